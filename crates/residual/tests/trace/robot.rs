//! A small robot whose secrets are known, and a trace of them.

use phiw_dynamics::random_tree::RandomNumbers;
use phiw_dynamics::urdf::{UrdfOptions, read_urdf};
use phiw_dynamics::{Tree, Workspace};
use phiw_effects::{Catalogue, SignalRanges};
use phiw_identification::{BlockSource, Data, Fold, Identified, Model, Variants, identify};
use phiw_residual::trace::{
    FoundEffect, HeldModel, TraceInput, TraceOptions, Tracing, Verdict, noise_floor, trace,
};
use phiw_telemetry::{Conditioning, ConditioningOptions, Recording};

pub const URDF: &str = r#"<robot name="two_links"><link name="base"/>
  <link name="upper"><inertial><origin xyz="0.2 0.01 0"/><mass value="3"/>
    <inertia ixx="0.01" iyy="0.05" izz="0.05" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="lower"><inertial><origin xyz="0.15 0 0.02"/><mass value="1.5"/>
    <inertia ixx="0.005" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/>
    <axis xyz="0 1 0"/><limit lower="-2" upper="2" effort="60" velocity="6"/></joint>
  <joint name="elbow" type="revolute"><parent link="upper"/><child link="lower"/><origin xyz="0.4 0 0"/>
    <axis xyz="0 1 0"/><limit lower="-2.5" upper="2.5" effort="30" velocity="8"/></joint>
</robot>"#;

/// What a secret sees: time, position, velocity, acceleration of both joints.
pub struct State<'a> {
    pub t: f64,
    pub q: &'a [f64],
    pub qd: &'a [f64],
    pub qdd: &'a [f64],
}

pub const RATE: f64 = 250.0;
pub const SECONDS: f64 = 60.0;

