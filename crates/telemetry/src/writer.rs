//! Writing logs.

use crate::LogError;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;

/// Which optional signals a written log has, besides `t` and `q`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct LogColumns {
    /// `tau.<joint>`.
    pub torque: bool,
    /// `qd.<joint>`.
    pub velocity: bool,
    /// `qdd.<joint>`.
    pub acceleration: bool,
    /// `temp.<joint>`.
    pub temperature: bool,
    /// `qref.<joint>`: what the controller was asked for.
    pub reference: bool,
    /// `tau_cmd.<joint>`: what it commanded.
    pub command: bool,
}

impl LogColumns {
    fn prefixes(self) -> impl Iterator<Item = &'static str> {
        let optional = [
            (self.torque, "tau"),
            (self.velocity, "qd"),
            (self.acceleration, "qdd"),
            (self.temperature, "temp"),
            (self.reference, "qref"),
            (self.command, "tau_cmd"),
        ];
        std::iter::once("q").chain(optional.into_iter().filter(|(has, _)| *has).map(|(_, prefix)| prefix))
    }
}

/// Writes a log row by row.
///
/// Numbers are written in the shortest form that reads back as the same `f64`; a value that is not finite
/// becomes an empty cell, a gap.
#[derive(Debug)]
pub struct LogWriter<W: Write> {
    out: W,
}

impl LogWriter<BufWriter<File>> {
    /// Creates (or replaces) the file at `path` and writes the header.
    ///
    /// # Errors
    /// [`LogError::Unwritable`].
    pub fn create(path: &Path, joints: &[String], columns: LogColumns) -> Result<Self, LogError> {
        let unwritable = |source| LogError::Unwritable { path: path.into(), source };
        let out = BufWriter::new(File::create(path).map_err(unwritable)?);
        LogWriter::new(out, joints, columns).map_err(unwritable)
    }
}

impl<W: Write> LogWriter<W> {
    /// Writes the header to `out`.
    ///
    /// # Errors
    /// What `out` fails with.
    pub fn new(mut out: W, joints: &[String], columns: LogColumns) -> std::io::Result<Self> {
        out.write_all(b"t")?;
        for prefix in columns.prefixes() {
            for joint in joints {
                write!(out, ",{prefix}.{joint}")?;
            }
        }
        out.write_all(b"\n")?;
        Ok(LogWriter { out })
    }

    /// Writes one row: the time, then the signals in the order `q`, `tau`, `qd`, `qdd`, `temp`, `qref`,
    /// `tau_cmd` (those that the log has), one value a joint each.
    ///
    /// # Errors
    /// What the output fails with.
    pub fn write(&mut self, t: f64, signals: &[&[f64]]) -> std::io::Result<()> {
        write!(self.out, "{t}")?;
        for value in signals.iter().copied().flatten() {
            self.out.write_all(b",")?;
            if value.is_finite() {
                write!(self.out, "{value}")?;
            }
        }
        self.out.write_all(b"\n")
    }

    /// Writes out what is buffered and gives the output back.
    ///
    /// # Errors
    /// What the output fails with.
    pub fn finish(mut self) -> std::io::Result<W> {
        self.out.flush()?;
        Ok(self.out)
    }
}
