//! A map as text, and what is said of it.

use super::MapArguments;
use super::guess::{Guess, Guesses};
use super::names::Kind;
use std::fmt::Write;

/// A text in quotes, as TOML has it.
fn quoted(text: &str) -> String {
    let mut quoted = String::from('"');
    for c in text.chars() {
        match c {
            '"' | '\\' => quoted.extend(['\\', c]),
            c if c.is_control() => {
                let _ = write!(quoted, "\\u{:04x}", u32::from(c));
            }
            c => quoted.push(c),
        }
    }
    quoted.push('"');
    quoted
}

/// The map, with the reasons as comments.
pub fn map(guesses: &Guesses, arguments: &MapArguments) -> String {
    let mut text = String::new();
    // Writing to a string does not fail.
    let log = arguments.log.file_name().unwrap_or(arguments.log.as_os_str()).to_string_lossy();
    let log: String = log.chars().filter(|c| !c.is_control()).collect();
    let _ = writeln!(
        text,
        "# Guessed by `phiw map` from {log}: check every line. docs/log-maps.md has the keys."
    );
    if let Some(topic) = &arguments.topic {
        let _ = writeln!(text, "topic = {}", quoted(topic));
    }
    match &guesses.time {
        None => {
            let _ = writeln!(text, "# time = \"…\"    no column is called like a time");
        }
        Some((column, unit)) if column == "t" && unit.unit.is_none() => {}
        Some((column, unit)) => {
            let of = unit.unit.map_or(String::new(), |unit| format!(", unit = {}", quoted(unit)));
            let _ = writeln!(text, "time = {{ column = {}{of} }}    # {}", quoted(column), unit.why);
        }
    }
    for (joint, guesses) in &guesses.joints {
        let _ = writeln!(text, "\n[joint.{}]", quoted(joint));
        let mut needed: Vec<&str> = guesses.iter().flat_map(|guess| guess.unit.needs).copied().collect();
        needed.sort_unstable();
        needed.dedup();
        for constant in needed {
            let _ = writeln!(text, "{constant} = 1.0    # fill in");
        }
        for guess in guesses {
            let why: String = why(guess).chars().filter(|c| !c.is_control()).collect();
            let _ = writeln!(text, "{} = {}    # {why}", guess.kind.key(), value(guess));
        }
        for kind in missing(guesses) {
            let _ = writeln!(text, "# {} = \"…\"    no column is called like it", kind.key());
        }
    }
    text
}

fn value(guess: &Guess) -> String {
    match guess.unit.unit {
        None => quoted(&guess.column),
        Some(unit) => format!("{{ column = {}, unit = {} }}", quoted(&guess.column), quoted(unit)),
    }
}

fn why(guess: &Guess) -> String {
    match guess.unit.why.as_str() {
        "" => guess.why.clone(),
        unit => format!("{}; {unit}", guess.why),
    }
}

/// Signals that a fit needs and that no column was found for.
fn missing(guesses: &[Guess]) -> Vec<Kind> {
    let found = |kind: &Kind| guesses.iter().any(|guess| guess.kind == *kind);
    [Kind::Position, Kind::Torque].into_iter().filter(|kind| !found(kind)).collect()
}

/// The guesses on a terminal.
pub fn summary(guesses: &Guesses) -> String {
    let mut text = String::new();
    if let Some((column, unit)) = &guesses.time {
        let _ = writeln!(text, "time: `{column}` in {} ({})", unit.unit.unwrap_or("s"), unit.why);
    }
    for (joint, guesses) in &guesses.joints {
        for guess in guesses {
            let unit = guess.unit.unit.map_or("SI".to_owned(), str::to_owned);
            let _ =
                writeln!(text, "{}.{joint}: `{}` in {unit} ({})", guess.kind.key(), guess.column, why(guess));
        }
    }
    if !guesses.unused.is_empty() {
        let _ = writeln!(text, "not used: {}", guesses.unused.join(", "));
    }
    text
}

/// What must be filled in or was not found.
pub fn warnings(guesses: &Guesses) -> Vec<String> {
    let mut warnings = Vec::new();
    if guesses.time.is_none() {
        warnings.push("no column is called like a time; name it in the map: time = \"…\"".to_owned());
    }
    for (joint, guesses) in &guesses.joints {
        for kind in missing(guesses) {
            warnings
                .push(format!("no column for {}.{joint}; name it in the map, or hold the joint", kind.key()));
        }
        for guess in guesses.iter().filter(|guess| !guess.unit.needs.is_empty()) {
            let needs = guess.unit.needs.join(" and ");
            warnings.push(format!("`{}` needs {needs} of {joint}; fill them in", guess.column));
        }
    }
    warnings
}
