//! Motions whose position, velocity and acceleration are known in closed form.

use super::profile::{hermite, minimum_jerk, stroke, window};
use super::rng::CaseRng;
use phiw_dynamics::Tree;
use std::f64::consts::TAU;

/// Reach taken for joints without limits \[rad\].
const UNLIMITED_REACH: f64 = 2.8;
/// Fastest speed asked of any joint \[rad/s, m/s\].
const FASTEST: f64 = 3.0;
/// Shortest and longest rest between moves \[s\].
const SHORT_RESTS: [f64; 2] = [0.1, 0.7];
/// The same where joints rest for long.
const LONG_RESTS: [f64; 2] = [0.8, 3.0];
/// No move with its rest takes longer \[s\].
const LONGEST_MOVE: f64 = 12.0;

/// Shortest and longest ramp of a stroke, as a share of its time. With 0.3 its constant speed is three
/// quarters of the highest of a minimum-jerk move that takes as long; longer ramps would need more.
const RAMPS: [f64; 2] = [0.1, 0.3];

/// Step at which sticking motions are kept \[s\].
const GRID: f64 = 1e-3;

/// Position, velocity, acceleration of one joint.
pub type JointState = [f64; 3];

/// One log's motion of all joints, at rest before its start and after its end.
#[derive(Clone, Debug)]
pub struct Trajectory {
    /// Session time of its start \[s\].
    pub start: f64,
    /// How long it takes \[s\].
    pub duration: f64,
    /// One for each joint.
    pub joints: Vec<JointMotion>,
    /// What was commanded beyond what an actuator delivered.
    pub excess: Option<Excess>,
}

/// Torque that was commanded but not delivered.
#[derive(Clone, Debug)]
pub struct Excess {
    /// The joint.
    pub joint: usize,
    /// Step of the grid from the motion's start \[s\].
    pub step: f64,
    /// Torque on the grid \[N·m\].
    pub torque: Vec<f64>,
}

/// The motion of one joint, over the time since the start.
#[derive(Clone, Debug)]
pub enum JointMotion {
    /// A finite Fourier series that fades in and out.
    Fourier {
        /// Where it rests.
        center: f64,
        /// Amplitude, angular frequency, phase.
        terms: Vec<[f64; 3]>,
    },
    /// Moves with rests between.
    PointToPoint {
        /// Beginning and end in time, start and goal, ascending in time.
        moves: Vec<[f64; 4]>,
        /// Share of a move's time that each ramp of a stroke of constant speed takes; minimum jerk without.
        ramp: Option<f64>,
    },
    /// Another motion, so many times as slow.
    Slowed {
        /// The motion.
        motion: Box<JointMotion>,
        /// How many times.
        factor: f64,
    },
    /// Simulated on an even grid of this step \[s\].
    Simulated {
        /// Step of the grid \[s\].
        step: f64,
        /// States on the grid.
        states: Vec<JointState>,
    },
}

/// A joint that must come close to one of its limits.
#[derive(Clone, Copy, Debug)]
pub struct Reach {
    /// The joint.
    pub joint: usize,
    /// The upper limit or the lower.
    pub upper: bool,
}

impl Trajectory {
    /// State of a joint at a session time.
    pub fn state(&self, joint: usize, time: f64) -> JointState {
        self.joints[joint].state((time - self.start).clamp(0.0, self.duration), self.duration)
    }

    /// A periodic excitation of all joints: six to ten sinusoids each, of a fundamental of 0.05 to 0.1 Hz.
    pub fn fourier(tree: &Tree, rng: &mut CaseRng, start: f64, duration: f64, reach: Option<Reach>) -> Self {
        let fundamental = rng.uniform(0.05, 0.1);
        let highest = rng.uniform(1.0, 1.5);
        let joints = (0..tree.joint_count())
            .map(|joint| {
                let reach = reach.filter(|reach| reach.joint == joint);
                fourier_joint(room(tree, joint), rng, fundamental, highest, duration, reach)
            })
            .collect();
        Trajectory { start, duration, joints, excess: None }
    }

