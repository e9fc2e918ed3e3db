//! Whole methods: the paper's as printed, and ours; and what is chosen where none is named.

use super::arguments::{Method, PriorName, RelaxationName, RunArguments};
use super::motions::Source;
use super::subject::Subject;
use phiw_curriculum::relaxation::{ConditionRelaxation, Maximum, Relaxation, Scale, UncertaintyRelaxation};
use phiw_simulated_robot::Encoders;

/// Bits of the encoders of a robot that nobody knows, and their period over the commands'.
const ENCODER_BITS: u8 = 17;
const ENCODER_SHARE: f64 = 0.1;
/// Equation (20) with the numbers of section 5.2.2.
const PRINTED: ConditionRelaxation =
    ConditionRelaxation { maximum: Maximum::Fixed(0.74), scale: Scale::Fixed(2.5e-4), bias: 1.0 };
/// What the estimate falls back on and what α follows, unless they are asked for. The paper's robot is
/// excited well, and its method is the paper's.
pub fn method(arguments: &RunArguments, subject: &Subject) -> (PriorName, RelaxationName) {
    let (prior, relaxation) = match subject.standing {
        Some(_) => (PriorName::Initial, RelaxationName::Uncertainty),
        None => (PriorName::None, RelaxationName::Condition),
    };
    (arguments.prior.unwrap_or(prior), arguments.relaxation.unwrap_or(relaxation))
}

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
