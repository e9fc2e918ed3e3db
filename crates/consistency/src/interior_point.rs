//! The search: a primal-dual interior-point method with Mehrotra's predictor and corrector.
//!
//! Every matrix X that has to be positive definite has a dual Z. On the central path X·Z = τ·1: of
//! constraints τ goes to zero, of bodies it stops at the prior's weight λ, where Z = λP⁻¹ makes the path's
//! point the optimum. Steps are Newton's with the Nesterov–Todd scaling (Todd, Toh & Tütüncü, "On the
//! Nesterov–Todd direction in semidefinite programming", 1998; Mehrotra 1992 for the two steps).

use crate::block::Scaled;
use crate::certificate::gap;
use crate::constraint::MatrixConstraint;
use crate::newton::{Equations, Frame, coordinates, dot, matrix_of, ridge};
use crate::problem::Problem;
use crate::pseudo_inertia::parameters_of;
use crate::small_matrix::Square;
use crate::start::{extras_start, scale_start};
use crate::{ConsistencyError, PARAMETERS_PER_BODY, PseudoInertia};
use faer::Mat;

/// When the search ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Gap, in units of one plus the optimum, at which the search ends. Parameters are then exact to far
    /// below their standard deviations, which a gap of one half would move by one.
    pub tolerance: f64,
    /// Gap, in the same units, up to which an optimum is called certified. Above `tolerance`, since rounding
    /// can end a search early.
    pub certified: f64,
    /// Newton steps at most. Some twenty are needed; a problem of numbers near the limits of a double takes
    /// more.
    pub iterations: usize,
}

impl Default for Settings {
    fn default() -> Self {
        Settings { tolerance: 1e-13, certified: 1e-6, iterations: 100 }
    }
}

/// The optimum.
#[derive(Clone, Debug, PartialEq)]
pub struct Solution {
    /// Standard parameters, ten for each body: every body possible.
    pub standard: Vec<f64>,
    /// Extras, within their constraints.
    pub extras: Vec<f64>,
    /// The prior's weight λ.
    pub weight: f64,
    /// ½‖Ax − b‖² + λ Σ D.
    pub objective: f64,
    /// ½‖Ax − b‖².
    pub misfit: f64,
    /// Σ D, the divergence from the priors.
    pub divergence: f64,
    /// The objective is at most this far above the least that is possible; proven by a dual point, whatever
    /// the search did.
    pub gap: f64,
    /// Whether the gap is as small as [`Settings::certified`] asks.
    pub certified: bool,
    /// Newton steps.
    pub iterations: usize,
}

/// The target of the complementarity is at most this share of its present value.
const MOST_CENTRING: f64 = 0.9;
/// Share of the way to the boundary that a step goes at least, and 0.09 more where the first direction goes
/// all the way (Toh, Todd & Tütüncü, "SDPT3", 1999).
const STAY_INSIDE: f64 = 0.9;
/// A step shorter than this gives way to one back to the central path.
const JAMMED: f64 = 0.3;
/// Certificates that are no better than half the last one, after which rounding has the say.
const IN_VAIN: usize = 3;
/// Complementarity of all constraints, over the accuracy, from which on the optimum may be near.
const WORTH_A_CERTIFICATE: f64 = 1e3;

pub(crate) struct State<'a> {
    pub problem: &'a Problem,
    pub weight: f64,
    pub ridge: Vec<f64>,
    pub x: Vec<f64>,
    /// Duals of the bodies and of the constraints.
    body_duals: Vec<Square>,
    pub duals: Vec<Square>,
}

/// The scalings of all blocks, bodies first.
struct Blocks {
    scaled: Vec<Scaled>,
    bodies: usize,
}

/// A direction, with its changes of X and of Z in each block's scaled coordinates.
struct Direction {
    unknowns: Vec<f64>,
    primal: Vec<Square>,
    dual: Vec<Square>,
}

/// How carefully the central path is followed: fast first, and more closely where that has gone astray.
struct Care {
    /// Factor of the complementarity at the start.
    start: f64,
    /// The target of the complementarity is at least this share of its present value.
    centring: f64,
}

const CARE: [Care; 3] = [
    Care { start: 1.0, centring: 1e-3 },
    Care { start: 100.0, centring: 0.1 },
    Care { start: 1e4, centring: 0.5 },
];

pub(crate) fn solve(
    problem: &Problem,
    weight: f64,
    settings: &Settings,
) -> Result<Solution, ConsistencyError> {
    let [fast, careful @ ..] = &CARE;
    let mut best = follow(problem, weight, settings, fast)?;
    for care in careful {
        if best.certified {
            break;
        }
        let found = follow(problem, weight, settings, care)?;
        if found.gap < best.gap {
            best = found;
        }
    }
    Ok(best)
}

