//! Training logs without the moments in which something else acted on the robot.

use crate::Error;
use crate::arguments::ExplainArguments;
use crate::session::Session;
use crate::warnings::file_name;
use phiw_identification::Data;
use phiw_identification::fitting::{Disturbance, DisturbanceSettings, disturbances};
use phiw_report::number::significant;
use phiw_residual::trace::Tracing;
use std::path::PathBuf;

/// The disturbances that traces have found, and in how many traces.
#[derive(Clone, Debug, Default)]
pub struct DisturbedLogs {
    found: Vec<(PathBuf, Disturbance)>,
    traces: usize,
}

/// Traces that seek disturbances: those that a larger one has hidden are found once it is left out.
const TRACES: usize = 3;

/// Disturbances that a warning names.
const MOST_NAMED: usize = 4;

impl DisturbedLogs {
    /// These and those that a trace has found beside; none if it found none. They are sought where what is
    /// left is more than noise.
    ///
    /// # Errors
    /// A log cannot be read any more.
    pub fn and_those_of(
        &self,
        session: &Session,
        data: &Data<'_>,
        tracing: &Tracing,
    ) -> Result<Option<Self>, Error> {
        let is_noise = tracing.remaining.joints.is_empty() && tracing.remaining.disturbances.is_empty();
        if is_noise || self.traces == TRACES {
            return Ok(None);
        }
        let (design, parameters) = (&tracing.model.design, &tracing.model.fit.parameters);
        let settings = DisturbanceSettings::default();
        let found = disturbances(design, parameters, &data.train, &data.sources, &settings)?;
        if found.is_empty() {
            return Ok(None);
        }
        let of_log = |found: Disturbance| Some((session.arguments.train.get(found.log)?.clone(), found));
        let found = self.found.iter().cloned().chain(found.into_iter().filter_map(of_log)).collect();
        Ok(Some(DisturbedLogs { found, traces: self.traces + 1 }))
    }

    /// The arguments of an `explain` that leaves them out.
    pub fn left_out_of(&self, arguments: &ExplainArguments) -> ExplainArguments {
        let mut without = arguments.clone();
        let of_logs = &mut without.session.in_memory.disturbed;
        of_logs.clear();
        for (log, found) in &self.found {
            of_logs.entry(log.clone()).or_default().push(found.stretch_s);
        }
        without
    }

    /// What a reader should know of them, if there are any.
    pub fn warning(&self, session: &Session) -> Option<String> {
        let in_words = |(log, found): &(PathBuf, Disturbance)| {
            let joint = |torque: &usize| session.tree.joint(*torque).joint.as_str();
            let joints: Vec<&str> = found.torques.iter().map(joint).collect();
            let [from, to] = found.stretch_s;
            format!(
                "{} from {from:.2} to {to:.2} s ({}, up to {} times what is usual)",
                file_name(log),
                joints.join(", "),
                significant(found.ratio, 2)
            )
        };
        let mut named: Vec<String> = self.found.iter().take(MOST_NAMED).map(in_words).collect();
        let more = self.found.len().saturating_sub(MOST_NAMED);
        if more > 0 {
            named.push(format!("{more} more"));
        }
        (!named.is_empty()).then(|| {
            format!(
                "something else acted on the robot (a push, a collision, a cable): {}; in the same states at other times \
                 nothing of it is left, and these stretches were left out of the training",
                named.join(", ")
            )
        })
    }
}
