//! Effects of measurement and drive on position and torque: encoder offset, saturation.

use crate::columns::{Formula, OwnTorque, ParameterKind};
use crate::fitted::FittedEffect;
use crate::kind::{Constants, EffectKind, Refinement, Signal, SignalRanges, constant};
use phiw_dynamics::{JointType, Tree};
use phiw_identification::effect::{EffectParameter, Entry, Evaluator, Needs, Sample};
use phiw_identification::{Effect, EffectSpec};
use phiw_telemetry::Block;

/// The true angle is q + δ. Linear in δ about the value that has been corrected for already.
pub struct EncoderOffset;

const OFFSET: &str = "offset";

impl EffectKind for EncoderOffset {
    fn name(&self) -> &str {
        "encoder_offset"
    }
    fn telling_motion(&self) -> &'static str {
        "rests in many poses of the joint and of those behind it"
    }
    fn sentence(&self, found: &FittedEffect<'_>) -> String {
        let offset = found.in_unit_of(0, found.constant(OFFSET) + found.value(0));
        format!("The zero of {}'s encoder is off by {offset}.", found.joints())
    }
    fn seen_against(&self) -> Signal {
        Signal::Position
    }
    fn build(&self, tree: &Tree, site: &[usize], constants: &Constants) -> Box<dyn Effect> {
        let unit = if tree.joint(site[0]).joint_type == JointType::Prismatic { "m" } else { "rad" };
        Box::new(Offset {
            joint: site[0],
            joints: tree.joint_count(),
            offset: constant(constants, OFFSET, 0.0),
            unit,
            spec: spec(self.name(), tree, site, constants),
        })
    }
}

#[derive(Clone)]
struct Offset {
    joint: usize,
    joints: usize,
    offset: f64,
    unit: &'static str,
    spec: EffectSpec,
}

impl Effect for Offset {
    fn spec(&self) -> EffectSpec {
        self.spec.clone()
    }
    fn parameters(&self) -> Vec<EffectParameter> {
        let joint = self.spec.joints.first().cloned().unwrap_or_default();
        // A joint that turns is off by half a turn at most, what is in force counted; where the torque hardly
        // depends on its angle, a fit would say anything.
        let most = if self.unit == "rad" { std::f64::consts::PI } else { f64::INFINITY };
        let bounds = (-most - self.offset, most - self.offset);
        vec![EffectParameter { joint, name: OFFSET.to_owned(), unit: self.unit.to_owned(), bounds }]
    }
    fn entries(&self) -> Vec<Entry> {
        (0..self.joints).map(|row| Entry { row, parameter: 0 }).collect()
    }
    fn needs(&self) -> Needs {
        Needs { torque: true, derivatives: true, ..Needs::default() }
    }
    fn evaluator(&self) -> Box<dyn Evaluator + '_> {
        Box::new(OffsetColumns(self))
    }
    fn correct(&self, block: &mut Block) {
        block
            .q
            .iter_mut()
            .skip(self.joint)
            .step_by(self.joints)
            .for_each(|position| *position += self.offset);
    }
    fn relinearised(&self, fitted: &[f64]) -> Option<Box<dyn Effect>> {
        let offset = self.offset + fitted.first().copied().unwrap_or_default();
        Some(Box::new(Offset { offset, spec: self.spec.clone().with(OFFSET, offset), ..self.clone() }))
    }
}

struct OffsetColumns<'a>(&'a Offset);

impl Evaluator for OffsetColumns<'_> {
    fn evaluate(&mut self, sample: &Sample<'_>, columns: &mut [f64]) {
        let derivatives = sample.torque_by_position();
        for (row, column) in columns.iter_mut().enumerate() {
            *column = derivatives.get(row * self.0.joints + self.0.joint).copied().unwrap_or_default();
        }
    }
}

/// The logged torque is the commanded one; what is delivered clips at `limit`. The column is the part beyond
/// it, where the motion asks for the limit too: noise of the measured torque must not explain itself, and
/// what moves as only more than the limit can move it was not clipped. Where a command swings from one limit
/// to the other, the smoothed motion is late: for one period of its band after it was at the limit it may ask
/// for anything up to that. The parameter is one where the drive clips in truth.
pub struct ActuatorSaturation;

const LIMIT: &str = "limit";
/// The lowest limit that is plausible: the steps of refinement together once led below the torque's RMS.
const LEAST_LIMIT: &str = "least_limit";
/// The lowest limit over the one that a start has.
const LEAST_OF_START: f64 = 0.8;
/// Share of the limit that the model's torque reaches where the drive clips, and of the model's torque that
/// the limit reaches; the model was fitted with the clipping, and is not exact.
const REACHED: f64 = 0.9;
/// How far the peaks of noise stand out, in RMS of the filtered residual: those of a few thousand samples
/// reach four times their own RMS.
const NOISE_PEAK: f64 = 4.0;
/// What the share of the part beyond the limit that is missing may be.
const CLIPPED_SHARE: (f64, f64) = (0.8, 1.2);

