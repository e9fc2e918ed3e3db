//! Which fields of which types are signals of a log, by the types' definitions.

/// Types of messages that say how the joints of a robot are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum RobotState {
    /// `sensor_msgs/JointState`: rad, rad/s, N·m.
    JointState,
    /// `control_msgs/JointTrajectoryControllerState`, with the fields of either ROS.
    TrajectoryController,
}

impl RobotState {
    /// The likelier log first.
    pub const ALL: [RobotState; 2] = [RobotState::JointState, RobotState::TrajectoryController];

    /// Of a type's name, with or without `msg` in it.
    pub fn of_type(type_name: &str) -> Option<Self> {
        let package = type_name.split('/').next().unwrap_or_default();
        let name = type_name.rsplit('/').next().unwrap_or_default();
        match (package, name) {
            ("sensor_msgs", "JointState") => Some(RobotState::JointState),
            ("control_msgs", "JointTrajectoryControllerState") => Some(RobotState::TrajectoryController),
            _ => None,
        }
    }

    /// The signal's prefix in our own logs, for an array that has a value for each joint.
    pub fn signal(self, array: &str) -> Option<&'static str> {
        match self {
            RobotState::JointState => match array {
                "position" => Some("q."),
                "velocity" => Some("qd."),
                "effort" => Some("tau."),
                _ => None,
            },
            RobotState::TrajectoryController => match array {
                "feedback.positions" | "actual.positions" => Some("q."),
                "feedback.velocities" | "actual.velocities" => Some("qd."),
                "feedback.accelerations" | "actual.accelerations" => Some("qdd."),
                "feedback.effort" | "actual.effort" | "output.effort" => Some("tau."),
                "reference.positions" | "desired.positions" => Some("qref."),
                _ => None,
            },
        }
    }
}
