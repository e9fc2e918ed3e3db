//! The score of the widened suites by situation and by number of effects, and what confidence is worth.

use super::kind::Name;
use super::run::Scored;
use super::score::{Outcome, Score};
use super::situation::Situation;
use super::suite::Suite;
use super::table::{kinds, outside, percent, scores};
use std::collections::BTreeMap;
use std::fmt::Write;

/// Bounds of the bins of confidence.
const BINS: [f64; 8] = [0.0, 0.5, 0.7, 0.8, 0.9, 0.95, 0.99, 1.0];

/// The tables of one of the widened suites.
pub fn suite(suite: Suite, cases: &[&Scored], text: &mut String) {
    match suite {
        Suite::WideRight => right(cases, text),
        Suite::WideOutside => {
            by_verdict(cases, text);
            text.push('\n');
            outside(cases, text);
        }
        _ => {
            let by_situation = |case: &Scored| case.truth.situation.map_or_else(String::new, Situation::name);
            effects("situation", &by_situation, cases, text);
            effects("effects at once", &|case| count(case), cases, text);
            effects("robot", &|case| case.truth.robot.to_owned(), cases, text);
            kinds(cases, text);
        }
    }
}

fn count(case: &Scored) -> String {
    let friction = if case.truth.declared.is_empty() { "nothing declared" } else { "friction declared" };
    let size = match case.truth.secrets.len() {
        0..=2 => "1 to 2",
        3..=5 => "3 to 5",
        6..=9 => "6 to 9",
        _ => "10 or more",
    };
    format!("{friction}, {size}")
}

fn grouped<'a>(key: &dyn Fn(&Scored) -> String, cases: &[&'a Scored]) -> Vec<(String, Vec<&'a Scored>)> {
    let mut groups: Vec<(String, Vec<&Scored>)> = Vec::new();
    for case in cases {
        let name = key(case);
        match groups.iter_mut().find(|(other, _)| *other == name) {
            Some((_, group)) => group.push(case),
            None => groups.push((name, vec![case])),
        }
    }
    // Situations come in their own order, all else by name.
    let place = |name: &str| Situation::ALL.iter().position(|situation| situation.name() == name);
    groups.sort_by(|(a, _), (b, _)| place(a).cmp(&place(b)).then_with(|| a.cmp(b)));
    groups.push(("**all**".to_owned(), cases.to_vec()));
    groups
}

fn situations<'a>(cases: &[&'a Scored]) -> Vec<(String, Vec<&'a Scored>)> {
    grouped(&|case| case.truth.situation.map_or_else(String::new, Situation::name), cases)
}

fn right(cases: &[&Scored], text: &mut String) {
    text.push_str(
        "| right models | n | with a false name | | sufficient | | explained | partly | unexplained | \
         tracer failed | floor over noise, median of lowest and of highest joint |\n",
    );
    text.push_str("|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|\n");
    for (name, cases) in situations(cases) {
        let n = cases.len();
        let count = |test: &dyn Fn(&Score) -> bool| scores(&cases).filter(|score| test(score)).count();
        let verdict = |verdict: &str| count(&|score: &Score| score.verdict == verdict);
        let named = count(&|score: &Score| !score.false_names.is_empty());
        let sufficient = count(&is_left_alone);
        let floor = [0, 1].map(|end| {
            middle(scores(&cases).filter_map(|score| score.floor.map(|floor| floor[end])).collect())
        });
        let _ = writeln!(
            text,
            "| {name} | {n} | {named} | {} | {sufficient} | {} | {} | {} | {} | {} | {} to {} |",
            percent(named, n),
            percent(sufficient, n),
            verdict("explained"),
            verdict("partly_explained"),
            verdict("unexplained"),
            n - scores(&cases).count(),
            floor[0],
            floor[1],
        );
    }
}

fn by_verdict(cases: &[&Scored], text: &mut String) {
    text.push_str(
        "| outside the catalogue | n | unexplained | partly | sufficient | explained | \
         said to be explained with more than noise left | left over noise, median | tracer failed |\n",
    );
    text.push_str("|---|--:|--:|--:|--:|--:|--:|--:|--:|\n");
    for (name, cases) in situations(cases) {
        let count = |test: &dyn Fn(&Score) -> bool| scores(&cases).filter(|score| test(score)).count();
        let verdict = |verdict: &str| count(&|score: &Score| score.verdict == verdict);
        let _ = writeln!(
            text,
            "| {name} | {} | {} | {} | {} | {} | {} | {} | {} |",
            cases.len(),
            verdict("unexplained"),
            verdict("partly_explained"),
            verdict("sufficient"),
            verdict("explained"),
            count(&Score::is_explained_away),
            middle(scores(&cases).filter_map(|score| score.left).collect()),
            cases.len() - scores(&cases).count(),
        );
    }
}

