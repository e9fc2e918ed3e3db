//! What the values of one of the tracer's thresholds do.

use super::run::Scored;
use super::score::Outcome;
use super::situation::Situation;
use super::suite::Suite;
use super::table::{percent, scores};
use super::wide_table::{is_left_alone, material_outcomes};
use std::fmt::Write;

/// Right models with a false name, by the colour of the noise, and those that are left alone; material
/// effects with exactly their joints, and cases of these with a false name: one row for each value.
pub fn by_value(name: &str, runs: &[(f64, Vec<Scored>)]) -> String {
    use Situation::{Colour, HeavyTails, LongColour, ShortColour, White};
    let groups: [(&str, &[Situation]); 4] = [
        ("white", &[White]),
        ("coloured", &[ShortColour, Colour, LongColour]),
        ("heavy tails", &[HeavyTails]),
        ("any noise", &Situation::ALL),
    ];
    let mut text = format!("## Values of {name}\n\n| {name} |");
    groups.iter().for_each(|(group, _)| {
        let _ = write!(text, " right models with a false name, {group} |");
    });
    text.push_str(" left alone | effects right | cases of these with a false name |\n|--:|--:|--:|--:|--:|--:|--:|--:|\n");
    for (value, cases) in runs {
        let of_suite = |suite: Suite| -> Vec<&Scored> {
            cases.iter().filter(|case| case.truth.suite == suite).collect()
        };
        let (right, effects) = (of_suite(Suite::WideRight), of_suite(Suite::WideEffects));
        let _ = write!(text, "| {value} |");
        for (_, situations) in &groups {
            let member = |case: &&Scored| case.truth.situation.is_some_and(|own| situations.contains(&own));
            let of_group: Vec<&Scored> = right.iter().copied().filter(member).collect();
            let _ = write!(text, " {} |", share(with_false_name(&of_group), of_group.len()));
        }
        let left_alone = scores(&right).filter(|score| is_left_alone(score)).count();
        let outcomes = material_outcomes(&effects);
        let named = outcomes.get(&Some(Outcome::Right)).copied().unwrap_or(0);
        let _ = writeln!(
            text,
            " {} | {} | {} |",
            share(left_alone, right.len()),
            share(named, outcomes.values().sum()),
            share(with_false_name(&effects), effects.len()),
        );
    }
    text
}

fn with_false_name(cases: &[&Scored]) -> usize {
    scores(cases).filter(|score| !score.false_names.is_empty()).count()
}

fn share(part: usize, whole: usize) -> String {
    format!("{part} of {whole} ({})", percent(part, whole))
}
