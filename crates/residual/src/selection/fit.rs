//! A weighted fit of some parameters, from products.

use super::blocks::Blocks;
use super::problem::{Problem, Torque};

/// A column of the model with less than this share of its squared norm left beside those before it is
/// undetermined.
const DEPENDENT: f64 = 1e-10;
/// The same for a candidate's column: what is left of it is rounding, or the model's own error.
pub(super) const ABSORBED: f64 = 4e-6;
/// Share of all rows that say what is in the model in any case, where stretches are left out.
const KNOWN: f64 = 0.01;
/// Share of all rows that draws what was found to where it is absent, where folds are left out: so little
/// that what the others tell stays, but for a ten-thousandth of it.
const DRAWN: f64 = 1e-4;
/// Share of a variance that must be left beside others' for the constraint's Schur complement to be exact:
/// below it is rounding.
const TOLD_APART: f64 = 1e-9;
/// Times that the weights are renewed from the residual.
const ITERATIONS: usize = 4;
/// Weights that change by less are settled: the criterion changes by the square of that for each parameter.
const SETTLED: f64 = 1e-2;

/// The least-squares fit with each torque weighted by its effective rows over its residual: the smallest Σ
/// n_e·log(rss).
#[derive(Clone, Debug)]
pub(crate) struct Fit {
    /// The parameters that are fitted, in the order of the system.
    pub active: Vec<usize>,
    /// For each parameter its place in `active`.
    pub place: Vec<Option<usize>>,
    /// For each torque (column, place) of the active parameters that act on it.
    pub own: Vec<Vec<(usize, usize)>>,
    /// For each torque (column, value) of the absent ones whose absence is a value.
    absent: Vec<Vec<(usize, f64)>>,
    /// Whether the rows determine it beside those before it.
    pub determined: Vec<bool>,
    /// The system's Cholesky factor.
    system: Blocks,
    /// L⁻¹ of the right-hand side.
    pub half: Vec<f64>,
    /// The value of every parameter: those that are not in the fit are absent.
    pub values: Vec<f64>,
    /// Residual sum of squares of each torque.
    pub rss: Vec<f64>,
    /// Weight of each torque's squares.
    pub weights: Vec<f64>,
    /// What the prior's squares are multiplied by: the share of its rows that is independent.
    pub prior_weight: f64,
}

impl Fit {
    /// Fits `active` parameters, of which the first `model` are the model's; the others may be absorbed.
    /// `rows` are the effective rows of each torque.
    pub fn new(problem: &Problem, active: Vec<usize>, rows: &[f64], start: Option<&Fit>) -> Self {
        let mut fit = Fit::prepared(problem, active, rows, start);
        for _ in 0..ITERATIONS {
            fit.weights =
                rows.iter().zip(&fit.rss).map(|(rows, rss)| rows / rss.max(f64::MIN_POSITIVE)).collect();
            fit.solve(problem, None);
            let rss: Vec<f64> =
                (0..problem.torques.len()).map(|torque| fit.residual(problem, torque)).collect();
            let change =
                rss.iter().zip(&fit.rss).map(|(new, old)| (new / old - 1.0).abs()).fold(0.0, f64::max);
            fit.rss = rss;
            if change < SETTLED {
                break;
            }
        }
        fit
    }

    /// The same with the weights of `start`, which was fitted to the same `rows`: the triangle of the
    /// parameters that both begin with is taken over, so that a few parameters more or less cost the square
    /// of their number and not the cube.
    pub fn beside(problem: &Problem, active: Vec<usize>, rows: &[f64], start: &Fit) -> Self {
        let mut fit = Fit::prepared(problem, active, rows, Some(start));
        fit.weights.clone_from(&start.weights);
        fit.solve(problem, Some(start));
        fit.rss = (0..problem.torques.len()).map(|torque| fit.residual(problem, torque)).collect();
        fit
    }

