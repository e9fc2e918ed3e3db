//! Two joints behind one transmission: the torque of each depends on the other's motion, or on their sum
//! (differential wrists).

use crate::columns::ParameterKind;
use crate::fitted::FittedEffect;
use crate::kind::{Constants, EffectKind, Refinement, SignalRanges, around, constant, product, values};
use crate::mechanism::{Mechanism, Mechanisms};
use crate::sign::{WIDTH, smooth_sign};
use phiw_codegen::{Expression, JointTorque};
use phiw_dynamics::Tree;
use phiw_identification::effect::{
    EffectParameter, Entry, Evaluator, JointProperty, QuadraticForm, QuadraticTerm, Sample, VelocitySum,
};
use phiw_identification::{Effect, EffectSpec};

/// Torque at one joint from the motion of another, both ways or one way.
///
/// What is stretched by both joints (a hose, a tendon, a spring over an elbow and a wrist) is a spring of
/// each of them (`joint_spring`) and a stiffness that crosses over.
///
/// Motors that turn with the sum q_i + q_j feel viscous friction, Coulomb friction and inertia of the sum;
/// what the joints' own friction and rotor inertia do not take up is the part that crosses over. Gears
/// between them make it q_i + `ratio`·q_j, which Coulomb friction alone tells from a sum: of viscous friction
/// and inertia, the joints' own take up the rest of any.
pub struct TransmissionCoupling;

/// Which terms a coupling has: one bit for each of [`TERMS`].
const TERMS_CONSTANT: &str = "terms";
/// How often the second joint's speed counts in the shaft's.
const RATIO: &str = "ratio";

/// Joints further apart than this along the tree do not share a transmission.
const LARGEST_DISTANCE: usize = 2;

/// A column computed from the motion of both joints.
type MotionColumn = fn(&Motion) -> f64;

#[derive(Clone, Copy)]
struct Term {
    name: &'static str,
    dimension: ParameterKind,
    lower: f64,
    /// Columns in the torques of the first and the second joint of the pair, of the velocities and
    /// accelerations of both, and the sign's width.
    columns: [Option<MotionColumn>; 2],
}

struct Motion {
    position: [f64; 2],
    velocity: [f64; 2],
    acceleration: [f64; 2],
    width: f64,
    ratio: f64,
}

impl Motion {
    fn sign_of_sum(&self) -> f64 {
        smooth_sign(self.velocity[0] + self.ratio * self.velocity[1], self.width)
    }
    fn sign_of_difference(&self) -> f64 {
        smooth_sign(self.velocity[0] - self.ratio * self.velocity[1], self.width)
    }
}

const TERMS: [Term; 9] = [
    Term {
        name: "fv_cross",
        dimension: ParameterKind::PerVelocity,
        lower: f64::NEG_INFINITY,
        columns: [Some(|motion| motion.velocity[1]), Some(|motion| motion.velocity[0])],
    },
    Term {
        name: "Ia_cross",
        dimension: ParameterKind::Inertia,
        lower: f64::NEG_INFINITY,
        columns: [Some(|motion| motion.acceleration[1]), Some(|motion| motion.acceleration[0])],
    },
    Term {
        name: "fc_sum",
        dimension: ParameterKind::Torque,
        lower: 0.0,
        columns: [Some(Motion::sign_of_sum), Some(|motion| motion.ratio * motion.sign_of_sum())],
    },
    Term {
        name: "fc_difference",
        dimension: ParameterKind::Torque,
        lower: 0.0,
        columns: [
            Some(Motion::sign_of_difference),
            Some(|motion| -motion.ratio * motion.sign_of_difference()),
        ],
    },
    Term {
        name: "fv_of_second_on_first",
        dimension: ParameterKind::PerVelocity,
        lower: f64::NEG_INFINITY,
        columns: [Some(|motion| motion.velocity[1]), None],
    },
    Term {
        name: "fv_of_first_on_second",
        dimension: ParameterKind::PerVelocity,
        lower: f64::NEG_INFINITY,
        columns: [None, Some(|motion| motion.velocity[0])],
    },
    Term {
        name: "fc_of_second_on_first",
        dimension: ParameterKind::Torque,
        lower: f64::NEG_INFINITY,
        columns: [Some(|motion| smooth_sign(motion.velocity[1], motion.width)), None],
    },
    Term {
        name: "fc_of_first_on_second",
        dimension: ParameterKind::Torque,
        lower: f64::NEG_INFINITY,
        columns: [None, Some(|motion| smooth_sign(motion.velocity[0], motion.width))],
    },
    Term {
        name: "k_cross",
        dimension: ParameterKind::Stiffness,
        lower: f64::NEG_INFINITY,
        columns: [Some(|motion| motion.position[1]), Some(|motion| motion.position[0])],
    },
];

