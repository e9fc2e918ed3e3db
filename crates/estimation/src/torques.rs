//! The torques of a model along a motion.

use crate::EstimationError;
use phiw_identification::Design;
use phiw_telemetry::Block;

/// The torques that `parameters` give along a block, φ(q, q̇, q̈)·w of every `stride`-th sample \[N·m, N\],
/// `[sample × joint]`. The block is corrected as the effects of `design` have it.
///
/// # Errors
/// The block is not of this robot.
pub fn torques_along(
    design: &Design,
    parameters: &[f64],
    block: &mut Block,
    stride: usize,
) -> Result<Vec<f64>, EstimationError> {
    design.correct(block);
    let mut scratch = design.scratch();
    scratch.begin(block)?;
    let mut row = vec![0.0; design.evaluation_width()];
    let mut torques = Vec::new();
    for sample in 0..block.len() {
        // All of them in order, for effects with memory.
        scratch.evaluate(block, sample, &mut row)?;
        if sample % stride == 0 {
            torques.extend(design.rows().iter().map(|layout| layout.torque(&row, parameters)));
        }
    }
    Ok(torques)
}
