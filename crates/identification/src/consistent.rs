//! A fitted design with bodies that can exist: the same factors, over possible bodies and dissipative effects
//! alone.
//!
//! What the logs do not tell comes from the URDF. How much it weighs is chosen by the error on training folds
//! that are left out; held-out folds fit nothing here either.

use crate::accumulate::accumulate;
use crate::effect::QuadraticForm;
use crate::fit::{Fit, TorqueError, merge, torque_error};
use crate::mirrored::mirror_map;
use crate::model::with_masses;
use crate::own_torque::{LARGEST_GROWTH, largest_growth};
use crate::{Data, Design, IdentificationError, Identified};
pub use phiw_consistency::Ellipsoid;
use phiw_consistency::{
    MatrixTerm, PriorSettings, Problem, PseudoInertia, Settings, Solution, possible_priors,
};
use phiw_dynamics::Tree;
use phiw_dynamics::inertia::PARAMETERS_PER_BODY;
use phiw_regressor::RegressorError;
use phiw_regressor::factor::{Factor, leave_one_out};
use phiw_regressor::least_squares::GroupedFactor;
use rayon::prelude::*;

/// How bodies are made possible.
#[derive(Clone, Debug, PartialEq)]
pub struct ConsistentSettings {
    /// Weights of the prior that are tried, ascending. One is worth one nat of the likelihood for each unit
    /// of divergence if the samples were independent; they are not, so that the best is mostly above one.
    /// Below the least of these nothing is gained on the robots of docs/results/consistent.md, and bodies
    /// come so near to the edge of the possible that Rapier refuses one.
    pub weights: Vec<f64>,
    /// The weight where there are too few training folds to leave one out.
    pub default_weight: f64,
    /// Training folds are merged into at most this many before one after the other is left out: more cost
    /// time and have not changed a choice by more than its neighbour.
    pub folds: usize,
    /// The least standard deviation of a torque's residual, over the torque's RMS: a log without noise would
    /// leave no digits for the bodies.
    pub least_residual: f64,
    /// What a body is taken for of which the URDF says nothing possible.
    pub prior: PriorSettings,
    /// When the search ends.
    pub solver: Settings,
    /// What is known of the bodies beside the URDF.
    pub known: Vec<Known>,
}

impl Default for ConsistentSettings {
    fn default() -> Self {
        ConsistentSettings {
            weights: (-2..=6).map(|exponent| 10.0_f64.powi(exponent)).collect(),
            default_weight: 1.0,
            folds: 12,
            least_residual: 1e-5,
            prior: PriorSettings::default(),
            solver: Settings::default(),
            known: Vec::new(),
        }
    }
}

/// Something that is known of the bodies.
#[derive(Clone, Debug, PartialEq)]
pub enum Known {
    /// Mass of a body \[kg\], by its index in the tree.
    Mass(usize, f64),
    /// Mass of all bodies that move \[kg\].
    TotalMass(f64),
    /// Of a body, by its index in the tree: all of its mass lies within an ellipsoid in its link's frame, as
    /// far as its second moments tell (Wensing, Kim & Slotine 2018, equation 21).
    Inside(usize, Ellipsoid),
    /// Of a body, by its index in the tree: all of its mass lies within a box along the axes of its link's
    /// frame, from the lowest corner to the highest \[m\], as far as its second moments tell.
    InsideBox(usize, [f64; 3], [f64; 3]),
    /// Two bodies, by their indices in the tree, that are mirror images of each other by the plane y = 0 of
    /// the world, with the robot in its configuration of zeros, wherever along y the plane is.
    Mirrored(usize, usize),
}

