//! `phiw explain`: the declared model, what it lacks, and the error before and after.

use crate::analysis::{Analysis, Rows};
use crate::argument_values::quoted;
use crate::arguments::ExplainArguments;
use crate::console::Console;
use crate::disturbed::DisturbedLogs;
use crate::draws::Draws;
use crate::explain_page;
use crate::held_out_reproduction::HeldOutReproduction;
use crate::identify::{Outcome, Results, outputs};
use crate::log_apart::{changes_in, what_differs};
use crate::model_file::ModelFile;
use crate::noise_floor::{noise_floor, noise_floor_with_textbook};
use crate::odd_log::without_odd_log;
use crate::output::take_folder;
use crate::possible_bodies::PossibleBodies;
use crate::report_json::{by_joint, report_json};
use crate::session::{Session, read_robot};
use crate::torque_zeros::ZerosOfLogs;
use crate::{Error, bandwidth, odd_log, refuted, summary, warnings};
use indexmap::IndexMap;
use phiw_effects::{Catalogue, SignalRanges, smoothing_corner_hz};
use phiw_identification::fitting::TorqueError;
use phiw_identification::{Data, EffectSpec, Identified, Model, identify};
use phiw_report::ReportJson;
use phiw_report::json::{
    ConstantJson, DrawsJson, EffectJson, EvidenceJson, JointMap, NamedInDrawsJson, ParameterJson,
    ProgramJson, RemainingJson, RivalJson, TorqueErrors, Verdict,
};
use phiw_report::number::significant;
use phiw_residual::trace::{
    self, HeldModel, ScannedConstant, Thresholds, TraceInput, TraceOptions, Tracing, trace,
};
use std::fmt::Write;
use std::path::PathBuf;

/// A model to start from: its effects' specs, its parameters, and what was known if it is held.
struct Start {
    model: Model,
    specs: Vec<EffectSpec>,
    parameters: Vec<f64>,
    held: Option<HeldModel>,
    /// The declared model; none where one is held.
    declared: Option<Identified>,
}

/// Identifies the declared model (or takes the held one), traces its residual, and writes the grown model
/// with its report.
///
/// # Errors
/// An input is wrong, or the results cannot be written: [`Error::exit_status`] tells the two apart.
pub fn explain(arguments: &ExplainArguments, console: &Console) -> Result<Outcome, Error> {
    let inputs: Vec<_> = arguments.session.inputs().into_iter().chain(arguments.model.clone()).collect();
    let place = take_folder(&arguments.session.out, &inputs, "phiw explain")?;
    results(arguments, console)?.write(&place, &arguments.session.out)
}

/// The same, without writing anything.
///
/// Where the torque was low-passed before it was logged, it is traced again in the band that this has left:
/// above its corner a filter's form decides, and what is not known of it looks like effects. Where its zero
/// differs from log to log, it is traced again without these zeros: they belong to logs, not to a model.
/// Where something else acted on the robot for a moment, it is traced again without that moment. And a
/// training log of another robot than all others is left out before anything is traced.
///
/// # Errors
/// An input is wrong.
pub fn results(arguments: &ExplainArguments, console: &Console) -> Result<Results, Error> {
    results_knowing(arguments, console, &OfTheLogs::default())
}

/// What a first trace has told of the logs, so that it begins again without it.
#[derive(Clone, Default)]
struct OfTheLogs {
    /// What is said of a torque that was low-passed, in whose band all is traced.
    low_passed: Option<String>,
    /// The zeros of torques that were found and taken off, and in how many traces.
    torque_zeros: Option<ZerosOfLogs>,
    traced_for_zeros: usize,
    /// Moments in which something else acted on the robot, which are left out.
    disturbed: DisturbedLogs,
    /// A training log of another robot, which is left out.
    odd_log: Option<PathBuf>,
    /// Whether the logs have been compared.
    compared: bool,
}

/// Traces that seek zeros of torques: a zero that is small beside others is found once these are off.
const TRACES_FOR_ZEROS: usize = 3;

