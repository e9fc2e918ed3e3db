//! A quick look at many candidates: the refit of [`Evidence::refit`] from the normal equations of the
//! candidate's few columns beside the model's factor (semi-normal equations, Björck 1987).
//!
//! A candidate costs columns² instead of columns³. What is left of its columns beside the model's is known to
//! about ε·cond of their norm, far below the share at which a column counts as absorbed; who is chosen is
//! then refitted in full.

use super::evidence::{ABSORBED, Evidence, Refit};
use phiw_regressor::RegressorError;
use phiw_regressor::factor::Factor;
use phiw_regressor::least_squares::Group;

/// The model alone over all torques, with the weights in.
pub(super) struct Whole {
    /// R over the model's determined parameters and the right-hand side.
    factor: Factor,
    /// Its solution.
    solution: Vec<f64>,
    /// The diagonal is free of zeros: the model is determined.
    regular: bool,
}

impl Whole {
    pub fn of_rows(rows: &[Factor]) -> Result<Self, RegressorError> {
        let factor = Factor::merge_all(rows)?;
        let regular = factor.undetermined_columns().is_empty();
        let solution = if regular { factor.solve()?.parameters } else { Vec::new() };
        Ok(Whole { factor, solution, regular })
    }
}

impl Evidence<'_> {
    /// [`Evidence::refit`], with fewer digits.
    pub fn screen(&self, added: &[usize], rows: &[usize]) -> Result<Option<Refit>, RegressorError> {
        let whole = self.whole()?;
        if !whole.regular {
            return self.refit(added, rows);
        }
        let (places, count) = self.places();
        let k = added.len();
        // Products of the added columns with the model's, with each other and with the right-hand side.
        let mut with_model = vec![0.0; k * count];
        let mut gram = vec![0.0; k * k];
        let mut with_torque = vec![0.0; k];
        for &row in rows {
            let group = &self.train.groups()[row];
            let square = self.weights[row] * self.weights[row];
            let place_of = columns_of(group, added);
            let right = group.factor.parameters();
            for &(column, place) in &place_of {
                for (own, &parameter) in
                    group.parameters.iter().enumerate().take_while(|(_, p)| **p < self.model)
                {
                    if let Some(target) = places[parameter] {
                        with_model[place * count + target] += square * product(&group.factor, own, column);
                    }
                }
                for &(other, other_place) in &place_of {
                    gram[place * k + other_place] += square * product(&group.factor, column, other);
                }
                with_torque[place] += square * product(&group.factor, column, right);
            }
        }
        // What the model does not absorb.
        let rhs = &whole.factor.column(count)[..count];
        for column in with_model.chunks_exact_mut(count.max(1)) {
            solve_transposed(&whole.factor, column);
        }
        let part = |place: usize| &with_model[place * count..(place + 1) * count];
        let mut left = gram.clone();
        for a in 0..k {
            for b in 0..k {
                left[a * k + b] -= dot(part(a), part(b));
            }
            with_torque[a] -= dot(part(a), rhs);
        }
        let Some(values) = solve_heard(&left, &gram, &with_torque) else { return Ok(None) };
        let mut absorbed = vec![0.0; count];
        for (place, &value) in values.iter().enumerate().filter(|(_, value)| **value != 0.0) {
            absorbed.iter_mut().zip(part(place)).for_each(|(sum, entry)| *sum += value * entry);
        }
        solve(&whole.factor, &mut absorbed);
        let mut parameters = vec![0.0; self.train.parameter_count()];
        for (parameter, place) in places.iter().enumerate() {
            parameters[parameter] = place.map_or(0.0, |place| whole.solution[place] - absorbed[place]);
        }
        added.iter().zip(&values).for_each(|(&parameter, value)| parameters[parameter] = *value);
        self.outcome(parameters, rows, added).map(Some)
    }
}

/// (column of the group's factor, place among the added) of the added parameters that act on the group's
/// torque.
fn columns_of(group: &Group, added: &[usize]) -> Vec<(usize, usize)> {
    // A group's columns are in the order of the design's parameters.
    let column = |parameter: &usize| group.parameters.binary_search(parameter).ok();
    added
        .iter()
        .enumerate()
        .filter_map(|(place, parameter)| column(parameter).map(|column| (column, place)))
        .collect()
}

/// Scalar product of two columns of the rows that a factor stands for.
fn product(factor: &Factor, left: usize, right: usize) -> f64 {
    let size = left.min(right) + 1;
    dot(&factor.column(left)[..size], &factor.column(right)[..size])
}

