//! The effects that were added to the declared model, and what they leave.

use super::parts::{Picture, share_bar};
use crate::number::{percent, significant};
use maud::{Markup, html};

/// Candidates that are listed without unfolding.
const CANDIDATES_UNFOLDED: usize = 6;

/// One effect that was added.
#[derive(Debug, Clone, Default)]
pub struct EffectSection {
    /// Its name in the catalogue.
    pub kind: String,
    /// The joints that it acts on.
    pub joints: Vec<String>,
    /// The sentence that explains it.
    pub sentence: String,
    /// Its fitted parameters.
    pub parameters: Vec<EffectParameterRow>,
    /// Pooled held-out error before it came in (1 is all).
    pub relative_before: f64,
    /// Pooled held-out error with it in.
    pub relative_after: f64,
    /// Share of the residual's variance above the noise floor that it took away, on data it was not fitted
    /// to.
    pub explains: f64,
    /// Its probability against its rivals.
    pub confidence: f64,
    /// Share of bootstrap draws of the training motion in which it, or one of its rivals, is chosen.
    pub stability: f64,
    /// Effects that the data could not tell from it.
    pub rivals: Vec<Rival>,
    /// The candidates that were compared at this step, best first, this one among them.
    pub candidates: Vec<CandidateRow>,
    /// Pictures such as the residual against the signal that it follows.
    pub pictures: Vec<Picture>,
}

/// A fitted parameter of an effect.
#[derive(Debug, Clone, Default)]
pub struct EffectParameterRow {
    /// The joint that it belongs to.
    pub joint: String,
    /// Its name.
    pub name: String,
    /// Its value.
    pub value: f64,
    /// Its standard deviation.
    pub std: f64,
    /// The unit of both.
    pub unit: String,
}

/// An effect that the data could not tell from the chosen one.
#[derive(Debug, Clone, Default)]
pub struct Rival {
    /// Its name in the catalogue.
    pub kind: String,
    /// The joints that it would act on.
    pub joints: Vec<String>,
    /// Its probability.
    pub confidence: f64,
    /// What would tell the two apart, such as a motion; may be empty.
    pub separated_by: String,
}

/// A candidate of one step.
#[derive(Debug, Clone, Default)]
pub struct CandidateRow {
    /// Its name in the catalogue.
    pub kind: String,
    /// The joints that it would act on.
    pub joints: Vec<String>,
    /// Pooled held-out error after everything was refitted with it (1 is all); NaN if it was not fitted.
    pub held_out: f64,
    /// Parameters that it adds to the model.
    pub parameters: usize,
    /// Why it was not taken, such as `not identifiable from these logs`; may be empty.
    pub note: String,
}

/// What the final model leaves.
#[derive(Debug, Clone, Default)]
pub struct Remaining {
    /// Whether it is more than noise.
    pub structured: bool,
    /// The joints on which it is.
    pub joints: Vec<String>,
    /// The signals that it follows.
    pub depends_on: Vec<String>,
    /// Sentences that describe it.
    pub description: Vec<String>,
    /// Candidates that were compared last and not taken, best first.
    pub candidates: Vec<CandidateRow>,
    /// Pictures such as the residual against a signal.
    pub pictures: Vec<Picture>,
    /// What these logs do not identify.
    pub unidentifiable: Vec<UnidentifiableEffect>,
}

/// An effect that the motion does not excite.
#[derive(Debug, Clone, Default)]
pub struct UnidentifiableEffect {
    /// Its name in the catalogue.
    pub kind: String,
    /// The joints, or groups of joints, on which it is unidentifiable.
    pub joints: Vec<String>,
    /// The motion, or the signal, that would tell.
    pub telling_motion: String,
}

pub(super) fn markup(effects: &[EffectSection]) -> Markup {
    let Some(first) = effects.first() else { return html! {} };
    let scale = effects
        .iter()
        .flat_map(|effect| [effect.relative_before, effect.relative_after])
        .fold(0.01, f64::max);
    html! {
        div.scroll { table.steps {
            thead { tr { th {} th { "Model" } th { "Joints" } th.number { "Held-out error" } th.wide {} } }
            tbody {
                (step("", "declared model", &[], first.relative_before, scale))
                @for (index, effect) in effects.iter().enumerate() {
                    (step(&(index + 1).to_string(), &format!("+ {}", effect.kind), &effect.joints, effect.relative_after, scale))
                }
            }
        } }
        @for (index, effect) in effects.iter().enumerate() { (effect.markup(index + 1)) }
    }
}

fn step(number: &str, model: &str, joints: &[String], relative: f64, scale: f64) -> Markup {
    html! { tr {
        td.muted { (number) }
        td { (model) }
        td { (joints.join(", ")) }
        td.number { strong { (percent(relative)) } " %" }
        td { (share_bar(relative, scale, None, None)) }
    } }
}

