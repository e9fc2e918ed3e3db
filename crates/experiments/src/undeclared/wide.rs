//! Draws a case of the widened suites: frictions on all joints in forms of their own, up to a dozen effects
//! at once, and a situation.

use super::case::{
    Case, DURATION, Drawn, SIZE_RATE, SIZES, STARTS, VISIBLE, VISIBLE_OUTSIDE, draw_motions, draw_ordinary,
    even_times, felt_in_every_log, survey, tamed,
};
use super::certainty::visible_beside_others;
use super::draw::{Survey, catalogue, outside};
use super::family::{Family, Turning};
use super::kind::{Kind, Name};
use super::logging::Logging;
use super::plant::{Ordinary, Record, States, record};
use super::rng::{CaseRng, Stream};
use super::robot::Robot;
use super::secret::{Form, Secret};
use super::sensors::Sensors;
use super::situation::Situation;
use super::smoothing::Smoothing;
use super::suite::{Spec, Suite};
use super::trajectory::{Reach, Trajectory};
use super::visibility::Absorber;

/// Attempts at one effect before it is left out.
const ATTEMPTS: usize = 8;
/// Most effects for each joint, besides the families.
const EFFECTS_PER_JOINT: usize = 2;
/// What an effect's size must be in units of its own uncertainty, for one that has to be named: far above any
/// guard's threshold.
const CERTAIN: f64 = 15.0;
/// Share of right models with nothing but a rigid body.
const BARE: f64 = 0.2;
/// How many times faster the held-out motion is, where it is.
const FASTER: [f64; 2] = [3.0, 5.0];

/// Shortest and longest of short logs \[s\].
const SHORT: [f64; 2] = [4.0, 8.0];
/// Speed below which joints begin to stick, over their RMS speed.
const STICKING: [f64; 2] = [0.5, 2.0];
/// Moves of each joint in a log, fewest and most, where joints move in turn.
const MOVES_IN_TURN: [usize; 2] = [2, 4];

/// One attempt at the case of a spec. `None` if its stranger can't be seen.
pub fn draw<'a>(spec: &Spec, situation: Situation, robot: &'a Robot, attempt: u64) -> Option<Case<'a>> {
    let rng = |stream| CaseRng::new(spec.seed, attempt, stream);
    let (mut secret_rng, mut plant_rng) = (rng(Stream::Secret), rng(Stream::Plant));
    let reach = spec
        .has(Kind::EndStop)
        .then(|| Reach { joint: secret_rng.index(robot.joints()), upper: secret_rng.chance(0.5) });
    let mut motions = motions(situation, robot, reach, spec, &mut rng(Stream::Motion));
    let plain = Spec { secrets: Vec::new(), ..spec.clone() };
    let (mut full, mut kinds) = draw_ordinary(&plain, robot, &motions, &mut plant_rng);
    if spec.suite == Suite::WideRight && plant_rng.chance(BARE) {
        full = bare(&full);
        kinds.clear();
    }
    let times: Vec<Vec<f64>> = motions.iter().map(|motion| even_times(motion, SIZE_RATE)).collect();
    let survey = survey(robot, &full, &motions, &times, reach);
    let mut sensors = Sensors::draw(&robot.tree, &survey.torque, &mut plant_rng);
    let rms: [&[f64]; 2] = [&survey.torque, &survey.speed];
    let logging = Logging::draw(situation, &robot.tree, rms, &mut sensors, &mut rng(Stream::Situation));
    sensors.logging = Some(logging);
    let turning = match situation {
        Situation::SoftBristles => Turning::SoftBristles,
        Situation::SoftConstraint => Turning::SoftConstraint,
        _ if situation.rests() && plant_rng.chance(0.6) => Turning::StiffBristles,
        _ => Turning::OverASpeed,
    };
    let mut still = Vec::new();
    if situation == Situation::StillJoints {
        // Sizes are drawn from the motion that these joints could make.
        let mut joints: Vec<usize> = (0..robot.joints()).collect();
        still = (0..1 + plant_rng.index(robot.joints().div_ceil(2)))
            .map(|_| joints.swap_remove(plant_rng.index(joints.len())))
            .map(|joint| (joint, motions[0].state(joint, motions[0].start)[0]))
            .collect();
        motions.iter_mut().for_each(|motion| motion.keep_still(&still));
    }
    let families: Vec<Secret> =
        kinds.iter().map(|kind| family(*kind, spec, &full, &survey.speed, turning, &mut plant_rng)).collect();
    let mut case = Case {
        spec: spec.clone(),
        robot,
        rejected: attempt,
        ordinary: bare(&full),
        declared: kinds,
        secrets: Vec::new(),
        motions,
        clean_motions: Vec::new(),
        sensors,
        plant: families,
        still,
        attempt,
    };
    let mut secrets = if spec.friction_declared { Vec::new() } else { std::mem::take(&mut case.plant) };
    if !spec.friction_declared {
        case.declared.clear();
    }
    let families = secrets.len();
    let most = EFFECTS_PER_JOINT * robot.joints();
    for &name in spec.secrets.iter().take(most) {
        let drawn = (0..ATTEMPTS).find_map(|_| {
            one_more(name, &case, &full, &survey, &times, &secrets[families..], &mut secret_rng)
        });
        match (drawn, name) {
            (Some(secret), _) => secrets.push(secret),
            (None, Name::Outside(_)) => return None,
            (None, Name::Catalogue(_)) => {}
        }
    }
    case.secrets = weighed(&secrets, &case, &full);
    let seen =
        |drawn: &Drawn| matches!(drawn.secret.name, Name::Catalogue(_)) || drawn.visible >= VISIBLE_OUTSIDE;
    case.secrets.iter().all(seen).then_some(case)
}

