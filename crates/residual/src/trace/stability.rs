//! Would other motion have led to another name? The selection again on bootstrap draws of the training folds
//! (Efron 1979).

use super::choice::near_score;
use super::evidence::ABSORBED;
use super::search::Fitted;
use phiw_regressor::factor::Factor;
use phiw_regressor::least_squares::Group;

/// Draws.
pub(super) const DRAWS: usize = 10;

/// A candidate, or an effect that is in the model, as it enters the draws.
pub(super) struct Finalist {
    /// Its parameters among the design's.
    pub parameters: Vec<usize>,
    /// What it pays for them.
    pub penalty: f64,
    /// The smaller, the simpler.
    pub complexity: (usize, usize),
}

/// For each draw the place of the finalist that would have been chosen beside the `determined` parameters of
/// the model; `None` where none gains anything.
///
/// A draw takes as many training folds as there are, with replacement. Its refits work on the folds' normal
/// equations, which are small sums once the folds' factors are there; half the digits are enough to rank.
pub(super) fn winners(
    fitted: &Fitted,
    determined: &[bool],
    prior: Option<&Factor>,
    finalists: &[Finalist],
    training_folds: usize,
    inflation: f64,
) -> Vec<Option<usize>> {
    let bench = Bench::new(fitted, determined, prior, finalists, training_folds);
    let mut dice = Dice(SEED);
    (0..DRAWS)
        .map(|_| {
            let mut times = vec![0.0; training_folds];
            (0..training_folds).for_each(|_| times[dice.below(training_folds)] += 1.0);
            bench.winner(&times, finalists, inflation)
        })
        .collect()
}

const SEED: u64 = 0x9e37_79b9_7f4a_7c15;

/// A linear congruential generator (Knuth's constants): ten draws of ten need no better one.
struct Dice(u64);

impl Dice {
    fn below(&mut self, count: usize) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 33) as usize) % count
    }
}

/// Scalar products of the columns of one torque over one fold: the model's, the finalists', and the torque as
/// the last.
#[derive(Clone)]
struct Products {
    size: usize,
    /// Symmetric, `size` × `size`.
    gram: Vec<f64>,
    rows: f64,
}

impl Products {
    fn of(factor: &Factor, columns: &[usize]) -> Self {
        let size = columns.len();
        let mut gram = vec![0.0; size * size];
        for (a, &left) in columns.iter().enumerate() {
            for (b, &right) in columns.iter().enumerate().skip(a) {
                let length = left.min(right) + 1;
                let product = dot(&factor.column(left)[..length], &factor.column(right)[..length]);
                (gram[a * size + b], gram[b * size + a]) = (product, product);
            }
        }
        Products { size, gram, rows: factor.rows() as f64 }
    }

    fn add(&mut self, other: &Self, times: f64) {
        self.gram.iter_mut().zip(&other.gram).for_each(|(sum, value)| *sum += times * value);
        self.rows += times * other.rows;
    }

    /// ‖f − Φw‖².
    fn residual(&self, w: &[f64]) -> f64 {
        let mut extended = w.to_vec();
        extended.push(-1.0);
        (0..self.size)
            .filter(|&row| extended[row] != 0.0)
            .map(|row| extended[row] * dot(&self.gram[row * self.size..(row + 1) * self.size], &extended))
            .sum()
    }
}

/// One torque: its columns' places in the system, and its products over the folds.
struct Row {
    /// For each column but the last, the unknown that it belongs to.
    unknowns: Vec<usize>,
    folds: Vec<Products>,
    held_out: Products,
    square_weight: f64,
}

struct Bench {
    rows: Vec<Row>,
    /// Determined parameters of the model: the first unknowns.
    model: usize,
    /// For each finalist its unknowns.
    added: Vec<Vec<usize>>,
    unknowns: usize,
    /// A held model's normal equations over the model's unknowns, the right-hand side behind them.
    prior: Option<Products>,
}

