//! What a simulator's model has for an effect.

use phiw_effects::{Catalogue, Mechanism};
use phiw_identification::EffectSpec;
use phiw_identification::effect::EffectParameter;

fn mechanisms(spec: &EffectSpec, name: &str, value: f64) -> phiw_effects::Mechanisms {
    let parameter = EffectParameter {
        joint: "elbow".to_owned(),
        name: name.to_owned(),
        unit: String::new(),
        bounds: (f64::NEG_INFINITY, f64::INFINITY),
    };
    Catalogue::default().mechanisms(spec, &[parameter], &[value])
}

/// τ_log(t) = τ(t − d): with d < 0 the log is ahead of what acts, which is a command and a motor that is
/// late.
#[test]
fn a_torque_that_is_logged_before_it_acts_is_a_late_motor() {
    let spec = EffectSpec::new("time_delay", &["shoulder", "elbow"]).with("delay", -0.004);
    let found = mechanisms(&spec, "delay", -0.001);
    let late = |joint: &str| Mechanism::MotorDelay { joint: joint.to_owned(), delay: 0.005 };
    assert_eq!(found.parts, [late("shoulder"), late("elbow")]);
    assert!(found.left_out.is_empty());
    let logged_late = mechanisms(&spec, "delay", 0.009);
    assert!(logged_late.parts.is_empty() && logged_late.left_out.len() == 1);
}

#[test]
fn friction_says_within_which_speed_it_turns() {
    let spec = EffectSpec::new("coulomb_friction", &["elbow"]).with("sign_width", 0.02);
    let found = mechanisms(&spec, "fc", 3.0);
    assert!(matches!(found.parts[..], [Mechanism::Joint { value: 3.0, width: 0.02, .. }]), "{found:?}");
}
