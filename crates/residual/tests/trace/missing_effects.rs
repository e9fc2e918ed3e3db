//! Effects that the declared model lacks.

use super::robot::{DECLARED, State, URDF, check, folds, named, record, traced, traced_on, traced_robot};
use phiw_dynamics::random_tree::RandomNumbers;
use phiw_dynamics::urdf::{UrdfOptions, read_urdf};
use phiw_effects::Catalogue;
use phiw_identification::fitting::accumulate;
use phiw_identification::{Design, EffectCatalogue, EffectSpec, Fold};
use phiw_regressor::BaseParameters;
use phiw_residual::trace::Verdict;
use phiw_telemetry::{Conditioning, ConditioningOptions};
use std::cell::RefCell;

#[test]
fn a_right_model_is_sufficient() {
    for seed in 1..=3 {
        let tracing = traced(seed, &|_, _| ());
        assert_eq!((named(&tracing), tracing.verdict), (vec![], Verdict::Sufficient), "seed {seed}");
    }
}

#[test]
fn an_offset_is_named() {
    check(|_, torque| torque[0] += 0.7, &[("torque_offset", &["shoulder"])]);
}

/// A constant torque beside a weak spring was named a spring, whose rest was ten turns away: what the spring
/// makes beside a constant is worth no name.
#[test]
fn an_offset_beside_a_weak_spring_is_an_offset() {
    for (offset, stiffness, expected) in
        [(3.0, 0.03, "torque_offset"), (3.0, 1.2, "joint_spring"), (0.0, 1.2, "joint_spring")]
    {
        let tracing = traced(11, &|state, torque| torque[1] += offset + stiffness * state.q[1]);
        let expected = [(expected.to_owned(), vec!["elbow".to_owned()])];
        assert_eq!(named(&tracing), expected, "{offset} N·m, {stiffness} N·m/rad");
    }
}

#[test]
fn stribeck_friction_is_named() {
    let stribeck = |state: &State<'_>, torque: &mut [f64]| {
        torque[1] += (-(state.qd[1] / 0.4).powi(2)).exp() * (state.qd[1] / 0.01).tanh();
    };
    check(stribeck, &[("stribeck_friction", &["elbow"])]);
}

/// Beside frictions that were found, too, an effect of a hundredth of their squares was a refinement, though
/// all but noise was left without it.
#[test]
fn a_small_effect_that_leaves_noise_only_has_a_name_where_nothing_is_declared() {
    let ripple = |state: &State<'_>, torque: &mut [f64]| {
        torque[1] += 3.4 * (state.qd[1] / 0.01).tanh() + 0.1 * (7.0 * state.q[1]).sin();
    };
    let tracing = traced_on(folds().0, &[], 11, &ripple, false);
    let names = named(&tracing);
    assert!(names.contains(&("torque_ripple".to_owned(), vec!["elbow".to_owned()])), "{names:?}");
    assert_eq!(tracing.verdict, Verdict::Explained);
}

/// Beside a viscous friction that rises a little less than its speed, a Coulomb friction of four thousandths
/// of the torque was named, with those of the other joints. It is certain, and as good as nothing.
#[test]
fn what_is_as_good_as_nothing_is_not_named_with_its_family() {
    for (friction, expected) in [(0.005, vec![["shoulder"]]), (0.1, vec![["elbow"], ["shoulder"]])] {
        let secret = |state: &State<'_>, torque: &mut [f64]| {
            torque[1] += (friction - 0.6) * (state.qd[1] / 0.01).tanh();
        };
        let tracing = traced_on(folds().0, &[], 11, &secret, false);
        let named = named(&tracing);
        let rubs: Vec<&Vec<String>> =
            named.iter().filter(|(kind, _)| kind == "coulomb_friction").map(|(_, joints)| joints).collect();
        assert_eq!(rubs, expected.iter().collect::<Vec<_>>(), "{friction} N·m");
        let is_in =
            tracing.specs.iter().any(|spec| spec.kind == "coulomb_friction" && spec.joints == ["elbow"]);
        assert!(is_in, "{friction} N·m");
    }
}