/// Whether a right model is left as it is; what a situation makes true may be named.
pub fn is_left_alone(score: &Score) -> bool {
    score.is_sufficient() || (score.verdict == "explained" && score.false_names.is_empty())
}

/// What became of the material effects; of none, where the tracer failed.
pub fn material_outcomes(cases: &[&Scored]) -> BTreeMap<Option<Outcome>, usize> {
    let mut outcomes = BTreeMap::new();
    for case in cases {
        let secrets = case.truth.secrets.iter().enumerate();
        for (index, _) in secrets.filter(|(_, secret)| secret.is_material()) {
            let outcome = case.score.as_ref().ok().map(|score| score.outcomes[index]);
            *outcomes.entry(outcome).or_default() += 1;
        }
    }
    outcomes
}

fn effects(title: &str, key: &dyn Fn(&Scored) -> String, cases: &[&Scored], text: &mut String) {
    let _ = writeln!(
        text,
        "| {title} | n | material effects | right | | rival | refined | wrong joints | wrong kind | \
         missed | tracer failed | cases with a false name | | held-out error over noise, median | seconds, median |"
    );
    text.push_str("|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|\n");
    for (name, cases) in grouped(key, cases) {
        let outcomes = material_outcomes(&cases);
        let material = outcomes.values().sum::<usize>();
        let of = |outcome: Outcome| outcomes.get(&Some(outcome)).copied().unwrap_or(0);
        let failed = outcomes.get(&None).copied().unwrap_or(0);
        let named = scores(&cases).filter(|score| !score.false_names.is_empty()).count();
        let _ = writeln!(
            text,
            "| {name} | {} | {material} | {} | {} | {} | {} | {} | {} | {} | {failed} | {named} | {} | {} | {} |",
            cases.len(),
            of(Outcome::Right),
            percent(of(Outcome::Right), material),
            of(Outcome::Rival),
            of(Outcome::Refined),
            of(Outcome::WrongJoints),
            of(Outcome::WrongKind),
            of(Outcome::Missed),
            percent(named, cases.len()),
            middle(scores(&cases).filter_map(|score| score.left).collect()),
            middle(cases.iter().filter(|case| case.score.is_ok()).map(|case| case.seconds).collect()),
        );
    }
    text.push('\n');
}

/// How often names of each confidence are true.
pub fn reliability(cases: &[Scored], text: &mut String) {
    let catalogue_only = |case: &&Scored| {
        // A name beside a stranger may stand for the stranger: no confidence is asked of it.
        case.truth.secrets.iter().all(|secret| matches!(secret.kind, Name::Catalogue(_)))
    };
    let judged: Vec<(f64, bool)> = cases
        .iter()
        .filter(catalogue_only)
        .filter_map(|case| case.score.as_ref().ok())
        .flat_map(|score| score.judged.iter().copied())
        .collect();
    text.push_str("## What confidence is worth\n\n");
    if judged.is_empty() {
        text.push_str("no names\n\n");
        return;
    }
    text.push_str("| confidence | names | mean confidence | true |\n|---|--:|--:|--:|\n");
    for bounds in BINS.windows(2) {
        let last = bounds[1] == 1.0;
        let inside = |confidence: f64| {
            confidence >= bounds[0] && (confidence < bounds[1] || (last && confidence <= bounds[1]))
        };
        let bin: Vec<(f64, bool)> =
            judged.iter().copied().filter(|(confidence, _)| inside(*confidence)).collect();
        if bin.is_empty() {
            continue;
        }
        let mean = bin.iter().map(|(confidence, _)| confidence).sum::<f64>() / bin.len() as f64;
        let right = bin.iter().filter(|(_, right)| *right).count();
        let _ = writeln!(
            text,
            "| {} to {} | {} | {mean:.3} | {} |",
            bounds[0],
            bounds[1],
            bin.len(),
            percent(right, bin.len())
        );
    }
    text.push('\n');
}

fn middle(mut values: Vec<f64>) -> String {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).map_or_else(|| "–".to_owned(), |value| format!("{value:.2}"))
}
