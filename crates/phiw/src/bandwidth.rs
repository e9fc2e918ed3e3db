//! What the cut-off of the parallel filter does to the answer, in words and numbers.

use crate::Error;
use crate::session::Session;
use phiw_effects::SignalRanges;
use phiw_identification::bandwidth::{Bandwidth, BandwidthSettings, bandwidth};
use phiw_identification::{Progress, Variants};
use phiw_report::json::{BandwidthJson, CutoffJson, MovedParameterJson};
use phiw_report::number::{percent, significant};
use phiw_report::page::Picture;
use phiw_report::plot::{Line, SpectrumLine, SpectrumPlot, spectrum};

/// What cut-offs are compared with beside the declared effects, so that no friction that is missing decides.
const TEXTBOOK: [&str; 3] = ["viscous_friction", "coulomb_friction", "torque_offset"];

/// Compares cut-offs on the training logs with the declared effects and the textbook's; `None` where the logs
/// hold too little.
///
/// # Errors
/// An effect cannot be declared, or a log cannot be read.
pub fn of_session(session: &Session, progress: Progress<'_>) -> Result<Option<Bandwidth>, Error> {
    let sources = session.logs.sources(progress);
    let effects = with_textbook(session, session.effects(&session.data(&sources))?)?;
    Ok(bandwidth(&session.tree, effects, &session.logs, &BandwidthSettings::default(), progress)?)
}

/// The declared effects and the textbook's.
///
/// # Errors
/// An effect cannot be declared.
pub fn with_textbook(session: &Session, mut effects: Vec<Variants>) -> Result<Vec<Variants>, Error> {
    let ranges = SignalRanges::of_surveys(session.logs.training());
    let kind_of = |declared: &str| declared.split(':').next().unwrap_or_default().to_owned();
    for kind in TEXTBOOK.iter().filter(|kind| !session.declared.iter().any(|other| kind_of(other) == **kind))
    {
        effects.extend(session.catalogue.declare(kind, &session.tree, &ranges)?);
    }
    Ok(effects)
}

/// What a reader should know of the cut-off.
pub fn warnings(found: &Bandwidth) -> Vec<String> {
    let own = significant(found.reference_hz, 3);
    let mut warnings = Vec::new();
    if let Some((better_hz, rung)) = found
        .better_hz
        .and_then(|better_hz| Some((better_hz, found.rungs.iter().find(|rung| rung.cutoff_hz == better_hz)?)))
    {
        let better = significant(better_hz, 3);
        warnings.push(format!(
            "a fit with columns and torque low-passed at {better} Hz foretells training motion left out \
             better than the one at {own} Hz: it saves {} ± {} % of the error's variance in the same \
             band; compare with --parallel-cutoff-hz {better}",
            percent(rung.comparison.saving),
            percent(rung.comparison.standard_error)
        ));
    }
    if let Some(most) = found.moved.first() {
        let other = significant(most.cutoff_hz, 3);
        let more = match found.moved.len() - 1 {
            0 => String::new(),
            1 => ", another one too".to_owned(),
            more => format!(", {more} others too"),
        };
        warnings.push(format!(
            "the answer depends on the cut-off: {} moves by {} of its standard deviations if columns and \
             torque are low-passed at {other} Hz and not at {own} Hz{more}; compare with \
             --parallel-cutoff-hz {other}",
            most.name,
            significant(most.deviations, 2)
        ));
    }
    warnings
}

/// The comparison as an entry of the conditioning.
pub fn in_words(found: &Bandwidth) -> String {
    let rung = |rung: &phiw_identification::bandwidth::Rung| {
        format!("{} % at {} Hz", percent(rung.relative), significant(rung.cutoff_hz, 3))
    };
    let rungs: Vec<String> = found.rungs.iter().map(rung).collect();
    format!(
        "error on training motion left out, of fits at other cut-offs (with viscous and Coulomb friction \
         and offset of all joints), all in the band of {} Hz: {}",
        significant(found.reference_hz, 3),
        rungs.join(", ")
    )
}

/// The comparison as a picture.
pub fn picture(found: &Bandwidth) -> Picture {
    let cutoffs: Vec<f64> = found.rungs.iter().map(|rung| rung.cutoff_hz).collect();
    let errors: Vec<f64> = found.rungs.iter().map(|rung| 1e2 * rung.relative).collect();
    let line = SpectrumLine { name: "error on folds left out", line: Line { x: &cutoffs, y: &errors } };
    let plot = SpectrumPlot { lines: &[line], y_label: "error [%]", cut_off: Some(found.reference_hz) };
    let caption = format!(
        "Error on training motion left out over the cut-off that the fit is made with, all in the band of {} Hz, which is the upright line.",
        significant(found.reference_hz, 3)
    );
    Picture { caption, svg: spectrum(&plot) }
}

/// The comparison as numbers.
pub fn json(found: &Bandwidth) -> BandwidthJson {
    let rung = |rung: &phiw_identification::bandwidth::Rung| CutoffJson {
        cutoff_hz: rung.cutoff_hz,
        left_out_relative: rung.relative,
        saving: rung.comparison.saving,
        saving_std: rung.comparison.standard_error,
        chosen: rung.cutoff_hz == found.reference_hz,
    };
    let moved = |moved: &phiw_identification::bandwidth::MovedParameter| MovedParameterJson {
        parameter: moved.name.clone(),
        cutoff_hz: moved.cutoff_hz,
        deviations: moved.deviations,
    };
    BandwidthJson {
        reference_hz: found.reference_hz,
        better_hz: found.better_hz,
        curve: found.rungs.iter().map(rung).collect(),
        moved: found.moved.iter().map(moved).collect(),
    }
}
