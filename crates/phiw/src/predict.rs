//! `phiw predict`: what an identified model says of logs, row by row.

use crate::arguments::PredictArguments;
use crate::console::Console;
use crate::model_use::{ModelUse, Reading};
use crate::output::check_file;
use crate::summary::write_table;
use crate::warnings::of_log;
use crate::{Error, session};
use phiw_identification::prediction::{
    CovarianceSource, PredictionErrors, PredictionParts, predict_in_parts,
};
use phiw_identification::{BlockSource, Prediction};
use phiw_report::number::{percent, significant};
use phiw_result_folder::{Disk, Lock, StreamedFile, check_inputs};
use std::fmt::Write as _;
use std::io::{self, Write as _};
use std::path::PathBuf;

/// What the command has done.
#[derive(Debug)]
pub struct PredictOutcome {
    /// Errors per joint and pooled, as text for a terminal.
    pub summary: String,
    /// What a reader should know before trusting a number.
    pub warnings: Vec<String>,
    /// The errors of all logs together, where they have torques.
    pub errors: PredictionErrors,
    /// Rows that were written.
    pub rows: u64,
}

/// Predicts the torques of logs with a model, and writes them with their standard deviations, the residuals
/// and the effects' shares, row by row in constant memory.
///
/// # Errors
/// An input is wrong, or the results cannot be written: [`Error::exit_status`] tells the two apart.
pub fn predict(arguments: &PredictArguments, console: &Console) -> Result<PredictOutcome, Error> {
    check_file(&arguments.out)?;
    let inputs: Vec<PathBuf> = std::iter::once(&arguments.model).chain(&arguments.logs).cloned().collect();
    check_inputs(&inputs, std::slice::from_ref(&arguments.out))?;
    let _place = Lock::acquire(&arguments.out, "phiw predict")?;
    let progress = |what: &str, done: u64, total: u64| console.progress(what, done, total);
    let reading = Reading {
        logs: &arguments.logs,
        map: arguments.map.as_deref(),
        hold: &arguments.hold,
        complete: false,
        cutoff_hz: arguments.cutoff_hz,
        parallel_cutoff_hz: arguments.parallel_cutoff_hz,
    };
    let used = ModelUse::open(&arguments.model, &reading, &progress)?;
    let mut parts = PredictionParts::of_effects(&used.design);
    if let Some(covariance) = &used.model.covariance {
        parts = parts.with_covariance(covariance, &used.design).map_err(session::of_numbers)?;
    }
    let sources = used.logs.sources(&progress);
    let sources = used.with_held(&sources)?;
    let sources: Vec<&dyn BlockSource> = sources.iter().map(|source| source as &dyn BlockSource).collect();

    let mut table = Table::begin(&used, &parts, StreamedFile::create(&Disk, &arguments.out)?)?;
    predict_in_parts(&used.design, &used.parameters, &parts, &sources, &mut |prediction| {
        table.take(prediction)
    })?;
    console.finish();
    let Table { file, errors, rows, .. } = table;
    file.commit()?;
    let pooled = errors
        .iter()
        .fold(PredictionErrors::new(used.design.rows().len()), |pooled, errors| pooled.merged(errors));
    let summary = summary(&used, &pooled, &errors, rows, arguments);
    Ok(PredictOutcome { summary, warnings: warnings(&used), errors: pooled, rows })
}

/// The rows on their way into the file, and what is summed over them.
struct Table<'a> {
    file: StreamedFile<'a>,
    used: &'a ModelUse,
    line: Vec<u8>,
    std: Vec<f64>,
    /// For each joint whether its residual has a column, and for each log whether it has torques.
    has_residual: Vec<bool>,
    has_torque: Vec<bool>,
    /// Errors of each log.
    errors: Vec<PredictionErrors>,
    rows: u64,
    /// Log, segment, and row in it of the last prediction.
    last: Option<(usize, usize, usize)>,
}

impl<'a> Table<'a> {
    fn begin(used: &'a ModelUse, parts: &PredictionParts, file: StreamedFile<'a>) -> Result<Self, Error> {
        let joints = used.joints();
        let measured =
            |survey: &phiw_telemetry::Survey| survey.joints.iter().any(|joint| joint.torque.is_some());
        let has_torque: Vec<bool> = used.logs.surveys().iter().map(measured).collect();
        let is_logged = used.is_logged();
        let has_residual: Vec<bool> =
            is_logged.iter().map(|logged| *logged && has_torque.contains(&true)).collect();
        let mut names = Vec::new();
        if has_torque.len() > 1 {
            names.push("log".to_owned());
        }
        names.push("t".to_owned());
        names.extend(joints.iter().map(|joint| format!("tau.{joint}")));
        names.extend(joints.iter().map(|joint| format!("tau_std.{joint}")));
        let with_residual = joints.iter().zip(&has_residual).filter(|(_, has)| **has);
        names.extend(with_residual.map(|(joint, _)| format!("residual.{joint}")));
        names.extend(parts.shares.iter().map(|share| format!("{}.{}", share.kind, joints[share.row])));
        let mut table = Table {
            file,
            used,
            line: Vec::new(),
            std: vec![0.0; joints.len()],
            errors: vec![PredictionErrors::new(joints.len()); has_torque.len()],
            has_residual,
            has_torque,
            rows: 0,
            last: None,
        };
        table.line.extend_from_slice(names.join(",").as_bytes());
        table.put_line()?;
        Ok(table)
    }

