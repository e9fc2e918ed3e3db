//! Pinocchio, asked through files.

use super::answers::{QUANTITIES, States};
use super::case::Case;
use super::python::{Python, read_numbers};
use anyhow::Context;
use phiw_dynamics::Tree;
use serde::Serialize;
use std::path::Path;

/// Pinocchio's side of the comparison.
const SCRIPT: &str = include_str!("pinocchio_oracle.py");

/// Pinocchio, installed.
pub struct Oracle {
    python: Python,
    version: String,
}

/// What the script is told beside the states.
#[derive(Serialize)]
struct Request<'a> {
    urdf: &'a Path,
    floating_base: bool,
    held: &'a [(String, f64)],
    /// Joints that move by themselves, in the order of their coordinates.
    joints: Vec<&'a str>,
    /// The joint of each body, in the order of the bodies.
    bodies: Vec<&'a str>,
    states: usize,
}

impl Oracle {
    /// Pinocchio in an environment where it is installed.
    ///
    /// # Errors
    /// It is not there.
    pub fn new(python: Python) -> anyhow::Result<Self> {
        Ok(Oracle { version: python.version("pin")?, python })
    }

    /// Pinocchio's version.
    pub fn version(&self) -> &str {
        &self.version
    }

    /// Pinocchio's answers, one for each of [`QUANTITIES`]; `None` for the accelerations of a singular mass
    /// matrix.
    ///
    /// # Errors
    /// The script fails, or a file cannot be written or read.
    pub fn answers(
        &self,
        case: &Case,
        tree: &Tree,
        states: &States,
    ) -> anyhow::Result<Vec<Option<Vec<f64>>>> {
        let folder = tempfile::tempdir()?;
        let folder = folder.path();
        let request = Request {
            urdf: &case.urdf,
            floating_base: case.options.floating_base,
            held: &case.options.held,
            joints: tree.joint_names().collect(),
            bodies: tree.bodies().iter().map(|body| body.joint.as_str()).collect(),
            states: states.count,
        };
        std::fs::write(folder.join("case.json"), serde_json::to_string(&request)?)?;
        for (name, values) in [("q", &states.q), ("v", &states.v), ("a", &states.a), ("force", &states.force)]
        {
            let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
            std::fs::write(folder.join(name), bytes)?;
        }
        self.python
            .run(SCRIPT, [folder])
            .with_context(|| format!("Pinocchio fails on {} ({} base)", case.robot, case.base()))?;
        let answer = |name: &str| {
            let values = read_numbers(&folder.join(format!("{name}.pinocchio")))?;
            Ok((!(name == "aba" && values.is_empty())).then_some(values))
        };
        QUANTITIES.into_iter().map(answer).collect()
    }
}
