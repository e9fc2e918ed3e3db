//! The parameters as the report lists them.

use crate::analysis::Analysis;
use crate::summary;
use phiw_dynamics::inertia::Inertia;
use phiw_identification::model::{BodyParameters, NamedParameter, parameter_name};
use phiw_report::number::significant;
use phiw_report::page::{BaseParameter, ParameterRow, ParametersSection};

/// All parameters with what is to be said about them.
pub fn parameters(analysis: &Analysis<'_>) -> ParametersSection {
    ParametersSection { rows: rows(analysis), note: note(analysis) }
}

/// Name of a parameter of the fit: `joint_1.Izz` of the rigid body, `joint_1.fv` of an effect.
pub fn name(analysis: &Analysis<'_>, parameter: usize) -> String {
    let design = &analysis.identified.design;
    match design.base().independent().get(parameter) {
        Some(&leading) => parameter_name(design.tree(), leading),
        None => {
            let info = &design.effect_parameter_info()[parameter - design.base().count()];
            format!("{}.{}", info.joint, info.name)
        }
    }
}

fn rows(analysis: &Analysis<'_>) -> Vec<ParameterRow> {
    let row = |(index, parameter): (usize, &NamedParameter)| ParameterRow {
        name: name(analysis, index),
        value: parameter.value,
        std: parameter.std.unwrap_or(f64::NAN),
        unit: parameter.unit.clone(),
    };
    let model = &analysis.model;
    let all = model.base_parameters.iter().chain(model.effects.iter().flat_map(|effect| &effect.parameters));
    let undetermined = &analysis.identified.fit.undetermined;
    all.enumerate().filter(|(index, _)| !undetermined.contains(index)).map(row).collect()
}

fn note(analysis: &Analysis<'_>) -> String {
    let mut sentences = vec![consistency(analysis)];
    sentences.extend(
        summary::file_notes(analysis).into_iter().map(|note| note.trim_end_matches('.').to_owned() + "."),
    );
    sentences.join(" ")
}

fn consistency(analysis: &Analysis<'_>) -> String {
    let bodies = &analysis.model.bodies;
    let is_physical = |body: &&BodyParameters| Inertia::<f64>::from_parameters(&body.inertial).is_physical();
    let consistent = bodies.iter().filter(is_physical).count();
    format!(
        "Least squares, each torque weighted by its residual; standard deviations by leaving out one twelfth of the training motion after \
         the other, so that correlated samples are not counted as independent. cond of the weighted regressor {}. Logs determine base \
         parameters only; model.json holds the standard parameters nearest to the URDF's that have them ({consistent} of {} \
         bodies are physically consistent: positive definite pseudo-inertia), and beside them, as identified.urdf and identified.xml do, the \
         parameters of possible bodies and dissipative friction that fit best, with the URDF as prior.",
        significant(analysis.condition_number(), 3),
        bodies.len(),
    )
}

/// Which standard parameters each base parameter stands for.
pub fn base_parameters(analysis: &Analysis<'_>) -> Vec<BaseParameter> {
    let (tree, base) = (analysis.identified.design.tree(), analysis.identified.design.base());
    let expression = |parameter: usize| {
        let regrouping = base.regrouping(parameter);
        let mut text = parameter_name(tree, regrouping.leading);
        for (other, factor) in regrouping.others {
            text.push_str(if factor < 0.0 { " − " } else { " + " });
            if (factor.abs() - 1.0).abs() > 1e-9 {
                text.push_str(&format!("{} ", significant(factor.abs(), 4)));
            }
            text.push_str(&parameter_name(tree, other));
        }
        BaseParameter { name: parameter_name(tree, regrouping.leading), regroups: text }
    };
    (0..base.count()).map(expression).collect()
}