fn results_knowing(
    arguments: &ExplainArguments,
    console: &Console,
    known: &OfTheLogs,
) -> Result<Results, Error> {
    let progress = |what: &str, done: u64, total: u64| console.progress(what, done, total);
    let mut excluded = excluded(arguments)?;
    let mut session = Session::open(&arguments.session, &progress)?;
    if let Some(zeros) = &known.torque_zeros {
        zeros.take_off(&mut session.logs);
        excluded.extend(zeros.excluded(&session, known.traced_for_zeros == TRACES_FOR_ZEROS));
    }
    // What a filter of the torque makes of the answer is said by its warning.
    let bandwidth = match (&arguments.model, &known.low_passed) {
        (None, None) => bandwidth::of_session(&session, &progress)?,
        _ => None,
    };
    let sources = session.logs.sources(&progress);
    let data = session.data(&sources);
    if arguments.model.is_none()
        && !known.compared
        && let Some((session, odd)) = without_odd_log(&session, &data)?
    {
        let others = ExplainArguments { session, ..arguments.clone() };
        let known = OfTheLogs { odd_log: Some(odd), compared: true, ..known.clone() };
        return results_knowing(&others, console, &known);
    }
    let known = &OfTheLogs { compared: true, ..known.clone() };
    let Traced { start, declared, mut tracing } = traced(arguments, &excluded, &session, &data)?;
    let least_share = thresholds(arguments)?.least_share;
    if let Some(corner_hz) = low_passed_in_band(arguments, &session, &tracing, least_share) {
        let corner = significant(corner_hz, 3);
        let warning = format!(
            "the torque was low-passed before it was logged, at about {corner} Hz: columns and torque are \
             low-passed there, too (--parallel-cutoff-hz asks for another cut-off)"
        );
        let mut lower = arguments.clone();
        lower.session.parallel_cutoff_hz = Some(corner_hz);
        return results_knowing(&lower, console, &OfTheLogs { low_passed: Some(warning), ..known.clone() });
    }
    if let Some(disturbed) = known.disturbed.and_those_of(&session, &data, &tracing)? {
        let without = disturbed.left_out_of(arguments);
        return results_knowing(&without, console, &OfTheLogs { disturbed, ..known.clone() });
    }
    let zeros = ZerosOfLogs::of(&session, &data, &tracing, known.torque_zeros.as_ref())?;
    if zeros.is_some() {
        let traced_for_zeros = known.traced_for_zeros + 1;
        let known = OfTheLogs { torque_zeros: zeros, traced_for_zeros, ..known.clone() };
        return results_knowing(arguments, console, &known);
    }
    let names = |data: &Data<'_>| {
        let Traced { tracing, .. } = traced(arguments, &excluded, &session, data)?;
        Ok(tracing.effects.into_iter().map(|effect| effect.spec).collect())
    };
    let draws = Draws::take(arguments.draws, &data, names)?;
    draws.weigh(&mut tracing);
    drop(data);
    drop(sources);
    if arguments.model.is_some() {
        // What the held model declared is declared here too.
        session.declared = start.declared.iter().filter(|kind| *kind != "rigid_body").cloned().collect();
    }

    let sources = session.logs.sources(&progress);
    let data = session.data(&sources);
    let possible = match declared {
        Some(declared) => {
            let (before, _) = PossibleBodies::settle(&session, declared, Some(&data))?;
            tracing.before = (before.train, before.held_out);
            let (after, possible) = PossibleBodies::settle(&session, tracing.model, Some(&data))?;
            tracing.model = after;
            possible
        }
        None => PossibleBodies::beside_held(&session, &tracing.model)?,
    };
    let mut analysis =
        Analysis::new(&session, Rows::Logs(&data), &tracing.model, possible, None)?.with_bandwidth(bandwidth);
    if arguments.model.is_none() {
        analysis = analysis.with_logs_compared()?;
        // Logs that are too short to say what differs say nothing of it.
        let differs =
            analysis.odd_log.and_then(|odd| what_differs(arguments, odd, &tracing.effects).ok().flatten());
        analysis.warnings.extend(differs);
    }
    if let Some(odd) = &known.odd_log {
        let model = serde_json::to_string(&analysis.model)
            .map_err(|source| Error::Json { file: "model.json", source })?;
        let differs = changes_in(arguments, model, odd).ok().flatten();
        analysis.warnings.push(odd_log::warning(odd, differs.as_deref()));
    }
    analysis.noise_floor.clone_from(&tracing.remaining.noise_floor);
    analysis.warnings.extend(known.low_passed.clone());
    analysis.warnings.extend(known.disturbed.warning(&session));
    if let Some(zeros) = &known.torque_zeros {
        analysis.warnings.extend(zeros.warning(&session, thresholds(arguments)?.least_size));
    }
    analysis.warnings.extend(tracing.not_judged.iter().map(|(kind, joints)| {
        format!("{kind} of {} could not be judged on these logs (its columns are not finite): not all of it was sought", joints.join(", "))
    }));
    analysis.warnings.extend(refuted::sentences(&tracing.withdrawn));
    if tracing.held_out_had_a_say {
        analysis.warnings.push(warnings::held_out_had_a_say(&tracing.left_out_by_held_out));
    }
    analysis.warnings.extend(warnings::told_by_held_out(&tracing.told_by_held_out));
    let reproduction = HeldOutReproduction::of(&analysis)?;
    analysis.warnings.extend(reproduction.warnings());
    let declared_design = start.design(&session.tree, &session.catalogue)?;
    let mut page = explain_page::page(&analysis, &tracing, declared_design, &data)?;
    page.command_line = command_line(arguments);
    page.reproduction = reproduction.pictures();
    let in_draws = draws.json().as_ref().map(draws_in_words);
    page.headline.extend(in_draws.clone());
    console.finish();

    let mut report = report(&analysis, &tracing);
    report.phiw.iter_mut().for_each(|program| {
        program.draws = draws.json();
        program.reproduction = reproduction.json();
    });
    let files = outputs(&analysis, &report, page.render())?;
    let mut summary = story(&analysis, &tracing, in_draws);
    summary.push_str(&summary::summary(&analysis, &arguments.session.out, &files));
    Ok(Results { files, summary, warnings: analysis.warnings, report })
}

