//! Training logs without one that is of another robot: a tool, a repair, a brake that drags.

use crate::Error;
use crate::arguments::SessionArguments;
use crate::session::Session;
use crate::warnings::file_name;
use phiw_effects::SignalRanges;
use phiw_identification::fitting::odd_log;
use phiw_identification::{Data, EffectCatalogue, EffectSpec, Identified, Variants, identify};
use std::path::{Path, PathBuf};

/// The training log that is of another robot than the others, and the arguments without it; nothing where
/// there is none.
///
/// Logs are compared by the model that a textbook has, whatever is declared: a friction that the model lacks
/// is no other robot.
///
/// # Errors
/// A log cannot be read any more.
pub fn without_odd_log(
    session: &Session,
    data: &Data<'_>,
) -> Result<Option<(SessionArguments, PathBuf)>, Error> {
    let logs = session.logs.training();
    if logs.len() < 3 {
        return Ok(None);
    }
    // Logs that tell no textbook model say nothing of each other.
    let Ok(identified) = identify(&session.tree, textbook(session, data)?, data) else { return Ok(None) };
    let Identified { design, fit, train_folds, .. } = &identified;
    let odd = odd_log(design, fit, &data.train, train_folds)?;
    let Some(odd) = odd.and_then(|odd| session.arguments.train.get(odd)) else { return Ok(None) };
    let mut others = session.arguments.clone();
    others.train.retain(|log| log != odd);
    Ok(Some((others, odd.clone())))
}

/// What is said of a log that was left out, and of what differs in it.
pub fn warning(odd: &Path, differs: Option<&str>) -> String {
    let name = file_name(odd);
    let by = differs.map_or_else(
        || format!("phiw explain --model model.json --train {name} asks what differs"),
        |differs| format!("it differs by {differs}"),
    );
    format!(
        "{name} is not of the robot of the other training logs (a tool, a repair, a warmer drive), and was left \
         out of the training; {by}"
    )
}

/// What is declared; the frictions and rotor inertias of all joints beside; and what may be another in each
/// log of one robot: frictions that warm up, and zeros of torques. Of the constants of each (over which speed
/// a sign turns) a few are tried: one that fits less well leaves as much more of every log, and hides no
/// other robot.
fn textbook(session: &Session, data: &Data<'_>) -> Result<Vec<Variants>, Error> {
    let mut effects = session.effects(data)?;
    let spec = |variants: &Variants| variants.first().map(|effect| site(&effect.spec()));
    let declared: Vec<Option<(String, Vec<String>)>> = effects.iter().map(spec).collect();
    let ranges = SignalRanges::of_surveys(session.logs.training());
    let is_textbook = |kind: &&str| {
        let spec = EffectSpec::new(kind, &[]);
        session.catalogue.joint_property(&spec).is_some() || [DRIFT, ZEROS].contains(kind)
    };
    let kinds = session.catalogue.kinds().map(|kind| kind.name());
    let kinds: Vec<&str> = kinds.filter(is_textbook).collect();
    for kind in kinds {
        let all = session.catalogue.declare(kind, &session.tree, &ranges)?;
        effects.extend(all.into_iter().filter(|variants| !declared.contains(&spec(variants))));
    }
    effects.iter_mut().for_each(|variants| {
        let few = std::mem::take(variants).into_iter().step_by(VARIANTS_APART);
        *variants = few.collect();
    });
    Ok(effects)
}

/// Of so many variants of an effect one is tried. Speeds over which a sign turns are then a factor of 5.7
/// apart. No command calibrates it: the tests of logs of two robots, and a report of 18 joints, are the same
/// with all variants.
const VARIANTS_APART: usize = 5;
const DRIFT: &str = "thermal_drift";
const ZEROS: &str = "torque_zero_by_log";

fn site(spec: &EffectSpec) -> (String, Vec<String>) {
    (spec.kind.clone(), spec.joints.clone())
}
