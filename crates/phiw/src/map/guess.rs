//! Which column is which signal of which joint.

use super::names::{Kind, common, kind, left_over, likeness, words};
use super::units::{UnitGuess, of_position, of_time, of_torque, of_velocity};
use phiw_dynamics::{JointType, Tree};
use phiw_telemetry::LogContents;
use std::f64::consts::PI;

/// A column that is taken for a signal.
#[derive(Debug, Clone)]
pub struct Guess {
    pub kind: Kind,
    pub column: String,
    pub unit: UnitGuess,
    /// Why this column.
    pub why: String,
}

/// All guesses for a log.
#[derive(Debug)]
pub struct Guesses {
    /// Column and unit of the time, if one was found.
    pub time: Option<(String, UnitGuess)>,
    /// Joints in the robot's order, each with what was found.
    pub joints: Vec<(String, Vec<Guess>)>,
    /// Columns that are taken for nothing.
    pub unused: Vec<String>,
}

/// Share of a joint's own words that a column must name.
const LIKE: f64 = 0.99;
/// Names of the time.
const TIMES: [&str; 6] = ["t", "time", "timestamp", "timestamps", "stamp", "times"];

impl Guesses {
    /// Names first, then the order of entries, then ranges for the units.
    pub fn of(tree: &Tree, contents: &LogContents) -> Self {
        let joints: Vec<String> = tree.joint_names().map(str::to_owned).collect();
        let joint_words: Vec<Vec<String>> = joints.iter().map(|joint| words(joint)).collect();
        let shared = common(&joint_words);
        let names: Vec<Vec<String>> = contents.columns.iter().map(|column| words(&column.name)).collect();
        let mut used = vec![false; names.len()];
        let time = time_of(contents, &names);
        if let Some(time) = time {
            used[time] = true;
        }
        let stamps: Vec<f64> = time.map_or(Vec::new(), |time| contents.column(time));
        let time_unit = time.map(|time| of_time(&contents.columns[time].name, &stamps));
        let seconds = seconds(time_unit.as_ref());
        let mut found: Vec<(String, Vec<Guess>)> =
            joints.iter().map(|joint| (joint.clone(), Vec::new())).collect();
        for wanted in Kind::ALL {
            let arrays = by_order(contents, &names, wanted, joints.len());
            for (index, joint) in joints.iter().enumerate() {
                let own = own_name(contents, wanted, joint);
                let own = own.map(|column| (column, "its name is that of the signal".to_owned()));
                let by_order = || {
                    let column = *arrays.as_ref()?.get(index)?;
                    Some((column, format!("entry {index} in a row of {}; check the order", joints.len())))
                };
                let by_name = || {
                    let own = (joint_words[index].as_slice(), shared.as_slice());
                    let column = like(&names, &used, own, wanted)?;
                    Some((column, "its name has those of joint and signal".to_owned()))
                };
                // A number says which entry it is, and counts from 0 or 1: the order is surer than the name.
                let chosen = match is_number(&joint_words[index], &shared) {
                    true => own.or_else(by_order).or_else(by_name),
                    false => own.or_else(by_name).or_else(by_order),
                };
                let Some((column, why)) = chosen.filter(|(column, _)| !used[*column]) else { continue };
                used[column] = true;
                let unit = UnitGuess { unit: None, why: String::new(), needs: &[] };
                let name = contents.columns[column].name.clone();
                found[index].1.push(Guess { kind: wanted, column: name, unit, why });
            }
        }
        for (index, (_, guesses)) in found.iter_mut().enumerate() {
            guess_units(tree, index, contents, &stamps, seconds, guesses);
            guesses.reverse();
        }
        let unused = contents.columns.iter().zip(&used).filter(|(_, used)| !**used);
        Guesses {
            time: time.map(|time| contents.columns[time].name.clone()).zip(time_unit),
            joints: found,
            unused: unused.map(|(column, _)| column.name.clone()).collect(),
        }
    }
}

/// Whether a joint is told from the others by numbers only.
fn is_number(joint: &[String], shared: &[String]) -> bool {
    let mut own = joint.iter().filter(|word| !shared.contains(word));
    own.all(|word| word.chars().all(|c| c.is_ascii_digit()))
}

