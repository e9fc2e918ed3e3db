//! External effects: a payload, a force, gravity from another direction.

use crate::fitted::FittedEffect;
use crate::kind::{Constants, EffectKind, Signal};
use phiw_dynamics::Tree;
use phiw_dynamics::inertia::{PARAMETER_NAMES, PARAMETERS_PER_BODY};
use phiw_identification::effect::{EffectParameter, Entry, Evaluator, Needs, Sample};
use phiw_identification::{Effect, EffectSpec};
use phiw_regressor::JointTorqueRegressor;

/// A rigid body held at a link: mass, first moment and inertia.
pub struct Payload;

impl EffectKind for Payload {
    fn name(&self) -> &str {
        "payload"
    }
    fn needs_held_model(&self) -> bool {
        true
    }
    fn telling_motion(&self) -> &'static str {
        "the same motion with and without the payload"
    }
    fn sentence(&self, found: &FittedEffect<'_>) -> String {
        let joint = found.joints();
        if found.value(0) != 0.0 {
            return format!(
                "The link behind {joint} carries {} more than the model knows.",
                found.quantity(0)
            );
        }
        match largest(found, 1..4).or_else(|| largest(found, 4..PARAMETERS_PER_BODY)) {
            Some((name, value)) => format!(
                "The link behind {joint} carries something that the model does not know: {name} of {value}; its \
                 mass the logs do not tell."
            ),
            None => found.plainly(),
        }
    }
    fn seen_against(&self) -> Signal {
        Signal::Position
    }
    fn build(&self, tree: &Tree, site: &[usize], constants: &Constants) -> Box<dyn Effect> {
        let regressor = JointTorqueRegressor::new(tree);
        let body = body_of(tree, site[0]);
        let pairs = pairs_of(&regressor, body);
        let joint = tree.joint(site[0]).joint.clone();
        let parameter = |name: &&str| EffectParameter {
            joint: joint.clone(),
            name: (*name).to_owned(),
            unit: standard_unit(name).to_owned(),
            bounds: (if *name == "m" { 0.0 } else { f64::NEG_INFINITY }, f64::INFINITY),
        };
        Box::new(BodyColumns {
            rows: pairs.iter().map(|&(row, _)| row).collect(),
            places: pairs
                .iter()
                .map(|&(_, place)| (0..PARAMETERS_PER_BODY).map(|column| place + column).collect())
                .collect(),
            parameters: PARAMETER_NAMES.iter().map(parameter).collect(),
            spec: EffectSpec {
                kind: self.name().to_owned(),
                joints: vec![joint],
                constants: constants.clone(),
            },
            needs: Needs::default(),
        })
    }
}

/// The largest of some parameters of the same effect, by its name and with its unit; `None` where the logs
/// tell none of them.
fn largest<'a>(found: &FittedEffect<'a>, places: std::ops::Range<usize>) -> Option<(&'a str, String)> {
    let size = |place: &usize| found.value(*place).abs();
    let place = places.filter(|place| size(place) > 0.0).max_by(|a, b| size(a).total_cmp(&size(b)))?;
    let (name, value) = found.named_values().nth(place)?;
    Some((name, found.in_unit_of(place, value.abs())))
}

/// A constant force in the world's frame on a link, at a point fixed in the link: F and the nine products of
/// F with the point.
///
/// A body of mass m under gravity g feels the force m·g at its centre of mass, so the columns are those of
/// the regressor at rest under unit gravity along x, y and z.
pub struct ExternalForce;

