//! Effects of the motor and its torque measurement: rotor inertia, offset.

use crate::columns::{OwnTorque, ParameterKind};
use crate::fitted::FittedEffect;
use crate::kind::{Constants, EffectKind, Signal};
use crate::mechanism::{Mechanism, Mechanisms};
use phiw_codegen::{Expression, JointTorque};
use phiw_dynamics::Tree;
use phiw_identification::Effect;
use phiw_identification::effect::{JointProperty, QuadraticForm, Sample};

/// Ia·q̈.
pub struct RotorInertia;

impl EffectKind for RotorInertia {
    fn name(&self) -> &str {
        "rotor_inertia"
    }
    fn may_change(&self) -> bool {
        true
    }
    fn telling_motion(&self) -> &'static str {
        "quick accelerations in several poses of the joints behind"
    }
    fn sentence(&self, found: &FittedEffect<'_>) -> String {
        let (joint, inertia) = (found.joints(), found.quantity(0));
        format!("{joint} carries a rotor inertia of {inertia} that the links do not account for.")
    }
    fn seen_against(&self) -> Signal {
        Signal::Acceleration
    }
    fn joint_property(&self) -> Option<JointProperty> {
        Some(JointProperty::Armature)
    }
    fn build(&self, tree: &Tree, site: &[usize], constants: &Constants) -> Box<dyn Effect> {
        let joint = site[0];
        let columns = move |sample: &Sample<'_>, out: &mut [f64]| out[0] = sample.qdd()[joint];
        let parameters = [("Ia", ParameterKind::Inertia, 0.0)];
        let effect = OwnTorque::new(self.name(), tree, joint, constants, &parameters, columns);
        Box::new(effect.linear_in_motion().in_form(QuadraticForm::KineticEnergy))
    }
}

/// A constant torque.
pub struct TorqueOffset;

impl EffectKind for TorqueOffset {
    fn name(&self) -> &str {
        "torque_offset"
    }
    fn may_change(&self) -> bool {
        true
    }
    fn telling_motion(&self) -> &'static str {
        "rests in several poses"
    }
    fn sentence(&self, found: &FittedEffect<'_>) -> String {
        format!("The torque of {} is off by a constant {}.", found.joints(), found.quantity(0))
    }
    /// The drive must ask for the offset, too, so that is what its motor takes off.
    fn mechanisms(&self, found: &FittedEffect<'_>) -> Mechanisms {
        motor(found, 1.0, -found.value(0))
    }
    fn formulas(&self, found: &FittedEffect<'_>) -> Vec<JointTorque> {
        found.own_torque(|_| Expression::Constant(found.value(0)))
    }
    fn seen_against(&self) -> Signal {
        Signal::Position
    }
    fn build(&self, tree: &Tree, site: &[usize], constants: &Constants) -> Box<dyn Effect> {
        let columns = move |_: &Sample<'_>, out: &mut [f64]| out[0] = 1.0;
        let parameters = [("offset", ParameterKind::Torque, f64::NEG_INFINITY)];
        Box::new(OwnTorque::new(self.name(), tree, site[0], constants, &parameters, columns))
    }
}

/// A motor of this gain and bias at the effect's joint.
pub(crate) fn motor(found: &FittedEffect<'_>, gain: f64, bias: f64) -> Mechanisms {
    let joint = found.joint_names().first().cloned().unwrap_or_default();
    Mechanisms::of(Mechanism::Motor { joint, gain, bias })
}