/// Right models whose friction turned as an arctangent does were given a Stribeck friction: how slowly a sign
/// turns is no effect of its own.
#[test]
fn a_sign_that_turns_slowly_is_no_stribeck_friction() {
    let secret = |state: &State<'_>, torque: &mut [f64]| {
        for (torque, velocity) in torque.iter_mut().zip(state.qd) {
            let slow = (velocity / 0.04).atan() * std::f64::consts::FRAC_2_PI;
            *torque += 3.0 * slow - 0.6 * (velocity / 0.01).tanh();
        }
    };
    let tracing = traced(31, &secret);
    assert!(named(&tracing).is_empty(), "{:?}", named(&tracing));
    assert_eq!(tracing.verdict, Verdict::Sufficient);
    let powers: Vec<Option<&f64>> = tracing
        .specs
        .iter()
        .filter(|spec| spec.kind == "coulomb_friction")
        .map(|spec| spec.constants.get("sign_power"))
        .collect();
    assert_eq!(powers, [Some(&1.0), Some(&1.0)]);
}

/// Friction that turns over a tenth of a milliradian was named a hysteresis, and the Coulomb friction that
/// was declared was refuted beside it: bristles bend before they slip, and that is how a sign turns.
#[test]
fn bristles_are_no_hysteresis() {
    let none: &[(&str, &[&str])] = &[];
    for (stribeck, expected) in [(0.0, none), (2.0, &[("stribeck_friction", &["elbow"])])] {
        let bristles = RefCell::new((0.0, 0.0));
        let secret = |state: &State<'_>, torque: &mut [f64]| {
            let (mut force, before) = *bristles.borrow();
            // LuGre's bristles in a hundred steps a sample: ż = v − |v|·z/d, of the force that they end at.
            let way = (state.q[1] - before) / 100.0;
            for _ in 0..100 {
                let steady = 3.0 + stribeck * (-(state.qd[1] / 0.3).powi(2)).exp();
                force += (steady * way - way.abs() * force) / 1e-4_f64.max(way.abs());
            }
            *bristles.borrow_mut() = (force, state.q[1]);
            torque[1] += force - 0.6 * (state.qd[1] / 0.01).tanh();
        };
        let tracing = traced(11, &secret);
        let expected: Vec<(String, Vec<String>)> = expected
            .iter()
            .map(|(kind, joints)| {
                ((*kind).to_owned(), joints.iter().map(|&joint| joint.to_owned()).collect())
            })
            .collect();
        assert_eq!(named(&tracing), expected, "{stribeck} N·m");
        let deflected = tracing.specs.iter().filter(|spec| spec.joints == ["elbow"]).any(|spec| {
            spec.constants.get("bristle_deflection").is_some_and(|way| (3e-5..=3e-4).contains(way))
        });
        assert!(deflected, "{:?}", tracing.specs);
    }
}

/// With nothing declared a hysteresis was named in the place of the friction that it was taken for.
#[test]
fn friction_of_bristles_is_found_with_nothing_declared() {
    let bristles = RefCell::new((0.0_f64, 0.0));
    let secret = |state: &State<'_>, torque: &mut [f64]| {
        let (force, before) = *bristles.borrow();
        let way: f64 = state.q[1] - before;
        let steady = 2.0 * way.signum();
        let force = steady + (force - steady) * (-way.abs() / 2e-4).exp();
        *bristles.borrow_mut() = (force, state.q[1]);
        torque[1] += force - 0.6 * (state.qd[1] / 0.01).tanh();
    };
    let tracing = traced_on(folds().0, &[], 11, &secret, false);
    let named = named(&tracing);
    assert!(named.contains(&("coulomb_friction".to_owned(), vec!["elbow".to_owned()])), "{named:?}");
    assert!(!named.iter().any(|(kind, _)| kind == "hysteresis" || kind == "time_delay"), "{named:?}");
}