    /// Moves from pose to pose, as when picking and placing, all joints together, with rests.
    pub fn point_to_point(
        tree: &Tree,
        rng: &mut CaseRng,
        start: f64,
        duration: f64,
        reach: Option<Reach>,
    ) -> Self {
        Self::moves(tree, rng, start, duration, reach, SHORT_RESTS)
    }

    /// Moves from pose to pose with long rests: all joints together, or one after the other in their own
    /// time.
    pub fn with_rests(
        tree: &Tree,
        rng: &mut CaseRng,
        start: f64,
        duration: f64,
        reach: Option<Reach>,
        together: bool,
    ) -> Self {
        let mut motion = Self::moves(tree, rng, start, duration, reach, LONG_RESTS);
        if !together {
            for joint in 0..tree.joint_count() {
                let mut own = Self::moves(tree, rng, start, duration, reach, LONG_RESTS);
                motion.joints[joint] = own.joints.swap_remove(joint);
            }
        }
        motion
    }

    /// Moves of one joint after the other in the robot's order, so many of each, while all others rest; as
    /// long as that takes.
    pub fn in_turn(tree: &Tree, rng: &mut CaseRng, start: f64, moves: usize, reach: Option<Reach>) -> Self {
        let plenty = LONGEST_MOVE * moves as f64;
        let mut joints: Vec<JointMotion> = Self::moves(tree, rng, start, plenty, reach, SHORT_RESTS).joints;
        let mut clock = 0.3;
        for number in 0..moves {
            for joint in &mut joints {
                let JointMotion::PointToPoint { moves, .. } = joint else { continue };
                let Some([begin, end, ..]) = moves.get_mut(number) else { continue };
                (*begin, *end) = (clock, clock + (*end - *begin));
                clock = *end + rng.uniform(SHORT_RESTS[0], SHORT_RESTS[1]);
            }
        }
        for joint in &mut joints {
            if let JointMotion::PointToPoint { moves: all, .. } = joint {
                all.truncate(moves);
            }
        }
        Trajectory { start, duration: clock + 0.3, joints, excess: None }
    }

    /// Strokes of constant speed from pose to pose, all joints together, with short rests.
    pub fn strokes(tree: &Tree, rng: &mut CaseRng, start: f64, duration: f64, reach: Option<Reach>) -> Self {
        let mut motion = Self::moves(tree, rng, start, duration, reach, SHORT_RESTS);
        let share = rng.uniform(RAMPS[0], RAMPS[1]);
        for joint in &mut motion.joints {
            if let JointMotion::PointToPoint { ramp, .. } = joint {
                *ramp = Some(share);
            }
        }
        motion
    }

    /// A periodic excitation of two to five harmonics of 0.2 to 0.5 Hz.
    pub fn periodic(tree: &Tree, rng: &mut CaseRng, start: f64, duration: f64, reach: Option<Reach>) -> Self {
        let fundamental = rng.uniform(0.2, 0.5);
        let highest = fundamental * (2 + rng.index(4)) as f64;
        let joints = (0..tree.joint_count())
            .map(|joint| {
                let reach = reach.filter(|reach| reach.joint == joint);
                fourier_joint(room(tree, joint), rng, fundamental, highest, duration, reach)
            })
            .collect();
        Trajectory { start, duration, joints, excess: None }
    }