/// The corner of the filter that the torque went through before it was logged \[Hz\], if that is below the
/// cut-off of columns and torque and nobody asked for this one. What is low-passed takes its share of what is
/// left, as what has a name does: a filter of two joints that polishes them is no reason to see less of all.
fn low_passed_in_band(
    arguments: &ExplainArguments,
    session: &Session,
    tracing: &Tracing,
    least_share: f64,
) -> Option<f64> {
    if arguments.model.is_some() || arguments.session.parallel_cutoff_hz.is_some() {
        return None;
    }
    let found = tracing.effects.iter().chain(&tracing.refinements);
    let filters = found.filter(|effect| smoothing_corner_hz(&effect.spec).is_some());
    let left = filters.map(|effect| 1.0 - effect.explains).product::<f64>();
    if 1.0 - left < least_share {
        return None;
    }
    let corners = tracing.specs.iter().filter_map(smoothing_corner_hz);
    let lowest_hz = corners.fold(f64::INFINITY, f64::min);
    (lowest_hz < session.logs.conditioning().parallel_cutoff_hz).then_some(lowest_hz)
}

/// The command line that gives these arguments to `phiw explain`.
pub fn command_line(arguments: &ExplainArguments) -> String {
    let mut line = arguments.session.command_line("explain");
    if let Some(model) = &arguments.model {
        line.push_str(&format!(" --model {}", quoted(&model.display().to_string())));
    }
    if !arguments.exclude.is_empty() {
        line.push_str(&format!(" --exclude {}", quoted(&arguments.exclude.join(","))));
    }
    if let Some(rate) = arguments.false_name_rate {
        line.push_str(&format!(" --false-name-rate {rate}"));
    }
    for (name, value) in &arguments.threshold {
        line.push_str(&format!(" --threshold {name}={value}"));
    }
    if arguments.draws > 0 {
        line.push_str(&format!(" --draws {}", arguments.draws));
    }
    line
}

/// A model to start from, the declared one where none is held, and what was traced.
struct Traced {
    start: Model,
    declared: Option<Identified>,
    tracing: Tracing,
}

/// Identifies the declared model on `data` (or takes the held one), and traces its residual.
fn traced(
    arguments: &ExplainArguments,
    excluded: &[EffectSpec],
    session: &Session,
    data: &Data<'_>,
) -> Result<Traced, Error> {
    let start = start(arguments, session, data)?;
    // What is declared and excluded is not sought, but stays; what is held may not be found to have changed.
    let stays = |other: &EffectSpec| {
        let is_other = |own: &EffectSpec| own.kind == other.kind && own.joints == other.joints;
        start.held.is_none() && start.specs.iter().any(is_other)
    };
    let excluded = excluded.iter().filter(|other| !stays(other)).cloned().collect();
    // The floor, and with it the search, is the same whatever is declared.
    let with_textbook = if start.held.is_none() { noise_floor_with_textbook(session, data)? } else { None };
    let floor = match with_textbook {
        Some(floor) => floor,
        None => noise_floor(session, Rows::Logs(data), &start.model)?,
    };
    let conditioning = session.logs.conditioning();
    let plan = conditioning.plan(&session.logs.surveys()[0])?;
    let input = TraceInput {
        tree: &session.tree,
        catalogue: &session.catalogue,
        data,
        ranges: SignalRanges::of_surveys(session.logs.training()),
        declared: start.specs,
        parameters: start.parameters,
        residual_std: start.model.residual_std.clone(),
        held: start.held,
        noise_floor: floor,
        rows_per_independent: (plan.output_rate_hz() / (2.0 * conditioning.parallel_cutoff_hz)).max(1.0),
    };
    let mut options = TraceOptions { excluded, ..TraceOptions::default() };
    options.thresholds = thresholds(arguments)?;
    let tracing = trace(input, &options)?;
    Ok(Traced { start: start.model, declared: start.declared, tracing })
}