/// The column whose name is likest to a joint's and a signal's.
fn like(
    names: &[Vec<String>],
    used: &[bool],
    (joint, shared): (&[String], &[String]),
    wanted: Kind,
) -> Option<usize> {
    let mut best: Option<(usize, usize)> = None;
    for (column, name) in names.iter().enumerate() {
        if used[column] || likeness(name, joint, shared) < LIKE || kind(name, joint) != Some(wanted) {
            continue;
        }
        let left = left_over(name, joint);
        if best.is_none_or(|(_, other)| left < other) {
            best = Some((column, left));
        }
    }
    best.map(|(column, _)| column)
}

fn seconds(unit: Option<&UnitGuess>) -> f64 {
    match unit.and_then(|unit| unit.unit) {
        Some("ms") => 1e-3,
        Some("us") => 1e-6,
        Some("ns") => 1e-9,
        _ => 1.0,
    }
}

fn time_of(contents: &LogContents, names: &[Vec<String>]) -> Option<usize> {
    let is_named = |time: &&str| contents.columns.iter().position(|column| column.name == *time);
    let exact = TIMES.iter().find_map(is_named);
    exact.or_else(|| names.iter().position(|name| name.iter().any(|word| TIMES.contains(&word.as_str()))))
}

/// The column that is the signal without a map.
fn own_name(contents: &LogContents, kind: Kind, joint: &str) -> Option<usize> {
    let own = format!("{}.{joint}", kind.key());
    contents.columns.iter().position(|column| column.name == own || column.signal.as_ref() == Some(&own))
}

/// The columns that speak of a signal and are numbered, if there are as many as joints.
fn by_order(
    contents: &LogContents,
    names: &[Vec<String>],
    wanted: Kind,
    joints: usize,
) -> Option<Vec<usize>> {
    let number = |name: &Vec<String>| name.iter().rev().find_map(|word| word.parse::<u64>().ok());
    let mut columns: Vec<(u64, usize)> = (0..contents.columns.len())
        .filter(|&column| kind(&names[column], &[]) == Some(wanted))
        .filter_map(|column| Some((number(&names[column])?, column)))
        .collect();
    columns.sort_unstable();
    let distinct = columns.windows(2).all(|pair| pair[0].0 != pair[1].0);
    (columns.len() == joints && distinct).then(|| columns.into_iter().map(|(_, column)| column).collect())
}

fn guess_units(
    tree: &Tree,
    index: usize,
    contents: &LogContents,
    stamps: &[f64],
    seconds: f64,
    guesses: &mut [Guess],
) {
    let body = tree.joint(index);
    let prismatic = body.joint_type == JointType::Prismatic;
    let values = |name: &str| {
        let column = contents.columns.iter().position(|column| column.name == name);
        column.map_or(Vec::new(), |column| contents.column(column))
    };
    for guess in guesses.iter_mut() {
        let column = values(&guess.column);
        guess.unit = match guess.kind {
            Kind::Position | Kind::Reference => of_position(&guess.column, &column, body.limits, prismatic),
            Kind::Torque => of_torque(&guess.column, &column, body.limits),
            _ => continue,
        };
    }
    let position = guesses.iter().find(|guess| guess.kind == Kind::Position).map(|guess| {
        let factor = match guess.unit.unit {
            Some("deg") => PI / 180.0,
            Some("mm") => 1e-3,
            _ => 1.0,
        };
        (values(&guess.column), factor)
    });
    for guess in guesses.iter_mut().filter(|guess| guess.kind == Kind::Velocity) {
        let ratio = position
            .as_ref()
            .and_then(|(q, factor)| slope_ratio(stamps, q, &values(&guess.column), seconds / factor));
        guess.unit = of_velocity(&guess.column, ratio, prismatic);
    }
}

/// How many times the positions' derivative a velocity is: Σ qd·q̇ over Σ q̇², in units where a second has
/// `seconds` of the stamps' units over those of the positions.
fn slope_ratio(t: &[f64], q: &[f64], qd: &[f64], seconds: f64) -> Option<f64> {
    if t.len() != q.len() || q.len() != qd.len() {
        return None;
    }
    let (mut product, mut square) = (0.0, 0.0);
    for k in 1..t.len().saturating_sub(1) {
        let slope = (q[k + 1] - q[k - 1]) / ((t[k + 1] - t[k - 1]) * seconds);
        if slope.is_finite() {
            product += slope * qd[k];
            square += slope * slope;
        }
    }
    (square > 0.0).then_some(product / square)
}
