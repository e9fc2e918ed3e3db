//! What a trace starts from.

use super::thresholds::Thresholds;
use phiw_dynamics::Tree;
use phiw_effects::{Catalogue, SignalRanges};
use phiw_identification::{Data, EffectSpec};
use phiw_regressor::factor::Factor;

/// What is sought, and when an effect is believed.
#[derive(Clone, Debug)]
pub struct TraceOptions {
    /// When an effect is believed.
    pub thresholds: Thresholds,
    /// Effects at most, refinements included: a bound for time and memory, far above what any robot has been
    /// found to lack.
    pub most_effects: usize,
    /// Torques whose residual is to be explained: what acts on none of them is no candidate. `None`: all.
    pub torques: Option<Vec<usize>>,
    /// Effects (kind and joints) that are no candidates, because they are known not to be there.
    pub excluded: Vec<EffectSpec>,
}

impl Default for TraceOptions {
    fn default() -> Self {
        TraceOptions {
            thresholds: Thresholds::default(),
            most_effects: 100,
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
    /// Standard deviation of each torque's residual when it was fitted \[N·m, N\].
    pub residual_std: Vec<f64>,
    /// What it left of each torque when it was identified, on motion held out, too \[N·m, N\]: an error that
    /// is no larger is no change.
    pub left: Vec<f64>,
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