impl EffectSection {
    fn markup(&self, number: usize) -> Markup {
        html! {
            article.effect {
                h3 { span.step { (number) } (self.kind) span.summary { (self.joints.join(", ")) } }
                @if !self.sentence.is_empty() { p.sentence { (self.sentence) } }
                dl.facts {
                    dt { "Held-out error" }
                    dd { (percent(self.relative_before)) " % → " strong { (percent(self.relative_after)) " %" } }
                    dt { "Explains" } dd { (percent(self.explains)) " % of the variance above the noise floor" }
                    dt { "Confidence" }
                    dd { (percent(self.confidence)) " %, named in " (percent(self.stability)) " % of bootstrap draws of the training motion" }
                    @if !self.rivals.is_empty() {
                        dt { "Rivals" }
                        dd { @for rival in &self.rivals { div { (rival.markup()) } } }
                    }
                }
                @if !self.parameters.is_empty() { (parameters(&self.parameters)) }
                @for picture in &self.pictures { (picture.markup()) }
                (candidates(&self.candidates))
            }
        }
    }
}

impl Rival {
    fn markup(&self) -> Markup {
        html! {
            (self.kind) " of " (self.joints.join(", ")) " (" (percent(self.confidence)) " %)"
            @if !self.separated_by.is_empty() { span.muted { " – told apart by " (self.separated_by) } }
        }
    }
}

fn parameters(parameters: &[EffectParameterRow]) -> Markup {
    html! {
        div.scroll { table.fit {
            thead { tr { th { "Joint" } th { "Parameter" } th.number { "Value" } th.number { "Std" } th { "Unit" } } }
            tbody { @for parameter in parameters { tr {
                td { (parameter.joint) }
                td { (parameter.name) }
                td.number { (significant(parameter.value, 4)) }
                td.number { (significant(parameter.std, 2)) }
                td.muted { (parameter.unit) }
            } } }
        } }
    }
}

fn candidates(candidates: &[CandidateRow]) -> Markup {
    if candidates.is_empty() {
        return html! {};
    }
    let scale = candidates.iter().map(|candidate| candidate.held_out).fold(0.01, f64::max);
    let table = |candidates: &[CandidateRow], from: usize| {
        let notes = candidates.iter().any(|candidate| !candidate.note.is_empty());
        html! {
            div.scroll { table.candidates {
                thead { tr {
                    th {} th { "Candidate" } th { "Joints" } th.number { "Parameters" }
                    th.number { "Held-out error" } th.wide {} @if notes { th { "Note" } }
                } }
                tbody { @for (index, candidate) in candidates.iter().enumerate() { tr {
                    td.muted { (from + index) }
                    td { (candidate.kind) }
                    td { (candidate.joints.join(", ")) }
                    td.number { (candidate.parameters) }
                    td.number { (percent(candidate.held_out)) @if candidate.held_out.is_finite() { " %" } }
                    td { (share_bar(candidate.held_out, scale, None, None)) }
                    @if notes { td.muted { (candidate.note) } }
                } } }
            } }
        }
    };
    let (first, rest) = candidates.split_at(candidates.len().min(CANDIDATES_UNFOLDED));
    html! {
        h4 { "Ranking of candidates" }
        (table(first, 1))
        @if !rest.is_empty() {
            details { summary { (rest.len()) " more" } (table(rest, first.len() + 1)) }
        }
    }
}

impl Remaining {
    pub(super) fn markup(&self) -> Markup {
        html! {
            @if self.structured {
                p { "The residual is more than noise"
                    @if !self.joints.is_empty() { " on " strong { (self.joints.join(", ")) } }
                    @if !self.depends_on.is_empty() { "; it follows " strong { (self.depends_on.join(", ")) } }
                    "."
                }
            } @else {
                p { "What is left is noise." }
            }
            @for sentence in &self.description { p { (sentence) } }
            @for picture in &self.pictures { (picture.markup()) }
            (candidates(&self.candidates))
            (unidentifiable(&self.unidentifiable))
        }
    }
}

fn unidentifiable(effects: &[UnidentifiableEffect]) -> Markup {
    if effects.is_empty() {
        return html! {};
    }
    html! {
        h4 { "What these logs cannot tell" }
        p.muted { "Of these effects the motion leaves nothing beside the model's own columns." }
        div.scroll { table {
            thead { tr { th { "Effect" } th { "Joints" } th { "What would tell" } } }
            tbody { @for effect in effects { tr {
                td { (effect.kind) } td { (effect.joints.join(", ")) } td.muted { (effect.telling_motion) }
            } } }
        } }
    }
}
