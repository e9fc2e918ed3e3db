//! What a case must be, whatever its seed.

use super::case::{Case, SIZES, even_times};
use super::kind::{Kind, Name};
use super::plant::{Record, record};
use super::rng::{CaseRng, Stream};
use super::robot::{Robot, robots};
use super::saturation::CLIPPED;
use super::secret::{Form, Secret};
use super::sensors::{Clock, Sensors};
use super::situation::Situation;
use super::suite::{Seeds, Spec, Suite};
use phiw_dynamics::Workspace;
use std::collections::BTreeSet;

fn models() -> Vec<Robot> {
    robots().expect("the models read")
}

fn spec(suite: Suite, index: usize) -> Spec {
    Spec::of_seed(suite.seed(Seeds::Dev, index), 5).expect("every suite has a case of every index")
}

fn draw<'a>(spec: &Spec, robots: &'a [Robot]) -> Case<'a> {
    Case::draw(spec, robots).unwrap_or_else(|| panic!("no robot can have {spec:?}"))
}

/// What a perfect logger sees of the first log.
fn first_record(case: &Case, secrets: &[&Secret]) -> Record {
    let motion = &case.motions[0];
    record(&case.robot.tree, &case.ordinary, secrets, motion, &even_times(motion, 50.0))
}

#[test]
fn the_same_seed_gives_the_same_bytes() {
    let robots = models();
    for spec in [spec(Suite::One, 3), spec(Suite::Two, 1), spec(Suite::Control, 2)] {
        assert_eq!(draw(&spec, &robots).logs(), draw(&spec, &robots).logs(), "{spec:?}");
    }
    assert_ne!(
        draw(&spec(Suite::Control, 0), &robots).logs(),
        draw(&spec(Suite::Control, 5), &robots).logs()
    );
}

/// Sizes as asked, named joints that exist, felt in the held model's logs only.
fn check(suite: Suite, indices: std::ops::Range<usize>) {
    let robots = models();
    for index in indices {
        let spec = spec(suite, index);
        let case = draw(&spec, &robots);
        assert_eq!(case.secrets.len(), spec.secrets.len());
        assert_eq!(case.motions.len() + case.clean_motions.len(), if spec.held { 6 } else { 3 });
        let times: Vec<Vec<f64>> = case.motions.iter().map(|motion| even_times(motion, 100.0)).collect();
        for drawn in &case.secrets {
            let Secret { name, joints, .. } = &drawn.secret;
            let size = drawn.secret.size(&case.robot.tree, &case.ordinary, &case.motions, &times);
            if !(spec.suite == Suite::LargeGains && *name == Name::Catalogue(Kind::TorqueGain)) {
                assert!((0.97 * SIZES[0]..=1.03 * SIZES[1]).contains(&size), "{spec:?}: {size}");
            }
            assert!(joints.is_sorted() && joints.iter().all(|&joint| joint < case.robot.joints()));
            assert_eq!(joints.is_empty(), *name == Name::Catalogue(Kind::GravityTilt), "{spec:?}");
            if let Name::Catalogue(kind) = name {
                let declared_too = case.declared.contains(kind) && !spec.held;
                assert!(!declared_too, "{kind:?} is declared and secret");
            }
        }
    }
}

#[test]
fn every_kind_is_drawn_in_its_size() {
    check(Suite::One, 0..23);
    check(Suite::Two, 0..6);
    check(Suite::Three, 0..3);
    check(Suite::Outside, 0..8);
    check(Suite::NewKinds, 0..4);
    check(Suite::LargeGains, 0..4);
    check(Suite::NewStrangers, 0..6);
    check(Suite::LaterStrangers, 0..4);
    check(Suite::NewForms, 0..5);
}

/// Stamps of all other cases count from the start of the session.
#[test]
fn stamps_of_new_forms_begin_with_each_log_or_count_from_long_before() {
    let robots = models();
    let first_stamps = |index| -> Vec<f64> {
        let case = draw(&spec(Suite::NewForms, index), &robots);
        let first = |(_, log): &(&str, String)| {
            log.lines().nth(1).unwrap().split(',').next().unwrap().parse().unwrap()
        };
        case.logs().iter().map(first).collect()
    };
    let near = |stamps: Vec<f64>, expected: [f64; 3]| {
        assert!(stamps.iter().zip(expected).all(|(stamp, start)| (stamp - start).abs() < 0.1), "{stamps:?}");
    };
    near(first_stamps(0), [0.0; 3]);
    near(first_stamps(1), [20_000.0, 20_025.0, 20_050.0]);
    near(first_stamps(2), [0.0, 25.0, 50.0]);
}