    /// The same weights and rows with some of the active parameters absent: values and residuals only, by the
    /// constraint's Schur complement. `None` where these parameters are not told apart.
    pub fn pinned(&self, problem: &Problem, places: &[usize]) -> Option<Self> {
        let places: Vec<usize> = places.iter().copied().filter(|&place| self.determined[place]).collect();
        let column = |&place: &usize| {
            let mut unit = vec![0.0; self.active.len()];
            unit[place] = 1.0;
            self.backward(self.forward(&unit))
        };
        let inverse: Vec<Vec<f64>> = places.iter().map(column).collect();
        let change: Vec<f64> = places
            .iter()
            .map(|&place| self.values[self.active[place]] - problem.absent[self.active[place]])
            .collect();
        let solved = solve_block(&places, &inverse, &change, TOLD_APART)?;
        let mut values = self.values.clone();
        for (at, &parameter) in self.active.iter().enumerate().filter(|(at, _)| self.determined[*at]) {
            let change: f64 = inverse.iter().zip(&solved).map(|(column, value)| column[at] * value).sum();
            values[parameter] -= change;
        }
        places.iter().for_each(|&place| values[self.active[place]] = problem.absent[self.active[place]]);
        let mut fit = Fit {
            active: self.active.clone(),
            place: self.place.clone(),
            own: self.own.clone(),
            absent: self.absent.clone(),
            determined: self.determined.clone(),
            system: Blocks::default(),
            half: Vec::new(),
            values,
            rss: Vec::new(),
            weights: self.weights.clone(),
            prior_weight: self.prior_weight,
        };
        fit.rss = (0..problem.torques.len()).map(|torque| fit.residual(problem, torque)).collect();
        Some(fit)
    }

    /// The same as [`Fit::pinned`] by another factorisation, on the rows of all folds but some: values only.
    /// It costs the cube of the parameters' number, and tells apart whatever the rows do.
    pub fn without_parameters(&self, problem: &Problem, places: &[usize], folds: &[usize]) -> Self {
        let stays = self.active.iter().enumerate().filter(|(place, _)| !places.contains(place));
        let active: Vec<usize> = stays.map(|(_, &parameter)| parameter).collect();
        let mut fit = Fit::prepared(problem, active, &[], Some(self));
        fit.weights.clone_from(&self.weights);
        fit.prior_weight = self.prior_weight;
        fit.values.clone_from(&self.values);
        fit.solve_rows(problem, None, folds);
        fit
    }

    /// The same parameters fitted with the same weights to the rows of all folds but some.
    ///
    /// What is in the model in any case, the rigid body and what is declared, is known beside these rows as
    /// if a small share of all rows had said what it is: a joint that moves in few stretches moves in none of
    /// the others, and what these make of its body would hide what is to be judged.
    ///
    /// Everything else is drawn to where it is absent as if a smaller share of all rows had said so, in every
    /// direction by as much: the end of an arc that is reached in one stretch only is not known from the
    /// others, and what is hard to tell from something else is known there as well as here.
    pub fn without(&self, problem: &Problem, folds: &[usize]) -> Self {
        let mut fit = self.clone();
        fit.determined.fill(true);
        fit.solve_rows(problem, None, folds);
        fit
    }

    /// Everything but the solution.
    fn prepared(problem: &Problem, active: Vec<usize>, rows: &[f64], start: Option<&Fit>) -> Self {
        let mut place = vec![None; problem.parameters];
        active.iter().enumerate().for_each(|(at, &parameter)| place[parameter] = Some(at));
        let all_rows: f64 = problem.torques.iter().map(|torque| torque.whole.rows()).sum();
        let of_torque = |rows: &Torque| -> Vec<(usize, usize)> {
            let places = rows.parameters.iter().enumerate();
            places.filter_map(|(column, &parameter)| Some((column, place[parameter]?))).collect()
        };
        let absent_of = |rows: &Torque| -> Vec<(usize, f64)> {
            let parameters = rows.parameters.iter().enumerate();
            let absent = parameters.filter(|&(_, &parameter)| place[parameter].is_none());
            absent
                .map(|(column, &parameter)| (column, problem.absent[parameter]))
                .filter(|(_, value)| *value != 0.0)
                .collect()
        };
        Fit {
            own: problem.torques.iter().map(of_torque).collect(),
            absent: problem.torques.iter().map(absent_of).collect(),
            determined: vec![true; active.len()],
            active,
            place,
            system: Blocks::default(),
            half: Vec::new(),
            values: problem.absent.clone(),
            rss: match start {
                Some(start) => start.rss.clone(),
                None => problem.torques.iter().map(|torque| torque.whole.right_hand_side()).collect(),
            },
            weights: Vec::new(),
            prior_weight: rows.iter().sum::<f64>() / all_rows.max(1.0),
        }
    }

    /// (column, value) of all parameters with a value in a torque.
    pub fn columns(&self, torque: usize) -> Vec<(usize, f64)> {
        let fitted =
            self.own[torque].iter().map(|&(column, place)| (column, self.values[self.active[place]]));
        let valued = fitted.filter(|(_, value)| *value != 0.0);
        valued.chain(self.absent[torque].iter().copied()).collect()
    }