/// A design fitted to possible bodies and dissipative effects.
#[derive(Clone, Debug)]
pub struct Consistent {
    /// Standard parameters, ten for each body of the tree: every body possible.
    pub standard: Vec<f64>,
    /// Parameters of the design: base parameters of these bodies, then those of the effects; zero where the
    /// fit did not determine an effect's.
    pub parameters: Vec<f64>,
    /// Weight of the prior that was chosen.
    pub weight: f64,
    /// Whether possible bodies foretell left-out training folds better than least squares does. Not where the
    /// fit is drawn to nothing: that is not compared.
    pub foretells_better: bool,
    /// What the objective can be above the optimum, in nats of independent samples.
    pub gap: f64,
    /// Whether the gap is as small as the solver's settings ask.
    pub certified: bool,
    /// Newton steps of the last solution.
    pub iterations: usize,
    /// Error on the training folds.
    pub train: TorqueError,
    /// Error on the folds held out.
    pub held_out: TorqueError,
    /// Bodies of the tree that no distribution of mass has as least squares makes them.
    pub impossible_by_least_squares: Vec<usize>,
}

impl Identified {
    /// The model that phiw reports and predicts with: these bodies, which can exist, where they foretell
    /// better than least squares' do, and whether it is. Intervals then hold the values of both. Columns that
    /// are made of the model's own torque are made again from `data`; where the error of a torque in training
    /// is larger then than the one by which these bodies were judged, the model stays as it was.
    ///
    /// # Errors
    /// A log cannot be read any more.
    pub fn with_possible(
        mut self,
        possible: &Consistent,
        data: Option<&Data<'_>>,
    ) -> Result<(Self, bool), IdentificationError> {
        if !possible.foretells_better {
            return Ok((self, false));
        }
        let (mut train, mut held_out) = (possible.train.clone(), possible.held_out.clone());
        if self.design.needs().of_reference() {
            self.design = self.design.with_own_reference(&possible.parameters)?;
            if let Some(data) = data {
                let all = [data.train.as_slice(), &data.held_out].concat();
                let mut train_folds = accumulate(&self.design, &all, &data.sources)?;
                let held_out_folds = train_folds.split_off(data.train.len());
                train = torque_error(&train_folds, &possible.parameters)?;
                held_out = torque_error(&held_out_folds, &possible.parameters)?;
                if largest_growth(&train.rmse, &possible.train.rmse) > LARGEST_GROWTH {
                    self.design = self.design.with_own_reference(&self.fit.parameters)?;
                    return Ok((self, false));
                }
                (self.train_folds, self.held_out_folds) = (train_folds, held_out_folds);
            }
        }
        (self.train, self.held_out) = (train, held_out);
        self.fit.parameters.clone_from(&possible.parameters);
        for (interval, value) in self.fit.intervals_95.iter_mut().zip(&possible.parameters) {
            if interval.iter().all(|end| end.is_finite()) {
                *interval = [interval[0].min(*value), interval[1].max(*value)];
            }
        }
        Ok((self, true))
    }
}

/// Bodies of standard parameters, ten for each, that no distribution of mass has.
pub fn impossible_bodies(standard: &[f64]) -> Vec<usize> {
    let bodies = standard.as_chunks::<PARAMETERS_PER_BODY>().0.iter().enumerate();
    bodies
        .filter(|(_, body)| !PseudoInertia::of_parameters(body).is_possible())
        .map(|(body, _)| body)
        .collect()
}

/// The fit of a design once more, over possible bodies and effects within their bounds.
///
/// # Errors
/// What is known contradicts itself, or the factors are of another design.
pub fn consistent(
    design: &Design,
    fit: &Fit,
    train_folds: &[GroupedFactor],
    held_out_folds: &[GroupedFactor],
    settings: &ConsistentSettings,
) -> Result<Consistent, IdentificationError> {
    let columns = Columns::new(design, fit);
    let weights = row_weights(fit, train_folds, settings)?;
    let blocks = merged(train_folds, settings.folds, &weights)?;
    let posed = columns.problem(design, settings)?;
    let Choice { weight, error } = choose_weight(&columns, &posed, &blocks, settings)?;
    let foretells_better = match error.filter(|_| !fit.is_drawn) {
        Some(error) => error < left_out_by_least_squares(fit, &blocks)?,
        None => false,
    };
    let all = Factor::merge_all(&blocks)?;
    let solution = columns.with_data(posed, &all)?.solve(weight, &settings.solver)?;
    let parameters = columns.parameters(&solution);
    let base = design.base();
    let by_least_squares = base.to_standard(&fit.parameters[..base.count()], &with_masses(design.tree()))?;
    Ok(Consistent {
        impossible_by_least_squares: impossible_bodies(&by_least_squares),
        train: torque_error(train_folds, &parameters)?,
        held_out: torque_error(held_out_folds, &parameters)?,
        standard: solution.standard,
        parameters,
        weight: solution.weight,
        foretells_better: foretells_better && solution.certified,
        gap: solution.gap,
        certified: solution.certified,
        iterations: solution.iterations,
    })
}

