//! What effects declare of themselves, held against their columns.

use phiw_dynamics::random_tree::{RandomNumbers, RandomTreeOptions, random_state, random_tree};
use phiw_dynamics::{AnalyticBackend, Tree, Workspace};
use phiw_effects::{Catalogue, JointRange, SignalRanges};
use phiw_identification::effect::{EffectParameter, ReferenceModel, VelocitySum};
use phiw_identification::reproduction::Plant;
use phiw_identification::{Design, Effect, EffectCatalogue, EffectSpec};
use phiw_regressor::BaseParameters;
use phiw_telemetry::Block;
use proptest::prelude::*;
use std::collections::BTreeMap;
use std::ops::Range;

/// What rounding leaves of a sum, over its terms.
const ROUNDING: f64 = 1e-9;
/// When states are looked at \[s\]: what changes with time is not linear in the motion.
const MOMENTS: [f64; 4] = [0.0, 0.7, 1.9, 4.1];
/// Rows of a motion, and the one of which it is asked whether later ones change it.
const ROWS: usize = 40;
const LOOKED_AT: usize = 20;
/// Time between rows \[s\], how fast the joints swing \[rad/s\], and how large the measured torques are
/// \[N·m, N\].
const PERIOD: f64 = 0.01;
const SWING: f64 = 5.0;
const TORQUE: f64 = 9.0;

/// Temperature at the beginning of a motion \[°C\]; joints warm up.
const WARM: f64 = 15.0;

/// For each parameter of a design, its number in each torque that it acts on, and which torque that is.
type Columns = Vec<Vec<(usize, f64)>>;

/// A robot, and all effects that the catalogue has for it, each with all constants that a scan tries.
struct Zoo {
    tree: Tree,
    design: Design,
    kinds: Vec<String>,
}

impl Zoo {
    fn new(seed: u64, joints: usize) -> Self {
        let tree = random_tree(seed, &RandomTreeOptions { joints, ..RandomTreeOptions::default() }).unwrap();
        let joint = JointRange {
            position: (-1.0, 1.0),
            velocity_rms: 0.8,
            torque_rms: 2.0,
            torque_peak: TORQUE,
            ..JointRange::default()
        };
        let ranges = SignalRanges {
            joints: vec![joint; joints],
            session: (0.0, 60.0),
            period: PERIOD,
            ripple_frequencies: vec![vec![12.0]; joints],
            friction_frequencies: vec![vec![5.0]; joints],
            temperature: true,
            logs: 2,
            longest_log: 30.0,
        };
        let (mut effects, mut kinds) = (Vec::new(), Vec::new());
        for kind in Catalogue::default().kinds() {
            for site in kind.sites(&tree) {
                for constants in kind.scan(&site, &ranges) {
                    effects.push(kind.build(&tree, &site, &constants));
                    kinds.push(kind.name().to_owned());
                }
            }
        }
        // What depends on torques sees those of a rigid body with friction.
        let name = &tree.joint(0).joint;
        let friction =
            Catalogue::default().build(&EffectSpec::new("coulomb_friction", &[name]), &tree).unwrap();
        let reference = ReferenceModel::new(tree.clone()).with_effects(vec![(friction, vec![0.3])]);
        let base = BaseParameters::of_tree(&tree, Default::default()).unwrap();
        let design = Design::new(tree.clone(), base, effects).with_reference(reference);
        Zoo { tree, design, kinds }
    }

    /// Columns of the samples of a block up to `last`: for each sample and parameter, its number in each
    /// torque that it acts on.
    fn columns(&self, block: &Block, last: usize) -> Vec<Columns> {
        let mut scratch = self.design.scratch();
        scratch.begin(block).unwrap();
        let of_sample = |sample| {
            let mut row = vec![0.0; self.design.evaluation_width()];
            scratch.evaluate(block, sample, &mut row).unwrap();
            let mut columns = vec![Vec::new(); self.design.parameter_count()];
            for (torque, layout) in self.design.rows().iter().enumerate() {
                let values = layout.parameters.iter().zip(&row[layout.range.clone()]);
                values.for_each(|(&parameter, &value)| columns[parameter].push((torque, value)));
            }
            columns
        };
        (0..=last).map(of_sample).collect()
    }

