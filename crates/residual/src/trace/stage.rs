//! One pass over the logs with a model and candidates beside it.

use super::hypotheses::Candidates;
use super::input::{TraceInput, TraceOptions};
use super::kept_columns::{Keep, KeptColumns, Pass, PassProducts};
use crate::selection::{self, Hypothesis, Member, Products, Torque, Variant};
use phiw_dynamics::Tree;
use phiw_effects::Catalogue;
use phiw_identification::effect::ReferenceModel;
use phiw_identification::fitting::accumulate;
use phiw_identification::{Data, Design, Effect, EffectCatalogue, EffectSpec, Fold, IdentificationError};
use phiw_regressor::factor::{Factor, FactorBuilder};
use phiw_regressor::least_squares::{Group, GroupedFactor};
use phiw_regressor::{BaseParameters, RegressorError};
use rayon::prelude::*;
use std::collections::BTreeSet;
use std::sync::Mutex;

/// What stays the same over all passes of a trace.
pub(super) struct Fixed<'a> {
    pub tree: &'a Tree,
    pub base: BaseParameters,
    pub catalogue: &'a Catalogue,
    pub data: &'a Data<'a>,
    /// What was known before, over the parameters of the held model that its logs determined.
    pub prior: Option<Prior>,
    /// Rows that the conditioning alone makes one.
    pub rows_per_independent: f64,
    /// A residual below this share of its torque (RMS) is as good as none.
    pub negligible_share: f64,
    /// Hypotheses that could not be judged.
    pub not_judged: Mutex<BTreeSet<(String, Vec<String>)>>,
    /// Columns that stay the same from pass to pass.
    kept: Mutex<KeptColumns>,
}

/// A held model's factor, and the parameters that its columns stand for.
pub(super) struct Prior {
    pub factor: Factor,
    pub parameters: Vec<usize>,
    /// 1/σ of each torque when it was fitted.
    pub weights: Vec<f64>,
}

/// A design over some folds.
pub(super) struct Stage {
    pub design: Design,
    /// Number of the model's effects; the candidates' follow.
    model_effects: usize,
    /// Candidates whose columns are not finite.
    not_finite: Vec<usize>,
    /// Parameters of the base and of a held model's effects that are there in any case.
    always: Vec<usize>,
    /// For each torque the products of each fold.
    pub torques: Vec<Vec<Products>>,
}

impl<'a> Fixed<'a> {
    pub fn new(
        input: &TraceInput<'a>,
        data: &'a Data<'a>,
        options: &TraceOptions,
    ) -> Result<Self, RegressorError> {
        let prior = input.held.as_ref().map(|held| Prior {
            factor: held.factor.clone(),
            parameters: held.determined.clone(),
            weights: held.residual_std.iter().map(|std| 1.0 / std.max(f64::MIN_POSITIVE)).collect(),
        });
        Ok(Fixed {
            tree: input.tree,
            base: BaseParameters::of_tree(input.tree, Default::default())?,
            catalogue: input.catalogue,
            data,
            prior,
            rows_per_independent: input.rows_per_independent,
            negligible_share: options.thresholds.negligible_share(),
            not_judged: Mutex::default(),
            kept: Mutex::default(),
        })
    }

    pub fn build(&self, specs: &[EffectSpec]) -> Result<Vec<Box<dyn Effect>>, IdentificationError> {
        Ok(specs.iter().map(|spec| self.catalogue.build(spec, self.tree)).collect::<Result<_, _>>()?)
    }

    /// For an effect that is in force through its point of linearisation, the values of its parameters that
    /// take it out of force again.
    pub fn absent(&self, spec: &EffectSpec) -> Result<Option<Vec<f64>>, IdentificationError> {
        let effect = self.catalogue.build(spec, self.tree)?;
        let parameters = effect.parameters();
        if effect.relinearised(&vec![0.0; parameters.len()]).is_none() {
            return Ok(None);
        }
        let in_force = |name: &String| spec.constants.get(name).copied().unwrap_or_default();
        Ok(Some(parameters.iter().map(|parameter| -in_force(&parameter.name)).collect()))
    }

    /// A rigid body and effects with numbers, for columns that need torques.
    pub fn reference(
        &self,
        specs: &[EffectSpec],
        parameters: &[f64],
    ) -> Result<ReferenceModel, IdentificationError> {
        let mut tree = self.tree.clone();
        let (base, mut rest) = parameters.split_at(self.base.count());
        tree.set_inertial_parameters(&self.base.to_standard(base, &self.tree.inertial_parameters())?)?;
        let mut effects = Vec::new();
        for effect in self.build(specs)? {
            let (own, others) = rest.split_at(effect.parameters().len());
            effects.push((effect, own.to_vec()));
            rest = others;
        }
        Ok(ReferenceModel::new(tree).with_effects(effects))
    }

