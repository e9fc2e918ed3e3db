//! From a log's columns and a map to the signals of joints.

use super::expression::Expression;
use super::read::{Drive, RawJoint, RawSignal, Side};
use super::signal::Signal;
use super::units::{Unit, seconds};
use super::{Coupling, LogMap, MapError};
use crate::LogError;
use crate::columns::nearest;
use phiw_log_formats::Column;
use std::f64::consts::TAU;
use std::path::Path;
use toml::Spanned;

/// A log's columns, and what a map says of them.
pub(crate) struct Lookup<'a> {
    pub path: &'a Path,
    /// Where the columns' names stand; follows the path in a message.
    pub header: &'a str,
    pub columns: &'a [Column],
    pub map: Option<&'a LogMap>,
    /// The joints asked for.
    pub joints: &'a [String],
}

/// One signal of one joint or motor in a map.
struct Entry<'a> {
    map: &'a LogMap,
    raw: &'a Spanned<RawSignal>,
    drive: Drive,
    signal: Signal,
    /// `joint` or `motor`, and its name.
    table: &'static str,
    name: &'a str,
}

impl Entry<'_> {
    fn wrong(&self, key: &str, what: impl Into<String>) -> LogError {
        let dot = if key.is_empty() { "" } else { "." };
        let key = format!("{}.{}.{}{dot}{key}", self.table, self.name, self.signal.name());
        MapError::new(&self.map.path, &self.map.text, self.raw.span().start, key, what).into()
    }

    /// A constant of the drive that must be there and above zero.
    fn constant(&self, key: &str, value: Option<f64>, why: &str) -> Result<f64, LogError> {
        match value {
            Some(value) if value > 0.0 && value.is_finite() => Ok(value),
            Some(value) => Err(self.wrong(
                key,
                format!("{value} is not above zero; write its magnitude, and the direction as sign = -1"),
            )),
            None => Err(self.wrong(key, format!("`{key}` is missing, which {why}"))),
        }
    }

    /// Factor and offset from what is logged to SI at the joint.
    fn conversion(&self) -> Result<(f64, f64), LogError> {
        let raw = self.raw.get_ref();
        let unit = match &raw.unit {
            None => Unit::Si(1.0),
            Some(name) => Unit::named(name, self.signal).ok_or_else(|| {
                self.wrong(
                    "unit",
                    format!(
                        "`{name}` is no unit of {}; write one of {}",
                        self.signal.name(),
                        Unit::names(self.signal)
                    ),
                )
            })?,
        };
        let drive = &self.drive;
        let of_current = "turns a current into a torque";
        let torque_constant =
            || self.constant("torque_constant_nm_per_a", drive.torque_constant_nm_per_a, of_current);
        let factor = match unit {
            Unit::Si(factor) => factor,
            Unit::Kelvin => 1.0,
            Unit::Ticks => {
                TAU / self.constant("ticks_per_rev", drive.ticks_per_rev, "turns ticks into an angle")?
            }
            Unit::Current(ampere) => ampere * torque_constant()?,
            Unit::OfRated(share) => match (drive.rated_torque_nm, drive.rated_current_a) {
                (None, Some(_)) => {
                    share
                        * self.constant("rated_current_a", drive.rated_current_a, "100 % stands for")?
                        * torque_constant()?
                }
                _ => {
                    share
                        * self.constant(
                            "rated_torque_nm",
                            drive.rated_torque_nm,
                            "100 % stands for (or `rated_current_a`)",
                        )?
                }
            },
        };
        let of_motor = matches!(unit, Unit::Current(_) | Unit::OfRated(_));
        let side = raw.side.unwrap_or(if of_motor { Side::Motor } else { Side::Joint });
        let transmission = match (side, self.signal) {
            (Side::Joint, _) | (_, Signal::Temperature) => 1.0,
            (Side::Motor, signal) => {
                let why = "turns what is measured at the motor into the joint's; write 1.0 for a direct drive, or side = \"joint\"";
                let gear = self.constant("gear", drive.gear, why)?;
                match signal {
                    Signal::Torque | Signal::Command => {
                        gear * drive
                            .efficiency
                            .map_or(Ok(1.0), |efficiency| self.constant("efficiency", Some(efficiency), ""))?
                    }
                    _ => 1.0 / gear,
                }
            }
        };
        let sign = match raw.sign {
            None => 1.0,
            Some(sign) if sign.abs() == 1.0 => sign,
            Some(sign) => {
                return Err(
                    self.wrong("sign", format!("{sign} is no sign; write 1 or -1, and a factor as `scale`"))
                );
            }
        };
        let scale = match raw.scale {
            None => 1.0,
            Some(scale) if scale.is_finite() && scale != 0.0 => scale,
            Some(scale) => return Err(self.wrong("scale", format!("{scale} is no factor"))),
        };
        let offset = raw.offset.unwrap_or(0.0);
        if !offset.is_finite() {
            return Err(self.wrong("offset", format!("{offset} is no offset")));
        }
        let kelvin = if unit == Unit::Kelvin { -273.15 } else { 0.0 };
        Ok((sign * scale * factor * transmission, offset + kelvin))
    }
}

