//! What a case of the widened suites must be: each situation does to the log what its name says.

use super::case::{Case, even_times};
use super::kind::{Kind, Name};
use super::logging::{DriveFilter, Logging, Tails, VelocityColumn};
use super::plant::{Record, States, record};
use super::rng::{CaseRng, Stream};
use super::robot::{Robot, robots};
use super::run::Scored;
use super::score::Score;
use super::secret::Secret;
use super::situation::Situation;
use super::suite::{Seeds, Spec, Suite};
use super::trajectory::Trajectory;
use super::truth::Truth;
use super::wide::speed;
use super::wide_table::reliability;

pub(super) fn models() -> Vec<Robot> {
    robots().expect("the models read")
}

fn draw(suite: Suite, index: usize, robots: &[Robot]) -> Case<'_> {
    let spec = Spec::of_seed(suite.seed(Seeds::Dev, index), 5).expect("every index has a case");
    Case::draw(&spec, robots).unwrap_or_else(|| panic!("no robot can have {spec:?}"))
}

/// The right model of a situation on the smallest robot.
pub(super) fn small(situation: Situation, number: usize, robots: &[Robot]) -> Case<'_> {
    let all = (0..1000).chain(Situation::later_indices(30));
    let mut own = all.filter(|index| Situation::of_index(*index) == situation);
    let index = own.nth(number).expect("each situation has thirty cases and more");
    let spec = Spec::of_seed(Suite::WideRight.seed(Seeds::Dev, index), 5).expect("every index has a case");
    Case::draw(&Spec { robot: 0, ..spec }, &robots[..1]).expect("a right model can always be drawn")
}

fn logging() -> Logging {
    Logging {
        tails: Tails::Normal,
        filter: None,
        smoothing: None,
        velocity: None,
        differenced: None,
        dead_band: vec![0.0; 2],
        torque_step: vec![0.0; 2],
        held_samples: 1,
        torque_zero: Vec::new(),
        held_positions: Vec::new(),
        pushes: Vec::new(),
        rough: None,
    }
}

pub(super) fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0.0), |(sum, count), value| (sum + value, count + 1.0));
    sum / count
}

/// Columns of a log's text by name.
pub(super) fn column(log: &str, name: &str) -> Vec<f64> {
    let mut lines = log.lines();
    let header = lines.next().expect("a header");
    let place =
        header.split(',').position(|other| other == name).unwrap_or_else(|| panic!("{name}: {header}"));
    lines.map(|line| line.split(',').nth(place).expect("a cell").parse().expect("a number")).collect()
}

#[test]
fn noise_has_the_correlation_time_that_it_says() {
    let times: Vec<f64> = (0..400_000).map(|k| 0.002 * f64::from(k)).collect();
    for correlation_time in [0.0_f64, 0.005, 0.05, 0.3, 1.0] {
        let noise = logging().noise(&times, correlation_time, &mut CaseRng::new(1, 0, Stream::Sensors));
        let power = mean(noise.iter().map(|value| value * value));
        assert!((power - 1.0).abs() < 0.15, "{correlation_time}: {power}");
        // About one correlation time apart.
        let lag = ((correlation_time / 0.002) as usize).max(1);
        let elapsed = 0.002 * lag as f64;
        let expected = if correlation_time > 0.0 { (-elapsed / correlation_time).exp() } else { 0.0 };
        let found = mean(noise.iter().zip(&noise[lag..]).map(|(a, b)| a * b)) / power;
        assert!((found - expected).abs() < 0.06, "{correlation_time}: {found}");
    }
}

#[test]
fn noise_has_the_tails_that_it_says() {
    let times = vec![0.0; 200_000];
    for (tails, kurtosis) in
        [(Tails::Normal, 2.9..3.1), (Tails::Student, 6.0..1e9), (Tails::Contaminated, 44.0..54.0)]
    {
        let logging = Logging { tails, ..logging() };
        let noise = logging.noise(&times, 0.0, &mut CaseRng::new(2, 0, Stream::Sensors));
        let square = mean(noise.iter().map(|value| value * value));
        let found = mean(noise.iter().map(|value| value.powi(4))) / (square * square);
        assert!((square - 1.0).abs() < 0.1, "{tails:?}: {square}");
        assert!(kurtosis.contains(&found), "{tails:?}: {found}");
    }
}