impl Bench {
    fn new(
        fitted: &Fitted,
        determined: &[bool],
        prior: Option<&Factor>,
        finalists: &[Finalist],
        training_folds: usize,
    ) -> Self {
        let stage = &fitted.stage;
        let mut place = vec![None; stage.train.parameter_count()];
        let mut unknowns = 0;
        for parameter in (0..stage.model_size()).filter(|&parameter| determined[parameter]) {
            place[parameter] = Some(unknowns);
            unknowns += 1;
        }
        let model = unknowns;
        let mut added = Vec::with_capacity(finalists.len());
        for finalist in finalists {
            let first = unknowns;
            for &parameter in &finalist.parameters {
                place[parameter] = Some(unknowns);
                unknowns += 1;
            }
            added.push((first..unknowns).collect());
        }
        let row = |row: usize| {
            let group = |factors: &phiw_regressor::least_squares::GroupedFactor| -> Group {
                factors.groups()[row].clone()
            };
            let whole = group(&stage.held_out);
            let columns: Vec<usize> = (0..whole.parameters.len())
                .filter(|&column| place[whole.parameters[column]].is_some())
                .chain([whole.factor.parameters()])
                .collect();
            let of = |factor: &Factor| Products::of(factor, &columns);
            Row {
                unknowns: whole.parameters.iter().filter_map(|&parameter| place[parameter]).collect(),
                folds: stage.folds[..training_folds]
                    .iter()
                    .map(|fold| of(&fold.groups()[row].factor))
                    .collect(),
                held_out: of(&whole.factor),
                square_weight: fitted.weights[row] * fitted.weights[row],
            }
        };
        let all: Vec<usize> = (0..=model).collect();
        Bench {
            rows: (0..stage.train.groups().len()).map(row).collect(),
            model,
            added,
            unknowns,
            prior: prior.map(|prior| Products::of(prior, &all)),
        }
    }

    fn winner(&self, times: &[f64], finalists: &[Finalist], inflation: f64) -> Option<usize> {
        let drawn: Vec<Products> = self
            .rows
            .iter()
            .map(|row| {
                let size = row.held_out.size;
                let mut sum = Products { size, gram: vec![0.0; size * size], rows: 0.0 };
                row.folds.iter().zip(times).for_each(|(fold, &times)| sum.add(fold, times));
                sum
            })
            .collect();
        let system = self.system(&drawn);
        let whole = Whole::solve(&system, self.model, self.unknowns)?;
        let squares = |w: &[f64]| -> Vec<(f64, f64)> {
            let of_row = |(row, drawn): (&Row, &Products)| {
                let own: Vec<f64> = row.unknowns.iter().map(|&unknown| w[unknown]).collect();
                (drawn.residual(&own), row.held_out.residual(&own))
            };
            self.rows.iter().zip(&drawn).map(of_row).collect()
        };
        let mut w = vec![0.0; self.unknowns];
        w[..self.model].copy_from_slice(&whole.solution);
        let before = squares(&w);
        let score = |place: usize| -> Option<f64> {
            let w = whole.with(&system, &self.added[place], self.unknowns)?;
            let after = squares(&w);
            let gain: f64 = self
                .rows
                .iter()
                .zip(&drawn)
                .zip(before.iter().zip(&after))
                .map(|((row, drawn), (before, after))| {
                    let part = |rows: f64, before: f64, after: f64| match before > 0.0 && after > 0.0 {
                        true => 0.5 * rows * (before / after).ln(),
                        false => 0.0,
                    };
                    part(drawn.rows, before.0, after.0) + part(row.held_out.rows, before.1, after.1)
                })
                .sum();
            Some(gain / inflation - finalists[place].penalty)
        };
        let scores: Vec<Option<f64>> = (0..finalists.len()).map(score).collect();
        let best = scores.iter().flatten().copied().fold(0.0, f64::max);
        let near = |place: &usize| {
            scores[*place].is_some_and(|score| score > 0.0 && score >= best - near_score(best))
        };
        (0..finalists.len()).filter(near).min_by_key(|&place| finalists[place].complexity)
    }

    /// The weighted normal equations over all unknowns, the right-hand side behind them.
    fn system(&self, drawn: &[Products]) -> Vec<f64> {
        let width = self.unknowns + 1;
        let mut system = vec![0.0; width * width];
        let mut add = |products: &Products, unknowns: &[usize], weight: f64| {
            let targets: Vec<usize> = unknowns.iter().copied().chain([self.unknowns]).collect();
            for (a, &row) in targets.iter().enumerate() {
                for (b, &column) in targets.iter().enumerate() {
                    system[row * width + column] += weight * products.gram[a * products.size + b];
                }
            }
        };
        self.rows.iter().zip(drawn).for_each(|(row, drawn)| add(drawn, &row.unknowns, row.square_weight));
        let model: Vec<usize> = (0..self.model).collect();
        self.prior.iter().for_each(|prior| add(prior, &model, 1.0));
        system
    }
}

