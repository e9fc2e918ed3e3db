//! The report page of an analysis.

use crate::analysis::Analysis;
use crate::traces::Role;
use crate::warnings::file_name;
use crate::{bandwidth, date, not_identified, parameters, possible_bodies, told};
use phiw_identification::LogSet;
use phiw_identification::effect::EffectSelector;
use phiw_report::IdentificationPage;
use phiw_report::number::{percent, significant};
use phiw_report::page::{
    ConditioningSection, ErrorRow, ErrorTable, InputFile, JointSection, Picture, PooledError,
};
use phiw_report::plot::{Line, SpectrumLine, SpectrumPlot, spectrum};
use phiw_telemetry::{LogPlan, Survey};

/// Lines that a picture of spectra tells apart.
const SPECTRA: usize = 6;

/// The page of a model to which nothing was added. `explain` adds verdict, effects and what remains.
pub fn page(analysis: &Analysis<'_>, command_line: String) -> IdentificationPage {
    IdentificationPage {
        robot: analysis.session.tree.name().to_owned(),
        inputs: inputs(analysis),
        date: date::now(),
        headline: headline(analysis),
        verdict: None,
        warnings: analysis.warnings.clone(),
        errors: errors(analysis),
        joints: (0..analysis.session.tree.joint_count())
            .map(|joint| joint_section(analysis, joint))
            .collect(),
        conditioning: ConditioningSection {
            entries: conditioning_entries(analysis),
            pictures: spectra(analysis)
                .into_iter()
                .chain(analysis.bandwidth.as_ref().map(bandwidth::picture))
                .collect(),
        },
        parameters: parameters::parameters(analysis),
        base_parameters: parameters::base_parameters(analysis),
        told: told::section(&analysis.information),
        not_identified: not_identified::lines(analysis),
        urdf_findings: analysis.session.findings.iter().map(ToString::to_string).collect(),
        version: format!("phiw {}", env!("CARGO_PKG_VERSION")),
        command_line,
        ..IdentificationPage::default()
    }
}

/// The declared model in words: `rigid body, viscous friction of j1 and j2`.
pub fn declared_in_words(analysis: &Analysis<'_>) -> String {
    let in_words = |declared: &String| {
        let EffectSelector { kind, joints } = EffectSelector::read(declared);
        let of_joints = joints.map(|joints| format!(" of {}", joints.join(" and "))).unwrap_or_default();
        kind.replace('_', " ") + &of_joints
    };
    analysis.model.declared.iter().map(in_words).collect::<Vec<String>>().join(", ")
}

fn headline(analysis: &Analysis<'_>) -> Vec<String> {
    let (identified, session) = (analysis.identified, analysis.session);
    let training = session.logs.training();
    let seconds: f64 = training.iter().map(Survey::duration).sum();
    let above = analysis.joints_above_noise();
    let joints = analysis.joints();
    let noise = if above.is_empty() {
        "What is left is no more than noise.".to_owned()
    } else {
        let names: Vec<&str> = above.iter().map(|&joint| joints[joint].as_str()).collect();
        format!("More than noise is left on {}.", names.join(", "))
    };
    let base = identified.design.base().count();
    vec![
        format!(
            "Held-out torque error {} % of RMS torque ({}).",
            percent(identified.held_out.relative),
            declared_in_words(analysis)
        ),
        format!(
            "{} and {} of effects from {} s of {} joints in {}.",
            counted(base, "base parameter"),
            identified.design.parameter_count() - base,
            significant(seconds, 3),
            joints.len(),
            counted(training.len(), "log")
        ),
        noise,
        possible_bodies::sentence(analysis),
    ]
}