/// A sinusoid at the corner loses half of its amplitude in two poles; only the causal filter shifts it, by a
/// quarter of a period.
#[test]
fn a_drives_filter_has_its_corner_and_its_delay() {
    let times: Vec<f64> = (0..20_000).map(|k| 5e-4 * f64::from(k)).collect();
    for causal in [false, true] {
        let filter = DriveFilter { corner: 5.0, causal };
        let phase = |time: &f64| std::f64::consts::TAU * 5.0 * time;
        let mut values: Vec<f64> = times.iter().map(|time| phase(time).sin()).collect();
        filter.apply(&times, &mut values);
        let along =
            |shape: fn(f64) -> f64| 2.0 * mean((8_000..12_000).map(|k| values[k] * shape(phase(&times[k]))));
        let [in_phase, quadrature] = [along(f64::sin), along(f64::cos)];
        let expected = if causal { [0.0, -0.5] } else { [0.5, 0.0] };
        assert!((in_phase - expected[0]).abs() < 0.02, "{causal}: {in_phase}");
        assert!((quadrature - expected[1]).abs() < 0.02, "{causal}: {quadrature}");
    }
}

#[test]
fn a_late_velocity_is_the_velocity_of_earlier() {
    let robots = models();
    let case = small(Situation::LateVelocity, 0, &robots);
    let velocity = VelocityColumn { lag: 0.15, scale: -1.0, dead_band: vec![0.0; 2], noise: vec![0.0; 2] };
    let logging = Logging { velocity: Some(velocity), ..logging() };
    let motion = &case.motions[0];
    let times = even_times(motion, 100.0);
    let record = record(&case.robot.tree, &case.ordinary, &[], motion, &times);
    let mut rng = CaseRng::new(3, 0, Stream::Sensors);
    let log = logging.log(&case.sensors, &case.robot.tree, motion, &record, &times, &mut rng);
    let qd = column(&log, "qd.joint_1");
    for sample in 15..times.len() {
        assert!((qd[sample] + record.states.v(sample - 15, 0)).abs() < 1e-5);
    }
    let drawn = case.sensors.logging.and_then(|logging| logging.velocity).expect("this is its situation");
    assert!((0.02..=0.2).contains(&drawn.lag));
}

/// Steps of the encoder are in it, and it is half a row late.
#[test]
fn a_differenced_velocity_is_the_step_of_the_logged_position() {
    let robots = models();
    let mut seen = [false; 2];
    for number in 0..6 {
        let case = small(Situation::DifferencedVelocity, number, &robots);
        let logging = case.sensors.logging.clone().expect("a wide case");
        let corner = logging.differenced.expect("this is its situation").corner;
        seen[usize::from(corner.is_some())] = true;
        let (_, log) = &case.logs()[0];
        let [t, q, qd] = ["t", "q.joint_1", "qd.joint_1"].map(|name| column(log, name));
        let share =
            |time: f64| corner.map_or(1.0, |corner| 1.0 - (-std::f64::consts::TAU * corner * time).exp());
        for row in 1..t.len() {
            let time = t[row] - t[row - 1];
            let step = (q[row] - q[row - 1]) / time;
            let expected = qd[row - 1] + share(time) * (step - qd[row - 1]);
            assert!(
                (qd[row] - expected).abs() < 1e-3 * step.abs() + 1e-5,
                "row {row}: {} {expected}",
                qd[row]
            );
        }
    }
    assert_eq!(seen, [true; 2]);
}

#[test]
fn dead_bands_and_steps_are_in_the_log() {
    let robots = models();
    let mut seen = [false; 2];
    for number in 0..6 {
        let case = small(Situation::DeadBand, number, &robots);
        let logging = case.sensors.logging.clone().expect("a wide case");
        let (_, log) = &case.logs()[0];
        let (name, band) = match &logging.velocity {
            Some(velocity) => ("qd.joint_2", velocity.dead_band[1]),
            None => ("tau.joint_2", logging.dead_band[1]),
        };
        seen[usize::from(logging.velocity.is_some())] = true;
        let values = column(log, name);
        let zeros = values.iter().filter(|value| **value == 0.0).count();
        assert!(zeros * 100 > values.len() || name.starts_with("tau"), "{name}: {zeros}");
        assert!(zeros > 0, "{name}");
        let noise = logging.velocity.map_or(0.0, |velocity| 6.0 * velocity.noise[1]);
        assert!(values.iter().all(|value| *value == 0.0 || value.abs() >= band - noise - 1e-6), "{name}");
    }
    assert_eq!(seen, [true, true], "both forms are drawn");
    let case = small(Situation::Quantised, 0, &robots);
    let step = case.sensors.logging.as_ref().expect("a wide case").torque_step[0];
    for value in column(&case.logs()[0].1, "tau.joint_1") {
        assert!((value / step - (value / step).round()).abs() < 1e-6 / step + 1e-9);
    }
}

