//! What is written and said of a reproduction.

use super::{Case, FILES, Reproduction, Simulated};
use crate::Error;
use crate::arguments::SimulateArguments;
use crate::model_use::ModelUse;
use crate::page::counted;
use crate::summary::write_table;
use phiw_report::number::percent;
use phiw_report::plot::{self, GrowthLine, Line, Svg};
use phiw_result_folder::ResultFile;
use serde_json::{Map, Value, json};
use std::fmt::Write;

/// The files of the folder.
///
/// # Errors
/// The numbers cannot be written as JSON.
pub fn files(
    used: &ModelUse,
    reproduction: &Reproduction,
    arguments: &SimulateArguments,
    warnings: &[String],
) -> Result<Vec<ResultFile>, Error> {
    let [json_name, csv_name, svg_name] = FILES;
    let text = serde_json::to_string_pretty(&report(used, reproduction, arguments, warnings))
        .map_err(|source| Error::Json { file: json_name, source })?;
    Ok(vec![
        ResultFile::new(json_name, text + "\n"),
        ResultFile::new(csv_name, table(used, reproduction)),
        ResultFile::new(svg_name, picture(reproduction).as_str()),
    ])
}

fn report(
    used: &ModelUse,
    reproduction: &Reproduction,
    arguments: &SimulateArguments,
    warnings: &[String],
) -> Value {
    let joints = used.joints();
    let case = |case: &Case| {
        let of_joint = |(joint, name): (usize, &String)| {
            let errors: Vec<f64> = case.growth.rmse.iter().map(|errors| errors[joint]).collect();
            (name.clone(), json!(errors))
        };
        json!({
            "model": case.model.name().replace(' ', "_"),
            "loop": if case.closed { "closed" } else { "open" },
            "horizon_s": case.growth.horizons,
            "share_of_travel": case.growth.share_of_travel,
            "lost": case.growth.lost,
            "rmse": joints.iter().enumerate().map(of_joint).collect::<Map<String, Value>>(),
            "loop_torque_share": if case.closed { json!(case.growth.loop_torque_share) } else { Value::Null },
        })
    };
    let travel = joints.iter().zip(&reproduction.travel).map(|(name, travel)| (name.clone(), json!(travel)));
    json!({
        "schema": 1,
        "robot": used.tree.name(),
        "model": arguments.model.display().to_string(),
        "backend": arguments.backend.name(),
        "logs": arguments.logs.iter().map(|log| log.display().to_string()).collect::<Vec<_>>(),
        "windows": reproduction.windows,
        "window_s": reproduction.window_s,
        "travel": travel.collect::<Map<String, Value>>(),
        "not_simulated": reproduction.left_out,
        "nominal_refused": reproduction.nominal_refused,
        "least_squares_refused": reproduction.least_squares_refused,
        "cases": reproduction.cases.iter().map(case).collect::<Vec<_>>(),
        "warnings": warnings,
    })
}

/// One row for each model, loop and horizon.
fn table(used: &ModelUse, reproduction: &Reproduction) -> String {
    let mut text = String::from("model,loop,horizon_s,share_of_travel,lost");
    used.joints().iter().for_each(|joint| text.push_str(&format!(",rmse.{joint}")));
    text.push('\n');
    for case in &reproduction.cases {
        let model = case.model.name().replace(' ', "_");
        let in_loop = if case.closed { "closed" } else { "open" };
        let growth = &case.growth;
        for (place, horizon) in growth.horizons.iter().enumerate() {
            let (share, lost) = (growth.share_of_travel[place], growth.lost[place]);
            // Writing to a string does not fail.
            let _ = write!(text, "{model},{in_loop},{horizon},{share},{lost}");
            growth.rmse[place].iter().for_each(|error| text.push_str(&format!(",{error}")));
            text.push('\n');
        }
    }
    text
}

/// Errors against the horizon.
pub(crate) fn picture(reproduction: &Reproduction) -> Svg {
    let shown: Vec<(String, Vec<f64>)> = reproduction
        .cases
        .iter()
        .map(|case| (case.name(), case.growth.share_of_travel.iter().map(|share| 100.0 * share).collect()))
        .collect();
    let lines: Vec<GrowthLine<'_>> = shown
        .iter()
        .zip(&reproduction.cases)
        .map(|((name, shares), case)| GrowthLine { name, line: Line { x: &case.growth.horizons, y: shares } })
        .collect();
    let growth =
        plot::ErrorGrowth { lines: &lines, x_label: "horizon [s]", y_label: "position error [% of travel]" };
    plot::error_growth(&growth)
}

/// Where the URDF does better, what is not simulated, and why the URDF, or what least squares has found,
/// could not be.
pub fn warnings(reproduction: &Reproduction) -> Vec<String> {
    let refused = [&reproduction.nominal_refused, &reproduction.least_squares_refused];
    let mut warnings: Vec<String> = refused.into_iter().flatten().cloned().collect();
    if !reproduction.left_out.is_empty() {
        let kinds = reproduction.left_out.join(", ");
        warnings.push(format!(
            "{kinds} has no place in a simulation and is left out of it: the errors are larger for that"
        ));
    }
    warnings.extend(worse(reproduction));
    warnings
}

/// Where the URDF does better, in words.
pub(crate) fn worse(reproduction: &Reproduction) -> Vec<String> {
    let mut worse = Vec::new();
    for closed in [false, true] {
        let both = (
            reproduction.growth(Simulated::Nominal, closed),
            reproduction.growth(Simulated::Identified, closed),
        );
        let (Some(nominal), Some(identified)) = both else { continue };
        for (horizon, place) in reproduction.told() {
            let (of_urdf, of_model) = (nominal.share_of_travel[place], identified.share_of_travel[place]);
            if of_model > of_urdf {
                worse.push(format!(
                    "the identified model reproduces the logs worse than the URDF over {horizon} s in {} loop: {} % of the travel against {} %",
                    if closed { "closed" } else { "open" },
                    percent(of_model),
                    percent(of_urdf)
                ));
            }
        }
    }
    worse
}

/// Errors at the horizons that are told.
pub fn summary(used: &ModelUse, reproduction: &Reproduction, arguments: &SimulateArguments) -> String {
    let mut text = format!(
        "{}: {} of {} s, errors as a share of each joint's travel (windows that are lost)\n\n",
        used.tree.name(),
        counted(reproduction.windows, "window"),
        reproduction.window_s
    );
    let mut rows = vec![["", "0.5 s", "1 s", "2 s"].map(str::to_owned)];
    for case in &reproduction.cases {
        let mut row = [case.name(), String::new(), String::new(), String::new()];
        for (cell, (_, place)) in row[1..].iter_mut().zip(reproduction.told()) {
            *cell =
                format!("{} % ({})", percent(case.growth.share_of_travel[place]), case.growth.lost[place]);
        }
        rows.push(row);
    }
    // Writing to a string does not fail.
    let _ = write_table(&mut text, &rows, 1);
    for case in reproduction.cases.iter().filter(|case| case.closed) {
        let share = percent(case.growth.loop_torque_share);
        let _ = writeln!(text, "{}: the loop adds {share} % of the measured torque", case.name());
    }
    let _ = writeln!(text, "\n{} in {}", FILES.join(", "), arguments.out.display());
    text
}
