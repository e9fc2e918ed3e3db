//! What was believed of the bodies, as a divergence that only possible bodies have.
//!
//! Each body is as far from its prior as the log-det divergence of their pseudo-inertias says, which is the
//! same in any frame and any units (Lee, Wensing & Park, T-RO 2020); a parameter that is not negative (a
//! friction) likewise, as a pseudo-inertia of one row. Beside the likelihood's −log det of the mass matrix it
//! keeps every body possible.

use crate::{EstimationError, RobotModel};
use faer::{Mat, Side};
use phiw_consistency::{PriorSettings, PseudoInertia, possible_priors};
use phiw_dynamics::dense::Cholesky;
use phiw_dynamics::inertia::PARAMETERS_PER_BODY;
use phiw_identification::Design;
use std::ops::Range;

/// Rows of a pseudo-inertia.
const ROWS: usize = 4;

/// The prior over x: the standard parameters of all bodies, then the parameters of the effects.
pub(super) struct BodyPrior {
    bodies: Vec<Body>,
    /// The value that was believed of each effect's parameter that is not negative; none of the others.
    effects: Vec<Option<f64>>,
}

struct Body {
    standard: [f64; PARAMETERS_PER_BODY],
    prior: PseudoInertia,
    /// P⁰⁻¹.
    inverse: Vec<f64>,
}

impl BodyPrior {
    /// About a model. Bodies of it that are not possible are mended first.
    pub fn new(design: &Design, model: &RobotModel, roundness: f64) -> Result<Self, EstimationError> {
        let described = model.standard.as_chunks::<PARAMETERS_PER_BODY>().0;
        let mut bodies = Vec::with_capacity(described.len());
        let settings = PriorSettings::default();
        let lengths = length(design);
        let masses: Vec<f64> = described.iter().map(|body| body[0]).filter(|mass| *mass > 0.0).collect();
        let mean_mass = masses.iter().sum::<f64>() / masses.len().max(1) as f64;
        let rounded: Vec<[f64; PARAMETERS_PER_BODY]> = described
            .iter()
            .map(|body| {
                let masses = settings.least_mass * mean_mass..mean_mass;
                round(body, roundness, masses, settings.least_radius * lengths)
            })
            .collect();
        // What is nothing at all stays for the general remedy.
        for standard in possible_priors(&rounded, lengths, &settings) {
            let prior = PseudoInertia::of_parameters(&standard);
            let Some(factor) = Cholesky::of(ROWS, |row, column| prior.entry(row, column)) else {
                return Err(EstimationError::Log("a body of the first belief is flat to the last digit"));
            };
            bodies.push(Body { standard, prior, inverse: factor.inverse() });
        }
        let known = model.effects.iter().flat_map(|effect| {
            let values = effect.parameters.iter();
            values.map(move |value| (effect.spec.clone(), *value))
        });
        let known: Vec<_> = known.collect();
        let mut effects = Vec::new();
        let info = design.effect_parameter_info();
        for (index, effect) in design.effects().iter().enumerate() {
            let spec = effect.spec();
            let own: Vec<f64> =
                known.iter().filter(|(other, _)| *other == spec).map(|(_, value)| *value).collect();
            for place in 0..design.effect_parameters(index).len() {
                let (lower, upper) = info[effects.len()].bounds;
                let value = own.get(place).copied().filter(|value| *value > 0.0);
                effects.push(value.filter(|_| lower == 0.0 && upper == f64::INFINITY));
            }
        }
        Ok(BodyPrior { bodies, effects })
    }

    /// Number of unknowns x.
    pub fn size(&self) -> usize {
        PARAMETERS_PER_BODY * self.bodies.len() + self.effects.len()
    }

    /// Numbers of standard parameters among them, which come first.
    pub fn standard_size(&self) -> usize {
        PARAMETERS_PER_BODY * self.bodies.len()
    }

