//! What a model leaves, in words: on which joints, what it follows, and what is known to do so.

use phiw_report::number::percent;
use phiw_residual::trace::{Dependence, Remaining};

/// A sentence on what is more than noise.
pub fn remaining_in_words(remaining: &Remaining) -> String {
    let mut text = format!("What is left on {} is more than noise", remaining.joints.join(", "));
    let mut all: Vec<String> = Vec::new();
    for joint in &remaining.joints {
        let best = remaining.depends_on.iter().find(|dependence| &dependence.joint == joint);
        all.extend(best.map(|best| {
            let known = known_to_follow(&best.signals).map(|known| format!(", as {known} does"));
            format!(
                "{joint} follows {} ({} % of its variance){}",
                in_words(&best.signals),
                percent(best.share),
                known.unwrap_or_default()
            )
        }));
    }
    if !remaining.by_log.is_empty() {
        all.push(format!("{} is told otherwise by one log than by all", remaining.by_log.join(", ")));
    }
    if all.is_empty() {
        text.push_str(", and follows none of the signals that were tried");
    } else {
        text.push_str(": ");
        text.push_str(&all.join("; "));
    }
    text.push('.');
    text
}

/// One line for each joint and the signals that its residual follows.
pub fn follows(dependence: &Dependence) -> String {
    format!(
        "{}: {} % of the held-out residual's variance follows {}",
        dependence.joint,
        percent(dependence.share),
        in_words(&dependence.signals)
    )
}

/// Signals that were looked at together.
fn in_words(signals: &[String]) -> String {
    let words: Vec<String> = signals.iter().map(|signal| signal_in_words(signal)).collect();
    match words.as_slice() {
        [first, second] => format!("{first} and {second} together"),
        words => words.join(", "),
    }
}

fn signal_in_words(signal: &str) -> String {
    if let Some((signal, joint)) = signal.split_once('.') {
        let of_joint = signal_in_words(signal);
        return format!("the {} of {joint}", of_joint.strip_prefix("its ").unwrap_or(&of_joint));
    }
    match signal {
        "q" => "its position".to_owned(),
        "qd" => "its velocity".to_owned(),
        "qdd" => "its acceleration".to_owned(),
        "tau" => "its torque".to_owned(),
        "t" => "the time".to_owned(),
        other => other.to_owned(),
    }
}

/// What the catalogue lacks and is known to follow these signals: a hint for whoever looks for it, no name.
fn known_to_follow(signals: &[String]) -> Option<&'static str> {
    let signals: Vec<&str> = signals.iter().map(String::as_str).collect();
    Some(match signals.as_slice() {
        ["tau"] => "a torque constant that falls with the torque, or a sensor with a dead band,",
        ["tau", "qd"] => "a torque constant that falls with the speed",
        ["tau", "q"] | ["q", "tau"] => "a ripple of teeth or of a commutation that grows with the load",
        ["q", "qd"] => "a friction that changes around the turn",
        ["t", "qd"] => "a friction that has changed in the course of the logs",
        ["q", other] if other.starts_with("q.") => "a cable that pulls at a link",
        ["t", "tau"] => "a clock of the torques that is not that of the positions",
        [other] if other.starts_with("tau.") => "a torque sensor that feels another joint's torque",
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::{Dependence, Remaining, follows, remaining_in_words};

    fn remaining(signals: &[&str]) -> Remaining {
        let signals = signals.iter().map(|signal| (*signal).to_owned()).collect();
        let dependence = Dependence { joint: "elbow".into(), signals, share: 0.621 };
        Remaining { joints: vec!["elbow".into()], depends_on: vec![dependence], ..Remaining::default() }
    }

    #[test]
    fn signals_are_named_together_with_what_is_known_to_follow_them() {
        for (signals, words) in [
            (
                &["tau", "qd"][..],
                "elbow follows its torque and its velocity together (62.1 % of its variance), as a torque \
                 constant that falls with the speed does.",
            ),
            (&["q.wrist"][..], "elbow follows the position of wrist (62.1 % of its variance)."),
            (
                &["q", "q.wrist"][..],
                "elbow follows its position and the position of wrist together (62.1 % of its variance), as a \
                 cable that pulls at a link does.",
            ),
            (
                &["tau.wrist"][..],
                "elbow follows the torque of wrist (62.1 % of its variance), as a torque sensor that feels \
                 another joint's torque does.",
            ),
        ] {
            let said = remaining_in_words(&remaining(signals));
            assert_eq!(said, format!("What is left on elbow is more than noise: {words}"));
        }
        let line = follows(&remaining(&["t"]).depends_on[0]);
        assert_eq!(line, "elbow: 62.1 % of the held-out residual's variance follows the time");
    }

    #[test]
    fn a_residual_that_follows_nothing_is_said_to() {
        let nothing = Remaining { depends_on: Vec::new(), ..remaining(&[]) };
        assert!(remaining_in_words(&nothing).ends_with("follows none of the signals that were tried."));
    }
}