/// Frictions of all joints that turn over most of a milliradian were named hystereses with a little Coulomb
/// friction beside them: the bristles began with another way, and never reached that of the hysteresis.
#[test]
fn frictions_of_bristles_of_all_joints_are_found_with_nothing_declared() {
    let bristles = RefCell::new([(0.0_f64, 0.0_f64); 2]);
    let secret = |state: &State<'_>, torque: &mut [f64]| {
        let mut bristles = bristles.borrow_mut();
        for (joint, (slides_at, deflection)) in [(4.0, 8e-4), (2.0, 5.5e-4)].into_iter().enumerate() {
            let (force, before) = bristles[joint];
            let way: f64 = state.q[joint] - before;
            let steady = slides_at * way.signum();
            let force = steady + (force - steady) * (-way.abs() / deflection).exp();
            bristles[joint] = (force, state.q[joint]);
            torque[joint] += force;
        }
    };
    let tracing = traced_on(folds().0, &[], 11, &secret, false);
    let named = named(&tracing);
    let mut kinds: Vec<&str> = named.iter().map(|(kind, _)| kind.as_str()).collect();
    kinds.sort_unstable();
    assert_eq!(kinds, ["coulomb_friction", "coulomb_friction", "viscous_friction", "viscous_friction"]);
    // As bristles, or as a hysteresis that refines the friction.
    let way = |spec: &EffectSpec| {
        let ways = ["bristle_deflection", "presliding"];
        ways.iter().find_map(|name| spec.constants.get(*name).copied())
    };
    let ways: Vec<f64> = ["shoulder", "elbow"]
        .iter()
        .filter_map(|joint| tracing.specs.iter().filter(|spec| spec.joints == [*joint]).find_map(way))
        .collect();
    assert!(ways.len() == 2 && ways[0] > ways[1] && ways[1] > 3e-4, "{ways:?} {:?}", tracing.specs);
}

/// Two frictions of a joint that turn over the same way were refined one after the other, and ended at ways
/// of 0.04 and 0.5 mrad: 0.0235 N·m were left where the noise is 0.014.
#[test]
fn coulomb_and_stribeck_friction_turn_over_a_way_together() {
    let bristles = RefCell::new((0.0_f64, 0.0));
    let secret = |state: &State<'_>, torque: &mut [f64]| {
        let (force, before) = *bristles.borrow();
        let way: f64 = state.q[1] - before;
        let steady = (1.0 + 2.0 * (-(state.qd[1] / 0.2).powi(2)).exp()) * way.signum();
        let force = steady + (force - steady) * (-way.abs() / 3e-4).exp();
        *bristles.borrow_mut() = (force, state.q[1]);
        torque[1] += force;
    };
    let tracing = traced_on(folds().0, &[], 11, &secret, false);
    let way_of = |kind: &str| {
        let own = tracing.specs.iter().find(|spec| spec.kind == kind && spec.joints == ["elbow"]);
        own.and_then(|spec| spec.constants.get("bristle_deflection").copied()).unwrap()
    };
    let ways = [way_of("coulomb_friction"), way_of("stribeck_friction")];
    assert!(ways.iter().all(|way| (1e-4..5e-4).contains(way)), "{ways:?} rad");
    let left = tracing.model.held_out.rmse[1];
    assert!(left < 0.02, "{left} N·m");
}

#[test]
fn a_ripple_is_named_with_its_frequency() {
    let ripple = |state: &State<'_>, torque: &mut [f64]| torque[0] += 0.4 * (9.0 * state.q[0] + 0.3).sin();
    check(ripple, &[("torque_ripple", &["shoulder"])]);
    let tracing = traced(11, &ripple);
    assert!((tracing.effects[0].spec.constants["periods"] - 9.0).abs() < 0.05);
}

#[test]
fn a_shared_transmission_is_named_with_both_joints() {
    let shared = |state: &State<'_>, torque: &mut [f64]| {
        let sum = state.qd[0] + state.qd[1];
        torque.iter_mut().for_each(|torque| *torque += 0.3 * sum + 0.2 * (sum / 0.02).tanh());
    };
    check(shared, &[("transmission_coupling", &["shoulder", "elbow"])]);
}

/// Two bumps of the angle are neither a spring nor a ripple, nor both of them.
#[test]
fn a_cable_that_catches_is_a_position_map() {
    let bump = |q: f64, center: f64, width: f64| (-0.5 * ((q - center) / width).powi(2)).exp();
    check(
        |state, torque| torque[1] += 1.2 * bump(state.q[1], -0.4, 0.2) - 0.9 * bump(state.q[1], 0.5, 0.25),
        &[("position_map", &["elbow"])],
    );
}

