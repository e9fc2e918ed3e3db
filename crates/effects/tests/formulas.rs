//! The formulas that kinds give of their effects, held against their columns.

use phiw_codegen::{Expression, Function};
use phiw_dynamics::random_tree::{RandomNumbers, RandomState, RandomTreeOptions, random_state, random_tree};
use phiw_dynamics::{Tree, Workspace};
use phiw_effects::{Catalogue, Constants, JointRange, Refinement, SignalRanges};
use phiw_identification::effect::ReferenceModel;
use phiw_identification::{Design, predict};
use phiw_regressor::BaseParameters;
use phiw_telemetry::Block;

/// Kinds of the present motion alone: each has a formula.
const OF_THE_MOTION: [&str; 16] = [
    "viscous_friction",
    "coulomb_friction",
    "torque_offset",
    "rotor_inertia",
    "torque_gain",
    "asymmetric_friction",
    "quadratic_friction",
    "stribeck_friction",
    "load_dependent_friction",
    "position_dependent_friction",
    "drive_efficiency",
    "joint_spring",
    "gravity_balancer",
    "torque_ripple",
    "end_stop",
    "transmission_coupling",
];

/// A motion and the torques of the bodies in it.
struct Moment<'a> {
    tree: &'a Tree,
    state: &'a RandomState,
    torque: Vec<f64>,
}

impl Moment<'_> {
    fn value(&self, expression: &Expression) -> f64 {
        let joint = |name: &str| self.tree.joint_index(name).unwrap();
        match expression {
            Expression::Constant(value) => *value,
            Expression::Position(name) => self.state.q[joint(name)],
            Expression::Velocity(name) => self.state.v[joint(name)],
            Expression::Acceleration(name) => self.state.a[joint(name)],
            // The reference has no effect beside the bodies.
            Expression::BodyTorque(name) | Expression::MotionTorque(name) => self.torque[joint(name)],
            Expression::Sum(left, right) => self.value(left) + self.value(right),
            Expression::Product(left, right) => self.value(left) * self.value(right),
            Expression::Function(function, of) => {
                let x = self.value(of);
                match *function {
                    Function::Sine => x.sin(),
                    Function::Cosine => x.cos(),
                    Function::Exponential => x.exp(),
                    Function::Magnitude => x.abs(),
                    Function::PositivePart => x.max(0.0),
                    Function::Power(exponent) => x.abs().powf(exponent),
                    Function::Sign(0.0) => x.signum(),
                    Function::Sign(width) => (x / width).tanh(),
                }
            }
        }
    }
}

#[test]
fn every_formula_is_its_effect() {
    let catalogue = Catalogue::default();
    let tree = random_tree(5, &RandomTreeOptions { joints: 4, ..Default::default() }).unwrap();
    let joints = tree.joint_count();
    let joint = JointRange {
        position: (-1.0, 1.0),
        velocity_rms: 0.8,
        torque_rms: 2.0,
        torque_peak: 9.0,
        ..JointRange::default()
    };
    let ranges = SignalRanges {
        joints: vec![joint; joints],
        session: (0.0, 60.0),
        period: 0.01,
        ripple_frequencies: vec![vec![12.0]; joints],
        friction_frequencies: vec![vec![5.0]; joints],
        temperature: false,
        logs: 2,
        longest_log: 30.0,
    };
    let mut random = RandomNumbers::new(7);
    let mut with = Vec::new();
    for kind in catalogue.kinds() {
        let mut count = 0;
        for site in kind.sites(&tree) {
            let scanned = kind.scan(&site, &ranges);
            let near = |found| kind.refine(&Refinement { found, site: &site, ranges: &ranges, step: 0 });
            let refined: Vec<Constants> = scanned.iter().flat_map(near).collect();
            for constants in scanned.into_iter().chain(refined) {
                let effect = kind.build(&tree, &site, &constants);
                let (spec, parameters) = (effect.spec(), effect.parameters());
                let values: Vec<f64> = parameters.iter().map(|_| random.uniform(0.1, 2.0)).collect();
                let formulas = catalogue.formulas(&spec, &parameters, &values);
                if formulas.is_empty() {
                    continue;
                }
                count += 1;
                let base = BaseParameters::of_tree(&tree, Default::default()).unwrap();
                let mut all = vec![0.0; base.count()];
                all.extend(&values);
                let design = Design::new(tree.clone(), base, vec![effect])
                    .with_reference(ReferenceModel::new(tree.clone()));
                for _ in 0..5 {
                    let state = random_state(&tree, &mut random);
                    let mut torque = vec![0.0; joints];
                    let mut workspace = Workspace::new(&tree);
                    tree.inverse_dynamics(&state.q, &state.v, &state.a, &mut workspace, &mut torque).unwrap();
                    let signals = [state.q.clone(), state.v.clone(), state.a.clone()];
                    let block = Block::unfiltered(joints, vec![0.0], signals, vec![0.0; joints]);
                    let mut expected = Vec::new();
                    predict(&design, &all, &[&vec![block]], &mut |prediction| {
                        expected = prediction.predicted.to_vec();
                    })
                    .unwrap();
                    let moment = Moment { tree: &tree, state: &state, torque };
                    let mut found = vec![0.0; joints];
                    for part in &formulas {
                        found[tree.joint_index(&part.joint).unwrap()] += moment.value(&part.torque);
                    }
                    for (found, expected) in found.iter().zip(&expected) {
                        let difference = (found - expected).abs();
                        assert!(difference < 1e-12 * (1.0 + expected.abs()), "{spec:?}: {found} {expected}");
                    }
                }
            }
        }
        if count > 0 {
            with.push(kind.name().to_owned());
        }
    }
    let missing: Vec<_> =
        OF_THE_MOTION.iter().filter(|name| !with.iter().any(|with| with == *name)).collect();
    assert_eq!(missing, [&""; 0]);
}
