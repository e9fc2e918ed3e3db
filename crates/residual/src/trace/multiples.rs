//! Torques that are logged as another multiple of what they are than the others, put in force at the start.

use super::hypotheses::{Candidates, Present};
use super::kept_columns::Keep;
use super::search::Search;
use crate::selection::{Multiple, multiples};
use phiw_effects::EffectKind;
use phiw_identification::{Effect, EffectSpec, IdentificationError};
use std::collections::BTreeMap;

impl Search<'_> {
    /// The same start with the factors of torques in force by which all torques agree better; `None` where
    /// there is no such torque. Of a held model a factor is exact to first order: it needs no start.
    pub(super) fn with_multiples(&self) -> Result<Option<Self>, IdentificationError> {
        let gains = self.gains();
        if self.fixed.prior.is_some() || self.fixed.tree.joint_count() < 2 || gains.is_empty() {
            return Ok(None);
        }
        let mut search = self.clone();
        for Multiple { torque, factor } in self.multiples(gains.keys().copied().collect())? {
            if let Some(in_force) = gains[&torque].with_logged_factor(&[factor - 1.0]) {
                search.specs.push(in_force.spec());
                search.parameters.push(0.0);
                search.chosen.alternatives.push(Vec::new());
            }
        }
        Ok((search.specs.len() > self.specs.len()).then_some(search))
    }

    /// Whether the model as it is asks for one of these factors, or has it to first order.
    pub(super) fn still_asks_for(&self, factors: &[EffectSpec]) -> Result<bool, IdentificationError> {
        let is_one = |spec: &EffectSpec| {
            factors.iter().any(|factor| factor.kind == spec.kind && factor.joints == spec.joints)
        };
        let gains = self.gains();
        let open = gains.iter().filter(|(_, gain)| is_one(&gain.spec())).map(|(torque, _)| *torque);
        Ok(self.specs.iter().any(is_one) || !self.multiples(open.collect())?.is_empty())
    }

    /// For each torque that may have one the effect that is a factor of it, not in force.
    fn gains(&self) -> BTreeMap<usize, Box<dyn Effect>> {
        let mut gains = BTreeMap::new();
        for kind in self.fixed.catalogue.kinds() {
            for site in kind.sites(self.fixed.tree) {
                let Some(constants) = kind.scan(&site, &self.input.ranges).into_iter().next() else {
                    continue;
                };
                let effect = kind.build(self.fixed.tree, &site, &constants);
                // Other effects multiply no torque; a factor of two in force shows which torque it is.
                let Some((torque, _)) = effect.with_logged_factor(&[1.0]).and_then(|own| own.logged_factor())
                else {
                    continue;
                };
                let EffectSpec { kind, joints, .. } = effect.spec();
                let is_it = |spec: &EffectSpec| spec.kind == kind && spec.joints == joints;
                let may_be = !self.specs.iter().chain(&self.options.excluded).any(is_it);
                let asked = self.options.torques.as_ref().is_none_or(|torques| torques.contains(&torque));
                if may_be && asked {
                    gains.insert(torque, effect);
                }
            }
        }
        gains
    }

    /// The multiples that the model asks for with all that the textbook has of joints beside it: a
    /// friction that is missing is no factor.
    fn multiples(&self, open: Vec<usize>) -> Result<Vec<Multiple>, IdentificationError> {
        let mut with_textbook = self.clone();
        for kind in self.fixed.catalogue.kinds().filter(|kind| kind.joint_property().is_some()) {
            with_textbook.declare_on_all_joints(kind);
        }
        with_textbook.declared = with_textbook.specs.len();
        let present = Present { specs: &with_textbook.specs, declared: with_textbook.declared };
        let mut candidates = Candidates::of_model(self.fixed, present);
        let stage = with_textbook.pass(Vec::new(), Keep::WhileThereIsRoom)?;
        let problem = self.fixed.problem(stage, &mut candidates)?;
        let independent = |rows: f64| (rows / problem.rows_per_independent).max(2.0);
        let rows: Vec<f64> = problem.torques.iter().map(|torque| independent(torque.whole.rows())).collect();
        let least_share = self.options.thresholds.least_share;
        Ok(multiples(problem, &candidates.present, &rows, least_share, open))
    }

    /// Adds a kind to the model on each joint that does not have it, with its first constants.
    fn declare_on_all_joints(&mut self, kind: &dyn EffectKind) {
        for site in kind.sites(self.fixed.tree) {
            let Some(constants) = kind.scan(&site, &self.input.ranges).into_iter().next() else { continue };
            let effect = kind.build(self.fixed.tree, &site, &constants);
            let spec = effect.spec();
            let is_it = |other: &EffectSpec| other.kind == spec.kind && other.joints == spec.joints;
            if !self.specs.iter().any(is_it) {
                self.parameters.extend(effect.parameters().iter().map(|_| 0.0));
                self.specs.push(spec);
            }
        }
    }
}
