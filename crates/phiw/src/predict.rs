//! `phiw predict`: what an identified model says of logs, row by row.

use crate::arguments::PredictArguments;
use crate::console::Console;
use crate::model_use::{ModelUse, Reading};
use crate::output::check_file;
use crate::summary::write_table;
use crate::warnings::of_log;
use crate::{Error, session};
use phiw_effects::Catalogue;
use phiw_identification::prediction::{
    CovarianceSource, PredictionErrors, PredictionParts, predict_in_parts,
};
use phiw_identification::{BlockSource, EffectSpec, Prediction};
use phiw_report::number::{percent, significant};
use phiw_result_folder::{Disk, Lock, StreamedFile, check_inputs};
use std::fmt::Write as _;
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};

/// What the command has done.
#[derive(Debug)]
pub struct PredictOutcome {
    /// Errors per joint and pooled, as text for a terminal.
    pub summary: String,
    /// What a reader should know before trusting a number.
    pub warnings: Vec<String>,
    /// The errors of all logs together, where they have torques.
    pub errors: PredictionErrors,
    /// Those of each log.
    pub of_logs: Vec<PredictionErrors>,
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
    let file = || {
        let file = StreamedFile::create(&Disk, &arguments.out)?;
        Ok(CsvRows { file, line: Vec::new(), several_logs: false })
    };
    let Predicted { sink, errors, of_logs, rows, used } = predict_into(arguments, console, file)?;
    sink.file.commit()?;
    let summary = summary(&used, &errors, &of_logs, rows, arguments);
    Ok(PredictOutcome { summary, warnings: warnings(&used), errors, of_logs, rows })
}

/// Predictions in memory.
pub struct PredictedColumns {
    /// Names of the columns: `t`, `tau.<joint>`, `tau_std.<joint>`, `residual.<joint>`, `<kind>.<joint>`.
    pub names: Vec<String>,
    /// The values of each; NaN where there is none.
    pub columns: Vec<Vec<f64>>,
    /// For each row its log, counted from 0.
    pub log: Vec<usize>,
    /// RMS of the residual over RMS of the torque, all joints and logs pooled; NaN without torques.
    pub relative: f64,
    /// What a reader should know before trusting a number.
    pub warnings: Vec<String>,
}

/// Predicts as [`predict`] does; writes nothing.
///
/// # Errors
/// An input is wrong.
pub fn predicted_columns(arguments: &PredictArguments, console: &Console) -> Result<PredictedColumns, Error> {
    let Predicted { sink, errors, used, .. } = predict_into(arguments, console, || Ok(Columns::default()))?;
    let Columns { names, columns, log } = sink;
    Ok(PredictedColumns { names, columns, log, relative: errors.relative(), warnings: warnings(&used) })
}

/// What has been predicted, and where it went.
struct Predicted<S> {
    sink: S,
    errors: PredictionErrors,
    of_logs: Vec<PredictionErrors>,
    rows: u64,
    used: ModelUse,
}

fn predict_into<S: PredictedRows>(
    arguments: &PredictArguments,
    console: &Console,
    sink: impl FnOnce() -> Result<S, Error>,
) -> Result<Predicted<S>, Error> {
    let progress = |what: &str, done: u64, total: u64| console.progress(what, done, total);
    let reading = Reading {
        logs: &arguments.logs,
        map: arguments.map.as_deref(),
        hold: &arguments.hold,
        complete: false,
        cutoff_hz: arguments.cutoff_hz,
        parallel_cutoff_hz: arguments.parallel_cutoff_hz,
        in_memory: &arguments.in_memory,
    };
    let used = ModelUse::open(&arguments.model, &reading, &progress)?;
    let mut parts = PredictionParts::of_effects(&used.design);
    if let Some(covariance) = &used.model.covariance {
        parts = parts.with_covariance(covariance, &used.design).map_err(session::of_numbers)?;
    }
    let sources = used.logs.sources(&progress);
    let sources = used.with_held(&sources)?;
    let sources: Vec<&dyn BlockSource> = sources.iter().map(|source| source as &dyn BlockSource).collect();

    let mut table = Table::begin(&used, &parts, sink()?)?;
    predict_in_parts(&used.design, &used.parameters, &parts, &sources, &mut |prediction| {
        table.take(prediction)
    })?;
    console.finish();
    let Table { sink, errors: of_logs, rows, .. } = table;
    let errors = of_logs
        .iter()
        .fold(PredictionErrors::new(used.design.rows().len()), |pooled, errors| pooled.merged(errors));
    Ok(Predicted { sink, errors, of_logs, rows, used })
}

/// Where predictions go.
trait PredictedRows {
    /// Takes the names of the columns, first of all; the first is `t`.
    fn begin(&mut self, names: Vec<String>, several_logs: bool) -> Result<(), Error>;

    /// Takes a row of a log: its number, its name, its time, and the other numbers.
    fn row(
        &mut self,
        log: (usize, &Path),
        t: f64,
        numbers: &mut dyn Iterator<Item = f64>,
    ) -> Result<(), Error>;
}

/// Predictions in memory.
#[derive(Default)]
struct Columns {
    names: Vec<String>,
    columns: Vec<Vec<f64>>,
    log: Vec<usize>,
}

