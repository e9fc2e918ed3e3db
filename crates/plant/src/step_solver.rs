//! One integration step under effects that are too stiff to be taken from the state at its beginning.
//!
//! A backend steps under constant joint torques. Friction over 1 mrad/s on a wrist of 2 g·m² is a damper with
//! a time constant of microseconds, so its torque must be that of the *end* of the step. The end is
//! predicted: the joints' accelerations answer a change of torque by the mobility W, the inverse of the mass
//! matrix, and everything else (gravity, Coriolis, contacts) is what it was in the last step, which leaves an
//! error of the order of the step squared. Joint after joint is solved for its own torque with the others'
//! fixed until nothing moves any more (Gauss-Seidel: W is positive definite, frictions are monotone).

use crate::joint_drive::{DriveStep, Flexible, JointDrive};
use crate::root::rising_root;
use crate::{Coupling, PlantError};
use phiw_dynamics::dense::Cholesky;
use phiw_dynamics::{Tree, Workspace};

/// Sweeps over all joints at most, and the change of speed below which they are done \[rad/s, m/s\].
const MOST_SWEEPS: usize = 60;
const SETTLED: f64 = 1e-9;
/// To what a joint's own speed is solved \[rad/s, m/s\], and a spring's torque \[N·m, N\].
const SPEED_TOLERANCE: f64 = 1e-12;
const TORQUE_TOLERANCE: f64 = 1e-10;

/// Predicts and solves steps of one robot.
pub(crate) struct StepSolver {
    joints: usize,
    /// W, joints × joints.
    mobility: Vec<f64>,
    matrix: Vec<f64>,
    workspace: Workspace<f64>,
    /// Of the links in the last step.
    acceleration: Vec<f64>,
    /// Torque into the rigid bodies: of the last step until [`Self::solve`], then of this one.
    pub(crate) torque: Vec<f64>,
    /// Speeds at the end of the step if no joint had a torque.
    untorqued: Vec<f64>,
    /// Speeds at the end of the step, of links and of drives.
    pub(crate) link_speed: Vec<f64>,
    pub(crate) drive_speed: Vec<f64>,
    smooth: Vec<f64>,
    steps: Vec<DriveStep>,
}

/// The robot at the beginning of a step.
pub(crate) struct StepStart<'a> {
    pub(crate) link_angle: &'a [f64],
    pub(crate) link_speed: &'a [f64],
    pub(crate) drive_angle: &'a [f64],
    pub(crate) drive_speed: &'a [f64],
    /// What external forces ask of the joints.
    pub(crate) external: &'a [f64],
    /// What the actuators deliver.
    pub(crate) delivered: &'a [f64],
    pub(crate) rotor_inertia: &'a [f64],
    pub(crate) t_s: f64,
    pub(crate) step_s: f64,
}

impl StepSolver {
    /// For a robot at rest, whose joints hold it with `torque`.
    pub(crate) fn new(tree: &Tree, torque: Vec<f64>) -> Self {
        let (joints, size) = (torque.len(), tree.velocity_size());
        StepSolver {
            joints,
            mobility: vec![0.0; joints * joints],
            matrix: vec![0.0; size * size],
            workspace: Workspace::new(tree),
            acceleration: vec![0.0; joints],
            untorqued: vec![0.0; joints],
            link_speed: vec![0.0; joints],
            drive_speed: vec![0.0; joints],
            smooth: vec![0.0; joints],
            steps: Vec::with_capacity(joints),
            torque,
        }
    }

    /// Computes the mobility in configuration `q`. A base that stands is taken as held by the floor.
    pub(crate) fn refresh(
        &mut self,
        tree: &Tree,
        q: &[f64],
        rotor_inertia: &[f64],
        stands: bool,
    ) -> Result<(), PlantError> {
        let size = tree.velocity_size();
        tree.mass_matrix(q, &mut self.workspace, &mut self.matrix)?;
        let first_joint = size - self.joints;
        for (joint, inertia) in rotor_inertia.iter().enumerate() {
            self.matrix[(first_joint + joint) * (size + 1)] += inertia;
        }
        let first = if stands { first_joint } else { 0 };
        let inverse = inverse(&self.matrix, size, first);
        let (kept, skipped) = (size - first, first_joint - first);
        for row in 0..self.joints {
            let from = (row + skipped) * kept + skipped;
            self.mobility[row * self.joints..][..self.joints]
                .copy_from_slice(&inverse[from..][..self.joints]);
        }
        Ok(())
    }

