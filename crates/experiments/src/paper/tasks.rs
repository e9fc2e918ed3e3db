//! The two tasks of the task-specific models.

use phiw_curriculum::constraint::{Believed, Constraint};
use phiw_curriculum::motion::MotionDataset;
use phiw_curriculum::relaxation::Relaxation;
use phiw_curriculum::{CurriculumError, unreliable_model};
use phiw_estimation::{Robot, RobotModel};
use std::collections::BTreeMap;

/// Initial models that are asked.
const INITIAL_MODELS: u64 = 20;

/// The paper's open and scoop where there are such. Else, as the paper chose them, two that could be selected
/// in the first iteration: of those motions that initial models allow, most belong to them.
///
/// # Errors
/// The motions are not of this robot.
pub fn two_tasks(
    robot: &Robot,
    truth: &RobotModel,
    dataset: &MotionDataset,
    constraint: &dyn Constraint,
    relaxation: &dyn Relaxation,
) -> Result<[String; 2], CurriculumError> {
    let mut counts: BTreeMap<&str, usize> =
        dataset.motions().iter().map(|motion| (motion.task.as_str(), 0)).collect();
    if ["open", "scoop"].iter().all(|task| counts.contains_key(task)) {
        return Ok(["open", "scoop"].map(str::to_owned));
    }
    for seed in 0..INITIAL_MODELS {
        let safety = constraint.all(robot, &Believed::unmeasured(&unreliable_model(truth, seed)), dataset)?;
        let alpha = relaxation.first(&safety);
        let motions = dataset.motions().iter().zip(&safety);
        for (motion, _) in motions.filter(|(_, safety)| safety.largest_reduction >= alpha) {
            *counts.entry(&motion.task).or_default() += 1;
        }
    }
    let mut names: Vec<(&str, usize)> = counts.into_iter().collect();
    names.sort_by_key(|&(name, count)| (std::cmp::Reverse(count), name));
    Ok([0, 1].map(|place| names.get(place).map_or_else(String::new, |(name, _)| (*name).to_owned())))
}
