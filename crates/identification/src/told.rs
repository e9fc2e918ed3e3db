//! What the logs tell of each body and effect: by itself, in sums with others, or not at all.
//!
//! The prior of the bodies is that of `consistent` with a weight of one: a mass give or take itself, and
//! moments in proportion to the body's extent. An effect has no prior of its own; before anything is known it
//! may make up a joint's whole torque.

use crate::consistent::{Consistent, ConsistentSettings, prior_bodies, row_weights};
use crate::fit::{Fit, merge};
use crate::{Design, IdentificationError};
use faer::Mat;
use phiw_consistency::PseudoInertia;
use phiw_dynamics::inertia::PARAMETERS_PER_BODY;
use phiw_regressor::RegressorError;
use phiw_regressor::factor::Factor;
use phiw_regressor::information::Information;
pub use phiw_regressor::information::{InformationSettings, Sum};
use phiw_regressor::least_squares::GroupedFactor;

/// What the logs tell. Parameters are the standard ones of all bodies, ten for each, then the effects'.
#[derive(Clone, Debug)]
pub struct Told {
    information: Information,
    values: Vec<f64>,
    standard: usize,
    weights: Vec<f64>,
    /// The map to base parameters, and the effects: what motion can tell apart.
    natural: Mat<f64>,
    /// Effects' parameters that the fit has left out: what they do stands in others, so they are told only
    /// with these.
    left_out: Vec<usize>,
}

/// A sum of parameters that is told.
#[derive(Clone, Debug, PartialEq)]
pub struct ToldSum {
    /// Parameters and their factors, the leading one first with a factor of one.
    pub terms: Sum,
    /// Value, of the bodies that can exist.
    pub value: f64,
    /// Posterior standard deviation.
    pub std: f64,
}

/// What the logs of a fit tell.
///
/// Correlated rows are counted as fewer independent ones: as many as make the deviations of least squares
/// those of the folds that were left out.
///
/// # Errors
/// The factors are of another design.
pub fn told(
    design: &Design,
    fit: &Fit,
    train_folds: &[GroupedFactor],
    consistent: &Consistent,
    settings: InformationSettings,
) -> Result<Told, IdentificationError> {
    let all = merge(train_folds)?;
    let shrink = correlation(fit).sqrt();
    let weights = row_weights(fit, train_folds, &ConsistentSettings::default())?;
    let weights: Vec<f64> = weights.iter().map(|weight| weight / shrink).collect();
    let base = design.base().count();
    let prior: Vec<f64> = prior_bodies(design.tree(), &Default::default())
        .iter()
        .flat_map(body_deviations)
        .chain(effect_deviations(&all, base..design.parameter_count()))
        .collect();
    let parameters: Vec<usize> = (0..design.parameter_count()).collect();
    let rows = of_parameters(design, &all.combine(&weights)?, &parameters);
    Ok(Told {
        information: Information::new(&prior, rows.as_ref(), settings)?,
        values: consistent.standard.iter().chain(&consistent.parameters[base..]).copied().collect(),
        standard: consistent.standard.len(),
        weights,
        natural: natural(design),
        left_out: (fit.undetermined.iter().filter(|parameter| **parameter >= base))
            .map(|parameter| consistent.standard.len() + parameter - base)
            .collect(),
    })
}

impl Told {
    /// Number of standard parameters; those of the effects follow.
    pub fn standard_parameters(&self) -> usize {
        self.standard
    }

    /// Number of parameters.
    pub fn parameters(&self) -> usize {
        self.values.len()
    }

    /// How many times narrower than its prior a posterior has to be.
    pub fn narrower_by(&self) -> f64 {
        self.information.settings().narrower_by
    }

    /// Number of directions of the parameters that are told.
    pub fn directions(&self) -> usize {
        self.information.directions_told()
    }

    /// Parameters that are told by themselves, ascending, with value and posterior standard deviation.
    pub fn alone(&self) -> Vec<(usize, f64, f64)> {
        let of = |parameter: usize| {
            let [_, std] = self.information.deviations(&[(parameter, 1.0)]);
            (parameter, self.values[parameter], std)
        };
        self.known().into_iter().map(of).collect()
    }

    fn known(&self) -> Vec<usize> {
        let alone = self.information.alone().into_iter();
        alone.filter(|parameter| !self.left_out.contains(parameter)).collect()
    }

