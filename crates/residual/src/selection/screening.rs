//! A quick look at every hypothesis: what would be gained if its columns stood beside the model's (Schur's
//! complement).

use super::criterion::price;
use super::fit::{ABSORBED, Fit, dot};
use super::problem::{Member, Problem};
use rayon::prelude::*;

/// A member beside the model, to first order.
#[derive(Clone, Debug)]
pub(super) struct Screened {
    pub member: Member,
    /// What the criterion gains before the price of the choice.
    pub gain: f64,
}

/// Columns beside a model, with what the model does not absorb of them.
pub(super) struct Beside {
    /// For each column: L⁻¹ of its products with the model's columns.
    parts: Vec<Vec<f64>>,
    /// Products of the columns, and with the right-hand side.
    gram: Vec<f64>,
    right: Vec<f64>,
}

impl Beside {
    pub fn new(problem: &Problem, fit: &Fit, parameters: &[usize], torques: &[usize]) -> Self {
        Beside::each(problem, fit, &[parameters], torques).swap_remove(0)
    }

    /// Of several sets of columns, each by itself: as many as there are sets.
    pub fn each(problem: &Problem, fit: &Fit, sets: &[&[usize]], torques: &[usize]) -> Vec<Self> {
        let mut products = Vec::new();
        let (mut squares, mut right) = (Vec::new(), Vec::new());
        for &parameter in sets.iter().copied().flatten() {
            let mut own_products = vec![0.0; fit.active.len()];
            let (own, value) = fit.products(problem, parameter, torques, &mut own_products);
            products.push(own_products);
            squares.push(own);
            // What is there in the signals already is in the residual as less of it.
            right.push(value - own * problem.absent[parameter]);
        }
        let mut parts = fit.forward_all(&products).into_iter();
        let (mut squares, mut right) = (squares.into_iter(), right.into_iter());
        let of_set = |parameters: &&[usize]| {
            let count = parameters.len();
            let mut gram = vec![0.0; count * count];
            for (place, &parameter) in parameters.iter().enumerate() {
                gram[place * count + place] = squares.next().unwrap_or_default();
                for (other_place, &other) in parameters.iter().enumerate().take(place) {
                    let mut sum = 0.0;
                    for &torque in torques {
                        let rows = &problem.torques[torque];
                        if let (Some(a), Some(b)) = (rows.column(parameter), rows.column(other)) {
                            sum += fit.weights[torque] * rows.whole.column(a)[b];
                        }
                    }
                    gram[place * count + other_place] = sum;
                    gram[other_place * count + place] = sum;
                }
            }
            let parts = parts.by_ref().take(count).collect();
            Beside { parts, gram, right: right.by_ref().take(count).collect() }
        };
        sets.iter().map(of_set).collect()
    }

    /// What is left of two columns beside the model.
    pub fn left(&self, a: usize, b: usize) -> f64 {
        self.gram[a * self.right.len() + b] - dot(&self.parts[a], &self.parts[b])
    }

    /// L⁻¹ of the first column's products with the model's.
    pub fn into_part(self) -> Vec<f64> {
        self.parts.into_iter().next().unwrap_or_default()
    }

    /// The weighted squares that the columns take away, and their values (nothing for a column that is
    /// absorbed).
    pub fn solve(&self, fit: &Fit) -> (f64, Vec<Option<f64>>) {
        let count = self.right.len();
        let mut triangle: Vec<Vec<f64>> = Vec::new();
        let mut determined: Vec<usize> = Vec::new();
        let mut reduced: Vec<f64> = Vec::new();
        for column in 0..count {
            let mut along: Vec<f64> = Vec::with_capacity(determined.len() + 1);
            for (place, &before) in determined.iter().enumerate() {
                let known = dot(&along, &triangle[place][..place]);
                along.push((self.left(column, before) - known) / triangle[place][place]);
            }
            let norm = self.gram[column * count + column];
            let rest = self.left(column, column) - dot(&along, &along);
            if rest <= ABSORBED * norm || rest <= 0.0 {
                continue;
            }
            let right = self.right[column] - dot(&self.parts[column], &fit.half);
            reduced.push((right - dot(&along, &reduced)) / rest.sqrt());
            along.push(rest.sqrt());
            triangle.push(along);
            determined.push(column);
        }
        let mut values = vec![None; count];
        for place in (0..determined.len()).rev() {
            let known: f64 = (place + 1..determined.len())
                .map(|other| triangle[other][place] * values[determined[other]].unwrap_or(0.0))
                .sum();
            values[determined[place]] = Some((reduced[place] - known) / triangle[place][place]);
        }
        (reduced.iter().map(|value| value * value).sum(), values)
    }
}