    /// For each parameter of the design: whether its columns change with velocity or acceleration, and
    /// whether they are affine in both.
    fn probe_of_linearity(&self, seed: u64) -> Vec<(bool, bool)> {
        let mut random = RandomNumbers::new(seed);
        let joints = self.tree.joint_count();
        let mut result = vec![(false, true); self.design.parameter_count()];
        for _ in 0..3 {
            let (one, other) = (random_state(&self.tree, &mut random), random_state(&self.tree, &mut random));
            let sum = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a + b).collect::<Vec<f64>>();
            let motions = [
                (vec![0.0; joints], vec![0.0; joints]),
                (one.v.clone(), one.a.clone()),
                (other.v.clone(), other.a.clone()),
                (sum(&one.v, &other.v), sum(&one.a, &other.a)),
            ];
            let mut at = motions.into_iter().zip(MOMENTS).map(|((v, a), t)| {
                let block = Block::unfiltered(joints, vec![t], [one.q.clone(), v, a], vec![0.0; joints]);
                self.columns(&block, 0).remove(0)
            });
            let [still, one, other, sum] = std::array::from_fn(|_| at.next().unwrap());
            for (parameter, (moves, is_affine)) in result.iter_mut().enumerate() {
                for row in 0..still[parameter].len() {
                    let [still, one, other, sum] =
                        [&still, &one, &other, &sum].map(|at| at[parameter][row].1);
                    let rounding = ROUNDING * still.abs().max(one.abs()).max(other.abs()).max(sum.abs());
                    *moves |= (one - still).abs() > rounding;
                    *is_affine &= (sum - one - other + still).abs() <= rounding;
                }
            }
        }
        result
    }

    /// The columns of two moments that have nothing but this velocity in common, nor anything before them.
    fn with_one_velocity(&self, axis: &VelocitySum, random: &mut RandomNumbers) -> [Columns; 2] {
        let joints = self.tree.joint_count();
        let states: [_; 4] = std::array::from_fn(|_| random_state(&self.tree, random));
        let velocity = axis.of(&states[0].v);
        [[0, 1], [2, 3]].map(|moments: [usize; 2]| {
            let [before, now] = moments.map(|moment| &states[moment]);
            let mut speeds = [before.v.clone(), now.v.clone()].concat();
            let (joint, factor) = axis.terms[0];
            speeds[joints + joint] += (velocity - axis.of(&now.v)) / factor;
            let signals =
                [[before.q.clone(), now.q.clone()].concat(), speeds, [&before.a[..], &now.a].concat()];
            let torques = (0..2 * joints).map(|_| random.uniform(-TORQUE, TORQUE)).collect();
            let start = random.uniform(0.0, 50.0);
            let block = Block::unfiltered(joints, vec![start, start + PERIOD], signals, torques);
            self.columns(&block, 1).remove(1)
        })
    }

    /// The joints swing about a posture; the measured torques do as well.
    fn swing(&self, seed: u64, rows: usize) -> Block {
        let joints = self.tree.joint_count();
        let state = random_state(&self.tree, &mut RandomNumbers::new(seed));
        let signal = |value: &dyn Fn(usize, f64) -> f64| -> Vec<f64> {
            (0..rows * joints)
                .map(|index| value(index % joints, SWING * PERIOD * (index / joints) as f64))
                .collect()
        };
        let signals = [
            signal(&|joint, phase| state.q[joint] + state.v[joint] / SWING * phase.sin()),
            signal(&|joint, phase| state.v[joint] * phase.cos()),
            signal(&|joint, phase| -state.v[joint] * SWING * phase.sin()),
        ];
        let torque = signal(&|joint, phase| TORQUE * (phase + joint as f64).sin());
        let temperature = signal(&|_, phase| WARM + 10.0 * phase);
        let mut block =
            Block::unfiltered(joints, (0..rows).map(|row| PERIOD * row as f64).collect(), signals, torque);
        block.temp = Some(temperature);
        block
    }

    /// For each parameter of the design, whether a row's columns change with what comes after it.
    fn probe_of_causality(&self, seed: u64) -> Vec<bool> {
        let at = |rows| self.columns(&self.swing(seed, rows), LOOKED_AT).remove(LOOKED_AT);
        let (until, whole) = (at(LOOKED_AT + 1), at(ROWS));
        let differs = |((_, a), (_, b)): (&(usize, f64), &(usize, f64))| {
            (a - b).abs() > ROUNDING * a.abs().max(b.abs())
        };
        until.iter().zip(&whole).map(|(a, b)| a.iter().zip(b).any(differs)).collect()
    }

    /// For each effect, the least power \[W\] that it takes from a motion at any moment, its parameters drawn
    /// within their bounds.
    fn least_powers(&self, seed: u64) -> Vec<f64> {
        let (block, mut random) = (self.swing(seed, ROWS), RandomNumbers::new(seed));
        let columns = self.columns(&block, ROWS - 1);
        let mut least_power = |(_, effect, places): (&str, &dyn Effect, Range<usize>)| {
            let draw = |parameter: EffectParameter| {
                let (lower, upper) = parameter.bounds;
                random.uniform(lower.max(-1.0), upper.min(1.0))
            };
            let drawn: Vec<f64> = effect.parameters().into_iter().map(draw).collect();
            let power = |(sample, columns): (usize, &Columns)| -> f64 {
                let speeds = &block.qd[block.row(sample)];
                let of_parameter = |(place, value): (usize, &f64)| -> f64 {
                    columns[place].iter().map(|(torque, column)| value * column * speeds[*torque]).sum()
                };
                places.clone().zip(&drawn).map(of_parameter).sum()
            };
            columns.iter().enumerate().map(power).fold(f64::INFINITY, f64::min)
        };
        self.effects().map(&mut least_power).collect()
    }

    /// Effects with their kinds and the places of their parameters in the design.
    fn effects(&self) -> impl Iterator<Item = (&str, &dyn Effect, Range<usize>)> {
        let effects = self.design.effects().iter().map(AsRef::as_ref).enumerate();
        effects
            .map(|(index, effect)| (self.kinds[index].as_str(), effect, self.design.effect_parameters(index)))
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, ..ProptestConfig::default() })]

    /// The estimators rely on it: noise of a period is accounted for exactly in what is linear, and in what
    /// looks ahead the motion alone does not determine it.
    #[test]
    fn what_effects_declare_is_true_of_their_columns(seed in 0u64..100_000, joints in 1usize..5) {
        let zoo = Zoo::new(seed, joints);
        let (linear, ahead) = (zoo.probe_of_linearity(seed), zoo.probe_of_causality(seed));
        for (kind, effect, places) in zoo.effects() {
            for (own, place) in places.enumerate() {
                prop_assert!(!effect.is_linear_in_motion(own) || linear[place] == (true, true), "{kind}: linear");
                prop_assert!(!effect.is_causal() || !ahead[place], "{kind}: causal");
            }
        }
    }

    /// The likelihood of a motion takes the mean of such a column along that velocity.
    #[test]
    fn what_turns_with_a_velocity_changes_with_nothing_else(seed in 0u64..100_000, joints in 2usize..5) {
        let (zoo, mut random) = (Zoo::new(seed, joints), RandomNumbers::new(seed));
        let mut moments: Vec<(VelocitySum, [Columns; 2])> = Vec::new();
        let mut turning = [0, 0];
        for (kind, effect, places) in zoo.effects() {
            for (own, place) in places.enumerate() {
                let Some(axis) = effect.turns_with(own) else { continue };
                if !moments.iter().any(|(other, _)| *other == axis) {
                    moments.push((axis.clone(), zoo.with_one_velocity(&axis, &mut random)));
                }
                let (_, at) = moments.iter().find(|(other, _)| *other == axis).unwrap();
                let [one, other] = at.each_ref().map(|columns| &columns[place]);
                prop_assert_eq!(one.len(), axis.terms.len(), "{}", kind);
                // One function of the velocity, times the factor of each joint.
                let function = one.iter().find(|(joint, _)| *joint == axis.terms[0].0).unwrap().1 / axis.terms[0].1;
                for (joint, value) in one.iter().chain(other) {
                    let factor = axis.terms.iter().find(|(own, _)| own == joint).unwrap().1;
                    let difference = (value - factor * function).abs();
                    prop_assert!(difference <= ROUNDING * (1.0 + value.abs()), "{kind}: {value}, {function}");
                }
                turning[usize::from(axis.joint().is_none())] += 1;
            }
        }
        // Coulomb, asymmetric and Stribeck friction, with all constants that are tried; shafts between two.
        prop_assert!(turning[0] >= 25 * joints && turning[1] >= 4, "{turning:?}");
    }

    #[test]
    fn what_dissipates_takes_energy_from_every_motion(seed in 0u64..100_000, joints in 1usize..5) {
        let (zoo, catalogue) = (Zoo::new(seed, joints), Catalogue::default());
        for ((kind, ..), power) in zoo.effects().zip(zoo.least_powers(seed)) {
            prop_assert!(!catalogue.kind(kind).unwrap().dissipates() || power >= 0.0, "{kind}: {power} W");
        }
    }
}