/// One over each torque's residual.
pub(crate) fn row_weights(
    fit: &Fit,
    folds: &[GroupedFactor],
    settings: &ConsistentSettings,
) -> Result<Vec<f64>, RegressorError> {
    let all = merge(folds)?;
    let weight = |(std, group): (&f64, &phiw_regressor::least_squares::Group)| {
        let square = group.factor.right_hand_side_sum_of_squares() / group.factor.rows().max(1) as f64;
        let std = std.max(settings.least_residual * square.sqrt());
        if std > 0.0 { 1.0 / std } else { 1.0 }
    };
    Ok(fit.residual_std.iter().zip(all.groups()).map(weight).collect())
}

/// The folds as at most `count` weighted factors. Neighbours are kept apart: logs of one kind of motion
/// follow one another, and what is left out should not be the only one of its kind.
fn merged(folds: &[GroupedFactor], count: usize, weights: &[f64]) -> Result<Vec<Factor>, RegressorError> {
    let count = count.clamp(1, folds.len().max(1));
    let block = |first: usize| {
        let own: Vec<GroupedFactor> = folds.iter().skip(first).step_by(count).cloned().collect();
        merge(&own)?.combine(weights)
    };
    (0..count).map(block).collect()
}

/// A weight of the prior, and the squares of what it leaves of folds that are left out, if there are enough.
struct Choice {
    weight: f64,
    error: Option<f64>,
}

/// The weight with the smallest error on folds that are left out.
fn choose_weight(
    columns: &Columns<'_>,
    posed: &Problem,
    blocks: &[Factor],
    settings: &ConsistentSettings,
) -> Result<Choice, IdentificationError> {
    if blocks.len() < 2 || settings.weights.is_empty() {
        return Ok(Choice { weight: settings.default_weight, error: None });
    }
    let rests: Vec<Factor> = leave_one_out(blocks)?;
    let errors = |(rest, left_out): (&Factor, &Factor)| -> Result<Vec<f64>, IdentificationError> {
        let problem = columns.with_data(posed.clone(), rest)?;
        let error = |weight: &f64| {
            let solution = problem.solve(*weight, &settings.solver)?;
            Ok(left_out.residual_sum_of_squares(&columns.parameters(&solution))?)
        };
        settings.weights.iter().map(error).collect()
    };
    let by_fold: Vec<Vec<f64>> = rests.par_iter().zip(blocks).map(errors).collect::<Result<_, _>>()?;
    let total = |index: usize| by_fold.iter().map(|errors| errors[index]).sum::<f64>();
    let best = (0..settings.weights.len()).map(|index| (total(index), index));
    let best = best.min_by(|a, b| a.0.total_cmp(&b.0));
    Ok(match best {
        Some((error, index)) => Choice { weight: settings.weights[index], error: Some(error) },
        None => Choice { weight: settings.default_weight, error: None },
    })
}