/// Follows the central path to the optimum.
fn follow(
    problem: &Problem,
    weight: f64,
    settings: &Settings,
    care: &Care,
) -> Result<Solution, ConsistencyError> {
    let mut state = State::start(problem, weight);
    state.centre_duals(care)?;
    let mut best = state.solution(settings, 0);
    let mut in_vain = 0;
    for iterations in 1..=settings.iterations {
        let accuracy = settings.tolerance * (1.0 + state.objective());
        // One step more squares what is left, which is worth more than it costs.
        let suffices = best.gap <= accuracy || in_vain >= IN_VAIN;
        let ends = state.iterate(accuracy, care).is_none() || suffices || iterations == settings.iterations;
        if ends || state.is_central(accuracy) {
            let found = state.solution(settings, iterations);
            in_vain = if found.gap < 0.5 * best.gap || found.gap.is_infinite() { 0 } else { in_vain + 1 };
            if found.gap < best.gap {
                best = found;
            }
        }
        if ends {
            break;
        }
    }
    Ok(best)
}

impl<'a> State<'a> {
    fn start(problem: &'a Problem, weight: f64) -> Self {
        let mut x: Vec<f64> = problem.body_starts.iter().flat_map(PseudoInertia::parameters).collect();
        x.resize(problem.unknowns(), 0.0);
        let scale = scale_start(problem, &x);
        x.iter_mut().for_each(|value| *value *= scale);
        let bodies = problem.unknowns() - problem.extras;
        x[bodies..].copy_from_slice(&extras_start(problem));
        State {
            problem,
            weight,
            ridge: ridge(problem),
            body_duals: vec![Square::identity(4); problem.priors.len()],
            duals: problem.constraints.iter().map(|c| Square::identity(c.offset.size)).collect(),
            x,
        }
    }

    /// The bodies' pseudo-inertias.
    pub fn bodies(&self) -> Vec<Square> {
        let bodies = self.x.as_chunks::<PARAMETERS_PER_BODY>().0.iter().take(self.problem.priors.len());
        bodies.map(|body| PseudoInertia::of_parameters(body).0).collect()
    }

    fn residual(&self) -> Vec<f64> {
        let x = Mat::from_fn(self.x.len(), 1, |row, _| self.x[row]);
        let product = &self.problem.matrix * &x;
        self.problem.target.iter().enumerate().map(|(row, target)| product[(row, 0)] - target).collect()
    }

    /// Gradient of misfit and penalty by the unknowns.
    pub fn misfit_gradient(&self) -> Vec<f64> {
        let residual = self.residual();
        let residual = Mat::from_fn(residual.len(), 1, |row, _| residual[row]);
        let product = self.problem.matrix.transpose() * residual;
        let mut gradient: Vec<f64> = (0..self.x.len()).map(|row| product[(row, 0)]).collect();
        let first = self.x.len() - self.ridge.len();
        for (extra, ridge) in self.ridge.iter().enumerate() {
            gradient[first + extra] += ridge * self.x[first + extra];
        }
        gradient
    }

    /// Hessian of misfit and penalty.
    pub fn misfit_hessian(&self) -> Mat<f64> {
        let mut hessian = self.problem.gram.clone();
        let first = self.x.len() - self.ridge.len();
        self.ridge
            .iter()
            .enumerate()
            .for_each(|(extra, ridge)| hessian[(first + extra, first + extra)] += ridge);
        hessian
    }

    fn misfit(&self) -> f64 {
        let residual = self.residual();
        0.5 * dot(&residual, &residual)
    }

    fn divergence(&self) -> f64 {
        let bodies = self.bodies().into_iter().map(PseudoInertia);
        bodies.zip(&self.problem.priors).map(|(body, prior)| body.divergence(prior)).sum()
    }

    fn objective(&self) -> f64 {
        self.misfit() + self.weight * self.divergence()
    }

    /// What each equality lacks.
    pub fn missing(&self) -> Vec<f64> {
        self.problem.equalities.iter().map(|equality| equality.value - equality.product(&self.x)).collect()
    }

