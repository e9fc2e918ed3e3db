//! The report page of a traced residual: the page of an identification, and what was found.

use crate::analysis::Analysis;
use crate::remaining_in_words::{follows, remaining_in_words};
use crate::{Error, page as identified_page, possible_bodies};
use phiw_effects::Signal;
use phiw_identification::fitting::TorqueError;
use phiw_identification::{BlockSource, Data, Design, EveryNth, predict};
use phiw_report::IdentificationPage;
use phiw_report::json::{UnidentifiableJson, Verdict};
use phiw_report::number::percent;
use phiw_report::page::{
    CandidateRow, EffectParameterRow, EffectSection, Picture, Remaining, Rival, UnidentifiableEffect,
};
use phiw_report::plot::{Line, ResidualAgainstSignal, residual_against_signal};
use phiw_residual::trace::{self, FoundEffect, Ranked, Tracing};

/// Points of a scatter; more would only blacken it.
const POINTS: usize = 3000;
/// Joints that are said to have gained where all torques together have not, at most.
const SAID_TO_HAVE_GAINED: usize = 3;
/// Rows of the logs that scatters are drawn from, about; of longer ones an even sample.
const SCATTERED_ROWS: u64 = 60_000;

/// The page. `declared` is the model before anything was added, with its parameters.
///
/// # Errors
/// A log cannot be read any more.
pub fn page(
    analysis: &Analysis<'_>,
    tracing: &Tracing,
    declared: (Design, Vec<f64>),
    data: &Data<'_>,
) -> Result<IdentificationPage, Error> {
    let mut page = identified_page::page(analysis, String::new());
    page.headline = headline(analysis, tracing);
    page.headline.push(possible_bodies::sentence(analysis));
    page.verdict = Some(match tracing.verdict {
        trace::Verdict::Sufficient => Verdict::Sufficient,
        trace::Verdict::Explained => Verdict::Explained,
        trace::Verdict::PartlyExplained => Verdict::PartlyExplained,
        trace::Verdict::Unexplained => Verdict::Unexplained,
    });
    for (row, before) in page.errors.rows.iter_mut().zip(&tracing.before.1.rmse) {
        row.before = Some(*before);
    }
    page.errors.pooled.before = Some(tracing.before.1.relative);
    let declared = (declared.0.with_rest_speeds(data.rest_speeds.clone()), declared.1);
    let mut scatters = Scatters::new(analysis, tracing);
    let rows: u64 = analysis.session.logs.surveys().iter().map(|survey| survey.rows).sum();
    let n = (rows / SCATTERED_ROWS).max(1) as usize;
    let sample: Vec<EveryNth<'_>> = data.sources.iter().map(|&source| EveryNth { source, n }).collect();
    let sample: Vec<&dyn BlockSource> = sample.iter().map(|source| source as &dyn BlockSource).collect();
    predict(&declared.0, &declared.1, &sample, &mut |prediction| scatters.add(0, prediction))?;
    let fitted = &tracing.model.fit.parameters;
    predict(&tracing.model.design, fitted, &sample, &mut |prediction| scatters.add(1, prediction))?;
    page.effects = tracing
        .effects
        .iter()
        .enumerate()
        .map(|(index, found)| section(analysis, tracing, index, found, &scatters))
        .collect();
    page.remaining = Some(remaining(analysis, tracing));
    Ok(page)
}