/// Correlation times, tails, filters and noise of each situation lie where they belong.
#[test]
fn every_situation_draws_what_it_says() {
    let robots = models();
    for situation in Situation::ALL {
        for number in 0..4 {
            let case = small(situation, number, &robots);
            let logging = case.sensors.logging.as_ref().expect("a wide case");
            let time = case.sensors.correlation_time;
            let [low, high] = match situation {
                Situation::White
                | Situation::HeavyTails
                | Situation::DriveFilter
                | Situation::LateFilter
                | Situation::Quantised => [0.0, 0.0],
                Situation::ShortColour => [0.005, 0.05],
                Situation::Colour => [0.05, 0.3],
                Situation::LongColour => [0.3, 1.0],
                _ => [0.0, 0.3],
            };
            assert!((low..=high).contains(&time), "{situation:?}: {time}");
            if situation == Situation::HeavyTails {
                assert_ne!(logging.tails, Tails::Normal);
            }
            let filters = matches!(situation, Situation::DriveFilter | Situation::LateFilter);
            assert_eq!(logging.filter.is_some(), filters, "{situation:?}");
            let causal = logging.filter.is_some_and(|filter| filter.causal);
            assert_eq!(causal, situation == Situation::LateFilter);
            let log = &case.logs()[0].1;
            let has_velocity = logging.velocity.is_some() || logging.differenced.is_some();
            assert_eq!(log.starts_with("t,q.joint_1,q.joint_2,qd."), has_velocity);
            assert!(case.secrets.is_empty() && Truth::of(&case).situation == Some(situation));
        }
    }
}

/// RMS of what the plant's right model leaves of the log, over that of the torque, joint by joint.
fn noise_share(case: &Case) -> Vec<f64> {
    let motion = &case.motions[0];
    let plant: Vec<&Secret> = case.plant.iter().collect();
    let times = even_times(motion, 50.0);
    let record = record(&case.robot.tree, &case.ordinary, &plant, motion, &times);
    let joints = case.robot.joints();
    let rms = |joint: usize| {
        mean(record.torque.iter().skip(joint).step_by(joints).map(|torque| torque * torque)).sqrt()
    };
    (0..joints).map(|joint| case.sensors.torque_noise[joint] / rms(joint)).collect()
}

#[test]
fn joints_of_noise_are_mostly_noise_and_others_are_not() {
    let robots = models();
    for number in 0..5 {
        let most =
            |situation| noise_share(&small(situation, number, &robots)).into_iter().fold(0.0, f64::max);
        assert!(most(Situation::NoiseJoints) > 0.3, "{}", most(Situation::NoiseJoints));
        assert!(most(Situation::White) < 0.15, "{}", most(Situation::White));
    }
}

fn rms_speed(motion: &Trajectory, joint: usize) -> f64 {
    let states = States::of_motion(motion, &even_times(motion, 50.0));
    mean((0..states.samples()).map(|sample| states.v(sample, joint).powi(2))).sqrt()
}

#[test]
fn motions_are_slow_periodic_or_at_rest_as_asked() {
    let robots = models();
    let (mut repeated, mut one_by_one) = (false, false);
    for number in 0..6 {
        let case = small(Situation::SlowToFast, number, &robots);
        let [slow, fast] = [0, 2].map(|log| speed(case.robot, &case.motions[log]));
        assert!(fast > 2.5 * slow, "{slow} {fast}");

        let case = small(Situation::Periodic, number, &robots);
        repeated |= (rms_speed(&case.motions[0], 0) - rms_speed(&case.motions[1], 0)).abs() < 1e-9;
        let motion = &case.motions[0];
        let period = (200..=500).map(|k| f64::from(k) * 0.01).find(|period| {
            let same = |k: i32| {
                let time = motion.start + 2.0 + 0.1 * f64::from(k);
                (motion.state(0, time)[0] - motion.state(0, time + period)[0]).abs() < 0.05
            };
            (0..100).all(same)
        });
        assert!(period.is_some(), "a period of 2 to 5 s");

        let case = small(Situation::Rests, number, &robots);
        let states = States::of_motion(&case.motions[0], &even_times(&case.motions[0], 50.0));
        let moves = |sample: usize, joint: usize| states.v(sample, joint) != 0.0;
        let at_rest = (0..states.samples()).filter(|sample| !moves(*sample, 0)).count();
        assert!(at_rest * 5 > states.samples(), "{at_rest} of {}", states.samples());
        one_by_one |= (0..states.samples()).any(|sample| moves(sample, 0) != moves(sample, 1));
    }
    assert!(repeated && one_by_one, "both forms are drawn");
}

