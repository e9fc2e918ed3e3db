//! The noise floor: what a right model would leave, from the sensors' noise alone.

use phiw_dynamics::{DimensionError, Tree, Workspace};
use phiw_identification::{BlockSource, IdentificationError};
use phiw_telemetry::{Conditioning, LogError, Survey};

/// Samples of the mass matrix over the logs.
const POSES: usize = 400;

/// Standard deviation of each torque's residual under a right model \[N·m, N\], after the filters.
///
/// Torque noise goes through the parallel filter. Position noise goes through the differentiating low-pass
/// and the parallel filter, then through the inertia: τ feels q̈'s noise by the mass matrix, which depends on
/// the pose and is averaged over the logs. `rotor_inertia` is what the effects add to its diagonal.
///
/// # Errors
/// A log cannot be read, or the conditioning does not fit it.
pub fn noise_floor(
    tree: &Tree,
    rotor_inertia: &[f64],
    surveys: &[Survey],
    conditioning: &Conditioning,
    sources: &[&dyn BlockSource],
) -> Result<Vec<f64>, IdentificationError> {
    let mut squares = SquaredMassMatrix::new(tree, rotor_inertia);
    let mut outcome = Ok(());
    each_pose(sources, sources.len(), &mut |q| {
        if outcome.is_ok() {
            outcome = squares.push(q);
        }
    })?;
    outcome?;
    floor_of(&squares.mean(), surveys, conditioning)
}

/// [`noise_floor`] with the mass matrix averaged over these [`poses`], one row of positions after another.
///
/// # Errors
/// The conditioning does not fit a log, or the poses are another robot's.
pub fn noise_floor_at(
    tree: &Tree,
    rotor_inertia: &[f64],
    surveys: &[Survey],
    conditioning: &Conditioning,
    poses: &[f64],
) -> Result<Vec<f64>, IdentificationError> {
    let mut squares = SquaredMassMatrix::new(tree, rotor_inertia);
    poses.chunks(tree.joint_count().max(1)).try_for_each(|q| squares.push(q))?;
    floor_of(&squares.mean(), surveys, conditioning)
}

fn floor_of(
    squares: &[f64],
    surveys: &[Survey],
    conditioning: &Conditioning,
) -> Result<Vec<f64>, IdentificationError> {
    let joints = surveys.first().map_or(0, |survey| survey.joints.len());
    let mut variance = vec![0.0; joints];
    let total: f64 = surveys.iter().map(Survey::duration).sum();
    for survey in surveys {
        let share = survey.duration() / total;
        let gains = gains(conditioning, survey)?;
        for joint in 0..joints {
            let torque = survey.joints[joint].torque.map_or(0.0, |torque| torque.noise_std);
            variance[joint] += share * (gains.torque * torque).powi(2);
            for (other, moved) in survey.joints.iter().enumerate() {
                let acceleration = gains.acceleration * moved.position_noise_std;
                variance[joint] += share * squares[joint * joints + other] * acceleration * acceleration;
            }
        }
    }
    Ok(variance.into_iter().map(f64::sqrt).collect())
}

struct Gains {
    /// Noise of the filtered torque over that of a sample.
    torque: f64,
    /// Noise of the filtered acceleration over that of a position sample \[1/s²\].
    acceleration: f64,
}

fn gains(conditioning: &Conditioning, survey: &Survey) -> Result<Gains, LogError> {
    let plan = conditioning.plan(survey)?;
    let parallel = plan.parallel.taps();
    let second = plan.kernel.taps(2);
    // The two filters one after the other are their convolution.
    let mut both = vec![0.0; parallel.len() + second.len() - 1];
    for (i, a) in parallel.iter().enumerate() {
        for (j, b) in second.iter().enumerate() {
            both[i + j] += a * b;
        }
    }
    let norm = |taps: &[f64]| taps.iter().map(|tap| tap * tap).sum::<f64>().sqrt();
    Ok(Gains { torque: norm(parallel), acceleration: norm(&both) })
}

/// Positions here and there in logs \[rad, m\], one row after another: some hundreds in each block of the
/// only log of a session, fewer where it has more `logs`, of which `sources` may be a part.
///
/// # Errors
/// A log cannot be read.
pub fn poses(sources: &[&dyn BlockSource], logs: usize) -> Result<Vec<f64>, IdentificationError> {
    let mut poses = Vec::new();
    each_pose(sources, logs, &mut |q| poses.extend_from_slice(q))?;
    Ok(poses)
}

fn each_pose(
    sources: &[&dyn BlockSource],
    logs: usize,
    take: &mut dyn FnMut(&[f64]),
) -> Result<(), LogError> {
    let of_block = (POSES / logs.max(1) / 4).max(1);
    for source in sources {
        source.blocks(&mut |block| {
            let step = (block.t.len() / of_block).max(1);
            (0..block.t.len()).step_by(step).for_each(|sample| take(&block.q[block.row(sample)]));
        })?;
    }
    Ok(())
}

/// The mean over poses of each squared entry of the mass matrix.
struct SquaredMassMatrix<'a> {
    tree: &'a Tree,
    rotor_inertia: &'a [f64],
    workspace: Workspace<f64>,
    matrix: Vec<f64>,
    sums: Vec<f64>,
    count: f64,
}

impl<'a> SquaredMassMatrix<'a> {
    fn new(tree: &'a Tree, rotor_inertia: &'a [f64]) -> Self {
        let entries = tree.joint_count() * tree.joint_count();
        let (matrix, sums) = (vec![0.0; entries], vec![0.0; entries]);
        SquaredMassMatrix { tree, rotor_inertia, workspace: Workspace::new(tree), matrix, sums, count: 0.0 }
    }

    fn push(&mut self, q: &[f64]) -> Result<(), DimensionError> {
        let joints = self.tree.joint_count();
        self.tree.mass_matrix(q, &mut self.workspace, &mut self.matrix)?;
        for joint in 0..joints {
            self.matrix[joint * joints + joint] += self.rotor_inertia[joint];
        }
        self.sums.iter_mut().zip(&self.matrix).for_each(|(sum, entry)| *sum += entry * entry);
        self.count += 1.0;
        Ok(())
    }

    fn mean(mut self) -> Vec<f64> {
        let count = self.count.max(1.0);
        self.sums.iter_mut().for_each(|sum| *sum /= count);
        self.sums
    }
}
