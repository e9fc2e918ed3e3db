//! What differs in a training log that tells otherwise than the others.

use crate::arguments::{ExplainArguments, SessionArguments};
use crate::console::Console;
use crate::in_memory::InMemory;
use crate::warnings::file_name;
use crate::{Error, explain, identify};
use phiw_identification::EffectSpec;
use phiw_identification::effect::EffectSelector;
use phiw_report::json::EffectJson;
use phiw_report::number::significant;
use phiw_residual::trace::FoundEffect;
use std::path::{Path, PathBuf};

/// Says by which effects the training log `odd` differs from the others: the model of these is held, with
/// what was `found` in all of them, and what has changed is sought in it. Nothing where nothing is found.
///
/// # Errors
/// The other logs, or this one, hold too little for a model.
pub fn what_differs(
    arguments: &ExplainArguments,
    odd: usize,
    found: &[FoundEffect],
) -> Result<Option<String>, Error> {
    let session = &arguments.session;
    let Some(log) = session.train.get(odd) else { return Ok(None) };
    let others: Vec<PathBuf> = session.train.iter().filter(|other| *other != log).cloned().collect();
    let console = Console::silent();
    let declare = session.declare.iter().cloned().chain(found.iter().map(declaration)).collect();
    let of_others = SessionArguments { train: others, declare, ..session.clone() };
    let model = identify::results(&of_others, &console)?;
    let Some(model) = model.files.iter().find(|file| file.name == "model.json") else { return Ok(None) };
    let model = String::from_utf8_lossy(&model.content).into_owned();
    let differs = changes_in(arguments, model, log)?;
    Ok(differs.map(|differs| format!("{} differs from the other training logs by {differs}", file_name(log))))
}

/// The effects that have changed in `log` where the `model` (as in `model.json`) is held; nothing where none
/// is found.
///
/// # Errors
/// The log holds too little.
pub fn changes_in(arguments: &ExplainArguments, model: String, log: &Path) -> Result<Option<String>, Error> {
    let session = &arguments.session;
    let held = ExplainArguments {
        session: SessionArguments {
            train: vec![log.to_owned()],
            validate: Vec::new(),
            declare: Vec::new(),
            in_memory: InMemory { model: Some(model), ..session.in_memory.clone() },
            ..session.clone()
        },
        model: Some(PathBuf::from("model.json")),
        draws: 0,
        ..arguments.clone()
    };
    let found = explain::results(&held, &Console::silent())?;
    let effects: Vec<String> = found.report.effects.iter().map(in_words).collect();
    Ok((!effects.is_empty()).then(|| effects.join("; ")))
}

/// What declares an effect where it was found.
fn declaration(found: &FoundEffect) -> String {
    let EffectSpec { kind, joints, .. } = &found.spec;
    let joints = (!joints.is_empty()).then(|| joints.clone());
    EffectSelector { kind: kind.clone(), joints }.to_string()
}

/// An effect with its first parameter on each joint.
fn in_words(effect: &EffectJson) -> String {
    let value = effect.parameters.iter().filter_map(|(_, own)| {
        let (name, parameter) = own.iter().next()?;
        Some(format!("{name} {} {}", significant(parameter.value, 3), parameter.unit))
    });
    let values: Vec<String> = value.collect();
    format!("{} of {} ({})", effect.kind.replace('_', " "), effect.joints.join(", "), values.join(", "))
}