impl Lookup<'_> {
    /// The time.
    ///
    /// # Errors
    /// The map names a column that is not there, or a unit that is none.
    pub fn time(&self) -> Result<Option<Expression>, LogError> {
        let Some((map, raw)) = self.map.and_then(|map| Some((map, map.time.as_ref()?))) else {
            return self.by_name("t");
        };
        let wrong = |key: &str, what: String| -> LogError {
            MapError::new(&map.path, &map.text, raw.span().start, key, what).into()
        };
        let name = raw.get_ref().column.as_deref().unwrap_or("t");
        let column = self.by_name(name)?.ok_or_else(|| wrong("time", self.no_column(name)))?;
        let factor = match &raw.get_ref().unit {
            None => 1.0,
            Some(unit) => seconds(unit).ok_or_else(|| {
                wrong("time.unit", format!("`{unit}` is no unit of time; write s, ms, us or ns"))
            })?,
        };
        Ok(Some(scaled(column, factor, 0.0)))
    }

    /// A signal of a joint; `None` where the log has none.
    ///
    /// # Errors
    /// The map names a column that is not there, or leaves out what a unit needs.
    pub fn signal(&self, signal: Signal, joint: &str) -> Result<Option<Expression>, LogError> {
        let Some(map) = self.map else { return self.unmapped(signal, joint) };
        let coupling = map.couplings.iter().find(|coupling| coupling.joints.iter().any(|name| name == joint));
        if let Some(coupling) = coupling
            && let Some(sum) = self.coupled(map, coupling, signal, joint)?
        {
            return Ok(Some(sum));
        }
        let own = map.joints.iter().find(|(name, _)| name.get_ref() == joint).map(|(_, raw)| raw);
        match self.entry(map, own, "joint", signal, joint) {
            Some(entry) => self.of_entry(&entry, joint).map(Some),
            None => self.unmapped(signal, joint),
        }
    }

    fn entry<'m>(
        &self,
        map: &'m LogMap,
        own: Option<&'m RawJoint>,
        table: &'static str,
        signal: Signal,
        name: &'m str,
    ) -> Option<Entry<'m>> {
        let every = map.every_joint.as_ref();
        let of_all = if table == "joint" { every.and_then(|every| every.signal(signal)) } else { None };
        let raw = own.and_then(|own| own.signal(signal)).or(of_all)?;
        let drives = [Some(raw.get_ref().drive), own.map(RawJoint::drive), every.map(RawJoint::drive)];
        let drive = drives.into_iter().flatten().reduce(Drive::or).unwrap_or_default();
        Some(Entry { map, raw, drive, signal, table, name })
    }

    /// A joint's signal from those of the motors that move it.
    fn coupled(
        &self,
        map: &LogMap,
        coupling: &Coupling,
        signal: Signal,
        joint: &str,
    ) -> Result<Option<Expression>, LogError> {
        let matrix = match signal {
            Signal::Torque | Signal::Command => &coupling.torques,
            Signal::Temperature => return Ok(None),
            _ => &coupling.matrix,
        };
        let row = coupling.joints.iter().position(|name| name == joint);
        let Some(row) = row.map(|row| &matrix[row]) else { return Ok(None) };
        let mut terms = Vec::new();
        let mut absent = None;
        for (motor, &factor) in coupling.motors.iter().zip(row) {
            let Some((span, own)) = map.motors.iter().find(|(name, _)| name.get_ref() == motor) else {
                continue;
            };
            match self.entry(map, Some(own), "motor", signal, motor) {
                Some(entry) => terms.push((factor, self.of_entry(&entry, motor)?)),
                None => absent = Some((motor, span.span().start)),
            }
        }
        if let Some((motor, at)) = absent.filter(|_| !terms.is_empty()) {
            let key = format!("motor.{motor}.{}", signal.name());
            let what = "is missing, but the other motors of its coupling have it; write its column";
            return Err(MapError::new(&map.path, &map.text, at, key, what).into());
        }
        terms.retain(|(factor, _)| *factor != 0.0);
        Ok((!terms.is_empty()).then_some(Expression::Sum(terms)))
    }

    fn of_entry(&self, entry: &Entry<'_>, name: &str) -> Result<Expression, LogError> {
        let (factor, offset) = entry.conversion()?;
        let raw = entry.raw.get_ref();
        let forms = [raw.column.is_some(), raw.pd.is_some(), raw.load.is_some()];
        if forms.iter().filter(|has| **has).count() > 1 {
            return Err(entry.wrong("", "has more than one of `column`, `pd` and `load`; leave one"));
        }
        let of_torque = raw.pd.is_some() || raw.load.is_some();
        if of_torque && entry.signal != Signal::Torque {
            return Err(entry.wrong("", "`pd` and `load` are of torques (tau) only"));
        }
        if let Some(load) = &raw.load {
            let Some(sign) = &raw.sign_of else {
                return Err(entry.wrong("sign_of", "is missing: name the column whose sign the load has"));
            };
            let column = |key, column| self.named(entry, key, column, name).map(Box::new);
            let load =
                Expression::LoadWithSign { load: column("load", load)?, sign: column("sign_of", sign)? };
            return with_offset(entry, load, factor, offset);
        }
        if let Some(pd) = &raw.pd {
            let signal = |signal| Ok::<_, LogError>(self.signal(signal, name)?.map(Box::new));
            let needed = |which, found: Option<Box<Expression>>| {
                found.ok_or_else(|| {
                    entry.wrong("pd", format!("it needs the {which}, which neither the map nor the log has"))
                })
            };
            let column = |key, column: &Option<String>| {
                let column = column.as_ref().map(|column| self.named(entry, key, column, name).map(Box::new));
                column.transpose()
            };
            let qd = signal(Signal::Velocity)?;
            let law = Expression::ProportionalDerivative {
                kp: pd.kp,
                kd: pd.kd,
                q_ref: needed("reference (qref)", signal(Signal::Reference)?)?,
                q: needed("position (q)", signal(Signal::Position)?)?,
                qd: if pd.kd == 0.0 { None } else { Some(needed("velocity (qd)", qd)?) },
                qd_ref: column("pd.reference_velocity", &pd.reference_velocity)?,
                feedforward: column("pd.feedforward", &pd.feedforward)?,
            };
            return with_offset(entry, law, factor, offset);
        }
        let column = match &raw.column {
            Some(column) => self.named(entry, "column", column, name)?,
            None => self.unmapped(entry.signal, name)?.ok_or_else(|| {
                entry.wrong("column", self.no_column(&format!("{}.{name}", entry.signal.name())))
            })?,
        };
        Ok(scaled(column, factor, offset))
    }

    /// A column that the map names, with its placeholders filled in.
    fn named(&self, entry: &Entry<'_>, key: &str, column: &str, name: &str) -> Result<Expression, LogError> {
        let mut wanted = column.replace("{joint}", name);
        if wanted.contains("{index}") {
            let Some(index) = entry.map.order.iter().position(|joint| joint == name) else {
                return Err(entry.wrong(
                    key,
                    "{index} counts in the list `joints` of the map, which lacks this joint; add it",
                ));
            };
            wanted = wanted.replace("{index}", &index.to_string());
        }
        self.by_name(&wanted)?.ok_or_else(|| entry.wrong(key, self.no_column(&wanted)))
    }

    /// A signal under its own name, under that of its format, or as an array with an entry for each joint.
    fn unmapped(&self, signal: Signal, joint: &str) -> Result<Option<Expression>, LogError> {
        let name = format!("{}.{joint}", signal.name());
        if let Some(column) = self.by_name(&name)? {
            return Ok(Some(column));
        }
        let Some(index) = self.joints.iter().position(|name| name == joint) else { return Ok(None) };
        match (self.is_array_of_joints(signal), self.joints.len()) {
            (true, _) => self.by_name(&format!("{}[{index}]", signal.name())),
            (false, 1) => self.by_name(signal.name()),
            _ => Ok(None),
        }
    }

    /// Whether there is an array with as many entries as there are joints.
    pub fn is_array_of_joints(&self, signal: Signal) -> bool {
        let has = |index: usize| {
            let name = format!("{}[{index}]", signal.name());
            self.columns.iter().any(|column| column.name == name || column.signal.as_ref() == Some(&name))
        };
        has(self.joints.len().saturating_sub(1)) && !has(self.joints.len())
    }

    /// A column by its name in the file or by that of its signal.
    fn by_name(&self, name: &str) -> Result<Option<Expression>, LogError> {
        let named = |wanted: &dyn Fn(&Column) -> bool| {
            let mut found = self.columns.iter().enumerate().filter(|(_, column)| wanted(column));
            (found.next().map(|(index, _)| index), found.next().is_some())
        };
        let (mut found, mut again) = named(&|column| column.name == name);
        if found.is_none() {
            (found, again) = named(&|column| column.signal.as_deref() == Some(name));
        }
        if again {
            let header = self.header.to_owned();
            return Err(LogError::DuplicateColumn { path: self.path.into(), header, column: name.into() });
        }
        Ok(found.map(Expression::Column))
    }

    fn no_column(&self, name: &str) -> String {
        let names: Vec<String> = self.columns.iter().map(|column| column.name.clone()).collect();
        let mut like = nearest(name, &names);
        if like.is_empty() {
            like = names.into_iter().take(8).collect();
        }
        format!("{} has no column `{name}`; there are {}", self.path.display(), like.join(", "))
    }
}

/// scale · column + offset, or the column itself where that is the same.
fn scaled(column: Expression, scale: f64, offset: f64) -> Expression {
    match column {
        column if scale == 1.0 && offset == 0.0 => column,
        Expression::Column(column) => Expression::Scaled { column, scale, offset },
        other => Expression::Sum(vec![(scale, other)]),
    }
}

fn with_offset(
    entry: &Entry<'_>,
    term: Expression,
    factor: f64,
    offset: f64,
) -> Result<Expression, LogError> {
    if offset != 0.0 {
        return Err(entry.wrong("offset", "a torque of a law or a load has no offset; leave it out"));
    }
    Ok(if factor == 1.0 { term } else { Expression::Sum(vec![(factor, term)]) })
}
