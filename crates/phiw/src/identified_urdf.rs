//! The URDF with the identified parameters in it.

use crate::Error;
use crate::analysis::Analysis;
use phiw_dynamics::urdf::{JointFriction, write_identified_urdf};

/// Effects that URDF's `<dynamics>` can express: as damping, as friction.
const EXPRESSED: [&str; 2] = ["viscous_friction", "coulomb_friction"];

/// The URDF with the identified inertial parameters, and with damping and friction where they were identified.
///
/// # Errors
/// The parameters cannot be expressed.
pub fn identified_urdf(analysis: &Analysis<'_>) -> Result<String, Error> {
    let tree = analysis.model.identified_tree(&analysis.session.tree)?;
    let friction = |joint: usize| {
        let body = analysis.session.tree.joint(joint);
        let [damping, friction] = EXPRESSED.map(|kind| fitted(analysis, kind, &body.joint));
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
        if !EXPRESSED.contains(&effect.spec.kind.as_str()) && !kinds.contains(&effect.spec.kind) {
            kinds.push(effect.spec.kind.clone());
        }
    }
    kinds
}

/// First parameter of the effect of a kind on one joint.
fn fitted(analysis: &Analysis<'_>, kind: &str, joint: &str) -> Option<f64> {
    let effects = &analysis.model.effects;
    let effect = effects.iter().find(|effect| effect.spec.kind == kind && effect.spec.joints == [joint])?;
    effect.parameters.first().map(|parameter| parameter.value)
}
