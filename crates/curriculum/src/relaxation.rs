//! How the constraint is relaxed from iteration to iteration: section 5.2.2.

use crate::constraint::Safety;

/// Gives the reduction coefficient α of each iteration.
pub trait Relaxation: Send + Sync {
    /// α of the first iteration, when nothing has been measured, from how safe the motions look.
    fn first(&self, motions: &[Safety]) -> f64;

    /// α of a later iteration.
    fn next(&self, learnt: &Learnt) -> f64;
}

/// How far a run has come, for a relaxation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Learnt {
    /// α of the first iteration.
    pub first_alpha: f64,
    /// cond(Φ) after the first measurement.
    pub first_condition_number: f64,
    /// cond(Φ) of all that has been measured.
    pub condition_number: f64,
    /// How sure the estimator was of the torques of all motions after the first measurement, and how sure it
    /// is now: see [`crate::IterationRecord::torque_uncertainty`]. None where it does not know.
    pub torque_uncertainty: Option<[f64; 2]>,
}

impl Learnt {
    /// From cond(Φ) and the torques' uncertainty after each iteration. None while nothing has been learnt:
    /// where cond was never finite, or is not now.
    pub fn of(
        first_alpha: f64,
        condition_numbers: &[Option<f64>],
        torque_uncertainties: &[Option<f64>],
    ) -> Option<Self> {
        let ends = |values: &[Option<f64>]| {
            let finite = |value: &Option<f64>| value.filter(|value| value.is_finite());
            Some([values.iter().find_map(finite)?, values.last().and_then(finite)?])
        };
        let [first_condition_number, condition_number] = ends(condition_numbers)?;
        let torque_uncertainty = ends(torque_uncertainties);
        Some(Learnt { first_alpha, first_condition_number, condition_number, torque_uncertainty })
    }
}

/// α stays what it is: somebody has chosen it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ConstantReduction(pub f64);

impl Relaxation for ConstantReduction {
    fn first(&self, _: &[Safety]) -> f64 {
        self.0
    }

    fn next(&self, _: &Learnt) -> f64 {
        self.0
    }
}

/// How α_max is chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Maximum {
    /// This value; the paper's robot has 0.74.
    Fixed(f64),
    /// Such that this share of the motions is allowed at first (rounded up): how the paper's 0.74 came about,
    /// with 0.05.
    Share(f64),
}

impl Maximum {
    /// α_max for these motions.
    fn of(self, motions: &[Safety]) -> f64 {
        match self {
            Maximum::Fixed(alpha) => alpha,
            Maximum::Share(share) => {
                let mut reductions: Vec<f64> =
                    motions.iter().map(|safety| safety.largest_reduction).collect();
                reductions.sort_by(|a, b| b.total_cmp(a));
                let wanted = (share * reductions.len() as f64).ceil().max(1.0) as usize;
                // The region can only shrink, and not beyond a point.
                reductions.get(wanted - 1).copied().unwrap_or(0.0).clamp(0.0, 1.0)
            }
        }
    }
}

/// How a is chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Scale {
    /// This value; the paper's robot has 2.5·10⁻⁴.
    Fixed(f64),
    /// Such that α of the second iteration is this share of α_max. cond has no natural scale: it depends on
    /// the robot and on the units of its parameters, and with a fixed a that suits another robot α never
    /// leaves α_max, or falls to 0 at once.
    Share(f64),
}

/// Equation (20): α = a·(cond(Φ) − b), but at most α_max.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ConditionRelaxation {
    /// α_max.
    pub maximum: Maximum,
    /// a.
    pub scale: Scale,
    /// b.
    pub bias: f64,
}

impl ConditionRelaxation {
    /// 5 % of the motions at first and b = 1, as in the paper; a by [`Scale::Share`] of 0.8, since the
    /// paper's a suits its own robot alone.
    pub const OF_THE_PAPER: Self =
        ConditionRelaxation { maximum: Maximum::Share(0.05), scale: Scale::Share(0.8), bias: 1.0 };
}

impl Default for ConditionRelaxation {
    /// [`Self::OF_THE_PAPER`].
    fn default() -> Self {
        Self::OF_THE_PAPER
    }
}

impl Relaxation for ConditionRelaxation {
    fn first(&self, motions: &[Safety]) -> f64 {
        self.maximum.of(motions)
    }

    fn next(&self, learnt: &Learnt) -> f64 {
        let scale = match self.scale {
            Scale::Fixed(scale) => scale,
            Scale::Share(share) => share * learnt.first_alpha / (learnt.first_condition_number - self.bias),
        };
        let alpha = scale * (learnt.condition_number - self.bias);
        // Without a finite cond nothing has been learnt.
        if alpha.is_nan() { learnt.first_alpha } else { alpha.clamp(0.0, learnt.first_alpha.max(0.0)) }
    }
}

/// Equation (20) with what the reduced support is a margin for in the place of cond(Φ): α = a·u, at most
/// α_max, where u is how uncertain the torques of the dataset's motions are
/// ([`crate::IterationRecord::torque_uncertainty`]).
///
/// A support is reduced because the ZMP of a motion is predicted by a model that may be wrong. cond(Φ) is a
/// poor measure of that: its σ_min is the one direction of w that is known least, which may be one that no
/// motion feels, and the ZMP neither. Of a robot with many such directions cond falls late or never, and α
/// stays at its second value however well the model predicts. The uncertainty of Φ·w over all motions, floor
/// wrenches included where the base floats, counts each direction as much as the motions feel it.
///
/// It needs an estimator that knows its covariance ([`phiw_estimation::MotionLikelihood`]); with others α stays at
/// α_max.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UncertaintyRelaxation {
    /// α_max.
    pub maximum: Maximum,
    /// α of the second iteration over α_max: a by [`Scale::Share`].
    pub share: f64,
}

impl Default for UncertaintyRelaxation {
    /// 5 % of the motions at first, and 0.8 of that α after the first measurement, as
    /// [`ConditionRelaxation`].
    fn default() -> Self {
        UncertaintyRelaxation { maximum: Maximum::Share(0.05), share: 0.8 }
    }
}

impl Relaxation for UncertaintyRelaxation {
    fn first(&self, motions: &[Safety]) -> f64 {
        self.maximum.of(motions)
    }

    fn next(&self, learnt: &Learnt) -> f64 {
        let Some([first, now]) = learnt.torque_uncertainty else { return learnt.first_alpha };
        let alpha = self.share * learnt.first_alpha * now / first;
        if alpha.is_nan() { learnt.first_alpha } else { alpha.clamp(0.0, learnt.first_alpha.max(0.0)) }
    }
}
