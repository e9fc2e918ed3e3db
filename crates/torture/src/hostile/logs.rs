//! Logs with one thing wrong.

use super::bytes;
use super::case::{Case, Class, Expectation};
use super::ground::Ground;
use super::table::Table;
use rand::RngExt;
use rand::seq::IndexedRandom;
use rand_chacha::ChaCha8Rng;
use std::f64::consts::PI;

/// The classes.
pub fn classes() -> Vec<Class> {
    vec![
        Class::wrong("stamps since an epoch, nothing held out by hand", 120, epoch),
        Class::wrong("nothing moves in what is held out", 120, at_rest),
        Class::wrong("stamps in ms, µs or ns", 60, time_unit),
        Class::wrong("positions or velocities in another unit", 120, signal_unit),
        Class::wrong("velocities that contradict the positions", 100, contradiction),
        Class::wrong("encoder spikes", 150, encoder_spike),
        Class::wrong("torque cells far off", 150, torque_cell),
        Class::wrong("cells without a number", 80, empty_cells),
        Class::wrong("rows twice, out of order or lost", 100, row_order),
        Class::wrong("other line ends, quotes, blanks, column order", 60, layout),
        Class::new("a log cut to a few rows", 100, short),
        Class::new("coarse steps in position or torque", 60, coarse),
        Class::new("bytes of a log damaged", 250, damaged),
        Class::new("another kind of file for a log", 60, another_kind),
        Class::new("columns missing, twice or many", 80, columns),
        Class::new("odd numbers", 100, odd_numbers),
        Class::new("lines beyond any length", 12, long_lines),
    ]
}

const LOGS: [&str; 2] = ["train.csv", "validate.csv"];

/// A case on `identify` with `table` in the place of the training log.
fn training(ground: &Ground, table: &Table, expectation: Expectation, story: String) -> Case {
    Case::new(ground, "identify", expectation, story).file("train.csv", table.text())
}

/// A column of that kind, and its name.
fn any_column(table: &Table, prefix: &str, random: &mut ChaCha8Rng) -> (usize, String) {
    let column = table.columns(prefix).choose(random).copied().unwrap_or_default();
    (column, table.header[column].clone())
}

fn epoch(ground: &Ground, random: &mut ChaCha8Rng) -> Case {
    let mut table = ground.table("train.csv");
    let start = random.random_range(1e8..2e9_f64).round() + random.random_range(0.0..1.0);
    table.map(0, |_, t| ((t + start) * 1e6).round() / 1e6);
    let story = format!("stamps from {start} s on");
    Case::new(ground, "held out by itself", Expectation::Same, story).file("train.csv", table.text())
}

fn at_rest(ground: &Ground, random: &mut ChaCha8Rng) -> Case {
    let by_itself = random.random_bool(0.5);
    let mut table = ground.table(if by_itself { "train.csv" } else { "validate.csv" });
    let rows = table.rows.len();
    let first = if by_itself { (rows as f64 * random.random_range(0.4..0.68)) as usize } else { 0 };
    let dither = *[0.0, 1e-12].choose(random).unwrap_or(&0.0);
    for column in table.columns("q.") {
        let at = table.number(first, column);
        table.map(column, |row, q| if row < first { q } else { at + dither * (row % 2) as f64 });
    }
    let story = format!("at rest from row {first} of {rows} on, dither {dither:e}");
    let key = if by_itself { "held out by itself" } else { "identify" };
    Case::new(ground, key, Expectation::Refused, story).file(LOGS[usize::from(!by_itself)], table.text())
}

fn time_unit(ground: &Ground, random: &mut ChaCha8Rng) -> Case {
    let factor = *[1e3, 1e6, 1e9].choose(random).unwrap_or(&1e3);
    let start = *[0.0, 1.7e9].choose(random).unwrap_or(&0.0);
    let story = format!("stamps × {factor:e} from {start} s on");
    let case = Case::new(ground, "identify", Expectation::Refused, story);
    let change = |name: &str| {
        let mut table = ground.table(name);
        table.map(0, |_, t| ((t + start) * factor).round());
        table.text()
    };
    case.file("train.csv", change("train.csv")).file("validate.csv", change("validate.csv"))
}