/// No friction and no rotors; only the width of signs stays.
fn bare(full: &Ordinary) -> Ordinary {
    let none = || vec![0.0; full.viscous.len()];
    Ordinary { viscous: none(), coulomb: none(), rotor: none(), offset: none(), ..full.clone() }
}

fn motions(
    situation: Situation,
    robot: &Robot,
    reach: Option<Reach>,
    spec: &Spec,
    rng: &mut CaseRng,
) -> Vec<Trajectory> {
    let tree = &robot.tree;
    match situation {
        Situation::SlowToFast => {
            let factor = rng.uniform(FASTER[0], FASTER[1]);
            let mut motions: Vec<Trajectory> = STARTS
                .into_iter()
                .map(|start| tamed(robot, Trajectory::fourier(tree, rng, start, DURATION, reach), reach))
                .collect();
            let fast = speed(robot, &motions[2]);
            for motion in &mut motions[..2] {
                motion.slow_down(factor * (speed(robot, motion) / fast).max(1.0));
            }
            motions
        }
        Situation::Periodic => {
            let mut motions: Vec<Trajectory> = STARTS
                .into_iter()
                .map(|start| tamed(robot, Trajectory::periodic(tree, rng, start, DURATION, reach), reach))
                .collect();
            if rng.chance(0.5) {
                motions[1] = Trajectory { start: STARTS[1], ..motions[0].clone() };
            }
            motions
        }
        Situation::Rests | Situation::Mixed => {
            let together = rng.chance(0.5);
            let draw = |start| {
                tamed(robot, Trajectory::with_rests(tree, rng, start, DURATION, reach, together), reach)
            };
            STARTS.into_iter().map(draw).collect()
        }
        Situation::Sticking => {
            let mut motions = draw_motions(robot, reach, false, rng);
            let share = rng.log_uniform(STICKING[0], STICKING[1]);
            motions.iter_mut().for_each(|motion| motion.stick(share));
            motions
        }
        Situation::Strokes => {
            let draw = |start| tamed(robot, Trajectory::strokes(tree, rng, start, DURATION, reach), reach);
            STARTS.into_iter().map(draw).collect()
        }
        Situation::MovingAlike => {
            let draw = |start| tamed(robot, Trajectory::alike(tree, rng, start, DURATION, reach), reach);
            STARTS.into_iter().map(draw).collect()
        }
        Situation::InTurn => {
            let moves = MOVES_IN_TURN[0] + rng.index(MOVES_IN_TURN[1] - MOVES_IN_TURN[0] + 1);
            let mut start = 0.0;
            let draw = |_| {
                let motion = tamed(robot, Trajectory::in_turn(tree, rng, start, moves, reach), reach);
                start += motion.duration + 5.0;
                motion
            };
            STARTS.iter().map(draw).collect()
        }
        Situation::ShortLogs => {
            let duration = rng.uniform(SHORT[0], SHORT[1]);
            let draw = |start| tamed(robot, Trajectory::fourier(tree, rng, start, duration, reach), reach);
            STARTS.into_iter().map(draw).collect()
        }
        // Bristles hold a force at rest: that belongs to the situations with rests.
        _ => draw_motions(robot, reach, spec.has(Kind::StribeckFriction), rng),
    }
}

/// Root mean square over joints and time of the speed as a share of each joint's limit.
pub fn speed(robot: &Robot, motion: &Trajectory) -> f64 {
    let states = States::of_motion(motion, &even_times(motion, 25.0));
    let square = |sample: usize| -> f64 {
        let share = |joint| states.v(sample, joint) / robot.tree.joint(joint).limits.velocity;
        (0..robot.joints()).map(|joint| share(joint).powi(2)).sum()
    };
    let sum: f64 = (0..states.samples()).map(square).sum();
    (sum / (states.samples() * robot.joints()) as f64).sqrt()
}