/// Families are on the joints that they say, in sizes of their own; other effects stay within their sizes,
/// and all are in the truth.
#[test]
fn many_effects_are_drawn_at_once() {
    let robots = models();
    let (mut most, mut undeclared) = (0, 0);
    for index in 0..12 {
        let case = draw(Suite::WideEffects, index, &robots[..4]);
        most = most.max(case.secrets.len());
        undeclared += usize::from(case.declared.is_empty());
        let secrets: Vec<&Secret> = case.secrets.iter().map(|drawn| &drawn.secret).collect();
        let motion = &case.motions[0];
        let times = even_times(motion, 20.0);
        let all: Record = record(&case.robot.tree, &case.ordinary, &secrets, motion, &times);
        for joint in 0..case.robot.joints() {
            let felt = all.effect(joint).any(|effect| effect != 0.0);
            let acts = |secret: &&Secret| secret.joints.contains(&joint);
            assert!(felt || !secrets.iter().any(acts), "{index}, joint {joint}");
        }
        for drawn in &case.secrets {
            assert!(drawn.material.iter().all(|joint| drawn.secret.joints.contains(joint)));
            let truth = Truth::of(&case);
            assert!(truth.secrets.iter().any(|secret| secret.kind == drawn.secret.name));
        }
        let kinds: Vec<Name> = secrets.iter().map(|secret| secret.name).collect();
        let mut distinct = kinds.clone();
        distinct.sort();
        distinct.dedup();
        assert_eq!(distinct.len(), kinds.len(), "{kinds:?}");
        if case.declared.is_empty() {
            assert_eq!(kinds[..2], [Kind::ViscousFriction, Kind::CoulombFriction].map(Name::Catalogue));
        }
    }
    assert!(most >= 6 && undeclared >= 4, "{most} {undeclared}");
}

#[test]
fn the_same_wide_seed_gives_the_same_bytes() {
    let robots = models();
    for index in [0, 4, 14] {
        let [first, second] = [0; 2].map(|_| draw(Suite::WideRight, index, &robots[..3]).logs());
        assert_eq!(first, second);
    }
}

/// A confidence that no name has was printed as true in 0 % of no names, with a mean of -0.
#[test]
fn confidence_is_told_of_names_only() {
    let robots = models();
    let truth = Truth::of(&small(Situation::White, 0, &robots));
    let scored = |judged: Vec<(f64, bool)>| {
        let score = Score {
            outcomes: Vec::new(),
            false_names: Vec::new(),
            named: Vec::new(),
            verdict: "sufficient".to_owned(),
            closed: None,
            closed_pooled: None,
            judged,
            left: None,
            floor: None,
        };
        Scored { truth: truth.clone(), score: Ok(score), seconds: 1.0 }
    };
    let text = |judged| {
        let mut text = String::new();
        reliability(&[scored(judged)], &mut text);
        text
    };
    assert!(text(Vec::new()).ends_with("no names\n\n"));
    let table = text(vec![(0.6, true), (0.96, true), (0.97, false)]);
    assert!(
        table.contains("| 0.5 to 0.7 | 1 | 0.600 | 100.0 % |\n| 0.95 to 0.99 | 2 | 0.965 | 50.0 % |\n"),
        "{table}"
    );
    assert!(!table.contains("0.7 to 0.8"), "{table}");
}

/// The old suites are a yardstick of years: their logs are what they were before there were wide ones.
#[test]
fn old_seeds_give_the_logs_that_they_always_gave() {
    let robots = models();
    for (seed, sum) in OLD_SUMS {
        let spec = Spec::of_seed(seed, 5).expect("an old seed");
        let case = Case::draw(&spec, &robots).expect("an old case");
        let (_, log) = &case.logs()[0];
        let rows = log.lines().skip(1).flat_map(|line| line.split(','));
        let found: f64 = rows.map(|cell| cell.parse::<f64>().expect("a number").abs()).sum();
        assert!((found / sum - 1.0).abs() < 1e-6, "{seed}: {found:.6}");
    }
}

/// Sum of the magnitudes of all cells of `train_a.csv`.
const OLD_SUMS: [(u64, f64); 3] =
    [(1_000_003, 588982.401526), (1_100_001, 504060.509541), (1_300_002, 579449.540858)];

/// What rubs in one direction only rubs half as much in both, and has a difference: that it is named so on a
/// joint which the family of frictions leaves out is no error.
#[test]
fn a_joint_that_rubs_in_one_direction_may_have_a_friction_of_the_family() {
    let robots = models();
    let spec = Spec::of_seed(2_600_019, 5).expect("it is one of the cases that are reported");
    let case = Case::draw(&spec, &robots).expect("it can be drawn");
    let truth = Truth::of(&case);
    let place = |kind: Kind| {
        truth.secrets.iter().position(|secret| secret.kind == Name::Catalogue(kind)).expect("it is there")
    };
    let (asymmetric, viscous) = (place(Kind::AsymmetricFriction), place(Kind::ViscousFriction));
    let joint = &truth.secrets[asymmetric].joints[0];
    let of_family = case.robot.names(&case.secrets[viscous].secret.joints);
    assert!(!of_family.contains(joint), "the family leaves {joint} out");
    assert!(truth.secrets[viscous].joints.contains(joint));
    assert!(truth.secrets[viscous].optional.contains(joint));
}