    /// Notes what the last step did to the links' speeds.
    pub(crate) fn learn(&mut self, before: &[f64], after: &[f64], step_s: f64) {
        for joint in 0..self.joints {
            self.acceleration[joint] = (after[joint] - before[joint]) / step_s;
        }
    }

    /// Finds the torques that go into the rigid bodies during the step, and the speeds at its end.
    pub(crate) fn solve(&mut self, start: &StepStart<'_>, drives: &[JointDrive], couplings: &[Coupling]) {
        self.begin(start, drives);
        let nothing_to_solve = couplings.is_empty() && !drives.iter().any(JointDrive::is_stiff);
        let coupled = |joint: usize| couplings.iter().any(|coupling| coupling.joints().contains(&joint));
        for sweep in 0..MOST_SWEEPS {
            let mut moved: f64 = 0.0;
            for joint in 0..self.joints {
                if sweep > 0 && !drives[joint].is_stiff() && !coupled(joint) {
                    // Its torque is what it is; its speed follows from the others'.
                    self.link_speed[joint] =
                        self.speed_without(joint) + self.response(joint, start) * self.torque[joint];
                    self.drive_speed[joint] = self.link_speed[joint];
                    continue;
                }
                let before = self.link_speed[joint];
                self.solve_joint(joint, start, &drives[joint], couplings);
                moved = moved.max((self.link_speed[joint] - before).abs());
            }
            // Torques that depend on no speed are known after one sweep.
            if moved < SETTLED || nothing_to_solve {
                break;
            }
        }
    }

    fn begin(&mut self, start: &StepStart<'_>, drives: &[JointDrive]) {
        self.steps.clear();
        for joint in 0..self.joints {
            let rotor = start.rotor_inertia.get(joint).copied().unwrap_or(0.0);
            let step = DriveStep {
                angle: start.drive_angle[joint],
                speed: start.drive_speed[joint],
                t_s: start.t_s,
                step_s: start.step_s,
                load: self.torque[joint] - rotor * self.acceleration[joint],
            };
            self.smooth[joint] = drives[joint].smooth_torque(&step);
            self.steps.push(step);
            let last: f64 = self.row(joint).iter().zip(&self.torque).map(|(w, torque)| w * torque).sum();
            self.untorqued[joint] =
                start.link_speed[joint] + start.step_s * (self.acceleration[joint] - last);
        }
        self.link_speed.copy_from_slice(start.link_speed);
        self.drive_speed.copy_from_slice(start.drive_speed);
    }

    fn row(&self, joint: usize) -> &[f64] {
        &self.mobility[joint * self.joints..][..self.joints]
    }

    /// What a unit of its own torque does to a joint's speed in this step.
    fn response(&self, joint: usize, start: &StepStart<'_>) -> f64 {
        start.step_s * self.mobility[joint * (self.joints + 1)]
    }

    /// The link's speed at the end of the step without its own torque.
    fn speed_without(&self, joint: usize) -> f64 {
        let all: f64 = self.row(joint).iter().zip(&self.torque).map(|(w, torque)| w * torque).sum();
        let others = all - self.mobility[joint * (self.joints + 1)] * self.torque[joint];
        self.untorqued[joint] + self.steps[joint].step_s * others
    }

