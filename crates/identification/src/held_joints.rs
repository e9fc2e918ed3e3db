//! Logs without columns for joints that were held while they were recorded.

use crate::{BlockSource, IdentificationError};
use phiw_telemetry::{Block, LogError};
use std::ops::ControlFlow;

/// The blocks of a log of some of a robot's joints, as blocks of all of them: the others stand still where
/// they are held, and have no measured torque.
pub struct HeldJoints<'a> {
    source: &'a dyn BlockSource,
    /// For each joint of the robot its place in the log, or where it is held \[rad, m\].
    joints: Vec<Place>,
}

#[derive(Clone, Copy)]
enum Place {
    Logged(usize),
    Held(f64),
}

impl<'a> HeldJoints<'a> {
    /// A `source` of the joints `logged` for a robot of the joints `joints`; `held` says where the others
    /// stand \[rad, m\].
    ///
    /// # Errors
    /// A joint is neither logged nor held.
    pub fn new(
        source: &'a dyn BlockSource,
        logged: &[&str],
        joints: &[&str],
        held: &[(String, f64)],
    ) -> Result<Self, IdentificationError> {
        let place = |joint: &&str| {
            let logged = logged.iter().position(|other| other == joint).map(Place::Logged);
            let held = || held.iter().find(|(other, _)| other == joint).map(|(_, at)| Place::Held(*at));
            logged.or_else(held).ok_or_else(|| {
                let message = format!(
                    "joint `{joint}` moves in the model, but follows a joint that is held here; hold it, too: --hold {joint}"
                );
                IdentificationError::Model(message)
            })
        };
        Ok(HeldJoints { source, joints: joints.iter().map(place).collect::<Result<_, _>>()? })
    }

    fn spread(&self, mut block: Block) -> Block {
        let logged = block.joints;
        let spread = |values: &[f64], held: &dyn Fn(f64) -> f64| -> Vec<f64> {
            let of_joint = |row: &[f64], place: &Place| match *place {
                Place::Logged(joint) => row[joint],
                Place::Held(at) => held(at),
            };
            values
                .chunks_exact(logged.max(1))
                .flat_map(|row| self.joints.iter().map(move |place| of_joint(row, place)))
                .collect()
        };
        block.joints = self.joints.len();
        block.q = spread(&block.q, &|at| at);
        block.qd = spread(&block.qd, &|_| 0.0);
        block.qdd = spread(&block.qdd, &|_| 0.0);
        block.tau = spread(&block.tau, &|_| 0.0);
        block.temp = block.temp.map(|temp| spread(&temp, &|_| f64::NAN));
        block
    }
}

impl BlockSource for HeldJoints<'_> {
    fn stream(&self, sink: &mut dyn FnMut(Block) -> ControlFlow<()>) -> Result<(), LogError> {
        self.source.stream(&mut |block| sink(self.spread(block)))
    }

    fn goes_on(&self) -> Result<(), LogError> {
        self.source.goes_on()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn held_joints_stand_where_they_are_held() {
        let signals = [vec![1.0, 2.0], vec![3.0, 4.0], vec![5.0, 6.0]];
        let log = vec![Block::unfiltered(1, vec![0.0, 0.1], signals, vec![7.0, 8.0])];
        let held = [("a".to_owned(), 0.5)];
        let all = HeldJoints::new(&log, &["b"], &["a", "b"], &held).unwrap();
        let mut seen = Vec::new();
        all.blocks(&mut |block| seen.push(block)).unwrap();
        assert_eq!(seen[0].joints, 2);
        assert_eq!(seen[0].q, [0.5, 1.0, 0.5, 2.0]);
        assert_eq!(seen[0].qd, [0.0, 3.0, 0.0, 4.0]);
        assert_eq!(seen[0].tau, [0.0, 7.0, 0.0, 8.0]);
        assert!(HeldJoints::new(&log, &["b"], &["a", "b", "c"], &held).is_err());
    }
}