/// How each term is said, the most telling first.
const SAID: [(&str, &str); 9] = [
    ("fv_cross", "of coupled viscous friction"),
    ("fc_sum", "of friction with the sign of the sum of their speeds"),
    ("fc_difference", "of friction with the sign of the difference of their speeds"),
    ("Ia_cross", "of coupled inertia"),
    ("k_cross", "of coupled stiffness"),
    ("fv_of_second_on_first", "of viscous friction of the second on the first"),
    ("fv_of_first_on_second", "of viscous friction of the first on the second"),
    ("fc_of_second_on_first", "of Coulomb friction of the second on the first"),
    ("fc_of_first_on_second", "of Coulomb friction of the first on the second"),
];

/// Sets of terms to try, simplest first: single terms, then the differential's.
const COMBINATIONS: [u32; 15] =
    [1, 2, 4, 8, 16, 32, 64, 128, 256, 1 | 4, 1 | 8, 1 | 2 | 4, 1 | 2 | 8, 16 | 64, 32 | 128];

impl EffectKind for TransmissionCoupling {
    fn name(&self) -> &str {
        "transmission_coupling"
    }
    fn sites(&self, tree: &Tree) -> Vec<Vec<usize>> {
        let count = tree.joint_count();
        let pairs = (0..count).flat_map(|first| (first + 1..count).map(move |second| vec![first, second]));
        pairs.filter(|pair| distance(tree, pair[0], pair[1]) <= LARGEST_DISTANCE).collect()
    }
    fn acts_on(&self) -> &'static str {
        "two joints at most two apart along the arm"
    }
    fn scan(&self, site: &[usize], ranges: &SignalRanges) -> Vec<Constants> {
        let speed = site.iter().map(|&joint| ranges.joints[joint].velocity_rms).fold(0.0, f64::max);
        product(&values(TERMS_CONSTANT, COMBINATIONS.map(f64::from)), &values(WIDTH, [0.02 * speed]))
    }
    fn refine(&self, &Refinement { found, step, .. }: &Refinement<'_>) -> Vec<Constants> {
        if constant(found, TERMS_CONSTANT, 0.0) as u32 & 0b1100_1100 == 0 {
            return Vec::new();
        }
        let mut own = found.clone();
        own.entry(RATIO.to_owned()).or_insert(1.0);
        [around(found, WIDTH, step), around(&own, RATIO, step)].concat()
    }
    fn with_other_parameters(&self, found: &Constants) -> Vec<Constants> {
        let own = constant(found, TERMS_CONSTANT, 0.0) as u32;
        let is_other = |terms: &u32| *terms != own && [own, *terms].contains(&(terms & own));
        let others = COMBINATIONS.into_iter().filter(is_other).map(f64::from);
        product(std::slice::from_ref(found), &values(TERMS_CONSTANT, others))
    }
    fn telling_motion(&self) -> &'static str {
        "each of the two joints moving alone, then both together"
    }
    fn sentence(&self, found: &FittedEffect<'_>) -> String {
        let terms = SAID.iter().flat_map(|(term, words)| {
            found
                .quantities()
                .filter(move |(name, _)| name == term)
                .map(move |(_, value)| format!("{value} {words}"))
        });
        let terms: Vec<String> = terms.collect();
        let (ratio, second) = (ratio(found.constants()), found.joint_names().get(1));
        let gears = match second {
            Some(second) if ratio != 1.0 => format!(" (the speed of {second} counts {ratio:.2} times)"),
            _ => String::new(),
        };
        format!("{} share a transmission: {}{gears}.", found.joints(), terms.join(", "))
    }
    /// A transmission that turns with the sum or the difference of the two; what is felt one way only is the
    /// work of none.
    fn mechanisms(&self, found: &FittedEffect<'_>) -> Mechanisms {
        let [first, second] = found.joint_names() else { return Mechanisms::default() };
        let mut mechanisms = Mechanisms::default();
        for (name, value) in found.named_values() {
            // c·q̇ of the other is what crosses over of c·(q̇ + q̇ of the other), or of −c·(q̇ − …).
            let (property, sign, crossing_only) = match name {
                "fv_cross" => (JointProperty::Damping, value.signum(), true),
                "Ia_cross" => (JointProperty::Armature, value.signum(), true),
                "fc_sum" => (JointProperty::Friction, 1.0, false),
                "fc_difference" => (JointProperty::Friction, -1.0, false),
                _ => {
                    mechanisms.left_out.push(name.to_owned());
                    continue;
                }
            };
            mechanisms.parts.push(Mechanism::Transmission {
                joints: [first.clone(), second.clone()],
                factors: [1.0, if crossing_only { sign } else { sign * ratio(found.constants()) }],
                property,
                value: if crossing_only { value.abs() } else { value },
                crossing_only,
                width: found.constant(WIDTH),
            });
        }
        mechanisms
    }
    fn formulas(&self, found: &FittedEffect<'_>) -> Vec<JointTorque> {
        let [first, second] = found.joint_names() else { return Vec::new() };
        let (q, v, a) = (Expression::position, Expression::velocity, Expression::acceleration);
        let ratio = ratio(found.constants());
        let sign = |factor: f64| (v(first) + factor * v(second)).sign(found.constant(WIDTH));
        let of_term = |name: &str| match name {
            "fv_cross" => [Some(v(second)), Some(v(first))],
            "Ia_cross" => [Some(a(second)), Some(a(first))],
            "k_cross" => [Some(q(second)), Some(q(first))],
            "fc_sum" => [Some(sign(ratio)), Some(ratio * sign(ratio))],
            "fc_difference" => [Some(sign(-ratio)), Some(-ratio * sign(-ratio))],
            "fv_of_second_on_first" => [Some(v(second)), None],
            "fv_of_first_on_second" => [None, Some(v(first))],
            "fc_of_second_on_first" => [Some(found.sign_of_velocity(second)), None],
            "fc_of_first_on_second" => [None, Some(found.sign_of_velocity(first))],
            _ => [None, None],
        };
        let torques = |(name, value): (&str, f64)| {
            let rows = [first, second].into_iter().zip(of_term(name));
            rows.filter_map(move |(joint, torque)| Some(JointTorque::new(joint, value * torque?)))
                .collect::<Vec<_>>()
        };
        found.named_values().flat_map(torques).collect()
    }
    fn build(&self, tree: &Tree, site: &[usize], constants: &Constants) -> Box<dyn Effect> {
        let chosen = constant(constants, TERMS_CONSTANT, 7.0) as u32;
        let terms: Vec<Term> = TERMS
            .iter()
            .enumerate()
            .filter(|(bit, _)| chosen >> bit & 1 == 1)
            .map(|(_, term)| *term)
            .collect();
        let describe = |term: &Term| EffectParameter {
            joint: tree.joint(site[0]).joint.clone(),
            name: term.name.to_owned(),
            unit: term.dimension.unit(tree, site[0]).to_owned(),
            bounds: (term.lower, f64::INFINITY),
        };
        Box::new(Coupling {
            site: [site[0], site[1]],
            parameters: terms.iter().map(describe).collect(),
            terms,
            spec: EffectSpec {
                kind: self.name().to_owned(),
                joints: site.iter().map(|&joint| tree.joint(joint).joint.clone()).collect(),
                constants: constants.clone(),
            },
        })
    }
}

