//! The URDF with the identified parameters in it: those of bodies that can exist.

use crate::Error;
use crate::analysis::Analysis;
use phiw_dynamics::urdf::{JointFriction, write_identified_urdf};

use phiw_identification::effect::JointProperty;
use phiw_identification::{EffectCatalogue, EffectSpec};

/// Properties of a joint that URDF's `<dynamics>` has: damping and friction.
const EXPRESSED: [JointProperty; 2] = [JointProperty::Damping, JointProperty::Friction];

/// The URDF with the identified inertial parameters, and with damping and friction where they were
/// identified.
///
/// # Errors
/// The parameters cannot be expressed.
pub fn identified_urdf(analysis: &Analysis<'_>) -> Result<String, Error> {
    let tree = analysis.model.consistent_tree(&analysis.session.tree)?;
    let friction = |joint: usize| {
        let body = analysis.session.tree.joint(joint);
        let [damping, friction] = EXPRESSED.map(|property| fitted(analysis, property, &body.joint));
        // What was not identified stays as the URDF declares it.
        (damping.is_some() || friction.is_some()).then(|| JointFriction {
            joint: body.joint.clone(),
            damping: damping.unwrap_or(body.damping),
            friction: friction.unwrap_or(body.friction),
        })
    };
    let declared: Vec<JointFriction> = (0..tree.joint_count()).filter_map(friction).collect();
    write_identified_urdf(&analysis.session.xml, &tree, &declared)
        .map_err(|source| Error::IdentifiedUrdf(Box::new(source)))
}

/// Kinds of effects in the model that the URDF lacks.
pub fn not_expressed(analysis: &Analysis<'_>) -> Vec<String> {
    let mut kinds: Vec<String> = Vec::new();
    for effect in &analysis.model.effects {
        let property = analysis.session.catalogue.joint_property(&effect.spec);
        let is_expressed = property.is_some_and(|property| EXPRESSED.contains(&property));
        if !is_expressed && !kinds.contains(&effect.spec.kind) {
            kinds.push(effect.spec.kind.clone());
        }
    }
    kinds
}

/// The parameter of the effect on one joint that is this property of it.
fn fitted(analysis: &Analysis<'_>, property: JointProperty, joint: &str) -> Option<f64> {
    let catalogue = &analysis.session.catalogue;
    let is_it =
        |spec: &EffectSpec| spec.joints == [joint] && catalogue.joint_property(spec) == Some(property);
    let effect = analysis.model.effects.iter().position(|effect| is_it(&effect.spec))?;
    analysis.model.consistent_effect(effect, 0)
}