/// No is always safe to say, so that nothing but this test would notice an effect that forgets what it is.
#[test]
fn what_effects_do_not_declare_is_not_true_of_their_columns() {
    let catalogue = Catalogue::default();
    // Whether there was any robot on which what is not declared does not hold, by the kind and what it does
    // not declare.
    let mut refuted: BTreeMap<String, bool> = BTreeMap::new();
    for seed in 0..12 {
        let zoo = Zoo::new(seed, 2 + seed as usize % 3);
        let (linear, ahead) = (zoo.probe_of_linearity(seed), zoo.probe_of_causality(seed));
        let powers = zoo.least_powers(seed);
        let mut note = |what: String, is_refuted: bool| *refuted.entry(what).or_default() |= is_refuted;
        for ((kind, effect, places), power) in zoo.effects().zip(powers) {
            if !effect.is_causal() {
                note(format!("{kind}: causal"), places.clone().any(|place| ahead[place]));
            }
            if !catalogue.kind(kind).unwrap().dissipates() {
                note(format!("{kind}: dissipates"), power < 0.0);
            }
            for ((own, parameter), place) in effect.parameters().iter().enumerate().zip(places) {
                if !effect.is_linear_in_motion(own) {
                    note(format!("{kind}: {} is linear", parameter.name), linear[place] != (true, true));
                }
            }
        }
    }
    let forgotten: Vec<&String> =
        refuted.iter().filter(|(_, refuted)| !**refuted).map(|(what, _)| what).collect();
    assert!(forgotten.is_empty(), "{forgotten:?} may hold, but is not declared");
    assert!(refuted.len() > 40, "{refuted:?}");
}