    /// The model's columns, then the candidates'.
    fn design(
        &self,
        specs: &[EffectSpec],
        candidates: Vec<Box<dyn Effect>>,
    ) -> Result<Design, IdentificationError> {
        let mut effects = self.build(specs)?;
        effects.extend(candidates);
        Ok(Design::new(self.tree.clone(), self.base.clone(), effects)
            .with_rest_speeds(self.data.rest_speeds.clone())
            .with_candidates_from(specs.len()))
    }

    /// The factors of a model and candidates over some folds, and their design.
    pub fn factors(
        &self,
        specs: &[EffectSpec],
        candidates: Vec<Box<dyn Effect>>,
        reference: ReferenceModel,
        folds: &[Fold],
    ) -> Result<(Design, Vec<GroupedFactor>), IdentificationError> {
        let design = self.design(specs, candidates)?.with_reference(reference);
        let folds = accumulate(&design, folds, &self.data.sources)?;
        Ok((design, folds))
    }

    /// One pass over the logs: the model's columns, then the candidates'. `keep` says whether these come
    /// again in other passes.
    pub fn pass(
        &self,
        specs: &[EffectSpec],
        candidates: Vec<Box<dyn Effect>>,
        reference: ReferenceModel,
        folds: &[Fold],
        keep: Keep,
    ) -> Result<Stage, IdentificationError> {
        if let Some(prior) = &self.prior {
            let (design, folds) = self.factors(specs, candidates, reference, folds)?;
            let of_fold = |group: &Group| {
                let base = self.base.count();
                let rigid_body = group.parameters.partition_point(|&parameter| parameter < base);
                Products::of_factor_beside(&group.factor, rigid_body)
            };
            let of_torque =
                |torque: usize| folds.iter().map(|fold| of_fold(&fold.groups()[torque])).collect();
            return Ok(Stage {
                model_effects: specs.len(),
                not_finite: design.not_finite(),
                always: still_determined(prior, &folds)?,
                torques: (0..design.rows().len()).into_par_iter().map(of_torque).collect(),
                design,
            });
        }
        let design = self.design(specs, candidates)?;
        let mut in_force = Vec::new();
        for (place, spec) in specs.iter().enumerate() {
            let is_factor = design.effects()[place].logged_factor().is_some();
            if is_factor || design.corrects_signals(place) || self.absent(spec)?.is_some() {
                in_force.push(spec.clone());
            }
        }
        let pass = Pass { design: &design, in_force, reference, folds, sources: &self.data.sources, keep };
        let products = self.products(pass)?;
        Ok(Stage {
            model_effects: specs.len(),
            not_finite: products.not_finite,
            always: (0..self.base.count()).collect(),
            torques: products.torques,
            design,
        })
    }

    /// The products of a pass. One beside another evaluates all columns by itself.
    fn products(&self, pass: Pass<'_>) -> Result<PassProducts, IdentificationError> {
        let mut kept = self.kept.lock().map(|mut kept| std::mem::take(&mut *kept)).unwrap_or_default();
        let products = kept.products(pass)?;
        if let Ok(mut place) = self.kept.lock() {
            *place = kept;
        }
        Ok(products)
    }

    /// For each fold, and each torque, whether it has rows there.
    pub fn has_rows(&self, folds: &[Fold]) -> Result<Vec<Vec<bool>>, IdentificationError> {
        let rigid_body = Pass {
            design: &self.design(&[], Vec::new())?,
            in_force: Vec::new(),
            reference: ReferenceModel::new(self.tree.clone()),
            folds,
            sources: &self.data.sources,
            keep: Keep::WhileThereIsRoom,
        };
        let torques = self.products(rigid_body)?.torques;
        let in_fold = |fold: usize| torques.iter().map(|folds| folds[fold].rows() > 0.0).collect();
        Ok((0..folds.len()).map(in_fold).collect())
    }