    fn residual(&self, problem: &Problem, torque: usize) -> f64 {
        problem.torques[torque].whole.residual(&self.columns(torque))
    }

    /// Products of a parameter's columns with those of the active ones, and with the right-hand side less
    /// what is absent.
    pub fn products(
        &self,
        problem: &Problem,
        parameter: usize,
        torques: &[usize],
        out: &mut [f64],
    ) -> (f64, f64) {
        out.fill(0.0);
        let (mut own, mut right) = (0.0, 0.0);
        for &torque in torques {
            let rows = &problem.torques[torque];
            let Some(column) = rows.column(parameter) else { continue };
            let weight = self.weights[torque];
            let products = rows.whole.column(column);
            own += weight * products[column];
            right += weight * products[rows.parameters.len()];
            self.own[torque].iter().for_each(|&(other, place)| out[place] += weight * products[other]);
            let absent = self.absent[torque].iter().filter(|(other, _)| *other != column);
            right -= weight * absent.map(|&(other, value)| products[other] * value).sum::<f64>();
        }
        (own, right)
    }

    /// Takes the rows of the triangle that are those of `start` from there; the weights must be the same.
    fn solve(&mut self, problem: &Problem, start: Option<&Fit>) {
        self.solve_rows(problem, start, &[]);
    }

    /// The same with the rows of all folds but `left_out`.
    fn solve_rows(&mut self, problem: &Problem, start: Option<&Fit>, left_out: &[usize]) {
        let size = self.active.len();
        let same = |start: &Fit| {
            self.active.iter().zip(&start.active).take_while(|(own, other)| own == other).count()
        };
        let kept = start.map_or(0, same);
        let mut system = self.of_zeros(problem);
        if let Some(start) = start {
            system.keep(&start.system, kept);
        }
        let mut right = vec![0.0; size];
        let given = if left_out.is_empty() { Vec::new() } else { problem.given() };
        for (torque, rows) in problem.torques.iter().enumerate() {
            let weight = self.weights[torque];
            // Most columns of a torque are candidates', which nothing here asks of.
            let fitted = self.own[torque].iter().map(|(column, _)| *column);
            let absent = self.absent[torque].iter().map(|(column, _)| *column);
            let asked: Vec<usize> = fitted.chain(absent).chain([rows.parameters.len()]).collect();
            let mut fewer = vec![0.0; if left_out.is_empty() { 0 } else { rows.parameters.len() + 1 }];
            for &(column, place) in &self.own[torque] {
                let whole = rows.whole.column(column);
                let mut products = whole;
                if !left_out.is_empty() {
                    let is_given = |place: usize| given[self.active[place]];
                    asked.iter().for_each(|&other| fewer[other] = whole[other]);
                    for &fold in left_out {
                        let own = rows.folds[fold].column(column);
                        asked.iter().for_each(|&other| fewer[other] -= own[other]);
                    }
                    for &(other, at) in &self.own[torque] {
                        let parameter = self.active[at];
                        let share = if is_given(place) && is_given(at) { KNOWN } else { DRAWN };
                        let value =
                            if is_given(at) { self.values[parameter] } else { problem.absent[parameter] };
                        let known = share * whole[other];
                        fewer[other] += known;
                        right[place] += weight * known * value;
                    }
                    products = &fewer;
                }
                // What is above the diagonal is not looked at, but a link is beside all blocks.
                if system.is_link(place) {
                    for &(other, at) in &self.own[torque] {
                        if at <= place || !system.is_link(at) {
                            system.add(place, at, weight * products[other]);
                        }
                    }
                } else if place >= kept {
                    let below = self.own[torque].iter().filter(|(_, at)| *at <= place);
                    below.for_each(|&(other, at)| system.add(place, at, weight * products[other]));
                }
                let absent: f64 =
                    self.absent[torque].iter().map(|&(other, value)| products[other] * value).sum();
                right[place] += weight * (products[rows.parameters.len()] - absent);
            }
        }
        if let Some(prior) = &problem.prior {
            let last = prior.parameters.len();
            for (a, &parameter) in prior.parameters.iter().enumerate() {
                let Some(at) = self.place[parameter] else { continue };
                let products = prior.products.column(a);
                right[at] += self.prior_weight * products[last];
                for (b, other) in prior.parameters.iter().enumerate().filter(|_| at >= kept) {
                    if let Some(other) = self.place[*other].filter(|other| *other <= at) {
                        system.add(at, other, self.prior_weight * products[b]);
                    }
                }
            }
        }
        let model = problem.model.len();
        let least = |row: usize| if row < model { DEPENDENT } else { ABSORBED };
        system.factor(kept, &mut self.determined, least);
        self.system = system;
        self.half = self.forward(&right);
        let solution = self.backward(self.half.clone());
        self.values.clone_from(&problem.absent);
        for ((&parameter, value), determined) in self.active.iter().zip(&solution).zip(&self.determined) {
            self.values[parameter] = if *determined { *value } else { problem.absent[parameter] };
        }
    }

