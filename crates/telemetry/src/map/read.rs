//! From the text of a map to what it says.

use super::facts::LogEntry;
use super::matrix::inverse_transposed;
use super::signal::Signal;
use super::{Coupling, LogMap, MapError};
use serde::Deserialize;
use serde::de::value::MapAccessDeserializer;
use serde::de::{Deserializer, MapAccess, Visitor};
use std::collections::BTreeMap;
use std::fmt;
use std::marker::PhantomData;
use std::path::Path;
use toml::Spanned;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawMap {
    topic: Option<String>,
    time: Option<Spanned<RawTime>>,
    #[serde(default)]
    joints: Vec<String>,
    every_joint: Option<RawJoint>,
    #[serde(default)]
    joint: BTreeMap<Spanned<String>, RawJoint>,
    #[serde(default)]
    motor: BTreeMap<Spanned<String>, RawJoint>,
    #[serde(default)]
    coupling: Vec<Spanned<RawCoupling>>,
    #[serde(default)]
    log: Vec<RawLog>,
}

/// The time: a column's name, or more of it.
#[derive(Debug, Clone)]
pub(crate) struct RawTime {
    pub column: Option<String>,
    pub unit: Option<String>,
}

/// A joint or motor: its signals, and the constants of its drive.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct RawJoint {
    pub q: Option<Spanned<RawSignal>>,
    pub qd: Option<Spanned<RawSignal>>,
    pub qdd: Option<Spanned<RawSignal>>,
    pub tau: Option<Spanned<RawSignal>>,
    pub qref: Option<Spanned<RawSignal>>,
    pub tau_cmd: Option<Spanned<RawSignal>>,
    pub temp: Option<Spanned<RawSignal>>,
    pub gear: Option<f64>,
    pub torque_constant_nm_per_a: Option<f64>,
    pub efficiency: Option<f64>,
    pub ticks_per_rev: Option<f64>,
    pub rated_torque_nm: Option<f64>,
    pub rated_current_a: Option<f64>,
}

impl RawJoint {
    pub fn signal(&self, signal: Signal) -> Option<&Spanned<RawSignal>> {
        match signal {
            Signal::Position => self.q.as_ref(),
            Signal::Velocity => self.qd.as_ref(),
            Signal::Acceleration => self.qdd.as_ref(),
            Signal::Torque => self.tau.as_ref(),
            Signal::Reference => self.qref.as_ref(),
            Signal::Command => self.tau_cmd.as_ref(),
            Signal::Temperature => self.temp.as_ref(),
        }
    }

    pub fn drive(&self) -> Drive {
        Drive {
            gear: self.gear,
            torque_constant_nm_per_a: self.torque_constant_nm_per_a,
            efficiency: self.efficiency,
            ticks_per_rev: self.ticks_per_rev,
            rated_torque_nm: self.rated_torque_nm,
            rated_current_a: self.rated_current_a,
        }
    }
}

/// The constants of a drive.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Drive {
    pub gear: Option<f64>,
    pub torque_constant_nm_per_a: Option<f64>,
    pub efficiency: Option<f64>,
    pub ticks_per_rev: Option<f64>,
    pub rated_torque_nm: Option<f64>,
    pub rated_current_a: Option<f64>,
}

impl Drive {
    /// These, and where they say nothing, the others.
    pub fn or(self, others: Drive) -> Drive {
        Drive {
            gear: self.gear.or(others.gear),
            torque_constant_nm_per_a: self.torque_constant_nm_per_a.or(others.torque_constant_nm_per_a),
            efficiency: self.efficiency.or(others.efficiency),
            ticks_per_rev: self.ticks_per_rev.or(others.ticks_per_rev),
            rated_torque_nm: self.rated_torque_nm.or(others.rated_torque_nm),
            rated_current_a: self.rated_current_a.or(others.rated_current_a),
        }
    }
}