fn signal_unit(ground: &Ground, random: &mut ChaCha8Rng) -> Case {
    let all = random.random_bool(0.5);
    let factor = *[180.0 / PI, 1000.0, 4096.0 / (2.0 * PI)].choose(random).unwrap_or(&1000.0);
    let column = any_column(&ground.table("train.csv"), "q.", random);
    let change = |name: &str| {
        let mut table = ground.table(name);
        for other in table.columns("q.").into_iter().filter(|&other| all || other == column.0) {
            table.map(other, |_, q| q * factor);
        }
        table.text()
    };
    let story = format!("{} × {factor}", if all { "all positions" } else { &column.1 });
    let case = Case::new(ground, "identify", Expectation::SameOrSaid, story);
    case.file("train.csv", change("train.csv")).file("validate.csv", change("validate.csv"))
}

/// The training log with velocities from central differences, changed.
fn with_velocities(ground: &Ground, change: impl Fn(usize, f64) -> f64) -> Table {
    let mut table = ground.table("train.csv");
    let (positions, last) = (table.columns("q."), table.rows.len() - 1);
    for (joint, column) in positions.into_iter().enumerate() {
        let source = table.clone();
        let name = table.header[column].replacen("q.", "qd.", 1);
        let velocity = |row: usize| {
            let (before, after) = (row.saturating_sub(1), (row + 1).min(last));
            let way = source.number(after, column) - source.number(before, column);
            way / (source.number(after, 0) - source.number(before, 0))
        };
        table.push_column(&name, |row| change(joint, velocity(row)));
    }
    table
}

fn contradiction(ground: &Ground, random: &mut ChaCha8Rng) -> Case {
    let joint = random.random_range(0..4);
    let (story, table) = match random.random_range(0..4) {
        0 => {
            let factor = *[-1.0, 180.0 / PI, 1e3, 1e-3, 0.1].choose(random).unwrap_or(&-1.0);
            (
                format!("velocity of joint {joint} × {factor}"),
                with_velocities(ground, |at, v| if at == joint { v * factor } else { v }),
            )
        }
        1 => (
            format!("velocity of joint {joint} zero"),
            with_velocities(ground, |at, v| if at == joint { 0.0 } else { v }),
        ),
        2 => {
            let other = (joint + 1) % 4;
            let mut table = with_velocities(ground, |_, v| v);
            let columns = table.columns("qd.");
            for row in &mut table.rows {
                row.swap(columns[joint], columns[other]);
            }
            (format!("velocities of joints {joint} and {other} exchanged"), table)
        }
        _ => {
            let lag = random.random_range(20..200);
            let mut table = with_velocities(ground, |_, v| v);
            for column in table.columns("qd.") {
                let source = table.clone();
                table.map(column, |row, _| source.number(row.saturating_sub(lag), column));
            }
            (format!("velocities late by {lag} rows"), table)
        }
    };
    training(ground, &table, Expectation::SameOrSaid, story)
}

fn encoder_spike(ground: &Ground, random: &mut ChaCha8Rng) -> Case {
    let mut table = ground.table("train.csv");
    let count = *[1, 1, 1, 2, 5].choose(random).unwrap_or(&1);
    let size = 10_f64.powf(random.random_range(0.0..6.0));
    let (mut column, mut name) = any_column(&table, "q.", random);
    let mut places = Vec::new();
    for _ in 0..count {
        if random.random_bool(0.3) {
            (column, name) = any_column(&table, "q.", random);
        }
        let row = random.random_range(0..table.rows.len());
        let sign = if random.random_bool(0.5) { 1.0 } else { -1.0 };
        let length = *[1, 1, 1, 2, 3].choose(random).unwrap_or(&1);
        let end = (row + length).min(table.rows.len());
        for row in row..end {
            table.rows[row][column] = (table.number(row, column) + sign * size).to_string();
        }
        places.push(format!("{name} by {} in rows {row}..{end}", sign * size));
    }
    training(ground, &table, Expectation::Same, format!("spikes: {}", places.join(", ")))
}