    /// Duals with one complementarity in all blocks.
    fn centre_duals(&mut self, care: &Care) -> Result<(), ConsistencyError> {
        // The sum of all is the gap, and no more than the whole misfit can be gained.
        let constraints = self.problem.constraints.iter().map(|known| known.offset.size).sum::<usize>();
        let dimension = 4 * self.body_duals.len() + constraints;
        let start = self.weight.max(care.start * self.misfit() / dimension.max(1) as f64);
        let centred = |matrix: &Square| {
            let lower = matrix.cholesky()?;
            let unit = Square::identity(matrix.size);
            Some(lower.inverse_of_lower().transposed().congruence(&unit).scaled(start))
        };
        let body = |(body, matrix): (usize, &Square)| {
            centred(matrix).ok_or(ConsistencyError::ImpossiblePrior { body })
        };
        self.body_duals = self.bodies().iter().enumerate().map(body).collect::<Result<_, _>>()?;
        let value = |(constraint, known): (usize, &MatrixConstraint)| {
            let why = "the search found no point within it to start from";
            centred(&known.value(&self.x)).ok_or(ConsistencyError::Empty { constraint, why })
        };
        self.duals = self.problem.constraints.iter().enumerate().map(value).collect::<Result<_, _>>()?;
        Ok(())
    }

    /// tr(XZ) of every body and of every constraint.
    fn complementarity(&self) -> [Vec<f64>; 2] {
        let bodies = self.bodies().iter().zip(&self.body_duals).map(|(x, z)| x.dot(z)).collect();
        let constraints = self.problem.constraints.iter().zip(&self.duals);
        [bodies, constraints.map(|(known, z)| known.value(&self.x).dot(z)).collect()]
    }

    /// What tr(XZ) of all blocks is above what it should become.
    fn excess(&self) -> f64 {
        let [bodies, constraints] = self.complementarity();
        let of_bodies = bodies.iter().map(|sum| (sum - 4.0 * self.weight).max(0.0)).sum::<f64>();
        of_bodies + constraints.iter().sum::<f64>()
    }

    /// Whether a certificate is worth its price.
    fn is_central(&self, accuracy: f64) -> bool {
        let [bodies, constraints] = self.complementarity();
        let settled = bodies.iter().all(|sum| (0.5..2.0).contains(&(0.25 * sum / self.weight)));
        settled && constraints.iter().sum::<f64>() <= WORTH_A_CERTIFICATE * accuracy
    }

    /// One predictor and corrector; none where nothing finite comes out. The constraints' complementarity
    /// need not be less in all than `accuracy`.
    fn iterate(&mut self, accuracy: f64, care: &Care) -> Option<()> {
        let mut pairs: Vec<(Square, &Square)> = self.bodies().into_iter().zip(&self.body_duals).collect();
        pairs.extend(self.problem.constraints.iter().map(|known| known.value(&self.x)).zip(&self.duals));
        let scaled = pairs.iter().map(|(x, z)| Scaled::new(x, z)).collect::<Option<Vec<Scaled>>>()?;
        let blocks = Blocks { scaled, bodies: self.body_duals.len() };
        let (bodies, constraints) = blocks.scaled.split_at(blocks.bodies);
        let equations = self.equations(bodies, constraints)?;
        let mut smooth = equations.frame().pull(&self.misfit_gradient());
        for (body, scaled) in bodies.iter().enumerate() {
            let prior = scaled.scaling.transposed().congruence(&self.problem.prior_inverses[body]);
            let own = &mut smooth[PARAMETERS_PER_BODY * body..PARAMETERS_PER_BODY * (body + 1)];
            own.iter_mut().zip(coordinates(&prior)).for_each(|(value, prior)| *value += self.weight * prior);
        }

        let predictor = self.direction(&equations, &smooth, &blocks, [self.weight, 0.0], None);
        let foretold = blocks.longest(&predictor, 1.0);
        let centring = (1.0 - foretold).powi(2).clamp(care.centring, MOST_CENTRING);
        let inside = STAY_INSIDE + 0.09 * foretold;
        let dimension: usize = blocks.scaled.iter().map(|scaled| scaled.sigma.len()).sum();
        let least = [self.weight, 0.1 * accuracy / dimension.max(1) as f64];
        // One for all blocks: where they are far apart, none can move.
        let present = self.excess() / dimension.max(1) as f64;
        let target = |centring: f64| least.map(|least| (centring * present).max(least));
        let mut direction = self.direction(&equations, &smooth, &blocks, target(centring), Some(&predictor));
        let mut length = blocks.longest(&direction, inside);
        if length < JAMMED {
            // Some block is far from the path: towards it first.
            let centred = self.direction(&equations, &smooth, &blocks, target(1.0), None);
            let centred_length = blocks.longest(&centred, inside);
            if centred_length > length {
                (direction, length) = (centred, centred_length);
            }
        }
        if !(length > 0.0 && direction.unknowns.iter().all(|value| value.is_finite())) {
            return None;
        }
        self.x.iter_mut().zip(&direction.unknowns).for_each(|(value, change)| *value += length * change);
        let duals =
            blocks.scaled.iter().zip(&direction.dual).map(|(scaled, change)| scaled.dual(change, length));
        let mut duals: Vec<Square> = duals.collect();
        self.duals = duals.split_off(blocks.bodies);
        self.body_duals = duals;
        Some(())
    }

