//! Whether a log counts a robot's joints as its URDF does: which way a joint turns, which way its torque
//! acts, which column is whose, in which unit torques are, and which way gravity points.
//!
//! A joint that turns the other way in a log than in the URDF is no missing effect, and no effect describes
//! it: it has to be said before anything is looked for. Bodies that hang on several joints tell: read as it
//! is meant, a rigid body with friction leaves far less of all torques.

mod mounting;
mod reading;
mod rough_fit;
mod samples;
mod scales;
mod settings;

pub use reading::ConventionKind;
pub use settings::{ConventionSettings, UnknownConventionSetting};

use crate::IdentificationError;
use crate::identify::Data;
use phiw_dynamics::Tree;
use phiw_regressor::{BaseParameters, BaseParametersOptions};
use rayon::prelude::*;
use reading::{Reading, alternatives};
use rough_fit::{Fitted, Left, fitted};
use samples::Samples;

/// A difference between a log and the URDF.
#[derive(Clone, Debug, PartialEq)]
pub struct Convention {
    /// What is different.
    pub kind: ConventionKind,
    /// On which joints; empty where it is all of them.
    pub joints: Vec<usize>,
    /// What a rigid body with friction leaves of the torques as they are (RMS, a share, geometric mean).
    pub left_as_named: f64,
    /// The same with this difference, and those before it, taken into account.
    pub left: f64,
}

/// A log's samples, to be read in one way or another.
struct Log<'a> {
    settings: &'a ConventionSettings,
    tree: &'a Tree,
    base: BaseParameters,
    samples: Samples,
}

impl Log<'_> {
    fn left_if(&self, reading: &Reading) -> Result<Left, IdentificationError> {
        Ok(self.fitted_if(reading)?.left)
    }

    fn fitted_if(&self, reading: &Reading) -> Result<Fitted, IdentificationError> {
        fitted(self.tree, &self.base, &self.samples, reading)
    }

    fn joints(&self) -> usize {
        self.samples.joints
    }
}

/// A difference that is tried.
struct Candidate {
    kind: ConventionKind,
    joints: Vec<usize>,
    left: Left,
}

impl Candidate {
    /// For how many differences it counts: one, or the numbers that were free.
    fn differences(&self) -> usize {
        match &self.kind {
            // A factor common to all changes nothing.
            ConventionKind::EachTorqueScale(scales) => scales.len().saturating_sub(1),
            ConventionKind::Mounting(_) => 2,
            _ => 1,
        }
    }
}

/// The differences between the training logs and the URDF, the greatest first; none in most cases, and none
/// for a robot with a floating base.
///
/// # Errors
/// A log cannot be read.
pub fn conventions(
    tree: &Tree,
    data: &Data<'_>,
    settings: &ConventionSettings,
) -> Result<Vec<Convention>, IdentificationError> {
    let joints = tree.joint_count();
    if tree.is_floating() || joints == 0 {
        return Ok(Vec::new());
    }
    let base = BaseParameters::of_tree(&mounting::askew(tree), BaseParametersOptions::default())?;
    let unknowns = base.count() + 5 * joints;
    let rows = settings.rows_per_unknown * unknowns as f64 / joints as f64;
    let samples = Samples::of(data, joints, rows as usize)?;
    if samples.len() * joints < 3 * unknowns {
        return Ok(Vec::new());
    }
    let log = Log { settings, tree, base, samples };
    let mut reading = Reading::as_named(tree);
    let mut present = log.left_if(&reading)?;
    let mean = |left: &Left| (left.total() / joints as f64).exp();
    let left_as_named = mean(&present);
    let mut found: Vec<Convention> = Vec::new();
    while found.len() < 2 * joints {
        let is_good = present.relative.iter().all(|relative| *relative <= settings.least_left);
        let is_new = |kind: &ConventionKind, joints: &[usize]| {
            found.iter().all(|old| old.kind != *kind || old.joints != joints)
        };
        let mut others = alternatives(tree);
        others.retain(|(kind, joints)| is_new(kind, joints));
        others.retain(|(kind, _)| !is_good || *kind == ConventionKind::AllTorqueSigns);
        let mut tried: Vec<Candidate> = others
            .into_par_iter()
            .map(|(kind, joints)| {
                let left = log.left_if(&reading.with(&kind, &joints))?;
                Ok(Candidate { kind, joints, left })
            })
            .collect::<Result<_, IdentificationError>>()?;
        if !is_good {
            tried.extend(scales::of_one(&log, &reading)?);
            tried.extend(scales::of_each(&log, &reading)?);
            tried.extend(mounting::mounted(&log, &reading)?);
        }
        let gain = |candidate: &Candidate| {
            present.total() - candidate.left.total() - settings.least_gain * candidate.differences() as f64
        };
        let Some(best) = tried.into_iter().max_by(|a, b| gain(a).total_cmp(&gain(b))) else { break };
        if gain(&best) < 0.0 {
            break;
        }
        reading = reading.with(&best.kind, &best.joints);
        let Candidate { kind, joints, left } = best;
        found.push(Convention { kind, joints, left_as_named, left: mean(&left) });
        present = left;
    }
    let has_units = found.iter().any(|found| matches!(found.kind, ConventionKind::EachTorqueScale(_)));
    if !has_units && let Some(scale) = scales::of_all(&log, &reading, &present)? {
        let kind = ConventionKind::AllTorqueScales(scale);
        found.push(Convention { kind, joints: Vec::new(), left_as_named, left: mean(&present) });
    }
    Ok(scales::merged(found, joints, settings))
}
