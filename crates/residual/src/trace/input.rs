//! What a trace starts from, and when it believes a candidate.

use phiw_dynamics::Tree;
use phiw_effects::{Catalogue, SignalRanges};
use phiw_identification::{Data, EffectSpec};
use phiw_regressor::factor::Factor;

/// When a candidate is believed.
#[derive(Clone, Debug)]
pub struct TraceOptions {
    /// Effects at most.
    pub most_effects: usize,
    /// Standard deviations (cluster-robust over the folds) that an effect must be from nothing.
    pub least_significance: f64,
    /// Share of a torque's held-out residual variance that an effect on it must take away at least.
    pub least_share: f64,
    /// Share of the variance that the effects found before took from the same torque, at least.
    pub least_of_others: f64,
    /// RMS of an effect over the RMS of its torque, at least.
    pub least_size: f64,
    /// A residual over the noise floor by less than this is noise.
    pub floor_margin: f64,
    /// Autocorrelation over 0.25 to 0.5 s from which a residual is structure: that of the declared model, and
    /// that of one to which effects were added. To say that an effect explains all asks for more than to say
    /// that nothing is missing.
    pub structured_correlation: [f64; 2],
    /// Residual over noise floor of one torque, over the same of the one nearest to its floor, from which it
    /// is structure: the noise of a robot's sensors is of one colour, and raises all residuals over their
    /// floors alike.
    pub structured_ratio: f64,
    /// RMS residual over the RMS of its torque from which it may be structure: filters and encoders leave as
    /// much of a right model. The second one is for torques on which effects act that were found, and those
    /// of the joints next to them, and for what follows the motion only: to say of a torque that it is
    /// explained asks for more.
    pub structured_share: [f64; 2],
    /// Torques whose residual is to be explained: what acts on none of them is no candidate. `None`: all.
    pub torques: Option<Vec<usize>>,
    /// Effects (kind and joints) that are no candidates, because they are known not to be there.
    pub excluded: Vec<EffectSpec>,
}

impl Default for TraceOptions {
    fn default() -> Self {
        TraceOptions {
            most_effects: 12,
            least_significance: 12.0,
            least_share: 0.2,
            least_of_others: 0.025,
            least_size: 0.01,
            floor_margin: 1.15,
            structured_correlation: [0.3, 0.2],
            structured_ratio: 8.0,
            structured_share: [0.01, 0.002],
            torques: None,
            excluded: Vec::new(),
        }
    }
}

/// A model whose parameters are known; what has changed since is sought.
pub struct HeldModel {
    /// What its fit knew, over `determined`.
    pub factor: Factor,
    /// The parameters that the factor's columns stand for.
    pub determined: Vec<usize>,
    /// Standard deviation of each torque's residual when it was fitted.
    pub residual_std: Vec<f64>,
}

/// What a trace starts from.
pub struct TraceInput<'a> {
    /// The robot.
    pub tree: &'a Tree,
    /// The effects to choose from.
    pub catalogue: &'a Catalogue,
    /// The logs.
    pub data: &'a Data<'a>,
    /// What the training logs cover.
    pub ranges: SignalRanges,
    /// The declared effects, constants chosen.
    pub declared: Vec<EffectSpec>,
    /// The declared model's parameters, fitted (or held).
    pub parameters: Vec<f64>,
    /// Standard deviation of each torque's residual under them \[N·m, N\].
    pub residual_std: Vec<f64>,
    /// The model that is held, if one is.
    pub held: Option<HeldModel>,
    /// Noise floor of each torque \[N·m, N\].
    pub noise_floor: Vec<f64>,
    /// Number of correlated rows that make one independent row: output rate over twice the parallel cut-off.
    pub rows_per_independent: f64,
}
