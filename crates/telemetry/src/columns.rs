//! From a header line to the columns that are used.

use crate::LogError;
use crate::map::{Expression, LogMap, Lookup, Signal};
use phiw_log_formats::Table;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Whether a log must have torque columns (`tau.<joint>`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum TorqueColumns {
    /// Every joint needs one.
    Required,
    /// Used if there are any; then every joint needs one.
    Optional,
    /// Not looked at.
    Absent,
}

/// Where each signal of a sample lies in a row `[t, q…, tau…, …]`; the same for logs and recordings.
///
/// Place 0 is the time; places of optional signals are per joint.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Layout {
    pub joints: usize,
    pub torque: bool,
    pub qd: Vec<Option<usize>>,
    pub qdd: Vec<Option<usize>>,
    pub temp: Vec<Option<usize>>,
    /// Values in a row, time included.
    pub width: usize,
}

impl Layout {
    pub fn new(joints: usize, torque: bool, has: impl Fn(Optional, usize) -> bool) -> Self {
        let mut width = 1 + joints * (1 + usize::from(torque));
        let mut places = |signal| {
            let mut place = |joint| {
                has(signal, joint).then(|| {
                    width += 1;
                    width - 1
                })
            };
            (0..joints).map(&mut place).collect::<Vec<_>>()
        };
        let (qd, qdd, temp) =
            (places(Optional::Velocity), places(Optional::Acceleration), places(Optional::Temperature));
        Layout { joints, torque, qd, qdd, temp, width }
    }

    /// Place of joint 0's position; the other joints follow.
    pub fn q(&self) -> usize {
        1
    }

    /// Place of joint 0's torque, if there is torque; the other joints follow.
    pub fn tau(&self) -> usize {
        1 + self.joints
    }

    /// Name of the column at `place`, of these joints.
    pub fn name(&self, place: usize, joints: &[String]) -> String {
        let joint =
            |prefix: &str, joint: usize| format!("{prefix}{}", joints.get(joint).map_or("", String::as_str));
        if place == 0 {
            return "t".to_owned();
        }
        if place <= self.joints {
            return joint("q.", place - 1);
        }
        if self.torque && place <= 2 * self.joints {
            return joint("tau.", place - 1 - self.joints);
        }
        let optional = [
            (Optional::Velocity, &self.qd),
            (Optional::Acceleration, &self.qdd),
            (Optional::Temperature, &self.temp),
        ];
        let found = optional.iter().find_map(|(signal, places)| {
            let index = places.iter().position(|candidate| *candidate == Some(place))?;
            Some(joint(signal.prefix(), index))
        });
        found.unwrap_or_default()
    }

    /// Whether a missing value at `place` leaves the sample usable. A temperature changes slowly and is often
    /// logged at a lower rate.
    pub fn may_be_missing(&self, place: usize) -> bool {
        self.temp.contains(&Some(place))
    }
}

/// The signals that a joint may have or not.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Optional {
    Velocity,
    Acceleration,
    Temperature,
}

impl Optional {
    fn signal(self) -> Signal {
        match self {
            Optional::Velocity => Signal::Velocity,
            Optional::Acceleration => Signal::Acceleration,
            Optional::Temperature => Signal::Temperature,
        }
    }

    pub fn prefix(self) -> &'static str {
        match self {
            Optional::Velocity => "qd.",
            Optional::Acceleration => "qdd.",
            Optional::Temperature => "temp.",
        }
    }
}

/// The used columns of one log.
#[derive(Debug, Clone)]
pub(crate) struct Columns {
    pub layout: Layout,
    /// How each place of the layout is computed from the log's columns.
    pub of_place: Vec<Expression>,
    /// Names of columns that are not used.
    pub ignored: Vec<String>,
    /// What was taken for what without being told.
    pub notes: Vec<String>,
}