impl EffectKind for ExternalForce {
    fn name(&self) -> &str {
        "external_force"
    }
    fn telling_motion(&self) -> &'static str {
        "rests in many poses, with and without what pulls"
    }
    fn sentence(&self, found: &FittedEffect<'_>) -> String {
        let start = format!("Something pulls at the link behind {} (a hose, a cable)", found.joints());
        let (told, untold): (Vec<usize>, Vec<usize>) = (0..3).partition(|&axis| found.value(axis) != 0.0);
        let axes =
            |places: &[usize]| -> Vec<&str> { places.iter().map(|&axis| ["x", "y", "z"][axis]).collect() };
        let force: Vec<String> = (told.iter().zip(axes(&told)))
            .map(|(&axis, name)| format!("{} along {name}", found.quantity(axis)))
            .collect();
        match (force.is_empty(), untold.is_empty(), largest(found, 3..found.values().len())) {
            (false, true, _) => format!("{start}: {} of the world.", force.join(", ")),
            (false, false, _) => format!(
                "{start}: {} of the world; along {} the logs do not tell it.",
                force.join(", "),
                axes(&untold).join(" and ")
            ),
            (true, _, Some((_, moment))) => {
                format!("{start}: its moment is up to {moment}; the force itself the logs do not tell.")
            }
            (true, _, None) => found.plainly(),
        }
    }
    fn seen_against(&self) -> Signal {
        Signal::Position
    }
    fn build(&self, tree: &Tree, site: &[usize], constants: &Constants) -> Box<dyn Effect> {
        let regressor = JointTorqueRegressor::new(tree);
        let size = regressor.buffer_size();
        let pairs = pairs_of(&regressor, body_of(tree, site[0]));
        let joint = tree.joint(site[0]).joint.clone();
        // Force first, then its products with the point, so that the simple part leads.
        let order: Vec<(usize, usize)> = (0..3)
            .map(|axis| (axis, 0))
            .chain((0..3).flat_map(|axis| (1..4).map(move |at| (axis, at))))
            .collect();
        let parameter = |&(axis, at): &(usize, usize)| {
            let force = ["Fx", "Fy", "Fz"][axis];
            let (name, unit) = if at == 0 {
                (force.to_owned(), "N")
            } else {
                (format!("{force}_p{}", ["x", "y", "z"][at - 1]), "N·m")
            };
            EffectParameter {
                joint: joint.clone(),
                name,
                unit: unit.to_owned(),
                bounds: (f64::NEG_INFINITY, f64::INFINITY),
            }
        };
        let places = |&(_, place): &(usize, usize)| {
            order.iter().map(|&(axis, at)| (axis + 1) * size + place + at).collect()
        };
        Box::new(BodyColumns {
            rows: pairs.iter().map(|&(row, _)| row).collect(),
            places: pairs.iter().map(places).collect(),
            parameters: order.iter().map(parameter).collect(),
            spec: EffectSpec {
                kind: self.name().to_owned(),
                joints: vec![joint],
                constants: constants.clone(),
            },
            needs: Needs { statics: true, ..Needs::default() },
        })
    }
}

/// Columns read off the regressor's pairs of one body: those of the sample, then those at rest under unit
/// gravity along x, y, z.
struct BodyColumns {
    rows: Vec<usize>,
    /// For each row, the place of each parameter's number.
    places: Vec<Vec<usize>>,
    parameters: Vec<EffectParameter>,
    spec: EffectSpec,
    needs: Needs,
}

impl Effect for BodyColumns {
    fn spec(&self) -> EffectSpec {
        self.spec.clone()
    }
    fn parameters(&self) -> Vec<EffectParameter> {
        self.parameters.clone()
    }
    fn entries(&self) -> Vec<Entry> {
        let count = self.parameters.len();
        self.rows.iter().flat_map(|&row| (0..count).map(move |parameter| Entry { row, parameter })).collect()
    }
    fn needs(&self) -> Needs {
        self.needs
    }
    fn evaluator(&self) -> Box<dyn Evaluator + '_> {
        Box::new(PairColumns(self))
    }
}

struct PairColumns<'a>(&'a BodyColumns);