fn torque_cell(ground: &Ground, random: &mut ChaCha8Rng) -> Case {
    let mut table = ground.table("train.csv");
    let count = random.random_range(1..4);
    let mut places = Vec::new();
    for _ in 0..count {
        let (column, name) = any_column(&table, "tau.", random);
        let row = random.random_range(0..table.rows.len());
        let value = match random.random_range(0..4) {
            0 => 3.4e38,
            1 => -1.7e308,
            2 => 65_535.0,
            _ => 10_f64.powf(random.random_range(3.5..40.0)),
        };
        table.rows[row][column] = format!("{value:e}");
        places.push(format!("{name} {value:e} in row {row}"));
    }
    training(ground, &table, Expectation::Same, places.join(", "))
}

fn empty_cells(ground: &Ground, random: &mut ChaCha8Rng) -> Case {
    let mut table = ground.table("train.csv");
    let word =
        *["", "nan", "NaN", "inf", "-inf", "NA", "null", "-", "1.2.3", "0x1F"].choose(random).unwrap_or(&"");
    let count = random.random_range(1..6);
    for _ in 0..count {
        let row = random.random_range(0..table.rows.len());
        let column = random.random_range(0..table.header.len());
        table.rows[row][column] = word.to_owned();
    }
    training(ground, &table, Expectation::SameOrSaid, format!("{count} cells `{word}`"))
}

fn row_order(ground: &Ground, random: &mut ChaCha8Rng) -> Case {
    let mut table = ground.table("train.csv");
    let at = random.random_range(1..table.rows.len() - 60);
    let story = match random.random_range(0..5) {
        0 => {
            let row = table.rows[at].clone();
            table.rows.insert(at, row);
            format!("row {at} twice")
        }
        1 => {
            table.rows.swap(at, at + 1);
            format!("rows {at} and {} exchanged", at + 1)
        }
        2 => {
            table.rows.drain(at..at + 40);
            format!("40 rows from {at} on lost")
        }
        3 => {
            let rows: Vec<_> = table.rows[at..at + 50].to_vec();
            table.rows.extend(rows);
            format!("50 rows from {at} on again at the end")
        }
        _ => {
            table.rows.reverse();
            "backwards".to_owned()
        }
    };
    training(ground, &table, Expectation::SameOrSaid, story)
}

fn layout(ground: &Ground, random: &mut ChaCha8Rng) -> Case {
    let mut table = ground.table("train.csv");
    let (story, text) = match random.random_range(0..7) {
        0 => ("CRLF", table.text().replace('\n', "\r\n")),
        1 => ("a byte order mark", format!("\u{feff}{}", table.text())),
        2 => {
            for row in &mut table.rows {
                row.iter_mut().for_each(|cell| *cell = format!("\"{cell}\""));
            }
            ("quotes", table.text())
        }
        3 => {
            let by = random.random_range(1..table.header.len());
            table.header.rotate_left(by);
            table.rows.iter_mut().for_each(|row| row.rotate_left(by));
            ("columns in another order", table.text())
        }
        4 => ("blanks after the commas", table.text().replace(',', ", ")),
        5 => ("blank lines at the end", table.text() + "\n\n\n"),
        _ => {
            table.push_column("comment", |row| row as f64);
            ("one more column", table.text())
        }
    };
    Case::new(ground, "identify", Expectation::Same, story.to_owned()).file("train.csv", text)
}

fn short(ground: &Ground, random: &mut ChaCha8Rng) -> Case {
    let rows = random.random_range(0..150);
    let by_itself = random.random_bool(0.5);
    let mut table = ground.table("train.csv");
    table.rows.truncate(rows);
    let key = if by_itself { "held out by itself" } else { "identify" };
    Case::new(ground, key, Expectation::Orderly, format!("{rows} rows")).file("train.csv", table.text())
}

