//! What is compared: the arms of the experiment.

use super::fourier::InOrder;
use phiw_curriculum::constraint::{Constraint, Unconstrained};
use phiw_curriculum::motion::MotionDataset;
use phiw_curriculum::selection::{
    Choice, Question, RandomMotion, Selection, SmallestCondition, TorqueOptimal, TorqueOptimalPerSecond,
};
use rand::{Rng, RngExt};
use serde::{Deserialize, Serialize};

/// One way to choose motions.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Arm {
    /// The smallest cond under the constraint: (11) and (12).
    Curriculum,
    /// The same, and after each iteration the residual is traced and what is found enters the model.
    Closed,
    /// Any motion under the constraint.
    Random,
    /// The smallest cond, whatever the constraint says.
    Greedy,
    /// The smallest uncertainty of the torques of all motions, under the constraint.
    TorqueOptimal,
    /// The largest fall of that uncertainty for each second of motion, under the constraint.
    TorquePerSecond,
    /// Periodic motions, optimised for a small cond with what the initial model says of the balance.
    FourierInitial,
    /// The same with what the true model says, which nobody has.
    FourierTrue,
    /// Any motion of one task that could be chosen at first: the paper's Open.
    TaskA,
    /// Any motion of another such task: the paper's Scoop.
    TaskB,
}

/// How the robot's base is held.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Footing {
    /// Bolted to the floor.
    Fixed,
    /// Standing on the floor, free to topple.
    Standing,
}

impl Arm {
    /// The name in file names and tables.
    pub fn name(self) -> &'static str {
        match self {
            Arm::Curriculum => "curriculum",
            Arm::Closed => "closed",
            Arm::Random => "random",
            Arm::Greedy => "greedy",
            Arm::TorqueOptimal => "torque-optimal",
            Arm::TorquePerSecond => "torque-per-second",
            Arm::FourierInitial => "fourier-initial",
            Arm::FourierTrue => "fourier-true",
            Arm::TaskA => "task-a",
            Arm::TaskB => "task-b",
        }
    }

    /// Who chooses.
    pub fn selection(self, dataset: &MotionDataset, tasks: &[String; 2]) -> Box<dyn Selection> {
        let of_task = |task: &String| {
            let motions = dataset.motions().iter().enumerate();
            let members = motions
                .filter(|(_, motion)| motion.task == *task && motion.times_slower == 1.0)
                .map(|(index, _)| index)
                .collect();
            Box::new(OfTask { members })
        };
        match self {
            Arm::Curriculum | Arm::Closed | Arm::Greedy => Box::new(SmallestCondition),
            Arm::Random => Box::new(RandomMotion),
            Arm::TorqueOptimal => Box::new(TorqueOptimal),
            Arm::TorquePerSecond => Box::new(TorqueOptimalPerSecond),
            Arm::FourierInitial | Arm::FourierTrue => Box::new(InOrder),
            Arm::TaskA => of_task(&tasks[0]),
            Arm::TaskB => of_task(&tasks[1]),
        }
    }

    /// What it may choose.
    pub fn constraint(self, zmp: &dyn Constraint) -> &dyn Constraint {
        match self {
            Arm::Curriculum | Arm::Closed | Arm::Random | Arm::TorqueOptimal | Arm::TorquePerSecond => zmp,
            // What was optimised has been held to the balance of its model already.
            Arm::FourierInitial | Arm::FourierTrue | Arm::Greedy | Arm::TaskA | Arm::TaskB => &Unconstrained,
        }
    }
}

impl Footing {
    /// The name in file names and tables.
    pub fn name(self) -> &'static str {
        match self {
            Footing::Fixed => "fixed",
            Footing::Standing => "standing",
        }
    }
}

/// Any motion of one task.
struct OfTask {
    members: Vec<usize>,
}

impl Selection for OfTask {
    fn name(&self) -> &'static str {
        "of_task"
    }

    fn choose(&self, question: &Question<'_>, rng: &mut dyn Rng) -> Choice {
        let open: Vec<usize> =
            question.allowed.iter().copied().filter(|motion| self.members.contains(motion)).collect();
        let from = if open.is_empty() { question.allowed } else { &open };
        Choice { motion: from[rng.random_range(0..from.len())], merit: None, runner_up: None }
    }
}
