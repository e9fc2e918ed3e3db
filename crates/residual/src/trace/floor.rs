//! The noise floor: what a right model would leave, from the sensors' noise alone.

use phiw_dynamics::{Tree, Workspace};
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
    let joints = tree.joint_count();
    let mut variance = vec![0.0; joints];
    let squares = mean_squared_mass_matrix(tree, rotor_inertia, sources)?;
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

fn mean_squared_mass_matrix(
    tree: &Tree,
    rotor_inertia: &[f64],
    sources: &[&dyn BlockSource],
) -> Result<Vec<f64>, IdentificationError> {
    let joints = tree.joint_count();
    let mut workspace = Workspace::new(tree);
    let mut matrix = vec![0.0; joints * joints];
    let mut sums = vec![0.0; joints * joints];
    let mut count = 0.0;
    let mut failure = None;
    for source in sources {
        source.blocks(&mut |block| {
            let step = (block.t.len() / (POSES / sources.len().max(1) / 4).max(1)).max(1);
            for sample in (0..block.t.len()).step_by(step) {
                if let Err(error) = tree.mass_matrix(&block.q[block.row(sample)], &mut workspace, &mut matrix)
                {
                    failure.get_or_insert(error);
                    return;
                }
                for joint in 0..joints {
                    matrix[joint * joints + joint] += rotor_inertia[joint];
                }
                sums.iter_mut().zip(&matrix).for_each(|(sum, entry)| *sum += entry * entry);
                count += 1.0;
            }
        })?;
    }
    if let Some(error) = failure {
        return Err(error.into());
    }
    sums.iter_mut().for_each(|sum| *sum /= f64::max(count, 1.0));
    Ok(sums)
}
