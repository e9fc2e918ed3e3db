//! What a constraint that counts uncertainty is asked for.

use statrs::function::erf::erfc_inv;

/// How the balance of a motion is judged under a belief that is not certain.
///
/// From the distance of the ZMP to each edge of the support k standard deviations of the ZMP are taken. They
/// count the belief's covariance, what no torque tells of the bodies, and the noise that moves the robot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FalseFalls {
    /// The rate that is asked for: the probability with which a motion that is allowed leaves the support,
    /// if the errors are normal. k is the normal quantile of it, 3.09 for the default of 10⁻³: a fall costs
    /// more than a thousand motions that were not the best ones.
    pub rate: f64,
    /// Standard deviation of the first belief over the magnitude of each body's parameters, where nothing
    /// has been measured and in what no torque feels ([`phiw_estimation::ParameterPrior`]). Default: 0.577,
    /// anything between nothing and twice the truth, as in the paper.
    pub belief_share: f64,
    /// The same for the link that stands on the floor, which is declared. Default: 0, weighed and measured.
    pub base_link_share: f64,
    /// Standard deviation of the noise of torques over their limits while no log has told it. Default: 0.02;
    /// drives deliver their torque to some percent.
    pub unmeasured_noise: f64,
    /// Time for which a command is held \[s\]. Default: 0.01, as in the paper.
    pub control_period_s: f64,
    /// Time between the instants at which the uncertainty is computed \[s\]; between them it is that of the
    /// nearest. Shorter costs time. Default: 0.2, since postures change slowly against it.
    pub instant_every_s: f64,
}

impl Default for FalseFalls {
    fn default() -> Self {
        FalseFalls {
            rate: 1e-3,
            belief_share: 0.577_350_269_189_625_8,
            base_link_share: 0.0,
            unmeasured_noise: 0.02,
            control_period_s: 0.01,
            instant_every_s: 0.2,
        }
    }
}

impl FalseFalls {
    /// The default with another rate.
    pub fn at_rate(rate: f64) -> Self {
        FalseFalls { rate, ..FalseFalls::default() }
    }

    /// k: how many standard deviations are taken from the margin. The normal distribution exceeds k of its
    /// standard deviations with the probability of the rate; 0 for a rate of a half or more.
    pub fn deviations(&self) -> f64 {
        let rate = self.rate.clamp(f64::MIN_POSITIVE, 0.5);
        std::f64::consts::SQRT_2 * erfc_inv(2.0 * rate)
    }
}
