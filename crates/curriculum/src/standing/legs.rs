//! Legs that follow: the motion of base and upper body is given, and the legs keep the feet where they are.

use super::{Feet, VIRTUAL_JOINTS};
use crate::CurriculumError;
use crate::motion::Motion;
use phiw_dynamics::{Foot, JointType, Tree, Vec3, check_size};
use phiw_regressor::BaseParameters;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::f64::consts::PI;

const BASE: usize = VIRTUAL_JOINTS.len();
/// Bodies between the virtual joints: they have no mass, and a floating tree does not have them.
const MASSLESS: [usize; BASE - 1] = [0, 1, 2, 3, 4];

/// A robot that stands on all its feet, on legs of six joints each.
#[derive(Clone, Debug)]
pub struct Legs {
    feet: Feet,
    /// Corners of each foot's sole, in its body's frame \[m\].
    soles: Vec<Vec<[f64; 3]>>,
    stance: Vec<f64>,
    joints: Vec<usize>,
}

/// Random states with the feet on the floor, from which the base parameters are computed.
#[derive(Clone, Debug, PartialEq)]
pub struct StandingStates {
    /// How many: each gives a row for each joint, so 200 are many times the columns of a humanoid.
    pub count: usize,
    /// How far the base goes from the stance, to both sides, along and about each virtual joint \[m, rad\].
    pub reach: [f64; BASE],
    /// How far the base is lowered before that \[m\], so that the knees can stretch.
    pub lowered_m: f64,
    /// Largest velocity of base and upper body \[m/s, rad/s\].
    pub velocity: f64,
    /// Largest acceleration of base and upper body \[m/s², rad/s²\].
    pub acceleration: f64,
    /// How many random states are tried for each that the legs can reach.
    pub tries: usize,
    /// Seed of the states.
    pub seed: u64,
}

impl Default for StandingStates {
    /// For a humanoid of human size. `cargo xtask paper --robot whole-body` uses them: its 30 joints give the
    /// same rank from 120 states on.
    fn default() -> Self {
        StandingStates {
            count: 200,
            reach: [0.05, 0.05, 0.05, 0.3, 0.2, 0.15],
            lowered_m: 0.06,
            velocity: 3.0,
            acceleration: 10.0,
            tries: 10,
            seed: 1,
        }
    }
}

impl Legs {
    /// The robot `tree`, with virtual joints, in the configuration `posture` \[m, rad\]: its height is
    /// changed so that the first sole lies on the floor. `feet` are counted as in the floating tree, which
    /// has no virtual joints.
    ///
    /// # Errors
    /// The posture does not fit the tree, a foot is of no body, there are no feet, or a leg has not six
    /// joints.
    pub fn new(tree: &Tree, feet: &[Foot], posture: Vec<f64>) -> Result<Self, CurriculumError> {
        check_size("the posture", posture.len(), tree.joint_count())?;
        let bodies = tree.bodies().len();
        let own: Vec<Foot> = feet
            .iter()
            .map(|foot| Foot { body: foot.body + MASSLESS.len(), sole: foot.sole.clone() })
            .collect();
        if let Some(foot) = own.iter().find(|foot| foot.body >= bodies) {
            let value = (foot.body - MASSLESS.len()) as f64;
            let must_be = "a body of the floating tree";
            return Err(CurriculumError::Value { what: "the body of a foot", value, must_be });
        }
        let mut stance = posture;
        let placed = Feet::new(tree, &own, &stance)?;
        let Some(first) = placed.all().first() else {
            return Err(CurriculumError::Value {
                what: "the number of feet",
                value: 0.0,
                must_be: "one or more",
            });
        };
        stance[2] -= first.placement.point(first.sole).0[2];
        let feet = Feet::new(tree, &own, &stance)?;
        let joints: Vec<usize> = (0..own.len()).flat_map(|foot| feet.leg(foot)).collect();
        check_size("joints of the legs", joints.len(), 6 * own.len())?;
        Ok(Legs { feet, soles: own.into_iter().map(|foot| foot.sole).collect(), stance, joints })
    }

    /// The feet, where they stay.
    pub fn feet(&self) -> &Feet {
        &self.feet
    }

    /// The configuration, with virtual joints, in which the robot stands at first \[m, rad\].
    pub fn stance(&self) -> &[f64] {
        &self.stance
    }

    /// The legs' joints in the tree, leg by leg from the base.
    pub fn joints(&self) -> &[usize] {
        &self.joints
    }