/// The thresholds that are asked for, or else their defaults.
fn thresholds(arguments: &ExplainArguments) -> Result<Thresholds, Error> {
    let mut thresholds = Thresholds::default();
    if let Some(rate) = arguments.false_name_rate {
        thresholds.false_name_probability = rate;
    }
    arguments.threshold.iter().try_for_each(|(name, value)| thresholds.set(name, *value))?;
    Ok(thresholds)
}

/// The candidates that are taken out.
fn excluded(arguments: &ExplainArguments) -> Result<Vec<EffectSpec>, Error> {
    let catalogue = Catalogue::default();
    let texts = arguments.exclude.iter().map(|text| text.trim()).filter(|text| !text.is_empty());
    let texts: Vec<&str> = texts.collect();
    if texts.is_empty() {
        return Ok(Vec::new());
    }
    let robot = read_robot(&arguments.session)?;
    let excluded = texts.into_iter().map(|text| catalogue.excluded(text, &robot.tree));
    Ok(excluded.collect::<Result<Vec<_>, _>>()?.concat())
}

fn draws_in_words(draws: &DrawsJson) -> String {
    let each = |named: &NamedInDrawsJson| {
        format!("{} of {} {}", named.kind.replace('_', " "), named.joints.join(", "), named.draws)
    };
    let named: Vec<String> = draws.named.iter().map(each).collect();
    let named = if named.is_empty() { "nothing".to_owned() } else { named.join("; ") };
    format!("Named on {} bootstrap draws of the training motion: {named}.", draws.count)
}

fn start(arguments: &ExplainArguments, session: &Session, data: &Data<'_>) -> Result<Start, Error> {
    let cutoffs = (session.logs.conditioning().cutoff_hz, session.logs.conditioning().parallel_cutoff_hz);
    let Some(path) = &arguments.model else {
        let identified: Identified = identify(&session.tree, session.effects(data)?, data)
            .map_err(|error| session.of_training_logs(error))?;
        session.joints_without_held_out_motion(&identified.held_out_folds)?;
        let Identified { design, fit, .. } = &identified;
        return Ok(Start {
            model: Model::of_fit(design, fit, &session.declared, &session.held, cutoffs)?,
            specs: design.effects().iter().map(|effect| effect.spec()).collect(),
            parameters: fit.parameters.clone(),
            held: None,
            declared: Some(identified),
        });
    };
    let file = ModelFile::given(session.arguments.in_memory.model.as_ref(), path)?;
    let (design, parameters) = file.design(&session.arguments.urdf, &session.tree, &session.catalogue)?;
    let factor = file.knowledge()?;
    let model = file.model;
    let held = HeldModel {
        factor,
        determined: model.factor.parameters.clone(),
        residual_std: model.residual_std.clone(),
        left: model.left(),
    };
    let specs = design.effects().iter().map(|effect| effect.spec()).collect();
    Ok(Start { model, specs, parameters, held: Some(held), declared: None })
}

fn verdict(verdict: trace::Verdict) -> Verdict {
    match verdict {
        trace::Verdict::Sufficient => Verdict::Sufficient,
        trace::Verdict::Explained => Verdict::Explained,
        trace::Verdict::PartlyExplained => Verdict::PartlyExplained,
        trace::Verdict::Unexplained => Verdict::Unexplained,
    }
}

fn constant(found: &ScannedConstant) -> (String, ConstantJson) {
    let (std, interval_95) = (found.free.map(|free| free.std), found.free.map(|free| free.interval_95));
    (found.name.clone(), ConstantJson { value: found.value, std, interval_95 })
}

