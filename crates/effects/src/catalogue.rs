//! The catalogue finds kinds of effects by name, and builds them from a model's file.

use crate::declaration::{cannot_act, joint_indices, nearest};
use crate::{Constants, EffectKind, FittedEffect, Mechanisms, Refinement, ServoFriction, SignalRanges};
use crate::{coupling, drift, drive, efficiency, elasticity, external, friction, friction_over_position};
use crate::{
    hysteresis, load_friction, logged_torque, position, position_map, sensing, torque_gain, torque_zero,
};
use phiw_codegen::JointTorque;
use phiw_dynamics::Tree;
use phiw_identification::effect::{EffectError, EffectParameter, JointProperty};
use phiw_identification::{Effect, EffectCatalogue, EffectSpec};

/// Kinds of effects by name, in the order of simplicity: of two that explain alike, the earlier is preferred.
pub struct Catalogue {
    kinds: Vec<Box<dyn EffectKind>>,
}

impl Default for Catalogue {
    /// All kinds that phiw knows.
    fn default() -> Self {
        Catalogue {
            kinds: vec![
                Box::new(friction::Viscous),
                Box::new(friction::Coulomb),
                Box::new(drive::TorqueOffset),
                Box::new(drive::RotorInertia),
                Box::new(torque_gain::TorqueGain),
                Box::new(friction::Asymmetric),
                Box::new(friction::Quadratic),
                Box::new(friction::Stribeck),
                Box::new(load_friction::LoadDependent),
                Box::new(position::JointSpring),
                Box::new(position::GravityBalancer),
                Box::new(position::TorqueRipple),
                Box::new(position::EndStop),
                Box::new(coupling::TransmissionCoupling),
                Box::new(logged_torque::TimeDelay),
                Box::new(sensing::EncoderOffset),
                Box::new(sensing::ActuatorSaturation),
                Box::new(hysteresis::Hysteresis),
                Box::new(drift::ThermalDrift),
                Box::new(elasticity::JointElasticity),
                Box::new(external::GravityTilt),
                Box::new(external::Payload),
                Box::new(external::ExternalForce),
                Box::new(efficiency::DriveEfficiency),
                Box::new(position_map::PositionMap),
                Box::new(friction_over_position::FrictionOverPosition),
                Box::new(logged_torque::TorqueSmoothing),
                Box::new(torque_zero::TorqueZeroByLog),
                Box::new(logged_torque::ClockDrift),
            ],
        }
    }
}

impl Catalogue {
    /// The same with a kind of the user's own.
    pub fn with(mut self, kind: impl EffectKind + 'static) -> Self {
        self.kinds.push(Box::new(kind));
        self
    }

    /// All kinds.
    pub fn kinds(&self) -> impl Iterator<Item = &dyn EffectKind> {
        self.kinds.iter().map(Box::as_ref)
    }

    /// Constants to try first for an effect on the joints of `spec` ([`EffectKind::scan`]).
    ///
    /// # Errors
    /// Its kind or a joint is unknown.
    pub fn scanned(
        &self,
        spec: &EffectSpec,
        tree: &Tree,
        ranges: &SignalRanges,
    ) -> Result<Vec<Constants>, EffectError> {
        let site = joint_indices(&spec.kind, &spec.joints, tree)?;
        Ok(self.kind(&spec.kind)?.scan(&site, ranges))
    }

    /// Constants near those of an effect ([`EffectKind::refine`]).
    ///
    /// # Errors
    /// Its kind or a joint is unknown.
    pub fn refined(
        &self,
        spec: &EffectSpec,
        tree: &Tree,
        ranges: &SignalRanges,
        step: usize,
    ) -> Result<Vec<Constants>, EffectError> {
        let site = joint_indices(&spec.kind, &spec.joints, tree)?;
        let from = Refinement { found: &spec.constants, site: &site, ranges, step };
        Ok(self.kind(&spec.kind)?.refine(&from))
    }

    /// The place of a kind in the order of simplicity; none for one that is unknown here.
    pub fn rank(&self, name: &str) -> Option<usize> {
        self.kinds().position(|kind| kind.name() == name)
    }

    /// A kind by its name.
    ///
    /// # Errors
    /// There is none of that name; the error knows the nearest.
    pub fn kind(&self, name: &str) -> Result<&dyn EffectKind, EffectError> {
        self.kinds().find(|kind| kind.name() == name).ok_or_else(|| {
            let known: Vec<String> = self.kinds().map(|kind| kind.name().to_owned()).collect();
            let nearest = nearest(name, &known);
            EffectError::UnknownKind { kind: name.to_owned(), nearest, known }
        })
    }

    /// What in a simulator's model does what an effect does, with its fitted values; nothing for a kind that
    /// is unknown here.
    pub fn mechanisms(
        &self,
        spec: &EffectSpec,
        parameters: &[EffectParameter],
        fitted: &[f64],
    ) -> Mechanisms {
        let found = FittedEffect::new(spec, parameters, fitted);
        self.kind(&spec.kind).map(|kind| kind.mechanisms(&found)).unwrap_or_default()
    }

    /// What an effect is among the frictions of a servo's model; none for most.
    pub fn servo_friction(
        &self,
        spec: &EffectSpec,
        parameters: &[EffectParameter],
        fitted: &[f64],
    ) -> Option<ServoFriction> {
        let found = FittedEffect::new(spec, parameters, fitted);
        self.kind(&spec.kind).ok().and_then(|kind| kind.servo_friction(&found))
    }

    /// The torques that an effect adds as formulas of the present motion, with its fitted values; none for
    /// one that needs more, and for a kind that is unknown here.
    pub fn formulas(
        &self,
        spec: &EffectSpec,
        parameters: &[EffectParameter],
        fitted: &[f64],
    ) -> Vec<JointTorque> {
        let found = FittedEffect::new(spec, parameters, fitted);
        self.kind(&spec.kind).map(|kind| kind.formulas(&found)).unwrap_or_default()
    }

    /// What an effect means, with its fitted values; a kind that is unknown here gets its name and numbers.
    pub fn sentence(&self, spec: &EffectSpec, parameters: &[EffectParameter], fitted: &[f64]) -> String {
        let found = FittedEffect::new(spec, parameters, fitted);
        self.kind(&spec.kind).map_or_else(|_| found.plainly(), |kind| kind.sentence(&found))
    }
}

impl EffectCatalogue for Catalogue {
    fn build(&self, spec: &EffectSpec, tree: &Tree) -> Result<Box<dyn Effect>, EffectError> {
        let kind = self.kind(&spec.kind)?;
        let site = joint_indices(&spec.kind, &spec.joints, tree)?;
        if !kind.accepts(tree, &site) {
            return Err(cannot_act(kind, tree, &spec.joints));
        }
        Ok(kind.build(tree, &site, &spec.constants))
    }

    fn joint_property(&self, spec: &EffectSpec) -> Option<JointProperty> {
        self.kind(&spec.kind).ok()?.joint_property()
    }
}

/// What an effect of [`Catalogue::default`] means, with its fitted values; kinds that it does not know get
/// their name and numbers.
pub fn sentence(spec: &EffectSpec, parameters: &[EffectParameter], fitted: &[f64]) -> String {
    Catalogue::default().sentence(spec, parameters, fitted)
}