/// How a signal comes about.
#[derive(Debug, Clone, Default)]
pub(crate) struct RawSignal {
    pub column: Option<String>,
    pub unit: Option<String>,
    pub side: Option<Side>,
    pub sign: Option<f64>,
    pub scale: Option<f64>,
    pub offset: Option<f64>,
    pub load: Option<String>,
    pub sign_of: Option<String>,
    pub pd: Option<RawPd>,
    pub drive: Drive,
}

/// Where a signal is measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Side {
    Joint,
    Motor,
}

/// The law of a controller.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct RawPd {
    pub kp: f64,
    #[serde(default)]
    pub kd: f64,
    /// Columns \[rad/s, m/s\] and \[N·m, N\].
    pub reference_velocity: Option<String>,
    pub feedforward: Option<String>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawCoupling {
    motors: Vec<String>,
    joints: Vec<String>,
    matrix: Vec<Vec<f64>>,
}

/// What is said of one log.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct RawLog {
    pub file: Option<String>,
    pub train: Option<Spanned<Vec<[f64; 2]>>>,
    pub validate: Option<Spanned<Vec<[f64; 2]>>>,
    pub leave_out: Option<Spanned<Vec<[f64; 2]>>>,
    pub payload: Option<Spanned<RawPayload>>,
}

/// What the robot held.
#[derive(Debug)]
pub(crate) enum RawPayload {
    Words(String),
    Known(RawKnownPayload),
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct RawKnownPayload {
    pub link: String,
    pub mass_kg: f64,
    #[serde(default)]
    pub com_m: [f64; 3],
}

/// The long form of a time.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct LongTime {
    column: Option<String>,
    unit: Option<String>,
}

/// The long form of a signal.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct LongSignal {
    column: Option<String>,
    unit: Option<String>,
    side: Option<Side>,
    sign: Option<f64>,
    scale: Option<f64>,
    offset: Option<f64>,
    load: Option<String>,
    sign_of: Option<String>,
    pd: Option<RawPd>,
    gear: Option<f64>,
    torque_constant_nm_per_a: Option<f64>,
    efficiency: Option<f64>,
    ticks_per_rev: Option<f64>,
    rated_torque_nm: Option<f64>,
    rated_current_a: Option<f64>,
}

/// What is written as a text in short and as a table in full.
struct TextOr<L, T>(PhantomData<(L, T)>);

/// How the two forms are read.
trait Forms<L>: Sized {
    const EXPECTED: &'static str;
    fn of_text(text: String) -> Self;
    fn of_table(table: L) -> Self;
}

impl<'de, L: Deserialize<'de>, T: Forms<L>> Visitor<'de> for TextOr<L, T> {
    type Value = T;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(T::EXPECTED)
    }

    fn visit_str<E>(self, text: &str) -> Result<T, E> {
        Ok(T::of_text(text.to_owned()))
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<T, A::Error> {
        L::deserialize(MapAccessDeserializer::new(map)).map(T::of_table)
    }
}

impl Forms<LongTime> for RawTime {
    const EXPECTED: &'static str = "a column's name, or a table with `column` and `unit`";

    fn of_text(text: String) -> Self {
        RawTime { column: Some(text), unit: None }
    }

    fn of_table(table: LongTime) -> Self {
        RawTime { column: table.column, unit: table.unit }
    }
}

impl Forms<LongSignal> for RawSignal {
    const EXPECTED: &'static str = "a column's name, or a table with `column`, `pd`, or `load` and `sign_of`";

    fn of_text(text: String) -> Self {
        RawSignal { column: Some(text), ..RawSignal::default() }
    }