fn inputs(analysis: &Analysis<'_>) -> Vec<InputFile> {
    let session = analysis.session;
    let held = &session.held;
    let mut content = counted(session.tree.joint_count(), "moving joint");
    if !held.is_empty() {
        let names: Vec<String> = held.iter().map(|(joint, value)| format!("{joint} at {value}")).collect();
        content.push_str(&format!("; held: {}", names.join(", ")));
    }
    let urdf = InputFile { role: "URDF".into(), name: file_name(&session.arguments.urdf), content };
    let split = session.logs.splits_training_logs();
    let log = |(index, survey): (usize, &Survey)| {
        let role = match index < session.logs.training().len() {
            true if split => "train, held out",
            true => "train",
            false => "validate",
        };
        let content = format!(
            "{} s, {} of {} rows used, {}",
            significant(survey.duration(), 3),
            survey.used_rows,
            survey.rows,
            counted(survey.segments.len(), "segment")
        );
        InputFile { role: role.into(), name: file_name(&survey.path), content }
    };
    std::iter::once(urdf).chain(session.logs.surveys().iter().enumerate().map(log)).collect()
}

fn errors(analysis: &Analysis<'_>) -> ErrorTable {
    let identified = analysis.identified;
    let row = |(joint, name): (usize, String)| ErrorRow {
        joint: name,
        unit: analysis.session.torque_unit(joint).into(),
        rms_torque: identified.held_out.rms_torque[joint],
        train: Some(identified.train.rmse[joint]),
        held_out: Some(identified.held_out.rmse[joint]),
        before: None,
        noise_floor: Some(analysis.noise_floor[joint]),
    };
    ErrorTable {
        rows: analysis.joints().into_iter().enumerate().map(row).collect(),
        pooled: PooledError {
            train: Some(identified.train.relative),
            held_out: Some(identified.held_out.relative),
            before: None,
        },
        note: errors_note(analysis),
    }
}

/// What is held out, what is left out, what the noise floor assumes.
pub fn errors_note(analysis: &Analysis<'_>) -> String {
    let held_out = if analysis.session.logs.splits_training_logs() {
        format!(
            "Held out: the last {} % of each training log, since no log was given to validate on.",
            100.0 * LogSet::HELD_OUT_SHARE
        )
    } else {
        "Held out: the logs given to validate on.".to_owned()
    };
    format!(
        "{held_out} Errors are of the filtered torque while the joint moves; with rests included the pooled held-out error is {} %. \
         The noise floor is what the sensors' noise alone would leave: the torque's in the filter's band, and the positions' through differentiation and inertia, both taken as white.",
        percent(analysis.with_rests.held_out_relative)
    )
}

fn joint_section(analysis: &Analysis<'_>, joint: usize) -> JointSection {
    let session = analysis.session;
    let unit = session.torque_unit(joint);
    let name = |log: usize| file_name(&session.logs.surveys()[log].path);
    let traces = |role| match &analysis.traces {
        Some(traces) => traces.of_joint(role, joint, name),
        None => Vec::new(),
    };
    JointSection {
        joint: session.tree.joint(joint).joint.clone(),
        unit: unit.into(),
        summary: format!(
            "held-out RMSE {} {unit} of {} {unit}, noise floor {} {unit}",
            significant(analysis.identified.held_out.rmse[joint], 3),
            significant(analysis.identified.held_out.rms_torque[joint], 3),
            significant(analysis.noise_floor[joint], 2)
        ),
        noise_floor: Some(analysis.noise_floor[joint]),
        held_out: traces(Role::HeldOut),
        train: traces(Role::Train),
    }
}

