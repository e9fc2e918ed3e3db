//! The sentence that explains a found effect to a user.

use phiw_identification::{EffectParameter, EffectSpec};

/// What an effect of the catalogue means, with its fitted values.
///
/// Kinds of a user's own get their name and numbers.
pub fn sentence(spec: &EffectSpec, parameters: &[EffectParameter], fitted: &[f64]) -> String {
    let value = |name: &str| {
        let place = parameters.iter().position(|parameter| parameter.name == name)?;
        Some(quantity(fitted[place], &parameters[place].unit))
    };
    let or_nothing =
        |name: &str, words: &str| value(name).map(|value| format!(", {value} {words}")).unwrap_or_default();
    let joints = spec.joints.join(" and ");
    let constant = |name: &str| spec.constants.get(name).copied().unwrap_or_default();
    let first = parameters
        .iter()
        .zip(fitted)
        .next()
        .map(|(info, value)| quantity(*value, &info.unit))
        .unwrap_or_default();
    match spec.kind.as_str() {
        "viscous_friction" => format!("{joints} has viscous friction of {first}."),
        "coulomb_friction" => format!("{joints} has Coulomb friction of {first}."),
        "torque_offset" => format!("The torque of {joints} is off by a constant {first}."),
        "rotor_inertia" => {
            format!("{joints} carries a rotor inertia of {first} that the links do not account for.")
        }
        "torque_gain" => format!("The torque of {joints} is measured {:+.1} % too large.", 100.0 * fitted[0]),
        "asymmetric_friction" => format!(
            "{joints} rubs differently in its two directions: half the difference is {}.",
            parameters
                .iter()
                .zip(fitted)
                .map(|(info, value)| quantity(*value, &info.unit))
                .collect::<Vec<_>>()
                .join(" and ")
        ),
        "quadratic_friction" => {
            format!("The friction of {joints} bends with the square of the speed: {first}.")
        }
        "stribeck_friction" => format!(
            "{joints} sticks at low speed: {first} on top of Coulomb friction, gone above {:.3} rad/s or m/s (Stribeck).",
            constant("stribeck_velocity")
        ),
        "load_dependent_friction" => {
            format!(
                "The friction of {joints} grows with its load: {:.3} of the torque that it carries.",
                fitted[0]
            )
        }
        "joint_spring" => format!("A spring pulls {joints} back: {first}."),
        "gravity_balancer" => format!(
            "{joints} is counterbalanced: up to {} as a sine of its angle.",
            quantity(fitted[0].hypot(fitted[1]), &parameters[0].unit)
        ),
        "torque_ripple" => format!(
            "The torque of {joints} ripples by {} with {:.2} periods a radian over 2π ({:.1} a turn).",
            quantity(fitted[0].hypot(fitted[1]), &parameters[0].unit),
            constant("periods") / std::f64::consts::TAU,
            constant("periods")
        ),
        "end_stop" => format!("{joints} runs into something stiff at {:.3}: {first}.", constant("stop")),
        "transmission_coupling" => {
            let parts = [
                ("fv_cross", "of coupled viscous friction"),
                ("fc_sum", "of friction with the sign of the sum of their speeds"),
                ("fc_difference", "of friction with the sign of the difference of their speeds"),
                ("Ia_cross", "of coupled inertia"),
                ("fv_of_second_on_first", "of viscous friction of the second on the first"),
                ("fv_of_first_on_second", "of viscous friction of the first on the second"),
                ("fc_of_second_on_first", "of Coulomb friction of the second on the first"),
                ("fc_of_first_on_second", "of Coulomb friction of the first on the second"),
            ];
            let parts: String = parts.iter().map(|(name, words)| or_nothing(name, words)).collect();
            format!("{joints} share a transmission: {}.", parts.trim_start_matches(", "))
        }
        "payload" => format!("The link behind {joints} carries {first} more than the model knows."),
        "gravity_tilt" => format!(
            "The base is not level: gravity leans by {:.2} degrees.",
            (fitted[0].hypot(fitted[1]) / 9.81).clamp(-1.0, 1.0).asin().to_degrees()
        ),
        "encoder_offset" => format!(
            "The zero of {joints}'s encoder is off by {}.",
            quantity(constant("offset") + fitted[0], &parameters[0].unit)
        ),
        "time_delay" => {
            format!("The torque of {joints} is stamped {:.2} ms late.", 1e3 * (constant("delay") + fitted[0]))
        }
        "hysteresis" => format!(
            "The torque of {joints} depends on the way since the last reversal: {first} over {:.4} rad or m.",
            constant("presliding")
        ),
        "thermal_drift" => {
            format!("The friction of {joints} falls as it warms up, over {:.0} s.", constant("time_constant"))
        }
        "external_force" => {
            format!("Something pulls at the link behind {joints} (a hose, a cable): {first} along x.")
        }
        "joint_elasticity" => {
            format!("The transmission of {joints} gives: {:.3e} {}.", fitted[0], parameters[0].unit)
        }
        "actuator_saturation" => format!(
            "The drive of {joints} delivers no more than {:.3} N·m or N, whatever is commanded.",
            constant("limit")
        ),
        kind => {
            let values = parameters
                .iter()
                .zip(fitted)
                .map(|(info, value)| format!("{} = {}", info.name, quantity(*value, &info.unit)));
            format!("{} on {joints}: {}.", kind.replace('_', " "), values.collect::<Vec<_>>().join(", "))
        }
    }
}

/// Three significant digits and the unit.
fn quantity(value: f64, unit: &str) -> String {
    let digits = if value == 0.0 { 0 } else { (2 - value.abs().log10().floor() as i32).clamp(0, 8) };
    format!("{value:.*} {unit}", digits as usize)
}
