//! How a noise in the torque moves the robot, as a linear function of the parameters.

use super::Instant;
use crate::CurriculumError;
use faer::Mat;
use phiw_identification::Design;
use phiw_telemetry::Block;

/// Step of the speed for a central difference \[rad/s, m/s\].
const SPEED_STEP: f64 = 1e-3;

/// The matrices J_k of an instant: J = Σ w_k·J_k = ∂τ/∂q̈ + ½T·∂τ/∂q̇ is what a change of the mean acceleration over a period asks of the
/// torque, its share in the mean velocity counted. Only the symmetric part is kept: what Coriolis' term adds beside it is a
/// thousandth.
pub(super) struct Sensitivity {
    /// Rows that it stands for.
    pub weight: f64,
    /// `packed(n)` × parameters: the lower triangle of each J_k, elements beside the diagonal times √2, so that products of columns are
    /// traces of products.
    pub packed: Mat<f64>,
}

/// Numbers in the lower triangle of an n × n matrix.
pub(super) fn packed(n: usize) -> usize {
    n * (n + 1) / 2
}

/// Place of an element of the lower triangle.
pub(super) fn place(row: usize, column: usize) -> usize {
    row * (row + 1) / 2 + column
}

impl Sensitivity {
    /// By evaluating the design's columns around the instant: exact in the acceleration, in which they are linear.
    pub fn of(design: &Design, instant: &Instant) -> Result<Self, CurriculumError> {
        let n = instant.state[0].len();
        let block = around(n, instant);
        let mut scratch = design.scratch();
        scratch.begin(&block)?;
        let mut rows = vec![vec![0.0; design.evaluation_width()]; block.len()];
        for (sample, row) in rows.iter_mut().enumerate() {
            scratch.evaluate(&block, sample, row)?;
        }
        let mut packed_columns = Mat::zeros(packed(n), design.parameter_count());
        let half_period = 0.5 * instant.period_s;
        for (torque, layout) in design.rows().iter().enumerate() {
            for (column, &parameter) in layout.parameters.iter().enumerate() {
                let at = layout.range.start + column;
                for moved in 0..n {
                    let by_acceleration = rows[1 + moved][at] - rows[0][at];
                    let by_velocity =
                        (rows[1 + n + moved][at] - rows[1 + 2 * n + moved][at]) / (2.0 * SPEED_STEP);
                    let value = by_acceleration + half_period * by_velocity;
                    // Half of J + Jᵀ; √2 for what stands for two elements.
                    let scale = if torque == moved { 1.0 } else { 0.5 * std::f64::consts::SQRT_2 };
                    packed_columns[(place(torque.max(moved), torque.min(moved)), parameter)] += scale * value;
                }
            }
        }
        Ok(Sensitivity { weight: instant.weight, packed: packed_columns })
    }
}

/// The instant, then each acceleration one up, then each velocity a step up, then each a step down.
fn around(n: usize, instant: &Instant) -> Block {
    let [q, v, a] = &instant.state;
    let samples = 1 + 3 * n;
    let mut signals = [q, v, a].map(|signal| signal.repeat(samples));
    for moved in 0..n {
        signals[2][(1 + moved) * n + moved] += 1.0;
        signals[1][(1 + n + moved) * n + moved] += SPEED_STEP;
        signals[1][(1 + 2 * n + moved) * n + moved] -= SPEED_STEP;
    }
    let t = (0..samples).map(|sample| sample as f64 * instant.period_s).collect();
    Block::unfiltered(n, t, signals, Vec::new())
}

/// Cholesky's factor of a symmetric matrix in a packed column, elements beside the diagonal times √2: lower, row by row. None if it is not
/// positive definite.
pub(super) fn cholesky(n: usize, column: &[f64]) -> Option<Vec<f64>> {
    let mut lower = vec![0.0; packed(n)];
    for row in 0..n {
        for col in 0..=row {
            let scale = if row == col { 1.0 } else { std::f64::consts::FRAC_1_SQRT_2 };
            let mut sum = scale * column[place(row, col)];
            for k in 0..col {
                sum -= lower[place(row, k)] * lower[place(col, k)];
            }
            lower[place(row, col)] = if row != col {
                sum / lower[place(col, col)]
            } else if sum > 0.0 {
                sum.sqrt()
            } else {
                return None;
            };
        }
    }
    Some(lower)
}