/// Solves the added columns' equations one by one (Cholesky); a column with nothing left is left out and gets
/// zero. `None` if all are.
fn solve_heard(left: &[f64], gram: &[f64], right: &[f64]) -> Option<Vec<f64>> {
    let k = right.len();
    let mut triangle = vec![0.0; k * k];
    let mut heard = Vec::with_capacity(k);
    let mut reduced = Vec::with_capacity(k);
    for column in 0..k {
        let mut rest = left[column * k + column];
        let mut along = Vec::with_capacity(heard.len());
        for (place, &before) in heard.iter().enumerate() {
            let known: f64 = (0..place).map(|other| along[other] * triangle[place * k + other]).sum();
            let entry: f64 = (left[column * k + before] - known) / triangle[place * k + place];
            rest -= entry * entry;
            along.push(entry);
        }
        if rest <= ABSORBED * ABSORBED * gram[column * k + column] || rest <= 0.0 {
            continue;
        }
        let place = heard.len();
        let known: f64 = along.iter().zip(&reduced).map(|(a, b): (&f64, &f64)| a * b).sum();
        triangle[place * k..place * k + place].copy_from_slice(&along);
        triangle[place * k + place] = rest.sqrt();
        reduced.push((right[column] - known) / rest.sqrt());
        heard.push(column);
    }
    if heard.is_empty() {
        return None;
    }
    let mut values = vec![0.0; k];
    for place in (0..heard.len()).rev() {
        let known: f64 =
            (place + 1..heard.len()).map(|other| triangle[other * k + place] * values[heard[other]]).sum();
        values[heard[place]] = (reduced[place] - known) / triangle[place * k + place];
    }
    Some(values)
}

/// `x := R⁻ᵀ x`.
fn solve_transposed(factor: &Factor, x: &mut [f64]) {
    for column in 0..x.len() {
        let entries = factor.column(column);
        let known = dot(&entries[..column], &x[..column]);
        x[column] = (x[column] - known) / entries[column];
    }
}

/// `x := R⁻¹ x`.
fn solve(factor: &Factor, x: &mut [f64]) {
    for column in (0..x.len()).rev() {
        let entries = factor.column(column);
        x[column] /= entries[column];
        let value = x[column];
        x[..column].iter_mut().zip(&entries[..column]).for_each(|(x, entry)| *x -= entry * value);
    }
}

fn dot(left: &[f64], right: &[f64]) -> f64 {
    left.iter().zip(right).map(|(a, b)| a * b).sum()
}

#[cfg(test)]
mod tests {
    use super::super::evidence::Evidence;
    use phiw_dynamics::random_tree::RandomNumbers;
    use phiw_regressor::factor::FactorBuilder;
    use phiw_regressor::least_squares::{Group, GroupedFactor};

    /// Two torques over three parameters of a model and two candidates, the second of which nearly depends on
    /// the model.
    fn factors(random: &mut RandomNumbers) -> GroupedFactor {
        let mut number = || random.uniform(-1.0, 1.0);
        let columns = [vec![0, 1, 3, 4], vec![1, 2, 4]];
        let groups = columns.map(|parameters| {
            let mut builder = FactorBuilder::new(parameters.len() + 1);
            for _ in 0..60 {
                let mut row: Vec<f64> = (0..=parameters.len()).map(|_| number()).collect();
                if parameters.len() == 4 {
                    row[3] = row[0] - 2.0 * row[1] + 0.05 * row[3];
                }
                builder.push_row(&row).unwrap();
            }
            Group { parameters, factor: builder.factor() }
        });
        GroupedFactor::new(5, groups.to_vec()).unwrap()
    }

    #[test]
    fn screening_is_the_full_refit() {
        let mut random = RandomNumbers::new(3);
        for _ in 0..20 {
            let (train, held_out) = (factors(&mut random), factors(&mut random));
            let folds = vec![&train, &held_out];
            let evidence =
                Evidence::new(&train, &held_out, folds, 3, vec![true; 3], vec![1.3, 0.4], None).unwrap();
            for (added, rows) in [(vec![3], vec![0]), (vec![4], vec![0, 1]), (vec![3, 4], vec![0, 1])] {
                let full = evidence.refit(&added, &rows).unwrap().unwrap();
                let quick = evidence.screen(&added, &rows).unwrap().unwrap();
                let pairs = full.parameters.iter().zip(&quick.parameters);
                let sums =
                    full.train.iter().zip(&quick.train).chain(full.held_out.iter().zip(&quick.held_out));
                for (full, quick) in pairs.chain(sums) {
                    assert!((full - quick).abs() <= 1e-9 * full.abs().max(1.0), "{full} {quick}");
                }
            }
        }
    }
}