    fn moves(
        tree: &Tree,
        rng: &mut CaseRng,
        start: f64,
        duration: f64,
        reach: Option<Reach>,
        rests: [f64; 2],
    ) -> Self {
        let rooms: Vec<Room> = (0..tree.joint_count()).map(|joint| room(tree, joint)).collect();
        let pose = |rng: &mut CaseRng, number: usize| -> Vec<f64> {
            let inside = |(joint, room): (usize, &Room)| match reach {
                Some(reach) if reach.joint == joint && number % 3 == 1 => room.near_limit(reach.upper),
                _ => {
                    let margin = 0.12 * (room.upper - room.lower);
                    rng.uniform(room.lower + margin, room.upper - margin)
                }
            };
            rooms.iter().enumerate().map(inside).collect()
        };
        let mut joints = vec![Vec::new(); rooms.len()];
        let mut from = pose(rng, 0);
        let mut clock = 0.3;
        let haste = rng.uniform(0.6, 0.95);
        for number in 1.. {
            let to = pose(rng, number);
            // A minimum-jerk move of distance d in time T peaks at 1.875 d/T and 5.77 d/T².
            let needed = rooms.iter().zip(from.iter().zip(&to)).map(|(room, (from, to))| {
                let distance = (to - from).abs();
                (1.875 * distance / (haste * room.velocity))
                    .max((5.77 * distance / (8.0 * room.velocity)).sqrt())
            });
            let end = clock + needed.fold(0.4, f64::max);
            if end > duration - 0.3 {
                break;
            }
            for (moves, (from, to)) in joints.iter_mut().zip(from.iter().zip(&to)) {
                moves.push([clock, end, *from, *to]);
            }
            clock = end + rng.uniform(rests[0], rests[1]);
            from = to;
        }
        let joints =
            joints.into_iter().map(|moves| JointMotion::PointToPoint { moves, ramp: None }).collect();
        Trajectory { start, duration, joints, excess: None }
    }

    /// A motion whose joints are slower where they were slower than `share` of their RMS speed, and linger
    /// about zero where they reverse; as wide as before, or less.
    pub fn stick(&mut self, share: f64) {
        let samples = (self.duration / GRID).ceil() as usize + 1;
        let duration = self.duration;
        for joint in &mut self.joints {
            let states: Vec<JointState> =
                (0..samples).map(|k| joint.state((k as f64 * GRID).min(duration), duration)).collect();
            *joint = JointMotion::Simulated { step: GRID, states: sticking(&states, share) };
        }
    }

    /// The same motion `factor` times as slow: as much of it as there is time for.
    pub fn slow_down(&mut self, factor: f64) {
        let slowed = |motion: &JointMotion| JointMotion::Slowed { motion: Box::new(motion.clone()), factor };
        self.joints = self.joints.iter().map(slowed).collect();
    }

    /// The same motion with some joints that stay where they are told to.
    pub fn keep_still(&mut self, still: &[(usize, f64)]) {
        for &(joint, center) in still {
            self.joints[joint] = JointMotion::Fourier { center, terms: Vec::new() };
        }
    }

    /// The same motion around the same place, `factor` times as wide.
    pub fn shrink(&mut self, factor: f64) {
        for joint in &mut self.joints {
            match joint {
                JointMotion::Fourier { terms, .. } => terms.iter_mut().for_each(|term| term[0] *= factor),
                JointMotion::PointToPoint { moves, .. } => {
                    let center = moves.first().map_or(0.0, |first| first[2]);
                    for [_, _, from, to] in moves {
                        *from = center + factor * (*from - center);
                        *to = center + factor * (*to - center);
                    }
                }
                JointMotion::Slowed { .. } | JointMotion::Simulated { .. } => {}
            }
        }
    }
}

impl JointMotion {
    fn state(&self, time: f64, duration: f64) -> JointState {
        match self {
            JointMotion::Fourier { center, terms } => {
                let mut sum = [0.0; 3];
                for &[amplitude, frequency, phase] in terms {
                    let (sine, cosine) = (frequency * time + phase).sin_cos();
                    sum[0] += amplitude * sine;
                    sum[1] += amplitude * frequency * cosine;
                    sum[2] -= amplitude * frequency * frequency * sine;
                }
                let [w, dw, ddw] = window(time, duration);
                let [s, ds, dds] = sum;
                [center + w * s, dw * s + w * ds, ddw * s + 2.0 * dw * ds + w * dds]
            }
            JointMotion::PointToPoint { moves, ramp } => {
                let after = moves.partition_point(|move_| move_[0] <= time);
                match after.checked_sub(1).map(|index| moves[index]) {
                    Some([begin, end, from, to]) => {
                        let (x, length) = ((time - begin) / (end - begin), end - begin);
                        match ramp {
                            Some(ramp) => stroke(x, length, from, to, *ramp),
                            None => minimum_jerk(x, length, from, to),
                        }
                    }
                    None => [moves.first().map_or(0.0, |first| first[2]), 0.0, 0.0],
                }
            }
            JointMotion::Slowed { motion, factor } => {
                let [q, v, a] = motion.state(time / factor, duration);
                [q, v / factor, a / (factor * factor)]
            }
            JointMotion::Simulated { step, states } => hermite(states, time / step, *step),
        }
    }
}

