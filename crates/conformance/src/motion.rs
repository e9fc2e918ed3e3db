//! Motions that joints are asked to make, and the controller that makes them.

use phiw_dynamics::{DimensionError, JointType, Tree, Workspace};
use std::f64::consts::TAU;

/// Natural frequency of the closed loop \[rad/s\]: low enough for a controller that acts every few
/// milliseconds.
const BANDWIDTH: f64 = 15.0;

/// Where all joints should be at one instant.
#[derive(Clone, Debug)]
pub(crate) struct Target {
    pub(crate) q: Vec<f64>,
    pub(crate) v: Vec<f64>,
    pub(crate) a: Vec<f64>,
}

impl Target {
    /// Standing still.
    pub(crate) fn still(q: Vec<f64>) -> Self {
        let zeros = vec![0.0; q.len()];
        Target { v: zeros.clone(), a: zeros, q }
    }
}

/// All joints on sines about the middle of their ranges, each with a frequency of its own, blended in over a
/// second.
#[derive(Clone, Debug)]
pub(crate) struct Swing {
    joints: Vec<Sine>,
}

#[derive(Clone, Debug)]
struct Sine {
    middle: f64,
    amplitude: f64,
    /// \[rad/s\]
    frequency: f64,
}

impl Swing {
    pub(crate) fn new(tree: &Tree) -> Self {
        let sine = |joint: usize| {
            let (lower, upper) = reach(tree, joint);
            Sine {
                middle: 0.5 * (lower + upper),
                amplitude: 0.2 * (upper - lower),
                frequency: TAU * (0.3 + 0.05 * (joint % 7) as f64),
            }
        };
        Swing { joints: (0..tree.joint_count()).map(sine).collect() }
    }

    pub(crate) fn at(&self, time: f64) -> Target {
        let [blend, rate, curvature] = smooth_step(time);
        let mut target = Target::still(self.joints.iter().map(|joint| joint.middle).collect());
        for (joint, &Sine { amplitude, frequency, .. }) in self.joints.iter().enumerate() {
            let (sine, cosine) = (frequency * time).sin_cos();
            target.q[joint] += amplitude * blend * sine;
            target.v[joint] = amplitude * (rate * sine + blend * frequency * cosine);
            target.a[joint] = amplitude
                * (curvature * sine + 2.0 * rate * frequency * cosine - blend * frequency * frequency * sine);
        }
        target
    }
}

/// From 0 at time 0 to 1 at time 1 with speed and acceleration zero at both ends; with its two derivatives.
pub(crate) fn smooth_step(time: f64) -> [f64; 3] {
    let t = time.clamp(0.0, 1.0);
    [
        t * t * t * (10.0 - 15.0 * t + 6.0 * t * t),
        30.0 * t * t * (1.0 - t) * (1.0 - t),
        60.0 * t * (1.0 - t) * (1.0 - 2.0 * t),
    ]
}

/// The part of a joint's range that the suite uses: a radian or 0.3 m to both sides of its middle at most.
fn reach(tree: &Tree, joint: usize) -> (f64, f64) {
    let body = tree.joint(joint);
    let extent = if body.joint_type == JointType::Prismatic { 0.3 } else { 1.0 };
    let limits = body.limits;
    if limits.lower.is_finite() && limits.upper.is_finite() {
        let (middle, half) = (0.5 * (limits.lower + limits.upper), 0.5 * (limits.upper - limits.lower));
        (middle - half.min(extent), middle + half.min(extent))
    } else {
        (-extent, extent)
    }
}

/// PD control of the joints' accelerations with gravity compensation, as if the base did not accelerate.
pub(crate) struct Controller<'a> {
    tree: &'a Tree,
    workspace: Workspace<f64>,
    acceleration: Vec<f64>,
    velocity: Vec<f64>,
    force: Vec<f64>,
}

impl<'a> Controller<'a> {
    pub(crate) fn new(tree: &'a Tree) -> Self {
        let zeros = || vec![0.0; tree.velocity_size()];
        Controller {
            tree,
            workspace: Workspace::new(tree),
            acceleration: zeros(),
            velocity: zeros(),
            force: zeros(),
        }
    }

    /// Torque that leads from the state `(q, v)` to the target: M·(PD) + gravity.
    pub(crate) fn pull(&mut self, q: &[f64], v: &[f64], target: &Target) -> Result<&[f64], DimensionError> {
        let still = Target { a: vec![0.0; target.a.len()], ..target.clone() };
        self.velocity.fill(0.0);
        self.torque(q, v, &still)
    }

    /// As [`pull`](Self::pull), with the target's acceleration and the present velocity's forces compensated
    /// too.
    pub(crate) fn follow(&mut self, q: &[f64], v: &[f64], target: &Target) -> Result<&[f64], DimensionError> {
        self.velocity.copy_from_slice(v);
        self.torque(q, v, target)
    }

    fn torque(&mut self, q: &[f64], v: &[f64], target: &Target) -> Result<&[f64], DimensionError> {
        let first_joint = self.tree.velocity_size() - self.tree.joint_count();
        let positions = self.tree.joint_configuration(q);
        for joint in 0..self.tree.joint_count() {
            self.acceleration[first_joint + joint] = target.a[joint]
                + BANDWIDTH * BANDWIDTH * (target.q[joint] - positions[joint])
                + 2.0 * BANDWIDTH * (target.v[joint] - v[first_joint + joint]);
        }
        let Controller { tree, workspace, acceleration, velocity, force } = self;
        tree.inverse_dynamics(q, velocity, acceleration, workspace, force)?;
        Ok(&force[first_joint..])
    }
}