    /// The motors that are not in the legs.
    pub fn upper_joints(&self) -> impl Iterator<Item = usize> + '_ {
        (BASE..self.stance.len()).filter(|joint| !self.joints.contains(joint))
    }

    /// Where the corners of the soles are on the floor \[m\].
    pub fn sole_corners(&self) -> Vec<[f64; 2]> {
        let corners = self.feet.all().iter().zip(&self.soles);
        corners
            .flat_map(|(foot, sole)| sole.iter().map(|&corner| foot.placement.point(Vec3(corner)).0))
            .map(|[x, y, _]| [x, y])
            .collect()
    }

    /// The motion of all joints in which the upper joints do `upper`, and the base goes against the stance as
    /// `base` says for a time \[s\]: positions \[m, rad\], velocities and accelerations of the virtual
    /// joints. None where a leg would go beyond its limits.
    ///
    /// # Errors
    /// `upper` is not a motion of the [upper joints](Self::upper_joints).
    pub fn follow(
        &self,
        upper: &Motion,
        mut base: impl FnMut(f64) -> [[f64; BASE]; 3],
    ) -> Result<Option<Motion>, CurriculumError> {
        let tree = self.feet.tree();
        let joints = tree.joint_count();
        check_size("joints of the upper body's motion", upper.joints(), self.upper_joints().count())?;
        let all: Vec<usize> = (0..self.feet.all().len()).collect();
        let mut signals = [0; 3].map(|_| Vec::with_capacity(upper.samples() * joints));
        let mut state = [self.stance.clone(), vec![0.0; joints], vec![0.0; joints]];
        for sample in 0..upper.samples() {
            let moved = base(sample as f64 * upper.period_s());
            let parts = upper.sample(sample);
            for ((values, part), moved) in state.iter_mut().zip(parts).zip(moved) {
                values[..BASE].copy_from_slice(&moved);
                self.upper_joints().zip(part).for_each(|(joint, &value)| values[joint] = value);
            }
            state[0][..BASE].iter_mut().zip(&self.stance).for_each(|(value, stance)| *value += stance);
            let [q, v, a] = &mut state;
            if self.feet.close(&self.joints, &all, [q, v, a]).is_err() {
                return Ok(None);
            }
            let within = |&joint: &usize| {
                let limits = tree.joint(joint).limits;
                (limits.lower..=limits.upper).contains(&q[joint]) && v[joint].abs() <= limits.velocity
            };
            if !self.joints.iter().all(within) {
                return Ok(None);
            }
            signals.iter_mut().zip(&state).for_each(|(signal, values)| signal.extend_from_slice(values));
        }
        Ok(Some(Motion::new(&upper.name, &upper.task, joints, upper.period_s(), signals)?))
    }

    /// What motions with all feet on the floor can tell apart: less than those of a robot that may move its
    /// feet.
    ///
    /// # Errors
    /// The legs can reach too few of the states.
    pub fn base_parameters(&self, states: &StandingStates) -> Result<BaseParameters, CurriculumError> {
        let all: Vec<usize> = (0..self.feet.all().len()).collect();
        let mut rng = ChaCha8Rng::seed_from_u64(states.seed);
        let mut reached: Vec<[Vec<f64>; 3]> = Vec::with_capacity(states.count);
        for _ in 0..states.tries * states.count {
            if reached.len() == states.count {
                break;
            }
            let mut state = self.random_state(states, &mut rng);
            let [q, v, a] = &mut state;
            if self.feet.close(&self.joints, &all, [q, v, a]).is_ok() {
                reached.push(state);
            }
        }
        if reached.len() < states.count {
            let problem = format!(
                "the legs reach {} of {} states: bend the knees more, or make the base's reach smaller",
                reached.len(),
                states.count
            );
            return Err(CurriculumError::Motion { name: "of a robot on its feet".to_owned(), problem });
        }
        let reached = reached.iter().map(|[q, v, a]| [q.as_slice(), v.as_slice(), a.as_slice()]);
        Ok(BaseParameters::of_states(self.feet.tree(), reached, &MASSLESS, Default::default())?)
    }

    /// Base and upper body anywhere within their reach; the legs as in the stance, from where they are to
    /// follow.
    fn random_state(&self, states: &StandingStates, rng: &mut ChaCha8Rng) -> [Vec<f64>; 3] {
        let tree = self.feet.tree();
        let joints = tree.joint_count();
        let mut state = [self.stance.clone(), vec![0.0; joints], vec![0.0; joints]];
        for joint in (0..joints).filter(|joint| !self.joints.contains(joint)) {
            state[0][joint] = match states.reach.get(joint) {
                Some(reach) => self.stance[joint] + reach * rng.random_range(-1.0..1.0),
                None => random_position(tree, joint, rng),
            };
            state[1][joint] = states.velocity * rng.random_range(-1.0..1.0);
            state[2][joint] = states.acceleration * rng.random_range(-1.0..1.0);
        }
        state[0][2] -= states.lowered_m;
        state
    }
}

/// Anywhere between the limits \[rad, m\]; for a joint without them, half a turn or half a metre to both
/// sides.
fn random_position(tree: &Tree, joint: usize, rng: &mut ChaCha8Rng) -> f64 {
    let body = tree.joint(joint);
    let most = if body.joint_type == JointType::Prismatic { 0.5 } else { PI };
    let (lower, upper) = (body.limits.lower, body.limits.upper);
    match (lower.is_finite(), upper.is_finite()) {
        (true, true) if lower < upper => rng.random_range(lower..upper),
        (true, true) => lower,
        (true, false) => lower + rng.random_range(0.0..2.0 * most),
        (false, true) => upper - rng.random_range(0.0..2.0 * most),
        (false, false) => rng.random_range(-most..most),
    }
}
