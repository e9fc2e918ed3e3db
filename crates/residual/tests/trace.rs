//! Tracing on recordings of a small robot whose secrets are known: named right, with its joints, and nothing
//! else.

use phiw_dynamics::random_tree::RandomNumbers;
use phiw_dynamics::urdf::{UrdfOptions, read_urdf};
use phiw_dynamics::{Tree, Workspace};
use phiw_effects::{Catalogue, SignalRanges};
use phiw_identification::fitting::accumulate;
use phiw_identification::{
    BlockSource, Data, Design, EffectCatalogue, EffectSpec, Fold, Model, Variants, identify,
};
use phiw_regressor::BaseParameters;
use phiw_residual::trace::{HeldModel, TraceInput, TraceOptions, Tracing, Verdict, noise_floor, trace};
use phiw_telemetry::{Conditioning, ConditioningOptions, Recording};

const URDF: &str = r#"<robot name="two_links"><link name="base"/>
  <link name="upper"><inertial><origin xyz="0.2 0.01 0"/><mass value="3"/><inertia ixx="0.01" iyy="0.05" izz="0.05" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="lower"><inertial><origin xyz="0.15 0 0.02"/><mass value="1.5"/><inertia ixx="0.005" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/><axis xyz="0 1 0"/><limit lower="-2" upper="2" effort="60" velocity="6"/></joint>
  <joint name="elbow" type="revolute"><parent link="upper"/><child link="lower"/><origin xyz="0.4 0 0"/><axis xyz="0 1 0"/><limit lower="-2.5" upper="2.5" effort="30" velocity="8"/></joint>
</robot>"#;

/// What a secret sees: time, position, velocity, acceleration of both joints.
struct State<'a> {
    t: f64,
    q: &'a [f64],
    qd: &'a [f64],
    qdd: &'a [f64],
}

const RATE: f64 = 250.0;
const SECONDS: f64 = 60.0;