/// Small gains are drawn in the other suites; what is linear about one is not about a half or two.
#[test]
fn large_gains_are_of_a_third_to_three_beside_another_effect_in_one_case_of_three() {
    let robots = models();
    let mut above = 0;
    for index in 0..15 {
        let spec = spec(Suite::LargeGains, index);
        assert_eq!(spec.secrets.len(), if index >= 10 { 2 } else { 1 });
        let case = draw(&spec, &robots);
        let factor = 1.0 + case.secrets[0].secret.scale;
        assert!((1.6..3.0).contains(&factor) || (1.6..3.0).contains(&(1.0 / factor)), "{factor}");
        assert_eq!(case.secrets[0].secret.name, Name::Catalogue(Kind::TorqueGain));
        above += usize::from(factor > 1.0);
    }
    assert!((3..=12).contains(&above));
}

#[test]
fn several_secrets_are_distinct_and_not_nested() {
    for suite in [Suite::Two, Suite::Three, Suite::NewKinds, Suite::LargeGains, Suite::NewForms] {
        for index in 0..300 {
            let kinds: Vec<Kind> = spec(suite, index)
                .secrets
                .iter()
                .filter_map(|name| if let Name::Catalogue(kind) = name { Some(*kind) } else { None })
                .collect();
            for (position, kind) in kinds.iter().enumerate() {
                assert!(!kinds[..position].iter().any(|other| kind.is_nested_with(*other)), "{kinds:?}");
            }
        }
    }
}

#[test]
fn suites_and_seeds_do_not_overlap() {
    let mut seen = BTreeSet::new();
    for seeds in [Seeds::Dev, Seeds::Report] {
        for suite in Suite::ALL {
            let later = Situation::later_indices(suite.later_each());
            for index in (0..suite.full_count()).chain(later) {
                let seed = suite.seed(seeds, index);
                assert!(seen.insert(seed));
                assert_eq!(Spec::of_seed(seed, 5).map(|spec| spec.suite), Some(suite));
            }
        }
    }
    assert_eq!(seen.len(), 2 * (1000 + 1170 + 120 + 120 + 120 + 40 + 90 + 782));
}

/// Kinds that came to the catalogue later took the places of others in all cases that were drawn before.
#[test]
fn a_new_kind_changes_no_case_of_the_other_suites() {
    for suite in Suite::ALL {
        for index in 0..100 {
            let spec = spec(suite, index);
            let is_new = |name: &Name| Kind::NEW.iter().any(|kind| *name == Name::Catalogue(*kind));
            assert_eq!(spec.secrets.iter().any(is_new), suite == Suite::NewKinds, "{}", spec.seed);
        }
    }
    let kinds = (0..23).map(|index| spec(Suite::One, index).secrets[0].name()).collect::<Vec<_>>();
    assert_eq!(kinds.first().map(String::as_str), Some("viscous_friction"));
    assert_eq!(kinds.last().map(String::as_str), Some("actuator_saturation"));
    assert_eq!(spec(Suite::One, 23).secrets, spec(Suite::One, 0).secrets);
}

/// Without its secrets, a robot's torque is M(q)·q̈ + h(q, q̇) and the declared friction, term by term.
#[test]
fn what_is_not_secret_is_the_declared_model() {
    let robots = models();
    for index in 0..5 {
        let case = draw(&spec(Suite::Control, index), &robots);
        let (tree, n) = (&case.robot.tree, case.robot.joints());
        let record = first_record(&case, &[]);
        let mut workspace = Workspace::new(tree);
        let (mut mass, mut bias, zero) = (vec![0.0; n * n], vec![0.0; n], vec![0.0; n]);
        for sample in (0..record.times.len()).step_by(37) {
            let [q, v, a] = record.states.at(sample);
            tree.mass_matrix(q, &mut workspace, &mut mass).expect("sizes fit");
            tree.inverse_dynamics(q, v, &zero, &mut workspace, &mut bias).expect("sizes fit");
            for joint in 0..n {
                let inertial: f64 = (0..n).map(|other| mass[joint * n + other] * a[other]).sum();
                let ordinary = &case.ordinary;
                let friction = ordinary.viscous[joint] * v[joint]
                    + ordinary.coulomb[joint] * ordinary.smoothing.of(v[joint], ordinary.width)
                    + ordinary.rotor[joint] * a[joint]
                    + ordinary.offset[joint];
                let expected = inertial + bias[joint] + friction;
                let found = record.torque[sample * n + joint];
                assert!((found - expected).abs() < 1e-9 * (1.0 + expected.abs()), "{found} {expected}");
                assert_eq!(found, record.ideal[sample * n + joint]);
            }
        }
    }
}