/// The squares of what least squares leaves of folds that are left out; infinite where the others do not
/// determine what all of them do.
fn left_out_by_least_squares(fit: &Fit, blocks: &[Factor]) -> Result<f64, RegressorError> {
    let mut columns = fit.determined();
    columns.push(fit.parameters.len());
    let blocks: Vec<Factor> = blocks.iter().map(|block| block.select(&columns)).collect::<Result<_, _>>()?;
    let mut error = 0.0;
    for (rest, left_out) in leave_one_out(&blocks)?.iter().zip(&blocks) {
        let parameters = match rest.solve() {
            Ok(solution) => solution.parameters,
            Err(RegressorError::RankDeficient { .. }) => return Ok(f64::INFINITY),
            Err(error) => return Err(error),
        };
        error += left_out.residual_sum_of_squares(&parameters)?;
    }
    Ok(error)
}

/// From the factors' columns to the problem's: base parameters become standard ones, and effects that the fit
/// did not determine stay zero.
struct Columns<'a> {
    design: &'a Design,
    /// Parameters of the design that are extras of the problem.
    extras: Vec<usize>,
}

impl<'a> Columns<'a> {
    fn new(design: &'a Design, fit: &Fit) -> Self {
        let effects = design.base().count()..design.parameter_count();
        Columns {
            design,
            extras: effects.filter(|parameter| !fit.undetermined.contains(parameter)).collect(),
        }
    }

    fn standard_size(&self) -> usize {
        self.design.base().map().ncols()
    }

    /// The problem without data.
    fn problem(
        &self,
        design: &Design,
        settings: &ConsistentSettings,
    ) -> Result<Problem, IdentificationError> {
        let tree = design.tree();
        let priors = prior_bodies(tree, &settings.prior);
        let info = design.effect_parameter_info();
        let mut problem = Problem::new(&priors, self.extras.len())?;
        for (extra, parameter) in self.extras.iter().enumerate() {
            let (lower, upper) = info[parameter - design.base().count()].bounds;
            problem = problem.with_bounds(extra, lower, upper)?;
        }
        for form in [QuadraticForm::Power, QuadraticForm::KineticEnergy] {
            let terms = self.coupled(form);
            let size = terms.iter().map(|term| term.row.max(term.column) + 1).max().unwrap_or(0);
            if size > 0 {
                problem = problem.with_dissipative(size, &terms)?;
            }
        }
        for known in &settings.known {
            problem = match *known {
                Known::Inside(body, ellipsoid) => problem.with_ellipsoid(body, &ellipsoid)?,
                Known::InsideBox(body, lower, upper) => problem.with_box(body, lower, upper)?,
                Known::Mirrored(body, image) => {
                    let mut mirrored = problem;
                    for (place, row) in mirror_map(tree, body, image).iter().enumerate() {
                        let own =
                            |(column, value): (usize, &f64)| (PARAMETERS_PER_BODY * body + column, *value);
                        let mut coefficients: Vec<(usize, f64)> = row.iter().enumerate().map(own).collect();
                        coefficients.push((PARAMETERS_PER_BODY * image + place, -1.0));
                        mirrored = mirrored.with_equality(&coefficients, 0.0)?;
                    }
                    mirrored
                }
                Known::Mass(body, mass) => {
                    problem.with_equality(&[(PARAMETERS_PER_BODY * body, 1.0)], mass)?
                }
                Known::TotalMass(mass) => {
                    let masses: Vec<(usize, f64)> =
                        (0..priors.len()).map(|body| (PARAMETERS_PER_BODY * body, 1.0)).collect();
                    problem.with_equality(&masses, mass)?
                }
            };
        }
        Ok(problem)
    }

