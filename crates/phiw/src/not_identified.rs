//! Parameters of the fit that it leaves out or that are poor, in words.

use crate::analysis::Analysis;
use crate::parameters;

/// A parameter that takes this share of another's effect is named with it.
const ACTS_LIKE: f64 = 0.05;
/// More are only counted.
const NAMED: usize = 3;

/// A line for each parameter that could not be separated from others, and one for those that are poor.
pub fn lines(analysis: &Analysis<'_>) -> Vec<String> {
    let mut lines: Vec<String> = analysis
        .identified
        .fit
        .undetermined
        .iter()
        .map(|&parameter| undetermined(analysis, parameter))
        .collect();
    lines.extend(poor(analysis));
    lines
}

/// `joint_1.Ia acts like joint_1.Izz: …`.
fn undetermined(analysis: &Analysis<'_>, parameter: usize) -> String {
    let name = parameters::name(analysis, parameter);
    let base = analysis.identified.design.base().count();
    let shares = analysis.acts_like(parameter).unwrap_or_default();
    let alike: Vec<usize> =
        shares.iter().filter(|(_, share)| share.abs() > ACTS_LIKE).map(|&(column, _)| column).collect();
    if alike.is_empty() {
        return format!("{name}: the training motion does not excite it");
    }
    let named: Vec<String> =
        alike.iter().take(NAMED).map(|&column| parameters::name(analysis, column)).collect();
    let more = if alike.len() > NAMED {
        format!(" and {} more together", alike.len() - NAMED)
    } else {
        String::new()
    };
    let rigid = alike.iter().all(|&column| column < base);
    let from = if rigid { "the rigid body" } else { "them" };
    format!("{name} acts like {}{more}: not separable from {from}, which takes its part", named.join(", "))
}

/// Parameters less certain than they are large.
fn poor(analysis: &Analysis<'_>) -> Option<String> {
    let fit = &analysis.identified.fit;
    let is_poor = |&parameter: &usize| fit.standard_deviations[parameter] > fit.parameters[parameter].abs();
    let poor: Vec<String> = fit
        .determined()
        .into_iter()
        .filter(is_poor)
        .map(|parameter| parameters::name(analysis, parameter))
        .collect();
    (!poor.is_empty()).then(|| {
        format!(
            "{} of {} parameters have a standard deviation above their value: {}",
            poor.len(),
            fit.parameters.len(),
            poor.join(", ")
        )
    })
}