    /// A start: a model's own bodies where they are possible, the prior's where not, and its effects.
    pub fn start(&self, standard: &[f64], effects: &[f64]) -> Mat<f64> {
        let mut x = Mat::zeros(self.size(), 1);
        let own = standard.as_chunks::<PARAMETERS_PER_BODY>().0;
        for (place, (body, own)) in self.bodies.iter().zip(own).enumerate() {
            let far = PseudoInertia::of_parameters(own).divergence(&body.prior);
            let from = if far < FARTHEST_START { own } else { &body.standard };
            from.iter()
                .enumerate()
                .for_each(|(index, value)| x[(PARAMETERS_PER_BODY * place + index, 0)] = *value);
        }
        for (place, (prior, value)) in self.effects.iter().zip(effects).enumerate() {
            let start = match prior {
                Some(prior) => value.max(NEAREST_TO_ZERO * prior),
                None => *value,
            };
            x[(self.standard_size() + place, 0)] = start;
        }
        x
    }

    /// Σ D; infinite where a body is not possible.
    pub fn divergence(&self, x: &Mat<f64>) -> f64 {
        let mut sum = 0.0;
        for (place, body) in self.bodies.iter().enumerate() {
            sum += body_at(x, place).divergence(&body.prior);
        }
        for (place, prior) in self.effects.iter().enumerate() {
            let Some(prior) = prior else { continue };
            let ratio = x[(self.standard_size() + place, 0)] / prior;
            if ratio <= 0.0 {
                return f64::INFINITY;
            }
            sum += ratio - 1.0 - ratio.ln();
        }
        if sum.is_nan() { f64::INFINITY } else { sum }
    }

    /// Adds `weight` times the gradient and the curvature of Σ D at possible bodies.
    pub fn add_to(&self, x: &Mat<f64>, weight: f64, gradient: &mut Mat<f64>, hessian: &mut Mat<f64>) {
        let directions = directions();
        for (place, body) in self.bodies.iter().enumerate() {
            let own = body_at(x, place);
            let Some(factor) = Cholesky::of(ROWS, |row, column| own.entry(row, column)) else { continue };
            let inverse = factor.inverse();
            // P⁻¹E_k of each parameter.
            let moved: Vec<Vec<f64>> =
                directions.iter().map(|direction| product(&inverse, direction)).collect();
            for k in 0..PARAMETERS_PER_BODY {
                let row = PARAMETERS_PER_BODY * place + k;
                let towards: f64 = body.inverse.iter().zip(&directions[k]).map(|(a, b)| a * b).sum();
                let away: f64 = (0..ROWS).map(|index| moved[k][index * (ROWS + 1)]).sum();
                gradient[(row, 0)] += weight * (towards - away);
                for l in 0..=k {
                    let column = PARAMETERS_PER_BODY * place + l;
                    let trace: f64 = (0..ROWS * ROWS)
                        .map(|index| moved[k][index] * moved[l][index % ROWS * ROWS + index / ROWS])
                        .sum();
                    hessian[(row, column)] += weight * trace;
                    if l < k {
                        hessian[(column, row)] += weight * trace;
                    }
                }
            }
        }
        for (place, prior) in self.effects.iter().enumerate() {
            let Some(prior) = prior else { continue };
            let index = self.standard_size() + place;
            let value = x[(index, 0)];
            gradient[(index, 0)] += weight * (1.0 / prior - 1.0 / value);
            hessian[(index, index)] += weight / (value * value);
        }
    }
}