    /// Sums that are told of parameters that are not told by themselves. Moments of inertia lead where they
    /// can, then first moments, then masses: so a link's mass is written with what carries it.
    pub fn sums(&self) -> Vec<ToldSum> {
        let rank = |parameter: usize| match parameter {
            _ if parameter >= self.standard => 3,
            _ => match parameter % PARAMETERS_PER_BODY {
                0 => 2,
                1..4 => 1,
                _ => 0,
            },
        };
        let mut preference: Vec<usize> = (0..self.values.len()).collect();
        preference.sort_by_key(|&parameter| rank(parameter));
        let of = |terms: Sum| {
            let [_, std] = self.information.deviations(&terms);
            let value = terms.iter().map(|(parameter, factor)| factor * self.values[*parameter]).sum();
            ToldSum { terms, value, std }
        };
        let sums = self.information.sums(&self.known(), &preference, self.natural.as_ref());
        let mut sums: Vec<ToldSum> = sums.into_iter().map(of).collect();
        sums.sort_by_key(|sum| sum.terms[0].0);
        sums
    }

    /// Parameters that are told neither by themselves nor in one of `sums`, ascending.
    pub fn not_at_all(&self, sums: &[ToldSum]) -> Vec<usize> {
        let alone = self.known();
        let in_sum =
            |parameter: usize| sums.iter().any(|sum| sum.terms.iter().any(|term| term.0 == parameter));
        (0..self.values.len()).filter(|parameter| !alone.contains(parameter) && !in_sum(*parameter)).collect()
    }

    /// Rows of another motion as they count here: a factor for each torque over the `parameters` of the
    /// design, whose rows each stand for `share` rows of a log.
    ///
    /// # Errors
    /// The factor is of another robot.
    pub fn rows(
        &self,
        design: &Design,
        factor: &GroupedFactor,
        parameters: &[usize],
        share: f64,
    ) -> Result<Mat<f64>, RegressorError> {
        let weights: Vec<f64> = self.weights.iter().map(|weight| weight * share.sqrt()).collect();
        Ok(of_parameters(design, &factor.combine(&weights)?, parameters))
    }

    /// What such rows would tell of what is not told \[nats\].
    ///
    /// # Errors
    /// They are of other parameters.
    pub fn nats_of_untold(&self, rows: &Mat<f64>) -> Result<f64, RegressorError> {
        self.information.nats_of_untold(rows.as_ref())
    }

    /// What would be told with such rows beside those of the logs.
    ///
    /// # Errors
    /// They are of other parameters.
    pub fn with_rows(&self, rows: &Mat<f64>) -> Result<Self, RegressorError> {
        Ok(Told { information: self.information.with_rows(rows.as_ref())?, ..self.clone() })
    }
}

/// R over some parameters of a design as rows over standard parameters and effects.
fn of_parameters(design: &Design, factor: &Factor, parameters: &[usize]) -> Mat<f64> {
    let (map, base) = (design.base().map(), design.base().count());
    let (standard, effects) = (map.ncols(), design.parameter_count() - base);
    let mut rows = Mat::zeros(factor.columns(), standard + effects);
    for row in 0..factor.columns() {
        for (column, &parameter) in parameters.iter().enumerate().skip(row) {
            let entry = factor.entry(row, column);
            if parameter >= base {
                rows[(row, standard + parameter - base)] = entry;
            } else if entry != 0.0 {
                (0..standard).for_each(|own| rows[(row, own)] += entry * map[(parameter, own)]);
            }
        }
    }
    rows
}

/// Base parameters as rows over standard ones, and a row for each parameter of the effects.
fn natural(design: &Design) -> Mat<f64> {
    let map = design.base().map();
    let effects = design.parameter_count() - map.nrows();
    Mat::from_fn(map.nrows() + effects, map.ncols() + effects, |row, column| {
        match (row < map.nrows(), column < map.ncols()) {
            (true, true) => map[(row, column)],
            (false, false) if row - map.nrows() == column - map.ncols() => 1.0,
            _ => 0.0,
        }
    })
}

/// How many correlated rows are worth one: the median, over the parameters, of their variance by folds left
/// out over that of independent rows.
fn correlation(fit: &Fit) -> f64 {
    let Ok(unit) = fit.factor.unit_covariance() else { return 1.0 };
    let ratio = |(place, parameter): (usize, usize)| {
        (fit.standard_deviations[parameter].powi(2) / unit[(place, place)]).max(0.0)
    };
    let mut ratios: Vec<f64> =
        fit.determined().into_iter().enumerate().map(ratio).filter(|ratio| ratio.is_finite()).collect();
    ratios.sort_by(f64::total_cmp);
    ratios.get(ratios.len() / 2).copied().unwrap_or(1.0).max(1.0)
}