/// The answer in a few sentences.
pub fn headline(analysis: &Analysis<'_>, tracing: &Tracing) -> Vec<String> {
    let declared = identified_page::declared_in_words(analysis);
    let before = tracing.before.1.relative;
    let mut lines = Vec::new();
    match tracing.verdict {
        trace::Verdict::Sufficient => lines.push(format!(
            "The declared model ({declared}) is sufficient: what it leaves, {} % of RMS torque held out, {}.",
            percent(before),
            match tracing.remaining.disturbances.is_empty() {
                true => "is noise",
                false => "follows nothing that was measured",
            }
        )),
        trace::Verdict::Unexplained => lines.push(format!(
            "The declared model ({declared}) leaves {} % of RMS torque held out, with structure that no effect of the catalogue accounts for.",
            percent(before)
        )),
        trace::Verdict::Explained | trace::Verdict::PartlyExplained => {
            lines.extend(sentences(analysis, tracing));
            if !tracing.refinements.is_empty() {
                lines.push(format!(
                    "{} refinements polish the form of these; they are in the model and in the error.",
                    tracing.refinements.len()
                ));
            }
            lines.push(errors_held_out(analysis, tracing));
        }
    }
    if !tracing.remaining.joints.is_empty() {
        lines.push(remaining_in_words(&tracing.remaining));
    }
    lines.extend(disturbances(tracing));
    lines
}

/// The error before and after. Where that of all torques together has grown, which it may by the noise of a
/// large torque, also of the joints that have gained most.
fn errors_held_out(analysis: &Analysis<'_>, tracing: &Tracing) -> String {
    let (before, after) = (&tracing.before.1, &tracing.model.held_out);
    let all = format!("Held-out error {} % → {} %", percent(before.relative), percent(after.relative));
    let ratio = |joint: &usize| after.rmse[*joint] / before.rmse[*joint];
    let mut gained: Vec<usize> = (0..before.rmse.len()).filter(|joint| ratio(joint) < 1.0).collect();
    gained.sort_by(|a, b| ratio(a).total_cmp(&ratio(b)));
    let names = analysis.joints();
    let of_joint = |joint: &usize| {
        let share = |error: &TorqueError| percent(error.rmse[*joint] / error.rms_torque[*joint]);
        format!("{} {} % → {} %", names[*joint], share(before), share(after))
    };
    if after.relative <= before.relative || gained.is_empty() {
        return format!("{all}.");
    }
    let gained: Vec<String> = gained.iter().take(SAID_TO_HAVE_GAINED).map(of_joint).collect();
    format!("{all} of all torques together; of single joints' torques: {}.", gained.join(", "))
}

/// A sentence on what is larger than noise and follows nothing.
fn disturbances(tracing: &Tracing) -> Option<String> {
    let of_joint = |disturbance: &trace::Disturbance| {
        format!(
            "{} ({:.2} times its noise floor, correlation over a third of a second {:.2})",
            disturbance.joint,
            disturbance.rmse / disturbance.noise_floor,
            disturbance.autocorrelation
        )
    };
    let joints: Vec<String> = tracing.remaining.disturbances.iter().map(of_joint).collect();
    (!joints.is_empty()).then(|| {
        format!(
            "A disturbance that follows nothing measured is left on {}: no effect is missing for it.",
            joints.join(", ")
        )
    })
}

/// A sentence for each effect; for a kind on each of several joints, one.
fn sentences(analysis: &Analysis<'_>, tracing: &Tracing) -> Vec<String> {
    let family = |a: &FoundEffect, b: &FoundEffect| {
        a.spec.kind == b.spec.kind && a.spec.joints.len() == 1 && b.spec.joints.len() == 1
    };
    let mut lines = Vec::new();
    let mut first = 0;
    for members in tracing.effects.chunk_by(family) {
        let indices = first..first + members.len();
        first = indices.end;
        if members.len() == 1 {
            lines.extend(indices.map(|index| sentence_of(analysis, tracing, index)));
            continue;
        }
        let joints: Vec<&str> = members.iter().map(|member| member.spec.joints[0].as_str()).collect();
        let kind = members[0].spec.kind.replace('_', " ");
        lines.push(match joints.len() == analysis.joints().len() {
            true => format!("All {} joints have {kind}.", joints.len()),
            false => format!("{} have {kind}, each of its own.", joints.join(", ")),
        });
    }
    lines
}