/// A sum of three waves was named a ripple, a balancer, an offset and a stop, which leave of it what is not
/// worth a name and several times the noise.
#[test]
fn a_curve_of_three_waves_is_a_position_map_and_not_four_effects() {
    for waves in [[(2.4, 0.1), (2.7, 1.5), (4.0, 0.1)], [(4.1, 5.2), (3.8, 3.6), (2.8, 2.9)]] {
        let tracing = traced(11, &|state, torque| {
            torque[1] +=
                waves.iter().map(|(waves, phase)| 1.5 * (waves * state.q[1] + phase).sin()).sum::<f64>();
        });
        assert_eq!(named(&tracing), [("position_map".to_owned(), vec!["elbow".to_owned()])], "{waves:?}");
    }
}

/// A friction that differs by direction gave way to an offset beside the large friction of both, and what it
/// makes beyond that was in no model any more: eleven times the noise was left.
#[test]
fn what_a_friction_makes_beyond_an_offset_refines_the_model() {
    for (offset, slope) in [(1.0, 0.2), (2.0, 0.3)] {
        let tracing = traced(11, &|state, torque| {
            let sign = (state.qd[1] / 0.01).tanh();
            torque[1] += (0.5 + 0.5 * sign) * (offset + slope * state.qd[1]) + 8.0 * (state.qd[1] + sign);
        });
        let left = tracing.model.held_out.rmse[1];
        assert!(left < 0.02, "{left} N·m left, {:?}", named(&tracing));
        assert_eq!(tracing.verdict, Verdict::Explained);
    }
}

/// A stop that stiffens was named a map of the position, which follows it more closely with 24 numbers than
/// the catalogue's stop does with three.
#[test]
fn a_stop_that_stiffens_is_a_stop_and_no_map() {
    let tracing = traced(11, &|state, torque| {
        torque[1] += 1.5 * ((state.q[1] - 0.9) / 0.3).max(0.0).powf(1.3);
    });
    assert_eq!(named(&tracing), [("end_stop".to_owned(), vec!["elbow".to_owned()])]);
}

/// A spring between two levers makes more than a sine of the angle where it has a length at rest. A map of
/// the position was named for it, which says nothing beyond the arc that the training shows.
#[test]
fn a_counterbalance_spring_with_a_length_at_rest_is_a_balancer() {
    for (lever, rest) in [(0.3, 0.0), (0.2, 0.3), (0.3, 0.3)] {
        let spring = |state: &State<'_>, torque: &mut [f64]| {
            let (sine, cosine) = (state.q[1] - 0.9).sin_cos();
            let length = (1.0_f64 + lever * lever - 2.0 * lever * cosine).sqrt();
            torque[1] += 20.0 * (1.0 - rest / length) * sine;
        };
        check(spring, &[("gravity_balancer", &["elbow"])]);
    }
}

/// A spring and a balancer that cancel each other mended what a long soft stop is not in the catalogue's
/// form, and both had names beside it; where the stop began beyond the fifth of the range that was looked
/// through, they had its name.
#[test]
fn a_long_soft_stop_is_neither_a_spring_nor_a_balancer() {
    for begin in [0.2, 0.6] {
        let tracing = traced(11, &|state, torque| {
            torque[1] += 4.0 * (state.q[1] - begin).max(0.0).powf(1.2);
        });
        assert_eq!(named(&tracing), [("end_stop".to_owned(), vec!["elbow".to_owned()])], "from {begin} rad");
    }
}

/// Friction of a shaft that runs out was left in the errors, or taken for a rotor and an elasticity. Neither
/// the waves nor the spot are in the catalogue's form to the last digit.
#[test]
fn friction_that_comes_and_goes_with_the_position_has_a_name() {
    let frictions: [fn(f64) -> f64; 2] = [
        |q| 1.15 + (2.0 * q + 0.7).sin() + 0.15 * (4.0 * q).cos(),
        |q| 2.0 * (-((q + 0.3) / 0.6).powi(2)).exp(),
    ];
    for friction in frictions {
        check(
            |state, torque| torque[1] += 0.6 * friction(state.q[1]) * (state.qd[1] / 0.01).tanh(),
            &[("position_dependent_friction", &["elbow"])],
        );
    }
}