/// A probe with a few random states took it for linear on joints whose speeds happened to have the same sign
/// in all of them.
#[test]
fn the_magnitude_of_a_speed_is_linear_on_no_joint() {
    let zoo = Zoo::new(1, 4);
    let of_kind = zoo.effects().filter(|(kind, ..)| *kind == "asymmetric_friction");
    let parameters: Vec<bool> = of_kind
        .flat_map(|(_, effect, places)| places.enumerate().map(|(own, _)| effect.is_linear_in_motion(own)))
        .collect();
    assert!(parameters.len() >= 16, "{}", parameters.len());
    assert!(!parameters.contains(&true));
}

/// A joint whose elasticity had been found ended `phiw explain` with a panic while the model was moved: a
/// simulation has no derivatives of the torque by position.
#[test]
fn a_model_with_any_effect_can_be_moved() {
    let zoo = Zoo::new(3, 3);
    let joints = zoo.tree.joint_count();
    let base = BaseParameters::of_tree(&zoo.tree, Default::default()).unwrap();
    let mut parameters = base.from_standard(&zoo.tree.inertial_parameters()).unwrap();
    parameters.resize(zoo.design.parameter_count(), 0.0);
    let backend = Box::new(AnalyticBackend::new(zoo.tree.clone()));
    let mut plant = Plant::new(backend).with_effects(&zoo.design, &parameters).unwrap();
    let state = random_state(&zoo.tree, &mut RandomNumbers::new(5));
    let mut torque = vec![0.0; joints];
    zoo.tree
        .inverse_dynamics(&state.q, &state.v, &state.a, &mut Workspace::new(&zoo.tree), &mut torque)
        .unwrap();
    let mut acceleration = vec![0.0; joints];
    plant.accelerate(0.0, [&state.q, &state.v, &torque, &state.a], &mut acceleration).unwrap();
    for (own, asked) in acceleration.iter().zip(&state.a) {
        assert!((own - asked).abs() < 1e-6 * (1.0 + asked.abs()), "{own} {asked}");
    }
}