/// Place of a found effect among those of the model.
fn place(tracing: &Tracing, index: usize) -> usize {
    tracing.specs.len() - tracing.effects.len() - tracing.refinements.len() + index
}

fn sentence_of(analysis: &Analysis<'_>, tracing: &Tracing, index: usize) -> String {
    let place = place(tracing, index);
    let effect = &tracing.model.design.effects()[place];
    let fitted: Vec<f64> = tracing
        .model
        .design
        .effect_parameters(place)
        .map(|parameter| tracing.model.fit.parameters[parameter])
        .collect();
    analysis.session.catalogue.sentence(&effect.spec(), &effect.parameters(), &fitted)
}

fn section(
    analysis: &Analysis<'_>,
    tracing: &Tracing,
    index: usize,
    found: &FoundEffect,
    scatters: &Scatters,
) -> EffectSection {
    let place = place(tracing, index);
    let info = analysis.identified.design.effects()[place].parameters();
    let named = &analysis.model.effects[place].parameters;
    let parameter = |(named, info): (
        &phiw_identification::model::NamedParameter,
        phiw_identification::effect::EffectParameter,
    )| {
        EffectParameterRow {
            joint: info.joint,
            name: named.name.clone(),
            value: found.spec.constants.get(&named.name).copied().unwrap_or_default() + named.value,
            std: named.std.unwrap_or(f64::NAN),
            unit: named.unit.clone(),
        }
    };
    EffectSection {
        kind: found.spec.kind.clone(),
        joints: found.spec.joints.clone(),
        sentence: sentence_of(analysis, tracing, index),
        parameters: named.iter().zip(info).map(parameter).collect(),
        relative_before: found.relative_before,
        relative_after: found.relative,
        explains: found.explains,
        confidence: found.confidence,
        stability: found.stability,
        rivals: found
            .rivals
            .iter()
            .map(|rival| Rival {
                kind: rival.spec.kind.clone(),
                joints: rival.spec.joints.clone(),
                confidence: rival.confidence,
                separated_by: telling_motion(analysis, &rival.spec.kind),
            })
            .collect(),
        candidates: candidates(&found.ranking),
        pictures: scatters.pictures(index),
    }
}

fn candidates(ranking: &[Ranked]) -> Vec<CandidateRow> {
    let row = |ranked: &Ranked| CandidateRow {
        kind: ranked.spec.kind.clone(),
        joints: ranked.spec.joints.clone(),
        held_out: ranked.held_out,
        parameters: ranked.parameters,
        note: String::new(),
    };
    ranking.iter().map(row).collect()
}

fn remaining(analysis: &Analysis<'_>, tracing: &Tracing) -> Remaining {
    let structured = !tracing.remaining.joints.is_empty();
    Remaining {
        structured,
        joints: tracing.remaining.joints.clone(),
        depends_on: tracing.remaining.depends_on.iter().take(12).map(follows).collect(),
        description: if structured { vec![remaining_in_words(&tracing.remaining)] } else { Vec::new() },
        candidates: candidates(&tracing.remaining.ranking),
        pictures: Vec::new(),
        unidentifiable: unidentifiable(analysis, tracing)
            .into_iter()
            .map(|effect| UnidentifiableEffect {
                kind: effect.kind,
                joints: effect.joints.iter().map(|joints| joints.join(" and ")).collect(),
                telling_motion: effect.telling_motion,
            })
            .collect(),
    }
}

/// What the logs leave no trace of, kind by kind.
pub fn unidentifiable(analysis: &Analysis<'_>, tracing: &Tracing) -> Vec<UnidentifiableJson> {
    let mut kinds: Vec<UnidentifiableJson> = Vec::new();
    for spec in &tracing.remaining.unidentifiable {
        match kinds.iter_mut().find(|other| other.kind == spec.kind) {
            Some(kind) => kind.joints.push(spec.joints.clone()),
            None => kinds.push(UnidentifiableJson {
                kind: spec.kind.clone(),
                joints: vec![spec.joints.clone()],
                telling_motion: telling_motion(analysis, &spec.kind),
            }),
        }
    }
    kinds
}

