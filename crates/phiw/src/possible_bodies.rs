//! What is said of the bodies that can exist, in words and in `report.json`.

use crate::analysis::Analysis;
use crate::page::counted;
use crate::report_json::by_joint;
use phiw_identification::Model;
use phiw_identification::consistent::{Consistent, impossible_bodies};
use phiw_identification::fitting::Fit;
use phiw_report::json::{ConsistencyJson, OfBothFits};
use phiw_report::number::percent;

/// Names of the bodies that least squares has made impossible, by the joints that carry them.
pub fn impossible(model: &Model) -> Vec<String> {
    let standard: Vec<f64> = model.bodies.iter().flat_map(|body| body.inertial).collect();
    impossible_bodies(&standard).into_iter().map(|body| model.bodies[body].joint.clone()).collect()
}

/// A warning where least squares has made bodies that cannot exist, or effects out of their bounds.
pub fn warning(model: &Model, consistent: &Consistent, fit: &Fit) -> Vec<String> {
    let mut warnings = Vec::new();
    let impossible = impossible(model);
    if !impossible.is_empty() {
        warnings.push(format!(
            "no distribution of mass has the least-squares parameters of {} of {} ({}): identified.urdf holds the possible ones that fit best, model.json both",
            impossible.len(),
            counted(model.bodies.len(), "body").replace("bodys", "bodies"),
            impossible.join(", ")
        ));
    }
    if !consistent.certified {
        warnings.push(format!(
            "the fit of possible bodies is not certified: it may be {:.1e} above its optimum (training residuals as small as {:.1e} leave too few digits)",
            consistent.gap,
            fit.residual_std.iter().copied().fold(f64::INFINITY, f64::min)
        ));
    }
    warnings
}

/// What possible bodies cost, in one sentence.
pub fn sentence(analysis: &Analysis<'_>) -> String {
    let (possible, free) = (&analysis.consistent.held_out, &analysis.identified.held_out);
    let impossible = impossible(&analysis.model).len();
    let bodies = analysis.model.bodies.len();
    let why = match impossible {
        0 => "by least squares, whose bodies can exist, too".to_owned(),
        _ => format!("by least squares, {impossible} of whose {bodies} bodies cannot exist"),
    };
    format!(
        "With bodies that can exist (identified.urdf) the held-out error is {} %; {} % {why}.",
        percent(possible.relative),
        percent(free.relative)
    )
}

/// The same as numbers.
pub fn json(analysis: &Analysis<'_>) -> ConsistencyJson {
    let joints = analysis.joints();
    let (possible, free) = (&analysis.consistent.held_out, &analysis.identified.held_out);
    let both: Vec<OfBothFits> = (possible.rmse.iter().zip(&free.rmse))
        .map(|(&consistent, &least_squares)| OfBothFits { least_squares, consistent })
        .collect();
    ConsistencyJson {
        prior_weight: analysis.consistent.weight,
        gap: analysis.consistent.gap,
        certified: analysis.consistent.certified,
        impossible: impossible(&analysis.model),
        validate: by_joint(&joints, &both),
        validate_relative: OfBothFits { least_squares: free.relative, consistent: possible.relative },
    }
}