    fn of_table(table: LongSignal) -> Self {
        RawSignal {
            column: table.column,
            unit: table.unit,
            side: table.side,
            sign: table.sign,
            scale: table.scale,
            offset: table.offset,
            load: table.load,
            sign_of: table.sign_of,
            pd: table.pd,
            drive: Drive {
                gear: table.gear,
                torque_constant_nm_per_a: table.torque_constant_nm_per_a,
                efficiency: table.efficiency,
                ticks_per_rev: table.ticks_per_rev,
                rated_torque_nm: table.rated_torque_nm,
                rated_current_a: table.rated_current_a,
            },
        }
    }
}

impl Forms<RawKnownPayload> for RawPayload {
    const EXPECTED: &'static str = "\"unknown but the same\", or a table with `link`, `mass_kg` and `com_m`";

    fn of_text(text: String) -> Self {
        RawPayload::Words(text)
    }

    fn of_table(table: RawKnownPayload) -> Self {
        RawPayload::Known(table)
    }
}

impl<'de> Deserialize<'de> for RawTime {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(TextOr::<LongTime, RawTime>(PhantomData))
    }
}

impl<'de> Deserialize<'de> for RawSignal {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(TextOr::<LongSignal, RawSignal>(PhantomData))
    }
}

impl<'de> Deserialize<'de> for RawPayload {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(TextOr::<RawKnownPayload, RawPayload>(PhantomData))
    }
}

/// Reads a map.
pub(crate) fn read(path: &Path, text: &str) -> Result<LogMap, MapError> {
    let raw: RawMap = toml::from_str(text).map_err(|error| {
        let at = error.span().map_or(0, |span| span.start);
        MapError::new(path, text, at, key_at(text, at), error.message().replace('\n', " "))
    })?;
    let couplings = raw.coupling.iter().map(|coupling| of_coupling(coupling, path, text));
    let couplings = couplings.collect::<Result<Vec<_>, _>>()?;
    for motor in couplings.iter().flat_map(|coupling| &coupling.motors) {
        if !raw.motor.keys().any(|known| known.get_ref() == motor) {
            let what = format!("there is no table [motor.{motor}]; say in it which columns are this motor's");
            return Err(MapError::new(path, text, text.find("motors").unwrap_or(0), "coupling.motors", what));
        }
    }
    let logs = raw.log.into_iter().map(|log| LogEntry::new(log, path, text)).collect::<Result<_, _>>()?;
    Ok(LogMap {
        path: path.into(),
        text: text.into(),
        topic: raw.topic,
        time: raw.time,
        order: raw.joints,
        every_joint: raw.every_joint,
        joints: raw.joint,
        motors: raw.motor,
        couplings,
        logs,
    })
}

fn of_coupling(raw: &Spanned<RawCoupling>, path: &Path, text: &str) -> Result<Coupling, MapError> {
    let wrong = |what: String| MapError::new(path, text, raw.span().start, "coupling.matrix", what);
    let RawCoupling { motors, joints, matrix } = raw.get_ref();
    let n = motors.len();
    if joints.len() != n || matrix.len() != n || matrix.iter().any(|row| row.len() != n) || n == 0 {
        return Err(wrong(format!(
            "it must be square: a row for each of the {} joints, in it a number for each of the {n} motors",
            joints.len()
        )));
    }
    let torques =
        inverse_transposed(matrix).filter(|torques| torques.iter().flatten().all(|x| x.is_finite()));
    let torques = torques.ok_or_else(|| {
        wrong("it cannot be inverted, so that torques have no meaning; each joint must move in a way of its own".into())
    })?;
    Ok(Coupling { motors: motors.clone(), joints: joints.clone(), matrix: matrix.clone(), torques })
}

/// The key on the line of a place, or the line itself where it has none.
fn key_at(text: &str, at: usize) -> String {
    let at = (0..=at.min(text.len())).rev().find(|&at| text.is_char_boundary(at)).unwrap_or(0);
    let start = text[..at].rfind('\n').map_or(0, |end| end + 1);
    let line = text[start..].lines().next().unwrap_or_default();
    line.split('=').next().unwrap_or_default().trim().chars().take(40).collect()
}
