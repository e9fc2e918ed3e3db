//! The score as tables: per kind and overall, a CSV of all cases, and the failures with their seeds.

use super::kind::Name;
use super::run::Scored;
use super::score::{Outcome, Score};
use super::suite::Suite;
use phiw_report::statistics;
use std::collections::BTreeMap;
use std::fmt::Write;

/// The tables in Markdown.
pub fn markdown(cases: &[Scored]) -> String {
    let mut text = String::new();
    for suite in Suite::ALL {
        let cases: Vec<&Scored> = cases.iter().filter(|case| case.truth.suite == suite).collect();
        if cases.is_empty() {
            continue;
        }
        let _ = writeln!(text, "## {suite:?}: {} cases\n", cases.len());
        match suite {
            Suite::Control => control(&cases, &mut text),
            Suite::Outside | Suite::NewStrangers | Suite::LaterStrangers => outside(&cases, &mut text),
            suite if suite.is_wide() => super::wide_table::suite(suite, &cases, &mut text),
            _ => {
                kinds(&cases, &mut text);
                if suite != Suite::One {
                    together(&cases, &mut text);
                }
            }
        }
        by_robot(&cases, &mut text);
        timing(&cases, &mut text);
    }
    super::wide_table::reliability(cases, &mut text);
    failures(cases, &mut text);
    text
}

/// The scores of the cases that the tracer got through.
pub fn scores<'a>(cases: &[&'a Scored]) -> impl Iterator<Item = &'a Score> {
    let cases: Vec<&'a Scored> = cases.to_vec();
    cases.into_iter().filter_map(|case| case.score.as_ref().ok())
}

/// For each kind, what became of it.
pub fn kinds(cases: &[&Scored], text: &mut String) {
    const COLUMNS: [Outcome; 6] = [
        Outcome::Right,
        Outcome::Rival,
        Outcome::Refined,
        Outcome::WrongJoints,
        Outcome::WrongKind,
        Outcome::Missed,
    ];
    text.push_str("| kind | n | right | | rival | refined | wrong joints | wrong kind | missed | tracer failed | with a false name |\n");
    text.push_str("|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|\n");
    // Outcomes, failures of the tracer, cases with false names.
    let mut rows: BTreeMap<Option<Name>, [usize; 8]> = BTreeMap::new();
    for case in cases {
        for (index, secret) in
            case.truth.secrets.iter().enumerate().filter(|(_, secret)| secret.is_material())
        {
            for key in [Some(secret.kind), None] {
                let row = rows.entry(key).or_default();
                match &case.score {
                    Ok(score) => {
                        let column = COLUMNS.iter().position(|outcome| *outcome == score.outcomes[index]);
                        row[column.unwrap_or(6)] += 1;
                        row[7] += usize::from(!score.false_names.is_empty());
                    }
                    Err(_) => row[6] += 1,
                }
            }
        }
    }
    let overall = rows.remove(&None);
    let named = rows.iter().map(|(kind, row)| (kind.map_or_else(String::new, Name::name), *row));
    for (kind, row) in named.chain(overall.map(|row| ("**overall**".to_owned(), row))) {
        let n: usize = row[..7].iter().sum();
        let _ = write!(text, "| {kind} | {n} | {} | {} |", row[0], percent(row[0], n));
        for count in &row[1..] {
            let _ = write!(text, " {count} |");
        }
        text.push('\n');
    }
    let closed = |part: fn(&Score) -> Option<f64>| median(scores(cases).filter_map(part).collect());
    let strict =
        cases.iter().filter(|case| case.score.as_ref().is_ok_and(|score| score.is_good(&case.truth))).count();
    let _ = writeln!(
        text,
        "\nAll named right and nothing false: {strict} of {} ({}). Held-out squared error above the noise floor removed, median: {} \
         (joints in units of their floor), {} (pooled as they are).",
        cases.len(),
        percent(strict, cases.len()),
        closed(|score| score.closed),
        closed(|score| score.closed_pooled)
    );
}

fn together(cases: &[&Scored], text: &mut String) {
    let all =
        scores(cases).filter(|score| score.outcomes.iter().all(|outcome| *outcome == Outcome::Right)).count();
    let _ = writeln!(
        text,
        "All secrets of the case named right: {all} of {} ({}).",
        cases.len(),
        percent(all, cases.len())
    );
}

fn control(cases: &[&Scored], text: &mut String) {
    let count = |test: fn(&Score) -> bool| scores(cases).filter(|score| test(score)).count();
    let named = count(|score| !score.named.is_empty());
    let unsure = count(|score| score.verdict != "sufficient");
    let failed = cases.iter().filter(|case| case.score.is_err()).count();
    let n = cases.len();
    let _ = writeln!(
        text,
        "A false name: {named} ({}). Verdict other than `sufficient`: {unsure} ({}). Tracer failed: {failed}.",
        percent(named, n),
        percent(unsure, n)
    );
}