    /// Newton's direction to X·Z = target·1, of second order if a first direction is given.
    fn direction(
        &self,
        equations: &Equations,
        smooth: &[f64],
        blocks: &Blocks,
        targets: [f64; 2],
        first: Option<&Direction>,
    ) -> Direction {
        let wanted: Vec<Square> = (0..blocks.scaled.len())
            .map(|block| {
                let target = targets[usize::from(block >= blocks.bodies)];
                let bent = first.map(|first| (&first.primal[block], &first.dual[block]));
                blocks.scaled[block].wanted(target, bent)
            })
            .collect();
        // What the duals will be is taken from the gradient; what they lose by the change of X is in the
        // equations.
        let mut gradient = vec![0.0; smooth.len()];
        let constraints = self.problem.constraints.iter();
        for ((constraint, scaled), wanted) in
            constraints.clone().zip(&blocks.scaled[blocks.bodies..]).zip(&wanted[blocks.bodies..])
        {
            for (unknown, matrix) in &constraint.terms {
                gradient[*unknown] -=
                    scaled.inverse.congruence(matrix).dot(&scaled.diagonal().plus(1.0, wanted));
            }
        }
        let mut gradient = equations.frame().pull(&gradient);
        gradient.iter_mut().zip(smooth).for_each(|(value, smooth)| *value += smooth);
        for (body, (scaled, wanted)) in blocks.scaled.iter().zip(&wanted).take(blocks.bodies).enumerate() {
            let own = &mut gradient[PARAMETERS_PER_BODY * body..PARAMETERS_PER_BODY * (body + 1)];
            let dual = coordinates(&scaled.diagonal().plus(1.0, wanted));
            own.iter_mut().zip(dual).for_each(|(value, dual)| *value -= dual);
        }
        let step = equations.step(&gradient, &self.missing());
        let mut primal: Vec<Square> = (0..blocks.bodies)
            .map(|body| {
                matrix_of(&step.coordinates[PARAMETERS_PER_BODY * body..PARAMETERS_PER_BODY * (body + 1)])
            })
            .collect();
        primal.extend(
            constraints
                .zip(&blocks.scaled[blocks.bodies..])
                .map(|(constraint, scaled)| scaled.inverse.congruence(&constraint.change(&step.unknowns))),
        );
        let dual = wanted.iter().zip(&primal).map(|(wanted, primal)| wanted.plus(-1.0, primal)).collect();
        Direction { unknowns: step.unknowns, primal, dual }
    }

    fn equations(&self, bodies: &[Scaled], constraints: &[Scaled]) -> Option<Equations> {
        let mut hessian = self.misfit_hessian();
        for (constraint, scaled) in self.problem.constraints.iter().zip(constraints) {
            let terms: Vec<(usize, Square)> = constraint
                .terms
                .iter()
                .map(|(unknown, matrix)| (*unknown, scaled.inverse.congruence(matrix)))
                .collect();
            for (row, a) in &terms {
                terms.iter().for_each(|(column, b)| hessian[(*row, *column)] += a.dot(b));
            }
        }
        let frame = Frame::new(bodies.iter().map(|scaled| &scaled.scaling));
        Equations::new(frame, &hessian, 1.0, &self.problem.equalities)
    }

    fn solution(&self, settings: &Settings, iterations: usize) -> Solution {
        let gap = gap(self);
        let objective = self.objective();
        let bodies = PARAMETERS_PER_BODY * self.problem.priors.len();
        Solution {
            standard: self.bodies().iter().flat_map(parameters_of).collect(),
            extras: self.x[bodies..].to_vec(),
            weight: self.weight,
            objective,
            misfit: self.misfit(),
            divergence: self.divergence(),
            certified: gap <= settings.certified * (1.0 + objective.abs()),
            gap,
            iterations,
        }
    }
}

impl Blocks {
    /// The longest step, at most a full one, that goes no further than the share `inside` of the way to where
    /// some X or Z is no longer positive definite.
    fn longest(&self, direction: &Direction, inside: f64) -> f64 {
        let changes = direction.primal.iter().zip(&direction.dual);
        self.scaled
            .iter()
            .zip(changes)
            .flat_map(|(scaled, (primal, dual))| [scaled.longest(primal), scaled.longest(dual)])
            .fold(1.0, |shortest: f64, length| shortest.min(inside * length))
    }
}
