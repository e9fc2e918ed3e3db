//! Columns that a period's own noise has not touched.
//!
//! Noise in a torque moves the robot within the period, and so is in the mean speed and the mean acceleration of that period. Where a column is linear in both
//! (rigid body, viscous friction, rotor inertia) the log-determinant of the likelihood accounts for it exactly. Where it is not (a friction that turns with the sign),
//! nothing simple does: near a reversal the sign is the noise's own, and the slope of a column that turns within 0.01 rad/s can not be told from an instant of many rows. Such a
//! column is taken of what was known when the period began: then its product with the noise is nothing on average, whatever its form.

use crate::{CurriculumError, Measured};
use phiw_identification::Design;
use phiw_regressor::factor::FactorBuilder;
use phiw_regressor::least_squares::{Group, GroupedFactor};
use phiw_telemetry::Block;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// States in which columns are probed, and how far \[rad/s, rad/s²\].
const STATES: u64 = 3;
const REACH: [f64; 2] = [1.0, 5.0];
/// When they are \[s\]: a column that changes with time is not linear either, since an instant that stands for many rows has no time.
const MOMENTS: [f64; 4] = [0.0, 0.7, 1.9, 4.1];
/// Largest position of a joint without limits \[rad, m\].
const TURN: f64 = std::f64::consts::PI;
/// A motion on which columns are tried that may look ahead: the row that is looked at, and all rows; time between them \[s\], and how it swings.
const LOOKED_AT: [usize; 2] = [20, 40];
const PERIOD_S: f64 = 0.01;
const SWING_RAD_PER_S: f64 = 5.0;
/// What rounding leaves of a sum, over its terms.
const ROUNDING: f64 = 1e-9;

/// For each parameter, whether its columns are taken of the beginning of a period: those of effects, unless they are linear in speed and acceleration and
/// depend on one of them. (A torque of the position alone is so as well: what half a period of noise adds to a position is little, but a ripple is steep.)
///
/// # Errors
/// None that a design can cause.
pub(super) fn foreseen(design: &Design) -> Result<Vec<bool>, CurriculumError> {
    let rigid = design.base().count();
    let mut foreseen: Vec<bool> = (0..design.parameter_count()).map(|parameter| parameter >= rigid).collect();
    if design.parameter_count() == rigid {
        return Ok(foreseen);
    }
    let mut moving = vec![false; foreseen.len()];
    let mut linear = vec![true; foreseen.len()];
    let mut random = ChaCha8Rng::seed_from_u64(0);
    let mut scratch = design.scratch();
    for _ in 0..STATES {
        let (position, [one, other]) = state(design, &mut random);
        let sum = [0, 1].map(|signal| one[signal].iter().zip(&other[signal]).map(|(a, b)| a + b).collect());
        let still = one.each_ref().map(|values| vec![0.0; values.len()]);
        let mut rows = Vec::with_capacity(4);
        for ([velocity, acceleration], t) in [still, one, other, sum].into_iter().zip(MOMENTS) {
            // Each by itself: they do not follow each other in time.
            let joints = position.len();
            let signals = [position.clone(), velocity, acceleration];
            let mut block = Block::unfiltered(joints, vec![t], signals, vec![0.0; joints]);
            design.correct(&mut block);
            let mut row = vec![0.0; design.evaluation_width()];
            scratch.begin(&block)?;
            scratch.evaluate(&block, 0, &mut row)?;
            rows.push(row);
        }
        for layout in design.rows() {
            for (column, &parameter) in layout.parameters.iter().enumerate() {
                let [still, one, other, sum] =
                    [0, 1, 2, 3].map(|row: usize| rows[row][layout.range.start + column]);
                let largest = still.abs().max(one.abs()).max(other.abs()).max(sum.abs());
                moving[parameter] |= (one - still).abs() > ROUNDING * largest;
                linear[parameter] &= (sum - one - other + still).abs() <= ROUNDING * largest;
            }
        }
    }
    // What looks ahead can not be foreseen: a delay's rate of change has the noise of the next period in it, whenever it is taken.
    let ahead = looking_ahead(design)?;
    for parameter in rigid..foreseen.len() {
        foreseen[parameter] = !(moving[parameter] && linear[parameter] || ahead[parameter]);
    }
    Ok(foreseen)
}

