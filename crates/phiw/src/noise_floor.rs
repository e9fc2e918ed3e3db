//! The noise floor of the torques: what a right model would leave.

use crate::Error;
use crate::analysis::Rows;
use crate::session::Session;
use phiw_effects::SignalRanges;
use phiw_identification::effect::JointProperty;
use phiw_identification::{Data, EffectCatalogue, EffectSpec, Model, Variants, identify};
use phiw_residual::trace;

/// A residual up to this many times the noise floor is noise.
pub const NOISE_MARGIN: f64 = 1.1;

/// What the sensors' noise alone would leave under the model's inertia \[N·m, N\]; no more than the margin of
/// noise above what the model left of the motion that it was identified from: inertias that few rows tell
/// make any noise of the positions a large one.
///
/// # Errors
/// A log cannot be read any more.
pub fn noise_floor(session: &Session, rows: Rows<'_>, model: &Model) -> Result<Vec<f64>, Error> {
    let tree = model.identified_tree(&session.tree)?;
    let mut rotor = vec![0.0; tree.joint_count()];
    let armature = Some(JointProperty::Armature);
    let adds_inertia = |spec: &EffectSpec| session.catalogue.joint_property(spec) == armature;
    for effect in model.effects.iter().filter(|effect| adds_inertia(&effect.spec)) {
        let joint = effect.spec.joints.first().and_then(|joint| tree.joint_index(joint));
        if let (Some(joint), Some(inertia)) = (joint, effect.parameters.first()) {
            rotor[joint] += inertia.value;
        }
    }
    let (surveys, conditioning) = (session.logs.surveys(), session.logs.conditioning());
    let floor = match rows {
        Rows::Logs(data) => trace::noise_floor(&tree, &rotor, surveys, conditioning, &data.sources)?,
        Rows::Reduced { poses, .. } => trace::noise_floor_at(&tree, &rotor, surveys, conditioning, poses)?,
    };
    Ok(floor.iter().zip(&model.residual_std).map(|(floor, left)| floor.min(NOISE_MARGIN * left)).collect())
}

/// [`noise_floor`] under the inertia that is told with what the textbook has of every joint, whatever is
/// declared: a friction that is missing is taken for inertia. `None` where the logs do not tell that model.
///
/// # Errors
/// A log cannot be read any more.
pub fn noise_floor_with_textbook(session: &Session, data: &Data<'_>) -> Result<Option<Vec<f64>>, Error> {
    let ranges = SignalRanges::of_surveys(session.logs.training());
    let textbook = session.catalogue.kinds().filter(|kind| kind.joint_property().is_some());
    let mut effects: Vec<Variants> = Vec::new();
    for kind in textbook {
        let all = session.catalogue.declare(kind.name(), &session.tree, &ranges)?;
        effects.extend(all.into_iter().map(|variants| variants.into_iter().take(1).collect()));
    }
    let Ok(identified) = identify(&session.tree, effects, data) else { return Ok(None) };
    let conditioning = session.logs.conditioning();
    let cutoffs = (conditioning.cutoff_hz, conditioning.parallel_cutoff_hz);
    let model = Model::of_fit(&identified.design, &identified.fit, &[], &session.held, cutoffs)?;
    noise_floor(session, Rows::Logs(data), &model).map(Some)
}
