//! What a trace starts from, and when it believes a candidate.

use phiw_dynamics::Tree;
use phiw_effects::{Catalogue, SignalRanges};
use phiw_identification::{Data, EffectSpec};
use phiw_regressor::factor::Factor;

/// When an effect is believed: the policy of a trace.
///
/// `cargo xtask undeclared` is what each of these numbers is held against: how often a name is wrong on a
/// right model, and what is missed.
#[derive(Clone, Debug)]
pub struct TraceOptions {
    /// Effects at most, refinements included: a bound for time and memory, far above what any robot has been
    /// found to lack.
    pub most_effects: usize,
    /// Probability of naming anything on a right model, for all candidates of a run together.
    pub false_name_probability: f64,
    /// Probability at which a refinement is in the model, if it were not there.
    pub false_refinement_probability: f64,
    /// Share of a torque's residual variance, where training motion is foretold from its other parts, that an
    /// effect on it must take away to have a name.
    pub least_share: f64,
    /// The same for an effect whose torque follows the same signal of the same joint as a simpler one of the
    /// model.
    pub least_share_of_kin: f64,
    /// Share of what the other effects took from the same torque that it must take: the form of an effect is
    /// never quite the catalogue's, and what mends it is no effect of its own.
    pub least_of_others: f64,
    /// What a form must take, as a share of the squares of the simpler that it is a form of, times what the
    /// simpler leaves over what is left with it. How exactly a sign turns is no effect of its own, and does
    /// not leave next to nothing. It was set by looking at single development cases, and no command prints
    /// the shares: right models reached 0.010 there, true forms 0.03 and more.
    pub least_of_simpler: f64,
    /// RMS of what an effect takes over the RMS of its torque, at least, to have a name.
    pub least_size: f64,
    /// A residual below this share of its torque (RMS) is as good as none: nothing is sought in it.
    pub negligible_share: f64,
    /// A residual over the noise floor by less than this factor is noise.
    pub floor_margin: f64,
    /// A residual below this share of its torque (RMS) is no structure: filters and encoders leave as much of
    /// a right model.
    pub structured_share: f64,
    /// Probability that a torque's residual of noise seems to follow any signal.
    pub false_structure_probability: f64,
    /// Residual over noise floor of one torque, over the same of the one nearest to its floor, from which on
    /// it is structure if its samples hang together (`structured_correlation`): the noise of a robot's
    /// sensors is of one colour, and raises all residuals over their floors alike.
    pub structured_ratio: f64,
    /// Correlation of a residual's samples a quarter to half a second apart, less what the filter gives to
    /// noise, from which on they hang together.
    pub structured_correlation: f64,
    /// Correlation of a residual's samples 2.5 s apart from which on it wanders, whatever it follows: noise
    /// of up to 1 s of correlation has less than a tenth.
    pub wander: f64,
    /// Torques whose residual is to be explained: what acts on none of them is no candidate. `None`: all.
    pub torques: Option<Vec<usize>>,
    /// Effects (kind and joints) that are no candidates, because they are known not to be there.
    pub excluded: Vec<EffectSpec>,
}

impl Default for TraceOptions {
    fn default() -> Self {
        TraceOptions {
            most_effects: 100,
            false_name_probability: 0.01,
            false_refinement_probability: 0.01,
            least_share: 0.2,
            least_share_of_kin: 0.75,
            least_of_others: 0.025,
            least_of_simpler: 0.02,
            least_size: 0.01,
            negligible_share: 0.005,
            floor_margin: 1.15,
            structured_share: 0.03,
            false_structure_probability: 0.05,
            structured_ratio: 8.0,
            structured_correlation: 0.3,
            wander: 0.5,
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
