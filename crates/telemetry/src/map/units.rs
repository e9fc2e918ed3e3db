//! Units that loggers write, in SI.

use super::signal::Signal;
use std::f64::consts::PI;

/// What a number of a unit is in the signal's own, but for a constant of the drive.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Unit {
    /// Times this.
    Si(f64),
    /// Ticks of an encoder: of so many a revolution.
    Ticks,
    /// A current: times this in ampere.
    Current(f64),
    /// A share of the rated torque: times this.
    OfRated(f64),
    /// A temperature in kelvin.
    Kelvin,
}

const KGF: f64 = 9.806_65;

impl Unit {
    /// The unit of this name, for a signal.
    pub fn named(name: &str, signal: Signal) -> Option<Self> {
        let plain = name.replace(['·', '*', ' ', '.'], "").replace('²', "2").replace("^2", "2");
        let angle = |base: &str| match base {
            "rad" | "m" => Some(Unit::Si(1.0)),
            "deg" | "°" => Some(Unit::Si(PI / 180.0)),
            "rev" | "turn" => Some(Unit::Si(2.0 * PI)),
            "mrad" | "mm" => Some(Unit::Si(1e-3)),
            "cm" => Some(Unit::Si(1e-2)),
            "um" | "µm" => Some(Unit::Si(1e-6)),
            "ticks" | "counts" => Some(Unit::Ticks),
            _ => None,
        };
        match signal {
            Signal::Position | Signal::Reference => angle(&plain),
            Signal::Velocity => match plain.as_str() {
                "rpm" => Some(Unit::Si(2.0 * PI / 60.0)),
                plain => angle(plain.strip_suffix("/s")?),
            },
            Signal::Acceleration => angle(plain.strip_suffix("/s2")?),
            Signal::Torque | Signal::Command => Some(match plain.as_str() {
                "Nm" | "N" => Unit::Si(1.0),
                "mNm" | "mN" => Unit::Si(1e-3),
                "kN" | "kNm" => Unit::Si(1e3),
                "Ncm" => Unit::Si(1e-2),
                "kgfm" | "kgf" => Unit::Si(KGF),
                "kgfcm" | "kgcm" => Unit::Si(1e-2 * KGF),
                "A" => Unit::Current(1.0),
                "mA" => Unit::Current(1e-3),
                "%" | "%ofrated" => Unit::OfRated(1e-2),
                "permille" | "‰" => Unit::OfRated(1e-3),
                _ => return None,
            }),
            Signal::Temperature => match plain.as_str() {
                "degC" | "°C" | "C" => Some(Unit::Si(1.0)),
                "K" => Some(Unit::Kelvin),
                _ => None,
            },
        }
    }

    /// The names that a message lists for a signal.
    pub fn names(signal: Signal) -> &'static str {
        match signal {
            Signal::Position | Signal::Reference => "rad, deg, rev, ticks, m, cm, mm",
            Signal::Velocity => "rad/s, deg/s, rev/s, rpm, ticks/s, m/s, mm/s",
            Signal::Acceleration => "rad/s^2, deg/s^2, rev/s^2, m/s^2, mm/s^2",
            Signal::Torque | Signal::Command => {
                "N.m, mN.m, N.cm, kgf.cm, N, kN, A, mA, % (of rated), permille (of rated)"
            }
            Signal::Temperature => "degC, K",
        }
    }
}

/// Seconds in a unit of time.
pub(crate) fn seconds(name: &str) -> Option<f64> {
    Some(match name {
        "s" => 1.0,
        "ms" => 1e-3,
        "us" | "µs" => 1e-6,
        "ns" => 1e-9,
        "min" => 60.0,
        "h" => 3600.0,
        _ => return None,
    })
}
