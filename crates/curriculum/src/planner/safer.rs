//! Which safer motion would do where none is allowed: how much slower one would have to be.

use crate::CurriculumError;
use crate::constraint::{Believed, Constraint, Safety};
use crate::motion::{Motion, MotionDataset};
use phiw_estimation::Robot;

/// How many times slower motions are tried, least first; ten times slower, a motion is a row of postures.
const SLOWER: [f64; 5] = [1.5, 2.0, 3.0, 5.0, 10.0];

/// So many motions are tried: those that come nearest at their own speed. A slower motion takes longer to
/// look at.
const TRIED: usize = 12;

/// What to add to the motions, whose `safety` allows none of them, as the end of a sentence.
///
/// # Errors
/// The motions are not of this robot.
pub(super) fn in_words(
    constraint: &dyn Constraint,
    robot: &Robot,
    believed: &Believed<'_>,
    (dataset, safety): (&MotionDataset, &[Safety]),
) -> Result<String, CurriculumError> {
    let mut tried: Vec<(&Motion, f64)> =
        dataset.motions().iter().zip(safety.iter().map(|safety| safety.largest_reduction)).collect();
    tried.retain(|(motion, _)| motion.times_slower == 1.0);
    tried.sort_by(|(_, a), (_, b)| b.total_cmp(a));
    tried.truncate(TRIED);
    let mut nearest: Option<(&Motion, Safety)> = None;
    for times in SLOWER {
        let slower: Result<Vec<Motion>, CurriculumError> =
            tried.iter().map(|(motion, _)| motion.slower(times)).collect();
        let slower = MotionDataset::new(robot.tree().joint_count(), slower?)?;
        let safety = constraint.all(robot, believed, &slower)?;
        let reduction = |motion: &usize| safety[*motion].largest_reduction;
        let best = (0..safety.len()).max_by(|a, b| reduction(a).total_cmp(&reduction(b)));
        let Some(best) = best else { break };
        nearest = Some((tried[best].0, safety[best]));
        if reduction(&best) >= 0.0 {
            let name = &tried[best].0.name;
            return Ok(format!("{name} {times} times slower would stay on it (--slower {times})"));
        }
    }
    let most = SLOWER[SLOWER.len() - 1];
    Ok(match nearest {
        Some((motion, Safety { sure_margin_m, .. })) if sure_margin_m.is_finite() => format!(
            "even {most} times slower the nearest, {}, leaves it by {:.1} mm, so its postures do: add calmer motions \
             that stay nearer to the middle of the support, or start from a better model",
            motion.name,
            -1e3 * sure_margin_m
        ),
        _ => "add calmer motions, or start from a better model".to_owned(),
    })
}