fn telling_motion(analysis: &Analysis<'_>, kind: &str) -> String {
    let kind = analysis.session.catalogue.kind(kind);
    kind.map(|kind| kind.telling_motion().to_owned()).unwrap_or_default()
}

/// Residual against the signal that an effect lives on, before anything was added and after all.
struct Scatters {
    effects: Vec<Scatter>,
}

struct Scatter {
    joint: usize,
    name: String,
    signal: Signal,
    points: [Thinned; 2],
}

/// At most [`POINTS`] points, spread evenly over all that came.
#[derive(Default)]
struct Thinned {
    x: Vec<f64>,
    y: Vec<f64>,
    stride: usize,
    seen: usize,
}

impl Thinned {
    fn add(&mut self, x: f64, y: f64) {
        let stride = self.stride.max(1);
        if self.seen.is_multiple_of(stride) {
            self.x.push(x);
            self.y.push(y);
        }
        self.seen += 1;
        if self.x.len() == 2 * POINTS {
            let mut keep = (0..2 * POINTS).map(|index| index % 2 == 0);
            self.x.retain(|_| keep.next().unwrap_or(false));
            let mut keep = (0..2 * POINTS).map(|index| index % 2 == 0);
            self.y.retain(|_| keep.next().unwrap_or(false));
            self.stride = 2 * stride;
        }
    }
}

impl Scatters {
    fn new(analysis: &Analysis<'_>, tracing: &Tracing) -> Self {
        let catalogue = &analysis.session.catalogue;
        let scatter = |found: &FoundEffect| {
            // An effect on the whole robot is shown on the first joint that it names, or the first of all.
            let name = found.spec.joints.first().cloned().unwrap_or_else(|| analysis.joints()[0].clone());
            Scatter {
                joint: analysis.session.tree.joint_index(&name).unwrap_or_default(),
                name,
                signal: catalogue.kind(&found.spec.kind).map_or(Signal::Velocity, |kind| kind.seen_against()),
                points: [Thinned::default(), Thinned::default()],
            }
        };
        Scatters { effects: tracing.effects.iter().map(scatter).collect() }
    }

    fn add(&mut self, when: usize, prediction: &phiw_identification::Prediction<'_>) {
        for scatter in &mut self.effects {
            let joint = scatter.joint;
            if !prediction.counts(joint) {
                continue;
            }
            let x = match scatter.signal {
                Signal::Position => prediction.q[joint],
                Signal::Velocity => prediction.qd[joint],
                Signal::Acceleration => prediction.qdd[joint],
                Signal::Torque => prediction.measured[joint],
                Signal::Time => prediction.t,
            };
            scatter.points[when].add(x, prediction.residual(joint));
        }
    }

    fn pictures(&self, index: usize) -> Vec<Picture> {
        let Scatter { name, signal, points: [before, after], .. } = &self.effects[index];
        let label = match signal {
            Signal::Position => format!("q of {name} [rad, m]"),
            Signal::Velocity => format!("q̇ of {name} [rad/s, m/s]"),
            Signal::Acceleration => format!("q̈ of {name} [rad/s², m/s²]"),
            Signal::Torque => format!("τ of {name} [N·m, N]"),
            Signal::Time => "time [s]".to_owned(),
        };
        let svg = residual_against_signal(&ResidualAgainstSignal {
            signal: &label,
            residual: &format!("residual of {name} [N·m, N]"),
            before: Line { x: &before.x, y: &before.y },
            after: Line { x: &after.x, y: &after.y },
        });
        vec![Picture {
            caption: "Residual of the declared model and of the final one; the line is the median."
                .to_owned(),
            svg,
        }]
    }
}