fn ratio(constants: &Constants) -> f64 {
    constant(constants, RATIO, 1.0)
}

/// Steps from one joint to another along the tree.
fn distance(tree: &Tree, first: usize, second: usize) -> usize {
    let path = |joint: usize| {
        let own = tree.bodies().iter().position(|body| body.joint == tree.joint(joint).joint);
        std::iter::successors(own, |&body| tree.bodies()[body].parent).collect::<Vec<usize>>()
    };
    let (first, second) = (path(first), path(second));
    let shared = first.iter().rev().zip(second.iter().rev()).take_while(|(a, b)| a == b).count();
    // Siblings have the world or one body as their parent: the distance between them goes over it.
    first.len() + second.len() - 2 * shared
}

struct Coupling {
    site: [usize; 2],
    terms: Vec<Term>,
    parameters: Vec<EffectParameter>,
    spec: EffectSpec,
}

impl Effect for Coupling {
    fn spec(&self) -> EffectSpec {
        self.spec.clone()
    }
    fn parameters(&self) -> Vec<EffectParameter> {
        self.parameters.clone()
    }
    fn entries(&self) -> Vec<Entry> {
        let of_term = |(parameter, term): (usize, &Term)| {
            let rows = self.site.into_iter().zip(term.columns);
            rows.filter(|(_, column)| column.is_some())
                .map(|(row, _)| Entry { row, parameter })
                .collect::<Vec<_>>()
        };
        self.terms.iter().enumerate().flat_map(of_term).collect()
    }
    /// Terms with a sign are not, and a stiffness does not change with the motion at all.
    fn is_linear_in_motion(&self, parameter: usize) -> bool {
        let dimension = self.terms.get(parameter).map(|term| term.dimension);
        matches!(dimension, Some(ParameterKind::PerVelocity | ParameterKind::Inertia))
    }
    /// Friction of the shaft that turns with the sum or with the difference.
    fn turns_with(&self, parameter: usize) -> Option<VelocitySum> {
        let [first, second] = self.site;
        let ratio = ratio(&self.spec.constants);
        let of_second = match self.terms.get(parameter)?.name {
            "fc_sum" => ratio,
            "fc_difference" => -ratio,
            _ => return None,
        };
        Some(VelocitySum { terms: vec![(first, 1.0), (second, of_second)] })
    }
    fn quadratic_terms(&self) -> Vec<QuadraticTerm> {
        let of_term = |(parameter, term): (usize, &Term)| {
            let form = match term.dimension {
                ParameterKind::PerVelocity => QuadraticForm::Power,
                ParameterKind::Inertia => QuadraticForm::KineticEnergy,
                _ => return None,
            };
            // One way only, half of it is in each of the mirrored entries.
            let factor = if term.columns.iter().all(Option::is_some) { 1.0 } else { 0.5 };
            Some(QuadraticTerm { parameter, form, coordinates: self.site, factor })
        };
        self.terms.iter().enumerate().filter_map(of_term).collect()
    }
    fn evaluator(&self) -> Box<dyn Evaluator + '_> {
        Box::new(CouplingColumns {
            site: self.site,
            width: constant(&self.spec.constants, WIDTH, 0.0),
            ratio: ratio(&self.spec.constants),
            formulas: self.terms.iter().flat_map(|term| term.columns).flatten().collect(),
        })
    }
}