/// A family on all joints; an undeclared one also on the proximal joints only, or on all but one.
fn family(
    kind: Kind,
    spec: &Spec,
    full: &Ordinary,
    speed: &[f64],
    turning: Turning,
    rng: &mut CaseRng,
) -> Secret {
    let count = speed.len();
    let choice = rng.uniform(0.0, 1.0);
    let except = rng.index(count);
    let joints: Vec<usize> = match choice {
        _ if spec.friction_declared || count < 4 => (0..count).collect(),
        c if c < 0.7 => (0..count).collect(),
        c if c < 0.85 => (0..count.div_ceil(2)).collect(),
        _ => (0..count).filter(|joint| *joint != except).collect(),
    };
    let family = Family::draw(kind, full, &joints, speed, turning, rng);
    Secret { name: Name::Catalogue(kind), joints, form: Form::Family(family), scale: 1.0 }
}

/// One effect more, on a joint where none of the others is too much like it.
fn one_more(
    name: Name,
    case: &Case,
    full: &Ordinary,
    survey: &Survey,
    times: &[Vec<f64>],
    others: &[Secret],
    rng: &mut CaseRng,
) -> Option<Secret> {
    let tree = &case.robot.tree;
    let joint = match (name, survey.reach) {
        (Name::Catalogue(Kind::EndStop), Some(reach)) => reach.joint,
        _ => rng.index(tree.joint_count()),
    };
    let (mut joints, form, scale) = match name {
        Name::Catalogue(kind) => catalogue(kind, joint, survey, rng)?,
        Name::Outside(stranger) => outside(stranger, joint, survey, rng)?,
    };
    joints.sort_unstable();
    let nested = |other: &Secret| match (name, other.name) {
        (Name::Catalogue(kind), Name::Catalogue(other_kind)) => {
            kind.is_nested_with(other_kind) && other.joints.iter().any(|joint| joints.contains(joint))
        }
        _ => other.joints.iter().any(|joint| joints.contains(joint)),
    };
    if others.iter().any(nested) {
        return None;
    }
    let mut secret = Secret { name, joints, form, scale };
    let size = secret.calibrate(rng.log_uniform(SIZES[0], SIZES[1]), tree, full, &case.motions, times);
    ((0.98 * SIZES[0]..=1.02 * SIZES[1]).contains(&size)
        && felt_in_every_log(&secret, tree, full, &case.motions, times))
    .then_some(secret)
}