    /// A system of zeros, in blocks of limbs. What was known before is of the whole robot.
    fn of_zeros(&self, problem: &Problem) -> Blocks {
        let size = self.active.len();
        if problem.prior.is_some() {
            return Blocks::of_zeros(size, size, &[(0..size).collect()]);
        }
        let of_torque = |(own, rows): (&Vec<(usize, usize)>, &Torque)| {
            let acts = |column: usize| rows.whole.column(column)[column] != 0.0;
            own.iter().filter(|(column, _)| acts(*column)).map(|&(_, place)| place).collect()
        };
        let of_torques: Vec<Vec<usize>> = self.own.iter().zip(&problem.torques).map(of_torque).collect();
        Blocks::of_zeros(size, problem.model.len(), &of_torques)
    }

    /// L⁻¹·x.
    pub fn forward(&self, x: &[f64]) -> Vec<f64> {
        self.system.forward(x)
    }

    /// L⁻¹·x for several x.
    pub fn forward_all(&self, all: &[Vec<f64>]) -> Vec<Vec<f64>> {
        self.system.forward_all(all)
    }

    /// L⁻ᵀ·y.
    pub fn backward(&self, y: Vec<f64>) -> Vec<f64> {
        self.system.backward(y)
    }

    /// What the prior says against the values: its weighted squares.
    pub fn prior_squares(&self, problem: &Problem) -> f64 {
        let Some(prior) = &problem.prior else { return 0.0 };
        let values: Vec<(usize, f64)> = prior
            .parameters
            .iter()
            .enumerate()
            .map(|(at, &parameter)| (at, self.values[parameter]))
            .collect();
        self.prior_weight * prior.products.residual(&values)
    }
}

#[inline(always)]
pub(super) fn dot(left: &[f64], right: &[f64]) -> f64 {
    // Many sums, so that the additions do not wait for each other and fill the widest registers.
    let mut sums = [0.0; 16];
    let (left_parts, right_parts) = (left.chunks_exact(16), right.chunks_exact(16));
    let rest: f64 = left_parts.remainder().iter().zip(right_parts.remainder()).map(|(a, b)| a * b).sum();
    for (a, b) in left_parts.zip(right_parts) {
        for lane in 0..16 {
            sums[lane] += a[lane] * b[lane];
        }
    }
    // Halved and halved again: as one chain the sixteen additions would take longer than all before them.
    for half in [8, 4, 2, 1] {
        for lane in 0..half {
            sums[lane] += sums[lane + half];
        }
    }
    sums[0] + rest
}

/// (Z_oo)⁻¹·x for some places o, from their columns of Z, by Cholesky's factor of the small block. `None`
/// where of one less than `least` of its square is left beside those before it.
pub(super) fn solve_block(own: &[usize], inverse: &[Vec<f64>], x: &[f64], least: f64) -> Option<Vec<f64>> {
    let count = own.len();
    let mut l = vec![0.0; count * count];
    for row in 0..count {
        for column in 0..=row {
            let known: f64 = (0..column).map(|k| l[row * count + k] * l[column * count + k]).sum();
            let rest = inverse[row][own[column]] - known;
            if row == column {
                if rest.is_nan() || rest <= least * inverse[row][own[column]] {
                    return None;
                }
                l[row * count + row] = rest.sqrt();
            } else {
                l[row * count + column] = rest / l[column * count + column];
            }
        }
    }
    let mut y = x.to_vec();
    for row in 0..count {
        let known: f64 = (0..row).map(|k| l[row * count + k] * y[k]).sum();
        y[row] = (y[row] - known) / l[row * count + row];
    }
    for row in (0..count).rev() {
        let known: f64 = (row + 1..count).map(|k| l[k * count + row] * y[k]).sum();
        y[row] = (y[row] - known) / l[row * count + row];
    }
    Some(y)
}