impl PredictedRows for Columns {
    fn begin(&mut self, names: Vec<String>, _several_logs: bool) -> Result<(), Error> {
        self.columns = vec![Vec::new(); names.len()];
        self.names = names;
        Ok(())
    }

    fn row(
        &mut self,
        (log, _): (usize, &Path),
        t: f64,
        numbers: &mut dyn Iterator<Item = f64>,
    ) -> Result<(), Error> {
        self.log.push(log);
        self.columns.iter_mut().zip(std::iter::once(t).chain(numbers)).for_each(|(column, x)| column.push(x));
        Ok(())
    }
}

/// Predictions in a CSV file.
struct CsvRows<'a> {
    file: StreamedFile<'a>,
    line: Vec<u8>,
    several_logs: bool,
}

impl CsvRows<'_> {
    fn put_line(&mut self) -> Result<(), Error> {
        self.line.push(b'\n');
        self.file.write_all(&self.line).map_err(|source| self.file.unwritable(source))?;
        self.line.clear();
        Ok(())
    }

    /// The cells of a row into the line.
    fn cells(&mut self, log: &Path, t: f64, numbers: &mut dyn Iterator<Item = f64>) -> io::Result<()> {
        if self.several_logs {
            write!(self.line, "{},", cell(&log.display().to_string()))?;
        }
        write!(self.line, "{t}")?;
        for number in numbers {
            self.line.push(b',');
            if number.is_finite() {
                write!(self.line, "{number}")?;
            }
        }
        Ok(())
    }
}

impl PredictedRows for CsvRows<'_> {
    fn begin(&mut self, names: Vec<String>, several_logs: bool) -> Result<(), Error> {
        self.several_logs = several_logs;
        self.line.extend_from_slice(if several_logs { b"log," } else { b"" });
        self.line.extend_from_slice(names.join(",").as_bytes());
        self.put_line()
    }

    fn row(
        &mut self,
        (_, log): (usize, &Path),
        t: f64,
        numbers: &mut dyn Iterator<Item = f64>,
    ) -> Result<(), Error> {
        self.cells(log, t, numbers).map_err(|source| self.file.unwritable(source))?;
        self.put_line()
    }
}

/// The rows on their way, and what is summed over them.
struct Table<'a, S> {
    sink: S,
    used: &'a ModelUse,
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

impl<'a, S: PredictedRows> Table<'a, S> {
    fn begin(used: &'a ModelUse, parts: &PredictionParts, sink: S) -> Result<Self, Error> {
        let joints = used.joints();
        let measured =
            |survey: &phiw_telemetry::Survey| survey.joints.iter().any(|joint| joint.torque.is_some());
        let has_torque: Vec<bool> = used.logs.surveys().iter().map(measured).collect();
        let is_logged = used.is_logged();
        let has_residual: Vec<bool> =
            is_logged.iter().map(|logged| *logged && has_torque.contains(&true)).collect();
        let mut names = vec!["t".to_owned()];
        names.extend(joints.iter().map(|joint| format!("tau.{joint}")));
        names.extend(joints.iter().map(|joint| format!("tau_std.{joint}")));
        let with_residual = joints.iter().zip(&has_residual).filter(|(_, has)| **has);
        names.extend(with_residual.map(|(joint, _)| format!("residual.{joint}")));
        names.extend(parts.shares.iter().map(|share| format!("{}.{}", share.kind, joints[share.row])));
        let mut table = Table {
            sink,
            used,
            std: vec![0.0; joints.len()],
            errors: vec![PredictionErrors::new(joints.len()); has_torque.len()],
            has_residual,
            has_torque,
            rows: 0,
            last: None,
        };
        table.sink.begin(names, table.has_torque.len() > 1)?;
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
        self.rows += 1;
        let has_torque = self.has_torque[prediction.log];
        let residual = |row: usize| if has_torque { prediction.residual(row) } else { f64::NAN };
        let residuals = (0..self.has_residual.len()).filter(|&row| self.has_residual[row]).map(residual);
        let numbers = prediction.predicted.iter().chain(&self.std).copied();
        let mut numbers = numbers.chain(residuals).chain(prediction.shares.iter().copied());
        let log = &self.used.logs.surveys()[prediction.log].path;
        self.sink.row((prediction.log, log), prediction.t, &mut numbers)
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
    warnings.extend(of_session_time(used));
    warnings
}

/// Effects that count the time of their session: it begins with the first of the logs that are given.
fn of_session_time(used: &ModelUse) -> Option<String> {
    let catalogue = Catalogue::default();
    let counts = |spec: &EffectSpec| {
        catalogue.kind(&spec.kind).is_ok_and(|kind| kind.needs_session_time(&spec.constants))
    };
    let specs = used.design.effects().iter().map(|effect| effect.spec());
    let of: Vec<String> =
        specs.filter(counts).map(|spec| format!("{} of {}", spec.kind, spec.joints.join("+"))).collect();
    (!of.is_empty()).then(|| {
        format!(
            "{} counts the time since its session began, which is taken to be with the first log: give the logs that came before as well, in their order, or the errors are other than in the report",
            of.join(", ")
        )
    })
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