    /// The matrix of a form over the joints that are coupled in it. A coupling to a joint without an entry of
    /// its own is left out: what the rigid body or another effect gives to that entry is not known here.
    fn coupled(&self, form: QuadraticForm) -> Vec<MatrixTerm> {
        let mut terms: Vec<(usize, [usize; 2], f64)> = Vec::new();
        for (effect, known) in self.design.effects().iter().enumerate() {
            let first = self.design.effect_parameters(effect).start;
            for term in known.quadratic_terms().into_iter().filter(|term| term.form == form) {
                let extra = self.extras.iter().position(|&parameter| parameter == first + term.parameter);
                terms.extend(extra.map(|extra| (extra, term.coordinates, term.factor)));
            }
        }
        let is_own = |joint: usize| terms.iter().any(|(_, place, _)| *place == [joint; 2]);
        let couplings: Vec<_> = terms
            .iter()
            .filter(|(_, [row, column], _)| row != column && is_own(*row) && is_own(*column))
            .collect();
        let mut joints: Vec<usize> = couplings.iter().flat_map(|(_, place, _)| *place).collect();
        joints.sort_unstable();
        joints.dedup();
        let place = |joint: usize| joints.iter().position(|&known| known == joint);
        let own = terms.iter().filter(|(_, [row, column], _)| row == column);
        let matrix_term = |&(extra, [row, column], factor): &(usize, [usize; 2], f64)| {
            Some(MatrixTerm { extra, row: place(row)?, column: place(column)?, factor })
        };
        own.chain(couplings).filter_map(matrix_term).collect()
    }

    fn with_data(&self, problem: Problem, factor: &Factor) -> Result<Problem, IdentificationError> {
        let (map, standard) = (self.design.base().map(), self.standard_size());
        let width = standard + self.extras.len();
        let mut matrix = vec![0.0; factor.columns() * width];
        for (row, out) in matrix.chunks_exact_mut(width.max(1)).enumerate() {
            for base in row..map.nrows() {
                let entry = factor.entry(row, base);
                if entry != 0.0 {
                    (0..standard).for_each(|column| out[column] += entry * map[(base, column)]);
                }
            }
            for (extra, &parameter) in self.extras.iter().enumerate() {
                out[standard + extra] = factor.entry(row, parameter);
            }
        }
        let target: Vec<f64> =
            (0..factor.columns()).map(|row| factor.entry(row, factor.parameters())).collect();
        Ok(problem.with_data(&matrix, &target)?)
    }

    /// The design's parameters of a solution.
    fn parameters(&self, solution: &Solution) -> Vec<f64> {
        let map = self.design.base().map();
        let base =
            |row: usize| (0..map.ncols()).map(|column| map[(row, column)] * solution.standard[column]).sum();
        let mut parameters: Vec<f64> = (0..map.nrows()).map(base).collect();
        parameters.resize(self.design.parameter_count(), 0.0);
        self.extras
            .iter()
            .zip(&solution.extras)
            .for_each(|(&parameter, value)| parameters[parameter] = *value);
        parameters
    }
}

/// The bodies that a robot is taken to have before anything is measured: its description's, made possible.
pub(crate) fn prior_bodies(tree: &Tree, settings: &PriorSettings) -> Vec<[f64; PARAMETERS_PER_BODY]> {
    let standard = tree.inertial_parameters();
    possible_priors(standard.as_chunks::<PARAMETERS_PER_BODY>().0, length(tree), settings)
}

/// The robot's length \[m\]: the mean distance from a joint to the one before it, of those that are apart;
/// the mean distance of the centres of mass from their joints where no joints are apart, and zero where those
/// are not either.
fn length(tree: &Tree) -> f64 {
    let mean = |lengths: Vec<f64>| {
        let apart: Vec<f64> =
            lengths.into_iter().filter(|length| length.is_finite() && *length > 0.0).collect();
        if apart.is_empty() { 0.0 } else { apart.iter().sum::<f64>() / apart.len() as f64 }
    };
    let norm = |[x, y, z]: [f64; 3]| (x * x + y * y + z * z).sqrt();
    let joints = mean(tree.bodies().iter().skip(1).map(|body| norm(body.origin.translation.0)).collect());
    if joints > 0.0 {
        return joints;
    }
    let parameters = tree.inertial_parameters();
    let bodies = parameters.as_chunks::<PARAMETERS_PER_BODY>().0.iter();
    mean(bodies.map(|[mass, x, y, z, ..]| norm([x / mass, y / mass, z / mass])).collect())
}
