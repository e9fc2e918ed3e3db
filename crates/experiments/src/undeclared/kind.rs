//! Names of effects: those of the fixed formats, and what lies outside them.

use serde::{Deserialize, Serialize};

/// An effect of the catalogue, named as in `report.json` and `--declare`.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, clap::ValueEnum,
)]
#[serde(rename_all = "snake_case")]
#[value(rename_all = "snake_case")]
#[allow(missing_docs, reason = "the names are the documentation; formats.md defines them")]
pub enum Kind {
    ViscousFriction,
    CoulombFriction,
    AsymmetricFriction,
    StribeckFriction,
    QuadraticFriction,
    LoadDependentFriction,
    RotorInertia,
    TorqueOffset,
    TorqueGain,
    JointSpring,
    GravityBalancer,
    TorqueRipple,
    TransmissionCoupling,
    Payload,
    GravityTilt,
    EncoderOffset,
    TimeDelay,
    Hysteresis,
    ThermalDrift,
    ExternalForce,
    EndStop,
    JointElasticity,
    ActuatorSaturation,
    PositionMap,
    DriveEfficiency,
    PositionDependentFriction,
}

/// An effect that no name of the catalogue fits.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, clap::ValueEnum,
)]
#[serde(rename_all = "snake_case")]
#[value(rename_all = "snake_case")]
pub enum Stranger {
    /// A sinusoid in time that has nothing to do with the motion.
    TimeSinusoid,
    /// A spring between two joints: k·(qᵢ + qⱼ) on both. The catalogue's coupling has had this form since.
    PositionCoupling,
    /// A cubic spring with a dead zone in mid-range.
    DeadZoneSpring,
    /// An offset that walks at random.
    RandomWalk,
    /// A torque sensor that reads zero below a threshold.
    SensorDeadBand,
    /// A load that is picked up in mid-log.
    LoadStep,
    /// A torque that follows the product of two joints' speeds.
    SpeedProduct,
    /// Friction that comes and goes around the turn. The catalogue has had a kind for it since.
    PositionFriction,
    /// Ripple that grows with the load: teeth that mesh badly, or a motor's commutation.
    LoadRipple,
    /// A torque constant that falls with the current, as iron saturates.
    FallingTorqueConstant,
    /// A torque constant that falls with the speed.
    SpeedGain,
    /// A torque sensor that also feels another joint's torque.
    Crosstalk,
    /// Friction that jumps in mid-log and stays: a brake that drags, a seal that slips.
    FrictionJump,
    /// Torques whose clock is not that of the positions: a delay that grows over each log. The catalogue has
    /// had a kind of this name since.
    ClockDrift,
    /// A cable or a hose that is stretched between a fixed point and a link: its pull depends on where the
    /// link is.
    Hose,
    /// A load that swings on a link: a liquid, a cable that hangs, a tool on rubber.
    SwingingLoad,
}

impl Stranger {
    /// Strangers that have a suite of their own: the cases of the others stay what they were.
    pub const NEW: [Stranger; 6] = [
        Stranger::LoadRipple,
        Stranger::FallingTorqueConstant,
        Stranger::SpeedGain,
        Stranger::Crosstalk,
        Stranger::FrictionJump,
        Stranger::ClockDrift,
    ];

    /// Those that came after these, in a suite of their own again.
    pub const LATER: [Stranger; 2] = [Stranger::Hose, Stranger::SwingingLoad];

    /// All others.
    pub fn of_other_suites() -> Vec<Stranger> {
        let all = <Stranger as clap::ValueEnum>::value_variants().iter();
        all.copied()
            .filter(|stranger| !Self::NEW.contains(stranger) && !Self::LATER.contains(stranger))
            .collect()
    }
}

/// What a secret is called.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(untagged)]
pub enum Name {
    /// An effect of the catalogue.
    Catalogue(Kind),
    /// One from outside.
    Outside(Stranger),
}

impl Kind {
    /// Kinds that have a suite of their own: the cases of the others stay what they were.
    pub const NEW: [Kind; 3] = [Kind::PositionMap, Kind::DriveEfficiency, Kind::PositionDependentFriction];

    /// All others.
    pub fn of_other_suites() -> Vec<Kind> {
        let all = <Kind as clap::ValueEnum>::value_variants().iter();
        all.copied().filter(|kind| !Kind::NEW.contains(kind)).collect()
    }

    /// The name in files.
    pub fn name(self) -> String {
        clap::ValueEnum::to_possible_value(&self)
            .map_or_else(String::new, |value| value.get_name().to_owned())
    }

    /// Whether a free identification of the rigid body swallows the effect, so that it can only be told
    /// against a held model.
    pub fn needs_held_model(self) -> bool {
        matches!(self, Kind::Payload | Kind::GravityTilt | Kind::EncoderOffset)
    }

    /// Whether it is also sought against a held model: something that changes in a robot's life.
    pub fn may_grow(self) -> bool {
        use Kind::*;
        matches!(
            self,
            ViscousFriction
                | CoulombFriction
                | TorqueGain
                | TimeDelay
                | ActuatorSaturation
                | TorqueOffset
                | ExternalForce
        )
    }

    /// Whether `self` on some joint contains `other` on the same joint as a special case, or the other way
    /// round, or the two are so much alike that finding one of them is right.
    pub fn is_nested_with(self, other: Kind) -> bool {
        use Kind::*;
        let group = |kinds: &[Kind]| kinds.contains(&self) && kinds.contains(&other);
        self == other
            || group(&[CoulombFriction, AsymmetricFriction, StribeckFriction, Hysteresis, ThermalDrift])
            || group(&[ViscousFriction, AsymmetricFriction, QuadraticFriction, ThermalDrift])
            || group(&[ViscousFriction, CoulombFriction, TransmissionCoupling])
            || group(&[RotorInertia, TransmissionCoupling, JointElasticity])
            || group(&[TorqueOffset, JointSpring, GravityBalancer, ExternalForce, GravityTilt])
            || group(&[CoulombFriction, LoadDependentFriction, DriveEfficiency])
            || group(&[CoulombFriction, PositionDependentFriction])
            || group(&[TorqueGain, DriveEfficiency])
            || (group(&[
                PositionMap,
                TorqueOffset,
                JointSpring,
                GravityBalancer,
                ExternalForce,
                TorqueRipple,
                EndStop,
            ]) && (self == PositionMap || other == PositionMap))
            || group(&[TorqueOffset, AsymmetricFriction])
            || group(&[JointSpring, EndStop, Hysteresis])
            || group(&[TimeDelay, JointElasticity, RotorInertia, ViscousFriction])
            || group(&[Payload, GravityTilt, EncoderOffset, ExternalForce, TorqueGain])
    }
}

impl Name {
    /// The name in files.
    pub fn name(self) -> String {
        match self {
            Name::Catalogue(kind) => kind.name(),
            Name::Outside(stranger) => clap::ValueEnum::to_possible_value(&stranger)
                .map_or_else(String::new, |value| value.get_name().to_owned()),
        }
    }
}