    /// What is to be chosen from, as plain data; hypotheses and their variants are those of `candidates`, in
    /// their order.
    pub fn problem(
        &self,
        stage: Stage,
        candidates: &mut Candidates,
    ) -> Result<selection::Problem, IdentificationError> {
        self.leave_out_what_is_not_finite(&stage, candidates);
        let design = &stage.design;
        let mut absent = vec![0.0; design.parameter_count()];
        let mut hypotheses = Vec::with_capacity(candidates.list.len());
        for candidate in &candidates.list {
            let mut torques: Vec<usize> = Vec::new();
            let mut variants = Vec::new();
            let mut made_of_model = false;
            for (&effect, spec) in candidate.effects.iter().zip(&candidate.specs) {
                let own = &design.effects()[effect];
                torques.extend(own.entries().iter().map(|entry| entry.row));
                made_of_model |= own.needs().total_torque;
                variants.push(Variant {
                    parameters: design.effect_parameters(effect).collect(),
                    bounds: own.parameters().iter().map(|parameter| parameter.bounds).collect(),
                    constants: spec.constants.len(),
                });
            }
            if effect_is_found(candidate, &stage)
                && let Some(values) = self.absent(&candidate.specs[0])?
            {
                design
                    .effect_parameters(candidate.effects[0])
                    .zip(values)
                    .for_each(|(parameter, value)| absent[parameter] = value);
            }
            torques.sort_unstable();
            torques.dedup();
            hypotheses.push(Hypothesis {
                kind: candidate.kind,
                textbook: self.catalogue.kind(&candidate.specs[0].kind)?.joint_property().is_some(),
                familiar: candidate.familiar,
                torques,
                variants,
                declared: candidate.declared,
                linearised: self.absent(&candidate.specs[0])?.is_some(),
                requires: self.required(candidates, candidate)?,
                made_of_model,
            });
        }
        let torques = stage
            .torques
            .into_par_iter()
            .zip(design.rows())
            .map(|(folds, layout)| Torque::new(layout.parameters.clone(), folds, self.negligible_share));
        Ok(selection::Problem {
            torques: torques.collect(),
            parameters: design.parameter_count(),
            model: stage.always,
            hypotheses,
            prior: self.prior.as_ref().map(|prior| selection::Prior {
                parameters: prior.parameters.clone(),
                products: Products::of_factor(&prior.factor),
            }),
            absent,
            rows_per_independent: self.rows_per_independent,
        })
    }

    /// Candidates on the same joint of which another is a form. None where the model is held: they are in
    /// what is held.
    fn required(
        &self,
        candidates: &Candidates,
        candidate: &super::hypotheses::Candidate,
    ) -> Result<Vec<usize>, IdentificationError> {
        if self.prior.is_some() {
            return Ok(Vec::new());
        }
        let spec = &candidate.specs[0];
        let simpler = self.catalogue.kind(&spec.kind)?.form_of();
        let is_simpler =
            |other: &EffectSpec| other.joints == spec.joints && simpler.contains(&other.kind.as_str());
        let list = candidates.list.iter().enumerate();
        Ok(list.filter(|(_, other)| is_simpler(&other.specs[0])).map(|(place, _)| place).collect())
    }

    fn leave_out_what_is_not_finite(&self, stage: &Stage, candidates: &mut Candidates) {
        let not_finite = &stage.not_finite;
        if not_finite.is_empty() {
            return;
        }
        for candidate in &mut candidates.list {
            let places: Vec<usize> = (0..candidate.effects.len())
                .filter(|&place| !not_finite.contains(&candidate.effects[place]))
                .collect();
            if places.len() < candidate.effects.len()
                && let Ok(mut not_judged) = self.not_judged.lock()
            {
                let spec = &candidate.specs[0];
                not_judged.insert((spec.kind.clone(), spec.joints.clone()));
            }
            candidate.specs = places.iter().map(|&place| candidate.specs[place].clone()).collect();
            candidate.effects = places.iter().map(|&place| candidate.effects[place]).collect();
        }
        // Effects of the model come first and are finite, so that the places of its members stay.
        candidates.list.retain(|candidate| !candidate.effects.is_empty());
    }
}

fn effect_is_found(candidate: &super::hypotheses::Candidate, stage: &Stage) -> bool {
    !candidate.declared && candidate.effects[0] < stage.model_effects
}

/// Parameters of a held model that its own rows and these determine. One that was not determined then would
/// take up what has come since: it stays out.
fn still_determined(prior: &Prior, folds: &[GroupedFactor]) -> Result<Vec<usize>, RegressorError> {
    let mut builder = FactorBuilder::new(prior.parameters.len() + 1);
    let all: Vec<usize> = (0..=prior.parameters.len()).collect();
    builder.push_factor(&prior.factor, &all, 1.0)?;
    for fold in folds {
        builder.push_factor(&fold.select(&prior.parameters)?.combine(&prior.weights)?, &all, 1.0)?;
    }
    let undetermined = builder.factor().undetermined_columns();
    let places = prior.parameters.iter().enumerate();
    Ok(places.filter(|(place, _)| !undetermined.contains(place)).map(|(_, &parameter)| parameter).collect())
}

/// Specs of the members, and the values of the base parameters and of theirs, in that order.
pub(super) fn specs_and_values(
    problem: &selection::Problem,
    candidates: &Candidates,
    held: &[EffectSpec],
    members: &[Member],
    values: &[f64],
    first: std::ops::Range<usize>,
) -> (Vec<EffectSpec>, Vec<f64>) {
    let spec = |member: &Member| candidates.list[member.hypothesis].specs[member.variant].clone();
    let specs = held.iter().cloned().chain(members.iter().map(spec)).collect();
    let own = members.iter().flat_map(|&member| problem.variant(member).parameters.iter());
    (specs, first.chain(own.copied()).map(|parameter| values[parameter]).collect())
}
