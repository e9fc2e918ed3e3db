//! The report: one HTML page with everything in it.
//!
//! [`IdentificationPage`] and [`ExperimentPage`] are plain data; what is empty or `None` does not appear. All
//! text is escaped. The page loads nothing, reads in light and dark, and prints.

mod conditioning;
mod effects;
mod errors;
mod experiment;
mod joints;
mod parameters;
mod parts;

pub use conditioning::ConditioningSection;
pub use effects::{CandidateRow, EffectParameterRow, EffectSection, Remaining, Rival, UnidentifiableEffect};
pub use errors::{ErrorRow, ErrorTable, PooledError};
pub use experiment::{ExperimentPage, Section, Table};
pub use joints::{JointSection, TorqueTrace};
pub use parameters::{BaseParameter, ParameterRow, ParametersSection};
pub use parts::Picture;

use crate::json::Verdict;
use crate::plot;
use maud::{DOCTYPE, Markup, PreEscaped, html};

/// Everything that the report shows, from top to bottom.
#[derive(Debug, Clone, Default)]
pub struct IdentificationPage {
    /// The robot's name.
    pub robot: String,
    /// The files that went in.
    pub inputs: Vec<InputFile>,
    /// When the report was made, as it shall be written.
    pub date: String,
    /// The result in one to three sentences.
    pub headline: Vec<String>,
    /// The answer in one word, where the residual was traced.
    pub verdict: Option<Verdict>,
    /// What a reader should know before trusting a number.
    pub warnings: Vec<String>,
    /// Torque errors per joint and pooled.
    pub errors: ErrorTable,
    /// The effects that were added, in order.
    pub effects: Vec<EffectSection>,
    /// What the final model leaves, where the residual was traced.
    pub remaining: Option<Remaining>,
    /// Measured against predicted torque, joint by joint.
    pub joints: Vec<JointSection>,
    /// How far the model goes with the motion held out.
    pub reproduction: Vec<Picture>,
    /// What was done to the logs before the fit.
    pub conditioning: ConditioningSection,
    /// The identified parameters.
    pub parameters: ParametersSection,
    /// Which standard parameters each base parameter regroups.
    pub base_parameters: Vec<BaseParameter>,
    /// What the logs tell.
    pub told: ToldSection,
    /// What these logs cannot tell, a line each.
    pub not_identified: Vec<String>,
    /// What was wrong or remarkable in the URDF, a line each.
    pub urdf_findings: Vec<String>,
    /// Name and version of the program.
    pub version: String,
    /// The command line that made the report.
    pub command_line: String,
}

/// What the logs tell, in words.
#[derive(Debug, Clone, Default)]
pub struct ToldSection {
    /// What told means here.
    pub note: String,
    /// Parameters with their values.
    pub told: Vec<String>,
    /// Sums with their values.
    pub sums: Vec<String>,
    /// What is in neither, a line for each link or joint.
    pub not_told: Vec<String>,
    /// Motions that would tell more, best first.
    pub motions: Vec<String>,
}

impl ToldSection {
    fn markup(&self) -> Markup {
        let parts = [
            ("By themselves", &self.told),
            ("In sums only", &self.sums),
            ("Not at all", &self.not_told),
            ("Motions that would tell more", &self.motions),
        ];
        html! {
            @if parts.iter().any(|(_, lines)| !lines.is_empty()) {
                p.note { (self.note) }
                @for (title, lines) in parts.into_iter().filter(|(_, lines)| !lines.is_empty()) {
                    @if lines.len() > LINES_UNFOLDED {
                        details { summary { (title) " (" (lines.len()) ")" } (list(lines)) }
                    } @else {
                        p { (title) ":" } (list(lines))
                    }
                }
            }
        }
    }
}

/// Longer lists are folded.
const LINES_UNFOLDED: usize = 12;

/// A file that went in.
#[derive(Debug, Clone, Default)]
pub struct InputFile {
    /// What it served as: `URDF`, `train`, `validate`.
    pub role: String,
    /// Its name.
    pub name: String,
    /// What is in it: `60.1 s, 12 020 samples, 2 segments`.
    pub content: String,
}