/// A secret that adds torque adds it on its own joints only, in proportion to its scale.
#[test]
fn secrets_stay_on_their_joints() {
    let robots = models();
    for index in [0, 1, 2, 4, 7, 10, 11, 12, 17, 18, 20] {
        let case = draw(&spec(Suite::One, index), &robots);
        let secret = &case.secrets[0].secret;
        let record = first_record(&case, &[secret]);
        let doubled = first_record(&case, &[&Secret { scale: 2.0 * secret.scale, ..secret.clone() }]);
        for joint in 0..case.robot.joints() {
            let mine = secret.joints.contains(&joint);
            for (once, twice) in record.effect(joint).zip(doubled.effect(joint)) {
                assert!(mine || once == 0.0, "{secret:?}");
                assert!((twice - 2.0 * once).abs() < 1e-6 * (1.0 + once.abs()), "{secret:?}: {once} {twice}");
            }
        }
    }
}

#[test]
fn late_torque_is_the_torque_of_earlier() {
    let robots = models();
    let case = draw(&spec(Suite::One, Kind::TimeDelay as usize), &robots);
    let secret = &case.secrets[0].secret;
    let (motion, n) = (&case.motions[1], case.robot.joints());
    let times: Vec<f64> = (0..100).map(|k| motion.start + 2.0 + 0.1 * f64::from(k)).collect();
    let earlier: Vec<f64> = times.iter().map(|time| time - secret.scale).collect();
    let late = record(&case.robot.tree, &case.ordinary, &[secret], motion, &times);
    let prompt = record(&case.robot.tree, &case.ordinary, &[], motion, &earlier);
    for row in 0..times.len() {
        for &joint in &secret.joints {
            assert_eq!(late.torque[row * n + joint], prompt.torque[row * n + joint]);
        }
    }
}

#[test]
fn an_elastic_joints_motor_is_where_its_spring_says() {
    let robots = models();
    let case = draw(&spec(Suite::One, Kind::JointElasticity as usize), &robots);
    let secret = &case.secrets[0].secret;
    let (joint, motion, step) = (secret.joints[0], &case.motions[0], 1e-3);
    let times: Vec<f64> = (0..3000).map(|k| motion.start + 5.0 + step * f64::from(k)).collect();
    let elastic = record(&case.robot.tree, &case.ordinary, &[secret], motion, &times).states;
    let link = super::plant::States::of_motion(motion, &times);
    let torque = super::plant::rigid_torque(&link, |_| &case.robot.tree);
    let scale = (0..times.len()).map(|k| elastic.a(k, joint).abs()).fold(0.0, f64::max);
    for k in 1..times.len() - 1 {
        let deflection = elastic.q(k, joint) - link.q(k, joint);
        let spring = secret.scale * torque[k * case.robot.joints() + joint];
        assert!((deflection - spring).abs() < 1e-12 + 1e-9 * spring.abs());
        let rate = (elastic.q(k + 1, joint) - elastic.q(k - 1, joint)) / (2.0 * step);
        assert!((elastic.v(k, joint) - rate).abs() < 1e-3 * scale.max(1.0));
        let second = (elastic.v(k + 1, joint) - elastic.v(k - 1, joint)) / (2.0 * step);
        assert!((elastic.a(k, joint) - second).abs() < 0.01 * scale.max(1.0));
    }
}

#[test]
fn a_saturated_actuator_delivers_no_more_than_its_limit() {
    let robots = models();
    let case = draw(&spec(Suite::One, Kind::ActuatorSaturation as usize), &robots);
    let secret = &case.secrets[0].secret;
    assert!(matches!(secret.form, Form::Saturation));
    let (joint, n) = (secret.joints[0], case.robot.joints());
    let (mut clipped, mut samples) = (0, 0);
    for motion in &case.motions {
        let times: Vec<f64> = (0..20_000).map(|k| motion.start + 1e-3 * f64::from(k)).collect();
        let record = record(&case.robot.tree, &case.ordinary, &[secret], motion, &times);
        for sample in 5..times.len() - 5 {
            let [commanded, delivered] =
                [&record.torque, &record.ideal].map(|torque| torque[sample * n + joint]);
            // Delivered is what the simulated motion needs: the integration's error is in it, most where
            // friction turns.
            assert!(delivered.abs() < 1.1 * secret.scale, "{delivered} of {}", secret.scale);
            if commanded.abs() > secret.scale {
                clipped += 1;
                assert!((delivered - secret.scale.copysign(commanded)).abs() < 0.1 * secret.scale);
            } else {
                assert!((commanded - delivered).abs() < 0.1 * secret.scale, "{commanded} {delivered}");
            }
            samples += 1;
        }
    }
    let share = f64::from(clipped) / f64::from(samples);
    assert!((0.8 * CLIPPED[0]..=1.2 * CLIPPED[1]).contains(&share), "{share}");
}