fn coarse(ground: &Ground, random: &mut ChaCha8Rng) -> Case {
    let prefix = *["q.", "tau."].choose(random).unwrap_or(&"q.");
    let step = 10_f64.powf(if prefix == "q." {
        random.random_range(-3.0..-0.5)
    } else {
        random.random_range(-1.0..2.0)
    });
    let change = |name: &str| {
        let mut table = ground.table(name);
        for column in table.columns(prefix) {
            table.map(column, |_, value| (value / step).round() * step);
        }
        table.text()
    };
    let key = if random.random_bool(0.5) { "explain" } else { "identify" };
    let case = Case::new(ground, key, Expectation::Orderly, format!("{prefix} in steps of {step:.2e}"));
    case.file("train.csv", change("train.csv")).file("validate.csv", change("validate.csv"))
}

fn damaged(ground: &Ground, random: &mut ChaCha8Rng) -> Case {
    let name = *LOGS.choose(random).unwrap_or(&LOGS[0]);
    let (bytes, story) = bytes::damage(ground.file(name), random);
    Case::new(ground, "identify", Expectation::Orderly, format!("{name}: {story}")).file(name, bytes)
}

fn another_kind(ground: &Ground, random: &mut ChaCha8Rng) -> Case {
    let (bytes, story) = bytes::another_kind(random);
    Case::new(ground, "identify", Expectation::Refused, story).file("train.csv", bytes)
}

fn columns(ground: &Ground, random: &mut ChaCha8Rng) -> Case {
    let mut table = ground.table("train.csv");
    let column = random.random_range(0..table.header.len());
    let name = table.header[column].clone();
    let (story, expectation) = match random.random_range(0..5) {
        0 => {
            table.header[column] = format!("{name}_");
            (format!("no column {name}"), Expectation::Refused)
        }
        1 => {
            table.push_column(&name, |row| row as f64);
            (format!("{name} twice"), Expectation::Refused)
        }
        2 => {
            let count = random.random_range(10..3000);
            for number in 0..count {
                table.header.push(format!("x{number}\u{1b}[31m"));
                table.rows.iter_mut().take(100).for_each(|row| row.push("1".to_owned()));
            }
            (format!("{count} more columns, with escapes in their names, in 100 rows"), Expectation::Orderly)
        }
        3 => {
            table.rows.iter_mut().for_each(|row| row[column] = "1.5".to_owned());
            (format!("{name} constant"), Expectation::Orderly)
        }
        _ => {
            table.header[column].clear();
            (format!("{name} without a name"), Expectation::Refused)
        }
    };
    training(ground, &table, expectation, story)
}

fn odd_numbers(ground: &Ground, random: &mut ChaCha8Rng) -> Case {
    const ODD: [&str; 16] = [
        "1e308",
        "-1e308",
        "1e-320",
        "1e400",
        "-0",
        "+1.5",
        "1.",
        ".5",
        "1E5",
        "1_000",
        "١٢",
        "0b1",
        "1,5",
        "\u{7}",
        "1e160",
        "99999999999999999999999",
    ];
    let mut table = ground.table("train.csv");
    let odd = *ODD.choose(random).unwrap_or(&ODD[0]);
    let (column, row) =
        (random.random_range(0..table.header.len()), random.random_range(0..table.rows.len()));
    let name = table.header[column].clone();
    table.rows[row][column] = odd.to_owned();
    training(
        ground,
        &table,
        Expectation::Orderly,
        format!("`{}` for {name} in row {row}", odd.escape_debug()),
    )
}

fn long_lines(ground: &Ground, random: &mut ChaCha8Rng) -> Case {
    let size = random.random_range(1..40) << 20;
    let good = ground.text("train.csv");
    let filler = *["a", "1,", ",", "\"", " "].choose(random).unwrap_or(&"a");
    let line = filler.repeat(size / filler.len());
    let first = random.random_bool(0.5);
    let text = if first { line } else { good + &line };
    let story = format!("a {} of {size} bytes of `{filler}`", if first { "header" } else { "last line" });
    Case::new(ground, "identify", Expectation::Refused, story).file("train.csv", text)
}