/// The model's normal equations, factored: L·Lᵀ of the scaled matrix.
struct Whole {
    triangle: Vec<f64>,
    scale: Vec<f64>,
    solution: Vec<f64>,
}

impl Whole {
    fn solve(system: &[f64], model: usize, unknowns: usize) -> Option<Self> {
        let width = unknowns + 1;
        let scale: Vec<f64> = (0..model).map(|place| 1.0 / system[place * width + place].sqrt()).collect();
        let mut triangle = vec![0.0; model * model];
        for row in 0..model {
            for column in 0..=row {
                let product = dot(
                    &triangle[row * model..row * model + column],
                    &triangle[column * model..column * model + column],
                );
                let rest = system[row * width + column] * scale[row] * scale[column] - product;
                triangle[row * model + column] = match row == column {
                    true if rest > 0.0 => rest.sqrt(),
                    true => return None,
                    false => rest / triangle[column * model + column],
                };
            }
        }
        let mut whole = Whole { triangle, scale, solution: Vec::new() };
        let right: Vec<f64> = (0..model).map(|row| system[row * width + unknowns]).collect();
        let half = whole.forward(&right);
        whole.solution = whole.backward(half);
        Some(whole)
    }

    /// L⁻¹ of the scaled right-hand side.
    fn forward(&self, right: &[f64]) -> Vec<f64> {
        let model = self.scale.len();
        let mut x: Vec<f64> = right.iter().zip(&self.scale).map(|(value, scale)| value * scale).collect();
        for row in 0..model {
            let known = dot(&self.triangle[row * model..row * model + row], &x[..row]);
            x[row] = (x[row] - known) / self.triangle[row * model + row];
        }
        x
    }

    /// L⁻ᵀ, scaled back.
    fn backward(&self, mut x: Vec<f64>) -> Vec<f64> {
        let model = self.scale.len();
        for row in (0..model).rev() {
            x[row] /= self.triangle[row * model + row];
            let value = x[row];
            for column in 0..row {
                x[column] -= self.triangle[row * model + column] * value;
            }
        }
        x.iter_mut().zip(&self.scale).for_each(|(value, scale)| *value *= scale);
        x
    }

    /// The solution with some unknowns beside the model's; those that the model absorbs are left out. `None`
    /// if all are.
    fn with(&self, system: &[f64], added: &[usize], unknowns: usize) -> Option<Vec<f64>> {
        let width = unknowns + 1;
        let model = self.scale.len();
        let column =
            |unknown: usize| -> Vec<f64> { (0..model).map(|row| system[row * width + unknown]).collect() };
        let right = self.forward(&column(unknowns));
        // Gram-Schmidt of the added columns beside the model, each with its products.
        let mut heard: Vec<(usize, Vec<f64>)> = Vec::new();
        let parts: Vec<Vec<f64>> = added.iter().map(|&unknown| self.forward(&column(unknown))).collect();
        let left = |a: usize, b: usize| system[added[a] * width + added[b]] - dot(&parts[a], &parts[b]);
        let mut reduced: Vec<f64> = Vec::new();
        for place in 0..added.len() {
            let mut along = Vec::with_capacity(heard.len() + 1);
            let mut rest = left(place, place);
            for (other, entries) in &heard {
                let known = dot(&along, &entries[..along.len()]);
                let entry = (left(place, *other) - known) / entries[along.len()];
                rest -= entry * entry;
                along.push(entry);
            }
            if rest <= ABSORBED * ABSORBED * system[added[place] * width + added[place]] || rest <= 0.0 {
                continue;
            }
            let remainder = system[added[place] * width + unknowns] - dot(&parts[place], &right);
            let known = dot(&along, &reduced);
            reduced.push((remainder - known) / rest.sqrt());
            along.push(rest.sqrt());
            heard.push((place, along));
        }
        if heard.is_empty() {
            return None;
        }
        let mut w = vec![0.0; unknowns];
        let mut half = right;
        for index in (0..heard.len()).rev() {
            let known: f64 =
                heard[index + 1..].iter().map(|(place, entries)| entries[index] * w[added[*place]]).sum();
            let value = (reduced[index] - known) / heard[index].1[index];
            w[added[heard[index].0]] = value;
            half.iter_mut().zip(&parts[heard[index].0]).for_each(|(x, part)| *x -= value * part);
        }
        w[..model].copy_from_slice(&self.backward(half));
        Some(w)
    }
}

fn dot(left: &[f64], right: &[f64]) -> f64 {
    left.iter().zip(right).map(|(a, b)| a * b).sum()
}