impl IdentificationPage {
    /// The whole page.
    pub fn render(&self) -> String {
        let sections: Vec<(String, &str, Markup)> = [
            ("errors", "Torque error", self.errors.markup(&self.joints)),
            ("effects", "Effects added", effects::markup(&self.effects)),
            ("remaining", "What remains", self.remaining.as_ref().map_or(html! {}, Remaining::markup)),
            ("torques", "Measured and predicted torque", joints::markup(&self.joints)),
            ("reproduction", "Motion reproduced", pictures(&self.reproduction)),
            ("conditioning", "Conditioning of the logs", self.conditioning.markup()),
            ("parameters", "Parameters", self.parameters.markup()),
            ("base-parameters", "Base parameters", parameters::base_markup(&self.base_parameters)),
            ("told", "What the logs tell", self.told.markup()),
            ("not-identified", "What could not be identified", list(&self.not_identified)),
            ("urdf", "Findings about the URDF", list(&self.urdf_findings)),
        ]
        .into_iter()
        .filter(|(_, _, markup)| !markup.0.is_empty())
        .map(|(id, title, markup)| (id.to_owned(), title, markup))
        .collect();
        let title = format!("{} – identification", self.robot);
        shell(&title, &self.header(), &sections, &self.version, &self.command_line)
    }

    fn header(&self) -> Markup {
        html! {
            header {
                div.title {
                    h1 { (self.robot) }
                    @if let Some(verdict) = self.verdict { (badge(verdict)) }
                    time { (self.date) }
                }
                @for (index, sentence) in self.headline.iter().enumerate() {
                    p.headline.more[index > 0] { (sentence) }
                }
                @if !self.inputs.is_empty() {
                    table.inputs {
                        @for file in &self.inputs {
                            tr { th { (file.role) } td { code { (file.name) } } td.muted { (file.content) } }
                        }
                    }
                }
                @if !self.warnings.is_empty() {
                    aside.warnings {
                        strong { (self.warnings.len()) @if self.warnings.len() == 1 { " warning" } @else { " warnings" } }
                        (list(&self.warnings))
                    }
                }
            }
        }
    }
}

fn pictures(pictures: &[Picture]) -> Markup {
    html! { @for picture in pictures { (picture.markup()) } }
}

/// A page around its header and its sections, each with its anchor and title.
fn shell(
    title: &str,
    header: &Markup,
    sections: &[(String, &str, Markup)],
    version: &str,
    command_line: &str,
) -> String {
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="color-scheme" content="light dark";
                title { (title) }
                style { (PreEscaped(plot::palette_css())) (PreEscaped(include_str!("page/style.css"))) }
            }
            body {
                main {
                    (header)
                    nav {
                        @for (id, title, _) in sections { a href={ "#" (id) } { (title) } }
                    }
                    @for (id, title, markup) in sections {
                        section id=(id) { h2 { (title) } (markup) }
                    }
                    footer {
                        @if !version.is_empty() { p { (version) } }
                        @if !command_line.is_empty() { pre { (command_line) } }
                    }
                }
            }
        }
    };
    page.into_string()
}

fn badge(verdict: Verdict) -> Markup {
    let (class, word, meaning) = match verdict {
        Verdict::Sufficient => ("good", "sufficient", "the declared model leaves noise only"),
        Verdict::Explained => ("good", "explained", "effects were added and what remains is noise"),
        Verdict::PartlyExplained => {
            ("partly", "partly explained", "effects were added and structure remains")
        }
        Verdict::Unexplained => {
            ("open", "unexplained", "there is structure and no effect of the catalogue accounts for it")
        }
    };
    html! { span class={ "badge " (class) } title=(meaning) { (word) } }
}

fn list(lines: &[String]) -> Markup {
    html! { @if !lines.is_empty() { ul { @for line in lines { li { (line) } } } } }
}
