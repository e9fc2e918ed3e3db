//! The result in a terminal.

use crate::analysis::Analysis;
use crate::exported::Carried;
use crate::generated_code;
use crate::page::{counted, declared_in_words};
use crate::{identified_mjcf, identified_urdf, possible_bodies, told};
use phiw_identification::LogSet;
use phiw_report::number::{percent, significant};
use phiw_result_folder::ResultFile;
use std::fmt::Write;
use std::path::Path;

/// Errors per joint and pooled, parameters of the effects, where the files are.
pub fn summary(analysis: &Analysis<'_>, folder: &Path, files: &[ResultFile]) -> String {
    let mut text = format!("{}: {}\n\n", analysis.session.tree.name(), declared_in_words(analysis));
    // Writing to a string does not fail.
    let _ = errors(analysis, &mut text);
    let _ = effects(analysis, &mut text);
    let _ = closing(analysis, folder, files, &mut text);
    text
}

fn errors(analysis: &Analysis<'_>, text: &mut String) -> std::fmt::Result {
    let identified = analysis.identified;
    let header = ["joint", "", "RMS torque", "RMSE train", "held out", "%", "noise floor"].map(str::to_owned);
    let mut rows = vec![header];
    for (joint, name) in analysis.joints().into_iter().enumerate() {
        let (torque, error) = (identified.held_out.rms_torque[joint], identified.held_out.rmse[joint]);
        rows.push([
            name,
            analysis.session.torque_unit(joint).to_owned(),
            significant(torque, 3),
            significant(identified.train.rmse[joint], 3),
            significant(error, 3),
            percent(error / torque),
            significant(analysis.noise_floor[joint], 2),
        ]);
    }
    write_table(text, &rows, 2)?;
    writeln!(
        text,
        "pooled: train {} %, held out {} % of RMS torque ({} % with rests included)",
        percent(identified.train.relative),
        percent(identified.held_out.relative),
        percent(analysis.with_rests.held_out_relative)
    )?;
    writeln!(text, "{}", possible_bodies::sentence(analysis))?;
    if analysis.session.logs.splits_training_logs() {
        let share = 100.0 * LogSet::HELD_OUT_SHARE;
        writeln!(text, "held out is the last {share} % of each training log, since no --validate was given")?;
    }
    Ok(())
}

fn effects(analysis: &Analysis<'_>, text: &mut String) -> std::fmt::Result {
    if analysis.model.effects.is_empty() {
        return Ok(());
    }
    let undetermined = &analysis.identified.fit.undetermined;
    let mut rows = Vec::new();
    for (index, effect) in analysis.model.effects.iter().enumerate() {
        let parameters = analysis.identified.design.effect_parameters(index).zip(&effect.parameters);
        for (parameter, named) in parameters {
            let value = match undetermined.contains(&parameter) {
                true => "not separable".to_owned(),
                // What was fitted by linearisation stands partly in the constant of the same name.
                false => {
                    let linearised_at = effect.spec.constants.get(&named.name).copied().unwrap_or_default();
                    significant(linearised_at + named.value, 4)
                }
            };
            let std =
                named.std.map_or(String::new(), |std| format!("± {} {}", significant(std, 2), named.unit));
            rows.push([
                effect.spec.kind.clone(),
                effect.spec.joints.join(", "),
                named.name.clone(),
                value,
                std,
            ]);
        }
    }
    writeln!(text)?;
    // Numbers to the right, but the deviation follows its value.
    write_table(text, &rows, 3)
}

fn closing(
    analysis: &Analysis<'_>,
    folder: &Path,
    files: &[ResultFile],
    text: &mut String,
) -> std::fmt::Result {
    let base = analysis.identified.design.base().count();
    writeln!(
        text,
        "\n{}, cond {}",
        counted(base, "base parameter"),
        significant(analysis.condition_number(), 3)
    )?;
    for line in told::summary(&analysis.information).into_iter().chain(file_notes(analysis)) {
        writeln!(text, "{line}")?;
    }
    let names: Vec<&str> = files.iter().map(|file| file.name.as_str()).collect();
    writeln!(text, "{} in {}", names.join(", "), folder.display())
}

/// What the files for other programs lack, and who will refuse them.
pub fn file_notes(analysis: &Analysis<'_>) -> Vec<String> {
    let carried = Carried::of(analysis);
    let lacking = [
        ("identified.urdf", identified_urdf::not_expressed(carried)),
        (identified_mjcf::FILE, identified_mjcf::not_expressed(carried)),
        ("code of phiw export", generated_code::not_expressed(carried)),
    ];
    let lacking = lacking.iter().filter(|(_, left_out)| !left_out.is_empty());
    let mut notes: Vec<String> = lacking
        .map(|(file, left_out)| format!("{file} cannot express {}: model.json has all", left_out.join("; ")))
        .collect();
    notes.extend(identified_mjcf::refusal(carried).ok().flatten());
    notes
}

/// Columns as wide as they need to be; those from `numbers` on to the right.
pub(crate) fn write_table<const N: usize>(
    text: &mut String,
    rows: &[[String; N]],
    numbers: usize,
) -> std::fmt::Result {
    let width = |column: usize| rows.iter().map(|row| row[column].chars().count()).max().unwrap_or(0);
    let widths: [usize; N] = std::array::from_fn(width);
    for row in rows {
        let mut line = String::new();
        for (column, (cell, width)) in row.iter().zip(widths).enumerate() {
            if cell.starts_with('±') || column < numbers {
                write!(line, "{cell:<width$}  ")?;
            } else {
                write!(line, "{cell:>width$}  ")?;
            }
        }
        writeln!(text, "{}", line.trim_end())?;
    }
    Ok(())
}