/// For each parameter, whether its columns of a row change with what comes after the row.
///
/// # Errors
/// None that a design can cause.
pub(super) fn looking_ahead(design: &Design) -> Result<Vec<bool>, CurriculumError> {
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let (middle, [[speed, _], _]) = state(design, &mut random);
    let joints = middle.len();
    let [looked, rows] = LOOKED_AT;
    // Swings about one posture.
    let at = |index: usize| (index % joints, SWING_RAD_PER_S * PERIOD_S * (index / joints) as f64);
    let signal = |value: &dyn Fn(usize, f64) -> f64| -> Vec<f64> {
        (0..rows * joints).map(at).map(|(joint, phase)| value(joint, phase)).collect()
    };
    let signals = [
        signal(&|joint, phase| middle[joint] + speed[joint] / SWING_RAD_PER_S * phase.sin()),
        signal(&|joint, phase| speed[joint] * phase.cos()),
        signal(&|joint, phase| -speed[joint] * SWING_RAD_PER_S * phase.sin()),
    ];
    let torque = signal(&|joint, phase| (phase + joint as f64).sin());
    let mut evaluated = Vec::with_capacity(2);
    for length in [looked + 1, rows] {
        let count = length * joints;
        let t = (0..length).map(|row| PERIOD_S * row as f64).collect();
        let signals = signals.each_ref().map(|signal| signal[..count].to_vec());
        let mut block = Block::unfiltered(joints, t, signals, torque[..count].to_vec());
        design.correct(&mut block);
        let (mut scratch, mut row) = (design.scratch(), vec![0.0; design.evaluation_width()]);
        scratch.begin(&block)?;
        for sample in 0..=looked {
            scratch.evaluate(&block, sample, &mut row)?;
        }
        evaluated.push(row);
    }
    let mut ahead = vec![false; design.parameter_count()];
    for layout in design.rows() {
        for (column, &parameter) in layout.parameters.iter().enumerate() {
            let [one, other] = [0, 1].map(|which: usize| evaluated[which][layout.range.start + column]);
            ahead[parameter] |= (one - other).abs() > ROUNDING * one.abs().max(other.abs());
        }
    }
    Ok(ahead)
}

/// Positions within the limits, and twice velocities and accelerations.
fn state(design: &Design, random: &mut ChaCha8Rng) -> (Vec<f64>, [[Vec<f64>; 2]; 2]) {
    let tree = design.tree();
    let joints = tree.joint_count();
    let position = (0..joints).map(|joint| {
        let limits = tree.joint(joint).limits;
        let (lower, upper) = (limits.lower.max(-TURN), limits.upper.min(TURN));
        lower + (upper - lower).max(0.0) * random.random::<f64>()
    });
    let position = position.collect();
    let mut draw = |reach: f64| (0..joints).map(|_| reach * random.random_range(-1.0..1.0)).collect();
    (position, [0, 1].map(|_| REACH.map(&mut draw)))
}

/// Rows of a log over its periods, columns of foreseen parameters taken of the periods' beginnings, `[row × evaluation width]`, one after the other to
/// `take`.
///
/// # Errors
/// The log is not of this robot; what `take` returns.
pub(super) fn rows(
    design: &Design,
    foreseen: &[bool],
    measured: &Measured,
    mut take: impl FnMut(&[f64]) -> Result<(), CurriculumError>,
) -> Result<(), CurriculumError> {
    let (mut block, mut begun) = (measured.over_periods(), measured.begun());
    design.correct(&mut block);
    design.correct(&mut begun);
    let (mut scratch, mut begun_scratch) = (design.scratch(), design.scratch());
    scratch.begin(&block)?;
    begun_scratch.begin(&begun)?;
    let mut row = vec![0.0; design.evaluation_width()];
    let mut begun_row = row.clone();
    for sample in 0..block.len() {
        scratch.evaluate(&block, sample, &mut row)?;
        begun_scratch.evaluate(&begun, sample, &mut begun_row)?;
        for layout in design.rows() {
            let start = layout.range.start;
            let columns = layout.parameters.iter().enumerate().filter(|(_, parameter)| foreseen[**parameter]);
            columns.for_each(|(column, _)| row[start + column] = begun_row[start + column]);
        }
        take(&row)?;
    }
    Ok(())
}

/// The factors of these rows, one for each torque.
///
/// # Errors
/// The log is not of this robot.
pub(super) fn factor(
    design: &Design,
    foreseen: &[bool],
    measured: &Measured,
) -> Result<GroupedFactor, CurriculumError> {
    let mut builders: Vec<FactorBuilder> =
        design.rows().iter().map(|layout| FactorBuilder::new(layout.range.len())).collect();
    rows(design, foreseen, measured, |row| {
        for (builder, layout) in builders.iter_mut().zip(design.rows()) {
            builder.push_row(&row[layout.range.clone()])?;
        }
        Ok(())
    })?;
    let group = |(builder, layout): (&mut FactorBuilder, &phiw_identification::RowLayout)| Group {
        parameters: layout.parameters.clone(),
        factor: builder.factor(),
    };
    let groups = builders.iter_mut().zip(design.rows()).map(group).collect();
    Ok(GroupedFactor::new(design.parameter_count(), groups)?)
}
