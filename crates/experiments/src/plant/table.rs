//! The score as tables.

use super::Arguments;
use super::engine::Engine;
use super::score::{Outcome, Scored};
use super::secret::SecretKind;
use phiw_report::statistics;
use std::collections::BTreeMap;
use std::fmt::Write;

/// The tables in Markdown.
pub fn markdown(cases: &[Scored], arguments: &Arguments) -> String {
    let mut text = format!(
        "# Secrets in closed loops\n\nupper_body18, three logs of {} s each, a row and a command every {} ms, unlogged actuator noise of {} % of the \
         effort limits, seed {}.\n\n",
        arguments.duration,
        1e3 * arguments.period,
        100.0 * arguments.noise,
        arguments.seed
    );
    text.push_str("| kind | engine | n | right | right, and more | rival | wrong joints | wrong kind | missed | error / floor before | after |\n");
    text.push_str("|---|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|\n");
    let mut groups: BTreeMap<(Option<SecretKind>, Engine), Vec<&Scored>> = BTreeMap::new();
    for case in cases {
        groups.entry((Some(case.kind), case.engine)).or_default().push(case);
        groups.entry((None, case.engine)).or_default().push(case);
    }
    // What is all kinds' comes last.
    let (all, each): (Vec<_>, Vec<_>) = groups.into_iter().partition(|((kind, _), _)| kind.is_none());
    for ((kind, engine), cases) in each.into_iter().chain(all) {
        let count = |outcome| cases.iter().filter(|case| case.outcome == outcome).count();
        let name = kind.map_or_else(|| "**all**".to_owned(), SecretKind::name);
        let _ = write!(text, "| {name} | {engine:?} | {} |", cases.len());
        use Outcome::{Missed, Right, RightAndMore, Rival, WrongJoints, WrongKind};
        for outcome in [Right, RightAndMore, Rival, WrongJoints, WrongKind, Missed] {
            let _ = write!(text, " {} |", count(outcome));
        }
        for part in 0..2 {
            let _ =
                write!(text, " {} |", median(cases.iter().filter_map(|case| Some(case.over_floor?[part]))));
        }
        text.push('\n');
    }
    let named =
        cases.iter().filter(|case| matches!(case.outcome, Outcome::Right | Outcome::RightAndMore)).count();
    let right = cases.iter().filter(|case| case.outcome == Outcome::Right).count();
    let percent = |part: usize| 100.0 * part as f64 / cases.len().max(1) as f64;
    let _ = writeln!(
        text,
        "\nKind and joints named: {named} of {} ({:.1} %), with nothing else beside them: {right} ({:.1} %). Largest tracking error of a joint, median over cases: {} rad RMS.\n",
        cases.len(),
        percent(named),
        percent(right),
        median(cases.iter().map(|case| case.tracking_error))
    );
    for case in cases.iter().filter(|case| case.outcome != Outcome::Right) {
        let _ = writeln!(
            text,
            "- {} [{}] in {:?}, seed {}: {:?}; {}; named {}",
            case.kind.name(),
            case.joints.join("+"),
            case.engine,
            case.seed,
            case.outcome,
            case.verdict,
            if case.named.is_empty() { "nothing".to_owned() } else { case.named.join(", ") }
        );
    }
    text
}

fn median(values: impl Iterator<Item = f64>) -> String {
    let middle = statistics::median(&values.collect::<Vec<f64>>());
    if middle.is_nan() { "–".to_owned() } else { format!("{middle:.2}") }
}

/// One line for each case.
pub fn csv(cases: &[Scored]) -> String {
    let mut text = String::from(
        "engine,kind,joints,seed,outcome,named,verdict,worst_joint,over_floor_before,over_floor_after,tracking_error_rad,simulated_s,traced_s\n",
    );
    for case in cases {
        let number =
            |part: usize| case.over_floor.map_or_else(String::new, |over| format!("{:.4}", over[part]));
        let _ = writeln!(
            text,
            "{:?},{},{},{},{:?},{},\"{}\",{},{},{},{:.4},{:.2},{:.2}",
            case.engine,
            case.kind.name(),
            case.joints.join("+"),
            case.seed,
            case.outcome,
            case.named.join(" "),
            case.verdict.replace('"', "'").replace('\n', " "),
            case.worst_joint.as_deref().unwrap_or_default(),
            number(0),
            number(1),
            case.tracking_error,
            case.seconds[0],
            case.seconds[1]
        );
    }
    text
}