/// Verdicts on each effect from outside the catalogue.
pub fn outside(cases: &[&Scored], text: &mut String) {
    let verdicts = ["unexplained", "partly_explained", "sufficient", "explained"];
    text.push_str(
        "| what it was | n | unexplained | partly explained | sufficient | **explained** | tracer failed |\n",
    );
    text.push_str("|---|--:|--:|--:|--:|--:|--:|\n");
    let mut rows: BTreeMap<Name, [usize; 5]> = BTreeMap::new();
    for case in cases {
        for secret in case.truth.secrets.iter().filter(|secret| matches!(secret.kind, Name::Outside(_))) {
            let row = rows.entry(secret.kind).or_default();
            let verdict =
                case.score.as_ref().ok().and_then(|score| verdicts.iter().position(|v| *v == score.verdict));
            row[verdict.unwrap_or(4)] += 1;
        }
    }
    for (name, row) in &rows {
        let counts: Vec<String> = row.iter().map(usize::to_string).collect();
        let _ =
            writeln!(text, "| {} | {} | {} |", name.name(), row.iter().sum::<usize>(), counts.join(" | "));
    }
    let explained: usize = rows.values().map(|row| row[3]).sum();
    let _ = writeln!(text, "\nWrongly called explained: {explained} of {}.", cases.len());
}

/// How many cases of each robot came out as they should, and how many draws had to be thrown away.
fn by_robot(cases: &[&Scored], text: &mut String) {
    text.push_str("\n| robot | n | as it should be | | draws without a visible effect of that size |\n|---|--:|--:|--:|--:|\n");
    let mut rows: BTreeMap<&str, [u64; 3]> = BTreeMap::new();
    for case in cases {
        let row = rows.entry(case.truth.robot).or_default();
        row[0] += 1;
        row[1] += u64::from(case.score.as_ref().is_ok_and(|score| score.is_good(&case.truth)));
        row[2] += case.truth.rejected;
    }
    for (robot, [n, good, rejected]) in rows {
        let _ = writeln!(
            text,
            "| {robot} | {n} | {good} | {} | {rejected} |",
            percent(good as usize, n as usize)
        );
    }
}

fn timing(cases: &[&Scored], text: &mut String) {
    let seconds: Vec<f64> = cases.iter().filter(|case| case.score.is_ok()).map(|case| case.seconds).collect();
    let longest = seconds.iter().copied().fold(0.0, f64::max);
    let middle = if seconds.is_empty() { 0.0 } else { statistics::median(&seconds) };
    let _ = writeln!(text, "\n`explain` took {middle:.2} s in the median, {longest:.2} s at most.\n");
}

fn failures(cases: &[Scored], text: &mut String) {
    text.push_str("## Failures\n\n");
    let mut none = true;
    for case in cases {
        let truth = &case.truth;
        let said = match &case.score {
            Ok(score) if score.is_good(truth) => continue,
            Ok(score) => format!("{}; named {}", score.verdict, or_nothing(&score.named)),
            Err(error) => format!("tracer failed: {error}"),
        };
        none = false;
        let secrets: Vec<String> = truth
            .secrets
            .iter()
            .map(|secret| {
                format!("{}[{}] {:.0} %", secret.kind.name(), secret.joints.join("+"), 100.0 * secret.size)
            })
            .collect();
        let held = if truth.held_model { ", model held" } else { "" };
        let _ = writeln!(text, "- {} ({}{held}): {} → {said}", truth.seed, truth.robot, or_nothing(&secrets));
    }
    if none {
        text.push_str("none\n");
    }
}

fn or_nothing(list: &[String]) -> String {
    if list.is_empty() { "nothing".to_owned() } else { list.join(", ") }
}

/// One line for each case.
pub fn csv(cases: &[Scored]) -> String {
    let mut text = String::from(
        "seed,suite,robot,rejected,held_model,declared,secrets,sizes,visible,noise_correlation_time,rate,outcomes,false_names,named,\
         verdict,closed,closed_pooled,seconds,error\n",
    );
    for case in cases {
        let truth = &case.truth;
        let each = |value: &dyn Fn(&super::truth::TrueSecret) -> String| -> String {
            truth.secrets.iter().map(value).collect::<Vec<_>>().join(" ")
        };
        let _ = write!(
            text,
            "{},{:?},{},{},{},{},{},{},{},{:.4},{},",
            truth.seed,
            truth.suite,
            truth.robot,
            truth.rejected,
            truth.held_model,
            truth.declared.join(" "),
            each(&|secret| format!("{}[{}]", secret.kind.name(), secret.joints.join("+"))),
            each(&|secret| format!("{:.3}", secret.size)),
            each(&|secret| format!("{:.2}", secret.visible)),
            truth.sensors.correlation_time,
            truth.sensors.rate,
        );
        let number = |value: Option<f64>| value.map_or_else(String::new, |value| format!("{value:.4}"));
        let _ = match &case.score {
            Ok(score) => {
                let outcomes: Vec<String> =
                    score.outcomes.iter().map(|outcome| format!("{outcome:?}")).collect();
                writeln!(
                    text,
                    "{},{},{},{},{},{},{:.3},",
                    outcomes.join(" "),
                    score.false_names.join(" "),
                    score.named.join(" "),
                    score.verdict,
                    number(score.closed),
                    number(score.closed_pooled),
                    case.seconds
                )
            }
            Err(error) => writeln!(text, ",,,,,,,\"{}\"", error.replace('"', "'").replace('\n', " ")),
        };
    }
    text
}

/// A share in per cent; of nothing there is none.
pub fn percent(part: usize, whole: usize) -> String {
    if whole == 0 {
        return "–".to_owned();
    }
    format!("{:.1} %", 100.0 * part as f64 / whole as f64)
}

fn median(values: Vec<f64>) -> String {
    match values.len() {
        0 => "no case".to_owned(),
        count => format!("{:.1} % of {count} cases", 100.0 * statistics::median(&values)),
    }
}
