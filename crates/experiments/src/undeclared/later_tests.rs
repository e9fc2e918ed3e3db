//! What the situations that came later must do to a log.

use super::case::{Case, DURATION, even_times};
use super::family::Shape;
use super::kind::{Kind, Name};
use super::plant::record;
use super::secret::{Form, Secret};
use super::situation::Situation;
use super::wide_tests::{column, mean, models, small};
use std::cell::Cell;
use std::collections::BTreeSet;

/// Checks three training logs of a situation on the smallest robot.
fn check(situation: Situation, holds: impl Fn(&Case, &str)) {
    let robots = models();
    for number in 0..3 {
        let case = small(situation, number, &robots);
        let log = case.logs().swap_remove(0).1;
        holds(&case, &log);
    }
}

fn period(log: &str) -> f64 {
    let stamps = column(log, "t");
    (stamps[stamps.len() - 1] - stamps[0]) / (stamps.len() - 1) as f64
}

#[test]
fn a_low_rate_is_20_to_125_samples_a_second() {
    check(Situation::LowRate, |_, log| {
        let period = period(log);
        assert!((1.0 / 126.0..1.0 / 19.0).contains(&period), "{period}");
        assert!((period * column(log, "t").len() as f64 - DURATION).abs() < 0.2);
    });
}

#[test]
fn short_logs_last_4_to_8_seconds() {
    check(Situation::ShortLogs, |case, log| {
        let stamps = column(log, "t");
        let duration = stamps[stamps.len() - 1] - stamps[0];
        assert!((3.9..8.1).contains(&duration), "{duration}");
        assert!((case.motions[2].duration - case.motions[0].duration).abs() < 1e-12);
    });
}

#[test]
fn strokes_have_a_constant_speed_most_of_their_time() {
    check(Situation::Strokes, |case, _| {
        let states = (0..4000).map(|k| case.motions[0].state(0, 0.005 * f64::from(k)));
        let moving: Vec<[f64; 3]> = states.filter(|[_, v, _]| v.abs() > 1e-9).collect();
        let steady = moving.iter().filter(|[_, _, a]| *a == 0.0).count();
        assert!(steady as f64 > 0.3 * moving.len() as f64, "{steady} of {}", moving.len());
        assert!(steady < moving.len());
    });
}

#[test]
fn joints_that_stick_creep_below_what_their_encoders_show() {
    check(Situation::Sticking, |case, log| {
        let states: Vec<[f64; 3]> =
            (0..20_000).map(|k| case.motions[0].state(0, 0.001 * f64::from(k))).collect();
        for three in states.windows(3).skip(1000) {
            assert!((three[1][1] - (three[2][0] - three[0][0]) / 0.002).abs() < 1e-3, "{three:?}");
            assert!((three[1][2] - (three[2][1] - three[0][1]) / 0.002).abs() < 0.1, "{three:?}");
        }
        let rms = mean(states.iter().map(|[_, v, _]| v * v)).sqrt();
        let mut stuck = 0;
        for slow in states.chunk_by(|[_, a, _], [_, b, _]| (a.abs() < 0.02 * rms) == (b.abs() < 0.02 * rms)) {
            let turns = slow[0][1] * slow[slow.len() - 1][1] < 0.0;
            let step = case.sensors.quantum[0];
            let way = slow.iter().map(|[q, ..]| (q - slow[0][0]).abs()).fold(0.0, f64::max);
            stuck += usize::from(turns && slow.len() >= 100 && way < 2.0 * step);
        }
        assert!(stuck >= 2, "sticks {stuck} times");
        assert!(column(log, "q.joint_1").windows(50).any(|rows| rows.iter().all(|row| *row == rows[0])));
    });
}

#[test]
fn joints_that_move_alike_follow_one_motion() {
    check(Situation::MovingAlike, |case, log| {
        let stamps = column(log, "t");
        let speeds: Vec<Vec<f64>> = (0..case.robot.joints())
            .map(|joint| stamps.iter().map(|t| case.motions[0].state(joint, *t)[1]).collect())
            .collect();
        let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        for other in &speeds[1..] {
            let alike =
                product(&speeds[0], other) / (product(&speeds[0], &speeds[0]) * product(other, other)).sqrt();
            assert!(alike.abs() > 0.8 && alike.abs() < 1.0 - 1e-9, "{alike}");
        }
    });
}

