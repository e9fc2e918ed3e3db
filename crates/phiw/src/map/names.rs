//! How like a column's name is to a joint's signal.

/// Signals that a map can name, in the order in which they are sought.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    Reference,
    Temperature,
    Torque,
    Velocity,
    Position,
}

impl Kind {
    /// What says more comes first: `goal_position` is a reference, not a position.
    pub const ALL: [Kind; 5] =
        [Kind::Reference, Kind::Temperature, Kind::Torque, Kind::Velocity, Kind::Position];

    /// The key in a map.
    pub fn key(self) -> &'static str {
        match self {
            Kind::Reference => "qref",
            Kind::Temperature => "temp",
            Kind::Torque => "tau",
            Kind::Velocity => "qd",
            Kind::Position => "q",
        }
    }

    /// Words of a column's name that speak for the signal.
    fn words(self) -> &'static [&'static str] {
        match self {
            Kind::Reference => &[
                "qref",
                "ref",
                "reference",
                "cmd",
                "command",
                "goal",
                "target",
                "des",
                "desired",
                "action",
                "setpoint",
            ],
            Kind::Temperature => &["temp", "temperature"],
            Kind::Torque => &[
                "tau", "torque", "torques", "effort", "efforts", "load", "current", "currents", "cur", "amp",
                "amps", "force", "iq", "i",
            ],
            Kind::Velocity => {
                &["qd", "dq", "vel", "velocity", "velocities", "speed", "speeds", "qvel", "qdot"]
            }
            Kind::Position => &[
                "q",
                "pos",
                "position",
                "positions",
                "angle",
                "angles",
                "qpos",
                "encoder",
                "enc",
                "state",
                "pose",
            ],
        }
    }
}

/// Units that a name may end with; they say nothing of joint or signal.
const UNITS: [&str; 16] = [
    "rad", "deg", "rev", "rpm", "ticks", "counts", "mm", "m", "nm", "n", "a", "ma", "s", "raw", "permille",
    "percent",
];

/// The words of a name: letters and digits by themselves, in small letters; `fooBar2` is `foo`, `bar`, `2`.
pub fn words(name: &str) -> Vec<String> {
    let mut words: Vec<String> = Vec::new();
    let mut previous = None;
    for c in name.chars() {
        if !c.is_alphanumeric() {
            previous = None;
            continue;
        }
        let begins = previous.is_none_or(|before: char| {
            before.is_ascii_digit() != c.is_ascii_digit() || (before.is_lowercase() && c.is_uppercase())
        });
        if begins {
            words.push(String::new());
        }
        if let Some(word) = words.last_mut() {
            word.extend(c.to_lowercase());
        }
        previous = Some(c);
    }
    words
}

/// Which signal a column's name speaks of; a word of the joint's own name does not count.
pub fn kind(column: &[String], joint: &[String]) -> Option<Kind> {
    let free: Vec<&String> = column.iter().filter(|word| !joint.contains(word)).collect();
    Kind::ALL.into_iter().find(|kind| free.iter().any(|word| kind.words().contains(&word.as_str())))
}

/// Words of a joint's name that every joint's has.
pub fn common(joints: &[Vec<String>]) -> Vec<String> {
    let Some((first, others)) = joints.split_first() else { return Vec::new() };
    let in_all = |word: &&String| !others.is_empty() && others.iter().all(|other| other.contains(word));
    first.iter().filter(in_all).cloned().collect()
}

/// How much of a joint's name is in a column's: 1 is all of it. `common` counts for nothing.
pub fn likeness(column: &[String], joint: &[String], common: &[String]) -> f64 {
    let own: Vec<&String> = joint.iter().filter(|word| !common.contains(word)).collect();
    let found = own.iter().filter(|word| column.contains(**word)).count();
    if own.is_empty() { 0.0 } else { found as f64 / own.len() as f64 }
}

/// Words of a column's name that neither the joint, the signal nor a unit accounts for.
pub fn left_over(column: &[String], joint: &[String]) -> usize {
    let signal = |word: &str| Kind::ALL.iter().any(|kind| kind.words().contains(&word));
    column
        .iter()
        .filter(|word| !joint.contains(word) && !signal(word) && !UNITS.contains(&word.as_str()))
        .count()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_split_where_letters_change() {
        assert_eq!(words("motorState[12].tau_est"), ["motor", "state", "12", "tau", "est"]);
        assert_eq!(words("L-Elbow2"), ["l", "elbow", "2"]);
        assert_eq!(words("..."), [""; 0]);
    }

    #[test]
    fn the_word_that_says_most_decides() {
        let check = |column: &str, joint: &str, expected: Option<Kind>| {
            assert_eq!(kind(&words(column), &words(joint)), expected, "{column}");
        };
        check("goal_position_elbow", "elbow", Some(Kind::Reference));
        check("elbow.pos", "elbow", Some(Kind::Position));
        check("elbow_cur_mA", "elbow", Some(Kind::Torque));
        check("load_cell.q", "load_cell", Some(Kind::Position));
        check("gripper", "elbow", None);
    }
}
