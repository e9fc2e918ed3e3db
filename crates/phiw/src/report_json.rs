//! `report.json` of an analysis.

use crate::analysis::Analysis;
use crate::page::conditioning_entries;
use crate::{bandwidth, possible_bodies};
use phiw_identification::fitting::TorqueError;
use phiw_report::ReportJson;
use phiw_report::json::{
    JointMap, ProgramJson, RelativeErrors, RemainingJson, SCHEMA, TorqueErrors, Verdict,
};

/// The report of a model to which nothing was added: after is before.
///
/// The residual was not traced, so there is no verdict unless it is noise on every joint.
pub fn report_json(analysis: &Analysis<'_>) -> ReportJson {
    let joints = analysis.joints();
    let errors = errors(analysis);
    let above: Vec<String> =
        analysis.joints_above_noise().into_iter().map(|joint| joints[joint].clone()).collect();
    ReportJson {
        schema: SCHEMA,
        robot: analysis.session.tree.name().to_owned(),
        declared: analysis.model.declared.clone(),
        verdict: above.is_empty().then_some(Verdict::Sufficient),
        noise_floor: by_joint(&joints, &analysis.noise_floor),
        before: errors.clone(),
        effects: Vec::new(),
        refinements: Vec::new(),
        after: errors,
        remaining: RemainingJson { structured: !above.is_empty(), joints: above, depends_on: Vec::new() },
        warnings: analysis.warnings.clone(),
        phiw: Some(program(analysis)),
        joints,
    }
}

/// The errors of an analysis' model.
pub fn errors(analysis: &Analysis<'_>) -> TorqueErrors {
    let joints = analysis.joints();
    let error = |error: &TorqueError| phiw_report::json::TorqueErrorJson {
        rmse: by_joint(&joints, &error.rmse),
        relative: Some(error.relative),
    };
    TorqueErrors { train: error(&analysis.identified.train), validate: error(&analysis.identified.held_out) }
}

/// What only this program writes.
pub fn program(analysis: &Analysis<'_>) -> ProgramJson {
    let entries = conditioning_entries(analysis).into_iter();
    ProgramJson {
        version: env!("CARGO_PKG_VERSION").to_owned(),
        warnings: analysis.warnings.clone(),
        conditioning: entries.map(|(quantity, value)| (quantity, value.into())).collect(),
        bandwidth: analysis.bandwidth.as_ref().map(bandwidth::json),
        relative_with_rests: Some(RelativeErrors {
            train: analysis.with_rests.train_relative,
            validate: analysis.with_rests.held_out_relative,
        }),
        evidence: Vec::new(),
        unidentifiable: Vec::new(),
        draws: None,
        reproduction: None,
        consistency: Some(possible_bodies::json(analysis)),
        information: Some(analysis.information.clone()),
    }
}

/// One number for each joint.
pub fn by_joint<T: Copy>(joints: &[String], values: &[T]) -> JointMap<T> {
    joints.iter().cloned().zip(values.iter().copied()).collect()
}