/// Friction of the load is the same both ways.
#[test]
fn a_drive_that_is_harder_to_drive_back_has_an_efficiency_by_the_direction_of_power() {
    check(
        |state, torque| {
            let speed = state.qd[0];
            let load = torque[0] - 0.4 * speed - 0.6 * (speed / 0.01).tanh();
            torque[0] += if load * speed > 0.0 { load / 0.95 - load } else { 0.5 * load - load };
        },
        &[("drive_efficiency", &["shoulder"])],
    );
}

#[test]
fn two_secrets_are_both_named() {
    let both = |state: &State<'_>, torque: &mut [f64]| {
        torque[0] += 0.15 * state.qd[0] * state.qd[0].abs();
        torque[1] += 1.1 * (state.q[1] - 0.4);
    };
    check(both, &[("joint_spring", &["elbow"]), ("quadratic_friction", &["shoulder"])]);
}

#[test]
fn what_is_not_in_the_catalogue_is_not_explained() {
    // A disturbance that has nothing to do with the motion.
    let tracing = traced(11, &|state, torque| torque[1] += 0.6 * (9.7 * state.t).sin());
    assert!(
        matches!(tracing.verdict, Verdict::Unexplained | Verdict::PartlyExplained),
        "{:?}",
        named(&tracing)
    );
    assert_eq!(tracing.remaining.joints, ["elbow"]);
}

/// Bootstrap draws of the training folds: other motion must not lead to another name, nor to one name more.
#[test]
fn names_are_the_same_on_bootstrap_draws_of_the_training_folds() {
    let both = |state: &State<'_>, torque: &mut [f64]| {
        torque[0] += 0.15 * state.qd[0] * state.qd[0].abs();
        torque[1] += 1.1 * (state.q[1] - 0.4);
    };
    let (train, _) = folds();
    let expected = named(&traced(11, &both));
    let mut random = RandomNumbers::new(5);
    for draw in 0..10 {
        let pick = |_: &Fold| train[(random.uniform(0.0, train.len() as f64) as usize).min(train.len() - 1)];
        let drawn: Vec<Fold> = train.iter().map(pick).collect();
        assert_eq!(named(&traced_on(drawn, &DECLARED, 11, &both, false)), expected, "draw {draw}");
    }
}

/// A candidate of which the motion leaves nothing is listed, not left out in silence: the base of a free
/// rigid body takes up any payload's column of the shoulder's rotor.
#[test]
fn what_the_logs_cannot_tell_is_listed() {
    let tracing = traced(1, &|_, _| ());
    let unidentifiable: Vec<(&str, &[String])> = tracing
        .remaining
        .unidentifiable
        .iter()
        .map(|spec| (spec.kind.as_str(), spec.joints.as_slice()))
        .collect();
    assert!(unidentifiable.contains(&("rotor_inertia", &["shoulder".to_owned()])), "{unidentifiable:?}");
}

