//! Constants in which the model is not linear, found to their error.

use super::robot::traced;

/// The place at which a stop begins and how it stiffens make up for each other. One after the other they
/// stayed on the way: a stop at 0.9 rad began at 0.912, with a power of 1.22 and not 1.3.
#[test]
fn constants_that_make_up_for_each_other_are_found_together() {
    for power in [1.0, 1.3] {
        let tracing = traced(11, &|state, torque| {
            torque[1] += 1.5 * ((state.q[1] - 0.9) / 0.3).max(0.0).powf(power);
        });
        let constants = &tracing.specs.iter().find(|spec| spec.kind == "end_stop").unwrap().constants;
        let exponent = constants.get("exponent").copied().unwrap_or(1.0);
        assert!((constants["stop"] - 0.9).abs() < 0.005, "{constants:?}");
        assert!((exponent - power).abs() < 0.04, "{constants:?}");
    }
}