    fn solve_joint(
        &mut self,
        joint: usize,
        start: &StepStart<'_>,
        drive: &JointDrive,
        couplings: &[Coupling],
    ) {
        let step = self.steps[joint];
        let (without, response) = (self.speed_without(joint), self.response(joint, start));
        let pushed = start.delivered[joint] - self.smooth[joint];
        let resisted = |speed: f64| {
            drive.stiff_torque(&step, speed)
                + coupling_torque(couplings, joint, speed, &self.drive_speed, start)
        };
        // A force on the link acts behind the spring of a flexible drive.
        let external = start.external[joint];
        if let Some(flexible) = drive.flexible {
            let share = step.step_s / flexible.inertia;
            let twist = start.drive_angle[joint] - start.link_angle[joint];
            let rate = start.drive_speed[joint] - start.link_speed[joint];
            let motor_speed = |spring: f64| {
                let excess = |speed: f64| speed - step.speed - share * (pushed - spring - resisted(speed));
                rising_root(excess, self.drive_speed[joint], SPEED_TOLERANCE)
            };
            let link_speed = |spring: f64| without + response * (spring - external);
            let excess = |spring: f64| {
                let end_rate = motor_speed(spring) - link_speed(spring);
                spring - mean_torque(&flexible, twist, rate, end_rate, step.step_s)
            };
            let spring = rising_root(excess, self.torque[joint] + external, TORQUE_TOLERANCE);
            let (motor, link) = (motor_speed(spring), link_speed(spring));
            self.torque[joint] = spring - external;
            self.drive_speed[joint] = motor;
            self.link_speed[joint] = link;
            return;
        }
        let excess = |speed: f64| speed - without - response * (pushed - external - resisted(speed));
        let speed = rising_root(excess, self.link_speed[joint], SPEED_TOLERANCE);
        self.torque[joint] = pushed - external - resisted(speed);
        self.link_speed[joint] = without + response * self.torque[joint];
        self.drive_speed[joint] = self.link_speed[joint];
    }
}

/// Mean torque of a spring over a step (trapezoidal rule: it neither feeds nor damps an oscillation).
fn mean_torque(flexible: &Flexible, twist: f64, rate: f64, end_rate: f64, step_s: f64) -> f64 {
    let mean_rate = 0.5 * (rate + end_rate);
    flexible.torque(twist + 0.5 * step_s * mean_rate, mean_rate)
}

/// What couplings ask of a joint that moves at `speed` at the end of the step, the others at `speeds`.
fn coupling_torque(
    couplings: &[Coupling],
    joint: usize,
    speed: f64,
    speeds: &[f64],
    start: &StepStart<'_>,
) -> f64 {
    let mut sum = 0.0;
    for coupling in couplings {
        sum += match *coupling {
            Coupling::SharedFriction { joints, coefficient, torque, width } if joints.contains(&joint) => {
                let both = speed + speeds[other(joints, joint)];
                coefficient * both + torque * (both / width).tanh()
            }
            Coupling::SharedInertia { joints, inertia } if joints.contains(&joint) => {
                let other = other(joints, joint);
                inertia * (speeds[other] - start.drive_speed[other]) / start.step_s
            }
            Coupling::Driven { driven, driver, coefficient, torque, width } if driven == joint => {
                coefficient * speeds[driver] + torque * (speeds[driver] / width).tanh()
            }
            _ => 0.0,
        };
    }
    sum
}

fn other(joints: [usize; 2], joint: usize) -> usize {
    if joints[0] == joint { joints[1] } else { joints[0] }
}

/// Inverse of the part of a symmetric positive definite matrix from row and column `first` on; not a number
/// where the matrix is none such, which the motion that follows from it reports.
pub(crate) fn inverse(matrix: &[f64], size: usize, first: usize) -> Vec<f64> {
    let n = size - first;
    let entry = |row: usize, column: usize| matrix[(row + first) * size + column + first];
    Cholesky::of(n, entry).map_or_else(|| vec![f64::NAN; n * n], |factor| factor.inverse())
}

#[cfg(test)]
mod tests {
    use super::inverse;
    use phiw_dynamics::random_tree::RandomNumbers;

    #[test]
    fn inverse_times_matrix_is_one() {
        let mut rng = RandomNumbers::new(5);
        for (size, first) in [(1, 0), (7, 0), (12, 5), (24, 6)] {
            let root: Vec<f64> = (0..size * size).map(|_| rng.uniform(-1.0, 1.0)).collect();
            let element = |row: usize, column: usize| -> f64 {
                let product: f64 = (0..size).map(|k| root[row * size + k] * root[column * size + k]).sum();
                product + if row == column { 0.1 } else { 0.0 }
            };
            let matrix: Vec<f64> = (0..size * size).map(|at| element(at / size, at % size)).collect();
            let (inverse, n) = (inverse(&matrix, size, first), size - first);
            for row in 0..n {
                for column in 0..n {
                    let product: f64 =
                        (0..n).map(|k| element(row + first, k + first) * inverse[k * n + column]).sum();
                    assert!((product - f64::from(u8::from(row == column))).abs() < 1e-9);
                }
            }
        }
    }
}
