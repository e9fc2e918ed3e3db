//! Weights of the objective (15).

/// Weights of the terms of (15) and of what keeps it well-posed where markers say nothing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Weights {
    /// w_g: robot against human, for each sample \[m²\]. The paper's 100.
    pub correspondence: f64,
    /// w_η: control points beyond the joint limits \[rad²\]. The paper's 50.
    pub limits: f64,
    /// As `limits`, for velocities beyond theirs \[rad²/s²\]; zero leaves them out.
    pub velocity_limits: f64,
    /// Standard deviation of a marker \[m\], against which what is known beforehand is weighed: lengths ξ^h
    /// against those of adults, joints of the human against their rest.
    pub marker_deviation_m: f64,
    /// Robot joints away from zero \[rad²\], for each sample: decides where points leave a joint free.
    pub robot_posture: f64,
    /// Accelerations \[rad²/s⁴\], for each sample: bridges gaps.
    pub acceleration: f64,
}

impl Default for Weights {
    fn default() -> Self {
        Weights {
            correspondence: 100.0,
            limits: 50.0,
            velocity_limits: 0.0,
            marker_deviation_m: 0.005,
            robot_posture: 1e-6,
            acceleration: 1e-9,
        }
    }
}

/// The objective's value and its parts.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cost {
    /// ‖P^h − P^m‖² \[m²\].
    pub markers: f64,
    /// w_g ‖P^r − P^h‖².
    pub correspondence: f64,
    /// w_η η, and that of the velocities.
    pub limits: f64,
    /// What is known beforehand, posture and smoothness.
    pub prior: f64,
}

impl Cost {
    /// The sum.
    pub fn total(&self) -> f64 {
        self.markers + self.correspondence + self.limits + self.prior
    }
}