impl Columns {
    /// `torque` says what is needed of the torques, and which signal stands in their place.
    ///
    /// # Errors
    /// A column that is missing or there twice, or a map that does not fit.
    pub fn find(
        path: &Path,
        table: &dyn Table,
        map: Option<&LogMap>,
        joints: &[String],
        (torque, torque_signal): (TorqueColumns, Signal),
    ) -> Result<Self, LogError> {
        let header = table.header();
        let lookup = Lookup { path, header: &header, columns: table.columns(), map, joints };
        let names: Vec<String> = table.columns().iter().map(|column| column.name.clone()).collect();
        let Some(t) = lookup.time()? else {
            return Err(LogError::NoTimeColumn { path: path.into(), header, hint: time_hint(&names) });
        };
        let all = |signal: Signal| {
            joints.iter().map(|joint| lookup.signal(signal, joint)).collect::<Result<Vec<_>, _>>()
        };
        let torques = match torque {
            TorqueColumns::Absent => vec![None; joints.len()],
            _ => all(torque_signal)?,
        };
        let has_torque = torque == TorqueColumns::Required || torques.iter().any(Option::is_some);
        let mut of_place = vec![t];
        let mut missing = Vec::new();
        let required = [(Signal::Position, all(Signal::Position)?), (torque_signal, torques)];
        for (signal, found) in required.into_iter().take(1 + usize::from(has_torque)) {
            for (joint, found) in joints.iter().zip(found) {
                match found {
                    Some(expression) => of_place.push(expression),
                    None => missing.push(format!("{}.{joint}", signal.name())),
                }
            }
        }
        if !missing.is_empty() {
            let nearest = nearest(&missing[0], &names);
            return Err(LogError::MissingColumn { path: path.into(), header, missing, nearest });
        }
        let optional = [Optional::Velocity, Optional::Acceleration, Optional::Temperature];
        let optional: Vec<(Optional, Vec<Option<Expression>>)> = optional
            .into_iter()
            .map(|signal| Ok((signal, all(signal.signal())?)))
            .collect::<Result<_, LogError>>()?;
        let layout = Layout::new(joints.len(), has_torque, |signal, joint| {
            optional.iter().any(|(other, found)| *other == signal && found[joint].is_some())
        });
        of_place.extend(optional.into_iter().flat_map(|(_, found)| found).flatten());
        let mut used = vec![false; names.len()];
        for expression in &mut of_place {
            expression.visit_columns(&mut |column| used[*column] = true);
        }
        let ignored = names.into_iter().zip(used).filter(|(_, used)| !used).map(|(name, _)| name).collect();
        let by_order = map.is_none() && lookup.is_array_of_joints(Signal::Position);
        let notes = by_order.then(|| {
            format!(
                "the entries of `q` were taken for the joints in the robot's order: {}",
                joints.join(", ")
            )
        });
        Ok(Columns { layout, of_place, ignored, notes: notes.into_iter().collect() })
    }
}

fn time_hint(names: &[String]) -> String {
    let spelled = |name: &&String| {
        let plain = name.to_lowercase();
        ["t", "time", "timestamp", "stamp", "time_s", "t_s", "time [s]", "t [s]"].contains(&plain.as_str())
    };
    if names.iter().any(|name| name.parse::<f64>().is_ok()) {
        return "the first line must be a header with the columns' names".into();
    }
    match names.iter().find(spelled) {
        Some(name) => {
            format!("rename `{name}` if that is it, in seconds, or name it in a map: time = \"{name}\"")
        }
        None => "add one".into(),
    }
}

/// Up to three names like `wanted`, best first.
pub(crate) fn nearest(wanted: &str, names: &[String]) -> Vec<String> {
    let mut scored: Vec<(f64, &String)> = names
        .iter()
        .map(|name| (strsim::jaro_winkler(&wanted.to_lowercase(), &name.to_lowercase()), name))
        .collect();
    scored.sort_by(|a, b| b.0.total_cmp(&a.0));
    scored.iter().filter(|(score, _)| *score > 0.7).take(3).map(|(_, name)| (*name).clone()).collect()
}
