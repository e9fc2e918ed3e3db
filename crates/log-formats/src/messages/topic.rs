//! A topic, and which one a log is.

use super::signals::RobotState;
use crate::{FormatError, OpenOptions};
use std::path::Path;

/// How messages are laid out in bytes.
#[derive(Debug, Clone, PartialEq, Eq)]
#[cfg_attr(
    not(feature = "mcap"),
    allow(dead_code, reason = "which occur depends on the readers that are built")
)]
pub(crate) enum Encoding {
    /// The Common Data Representation of the OMG: ROS 2.
    Cdr,
    /// ROS 1's own.
    Ros1,
    /// One that is not read.
    Other(String),
}

/// A topic of a recording.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Topic {
    pub name: String,
    /// Such as `sensor_msgs/msg/JointState`.
    pub type_name: String,
    /// The type's definition as text, with those that it uses.
    pub definition: Option<String>,
    pub encoding: Encoding,
}

impl Topic {
    fn in_words(&self) -> String {
        format!("{} ({})", self.name, self.type_name)
    }
}

/// The topic asked for, or the only one that says how joints are.
///
/// # Errors
/// There is no such topic, or more than one.
pub(crate) fn choose<'a>(
    path: &Path,
    topics: &'a [Topic],
    options: &OpenOptions,
) -> Result<&'a Topic, FormatError> {
    let listed = |topics: &[&Topic]| topics.iter().map(|topic| topic.in_words()).collect::<Vec<_>>();
    if let Some(wanted) = &options.topic {
        let found = topics.iter().find(|topic| topic.name == *wanted);
        return found.ok_or_else(|| FormatError::NoSuchTopic {
            path: path.into(),
            topic: wanted.clone(),
            topics: listed(&topics.iter().collect::<Vec<_>>()),
        });
    }
    for state in RobotState::ALL {
        let of_type: Vec<&Topic> =
            topics.iter().filter(|topic| RobotState::of_type(&topic.type_name) == Some(state)).collect();
        match of_type.as_slice() {
            [] => {}
            [only] => return Ok(only),
            several => {
                return Err(FormatError::WhichTopic { path: path.into(), topics: listed(several) });
            }
        }
    }
    match topics {
        [only] => Ok(only),
        [] => Err(FormatError::Empty { path: path.into() }),
        several => Err(FormatError::WhichTopic {
            path: path.into(),
            topics: listed(&several.iter().collect::<Vec<_>>()),
        }),
    }
}
