//! What a log says of the controller, beside what was measured.

use crate::log_rows::open_log_of;
use crate::map::Signal;
use crate::reader::{Row, Rows};
use crate::turns::WithoutTurns;
use crate::{LogError, LogSource, TorqueColumns};
use std::f64::consts::TAU;

/// A signal of the controller.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ControllerSignal {
    /// `qref.<joint>`, what it was asked for \[rad, m\].
    Reference,
    /// `tau_cmd.<joint>`, what it commanded \[N·m, N\].
    Command,
}

impl ControllerSignal {
    /// The signal in every row of a log, `[row × joint]`; a row that can't be used is one of NaN, so that
    /// rows are those of [`crate::Recording::read`]. None where no joint has the signal.
    ///
    /// # Errors
    /// The log can't be read, or the signal is there for some joints only.
    pub fn read(self, source: impl Into<LogSource>, joints: &[String]) -> Result<Option<Vec<f64>>, LogError> {
        let signal = match self {
            ControllerSignal::Reference => Signal::Reference,
            ControllerSignal::Command => Signal::Command,
        };
        let log = open_log_of(&source.into(), joints, (TorqueColumns::Optional, signal))?;
        let mut reader = WithoutTurns::new(log);
        let layout = reader.layout().clone();
        if !layout.torque {
            return Ok(None);
        }
        let (mut row, mut all, mut positions) = (vec![0.0; layout.width], Vec::new(), Vec::new());
        loop {
            match reader.next(&mut row)? {
                Row::Sample { .. } => {
                    all.extend_from_slice(&row[layout.tau()..][..joints.len()]);
                    positions.extend_from_slice(&row[layout.q()..][..joints.len()]);
                }
                Row::Gap { .. } => {
                    all.extend(joints.iter().map(|_| f64::NAN));
                    positions.extend(joints.iter().map(|_| f64::NAN));
                }
                Row::End => break,
            }
        }
        if self == ControllerSignal::Reference {
            run_on(&mut all, &positions, reader.counts());
        }
        Ok(Some(all))
    }
}

/// Puts the reference of a joint whose position has jumped by turns on the turn that the position is on.
fn run_on(reference: &mut [f64], positions: &[f64], turns: &[u64]) {
    for (index, (reference, position)) in reference.iter_mut().zip(positions).enumerate() {
        if turns[index % turns.len()] > 0 {
            *reference -= TAU * ((*reference - position) / TAU).round();
        }
    }
}