impl EffectKind for ActuatorSaturation {
    fn name(&self) -> &str {
        "actuator_saturation"
    }
    fn scan(&self, site: &[usize], ranges: &SignalRanges) -> Vec<Constants> {
        // A level that most samples exceed is implausible for a drive, and its column would be the torque
        // itself.
        let range = ranges.joints[site[0]];
        // What exceeds it must be more than the noise that the measured torque holds.
        let beyond = (0.03 * range.torque_peak).max(NOISE_PEAK * range.residual_rms);
        let (lowest, highest) = (1.2 * range.torque_rms, range.torque_peak - beyond);
        if lowest >= highest {
            return Vec::new();
        }
        let step = (highest / lowest).powf(1.0 / 7.0);
        let with =
            |limit: f64| Constants::from([(LIMIT.to_owned(), limit), (LEAST_LIMIT.to_owned(), lowest)]);
        (0..8).map(|power| with(lowest * step.powi(power))).collect()
    }
    fn refine(&self, &Refinement { found, step, .. }: &Refinement<'_>) -> Vec<Constants> {
        let Some(&limit) = found.get(LIMIT) else { return Vec::new() };
        let spread = 0.04 * 0.5_f64.powi(step as i32);
        let least = constant(found, LEAST_LIMIT, 0.0);
        let near = [1.0 - spread, 1.0 + spread].map(|factor| limit * factor).into_iter();
        let with = |limit: f64| found.clone().into_iter().chain([(LIMIT.to_owned(), limit)]).collect();
        near.filter(|limit| *limit >= least).map(with).collect()
    }
    fn with_torque_limit(&self, limit: f64) -> Option<Constants> {
        let least = LEAST_OF_START * limit;
        Some(Constants::from([(LIMIT.to_owned(), limit), (LEAST_LIMIT.to_owned(), least)]))
    }
    fn telling_motion(&self) -> &'static str {
        "a motion that asks for more torque than the drive has"
    }
    fn sentence(&self, found: &FittedEffect<'_>) -> String {
        let (joint, limit) = (found.joints(), found.constant(LIMIT));
        format!("The drive of {joint} delivers no more than {limit:.3} N·m or N, whatever is commanded.")
    }
    fn seen_against(&self) -> Signal {
        Signal::Torque
    }
    fn build(&self, tree: &Tree, site: &[usize], constants: &Constants) -> Box<dyn Effect> {
        let (joint, limit) = (site[0], constant(constants, LIMIT, f64::INFINITY));
        let columns = BeyondLimit { joint, limit };
        let parameters = [("clipped_share", ParameterKind::Ratio, CLIPPED_SHARE.0)];
        let needs = Needs { total_torque: true, ..Needs::default() };
        let effect = OwnTorque::new(self.name(), tree, joint, constants, &parameters, columns);
        Box::new(effect.needing(needs).at_most(CLIPPED_SHARE.1))
    }
}

/// The column of an [`ActuatorSaturation`].
struct BeyondLimit {
    joint: usize,
    limit: f64,
}

impl Formula for BeyondLimit {
    /// When the drive was last at its limit.
    type Memory = Option<f64>;

    fn columns(&self, at_limit: &mut Self::Memory, sample: &Sample<'_>, columns: &mut [f64]) {
        let of_joint = |torques: &[f64]| torques.get(self.joint).copied().unwrap_or_default();
        let torque = of_joint(sample.tau());
        let beyond = (torque.abs() - self.limit).max(0.0);
        let of_motion = of_joint(sample.total_torque()) * torque.signum();
        columns[0] = 0.0;
        if beyond > 0.0 && REACHED * of_motion.abs() <= self.limit {
            if of_motion >= REACHED * self.limit {
                *at_limit = Some(sample.time_in_log());
            }
            let is_late = |at: f64| (sample.time_in_log() - at) * sample.motion_bandwidth_hz() <= 1.0;
            if at_limit.is_some_and(is_late) {
                columns[0] = torque.signum() * beyond;
            }
        }
    }
}

fn spec(kind: &str, tree: &Tree, site: &[usize], constants: &Constants) -> EffectSpec {
    let joints = site.iter().map(|&joint| tree.joint(joint).joint.clone()).collect();
    EffectSpec { kind: kind.to_owned(), joints, constants: constants.clone() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use phiw_dynamics::urdf::{UrdfOptions, read_urdf};
    use std::f64::consts::PI;

    /// An encoder was said to be off by 3.27 rad: the bound was about what was in force, not about nothing.
    #[test]
    fn an_encoder_is_off_by_half_a_turn_at_most_with_what_is_in_force() {
        let urdf = r#"<robot name="one"><link name="base"/><link name="arm"><inertial><mass value="1"/>
            <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
            <joint name="j" type="continuous"><parent link="base"/><child link="arm"/></joint></robot>"#;
        let tree = read_urdf(urdf, &UrdfOptions::default()).unwrap().tree;
        let offset = EncoderOffset.build(&tree, &[0], &Constants::new());
        assert_eq!(offset.parameters()[0].bounds, (-PI, PI));
        let moved = offset.relinearised(&[-2.0]).unwrap();
        assert_eq!(moved.parameters()[0].bounds, (2.0 - PI, 2.0 + PI));
    }
}
