//! Robust least squares: rows far outside their group's noise count less (Huber, iteratively reweighted).

use super::{Group, GroupedFactor, WeightedSolution, weighted_least_squares};
use crate::RegressorError;
use crate::factor::FactorBuilder;
use phiw_dynamics::check::check_index;

/// How rows are judged.
#[derive(Clone, Copy, Debug)]
pub struct RobustOptions {
    /// Residuals beyond this multiple of the noise count linearly (Huber's k; 1.345 loses 5 % on Gaussian
    /// noise).
    pub threshold: f64,
    /// Passes over the rows after the first.
    pub passes: usize,
}

impl Default for RobustOptions {
    fn default() -> Self {
        RobustOptions { threshold: 1.345, passes: 5 }
    }
}

/// The result of [`robust_least_squares`].
#[derive(Clone, Debug)]
pub struct RobustFit {
    /// The weighted solution of the last pass.
    pub solution: WeightedSolution,
    /// Share of rows of each group that counted less than fully in the last pass.
    pub downweighted: Vec<f64>,
}

/// Fits rows that `stream` can bring again and again: it calls its argument with (group, row) for every row
/// of \[Φ f\], the right-hand side last. Memory does not depend on the number of rows.
///
/// `group_parameters[k]` names the parameter of each column of group k's rows.
///
/// # Errors
/// What `stream` returns; a row of the wrong length; rows that do not determine all parameters.
pub fn robust_least_squares<E: From<RegressorError>>(
    parameter_count: usize,
    group_parameters: &[Vec<usize>],
    options: RobustOptions,
    mut stream: impl FnMut(&mut dyn FnMut(usize, &[f64]) -> Result<(), RegressorError>) -> Result<(), E>,
) -> Result<RobustFit, E> {
    let mut builders: Vec<FactorBuilder> =
        group_parameters.iter().map(|parameters| FactorBuilder::new(parameters.len() + 1)).collect();
    stream(&mut |group, row| {
        check_index("group of rows", group, builders.len())?;
        builders[group].push_row(row)
    })?;
    let mut solution = solve(parameter_count, group_parameters, &mut builders)?;
    let mut downweighted = vec![0.0; group_parameters.len()];
    // The scale of the noise must not feel the outliers: a histogram of |residual| gives its median in
    // constant memory.
    let mut scales = solution.group_std.clone();
    for _ in 0..options.passes {
        builders.iter_mut().for_each(FactorBuilder::clear);
        let mut histograms = vec![LogHistogram::default(); group_parameters.len()];
        let mut counts = vec![(0_u64, 0_u64); group_parameters.len()];
        stream(&mut |group, row| {
            let (columns, right) = row.split_at(row.len().saturating_sub(1));
            let fitted: f64 = columns
                .iter()
                .zip(&group_parameters[group])
                .map(|(value, &parameter)| value * solution.parameters[parameter])
                .sum();
            let residual = (right.first().copied().unwrap_or_default() - fitted).abs();
            histograms[group].add(residual);
            let bound = options.threshold * scales[group];
            counts[group].0 += 1;
            let weight = if residual > bound { (bound / residual).sqrt() } else { 1.0 };
            counts[group].1 += u64::from(weight < 1.0);
            builders[group].push_scaled_row(row, weight)
        })?;
        for (group, (rows, outside)) in counts.iter().enumerate() {
            downweighted[group] = *outside as f64 / (*rows).max(1) as f64;
            // 1.4826 turns the median of |x| into the standard deviation of a Gaussian x.
            scales[group] = 1.4826 * histograms[group].median();
        }
        solution = solve(parameter_count, group_parameters, &mut builders)?;
    }
    Ok(RobustFit { solution, downweighted })
}

fn solve(
    parameter_count: usize,
    group_parameters: &[Vec<usize>],
    builders: &mut [FactorBuilder],
) -> Result<WeightedSolution, RegressorError> {
    let groups = group_parameters
        .iter()
        .zip(builders)
        .map(|(parameters, builder)| Group { parameters: parameters.clone(), factor: builder.factor() })
        .collect();
    weighted_least_squares(&GroupedFactor::new(parameter_count, groups)?)
}

/// Counts of |x| in bins of 2 % width over forty decades.
#[derive(Clone, Debug)]
struct LogHistogram {
    counts: Vec<u64>,
}

impl Default for LogHistogram {
    fn default() -> Self {
        LogHistogram { counts: vec![0; 4600] }
    }
}

impl LogHistogram {
    const STEP: f64 = 0.02;
    const OFFSET: f64 = 2300.0;

    fn add(&mut self, value: f64) {
        let bin =
            (value.max(1e-20).ln() / Self::STEP + Self::OFFSET).clamp(0.0, (self.counts.len() - 1) as f64);
        self.counts[bin as usize] += 1;
    }

    fn median(&self) -> f64 {
        let half = self.counts.iter().sum::<u64>().div_ceil(2);
        let mut seen = 0;
        let bin = self.counts.iter().position(|count| {
            seen += count;
            seen >= half
        });
        ((bin.unwrap_or_default() as f64 + 0.5 - Self::OFFSET) * Self::STEP).exp()
    }
}