/// A body with the described mass, centre of mass and size, lifted where it is flatter than `roundness`, or
/// impossible: second moments about the centre of mass along all axes are then at least that share of their
/// mean. The mean is at least a quarter of that about the joint, and a sphere's of `least_radius`: what is
/// left of an inertia without its mass's own share may be less than nothing where each of them is uncertain.
///
/// A body whose first moments ask for a larger second moment than it has is too light for them: its centre of
/// mass would be far outside of it. It is given the mass with which it is not, up to the mean of all bodies
/// (the end of `masses`, which begins with the least). Of all ways to make it possible this is the one that a
/// motion can take back at the least price: what is lighter than its prior costs a logarithm, what is heavier
/// or elsewhere, many times the prior's size, costs its square.
fn round(
    body: &[f64; PARAMETERS_PER_BODY],
    roundness: f64,
    masses: Range<f64>,
    least_radius: f64,
) -> [f64; PARAMETERS_PER_BODY] {
    let whole = PseudoInertia::of_parameters(body);
    let about_joint: f64 = (0..3).map(|axis| whole.entry(axis, axis)).sum();
    let first_moment: f64 = (0..3).map(|axis| whole.entry(axis, 3).powi(2)).sum();
    let asked_for = if about_joint > 0.0 { first_moment / about_joint } else { 0.0 };
    let mass = body[0].max(masses.start).max(asked_for.min(masses.end));
    let centre: [f64; 3] = std::array::from_fn(|axis| whole.entry(axis, 3) / mass);
    let about = |row: usize, column: usize| whole.entry(row, column) - mass * centre[row] * centre[column];
    let about_centre: f64 = (0..3).map(|axis| about(axis, axis)).sum();
    let mean = about_centre.max(LEFT_OF_INERTIA * about_joint).max(3.0 * mass * least_radius.powi(2)) / 3.0;
    let Ok(eigen) = Mat::from_fn(3, 3, about).self_adjoint_eigen(Side::Lower) else { return *body };
    let lifted = |row: usize, column: usize| -> f64 {
        (0..3)
            .map(|k| eigen.U()[(row, k)] * eigen.U()[(column, k)] * eigen.S()[k].max(roundness * mean))
            .sum()
    };
    let second = |row: usize, column: usize| lifted(row, column) + mass * centre[row] * centre[column];
    let (x, y, z) = (second(0, 0), second(1, 1), second(2, 2));
    let [hx, hy, hz] = centre.map(|along| mass * along);
    [mass, hx, hy, hz, y + z, -second(0, 1), x + z, -second(0, 2), -second(1, 2), x + y]
}

/// Share of a body's second moment about its joint that is left about its centre of mass at least.
const LEFT_OF_INERTIA: f64 = 0.25;

/// Divergence from the prior above which a body is no start: nearly flat bodies take many steps.
const FARTHEST_START: f64 = 50.0;
/// Share of what was believed of a friction at which a start has it at least.
const NEAREST_TO_ZERO: f64 = 0.01;

fn body_at(x: &Mat<f64>, place: usize) -> PseudoInertia {
    PseudoInertia::of_parameters(&std::array::from_fn(|index| x[(PARAMETERS_PER_BODY * place + index, 0)]))
}

/// What one of each parameter adds to a pseudo-inertia, row by row.
fn directions() -> Vec<Vec<f64>> {
    let unit = |parameter: usize| std::array::from_fn(|index| f64::from(u8::from(index == parameter)));
    let matrix = |parameter: usize| {
        let body = PseudoInertia::of_parameters(&unit(parameter));
        (0..ROWS * ROWS).map(|index| body.entry(index / ROWS, index % ROWS)).collect()
    };
    (0..PARAMETERS_PER_BODY).map(matrix).collect()
}

fn product(left: &[f64], right: &[f64]) -> Vec<f64> {
    let entry = |index: usize| {
        let (row, column) = (index / ROWS, index % ROWS);
        (0..ROWS).map(|inner| left[row * ROWS + inner] * right[inner * ROWS + column]).sum()
    };
    (0..ROWS * ROWS).map(entry).collect()
}