    fn take(&mut self, prediction: &Prediction<'_>) -> Result<(), Error> {
        for (row, std) in self.std.iter_mut().enumerate() {
            *std = prediction.parameter_std[row].hypot(self.used.model.noise_std(row));
        }
        let place = match self.last {
            Some((log, segment, place)) if (log, segment) == (prediction.log, prediction.segment) => {
                place + 1
            }
            _ => 0,
        };
        self.last = Some((prediction.log, prediction.segment, place));
        if self.has_torque[prediction.log] && place.is_multiple_of(self.used.strides[prediction.log]) {
            self.errors[prediction.log].push(prediction, &self.std);
        }
        self.row(prediction).map_err(|source| self.file.unwritable(source))?;
        self.rows += 1;
        self.put_line()
    }

    /// The cells of a row into the line.
    fn row(&mut self, prediction: &Prediction<'_>) -> io::Result<()> {
        if self.has_torque.len() > 1 {
            let log = self.used.logs.surveys()[prediction.log].path.display().to_string();
            write!(self.line, "{},", cell(&log))?;
        }
        write!(self.line, "{}", prediction.t)?;
        let has_torque = self.has_torque[prediction.log];
        let residual = |row: usize| if has_torque { prediction.residual(row) } else { f64::NAN };
        let residuals = (0..self.has_residual.len()).filter(|&row| self.has_residual[row]).map(residual);
        let numbers = prediction.predicted.iter().chain(&self.std).copied();
        for number in numbers.chain(residuals).chain(prediction.shares.iter().copied()) {
            self.line.push(b',');
            if number.is_finite() {
                write!(self.line, "{number}")?;
            }
        }
        Ok(())
    }

    fn put_line(&mut self) -> Result<(), Error> {
        self.line.push(b'\n');
        self.file.write_all(&self.line).map_err(|source| self.file.unwritable(source))?;
        self.line.clear();
        Ok(())
    }
}

/// A text as a cell: in quotes if it holds what separates cells.
fn cell(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text.to_owned()
    }
}

fn warnings(used: &ModelUse) -> Vec<String> {
    let mut warnings: Vec<String> = used.logs.surveys().iter().flat_map(of_log).collect();
    match used.model.covariance.as_ref().map(|covariance| covariance.source) {
        Some(CovarianceSource::LeftOutFolds) => {}
        Some(CovarianceSource::LeastSquares) => warnings.push(
            "tau_std is too small: the training motion was too short for more than a covariance that takes its samples for independent; \
             identify the model from more motion"
                .to_owned(),
        ),
        None => warnings.push(
            "tau_std holds the noise alone: the model has no covariance; write it again with `phiw identify` or `phiw explain`".to_owned(),
        ),
    }
    warnings
}

/// Errors of each joint and pooled, of each log, and where the rows are.
fn summary(
    used: &ModelUse,
    pooled: &PredictionErrors,
    of_logs: &[PredictionErrors],
    rows: u64,
    arguments: &PredictArguments,
) -> String {
    let mut text = format!("{}: {}\n\n", used.tree.name(), arguments.model.display());
    let header = ["joint", "", "RMS torque", "RMSE", "%", "std", "in 95 % band"].map(str::to_owned);
    let mut lines = vec![header];
    for (row, joint) in used.joints().into_iter().enumerate().filter(|&(row, _)| pooled.count(row) > 0) {
        lines.push([
            joint,
            session::torque_unit(&used.tree, row).to_owned(),
            significant(pooled.rms_torque(row), 3),
            significant(pooled.rmse(row), 3),
            percent(pooled.rmse(row) / pooled.rms_torque(row)),
            significant(pooled.rms_std(row), 3),
            format!("{} %", percent(pooled.within_band(row))),
        ]);
    }
    // Writing to a string does not fail.
    if lines.len() > 1 {
        let _ = write_table(&mut text, &lines, 2);
        let told = |errors: &PredictionErrors| {
            format!(
                "{} % of RMS torque, {} % in the band",
                percent(errors.relative()),
                percent(errors.within_bands())
            )
        };
        let _ = writeln!(text, "pooled: {}", told(pooled));
        if of_logs.len() > 1 {
            for (survey, errors) in used.logs.surveys().iter().zip(of_logs) {
                if errors.relative().is_finite() {
                    let _ = writeln!(text, "{}: {}", survey.path.display(), told(errors));
                }
            }
        }
    } else {
        text.push_str("no log has torques of a joint that moves: there is nothing to compare with\n");
    }
    let _ = writeln!(text, "\n{rows} rows in {}", arguments.out.display());
    text
}