/// What the criterion gains, to first order, where `squares` weighted squares are taken from what a fit
/// leaves of torques of `rows` effective rows.
pub(super) fn gain_of(fit: &Fit, squares: f64, rows: f64, torques: &[usize]) -> f64 {
    // As many as there are rows only where the weights are the fit's own.
    let all: f64 = torques.iter().map(|&torque| fit.weights[torque] * fit.rss[torque]).sum();
    -rows * (-(squares / all.max(f64::MIN_POSITIVE)).min(1.0 - 1e-9)).ln_1p()
}

/// What the criterion would gain if nothing that counts were left of the torques.
pub(super) fn most_of(problem: &Problem, fit: &Fit, rows: &[f64], torques: &[usize]) -> f64 {
    let of_torque = |&torque: &usize| {
        let own = &problem.torques[torque];
        if own.least > 0.0 {
            rows[torque] * (own.mean_square(fit.rss[torque]) / own.least).ln().max(0.0)
        } else {
            f64::INFINITY
        }
    };
    torques.iter().map(of_torque).sum()
}

/// For every hypothesis of `open` the variant that gains most within its bounds, where one gains anything;
/// best first.
pub(super) fn screen(problem: &Problem, fit: &Fit, rows: &[f64], open: &[usize]) -> Vec<Screened> {
    let of_hypothesis = |&hypothesis: &usize| -> Option<Screened> {
        let own = &problem.hypotheses[hypothesis];
        let effective: f64 = own.torques.iter().map(|&torque| rows[torque]).sum();
        let most = most_of(problem, fit, rows, &own.torques);
        if most <= 0.0 {
            return None;
        }
        // Which variant is the best is asked before what is as good as none is taken off, and where what is
        // left of its torques would be negative to first order, by the squares: that many are good enough is
        // no reason to take any of them.
        let of_variant = |(variant, beside): (usize, &Beside)| -> Option<([f64; 2], Screened)> {
            let member = Member { hypothesis, variant };
            let (squares, values) = beside.solve(fit);
            let bounds = own.variants[variant].bounds.iter();
            let within = values
                .iter()
                .zip(bounds)
                .all(|(value, (low, high))| value.is_none_or(|value| *low <= value && value <= *high));
            let whole = gain_of(fit, squares, effective, &own.torques);
            let price = price(problem, member, None, rows);
            let gain = whole.min(most) - price;
            let gains = within && values.iter().any(Option::is_some) && gain > 0.0;
            gains.then_some(([whole - price, squares], Screened { member, gain }))
        };
        let sets: Vec<&[usize]> = own.variants.iter().map(|variant| variant.parameters.as_slice()).collect();
        let beside = Beside::each(problem, fit, &sets, &own.torques);
        let variants = beside.iter().enumerate().filter_map(of_variant);
        let better = |a: &[f64; 2], b: &[f64; 2]| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1]));
        variants.max_by(|a, b| better(&a.0, &b.0)).map(|(_, screened)| screened)
    };
    let mut screened: Vec<Screened> = open.par_iter().filter_map(of_hypothesis).collect();
    screened.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    screened
}

/// Hypotheses of which nothing is left beside the model, whatever their variant.
pub(super) fn unidentifiable(problem: &Problem, fit: &Fit, open: &[usize]) -> Vec<usize> {
    let is_silent = |hypothesis: &&usize| {
        let own = &problem.hypotheses[**hypothesis];
        own.variants.iter().all(|variant| {
            let beside = Beside::new(problem, fit, &variant.parameters, &own.torques);
            beside.solve(fit).1.iter().all(Option::is_none)
        })
    };
    open.par_iter().filter(is_silent).copied().collect()
}
