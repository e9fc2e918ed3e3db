//! Whether a log counts a robot's joints as its URDF does: which way a joint turns, which way its torque
//! acts, which column is whose, whether torques carry the robot's weight.
//!
//! A joint that turns the other way in a log than in the URDF is no missing effect, and no effect describes
//! it: it has to be said before anything is looked for. Bodies that hang on several joints tell: read as it
//! is meant, a rigid body with friction leaves far less of all torques.

mod reading;
mod rough_fit;
mod samples;

pub use reading::ConventionKind;

use crate::IdentificationError;
use crate::identify::Data;
use phiw_dynamics::Tree;
use phiw_regressor::{BaseParameters, BaseParametersOptions};
use rayon::prelude::*;
use reading::{Reading, alternatives};
use rough_fit::{Left, left};
use samples::Samples;

/// How a log is read otherwise.
///
/// At the default gain nothing is said of 45 right models, 62 with missing effects and six real robots (`cargo
/// xtask undeclared --suite SUITE --seeds dev --generate DIR`, each through `phiw identify`). They reached 0.51
/// while it was chosen; what the tests change in a log gave 2 and more.
#[derive(Clone, Copy, Debug)]
pub struct ConventionSettings {
    /// Rows for each unknown number.
    pub rows_per_unknown: usize,
    /// What must be left of some torque (RMS, a share of it) for the log to be read otherwise.
    pub least_left: f64,
    /// By how much the sum of the logarithms of what is left of the torques (RMS) must fall.
    pub least_gain: f64,
}

impl Default for ConventionSettings {
    fn default() -> Self {
        ConventionSettings { rows_per_unknown: 12, least_left: 0.05, least_gain: 1.0 }
    }
}

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
    let base = BaseParameters::of_tree(tree, BaseParametersOptions::default())?;
    let unknowns = base.count() + 5 * joints;
    let samples = Samples::of(data, joints, settings.rows_per_unknown * unknowns / joints)?;
    if samples.len() * joints < 3 * unknowns {
        return Ok(Vec::new());
    }
    let mut reading = Reading::as_named(joints);
    let mut present = left(tree, &base, &samples, &reading)?;
    let mean = |left: &Left| (left.total() / joints as f64).exp();
    let left_as_named = mean(&present);
    let mut found: Vec<Convention> = Vec::new();
    while found.len() < 2 * joints {
        let is_good = present.relative.iter().all(|relative| *relative <= settings.least_left);
        let mut others = alternatives(tree);
        others.retain(|(kind, _)| !is_good || *kind == ConventionKind::AllTorqueSigns);
        others.retain(|(kind, joints)| found.iter().all(|old| (old.kind, &old.joints) != (*kind, joints)));
        if !is_good {
            others.extend(present.scales.iter().enumerate().filter_map(|(joint, scale)| {
                let scale = (*scale)?.recip();
                let is_other = scale > 0.0 && scale.ln().abs() > LEAST_SCALE.ln();
                is_other.then_some((ConventionKind::TorqueScale(scale), vec![joint]))
            }));
        }
        let left_if = |reading: &Reading| left(tree, &base, &samples, reading);
        let tried: Vec<(ConventionKind, Left)> = others
            .par_iter()
            .map(|(kind, joints)| match *kind {
                ConventionKind::TorqueScale(scale) => scaled(&reading, joints[0], scale, left_if),
                kind => Ok((kind, left_if(&reading.with(kind, joints))?)),
            })
            .collect::<Result<_, IdentificationError>>()?;
        let best =
            tried.into_iter().zip(others).min_by(|((_, a), _), ((_, b), _)| a.total().total_cmp(&b.total()));
        let Some(((kind, left), (_, on))) = best else { break };
        if present.total() - left.total() < settings.least_gain {
            break;
        }
        reading = reading.with(kind, &on);
        found.push(Convention { kind, joints: on, left_as_named, left: mean(&left) });
        present = left;
    }
    Ok(found)
}

/// The scale of a torque, found in a few steps from a first one: as long as it is wrong it disturbs what the
/// others tell of it.
fn scaled(
    reading: &Reading,
    joint: usize,
    first: f64,
    left_if: impl Fn(&Reading) -> Result<Left, IdentificationError>,
) -> Result<(ConventionKind, Left), IdentificationError> {
    let mut kind = ConventionKind::TorqueScale(first);
    let mut left = left_if(&reading.with(kind, &[joint]))?;
    let mut scale = first;
    for _ in 1..SCALE_STEPS {
        let Some(factor) = left.scales[joint].filter(|factor| *factor > 0.0) else { break };
        scale /= factor;
        let next = left_if(&reading.with(ConventionKind::TorqueScale(scale), &[joint]))?;
        if next.total() >= left.total() {
            break;
        }
        (kind, left) = (ConventionKind::TorqueScale(scale), next);
    }
    Ok((kind, left))
}

/// Steps to find a scale.
const SCALE_STEPS: usize = 4;
/// A torque is in another unit from this factor on; below it is a gain.
const LEAST_SCALE: f64 = 2.0;