fn report(analysis: &Analysis<'_>, tracing: &Tracing) -> ReportJson {
    let joints = analysis.joints();
    let error = |error: &TorqueError| phiw_report::json::TorqueErrorJson {
        rmse: by_joint(&joints, &error.rmse),
        relative: Some(error.relative),
    };
    let first = tracing.specs.len() - tracing.effects.len() - tracing.refinements.len();
    let effect = |(index, found): (usize, &trace::FoundEffect)| {
        let effect = &analysis.model.effects[first + index];
        let info = analysis.identified.design.effects()[first + index].parameters();
        let mut parameters: JointMap<_> = JointMap::new();
        for (named, info) in effect.parameters.iter().zip(info) {
            // What was fitted by linearisation stands partly in the constant of the same name.
            let base = found.spec.constants.get(&named.name).copied().unwrap_or_default();
            let value = ParameterJson {
                value: base + named.value,
                std: named.std.unwrap_or(f64::NAN),
                unit: named.unit.clone(),
            };
            let of_joint: &mut indexmap::IndexMap<String, ParameterJson> =
                parameters.entry(info.joint).or_default();
            of_joint.insert(named.name.clone(), value);
        }
        let own = tracing.constants.iter().filter(|constant| constant.effect == first + index);
        let own: IndexMap<String, ConstantJson> = own.map(constant).collect();
        let joints = found.spec.joints.join("+");
        EffectJson {
            constants: (!own.is_empty()).then_some((joints, own)).into_iter().collect(),
            kind: found.spec.kind.clone(),
            joints: found.spec.joints.clone(),
            parameters,
            validate_relative: found.relative,
            explains: found.explains,
            confidence: found.confidence,
            rivals: found
                .rivals
                .iter()
                .map(|rival| RivalJson {
                    kind: rival.spec.kind.clone(),
                    joints: rival.spec.joints.clone(),
                    confidence: rival.confidence,
                })
                .collect(),
        }
    };
    let mut depends_on: Vec<String> = Vec::new();
    for signal in tracing.remaining.depends_on.iter().flat_map(|dependence| &dependence.signals) {
        if !depends_on.contains(signal) {
            depends_on.push(signal.clone());
        }
    }
    let base = report_json(analysis);
    let evidence = |found: &trace::FoundEffect| EvidenceJson {
        kind: found.spec.kind.clone(),
        joints: found.spec.joints.clone(),
        significance: found.significance,
        stability: found.stability,
    };
    let program = base.phiw.clone().map(|program| ProgramJson {
        evidence: tracing.effects.iter().map(evidence).collect(),
        unidentifiable: explain_page::unidentifiable(analysis, tracing),
        ..program
    });
    ReportJson {
        phiw: program,
        verdict: Some(verdict(tracing.verdict)),
        before: TorqueErrors { train: error(&tracing.before.0), validate: error(&tracing.before.1) },
        effects: families(tracing.effects.iter().enumerate().map(effect)),
        refinements: families((tracing.effects.len()..).zip(&tracing.refinements).map(effect)),
        after: TorqueErrors { train: error(&tracing.model.train), validate: error(&tracing.model.held_out) },
        remaining: RemainingJson {
            structured: !tracing.remaining.joints.is_empty(),
            joints: tracing.remaining.joints.clone(),
            depends_on,
        },
        ..base
    }
}

/// A kind on each of several joints, one after another, is one effect.
fn families(effects: impl Iterator<Item = EffectJson>) -> Vec<EffectJson> {
    let mut families: Vec<EffectJson> = Vec::new();
    for effect in effects {
        let single = effect.joints.len() == 1;
        match families.last_mut() {
            Some(family)
                if single && family.kind == effect.kind && family.parameters.len() == family.joints.len() =>
            {
                family.joints.extend(effect.joints);
                family.parameters.extend(effect.parameters);
                family.constants.extend(effect.constants);
                family.validate_relative = effect.validate_relative;
                family.explains = 1.0 - (1.0 - family.explains) * (1.0 - effect.explains);
                family.confidence = family.confidence.min(effect.confidence);
                family.rivals.extend(effect.rivals);
            }
            _ => families.push(effect),
        }
    }
    families
}

/// The answer in sentences.
fn story(analysis: &Analysis<'_>, tracing: &Tracing, in_draws: Option<String>) -> String {
    let mut text = String::new();
    for line in explain_page::headline(analysis, tracing).into_iter().chain(in_draws) {
        // Writing to a string does not fail.
        let _ = writeln!(text, "{line}");
    }
    text.push('\n');
    text
}