/// Deviations of a body's standard parameters under the log-det divergence of weight one: its second order
/// is that of a covariance ½(P_ik·P_jl + P_il·P_jk) of the entries of P.
fn body_deviations(body: &[f64; PARAMETERS_PER_BODY]) -> [f64; PARAMETERS_PER_BODY] {
    let p = PseudoInertia::of_parameters(body);
    let entry = |row: usize, column: usize| {
        (0.5 * (p.entry(row, row) * p.entry(column, column) + p.entry(row, column).powi(2))).sqrt()
    };
    // A moment of inertia is the sum of two second moments.
    let moment = |one: usize, other: usize| {
        (p.entry(one, one).powi(2) + p.entry(other, other).powi(2) + 2.0 * p.entry(one, other).powi(2)).sqrt()
    };
    [
        entry(3, 3),
        entry(0, 3),
        entry(1, 3),
        entry(2, 3),
        moment(1, 2),
        entry(0, 1),
        moment(0, 2),
        entry(0, 2),
        entry(1, 2),
        moment(0, 1),
    ]
}

/// For each parameter the value with which it alone would be as large as a torque that it acts on, the
/// smallest of all; infinite where no row has it.
fn effect_deviations(all: &GroupedFactor, parameters: std::ops::Range<usize>) -> Vec<f64> {
    let mut deviations = vec![f64::INFINITY; parameters.len()];
    for group in all.groups() {
        let torque = group.factor.right_hand_side_sum_of_squares().sqrt();
        for (column, parameter) in group.parameters.iter().enumerate() {
            let norm = group.factor.column_norm(column);
            if parameters.contains(parameter) && norm > 0.0 && torque > 0.0 {
                let own = &mut deviations[parameter - parameters.start];
                *own = own.min(torque / norm);
            }
        }
    }
    deviations
}

#[cfg(test)]
mod tests {
    use super::body_deviations;
    use phiw_consistency::PseudoInertia;
    use phiw_dynamics::inertia::PARAMETERS_PER_BODY;
    use phiw_dynamics::random_tree::RandomNumbers;

    /// The Hessian of the divergence by differences, inverted by elimination, has the variances.
    #[test]
    fn deviations_are_those_of_the_divergence() {
        let body = [2.0, 0.3, -0.2, 0.1, 0.3, 0.01, 0.25, -0.02, 0.03, 0.2];
        let prior = PseudoInertia::of_parameters(&body);
        let at = |steps: [f64; PARAMETERS_PER_BODY]| {
            let mut moved = body;
            moved.iter_mut().zip(steps).for_each(|(value, step)| *value += step);
            PseudoInertia::of_parameters(&moved).divergence(&prior)
        };
        let size: [f64; PARAMETERS_PER_BODY] = std::array::from_fn(|k| if k == 0 { 2e-4 } else { 2e-5 });
        let mut augmented = vec![vec![0.0; 2 * PARAMETERS_PER_BODY]; PARAMETERS_PER_BODY];
        for (row, line) in augmented.iter_mut().enumerate() {
            line[PARAMETERS_PER_BODY + row] = 1.0;
            for (column, value) in line.iter_mut().enumerate().take(PARAMETERS_PER_BODY) {
                let signed = |a: f64, b: f64| {
                    let mut steps = [0.0; PARAMETERS_PER_BODY];
                    steps[row] += a * size[row];
                    steps[column] += b * size[column];
                    at(steps)
                };
                let mixed = signed(1.0, 1.0) - signed(1.0, -1.0) - signed(-1.0, 1.0) + signed(-1.0, -1.0);
                *value = mixed / (4.0 * size[row] * size[column]);
            }
        }
        for pivot in 0..PARAMETERS_PER_BODY {
            let lead = augmented[pivot][pivot];
            augmented[pivot].iter_mut().for_each(|value| *value /= lead);
            let row = augmented[pivot].clone();
            for (_, other) in augmented.iter_mut().enumerate().filter(|(index, _)| *index != pivot) {
                let factor = other[pivot];
                other.iter_mut().zip(&row).for_each(|(value, row)| *value -= factor * row);
            }
        }
        for (index, found) in body_deviations(&body).into_iter().enumerate() {
            let expected = augmented[index][PARAMETERS_PER_BODY + index].sqrt();
            assert!((found / expected - 1.0).abs() < 1e-3, "{index}: {found} {expected}");
        }
    }

    #[test]
    fn a_mass_may_be_off_by_itself_wherever_the_frame_is() {
        let mut random = RandomNumbers::new(3);
        for _ in 0..10 {
            let mass = random.uniform(0.1, 9.0);
            let h = random.uniform(-1.0, 1.0);
            let moment = mass * 0.1 + h * h / mass;
            let body = [mass, h, 0.0, 0.0, mass * 0.1, 0.0, moment, 0.0, 0.0, moment];
            assert!((body_deviations(&body)[0] - mass).abs() < 1e-12);
        }
    }
}
