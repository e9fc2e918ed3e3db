//! How a noise in the torque moves the robot, as a linear function of the parameters.

use super::turning::Turned;
use super::{Evidence, Instant};
use crate::EstimationError;
use crate::free_directions::free_directions;
use faer::Mat;
use phiw_identification::Design;
use phiw_identification::effect::VelocitySum;
use phiw_telemetry::Block;

/// Change of speed for a central difference \[rad/s, m/s\]. Any is exact for Coriolis' terms, which are
/// quadratic, and for viscous friction. Of a friction that turns with the sign it takes the mean slope over
/// speeds that noise reaches within a period: an instant stands for the rows around it.
const SPEED_STEP: f64 = 0.1;

/// How the torque of an instant depends on the motion: inertia A = Σ w_k·A_k = ∂τ/∂q̈ and damping T·F = Σ
/// w_k·T·F_k = T·∂τ/∂q̇. Only the symmetric parts are kept: what Coriolis' term adds beside them is a
/// thousandth.
///
/// Where bodies stand still, they are those of the directions N that are left: Nᵀ·A·N.
pub(super) struct Sensitivity {
    /// Rows that it stands for.
    pub weight: f64,
    /// Number n of directions: all joints, or those that the standing bodies leave.
    pub directions: usize,
    /// `packed(n)` × parameters: the lower triangle of each A_k, elements beside the diagonal times √2, so
    /// that products of columns are traces of products.
    pub inertia: Mat<f64>,
    /// The same of each T·F_k.
    pub damping: Mat<f64>,
    /// For each joint, what it moves by with each of the directions.
    pub toward: Vec<Vec<f64>>,
    /// Slopes of frictions that turn in the rows that it stands for.
    pub turned: Turned,
}

/// Numbers in the lower triangle of an n × n matrix.
pub(super) fn packed(n: usize) -> usize {
    n * (n + 1) / 2
}

/// Place of an element of the lower triangle.
pub(super) fn place(row: usize, column: usize) -> usize {
    row * (row + 1) / 2 + column
}

/// The element of a symmetric matrix in a packed column, in which the elements beside the diagonal are times
/// √2; `row` ≥ `column`.
pub(super) fn element(packed: &[f64], row: usize, column: usize) -> f64 {
    let scale = if row == column { 1.0 } else { std::f64::consts::FRAC_1_SQRT_2 };
    scale * packed[place(row, column)]
}

impl Sensitivity {
    /// By evaluating the design's columns around the instant: exact in the acceleration, in which they are
    /// linear. `standing` bodies do not move. Columns that `foreseen` has are of the period's beginning, and
    /// do not move with its noise, but for those that are `turned`.
    pub fn of(
        design: &Design,
        (instant, turned): (&Instant, &Turned),
        standing: &[usize],
        foreseen: impl Fn(usize) -> bool,
    ) -> Result<Self, EstimationError> {
        let directions = match standing {
            [] => Mat::identity(instant.state[0].len(), instant.state[0].len()),
            bodies => free_directions(design.tree(), bodies, &instant.state[0])?,
        };
        let (joints, n) = (directions.nrows(), directions.ncols());
        let states = around(&directions, instant);
        let mut scratch = design.scratch();
        let mut rows = vec![vec![0.0; design.evaluation_width()]; states.len()];
        for (state, row) in states.into_iter().zip(&mut rows) {
            // Each by itself: they do not follow each other in time.
            let mut block = Block::unfiltered(joints, vec![0.0], state, Vec::new());
            design.correct(&mut block);
            scratch.begin(&block)?;
            scratch.evaluate(&block, 0, row)?;
        }
        let [mut inertia, mut damping] = [0; 2].map(|_| Mat::zeros(packed(n), design.parameter_count()));
        for (torque, layout) in design.rows().iter().enumerate() {
            let columns =
                layout.parameters.iter().enumerate().filter(|(_, parameter)| !foreseen(**parameter));
            for (column, &parameter) in columns {
                let at = layout.range.start + column;
                for moved in 0..n {
                    let by_acceleration = rows[1 + moved][at] - rows[0][at];
                    let by_velocity =
                        (rows[1 + n + moved][at] - rows[1 + 2 * n + moved][at]) / (2.0 * SPEED_STEP);
                    for along in (0..n).filter(|&along| directions[(torque, along)] != 0.0) {
                        // Half of A + Aᵀ; √2 for what stands for two elements.
                        let scale = if along == moved { 1.0 } else { 0.5 * std::f64::consts::SQRT_2 };
                        let (to, share) =
                            (place(along.max(moved), along.min(moved)), directions[(torque, along)]);
                        inertia[(to, parameter)] += scale * share * by_acceleration;
                        damping[(to, parameter)] += scale * share * instant.period_s * by_velocity;
                    }
                }
            }
        }
        let toward = |joint: usize| (0..n).map(|direction| directions[(joint, direction)]).collect();
        let toward = (0..joints).map(toward).collect();
        Ok(Sensitivity {
            weight: instant.weight,
            directions: n,
            inertia,
            damping,
            toward,
            turned: turned.clone(),
        })
    }

    /// What an axis moves by with each of the directions.
    pub fn toward(&self, axis: &VelocitySum) -> Vec<f64> {
        let along = |direction: usize| {
            axis.terms.iter().map(|&(joint, factor)| factor * self.toward[joint][direction]).sum()
        };
        (0..self.directions).map(along).collect()
    }

    /// Those of all instants.
    pub fn all(
        design: &Design,
        evidence: &Evidence,
        standing: &[usize],
    ) -> Result<Vec<Self>, EstimationError> {
        let foreseen = |parameter: usize| evidence.is_foreseen(parameter);
        let nothing = Turned::default();
        let of = |(index, instant): (usize, &Instant)| {
            Self::of(design, (instant, evidence.turned.get(index).unwrap_or(&nothing)), standing, foreseen)
        };
        evidence.instants().iter().enumerate().map(of).collect()
    }
}

/// The instant, then the acceleration one up along each direction, then the velocity a step up, then a step
/// down.
fn around(directions: &Mat<f64>, instant: &Instant) -> Vec<[Vec<f64>; 3]> {
    let with = |signal: usize, direction: usize, change: f64| {
        let mut state = instant.state.clone();
        let along = directions.col_as_slice(direction);
        state[signal].iter_mut().zip(along).for_each(|(value, share)| *value += change * share);
        state
    };
    let moved = [(2, 1.0), (1, SPEED_STEP), (1, -SPEED_STEP)];
    let changed = moved.iter().flat_map(|&(signal, change)| {
        (0..directions.ncols()).map(move |direction| (signal, direction, change))
    });
    let changed = changed.map(|(signal, direction, change)| with(signal, direction, change));
    std::iter::once(instant.state.clone()).chain(changed).collect()
}
