//! How far an optimum can be: a bound that holds for the point itself, whatever way led there.

use crate::PARAMETERS_PER_BODY;
use crate::interior_point::State;
use crate::newton::{Equations, Frame, coordinates, dot};
use crate::small_matrix::Square;

/// Objective at the state's point less a lower bound of the optimum; infinite where nothing is proven.
///
/// With Z ⪰ 0 for each constraint X(x) ⪰ 0 and any ν, the Lagrangian L = f − Σ tr(ZX) + νᵀ(Ex − e) is nowhere
/// on the feasible set above f, so its unconstrained minimum is a lower bound. L is quadratic plus λ times
/// the self-concordant −log det, so that at a Newton decrement δ < 1 of L/λ it is at most λ(−δ − log(1 − δ))
/// above that minimum (Nesterov, "Introductory lectures on convex optimization", theorem 4.1.11).
pub(crate) fn gap(state: &State<'_>) -> f64 {
    let State { problem, weight, .. } = state;
    let Some(lowers) = state.bodies().iter().map(Square::cholesky).collect::<Option<Vec<Square>>>() else {
        return f64::INFINITY;
    };
    let mut gradient = state.misfit_gradient();
    let mut complementarity = 0.0;
    for (constraint, dual) in problem.constraints.iter().zip(&state.duals) {
        if dual.cholesky().is_none() {
            return f64::INFINITY;
        }
        complementarity += dual.dot(&constraint.value(&state.x));
        constraint.terms.iter().for_each(|(unknown, matrix)| gradient[*unknown] -= dual.dot(matrix));
    }
    let frame = Frame::new(lowers.iter());
    let mut gradient = frame.pull(&gradient);
    for (body, lower) in lowers.iter().enumerate() {
        let relative = lower.transposed().congruence(&problem.prior_inverses[body]);
        let prior = coordinates(&relative.plus(-1.0, &Square::identity(4)));
        let own = &mut gradient[PARAMETERS_PER_BODY * body..PARAMETERS_PER_BODY * (body + 1)];
        own.iter_mut().zip(prior).for_each(|(value, prior)| *value += weight * prior);
    }
    let Some(equations) = Equations::new(frame, &state.misfit_hessian(), *weight, &problem.equalities) else {
        return f64::INFINITY;
    };
    let missing = state.missing();
    let step = equations.step(&gradient, &vec![0.0; missing.len()]);
    let decrement = (-dot(&gradient, &step.coordinates) / weight).max(0.0).sqrt();
    let not_met: f64 = missing.iter().zip(&step.multipliers).map(|(missing, nu)| (missing * nu).abs()).sum();
    complementarity + not_met + weight * above_minimum(decrement)
}

/// −δ − log(1 − δ), by its series where the difference would lose its digits.
fn above_minimum(decrement: f64) -> f64 {
    match decrement {
        delta if delta < 1e-3 => delta * delta * (0.5 + delta / 3.0 + 0.26 * delta * delta),
        delta if delta < 1.0 => -delta - (1.0 - delta).ln(),
        _ => f64::INFINITY,
    }
}
