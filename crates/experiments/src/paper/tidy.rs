//! Tidy tables: one row for each observation.

use super::ending::ended_after;
use super::report::Results;
use super::run_file::replace;
use super::{numbers, reliability, secrets};
use crate::plant::secret::SecretKind;
use phiw_curriculum::end::Converged;
use phiw_identification::accuracy::ReliabilityCriterion;
use std::collections::BTreeSet;
use std::fmt::Write;
use std::path::Path;

/// Writes `iterations.csv`, `parameters.csv`, `motions.csv`, `numbers.csv`, `secrets.csv` and
/// `detection.csv`.
///
/// # Errors
/// A file can not be written.
pub fn write(results: &Results, out: &Path) -> anyhow::Result<()> {
    for (name, text) in [
        ("iterations.csv", iterations(results)),
        ("parameters.csv", parameters(results)),
        ("motions.csv", motions(results)),
        ("numbers.csv", numbers_table(results)),
        ("secrets.csv", secrets_table(results)),
        ("detection.csv", detection(results)),
    ] {
        replace(&out.join(name), text.as_bytes())?;
    }
    Ok(())
}

/// One row for each run and iteration; iteration 0 is the initial model.
fn iterations(results: &Results) -> String {
    let mut text = String::from(
        "footing,arm,secret,found,seed,iteration,motion,alpha,allowed,forced,margin_m,predicted_cond,cond,torque_uncertainty,torque_change,fell_at_s,still_share,tracking_rms_rad,rmse_w,\
         rmse_w_least_squares,rmse_w_weighted,rmse_torque_nm,would_have_ended\n",
    );
    for run in &results.runs {
        let end = ended_after(run, &Converged::default());
        for (iteration, score) in run.scores.iter().enumerate() {
            let record = iteration.checked_sub(1).and_then(|index| run.run.history.get(index));
            // Writing to a string does not fail.
            let secret = run.secret.map_or_else(String::new, SecretKind::name);
            let found = secrets::names(run).join(" ");
            let (footing, arm, seed) = (run.footing.name(), run.arm.name(), run.run.seed);
            let _ = write!(text, "{footing},{arm},{secret},{found},{seed},{iteration},");
            match record {
                None => text.push_str(",,,,,,,,,,,,"),
                Some(record) => {
                    let tracking = &record.tracking_error;
                    let mean = tracking.iter().map(|error| error * error).sum::<f64>()
                        / tracking.len().max(1) as f64;
                    let _ = write!(
                        text,
                        "{},{},{},{},{},{},{},{},{},{},{},{},",
                        record.motion,
                        record.alpha,
                        record.allowed,
                        record.forced,
                        cell(record.margin_m),
                        cell(record.choice.merit),
                        cell(record.condition_number),
                        cell(record.torque_uncertainty),
                        cell(record.torque_change),
                        cell(record.fell_at_s),
                        record.still_share,
                        mean.sqrt()
                    );
                }
            }
            let _ = writeln!(
                text,
                "{},{},{},{},{}",
                score.rmse_w,
                cell(score.rmse_w_least_squares),
                cell(score.rmse_w_weighted),
                score.rmse_torque,
                iteration >= end
            );
        }
    }
    text
}

/// One row for each arm, iteration and parameter, over all seeds.
fn parameters(results: &Results) -> String {
    let mut text = String::from(
        "footing,arm,iteration,parameter,unit,true,mean,error_std,error_rms,relative_std_percent,well_estimated,well_with_bias\n",
    );
    let criterion = ReliabilityCriterion::default();
    let plain = results.runs.iter().filter(|run| run.secret.is_none());
    let arms: BTreeSet<_> = plain.map(|run| (run.footing, run.arm)).collect();
    for (footing, arm) in arms {
        for iteration in 0..=results.settings.iterations {
            let all = reliability::of_arm(results, footing, arm, iteration);
            for (facts, parameter) in results.settings.parameters.iter().zip(all) {
                let _ = writeln!(
                    text,
                    "{},{},{iteration},{},{},{},{},{},{},{},{},{}",
                    footing.name(),
                    arm.name(),
                    facts.name,
                    facts.unit,
                    facts.value,
                    parameter.mean,
                    parameter.deviation,
                    parameter.rms_error,
                    parameter.percent(),
                    parameter.well(&criterion),
                    parameter.well_with_bias(&criterion)
                );
            }
        }
    }
    text
}

fn motions(results: &Results) -> String {
    let mut text = String::from("motion,task,duration_s,cond\n");
    for motion in &results.settings.dataset {
        let _ = writeln!(
            text,
            "{},{},{},{}",
            motion.name, motion.task, motion.duration_s, motion.condition_number
        );
    }
    text
}

fn numbers_table(results: &Results) -> String {
    let quoted = |cell: &String| format!("\"{}\"", cell.replace('"', "'"));
    let line = |row: &[String; 4]| row.iter().map(quoted).collect::<Vec<_>>().join(",") + "\n";
    std::iter::once("what,paper,here,why\n".to_owned())
        .chain(numbers::rows(results).iter().map(line))
        .collect()
}

/// The table of the report.
fn secrets_table(results: &Results) -> String {
    let line =
        |row: Vec<String>| row.iter().map(|cell| format!("\"{cell}\"")).collect::<Vec<_>>().join(",") + "\n";
    let head = secrets::HEAD.map(str::to_owned).to_vec();
    std::iter::once(head)
        .chain(secrets::rows(results).into_iter().map(|row| row.to_vec()))
        .map(line)
        .collect()
}

/// One row for each run with the loop closed.
fn detection(results: &Results) -> String {
    let mut text = String::from(
        "secret,joints,seed,found,secret_gain,secret_deviations,other,other_gain,other_merit,rmse_w,rmse_torque_nm\n",
    );
    for run in &results.runs {
        let Some(detection) = &run.detection else { continue };
        let (other, gain, merit) = match &detection.other {
            Some((name, gain, merit)) => (name.as_str(), Some(*gain), Some(*merit)),
            None => ("", None, None),
        };
        let score = run.scores.last();
        let _ = writeln!(
            text,
            "{},{},{},{},{},{},{other},{},{},{},{}",
            run.secret.map_or_else(String::new, SecretKind::name),
            run.secret_joints.join("+"),
            run.run.seed,
            secrets::names(run).join(" "),
            cell(detection.secret),
            cell(detection.deviations()),
            cell(gain),
            cell(merit),
            cell(score.map(|score| score.rmse_w)),
            cell(score.map(|score| score.rmse_torque)),
        );
    }
    text
}

fn cell(value: Option<f64>) -> String {
    value.map_or_else(String::new, |value| value.to_string())
}