fn sensors(clock: Clock, correlation_time: f64) -> Sensors {
    Sensors {
        rate: 500.0,
        torque_noise: vec![0.5, 0.2],
        correlation_time,
        quantum: vec![1e-4, 3e-5],
        angle_noise: 0.0,
        clock,
        logging: None,
    }
}

#[test]
fn clocks_jitter_as_asked() {
    let check = |clock: Clock, samples_jitter: bool, stamps_jitter: bool| {
        let mut rng = CaseRng::new(7, 0, Stream::Sensors);
        let all = sensors(clock, 0.0).times(25.0, 20.0, &mut rng);
        for (times, jitters) in all.iter().zip([samples_jitter, stamps_jitter]) {
            assert_eq!(times.len(), 10_000);
            assert!(times.windows(2).all(|pair| pair[0] < pair[1]) && times[0] >= 25.0);
            let largest = (0..10_000).map(|k| (times[k] - 25.0 - k as f64 / 500.0).abs()).fold(0.0, f64::max);
            assert!(
                if jitters { largest > 0.0003 && largest <= 0.0004 } else { largest < 1e-9 },
                "{clock:?}: {largest}"
            );
        }
        assert_eq!(all[0] == all[1], samples_jitter == stamps_jitter);
    };
    check(Clock::Even, false, false);
    check(Clock::Truthful(0.2), true, true);
    check(Clock::JitteredSamples(0.2), true, false);
    check(Clock::JitteredStamps(0.2), false, true);
}

/// What the log holds beyond the perfect record: half a quantum of angle, and noise of the right size and
/// memory.
#[test]
fn logs_are_quantised_and_noisy_as_asked() {
    let robots = models();
    let control = draw(&spec(Suite::Control, 0), &robots[..1]);
    let (tree, motion) = (&control.robot.tree, &control.motions[0]);
    for correlation_time in [0.0, 0.02] {
        let sensors = sensors(Clock::Even, correlation_time);
        let mut rng = CaseRng::new(3, 0, Stream::Sensors);
        let [times, stamps] = sensors.times(motion.start, motion.duration, &mut rng);
        let record = record(tree, &control.ordinary, &[], motion, &times);
        let log = sensors.log(tree, &record, &stamps, &mut rng);
        let mut lines = log.lines();
        assert_eq!(lines.next(), Some("t,q.joint_1,q.joint_2,tau.joint_1,tau.joint_2"));
        let rows: Vec<Vec<f64>> =
            lines.map(|line| line.split(',').map(|cell| cell.parse().expect("a number")).collect()).collect();
        assert_eq!(rows.len(), times.len());
        for joint in 0..2 {
            let quantum = sensors.quantum[joint];
            let noise: Vec<f64> = rows
                .iter()
                .enumerate()
                .map(|(sample, row)| {
                    let place = row[1 + joint] / quantum;
                    assert!((place - place.round()).abs() < 1e-3);
                    assert!((row[1 + joint] - record.states.q(sample, joint)).abs() < 0.501 * quantum);
                    (row[3 + joint] - record.torque[sample * 2 + joint]) / sensors.torque_noise[joint]
                })
                .collect();
            let power: f64 = noise.iter().map(|value| value * value).sum::<f64>() / noise.len() as f64;
            let lag: f64 =
                noise.windows(2).map(|pair| pair[0] * pair[1]).sum::<f64>() / noise.len() as f64 / power;
            let expected = if correlation_time > 0.0 { (-0.002_f64 / correlation_time).exp() } else { 0.0 };
            assert!((power - 1.0).abs() < 0.2, "{power}");
            assert!((lag - expected).abs() < 0.04, "{lag} {expected}");
        }
    }
}

#[test]
fn a_twin_without_secrets_keeps_motion_and_noise() {
    let robots = models();
    let case = draw(&spec(Suite::One, 0), &robots);
    let twin = case.without_secrets();
    let own = 1 + case.robot.joints() + case.secrets[0].secret.joints[0];
    for ((name, log), (_, twin)) in case.logs().iter().zip(&twin.logs()) {
        for (row, other) in log.lines().zip(twin.lines()).skip(1).step_by(100) {
            for (column, (cell, other)) in row.split(',').zip(other.split(',')).enumerate() {
                assert!(cell == other || column == own, "{name}, column {column}");
            }
        }
        assert_ne!(log, twin);
    }
}
