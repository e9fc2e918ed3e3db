//! Windows reproduced, and how the error grows with the horizon.

use super::{Plant, PlantError, ReproductionSettings, Window};
use rayon::prelude::*;

/// How far a reproduction is from the log after some time.
#[derive(Clone, Debug, PartialEq)]
pub struct ErrorGrowth {
    /// Time since the windows' beginning \[s\].
    pub horizons: Vec<f64>,
    /// For each horizon and joint the RMS error of the position over the windows \[rad, m\]; an error of more
    /// than the joint's travel counts as that.
    pub rmse: Vec<Vec<f64>>,
    /// For each horizon the RMS over windows and joints of the error over the joint's travel.
    pub share_of_travel: Vec<f64>,
    /// For each horizon the windows in which some joint's error had exceeded its travel by then.
    pub lost: Vec<usize>,
    /// In closed loop, the RMS over windows, joints and time of the loop's torque over the measured one's
    /// RMS; zero in open loop.
    pub loop_torque_share: f64,
}

/// Reproduces each window with a plant of its own from `plant`, in parallel: from the measured state, under
/// the measured torque, and in closed loop with a PD loop about the log, whose gains follow from
/// `loop_inertia` (of each joint \[kg·m², kg\]). `travel` is each joint's in the logs \[rad, m\].
///
/// # Errors
/// A backend fails. That a motion diverges is no error: it is lost.
pub fn reproduce<'a>(
    plant: &(dyn Fn() -> Result<Plant<'a>, PlantError> + Sync),
    windows: &[Window],
    travel: &[f64],
    loop_inertia: Option<&[f64]>,
    settings: &ReproductionSettings,
) -> Result<ErrorGrowth, PlantError> {
    let count = (settings.window_s / settings.horizon_step_s).round().max(1.0) as usize;
    let horizons: Vec<f64> = (1..=count).map(|k| k as f64 * settings.horizon_step_s).collect();
    let work = |window: &Window| {
        let gains = loop_inertia.map(|inertia| Gains::new(inertia, settings.loop_frequency));
        Run { plant: plant()?, window, travel, gains, horizons: &horizons, settings }.reproduce()
    };
    let runs: Vec<Path> = windows.par_iter().map(work).collect::<Result<_, PlantError>>()?;
    let joints = travel.len();
    let mean = |of: &dyn Fn(&Path) -> f64| runs.iter().map(of).sum::<f64>() / runs.len().max(1) as f64;
    let rmse = |horizon: usize| {
        let of_joint = |joint: usize| mean(&|run| run.errors[horizon][joint].powi(2)).sqrt();
        (0..joints).map(of_joint).collect::<Vec<f64>>()
    };
    let share = |horizon: usize| {
        let squares = |run: &Path| {
            run.errors[horizon].iter().zip(travel).map(|(error, travel)| (error / travel).powi(2)).sum()
        };
        (mean(&squares) / joints.max(1) as f64).sqrt()
    };
    let lost =
        |horizon: usize| runs.iter().filter(|run| run.lost_from.is_some_and(|from| from <= horizon)).count();
    let ratio =
        |[loop_squares, squares]: [f64; 2]| if squares > 0.0 { (loop_squares / squares).sqrt() } else { 0.0 };
    Ok(ErrorGrowth {
        rmse: (0..count).map(rmse).collect(),
        share_of_travel: (0..count).map(share).collect(),
        lost: (0..count).map(lost).collect(),
        loop_torque_share: ratio([mean(&|run| run.torque_squares[0]), mean(&|run| run.torque_squares[1])]),
        horizons,
    })
}

/// Stiffness and damping of the loop about the log.
struct Gains {
    stiffness: Vec<f64>,
    damping: Vec<f64>,
}

impl Gains {
    fn new(inertia: &[f64], frequency: f64) -> Self {
        Gains {
            stiffness: inertia.iter().map(|inertia| inertia * frequency * frequency).collect(),
            damping: inertia.iter().map(|inertia| 2.0 * inertia * frequency).collect(),
        }
    }
}

struct Run<'a, 'b> {
    plant: Plant<'a>,
    window: &'b Window,
    travel: &'b [f64],
    gains: Option<Gains>,
    horizons: &'b [f64],
    settings: &'b ReproductionSettings,
}

/// What became of one window.
struct Path {
    /// For each horizon and joint, at most the joint's travel.
    errors: Vec<Vec<f64>>,
    /// The first horizon at which it is lost.
    lost_from: Option<usize>,
    /// Sums of squares of the loop's and of the measured torque.
    torque_squares: [f64; 2],
}

impl Run<'_, '_> {
    fn reproduce(mut self) -> Result<Path, PlantError> {
        let window = self.window;
        let n = window.joints;
        let (mut q, mut v) = (window.q[..n].to_vec(), window.qd[..n].to_vec());
        let (mut a, mut before) = (vec![0.0; n], vec![0.0; n]);
        let (mut torque, mut position, mut velocity) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
        let steps = (self.settings.horizon_step_s / self.settings.longest_step_s).ceil().max(1.0);
        let h = self.settings.horizon_step_s / steps;
        let mut path = Path { errors: Vec::new(), lost_from: None, torque_squares: [0.0; 2] };
        let mut step = 0_u64;
        for horizon in 0..self.horizons.len() {
            for _ in 0..steps as usize {
                if path.lost_from.is_some() {
                    break;
                }
                let at = step as f64 * h;
                window.interpolate(&window.tau, at, &mut torque);
                path.torque_squares[1] += torque.iter().map(|torque| torque * torque).sum::<f64>();
                if let Some(gains) = &self.gains {
                    window.interpolate(&window.q, at, &mut position);
                    window.interpolate(&window.qd, at, &mut velocity);
                    for joint in 0..n {
                        let pull = gains.stiffness[joint] * (position[joint] - q[joint])
                            + gains.damping[joint] * (velocity[joint] - v[joint]);
                        torque[joint] += pull;
                        path.torque_squares[0] += pull * pull;
                    }
                }
                match self.plant.accelerate(window.start + at, [&q, &v, &torque, &before], &mut a) {
                    Ok(()) => {}
                    // It has gone where there is no model.
                    Err(PlantError::NotPositiveDefinite) => path.lost_from = Some(horizon),
                    Err(error) => return Err(error),
                }
                if step == 0 {
                    before.copy_from_slice(&a);
                }
                // Beeman's method (1976): one acceleration a step, third order in the position.
                for joint in 0..n {
                    q[joint] += h * v[joint] + h * h / 6.0 * (4.0 * a[joint] - before[joint]);
                    v[joint] += 0.5 * h * (3.0 * a[joint] - before[joint]);
                }
                before.copy_from_slice(&a);
                step += 1;
            }
            window.interpolate(&window.q, self.horizons[horizon], &mut position);
            let errors: Vec<f64> = (0..n).map(|joint| (q[joint] - position[joint]).abs()).collect();
            let mut both = errors.iter().zip(self.travel);
            let is_lost = both.any(|(error, travel)| error.is_nan() || error > travel);
            if path.lost_from.is_none() && is_lost {
                path.lost_from = Some(horizon);
            }
            // Once it is lost, all of it is.
            let lost = path.lost_from.is_some();
            let counted = errors.iter().zip(self.travel);
            path.errors.push(counted.map(|(error, travel)| if lost { *travel } else { *error }).collect());
        }
        Ok(path)
    }
}
