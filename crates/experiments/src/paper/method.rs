//! Whole methods: the paper's as printed, and ours; and what is chosen where none is named.

use super::arguments::{Method, PriorName, RelaxationName, RunArguments};
use super::motions::Source;
use super::subject::Subject;
use phiw_curriculum::constraint::{FalseFalls, ZmpConstraint};
use phiw_curriculum::relaxation::{ConditionRelaxation, Maximum, Relaxation, Scale, UncertaintyRelaxation};
use phiw_simulated_robot::Encoders;
use phiw_zmp::Stance;

/// Bits of the encoders of a robot that nobody knows, and their period over the commands'.
const ENCODER_BITS: u8 = 17;
const ENCODER_SHARE: f64 = 0.1;
/// Equation (20) with the numbers of section 5.2.2.
const PRINTED: ConditionRelaxation =
    ConditionRelaxation { maximum: Maximum::Fixed(0.74), scale: Scale::Fixed(2.5e-4), bias: 1.0 };

/// How many times slower the slower motions of ours are.
const SLOWER: f64 = 2.0;
/// Time between the samples at which the ZMP is looked at \[s\], as in the paper.
const LOOK_EVERY_S: f64 = 0.02;

/// What the estimate falls back on and what α follows, unless they are asked for. The paper's robot is
/// excited well, and its method is the paper's.
pub fn method(arguments: &RunArguments, subject: &Subject) -> (PriorName, RelaxationName) {
    let (prior, relaxation) = match subject.standing {
        Some(_) => (PriorName::Initial, RelaxationName::Uncertainty),
        None => (PriorName::None, RelaxationName::Condition),
    };
    (arguments.prior.unwrap_or(prior), arguments.relaxation.unwrap_or(relaxation))
}

/// The rate of false falls that is asked for, if uncertainty counts. A robot on its feet has a noise under
/// them that no torque has, and is left out.
pub fn false_fall_rate(arguments: &RunArguments, subject: &Subject) -> Option<f64> {
    let ours = arguments.method == Some(Method::Ours) && subject.standing.is_none();
    arguments.false_fall_rate.or(ours.then(|| FalseFalls::default().rate))
}

/// How many times slower motions are done beside those as they were recorded.
pub fn slower(arguments: &RunArguments, subject: &Subject) -> Vec<f64> {
    let ours = arguments.method == Some(Method::Ours) && subject.standing.is_none();
    match arguments.slower.as_slice() {
        [] if ours => vec![SLOWER],
        given => given.to_vec(),
    }
}

/// The constraint (12): the paper's, or the one that counts what is not known. Until a log has told it, the
/// noise of the torques is the experiment's, as a share of their limits: what drives deliver is known.
pub fn constraint(stance: &Stance, false_fall_rate: Option<f64>, noise: f64) -> ZmpConstraint {
    match false_fall_rate {
        None => ZmpConstraint::of_the_paper(stance.clone()),
        Some(rate) => ZmpConstraint { period_s: LOOK_EVERY_S, ..ZmpConstraint::new(stance.clone()) }
            .counting(FalseFalls { unmeasured_noise: noise, ..FalseFalls::at_rate(rate) }),
    }
}

/// The motions in words.
pub fn motions_in_words(arguments: &RunArguments, subject: &Subject) -> &'static str {
    match (&arguments.motions, arguments.dataset) {
        (Some(_), _) => "of a folder",
        (None, Source::Embedded) if subject.standing.is_some() => {
            "embedded (synthetic), on synthetic legs that sway, squat and twist with both feet on the floor"
        }
        (None, Source::Embedded) => "embedded (synthetic)",
        (None, Source::UeAdl) => "ue_adl (measured on people)",
    }
}

/// What computes α.
pub fn relaxation(name: RelaxationName, method: Option<Method>) -> Box<dyn Relaxation> {
    match name {
        RelaxationName::Condition if method == Some(Method::Printed) => Box::new(PRINTED),
        RelaxationName::Condition => Box::new(ConditionRelaxation::default()),
        RelaxationName::Uncertainty => Box::new(UncertaintyRelaxation::default()),
    }
}

/// What measures the motion, if that is not the simulator itself.
pub fn encoders(method: Option<Method>, control_period_s: f64) -> Option<Encoders> {
    (method == Some(Method::Ours)).then(|| Encoders::new(ENCODER_BITS, ENCODER_SHARE * control_period_s))
}