/// The speeds v of a motion on the grid turned into v⁵/(v² + s²)², where s is a share of their RMS.
fn sticking(states: &[JointState], share: f64) -> Vec<JointState> {
    let square = states.iter().map(|[_, v, _]| v * v).sum::<f64>() / states.len().max(1) as f64;
    let soft = (share * share * square).max(f64::MIN_POSITIVE);
    let mut slower: Vec<JointState> = Vec::with_capacity(states.len());
    for &[q, v, a] in states {
        let sum = v * v + soft;
        let kept = (v * v / sum).powi(2);
        let speed = kept * v;
        let position = slower.last().map_or(q, |[q, before, _]| q + 0.5 * GRID * (before + speed));
        slower.push([position, speed, kept * a * (v * v + 5.0 * soft) / sum]);
    }
    let range = |states: &[JointState]| {
        let ends = |[low, high]: [f64; 2], [q, ..]: &JointState| [low.min(*q), high.max(*q)];
        states.iter().fold([f64::INFINITY, f64::NEG_INFINITY], ends)
    };
    let ([low, high], [own_low, own_high]) = (range(states), range(&slower));
    let factor = ((high - low) / (own_high - own_low).max(f64::MIN_POSITIVE)).min(1.0);
    let (middle, own_middle) = (0.5 * (low + high), 0.5 * (own_low + own_high));
    let placed = |[q, v, a]: JointState| [middle + factor * (q - own_middle), factor * v, factor * a];
    slower.into_iter().map(placed).collect()
}

/// Where a joint may go, and how fast.
pub(super) struct Room {
    lower: f64,
    upper: f64,
    velocity: f64,
}

impl Room {
    fn near_limit(&self, upper: bool) -> f64 {
        let margin = 0.015 * (self.upper - self.lower);
        if upper { self.upper - margin } else { self.lower + margin }
    }
}

pub(super) fn room(tree: &Tree, joint: usize) -> Room {
    let limits = tree.joint(joint).limits;
    Room {
        lower: limits.lower.max(-UNLIMITED_REACH),
        upper: limits.upper.min(UNLIMITED_REACH),
        velocity: limits.velocity.min(FASTEST),
    }
}

fn fourier_joint(
    room: Room,
    rng: &mut CaseRng,
    fundamental: f64,
    highest: f64,
    duration: f64,
    reach: Option<Reach>,
) -> JointMotion {
    let harmonics = (highest / fundamental) as usize;
    let decay = rng.uniform(0.7, 1.3);
    let count = 6 + rng.index(5);
    let terms: Vec<[f64; 3]> = (0..count)
        .map(|number| {
            // Spread evenly in the logarithm, lowest and highest always among them.
            let position = (number as f64 + rng.uniform(-0.4, 0.4)) / (count - 1) as f64;
            let harmonic = (harmonics as f64).powf(position.clamp(0.0, 1.0)).round().max(1.0);
            [
                rng.uniform(0.3, 1.0) * harmonic.powf(-decay),
                TAU * fundamental * harmonic,
                rng.uniform(0.0, TAU),
            ]
        })
        .collect();
    placed(terms, room, rng, duration, reach)
}