/// The mean distance from a joint to the one before it, of those that are apart \[m\].
fn length(design: &Design) -> f64 {
    let norm = |[x, y, z]: [f64; 3]| (x * x + y * y + z * z).sqrt();
    let lengths = design.tree().bodies().iter().skip(1).map(|body| norm(body.origin.translation.0));
    let apart: Vec<f64> = lengths.filter(|length| *length > 0.0).collect();
    apart.iter().sum::<f64>() / apart.len().max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use phiw_dynamics::random_tree::{RandomTreeOptions, random_tree};
    use phiw_regressor::BaseParameters;

    #[test]
    fn gradient_and_curvature_are_those_of_the_divergence() -> Result<(), Box<dyn std::error::Error>> {
        let tree = random_tree(3, &RandomTreeOptions::default())?;
        let model = RobotModel { standard: tree.inertial_parameters(), effects: Vec::new() };
        let design =
            Design::new(tree.clone(), BaseParameters::of_tree(&tree, Default::default())?, Vec::new());
        let prior = BodyPrior::new(&design, &model, 0.4)?;
        let at = |moved: usize, step: f64| {
            let mut x = prior.start(&model.standard, &[]) * faer::Scale(1.2);
            x[(moved, 0)] += step;
            x
        };
        let derivatives = |x: &Mat<f64>| {
            let (mut gradient, mut hessian) =
                (Mat::zeros(prior.size(), 1), Mat::zeros(prior.size(), prior.size()));
            prior.add_to(x, 2.0, &mut gradient, &mut hessian);
            (gradient, hessian)
        };
        let (gradient, hessian) = derivatives(&at(0, 0.0));
        for index in 0..PARAMETERS_PER_BODY.min(prior.size()) {
            // Parameters of a body differ by orders of magnitude: so do the steps, by the curvature.
            let step = 1e-4 / hessian[(index, index)].sqrt();
            let (up, down) = (at(index, step), at(index, -step));
            let slope = (prior.divergence(&up) - prior.divergence(&down)) / step;
            let scale = hessian[(index, index)].sqrt();
            assert!((slope - gradient[(index, 0)]).abs() < 1e-4 * scale, "{index}: {slope}");
            let (above, below) = (derivatives(&up).0, derivatives(&down).0);
            for other in 0..PARAMETERS_PER_BODY {
                let bend = (above[(other, 0)] - below[(other, 0)]) / (2.0 * step);
                let size = scale * hessian[(other, other)].sqrt();
                assert!((bend - hessian[(other, index)]).abs() < 1e-3 * size, "{index}, {other}: {bend}");
            }
        }
        Ok(())
    }

    /// Bodies with each number drawn by itself are mostly impossible.
    #[test]
    fn whatever_was_believed_the_prior_is_possible() {
        let bodies = [[2.0, 0.6, -2.0, 1.0, 0.1, 0.6, 0.2, -0.3, 0.1, 0.3], [0.0; 10], [1.0; 10]];
        for body in bodies {
            assert!(
                PseudoInertia::of_parameters(&round(&body, 0.4, 0.1..1.0, 0.02)).is_possible(),
                "{body:?}"
            );
        }
    }

    /// A hand of 1.3 kg that was believed to weigh 0.11 kg, with the same first moment: its centre of mass
    /// would be a metre away. A prior about that cost hundreds of nats, and no log of a minute moved it.
    #[test]
    fn a_body_that_is_too_light_for_its_first_moment_does_not_bar_the_true_one() {
        let hand = [1.3, 0.11, 0.0, 0.0, 0.0065, 0.0, 0.016, 0.0, 0.0, 0.016];
        let believed = [0.11, 0.11, 0.0, 0.0, 0.006, 0.0, 0.017, 0.0, 0.0, 0.023];
        let far = |prior: [f64; PARAMETERS_PER_BODY]| {
            PseudoInertia::of_parameters(&hand).divergence(&PseudoInertia::of_parameters(&prior))
        };
        let mended = round(&believed, 0.4, 0.1..2.0, 0.02);
        assert!(far(mended) < 40.0, "{mended:?}: {}", far(mended));
        // What it was: the centre of mass stays a metre away.
        assert!(far(round(&believed, 0.4, 0.1..0.1, 0.02)) > 200.0);
        // A possible body keeps its mass.
        assert_eq!(round(&hand, 0.4, 0.1..2.0, 0.02)[0], 1.3);
    }
}
