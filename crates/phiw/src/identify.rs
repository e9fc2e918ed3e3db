//! `phiw identify`: the declared model, fitted and written down.

use crate::analysis::{Analysis, Rows};
use crate::arguments::SessionArguments;
use crate::console::Console;
use crate::exported::Carried;
use crate::identified_mjcf::{self, identified_mjcf};
use crate::identified_urdf::identified_urdf;
use crate::output::take_folder;
use crate::possible_bodies::PossibleBodies;
use crate::report_json::report_json;
use crate::session::Session;
use crate::{Error, bandwidth, page, summary};
use phiw_report::ReportJson;
use phiw_result_folder::{Disk, Lock, ResultFile, replace_folder};
use std::path::{Path, PathBuf};

/// What a command has done.
pub struct Outcome {
    /// The result as text for a terminal.
    pub summary: String,
    /// What a reader should know before trusting a number.
    pub warnings: Vec<String>,
    /// The page.
    pub report_html: PathBuf,
    /// The numbers.
    pub report: ReportJson,
}

/// What was computed, before anything is written.
pub struct Results {
    /// The files.
    pub files: Vec<ResultFile>,
    /// The result as text for a terminal.
    pub summary: String,
    /// What a reader should know before trusting a number.
    pub warnings: Vec<String>,
    /// The numbers.
    pub report: ReportJson,
}

impl Results {
    /// Writes the files into the folder `out`, which is `place`.
    ///
    /// # Errors
    /// They cannot be written.
    pub(crate) fn write(self, place: &Lock, out: &Path) -> Result<Outcome, Error> {
        replace_folder(&Disk, place, &self.files)?;
        let Results { summary, warnings, report, .. } = self;
        Ok(Outcome { summary, warnings, report_html: out.join("report.html"), report })
    }
}

/// Fits the declared model and writes `model.json`, `report.json`, `report.html`, `identified.urdf` and
/// `identified.xml`.
///
/// Nothing is written before everything has been computed.
///
/// # Errors
/// An input is wrong, or the results cannot be written: [`Error::exit_status`] tells the two apart.
pub fn identify(arguments: &SessionArguments, console: &Console) -> Result<Outcome, Error> {
    let place = take_folder(&arguments.out, &arguments.inputs(), "phiw identify")?;
    results(arguments, console)?.write(&place, &arguments.out)
}

/// Fits the declared model; writes nothing.
///
/// # Errors
/// An input is wrong.
pub fn results(arguments: &SessionArguments, console: &Console) -> Result<Results, Error> {
    let progress = |what: &str, done: u64, total: u64| console.progress(what, done, total);
    let session = Session::open(arguments, &progress)?;
    let bandwidth = bandwidth::of_session(&session, &progress)?;
    let sources = session.logs.sources(&progress);
    let data = session.data(&sources);
    let effects = session.effects(&data)?;
    let (identified, at_rest) = phiw_identification::identify_with_rests(&session.tree, effects, &data)
        .map_err(|error| session.of_training_logs(error))?;
    let (identified, possible) = PossibleBodies::settle(&session, identified, Some(&data))?;
    // Columns of the model's own torque were made again, those of the rests were not.
    let is_as_reduced = !identified.design.needs().of_reference();
    let with_rests = is_as_reduced.then(|| at_rest.added_to(&identified)).transpose()?;
    let analysis = Analysis::new(&session, Rows::Logs(&data), &identified, possible, with_rests)?;
    let analysis = analysis.with_bandwidth(bandwidth).with_logs_compared()?;
    console.finish();

    let report = report_json(&analysis);
    let files =
        outputs(&analysis, &report, page::page(&analysis, arguments.command_line("identify")).render())?;
    let summary = summary::summary(&analysis, &arguments.out, &files);
    Ok(Results { files, summary, warnings: analysis.warnings, report })
}

/// The files that every identification writes.
///
/// # Errors
/// The parameters cannot be expressed in a file's form.
pub fn outputs(analysis: &Analysis<'_>, report: &ReportJson, page: String) -> Result<Vec<ResultFile>, Error> {
    let json = |file| move |source| Error::Json { file, source };
    let model = serde_json::to_string_pretty(&analysis.model).map_err(json("model.json"))?;
    Ok(vec![
        ResultFile::new("model.json", model + "\n"),
        ResultFile::new("report.json", report.to_json().map_err(json("report.json"))?),
        ResultFile::new("report.html", page),
        ResultFile::new("identified.urdf", identified_urdf(Carried::of(analysis))?),
        ResultFile::new(identified_mjcf::FILE, identified_mjcf(Carried::of(analysis))?),
    ])
}