#[test]
fn in_turn_one_joint_moves_at_a_time() {
    check(Situation::InTurn, |case, log| {
        let stamps = column(log, "t");
        let motion = &case.motions[0];
        let moves: Vec<Vec<bool>> = (0..case.robot.joints())
            .map(|joint| stamps.iter().map(|t| motion.state(joint, *t)[1].abs() > 1e-9).collect())
            .collect();
        for row in 0..stamps.len() {
            assert!(moves.iter().filter(|of_joint| of_joint[row]).count() < 2, "{}", stamps[row]);
        }
        for of_joint in &moves {
            let begins = of_joint.windows(2).filter(|pair| !pair[0] && pair[1]).count();
            assert!((2..=4).contains(&begins), "{begins}");
        }
    });
}

#[test]
fn a_held_torque_changes_every_so_many_samples() {
    check(Situation::HeldTorque, |case, log| {
        let held = case.sensors.logging.as_ref().expect("a wide case").held_samples;
        assert!(held > 1 && case.sensors.rate / held as f64 >= 24.0, "{held}");
        let torque = column(log, "tau.joint_1");
        assert!(torque.chunks(held).all(|chunk| chunk.iter().all(|value| *value == chunk[0])));
        let changes = torque.chunks(held).zip(torque.chunks(held).skip(1)).filter(|(a, b)| a[0] != b[0]);
        assert!(changes.count() > torque.len() / held / 2);
    });
}

#[test]
fn held_positions_change_every_so_many_samples() {
    check(Situation::HeldPositions, |case, log| {
        let held = &case.sensors.logging.as_ref().expect("a wide case").held_positions;
        let (last, held) = (held.len() - 1, held[held.len() - 1]);
        assert!(held > 1 && case.sensors.rate / held as f64 >= 20.0, "{held}");
        let position = column(log, &format!("q.{}", case.robot.tree.joint(last).joint));
        assert!(position.chunks(held).all(|chunk| chunk.iter().all(|value| *value == chunk[0])));
        let changes = position.chunks(held).zip(position.chunks(held).skip(1)).filter(|(a, b)| a[0] != b[0]);
        assert!(changes.count() > position.len() / held / 2);
    });
}

#[test]
fn a_push_is_felt_while_it_lasts_and_at_no_other_time() {
    check(Situation::Pushes, |case, _| {
        let pushes = &case.sensors.logging.as_ref().expect("a wide case").pushes;
        assert!(!pushes.is_empty());
        let mut felt = vec![false; pushes.len()];
        for motion in &case.motions[..2] {
            let times = even_times(motion, 200.0);
            let secrets: Vec<&Secret> = case.plant.iter().collect();
            let record = record(&case.robot.tree, &case.ordinary, &secrets, motion, &times);
            let joints = case.robot.joints();
            for (push, felt) in pushes.iter().zip(&mut felt) {
                let mut added = vec![0.0; record.torque.len()];
                push.add_torque(&case.robot.tree, &record, &mut added);
                for (t, row) in times.iter().zip(added.chunks_exact(joints)) {
                    let lasts = (push.start_s..push.start_s + push.duration_s).contains(t);
                    let is_felt = row.iter().any(|torque| *torque != 0.0);
                    assert!(lasts || !is_felt, "{t}");
                    *felt |= is_felt;
                }
            }
        }
        assert!(felt.iter().all(|felt| *felt));
    });
}

/// Shapes of the families of a case.
fn shapes(case: &Case<'_>) -> Vec<Shape> {
    let of = |secret: &Secret| match &secret.form {
        Form::Family(family) => Some(family.shape.clone()),
        _ => None,
    };
    case.plant.iter().filter_map(of).collect()
}

fn rubs(case: &Case<'_>) -> bool {
    case.plant.iter().any(|secret| secret.name == Name::Catalogue(Kind::CoulombFriction))
}

#[test]
fn soft_bristles_are_of_all_joints_and_each_bends_as_far_as_its_own() {
    let seen = Cell::new(0);
    check(Situation::SoftBristles, |case, _| {
        let own = shapes(case).into_iter().filter_map(|shape| match shape {
            Shape::Bristles { distances } => Some(distances),
            _ => None,
        });
        let own: Vec<Vec<f64>> = own.collect();
        assert_eq!(own.len(), usize::from(rubs(case)));
        for distances in own {
            assert!(distances.iter().all(|distance| (1e-4..1e-3).contains(distance)), "{distances:?}");
            assert!(distances.windows(2).all(|pair| pair[0] != pair[1]), "{distances:?}");
            seen.set(seen.get() + 1);
        }
    });
    assert!(seen.get() > 0, "no case rubs");
}

#[test]
fn a_soft_constraint_leads_and_turns_over_a_width_of_each_joint() {
    let seen = Cell::new(0);
    check(Situation::SoftConstraint, |case, _| {
        for shape in shapes(case) {
            let Shape::Constraint { lead, widths } = shape else { continue };
            assert!((3e-3..0.02).contains(&lead) && widths.iter().all(|width| *width > 0.0));
            assert!(widths.windows(2).all(|pair| pair[0] != pair[1]), "{widths:?}");
            seen.set(seen.get() + 1);
        }
    });
    assert!(seen.get() > 0, "no case rubs");
}