/// Sizes of all secrets, and what each of them leaves that no mix of the others can absorb. An effect is what
/// the logs lack without it: a gain multiplies the friction that the plant has, and not another.
fn weighed(secrets: &[Secret], case: &Case, full: &Ordinary) -> Vec<Drawn> {
    let (tree, sensors) = (&case.robot.tree, &case.sensors);
    let joints = tree.joint_count();
    let rate = if joints > 10 { 6.0 } else { 20.0 };
    let records = |ordinary: &Ordinary, secrets: &[&Secret]| -> Vec<Record> {
        let one = |motion: &Trajectory| record(tree, ordinary, secrets, motion, &even_times(motion, rate));
        case.motions[..2].iter().map(one).collect()
    };
    // Torque of the plant beside the rigid body's, of all secrets but one; or of those that are not about the
    // moment at which a torque is logged: what is late is late with all that the rigid body has.
    let is_late = |secret: &Secret| matches!(secret.form, Form::Delay | Form::ClockDrift);
    let beside_rigid = |left_out: Option<usize>, late: bool| -> Vec<f64> {
        let others = secrets.iter().enumerate().filter(|(index, _)| Some(*index) != left_out);
        let others = others.map(|(_, secret)| secret).filter(|secret| late || !is_late(secret));
        let plant: Vec<&Secret> = case.plant.iter().chain(others).collect();
        let added = |record: Record| -> Vec<f64> {
            record.torque.iter().zip(&record.ideal).map(|(torque, ideal)| torque - ideal).collect()
        };
        records(&case.ordinary, &plant).into_iter().flat_map(added).collect()
    };
    let without = records(full, &[]);
    let whole = [false, true].map(|late| beside_rigid(None, late));
    let mut absorber = Absorber::new(tree, full, &case.declared, &without, &sensors.torque_noise);
    let has = |kinds: &[Kind], joint: usize| {
        let one_of = |secret: &Secret| kinds.iter().any(|kind| secret.name == Name::Catalogue(*kind));
        secrets.iter().any(|secret| one_of(secret) && secret.joints.contains(&joint))
    };
    // A spring's place of rest says what an offset would.
    let offset_is_own = |joint: usize| {
        has(&[Kind::TorqueOffset], joint) && !has(&[Kind::JointSpring, Kind::GravityBalancer], joint)
    };
    for joint in (0..joints).filter(|joint| !offset_is_own(*joint)) {
        absorber.add_shape(&without, joint, &|_, _, _| 1.0);
    }
    let ideal: Vec<f64> = without.iter().flat_map(|record| record.ideal.iter().copied()).collect();
    let square = |values: &[f64], joint: usize| -> f64 {
        values.iter().skip(joint).step_by(joints).map(|value| value * value).sum()
    };
    // Of a family one column for each joint, of the others one.
    let mut columns: Vec<Vec<f64>> = Vec::new();
    let mut owners: Vec<(usize, Option<usize>, f64)> = Vec::new();
    for (index, secret) in secrets.iter().enumerate() {
        let late = is_late(secret);
        let others = beside_rigid(Some(index), late);
        let effect: Vec<f64> =
            whole[usize::from(late)].iter().zip(others).map(|(whole, others)| whole - others).collect();
        let size = |joint: usize| (square(&effect, joint) / square(&ideal, joint)).sqrt();
        if matches!(secret.form, Form::Family(_)) {
            for &joint in &secret.joints {
                let own = effect.iter().enumerate();
                columns
                    .push(own.map(|(row, value)| if row % joints == joint { *value } else { 0.0 }).collect());
                owners.push((index, Some(joint), size(joint)));
            }
        } else {
            owners.push((index, None, (0..joints).map(size).fold(0.0, f64::max)));
            columns.push(effect);
        }
    }
    let visible_in = |columns| visible_beside_others(&absorber, columns, ideal.len() / joints);
    let mut visible = visible_in(columns.clone());
    // A gain that the others make up for is no reason not to name them.
    let is_made_up_for =
        |place: usize| matches!(secrets[owners[place].0].form, Form::Gain) && visible[place] < VISIBLE;
    let told: Vec<usize> = (0..owners.len()).filter(|place| !is_made_up_for(*place)).collect();
    if told.len() < owners.len() {
        let again = visible_in(told.iter().map(|place| std::mem::take(&mut columns[*place])).collect());
        told.iter().zip(again).for_each(|(place, again)| visible[*place] = again);
    }
    let duration = case.motions[..2].iter().map(|motion| motion.duration).sum();
    let rows = effective_rows(sensors, duration);
    let material = |place: usize| {
        let (index, joint, size) = owners[place];
        // Friction that differs with the direction may well be named instead of what both directions have in
        // common.
        let common = [Kind::ViscousFriction, Kind::CoulombFriction]
            .iter()
            .any(|kind| secrets[index].name == Name::Catalogue(*kind));
        let contained = common && joint.is_some_and(|joint| has(&[Kind::AsymmetricFriction], joint));
        // What is constant is a part of zeros that are others in each log.
        let is_offset = secrets[index].name == Name::Catalogue(Kind::TorqueOffset);
        let is_zero = is_offset && case.spec.situation == Some(Situation::ShiftingZeros);
        !contained
            && !is_zero
            && size >= 0.9 * SIZES[0]
            && visible[place] >= VISIBLE
            && visible[place] * rows.sqrt() >= CERTAIN
    };
    let weigh = |(index, secret): (usize, &Secret)| {
        let places = || (0..owners.len()).filter(|place| owners[*place].0 == index);
        let material: Vec<usize> = places()
            .filter(|place| material(*place))
            .flat_map(|place| owners[place].1.map_or_else(|| secret.joints.clone(), |joint| vec![joint]))
            .collect();
        let size = places().map(|place| owners[place].2).fold(0.0, f64::max);
        let visible = places().map(|place| visible[place]).fold(0.0, f64::max);
        Drawn { secret: secret.clone(), size, visible, material }
    };
    secrets.iter().enumerate().map(weigh).collect()
}

/// Rows of so much training motion \[s\] that tell as much as independent ones would.
fn effective_rows(sensors: &Sensors, duration: f64) -> f64 {
    let corner = sensors.logging.as_ref().and_then(|logging| {
        logging.filter.map(|filter| filter.corner).or(logging.smoothing.map(Smoothing::corner))
    });
    let memory = corner.map_or(0.0, |corner| 1.0 / (std::f64::consts::TAU * corner));
    let correlation_time = sensors.correlation_time.max(memory);
    let kept = if correlation_time > 0.0 { (-1.0 / (sensors.rate * correlation_time)).exp() } else { 0.0 };
    duration * sensors.rate * (1.0 - kept) / (1.0 + kept)
}
