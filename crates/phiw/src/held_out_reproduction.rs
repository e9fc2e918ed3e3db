//! How far a model that was just identified goes with the motion held out.

use crate::Error;
use crate::analysis::Analysis;
use crate::arguments::Backend;
use crate::page::counted;
use crate::simulate::{Reproduction, Simulated, Subject, longest_windows, picture, travel, worse};
use phiw_identification::{BlockSource, LogSet};
use phiw_report::json::{GrowthJson, ReproductionJson};
use phiw_report::number::percent;
use phiw_report::page::Picture;

/// Windows of the motion held out: enough to compare two models, and quick beside the trace.
const MOST_WINDOWS: usize = 10;

/// What is held out, reproduced in open loop; a sentence instead where that is not possible.
pub struct HeldOutReproduction(Result<Reproduction, String>);

impl HeldOutReproduction {
    /// Moves the possible bodies of an analysis, and the URDF's, by the measured torques of what is held out.
    ///
    /// # Errors
    /// A log cannot be read any more.
    pub fn of(analysis: &Analysis<'_>) -> Result<Self, Error> {
        let session = analysis.session;
        let logs = session.logs.with_every_row();
        let first = if logs.splits_training_logs() { 0 } else { logs.training().len() };
        let silent = |_: &str, _: u64, _: u64| ();
        let sources = logs.sources(&silent);
        let sources: Vec<&dyn BlockSource> =
            sources[first..].iter().map(|source| source as &dyn BlockSource).collect();
        let surveys = &logs.surveys()[first..];
        let share = if logs.splits_training_logs() { LogSet::HELD_OUT_SHARE } else { 1.0 };
        let total: f64 = surveys.iter().map(|survey| survey.duration()).sum();
        // Of logs that are split only the last windows count, so more of them are cut.
        let most = (MOST_WINDOWS as f64 / share) as usize;
        let none = || HeldOutReproduction(Err("what is held out has no stretch of half a second".to_owned()));
        let Some((settings, mut windows)) = longest_windows(&sources, total, most)? else {
            return Ok(none());
        };
        windows.retain(|window| {
            // Windows count the logs of the session.
            let (begin, end) = logs.surveys()[window.log].time_range();
            share >= 1.0 || window.start >= end - share * (end - begin)
        });
        if windows.is_empty() {
            return Ok(none());
        }
        let subject = Subject {
            tree: &session.tree,
            model: &analysis.model,
            design: &analysis.identified.design,
            parameters: &analysis.identified.fit.parameters,
            travel: (0..session.tree.joint_count()).map(|joint| travel(surveys, joint)).collect(),
            logs: logs.surveys().iter().map(|survey| survey.path.clone()).collect(),
            backend: Backend::Analytic,
        };
        let reproduced = subject.reproduced(&windows, &settings, &[false])?;
        Ok(HeldOutReproduction(reproduced.map_err(|(log, t)| {
            let log = subject.logs[log].display();
            format!("the identified model cannot be simulated: its M(q) is not positive definite at {t:.3} s of {log}")
        })))
    }

    /// Where the URDF does better, and why nothing is reproduced if nothing is.
    pub fn warnings(&self) -> Vec<String> {
        match &self.0 {
            Ok(reproduction) => worse(reproduction),
            Err(why) => vec![format!("the motion held out is not reproduced: {why}")],
        }
    }

    /// The errors at the horizons that are told.
    pub fn json(&self) -> Option<ReproductionJson> {
        let reproduction = self.0.as_ref().ok()?;
        let told = reproduction.told();
        let growth = |model| {
            reproduction.growth(model, false).map(|growth| GrowthJson {
                share_of_travel: told.iter().map(|&(_, place)| growth.share_of_travel[place]).collect(),
                lost: told.iter().map(|&(_, place)| growth.lost[place]).collect(),
            })
        };
        Some(ReproductionJson {
            windows: reproduction.windows,
            window_s: reproduction.window_s,
            horizon_s: told.iter().map(|(horizon, _)| *horizon).collect(),
            identified: growth(Simulated::Identified),
            nominal: growth(Simulated::Nominal),
            not_simulated: reproduction.left_out.clone(),
            nominal_refused: reproduction.nominal_refused.clone(),
        })
    }

    /// The errors against the horizon, with what is to be said of them.
    pub fn pictures(&self) -> Vec<Picture> {
        let Ok(reproduction) = &self.0 else { return Vec::new() };
        let at = |model: Simulated, place: usize| {
            let growth = reproduction.growth(model, false);
            growth.map_or("not possible".to_owned(), |growth| {
                format!("{} %", percent(growth.share_of_travel[place]))
            })
        };
        let told = reproduction.told().into_iter().map(|(horizon, place)| {
            format!(
                "after {horizon} s {} (URDF: {})",
                at(Simulated::Identified, place),
                at(Simulated::Nominal, place)
            )
        });
        let told: Vec<String> = told.collect();
        let caption = format!(
            "Error of the position, RMS as a share of each joint's travel, over {} of {} s in open loop: {}.",
            counted(reproduction.windows, "window"),
            reproduction.window_s,
            told.join(", ")
        );
        vec![Picture { caption, svg: picture(reproduction) }]
    }
}