/// A finite Fourier series as wide and as fast as a joint may be, or less, and where it may be.
pub(super) fn placed(
    mut terms: Vec<[f64; 3]>,
    room: Room,
    rng: &mut CaseRng,
    duration: f64,
    reach: Option<Reach>,
) -> JointMotion {
    let unscaled = JointMotion::Fourier { center: 0.0, terms: terms.clone() };
    let mut extent = [0.0_f64, 0.0];
    let mut fastest = 0.0_f64;
    for step in 0..(50.0 * duration) as usize {
        let [q, v, _] = unscaled.state(step as f64 / 50.0, duration);
        extent = [extent[0].min(q), extent[1].max(q)];
        fastest = fastest.max(v.abs());
    }
    let width = extent[1] - extent[0];
    let scale = (rng.uniform(0.5, 0.9) * (room.upper - room.lower) / width)
        .min(rng.uniform(0.5, 0.95) * room.velocity / fastest);
    terms.iter_mut().for_each(|term| term[0] *= scale);
    let center = match reach {
        Some(reach) => room.near_limit(reach.upper) - scale * extent[usize::from(reach.upper)],
        None => {
            let margin = 0.03 * (room.upper - room.lower);
            rng.uniform(room.lower + margin - scale * extent[0], room.upper - margin - scale * extent[1])
        }
    };
    JointMotion::Fourier { center, terms }
}

#[cfg(test)]
mod tests {
    use super::super::rng::{CaseRng, Stream};
    use super::super::robot::robots;
    use super::{JointMotion, Reach, Trajectory};

    /// Derivatives by central differences, limits and rest at both ends.
    fn check(point_to_point: bool, reach: Option<Reach>) {
        let robots = robots().expect("the models read");
        for (number, robot) in robots.iter().enumerate() {
            let mut rng = CaseRng::new(number as u64, 0, Stream::Motion);
            let draw = if point_to_point { Trajectory::point_to_point } else { Trajectory::fourier };
            let motion = draw(&robot.tree, &mut rng, 25.0, 20.0, reach);
            let step = 1e-4;
            for joint in 0..robot.joints() {
                let limits = robot.tree.joint(joint).limits;
                let mut furthest = [f64::INFINITY, f64::NEG_INFINITY];
                for sample in 0..400 {
                    let time = 25.0 + 0.05 * f64::from(sample) + 0.0123;
                    let [before, [q, v, a], after] =
                        [time - step, time, time + step].map(|time| motion.state(joint, time));
                    assert!(
                        (v - (after[0] - before[0]) / (2.0 * step)).abs() < 1e-3,
                        "{}: {time}",
                        robot.name
                    );
                    assert!(
                        (a - (after[1] - before[1]) / (2.0 * step)).abs() < 0.1,
                        "{}: {time}",
                        robot.name
                    );
                    assert!(q > limits.lower && q < limits.upper && v.abs() <= limits.velocity);
                    furthest = [furthest[0].min(q), furthest[1].max(q)];
                }
                assert_eq!(motion.state(joint, 25.0)[1], 0.0);
                assert_eq!(motion.state(joint, 45.0)[1], 0.0);
                if reach.is_some_and(|reach| reach.joint == joint && reach.upper) {
                    assert!(limits.upper - furthest[1] < 0.03 * (limits.upper - limits.lower));
                }
            }
        }
    }

    #[test]
    fn derivatives_are_exact_and_limits_are_kept() {
        check(false, None);
        check(true, None);
        check(false, Some(Reach { joint: 1, upper: true }));
        check(true, Some(Reach { joint: 1, upper: true }));
    }

    #[test]
    fn a_simulated_motion_passes_through_its_grid() {
        let states: Vec<_> =
            (0..50).map(|k| 0.1 * f64::from(k)).map(|t| [t.sin(), t.cos(), -t.sin()]).collect();
        let joint = JointMotion::Simulated { step: 0.1, states };
        for time in [0.0, 0.31, 1.77, 4.9] {
            let [q, v, a] = joint.state(time, 5.0);
            assert!(
                (q - time.sin()).abs() < 1e-5
                    && (v - time.cos()).abs() < 1e-3
                    && (a + time.sin()).abs() < 2e-3
            );
        }
    }
}
