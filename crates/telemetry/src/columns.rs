//! From a header line to the columns that are used.

use crate::LogError;
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
    pub fn prefix(self) -> &'static str {
        match self {
            Optional::Velocity => "qd.",
            Optional::Acceleration => "qdd.",
            Optional::Temperature => "temp.",
        }
    }
}

/// The used columns of one file.
#[derive(Debug, Clone)]
pub(crate) struct Columns {
    pub layout: Layout,
    /// Column of each place of the layout.
    pub of_place: Vec<usize>,
    /// All names in the header, in order.
    pub names: Vec<String>,
    /// Names of columns that are not used.
    pub ignored: Vec<String>,
}

impl Columns {
    /// # Errors
    /// A column that is missing or there twice.
    pub fn from_header(
        path: &Path,
        names: Vec<String>,
        joints: &[String],
        torque: TorqueColumns,
    ) -> Result<Self, LogError> {
        let find = |name: &str| names.iter().position(|candidate| candidate == name);
        let Some(t) = find("t") else {
            return Err(LogError::NoTimeColumn { path: path.into(), hint: time_hint(&names) });
        };
        let has_torque = match torque {
            TorqueColumns::Required => true,
            TorqueColumns::Optional => joints.iter().any(|joint| find(&format!("tau.{joint}")).is_some()),
            TorqueColumns::Absent => false,
        };
        let mut of_place = vec![t];
        let mut missing = Vec::new();
        for prefix in ["q.", "tau."].iter().take(1 + usize::from(has_torque)) {
            for joint in joints {
                let name = format!("{prefix}{joint}");
                match find(&name) {
                    Some(column) => of_place.push(column),
                    None => missing.push(name),
                }
            }
        }
        if !missing.is_empty() {
            let nearest = nearest(&missing[0], &names);
            return Err(LogError::MissingColumn { path: path.into(), missing, nearest });
        }
        let optional =
            |signal: Optional, joint: usize| find(&format!("{}{}", signal.prefix(), joints[joint]));
        let layout = Layout::new(joints.len(), has_torque, |signal, joint| optional(signal, joint).is_some());
        for signal in [Optional::Velocity, Optional::Acceleration, Optional::Temperature] {
            of_place.extend((0..joints.len()).filter_map(|joint| optional(signal, joint)));
        }
        for &column in &of_place {
            if names.iter().filter(|name| **name == names[column]).count() > 1 {
                return Err(LogError::DuplicateColumn { path: path.into(), column: names[column].clone() });
            }
        }
        let ignored = (0..names.len())
            .filter(|column| !of_place.contains(column))
            .map(|column| names[column].clone())
            .collect();
        Ok(Columns { layout, of_place, names, ignored })
    }
}

fn time_hint(names: &[String]) -> String {
    let spelled = |name: &&String| {
        let plain = name.to_lowercase();
        ["t", "time", "timestamp", "stamp", "time_s", "t_s", "time [s]", "t [s]"].contains(&plain.as_str())
    };
    if let [only] = names
        && let Some(separator) = [';', '\t'].into_iter().find(|&separator| only.contains(separator))
    {
        return format!("the header is separated by {separator:?}; separate the columns by commas");
    }
    if names.iter().any(|name| name.parse::<f64>().is_ok()) {
        return "the first line must be a header with the columns' names".into();
    }
    match names.iter().find(spelled) {
        Some(name) => format!("rename `{name}` if that is it, in seconds"),
        None => "add one".into(),
    }
}

/// Up to three names like `wanted`, best first.
fn nearest(wanted: &str, names: &[String]) -> Vec<String> {
    let mut scored: Vec<(f64, &String)> = names
        .iter()
        .map(|name| (strsim::jaro_winkler(&wanted.to_lowercase(), &name.to_lowercase()), name))
        .collect();
    scored.sort_by(|a, b| b.0.total_cmp(&a.0));
    scored.iter().filter(|(score, _)| *score > 0.7).take(3).map(|(_, name)| (*name).clone()).collect()
}