struct CouplingColumns {
    site: [usize; 2],
    /// Velocity over which a sign turns \[rad/s, m/s\].
    width: f64,
    ratio: f64,
    formulas: Vec<MotionColumn>,
}

impl Evaluator for CouplingColumns {
    fn evaluate(&mut self, sample: &Sample<'_>, columns: &mut [f64]) {
        let both = |values: &[f64]| self.site.map(|joint| values[joint]);
        let motion = Motion {
            position: both(sample.q()),
            velocity: both(sample.qd()),
            acceleration: both(sample.qdd()),
            width: self.width,
            ratio: self.ratio,
        };
        for (column, formula) in columns.iter_mut().zip(&self.formulas) {
            *column = formula(&motion);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{Coupling, Motion, TERMS};
    use crate::sign::smooth_sign;
    use phiw_identification::{Effect, EffectSpec};

    /// Friction of a shaft takes the power that its sign has over the speed that it turns with.
    #[test]
    fn a_geared_shaft_brakes_the_speed_that_it_turns_with() {
        let velocity = [0.7, -1.3];
        for ratio in [-0.6, 0.4, 1.0, 1.7] {
            let motion = Motion { position: [0.0; 2], velocity, acceleration: [0.0; 2], width: 0.1, ratio };
            for (name, of_second) in [("fc_sum", ratio), ("fc_difference", -ratio)] {
                let speed = velocity[0] + of_second * velocity[1];
                let term = TERMS.iter().find(|term| term.name == name).unwrap();
                let columns = velocity.iter().zip(term.columns);
                let power: f64 = columns.map(|(speed, column)| speed * column.unwrap()(&motion)).sum();
                assert!((power - speed * smooth_sign(speed, 0.1)).abs() < 1e-12, "{name} {ratio}: {power}");
            }
        }
    }

    /// The power of a term's columns is what its entries of the matrix say: twice the entry times both
    /// speeds.
    #[test]
    fn the_quadratic_form_of_a_coupling_is_the_power_of_its_columns() {
        let speeds = [0.7, -1.3];
        let motion =
            Motion { position: speeds, velocity: speeds, acceleration: speeds, width: 0.1, ratio: 0.6 };
        let mut counted = 0;
        for term in TERMS {
            let effect = Coupling {
                site: [3, 5],
                terms: vec![term],
                parameters: Vec::new(),
                spec: EffectSpec::new("transmission_coupling", &[]),
            };
            let columns = speeds.iter().zip(term.columns);
            let power: f64 = columns.filter_map(|(speed, column)| Some(speed * column?(&motion))).sum();
            for found in effect.quadratic_terms() {
                assert_eq!(found.coordinates, [3, 5]);
                let expected = 2.0 * found.factor * speeds[0] * speeds[1];
                assert!((power - expected).abs() < 1e-12, "{}: {power}, not {expected}", term.name);
                counted += 1;
            }
        }
        assert_eq!(counted, 4);
    }
}