impl Evaluator for PairColumns<'_> {
    fn evaluate(&mut self, sample: &Sample<'_>, columns: &mut [f64]) {
        let (pairs, statics) = (sample.regressor_pairs(), sample.static_regressor_pairs());
        let value = |place: usize| pairs.get(place).or_else(|| statics.get(place - pairs.len())).copied();
        for (column, &place) in columns.iter_mut().zip(self.0.places.iter().flatten()) {
            *column = value(place).unwrap_or_default();
        }
    }
}

/// Gravity's direction differs from the declared one: its x and y components in the world's frame.
pub struct GravityTilt;

impl EffectKind for GravityTilt {
    fn name(&self) -> &str {
        "gravity_tilt"
    }
    fn sites(&self, _tree: &Tree) -> Vec<Vec<usize>> {
        vec![Vec::new()]
    }
    fn acts_on(&self) -> &'static str {
        "the whole robot (no joint is named)"
    }
    fn telling_motion(&self) -> &'static str {
        "rests in many poses of the first joint"
    }
    fn sentence(&self, found: &FittedEffect<'_>) -> String {
        let lean = (found.value(0).hypot(found.value(1)) / STANDARD_GRAVITY).clamp(-1.0, 1.0).asin();
        format!("The base is not level: gravity leans by {:.2} degrees.", lean.to_degrees())
    }
    fn seen_against(&self) -> Signal {
        Signal::Position
    }
    fn build(&self, tree: &Tree, _site: &[usize], constants: &Constants) -> Box<dyn Effect> {
        Box::new(Tilt { joints: tree.joint_count(), constants: constants.clone() })
    }
}

/// What the lean of the base is measured against \[m/s²\].
const STANDARD_GRAVITY: f64 = 9.81;

struct Tilt {
    joints: usize,
    constants: Constants,
}

impl Effect for Tilt {
    fn spec(&self) -> EffectSpec {
        EffectSpec { kind: "gravity_tilt".to_owned(), joints: Vec::new(), constants: self.constants.clone() }
    }
    fn parameters(&self) -> Vec<EffectParameter> {
        let parameter = |name: &str| EffectParameter {
            joint: "base".to_owned(),
            name: name.to_owned(),
            unit: "m/s²".to_owned(),
            bounds: (-STANDARD_GRAVITY, STANDARD_GRAVITY),
        };
        vec![parameter("gx"), parameter("gy")]
    }
    fn entries(&self) -> Vec<Entry> {
        (0..2).flat_map(|parameter| (0..self.joints).map(move |row| Entry { row, parameter })).collect()
    }
    fn needs(&self) -> Needs {
        Needs { gravity: true, ..Needs::default() }
    }
    fn evaluator(&self) -> Box<dyn Evaluator + '_> {
        Box::new(TiltColumns)
    }
}

struct TiltColumns;

impl Evaluator for TiltColumns {
    fn evaluate(&mut self, sample: &Sample<'_>, columns: &mut [f64]) {
        let torques = sample.torque_by_gravity();
        columns.fill(0.0);
        columns.iter_mut().zip(torques).for_each(|(column, torque)| *column = *torque);
    }
}

/// The body that a joint moves first-hand.
fn body_of(tree: &Tree, joint: usize) -> usize {
    let name = &tree.joint(joint).joint;
    tree.bodies().iter().position(|body| &body.joint == name).unwrap_or_default()
}

/// Rows that a body acts on, and the place of its ten numbers in the regressor's pairs.
fn pairs_of(regressor: &JointTorqueRegressor, body: usize) -> Vec<(usize, usize)> {
    (0..regressor.rows())
        .filter_map(|row| {
            let position = regressor.row_bodies(row).iter().position(|&other| other == body)?;
            Some((row, regressor.row_range(row).start + PARAMETERS_PER_BODY * position))
        })
        .collect()
}

fn standard_unit(name: &str) -> &'static str {
    match name {
        "m" => "kg",
        "mcx" | "mcy" | "mcz" => "kg·m",
        _ => "kg·m²",
    }
}