/// What was done to the logs before the fit.
pub fn conditioning_entries(analysis: &Analysis<'_>) -> Vec<(String, String)> {
    let session = analysis.session;
    let conditioning = session.logs.conditioning();
    let mut entries: Vec<(String, String)> = Vec::new();
    let mut entry = |quantity: &str, value: String| entries.push((quantity.to_owned(), value));
    let origin = if !conditioning.cutoff_from_data {
        "as told".to_owned()
    } else {
        let highest = conditioning.suggestions.iter().max_by(|a, b| a.cutoff_hz.total_cmp(&b.cutoff_hz));
        highest.map_or_else(
            || "from the sample rate".to_owned(),
            |highest| format!("from the spectra; {} needs most, bound by {}", highest.joint, highest.bound),
        )
    };
    let zero_phase = "zero-phase windowed sinc, −6 dB at";
    entry(
        "Low-pass of positions",
        format!("{zero_phase} {} Hz ({origin})", significant(conditioning.cutoff_hz, 3)),
    );
    let parallel = significant(conditioning.parallel_cutoff_hz, 3);
    entry("Low-pass of columns and torque", format!("{zero_phase} {parallel} Hz, the same over both"));
    if let Some(found) = &analysis.bandwidth {
        entry("Other cut-offs of columns and torque", bandwidth::in_words(found));
    }
    for survey in session.logs.surveys() {
        let Ok(plan) = conditioning.plan(survey) else { continue };
        entry(&file_name(&survey.path), log_conditioning(survey, &plan));
    }
    let rests: Vec<String> = analysis
        .joints()
        .iter()
        .enumerate()
        .map(|(joint, name)| (name, analysis.with_rests.share[joint]))
        .filter(|(_, share)| *share >= 5e-4)
        .map(|(name, share)| format!("{name} {} %", percent(share)))
        .collect();
    let rests = if rests.is_empty() { "none".to_owned() } else { rests.join(", ") };
    entry(
        "Rest",
        format!(
            "rows where a joint is slower than 1 % of its RMS speed in a tenth of the filter's window do not count for its torque: {rests}"
        ),
    );
    entries
}

fn log_conditioning(survey: &Survey, plan: &LogPlan) -> String {
    let derivatives =
        match (plan.measured_velocity.contains(&true), plan.measured_acceleration.contains(&true)) {
            (false, false) => "velocities and accelerations differentiated from positions",
            (true, false) => "velocities measured, accelerations differentiated",
            (false, true) => "accelerations measured, velocities differentiated",
            (true, true) => "velocities and accelerations measured",
        };
    format!("{plan}; jitter {} %; {derivatives}", percent(survey.jitter))
}

/// Spectra of the first joints' torques in the first log, with the cut-off of the parallel filter.
fn spectra(analysis: &Analysis<'_>) -> Vec<Picture> {
    let Some(survey) = analysis.session.logs.surveys().first() else { return Vec::new() };
    let found = &survey.spectrum;
    if found.windows == 0 || found.torque.is_empty() {
        return Vec::new();
    }
    let bins = found.torque[0].len();
    let frequency: Vec<f64> = (1..bins).map(|bin| bin as f64 * found.resolution_hz).collect();
    let amplitudes: Vec<Vec<f64>> = found
        .torque
        .iter()
        .take(SPECTRA)
        .map(|density| density[1..].iter().map(|power| power.sqrt()).collect())
        .collect();
    let joints = analysis.joints();
    let lines: Vec<SpectrumLine<'_>> = joints
        .iter()
        .zip(&amplitudes)
        .map(|(name, y)| SpectrumLine { name, line: Line { x: &frequency, y } })
        .collect();
    let cut_off = Some(analysis.session.logs.conditioning().parallel_cutoff_hz);
    let units: Vec<&str> = (0..lines.len()).map(|joint| analysis.session.torque_unit(joint)).collect();
    let unit = if units.iter().all(|unit| *unit == units[0]) { units[0] } else { "N·m or N" };
    let y_label = &format!("torque [{unit}/√Hz]");
    let svg = spectrum(&SpectrumPlot { lines: &lines, y_label, cut_off });
    let caption = format!(
        "Torque in {} before the filter, whose cut-off is the upright line.",
        file_name(&survey.path)
    );
    vec![Picture { caption, svg }]
}

/// `1 log`, `2 logs`.
pub(crate) fn counted(count: usize, thing: &str) -> String {
    if count == 1 { format!("1 {thing}") } else { format!("{count} {thing}s") }
}