#[test]
fn a_rough_clock_rounds_stamps_and_loses_rows() {
    check(Situation::RoughClock, |case, log| {
        let rough = case.sensors.logging.as_ref().and_then(|logging| logging.rough.clone());
        let rough = rough.expect("a rough clock");
        let stamps = column(log, "t");
        assert!(stamps.windows(2).all(|pair| pair[1] > pair[0]), "stamps run forwards");
        assert!(stamps.iter().all(|t| (t / rough.step - (t / rough.step).round()).abs() < 1e-3));
        let rows = (DURATION * case.sensors.rate) as usize;
        let lost = rows - stamps.len();
        assert!(lost > 0 && lost <= rough.burst + (3.0 * rough.lost * rows as f64) as usize + 5, "{lost}");
    });
}

#[test]
fn still_joints_stand_at_one_place_in_all_logs() {
    check(Situation::StillJoints, |case, _| {
        let still: BTreeSet<usize> = case.still.iter().map(|(joint, _)| *joint).collect();
        assert!(!still.is_empty() && still.len() < case.robot.joints());
        for (joint, motion) in (0..case.robot.joints()).flat_map(|j| case.motions.iter().map(move |m| (j, m)))
        {
            let place = |k: i32| motion.state(joint, motion.start + 0.5 * f64::from(k))[0];
            let moves = (0..40).any(|k| (place(k) - place(0)).abs() > 1e-9);
            assert_eq!(moves, !still.contains(&joint));
            if let Some((_, stands)) = case.still.iter().find(|(other, _)| *other == joint) {
                assert_eq!(place(0), *stands);
            }
        }
    });
}

#[test]
fn noisy_positions_scatter_about_the_motion() {
    check(Situation::NoisyPositions, |case, log| {
        let (stamps, positions) = (column(log, "t"), column(log, "q.joint_1"));
        let scatter =
            stamps.iter().zip(&positions).map(|(t, q)| (q - case.motions[0].state(0, *t)[0]).powi(2));
        let std = mean(scatter).sqrt();
        assert!((4e-4..7e-3).contains(&std), "{std}");
    });
}

#[test]
fn a_smoothed_torque_hardly_bends_from_sample_to_sample() {
    check(Situation::SmoothedTorque, |case, log| {
        let smoothing = case.sensors.logging.as_ref().and_then(|logging| logging.smoothing);
        let corner = smoothing.expect("a smoothed torque").corner();
        assert!((3.0..12.0).contains(&corner), "{corner}");
        let torque = column(log, "tau.joint_1");
        let rms = |values: &mut dyn Iterator<Item = f64>| mean(values.map(|value| value * value)).sqrt();
        // Of white noise it would be √6 times the noise.
        let bend = rms(&mut torque.windows(3).map(|three| three[0] - 2.0 * three[1] + three[2]));
        let noise = case.sensors.torque_noise[0];
        assert!(bend < 0.5 * noise, "{bend} {noise}");
    });
}

#[test]
fn shifting_zeros_are_another_in_each_log() {
    let robots = models();
    for number in 0..3 {
        let case = small(Situation::ShiftingZeros, number, &robots);
        let deviations = &case.sensors.logging.as_ref().expect("a wide case").torque_zero;
        assert!(deviations.iter().any(|deviation| *deviation > 0.0));
        let with: Vec<String> = case.logs().into_iter().map(|(_, log)| log).collect();
        for joint in (0..2).filter(|joint| deviations[*joint] > 0.0) {
            let name = format!("tau.joint_{}", joint + 1);
            let zeros: Vec<f64> = with
                .iter()
                .zip(&case.motions)
                .map(|(log, motion)| {
                    let times = even_times(motion, 50.0);
                    let plant: Vec<&Secret> = case.plant.iter().collect();
                    let record = record(&case.robot.tree, &case.ordinary, &plant, motion, &times);
                    let expected = mean(record.torque.iter().skip(joint).step_by(2).copied());
                    mean(column(log, &name).into_iter()) - expected
                })
                .collect();
            let span = zeros.iter().fold(f64::NEG_INFINITY, |a, b| a.max(*b))
                - zeros.iter().fold(f64::INFINITY, |a, b| a.min(*b));
            // Three normal numbers are hardly ever closer together, or further apart.
            assert!((0.05..6.0).contains(&(span / deviations[joint])), "{zeros:?} {deviations:?}");
        }
    }
}