/// The column of a gain is all torque that the model knows of, an effect found before it included. On a joint
/// whose rigid body shares no parameter with another that column once did the effect's work in its place, as
/// a rival of probability 1.
#[test]
fn a_gain_is_no_rival_of_an_effect_that_it_contains() {
    let lift = URDF.replace(r#"name="elbow" type="revolute""#, r#"name="elbow" type="prismatic""#);
    assert_ne!(lift, URDF);
    let warming =
        |state: &State<'_>, torque: &mut [f64]| torque[1] += 1.5 * (-state.t / 15.0).exp() * state.qd[1];
    let tracing = traced_robot(&lift, folds().0, &DECLARED, 11, &warming, false);
    assert_eq!(named(&tracing), [("thermal_drift".to_owned(), vec!["elbow".to_owned()])]);
    let rivals: Vec<&str> = tracing.effects[0].rivals.iter().map(|rival| rival.spec.kind.as_str()).collect();
    assert!(!rivals.contains(&"torque_gain"), "{rivals:?}");
}

/// A candidate whose columns were not finite ended the whole trace: a Stribeck velocity of zero, where steps
/// of the encoder hide the speed.
#[test]
fn a_candidate_that_cannot_be_judged_does_not_end_the_trace() {
    let tree = read_urdf(URDF, &UrdfOptions::default()).unwrap().tree;
    let log = record(&tree, 3, &|_, _| ());
    let surveys = [log.survey().unwrap()];
    let conditioning = Conditioning::choose(&surveys, &ConditioningOptions::default()).unwrap();
    let blocks = log.blocks(&conditioning).unwrap();
    let base = BaseParameters::of_tree(&tree, Default::default()).unwrap();
    let spec = EffectSpec {
        kind: "stribeck_friction".to_owned(),
        joints: vec!["elbow".to_owned()],
        constants: [
            ("stribeck_velocity".to_owned(), f64::NAN),
            ("exponent".to_owned(), 2.0),
            ("sign_width".to_owned(), 0.0),
        ]
        .into(),
    };
    let design = || {
        let effect = Catalogue::default().build(&spec, &tree).unwrap();
        Design::new(tree.clone(), base.clone(), vec![effect])
    };
    let (train, _) = folds();
    assert!(
        accumulate(&design(), &train, &[&blocks]).is_err(),
        "the columns are finite: this test tests nothing"
    );
    let design = design().with_candidates_from(0);
    accumulate(&design, &train, &[&blocks]).unwrap();
    assert_eq!(design.not_finite(), [0]);
}

/// One joint at a time, the friction of all joints came out one by one, and beside those that were not in yet
/// it was taken for other kinds.
#[test]
fn friction_of_all_joints_is_found_with_nothing_declared() {
    let tracing = traced_on(folds().0, &[], 11, &|_, _| (), false);
    let expected: Vec<(String, Vec<String>)> = ["coulomb_friction", "viscous_friction"]
        .iter()
        .flat_map(|kind| ["elbow", "shoulder"].map(|joint| ((*kind).to_owned(), vec![joint.to_owned()])))
        .collect();
    assert_eq!(named(&tracing), expected, "{:?}", tracing.verdict);
    assert!(tracing.model.held_out.relative < 0.1 * tracing.before.1.relative);
}

/// A friction that falls with the speed makes up for a viscous friction that rises with it: judged without
/// the former, the latter was none.
#[test]
fn a_viscous_friction_is_named_beside_the_stribeck_friction_that_hides_it() {
    let secret = |state: &State<'_>, torque: &mut [f64]| {
        let v = state.qd[1];
        torque[1] += 3.0 * (-(v / 1.2).powi(2)).exp() * (v / 0.01).tanh();
    };
    let tracing = traced_on(folds().0, &[], 11, &secret, false);
    let named = named(&tracing);
    for kind in ["viscous_friction", "coulomb_friction", "stribeck_friction"] {
        assert!(named.contains(&(kind.to_owned(), vec!["elbow".to_owned()])), "{kind}: {named:?}");
    }
}

/// The error of all joints together is the shoulder's noise, of which the elbow's ripple is a thousandth:
/// that it hardly falls, or grows a little, is no reason to leave the ripple out.
#[test]
fn an_effect_is_not_hidden_by_the_noise_of_another_joint() {
    for seed in 1..=6 {
        let random = RefCell::new(RandomNumbers::new(seed));
        let secret = |state: &State<'_>, torque: &mut [f64]| {
            torque[0] += random.borrow_mut().uniform(-60.0, 60.0);
            torque[1] += 0.1 * (12.0 * state.q[1]).sin();
        };
        let tracing = traced(seed, &secret);
        assert_eq!(named(&tracing), [("torque_ripple".to_owned(), vec!["elbow".to_owned()])], "{seed}");
    }
}

/// The elbow has no viscous friction. Beside a quadratic and a wide Stribeck friction it was found to have
/// one of 0.001 N·m·s/rad, within its error of nothing, and had the name, since the shoulder has it.
#[test]
fn a_joint_has_no_friction_of_the_others_of_which_nothing_is_certain() {
    let secret = |state: &State<'_>, torque: &mut [f64]| {
        let [shoulder, elbow] = [state.qd[0], state.qd[1]];
        torque[0] += 0.3 * shoulder * shoulder.abs();
        torque[1] -= 0.4 * elbow;
        torque[1] += 0.25 * elbow * elbow.abs() + 0.5 * (-(elbow / 0.3).abs()).exp() * (elbow / 0.01).tanh();
    };
    let named = named(&traced_on(folds().0, &[], 11, &secret, false));
    let viscous = |joint: &str| named.contains(&("viscous_friction".to_owned(), vec![joint.to_owned()]));
    assert!(viscous("shoulder") && !viscous("elbow"), "{named:?}");
}
