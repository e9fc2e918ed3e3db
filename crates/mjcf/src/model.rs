//! What is written of a robot.

use phiw_dynamics::Tree;
use phiw_dynamics::inertia::Inertia;

/// What one joint has beside the bodies that it moves. The torque that it needs is
/// armature·q̈ + damping·q̇ + friction·sign(q̇) + stiffness·(q − spring_reference), and that of the bodies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointModel {
    /// Inertia that its own motion alone feels \[kg·m², kg\].
    pub armature: f64,
    /// \[N·m·s/rad, N·s/m\].
    pub damping: f64,
    /// \[N·m, N\].
    pub friction: f64,
    /// Speed within which the friction turns as tanh(q̇/width) does \[rad/s, m/s\]; zero where it turns at
    /// once.
    pub friction_width: f64,
    /// \[N·m/rad, N/m\].
    pub stiffness: f64,
    /// Where the spring is slack \[rad, m\].
    pub spring_reference: f64,
    /// Torque of the motor for each unit of its command.
    pub motor_gain: f64,
    /// Torque of the motor under no command \[N·m, N\].
    pub motor_bias: f64,
    /// Time from a command to its torque \[s\].
    pub motor_delay: f64,
}

impl Default for JointModel {
    /// Nothing, and a motor whose command is its torque.
    fn default() -> Self {
        JointModel {
            armature: 0.0,
            damping: 0.0,
            friction: 0.0,
            friction_width: 0.0,
            stiffness: 0.0,
            spring_reference: 0.0,
            motor_gain: 1.0,
            motor_bias: 0.0,
            motor_delay: 0.0,
        }
    }
}

/// A transmission that turns with a sum of two joints' positions, and brakes and loads both.
#[derive(Clone, Debug, PartialEq)]
pub struct FixedTendon {
    /// Its name.
    pub name: String,
    /// Two joints (0-based, as [`Tree::joint`]), each with the factor of its position.
    pub joints: [(usize, f64); 2],
    /// Inertia against the sum \[kg·m², kg\]. One of the joints must carry the other: MuJoCo leaves out what
    /// couples two branches.
    pub armature: f64,
    /// Damping of the sum \[N·m·s/rad, N·s/m\].
    pub damping: f64,
    /// Friction of the sum \[N·m, N\].
    pub friction: f64,
    /// Speed of the sum within which the friction turns \[rad/s, m/s\].
    pub friction_width: f64,
}

/// A robot as it is to be written.
#[derive(Clone, Debug)]
pub struct RobotModel<'a> {
    /// Bodies, with their inertial parameters, and joints.
    pub tree: &'a Tree,
    /// One for each joint that moves by itself.
    pub joints: Vec<JointModel>,
    /// What joints share.
    pub tendons: Vec<FixedTendon>,
    /// Lines of the comment at the head of the file.
    pub header: Vec<String>,
}

impl<'a> RobotModel<'a> {
    /// The bodies of a robot alone.
    pub fn new(tree: &'a Tree) -> Self {
        let joints = vec![JointModel::default(); tree.joint_count()];
        RobotModel { tree, joints, tendons: Vec::new(), header: Vec::new() }
    }
}

/// Links whose inertial parameters no real body has (their pseudo-inertia is not positive definite): MuJoCo
/// refuses a file with one.
pub fn impossible_bodies(tree: &Tree) -> Vec<String> {
    let bodies = tree.bodies().iter();
    let impossible = bodies.filter(|body| !Inertia::<f64>::from_parameters(&body.inertial).is_physical());
    impossible.map(|body| body.link.clone()).collect()
}
