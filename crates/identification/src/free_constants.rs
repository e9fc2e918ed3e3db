//! What a fit would be with some constants of its effects free, to first order.
//!
//! An effect that is not linear in a constant c has, at its fitted values β, the derivative Σ β ∂column/∂c.
//! As one more column beside the model's, its parameter is how far c is from its best value, and its
//! deviation that of c: the curvature of the error along c, the model's own parameters free. The
//! parameters' intervals then no longer take c for known.

use crate::effect::{EffectParameter, Entry, Evaluator, Needs, Sample};
use crate::fit::{Fit, merge};
use crate::jackknife::Jackknife;
use crate::{Effect, EffectSpec, IdentificationError};
use phiw_regressor::least_squares::GroupedFactor;

/// The derivative of an effect by one of its constants, as an effect of one parameter.
pub struct ByConstant {
    spec: EffectSpec,
    constant: String,
    /// The effect with the constant a step below and above.
    sides: [Box<dyn Effect>; 2],
    values: Vec<f64>,
    step: f64,
}

impl ByConstant {
    /// Of an effect at its fitted `values`, built with the constant a `step` below and above its own.
    pub fn new(
        spec: EffectSpec,
        constant: &str,
        sides: [Box<dyn Effect>; 2],
        values: &[f64],
        step: f64,
    ) -> Self {
        ByConstant { spec, constant: constant.to_owned(), sides, values: values.to_vec(), step }
    }

    /// The torques that the effect acts on, each once.
    fn rows(&self) -> Vec<usize> {
        let mut rows: Vec<usize> = self.sides[0].entries().iter().map(|entry| entry.row).collect();
        rows.sort_unstable();
        rows.dedup();
        rows
    }
}

impl Effect for ByConstant {
    fn spec(&self) -> EffectSpec {
        self.spec.clone()
    }
    fn parameters(&self) -> Vec<EffectParameter> {
        vec![EffectParameter {
            joint: self.spec.joints.join("+"),
            name: self.constant.clone(),
            unit: String::new(),
            bounds: (f64::NEG_INFINITY, f64::INFINITY),
        }]
    }
    fn entries(&self) -> Vec<Entry> {
        self.rows().into_iter().map(|row| Entry { row, parameter: 0 }).collect()
    }
    fn needs(&self) -> Needs {
        self.sides[0].needs()
    }
    fn is_causal(&self) -> bool {
        self.sides[0].is_causal()
    }
    fn evaluator(&self) -> Box<dyn Evaluator + '_> {
        let rows = self.rows();
        let entries = self.sides[0].entries();
        let place = |entry: &Entry| rows.iter().position(|row| *row == entry.row).unwrap_or_default();
        let factor =
            |entry: &Entry| self.values.get(entry.parameter).copied().unwrap_or_default() / (2.0 * self.step);
        Box::new(Difference {
            sides: [self.sides[0].evaluator(), self.sides[1].evaluator()],
            terms: entries.iter().map(|entry| (place(entry), factor(entry))).collect(),
            columns: [vec![0.0; entries.len()], vec![0.0; entries.len()]],
        })
    }
}

struct Difference<'a> {
    sides: [Box<dyn Evaluator + 'a>; 2],
    /// For each entry of the effect its place among the rows, and its factor.
    terms: Vec<(usize, f64)>,
    columns: [Vec<f64>; 2],
}

impl Evaluator for Difference<'_> {
    fn restart(&mut self) {
        self.sides.iter_mut().for_each(|side| side.restart());
    }
    fn evaluate(&mut self, sample: &Sample<'_>, out: &mut [f64]) {
        for (side, columns) in self.sides.iter_mut().zip(&mut self.columns) {
            side.evaluate(sample, columns);
        }
        out.fill(0.0);
        for (entry, (place, factor)) in self.terms.iter().enumerate() {
            out[*place] += factor * (self.columns[1][entry] - self.columns[0][entry]);
        }
    }
}

/// A constant that was left free.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FreeConstant {
    /// Its standard deviation, how far it is from its best value included.
    pub std: f64,
    /// Its 95 % interval: Student's for the number of folds, about its best value.
    pub interval_95: [f64; 2],
}

/// Widens a fit by what constants leave open that were chosen before it. `folds` have the columns of the
/// fit's design, then one for the derivative by each constant; `constants` are the values, each with the
/// reach within which first order may hold. What comes back has no number for a constant whose deviation,
/// or whose way to its best value, is longer than that.
///
/// # Errors
/// The folds are of another design.
pub fn free_constants(
    fit: &mut Fit,
    folds: &[GroupedFactor],
    constants: &[(f64, f64)],
) -> Result<Vec<Option<FreeConstant>>, IdentificationError> {
    let determined = fit.determined();
    let first = fit.parameters.len();
    let weights: Vec<f64> = fit.residual_std.iter().map(|std| 1.0 / std).collect();
    let mut free: Vec<usize> = (0..constants.len()).collect();
    let mut found = vec![None; constants.len()];
    if fit.is_drawn {
        // What the rows alone say, without the prior, is far from the fit.
        return Ok(found);
    }
    while !free.is_empty() {
        let columns: Vec<usize> =
            determined.iter().copied().chain(free.iter().map(|constant| first + constant)).collect();
        let all = merge(folds)?.select(&columns)?.combine(&weights)?;
        let undetermined = all.undetermined_columns();
        let own = determined.len();
        if !undetermined.is_empty() {
            // A constant whose derivative is another column.
            let before = free.len();
            let mut place = own..columns.len();
            free.retain(|_| place.next().is_some_and(|column| !undetermined.contains(&column)));
            if free.len() == before {
                break;
            }
            continue;
        }
        let selected: Vec<GroupedFactor> =
            folds.iter().map(|fold| fold.select(&columns)).collect::<Result<_, _>>()?;
        let Ok(solution) = all.solve() else { break };
        let Some(jackknife) = Jackknife::of(&selected, &weights)? else { break };
        let deviations = jackknife.deviations();
        let folds_left_out = deviations.len() as f64;
        let std = |at: usize| {
            let squares: f64 = deviations.iter().map(|deviation| deviation[at] * deviation[at]).sum();
            (squares * (folds_left_out - 1.0) / folds_left_out).sqrt()
        };
        let is_wild = |(place, &constant): (usize, &usize)| {
            let (_, most) = constants[constant];
            let shift = solution.parameters[own + place].abs();
            // Written so that what is no number is wild.
            !(std(own + place) < most && shift < most)
        };
        let wild: Vec<usize> =
            free.iter().enumerate().filter(|&place| is_wild(place)).map(|(_, &constant)| constant).collect();
        if !wild.is_empty() {
            free.retain(|constant| !wild.contains(constant));
            continue;
        }
        let shift: Vec<f64> = determined
            .iter()
            .enumerate()
            .map(|(place, &parameter)| solution.parameters[place] - fit.parameters[parameter])
            .collect();
        let of_parameters: Vec<Vec<f64>> =
            deviations.iter().map(|deviation| deviation[..own].to_vec()).collect();
        fit.take_deviations(&determined, &of_parameters, Some(&shift));
        let quantile = fit.covariance.quantile_95();
        for (place, &constant) in free.iter().enumerate() {
            let (std, shift) = (std(own + place), solution.parameters[own + place]);
            let middle = constants[constant].0 + shift;
            found[constant] = Some(FreeConstant {
                std: std.hypot(shift),
                interval_95: [middle - quantile * std, middle + quantile * std],
            });
        }
        break;
    }
    Ok(found)
}