/// A minute of Fourier motion with viscous and Coulomb friction, the secret and torque noise.
pub fn record(tree: &Tree, seed: u64, secret: &dyn Fn(&State<'_>, &mut [f64])) -> Recording {
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

pub const DECLARED: [&str; 2] = ["viscous_friction", "coulomb_friction"];

/// Folds of three seconds: twelve train, eight are held out.
pub fn folds() -> (Vec<Fold>, Vec<Fold>) {
    let fold = |piece: usize| Fold { log: 0, start: 3.0 * piece as f64, end: 3.0 * (piece + 1) as f64 };
    ((0..12).map(fold).collect(), (12..20).map(fold).collect())
}

/// Traces recordings of the secret with viscous and Coulomb friction declared.
pub fn traced(seed: u64, secret: &dyn Fn(&State<'_>, &mut [f64])) -> Tracing {
    traced_on(folds().0, &DECLARED, seed, secret, false)
}

/// Traces the secret on the training folds `train`; with `held` against the model of the same robot,
/// identified without its secret on another recording.
pub fn traced_on(
    train: Vec<Fold>,
    declared: &[&str],
    seed: u64,
    secret: &dyn Fn(&State<'_>, &mut [f64]),
    held: bool,
) -> Tracing {
    traced_robot(URDF, train, declared, seed, secret, held)
}

/// The same on another robot with two joints of those names.
pub fn traced_robot(
    urdf: &str,
    train: Vec<Fold>,
    declared: &[&str],
    seed: u64,
    secret: &dyn Fn(&State<'_>, &mut [f64]),
    held: bool,
) -> Tracing {
    let tree = read_urdf(urdf, &UrdfOptions::default()).unwrap().tree;
    let clean = held.then(|| record(&tree, seed + 1, &|_, _| ()));
    traced_recording(&tree, &record(&tree, seed, secret), clean.as_ref(), train, declared)
}

/// Traces a recording of such a robot; against the model of `clean`, if there is one.
pub fn traced_recording(
    tree: &Tree,
    log: &Recording,
    clean: Option<&Recording>,
    train: Vec<Fold>,
    declared: &[&str],
) -> Tracing {
    let catalogue = Catalogue::default();
    let surveys = [log.survey().unwrap()];
    let conditioning = Conditioning::choose(&surveys, &ConditioningOptions::default()).unwrap();
    let ranges = SignalRanges::of_surveys(&surveys);
    let identified = |log: &Recording, train: Vec<Fold>| {
        let blocks = log.blocks(&conditioning).unwrap();
        let sources: Vec<&dyn BlockSource> = vec![&blocks];
        let data = Data { train, held_out: folds().1, sources, rest_speeds: vec![0.01; tree.joint_count()] };
        let declared: Vec<Variants> =
            declared.iter().flat_map(|kind| catalogue.declare(kind, tree, &ranges).unwrap()).collect();
        identify(tree, declared, &data).unwrap()
    };
    let clean = clean.map(|clean| identified(clean, folds().0));
    let held = clean.as_ref().map(|clean| {
        let model = Model::of_fit(&clean.design, &clean.fit, &[], &[], (0.0, 0.0)).unwrap();
        HeldModel {
            factor: model.knowledge().unwrap(),
            determined: model.factor.parameters.clone(),
            left: model.left(),
            residual_std: model.residual_std,
        }
    });
    let start = clean.unwrap_or_else(|| identified(log, train.clone()));
    let blocks = log.blocks(&conditioning).unwrap();
    let sources: Vec<&dyn BlockSource> = vec![&blocks];
    let data = Data { train, held_out: folds().1, sources, rest_speeds: vec![0.01; tree.joint_count()] };
    let plan = conditioning.plan(&surveys[0]).unwrap();
    let input = TraceInput {
        tree,
        catalogue: &catalogue,
        data: &data,
        ranges,
        declared: start.design.effects().iter().map(|effect| effect.spec()).collect(),
        parameters: start.fit.parameters.clone(),
        residual_std: start.fit.residual_std.clone(),
        held,
        noise_floor: noise_floor(
            tree,
            &vec![0.0; tree.joint_count()],
            &surveys,
            &conditioning,
            &data.sources,
        )
        .unwrap(),
        rows_per_independent: plan.output_rate_hz() / (2.0 * conditioning.parallel_cutoff_hz),
    };
    let is_held = input.held.is_some();
    let tracing = trace(input, &TraceOptions::default()).unwrap();
    if !is_held {
        each_name_is_certain(&tracing);
    }
    tracing
}

/// Of each effect with a name one parameter at least is not within its error of nothing; but a Stribeck
/// friction has the Coulomb friction below it, however the two share what they are.
fn each_name_is_certain(tracing: &Tracing) {
    let Identified { design, fit, .. } = &tracing.model;
    let quantile = fit.covariance.quantile_95();
    for FoundEffect { spec, .. } in &tracing.effects {
        let place = tracing.specs.iter().position(|other| other == spec).unwrap();
        let own = design.effect_parameters(place).zip(design.effects()[place].parameters());
        let is_certain = own.clone().any(|(parameter, info)| {
            let in_force = spec.constants.get(&info.name).copied().unwrap_or_default();
            let [low, high] = fit.intervals_95[parameter];
            let is_large = fit.parameters[parameter].abs() > quantile * fit.standard_deviations[parameter];
            (in_force + low > 0.0 || in_force + high < 0.0) && (is_large || !spec.constants.is_empty())
        });
        let has_stribeck = tracing
            .specs
            .iter()
            .any(|other| other.kind == "stribeck_friction" && other.joints == spec.joints);
        let values: Vec<f64> = own.map(|(parameter, _)| fit.parameters[parameter]).collect();
        assert!(is_certain || spec.kind == "coulomb_friction" && has_stribeck, "{spec:?} {values:?}");
    }
}

pub fn named(tracing: &Tracing) -> Vec<(String, Vec<String>)> {
    let mut named: Vec<_> =
        tracing.effects.iter().map(|effect| (effect.spec.kind.clone(), effect.spec.joints.clone())).collect();
    named.sort();
    named
}

/// The secret is found, with its joints, and the error comes down to the noise.
pub fn check(secret: impl Fn(&State<'_>, &mut [f64]), expected: &[(&str, &[&str])]) {
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