/// A minute of Fourier motion with viscous and Coulomb friction, the secret and torque noise.
fn record(tree: &Tree, seed: u64, secret: &dyn Fn(&State<'_>, &mut [f64])) -> Recording {
    let mut random = RandomNumbers::new(seed);
    let sines: Vec<[f64; 3]> = (0..10)
        .map(|k| {
            let frequency = 0.3 + 0.37 * f64::from(k % 5) + random.uniform(0.0, 0.1);
            [random.uniform(0.2, 0.5), std::f64::consts::TAU * frequency * 0.5, random.uniform(0.0, 6.2)]
        })
        .collect();
    let mut workspace = Workspace::new(tree);
    let mut recording = Recording { joints: vec!["shoulder".into(), "elbow".into()], ..Recording::default() };
    for row in 0..(RATE * SECONDS) as usize {
        let t = row as f64 / RATE;
        let (mut q, mut qd, mut qdd) = ([0.0; 2], [0.0; 2], [0.0; 2]);
        for (index, [amplitude, omega, phase]) in sines.iter().enumerate() {
            let (sine, cosine) = (omega * t + phase).sin_cos();
            q[index / 5] += amplitude * sine;
            qd[index / 5] += amplitude * omega * cosine;
            qdd[index / 5] -= amplitude * omega * omega * sine;
        }
        let mut torque = [0.0; 2];
        tree.inverse_dynamics(&q, &qd, &qdd, &mut workspace, &mut torque).unwrap();
        for joint in 0..2 {
            torque[joint] += 0.4 * qd[joint] + 0.6 * (qd[joint] / 0.01).tanh();
        }
        secret(&State { t, q: &q, qd: &qd, qdd: &qdd }, &mut torque);
        for torque in &mut torque {
            let normal = (0..12).map(|_| random.uniform(0.0, 1.0)).sum::<f64>() - 6.0;
            *torque += 0.05 * normal;
        }
        recording.t.push(t);
        recording.q.extend(q);
        recording.tau.extend(torque);
    }
    recording
}

const DECLARED: [&str; 2] = ["viscous_friction", "coulomb_friction"];

/// Folds of three seconds: twelve train, eight are held out.
fn folds() -> (Vec<Fold>, Vec<Fold>) {
    let fold = |piece: usize| Fold { log: 0, start: 3.0 * piece as f64, end: 3.0 * (piece + 1) as f64 };
    ((0..12).map(fold).collect(), (12..20).map(fold).collect())
}

/// Traces recordings of the secret with viscous and Coulomb friction declared.
fn traced(seed: u64, secret: &dyn Fn(&State<'_>, &mut [f64])) -> Tracing {
    traced_on(folds().0, &DECLARED, seed, secret, false)
}

/// Traces the secret on the training folds `train`; with `held` against the model of the same robot,
/// identified without its secret on another recording.
fn traced_on(
    train: Vec<Fold>,
    declared: &[&str],
    seed: u64,
    secret: &dyn Fn(&State<'_>, &mut [f64]),
    held: bool,
) -> Tracing {
    traced_robot(URDF, train, declared, seed, secret, held)
}

/// The same on another robot with two joints of those names.
fn traced_robot(
    urdf: &str,
    train: Vec<Fold>,
    declared: &[&str],
    seed: u64,
    secret: &dyn Fn(&State<'_>, &mut [f64]),
    held: bool,
) -> Tracing {
    let tree = read_urdf(urdf, &UrdfOptions::default()).unwrap().tree;
    let catalogue = Catalogue::default();
    let log = record(&tree, seed, secret);
    let surveys = [log.survey().unwrap()];
    let conditioning = Conditioning::choose(&surveys, &ConditioningOptions::default()).unwrap();
    let ranges = SignalRanges::of_surveys(&surveys);
    let identified = |log: &Recording, train: Vec<Fold>| {
        let blocks = log.blocks(&conditioning).unwrap();
        let sources: Vec<&dyn BlockSource> = vec![&blocks];
        let data = Data { train, held_out: folds().1, sources, rest_speeds: vec![0.01; 2] };
        let declared: Vec<Variants> =
            declared.iter().flat_map(|kind| catalogue.declare(kind, &tree, &ranges).unwrap()).collect();
        identify(&tree, declared, &data).unwrap()
    };
    let clean = held.then(|| identified(&record(&tree, seed + 1, &|_, _| ()), folds().0));
    let held = clean.as_ref().map(|clean| {
        let model = Model::of_fit(&clean.design, &clean.fit, &[], &[], (0.0, 0.0)).unwrap();
        HeldModel {
            factor: model.knowledge().unwrap(),
            determined: model.factor.parameters.clone(),
            left: model.left(),
            residual_std: model.residual_std,
        }
    });
    let start = clean.unwrap_or_else(|| identified(&log, train.clone()));
    let blocks = log.blocks(&conditioning).unwrap();
    let sources: Vec<&dyn BlockSource> = vec![&blocks];
    let data = Data { train, held_out: folds().1, sources, rest_speeds: vec![0.01; 2] };
    let plan = conditioning.plan(&surveys[0]).unwrap();
    let input = TraceInput {
        tree: &tree,
        catalogue: &catalogue,
        data: &data,
        ranges,
        declared: start.design.effects().iter().map(|effect| effect.spec()).collect(),
        parameters: start.fit.parameters.clone(),
        residual_std: start.fit.residual_std.clone(),
        held,
        noise_floor: noise_floor(&tree, &[0.0; 2], &surveys, &conditioning, &data.sources).unwrap(),
        rows_per_independent: plan.output_rate_hz() / (2.0 * conditioning.parallel_cutoff_hz),
    };
    trace(input, &TraceOptions::default()).unwrap()
}

fn named(tracing: &Tracing) -> Vec<(String, Vec<String>)> {
    let mut named: Vec<_> =
        tracing.effects.iter().map(|effect| (effect.spec.kind.clone(), effect.spec.joints.clone())).collect();
    named.sort();
    named
}

/// The secret is found, with its joints, and the error comes down to the noise.
fn check(secret: impl Fn(&State<'_>, &mut [f64]), expected: &[(&str, &[&str])]) {
    let tracing = traced(11, &secret);
    let expected: Vec<(String, Vec<String>)> = expected
        .iter()
        .map(|(kind, joints)| ((*kind).to_owned(), joints.iter().map(|joint| (*joint).to_owned()).collect()))
        .collect();
    assert_eq!(named(&tracing), expected, "{:?}", tracing.verdict);
    assert_eq!(tracing.verdict, Verdict::Explained);
    assert!(tracing.model.held_out.relative < tracing.before.1.relative);
    for found in &tracing.effects {
        assert!(found.significance > 3.0 && found.confidence > 0.5, "{found:?}");
    }
}

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

#[test]
fn stribeck_friction_is_named() {
    let stribeck = |state: &State<'_>, torque: &mut [f64]| {
        torque[1] += (-(state.qd[1] / 0.4).powi(2)).exp() * (state.qd[1] / 0.01).tanh();
    };
    check(stribeck, &[("stribeck_friction", &["elbow"])]);
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

/// A stop that stiffens was named a map of the position, which follows it more closely with 24 numbers than
/// the catalogue's stop does with three.
#[test]
fn a_stop_that_stiffens_is_a_stop_and_no_map() {
    let tracing = traced(11, &|state, torque| {
        torque[1] += 1.5 * ((state.q[1] - 0.9) / 0.3).max(0.0).powf(1.3);
    });
    assert_eq!(named(&tracing), [("end_stop".to_owned(), vec!["elbow".to_owned()])]);
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

/// The shoulder's rotor cannot be told from its link's inertia, so the held model has the one and not the
/// other; the one that it has not must not take up the inertia of what the arm holds.
#[test]
fn a_payload_is_found_beside_a_rotor_that_was_not_determined() {
    let declared = ["viscous_friction", "coulomb_friction", "rotor_inertia"];
    let tree = read_urdf(URDF, &UrdfOptions::default()).unwrap().tree;
    let with = {
        let mut with = tree.clone();
        let mut parameters = tree.inertial_parameters();
        // 1 kg at 0.25 m on the lower link.
        for (place, value) in [(10, 1.0), (11, 0.25), (16, 0.0625), (19, 0.0625)] {
            parameters[place] += value;
        }
        with.set_inertial_parameters(&parameters).unwrap();
        with
    };
    let mut workspace = Workspace::new(&tree);
    let workspace = std::cell::RefCell::new(&mut workspace);
    let payload = |state: &State<'_>, torque: &mut [f64]| {
        let mut loaded = [0.0; 2];
        with.inverse_dynamics(state.q, state.qd, state.qdd, &mut workspace.borrow_mut(), &mut loaded)
            .unwrap();
        let mut bare = [0.0; 2];
        tree.inverse_dynamics(state.q, state.qd, state.qdd, &mut workspace.borrow_mut(), &mut bare).unwrap();
        (0..2).for_each(|joint| torque[joint] += loaded[joint] - bare[joint]);
    };
    let tracing = traced_on(folds().0, &declared, 11, &payload, true);
    assert_eq!(named(&tracing), [("payload".to_owned(), vec!["elbow".to_owned()])]);
    let place = tracing.model.design.effects().len() - 1;
    let mass = tracing.model.fit.parameters[tracing.model.design.effect_parameters(place).start];
    assert!((mass - 1.0).abs() < 0.1, "{mass} kg");
}

/// Once an effect that grew has been found beside a held model, it is no candidate again.
#[test]
fn a_friction_that_grew_is_named_once() {
    let grown = |state: &State<'_>, torque: &mut [f64]| torque[1] += 0.5 * state.qd[1];
    let tracing = traced_on(folds().0, &DECLARED, 11, &grown, true);
    assert_eq!(named(&tracing), [("viscous_friction".to_owned(), vec!["elbow".to_owned()])]);
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

/// A gain scales all of the torque, friction included. Beside a held model nothing else can take up the
/// friction's part, which was once named a friction of its own.
#[test]
fn a_gain_scales_the_held_friction_too() {
    let gain = |_: &State<'_>, torque: &mut [f64]| torque[1] *= 1.15;
    let tracing = traced_on(folds().0, &DECLARED, 11, &gain, true);
    assert_eq!(named(&tracing), [("torque_gain".to_owned(), vec!["elbow".to_owned()])]);
}

/// The column of a gain is all torque that the model knows of, an effect found before it included. On a joint
/// whose rigid body shares no parameter with another that column once did the effect's work in its place, as
/// a rival of probability 1.
#[test]
fn a_gain_is_no_rival_of_an_effect_that_it_contains() {
    let lift = URDF.replace(
        "<joint name=\"elbow\" type=\"revolute\"><parent link=\"upper\"/><child link=\"lower\"/><origin xyz=\"0.4 0 0\"/><axis xyz=\"0 1 0\"/>",
        "<joint name=\"elbow\" type=\"prismatic\"><parent link=\"upper\"/><child link=\"lower\"/><origin xyz=\"0.4 0 0\"/><axis xyz=\"0 1 0\"/>",
    );
    assert_ne!(lift, URDF);
    let warming =
        |state: &State<'_>, torque: &mut [f64]| torque[1] += 1.5 * (-state.t / 15.0).exp() * state.qd[1];
    let tracing = traced_robot(&lift, folds().0, &DECLARED, 11, &warming, false);
    assert_eq!(named(&tracing), [("thermal_drift".to_owned(), vec!["elbow".to_owned()])]);
    let rivals: Vec<&str> = tracing.effects[0].rivals.iter().map(|rival| rival.spec.kind.as_str()).collect();
    assert!(!rivals.contains(&"torque_gain"), "{rivals:?}");
}

/// What swings once a second has no correlation over a quarter of a second, and is no noise for that.
#[test]
fn a_residual_that_swings_once_a_second_has_structure() {
    let one_hertz = |state: &State<'_>, torque: &mut [f64]| {
        torque[1] += 0.15 * (std::f64::consts::TAU * state.t).sin();
    };
    let tracing = traced(11, &one_hertz);
    assert!(
        matches!(tracing.verdict, Verdict::Unexplained | Verdict::PartlyExplained),
        "{:?} {:?}",
        tracing.verdict,
        named(&tracing)
    );
}

/// Torque noise of 0.3 N·m that is correlated over 30 ms.
fn coloured_noise() -> impl Fn(&mut [f64]) {
    let state = std::cell::RefCell::new((RandomNumbers::new(5), [0.0_f64; 2]));
    move |torque| {
        let (random, noise) = &mut *state.borrow_mut();
        let kept = (-1.0 / (0.03 * RATE)).exp();
        for (torque, noise) in torque.iter_mut().zip(noise) {
            let normal = (0..12).map(|_| random.uniform(0.0, 1.0)).sum::<f64>() - 6.0;
            *noise = kept * *noise + (1.0 - kept * kept).sqrt() * normal;
            *torque += 0.3 * *noise;
        }
    }
}

/// The floor knows nothing of a noise's colour, and such noise stands far above it. It does not follow the
/// motion.
#[test]
fn coloured_noise_is_no_structure() {
    let noise = coloured_noise();
    let tracing = traced(11, &|_, torque| noise(torque));
    assert_eq!(tracing.verdict, Verdict::Sufficient, "{:?}", tracing.remaining.depends_on);
}

/// A spring of the joint itself takes a part of it; what that leaves is smaller than the noise, and was once
/// taken for noise.
#[test]
fn a_spring_to_the_neighbour_under_coloured_noise_is_not_explained() {
    let noise = coloured_noise();
    let spring = |state: &State<'_>, torque: &mut [f64]| {
        noise(torque);
        torque[1] += 0.8 * state.q[1] + 0.4 * state.q[0];
    };
    let tracing = traced(11, &spring);
    assert_ne!(tracing.verdict, Verdict::Explained, "{:?}", named(&tracing));
    assert_ne!(tracing.verdict, Verdict::Sufficient);
    let follows = &tracing.remaining.depends_on;
    assert!(follows.iter().any(|follows| follows.signal == "q.shoulder"), "{follows:?}");
}

/// Its sign changes with every reversal: over tenths of a second it looks like noise.
#[test]
fn friction_that_comes_and_goes_around_the_turn_is_not_sufficient() {
    let noise = coloured_noise();
    let friction = |state: &State<'_>, torque: &mut [f64]| {
        noise(torque);
        torque[1] += 0.5 * (9.0 * state.q[1]).sin() * (state.qd[1] / 0.01).tanh();
    };
    let tracing = traced(11, &friction);
    assert!(
        matches!(tracing.verdict, Verdict::Unexplained | Verdict::PartlyExplained),
        "{:?} {:?}",
        tracing.verdict,
        named(&tracing)
    );
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
        let random = std::cell::RefCell::new(RandomNumbers::new(seed));
        let secret = |state: &State<'_>, torque: &mut [f64]| {
            torque[0] += random.borrow_mut().uniform(-60.0, 60.0);
            torque[1] += 0.1 * (12.0 * state.q[1]).sin();
        };
        let tracing = traced(seed, &secret);
        assert_eq!(named(&tracing), [("torque_ripple".to_owned(), vec!["elbow".to_owned()])], "{seed}");
    }
}
