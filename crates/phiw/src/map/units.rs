//! In what unit a column is, by its name and its range.

use super::names::words;
use phiw_dynamics::JointLimits;
use std::f64::consts::PI;

/// A unit, and why it is thought to be it.
#[derive(Debug, Clone, PartialEq)]
pub struct UnitGuess {
    /// As the map has it; `None` is SI.
    pub unit: Option<&'static str>,
    /// Why.
    pub why: String,
    /// Constants that the map needs with it, to be filled in.
    pub needs: &'static [&'static str],
}

fn si(why: impl Into<String>) -> UnitGuess {
    UnitGuess { unit: None, why: why.into(), needs: &[] }
}

fn of(unit: &'static str, needs: &'static [&'static str], why: impl Into<String>) -> UnitGuess {
    UnitGuess { unit: Some(unit), why: why.into(), needs }
}

/// How far beyond its limits a joint may be logged: soft limits and encoders' offsets.
const BEYOND_LIMITS: f64 = 1.2;
/// A magnitude that no angle in radians of a joint without limits has.
const MANY_TURNS: f64 = 8.0 * PI;
/// How near a ratio must be to that of a unit.
const NEAR: f64 = 0.15;

/// Of a position (or its reference).
pub fn of_position(name: &str, values: &[f64], limits: JointLimits, prismatic: bool) -> UnitGuess {
    let words = words(name);
    let has = |unit: &str| words.iter().any(|word| word == unit);
    let largest = largest(values);
    if prismatic {
        return match () {
            () if has("mm") => of("mm", &[], "its name says mm"),
            () if limits.upper.is_finite() && largest > 50.0 * limits.upper.abs().max(limits.lower.abs()) => {
                of("mm", &[], format!("it reaches {largest:.3}, {} is the limit in m", limits.upper))
            }
            () => si("its range fits the limits in m"),
        };
    }
    for (word, unit, needs) in
        [("deg", "deg", &[][..]), ("rev", "rev", &[]), ("ticks", "ticks", &["ticks_per_rev"])]
    {
        if has(word) {
            return of(unit, needs, format!("its name says {word}"));
        }
    }
    if has("rad") {
        return si("its name says rad");
    }
    let is_limited = limits.lower.is_finite() && limits.upper.is_finite() && limits.lower < limits.upper;
    let limit = if is_limited { limits.lower.abs().max(limits.upper.abs()) } else { MANY_TURNS };
    let whole = !values.is_empty() && values.iter().all(|value| value.fract() == 0.0);
    match () {
        () if largest <= BEYOND_LIMITS * limit => {
            si(format!("it reaches {largest:.3}, the limit is {limit:.3} rad"))
        }
        () if whole && largest > 360.0 => {
            of("ticks", &["ticks_per_rev"], format!("its values are whole numbers up to {largest}"))
        }
        () if largest * PI / 180.0 <= BEYOND_LIMITS * limit => of(
            "deg",
            &[],
            format!(
                "it reaches {largest:.3}, which fits the limit of {:.1} deg, not {limit:.3} rad",
                limit * 180.0 / PI
            ),
        ),
        () => of("ticks", &["ticks_per_rev"], format!("it reaches {largest:.1}, which no angle does")),
    }
}

/// Of a velocity, compared with that of the positions, which is already in SI.
pub fn of_velocity(name: &str, ratio: Option<f64>, prismatic: bool) -> UnitGuess {
    let known: [(&str, f64); 4] = if prismatic {
        [("m/s", 1.0), ("mm/s", 1e3), ("cm/s", 1e2), ("m/s", 1.0)]
    } else {
        [("rad/s", 1.0), ("deg/s", 180.0 / PI), ("rpm", 30.0 / PI), ("rev/s", 0.5 / PI)]
    };
    let Some(ratio) = ratio.filter(|ratio| ratio.is_finite()) else {
        return si("nothing to compare it with");
    };
    let near = known.into_iter().find(|(_, factor)| (ratio.abs() / factor - 1.0).abs() < NEAR);
    match near {
        Some((_, 1.0)) => si(format!("it is {ratio:.3} times the positions' derivative")),
        Some((unit, _)) => of(unit, &[], format!("it is {ratio:.3} times the positions' derivative")),
        None => {
            let words = words(name);
            let why =
                format!("it is {ratio:.3} times the positions' derivative, which is no unit that is known");
            if words.iter().any(|word| word == "ticks") {
                of("ticks/s", &["ticks_per_rev"], why)
            } else {
                si(why)
            }
        }
    }
}

/// Of a torque.
pub fn of_torque(name: &str, values: &[f64], limits: JointLimits) -> UnitGuess {
    let words = words(name);
    let has = |units: &[&str]| words.iter().any(|word| units.contains(&word.as_str()));
    let largest = largest(values);
    let current: &[&str] = &["torque_constant_nm_per_a", "gear"];
    let is_limited = limits.effort.is_finite() && limits.effort > 0.0;
    match () {
        () if has(&["ma"]) => of("mA", current, "its name says mA"),
        () if has(&["current", "currents", "cur", "amp", "amps", "iq", "i"]) && largest > 200.0 => {
            of("mA", current, format!("it is a current that reaches {largest:.1}"))
        }
        () if has(&["a", "current", "currents", "cur", "amp", "amps", "iq", "i"]) => {
            of("A", current, format!("it is a current that reaches {largest:.2}"))
        }
        () if has(&["permille"]) => of("permille", &["rated_torque_nm", "gear"], "its name says permille"),
        () if has(&["percent"]) => of("%", &["rated_torque_nm", "gear"], "its name says percent"),
        () if is_limited && largest > 20.0 * limits.effort => of(
            "permille",
            &["rated_torque_nm", "gear"],
            format!("it reaches {largest:.1}, far beyond the limit of {:.1} N·m", limits.effort),
        ),
        () => si(format!("it reaches {largest:.3}")),
    }
}

/// Of the time, by its name and the distance of its stamps.
pub fn of_time(name: &str, values: &[f64]) -> UnitGuess {
    let words = words(name);
    for unit in ["ns", "us", "ms"] {
        if words.iter().any(|word| word == unit) {
            return of(unit, &[], format!("its name says {unit}"));
        }
    }
    let mut steps: Vec<f64> =
        values.windows(2).map(|pair| pair[1] - pair[0]).filter(|step| *step > 0.0).collect();
    steps.sort_by(f64::total_cmp);
    let Some(&step) = steps.get(steps.len() / 2) else { return si("it has no steps") };
    let why = format!("its steps are {step}");
    match step {
        // A robot's log has from 1 Hz to 100 kHz.
        step if step <= 1.0 => si(why),
        step if step <= 100.0 => of("ms", &[], why),
        step if step <= 1e5 => of("us", &[], why),
        _ => of("ns", &[], why),
    }
}

fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |largest: f64, value| largest.max(value.abs()))
}
