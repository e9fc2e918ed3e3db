//! The effects that were found in the order in which they count, each with what it explains and its rivals.

use super::naming::Judged;
use super::search::Search;
use super::tracing::{FoundEffect, RivalEffect};
use super::trial::Trial;
use crate::selection::Products;
use phiw_identification::{EffectSpec, IdentificationError};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// A rival that is less probable is none.
pub const LEAST_RIVAL: f64 = 0.05;

/// The odds that an effect's work is done by none of the forms that were compared, against the chosen one. Of
/// 395 names of which the compared forms left no doubt, 94.9 % were true (`cargo xtask undeclared --suite
/// wide_effects` prints how often names of each confidence are; 36 development and 30 reporting cases).
const OF_NO_KNOWN_FORM: f64 = 0.05;

impl Search<'_> {
    /// Puts the effects into the order in which they count, and says what each has explained.
    pub(super) fn in_order(
        &mut self,
        trial: &Trial,
        mut judged: Vec<Judged>,
    ) -> Result<(Vec<FoundEffect>, usize), IdentificationError> {
        // A kind on each of several joints is one family, which stands together.
        let family = |judged: &Judged| -> (bool, String, Vec<String>) {
            let spec = &self.specs[judged.place];
            let joints = if spec.joints.len() > 1 { spec.joints.clone() } else { Vec::new() };
            (judged.named, spec.kind.clone(), joints)
        };
        let mut gains: BTreeMap<(bool, String, Vec<String>), f64> = BTreeMap::new();
        judged.iter().for_each(|judged| *gains.entry(family(judged)).or_default() += judged.gain);
        judged.sort_by(|a, b| {
            let (of_a, of_b) = (family(a), family(b));
            let by_family = b.named.cmp(&a.named).then(gains[&of_b].total_cmp(&gains[&of_a]));
            by_family.then(of_a.cmp(&of_b)).then(a.place.cmp(&b.place))
        });
        let named = judged.iter().filter(|judged| judged.named).count();
        let declared = self.declared;
        let mut found: Vec<FoundEffect> = Vec::new();
        let account = |inside: &[usize]| {
            let fit = trial.fit_with(|place| place < declared || inside.contains(&place));
            let squares = trial.held_out_squares(&fit);
            let torque: f64 = trial.held_out.iter().map(Products::right_hand_side).sum();
            let excess: f64 = squares
                .iter()
                .zip(&trial.held_out)
                .zip(&self.input.noise_floor)
                .map(|((squares, held_out), floor)| (squares - held_out.rows() * floor * floor).max(0.0))
                .sum();
            ((squares.iter().sum::<f64>() / torque).sqrt(), excess)
        };
        let places: Vec<usize> = judged.iter().map(|judged| judged.place).collect();
        let accounts: Vec<(f64, f64)> =
            (0..=places.len()).into_par_iter().map(|count| account(&places[..count])).collect();
        for (judged, accounts) in judged.iter().zip(accounts.windows(2)) {
            let (before, after) = (accounts[0], accounts[1]);
            let (confidence, rivals) = odds(&self.chosen.alternatives[judged.place - declared]);
            found.push(FoundEffect {
                spec: self.specs[judged.place].clone(),
                relative: after.0,
                relative_before: before.0,
                explains: match before.1 > 0.0 {
                    true => (1.0 - after.1 / before.1).clamp(0.0, 1.0),
                    false => 0.0,
                },
                confidence,
                stability: judged.folds,
                significance: judged.significance,
                rivals,
                ranking: Vec::new(),
            });
        }
        let order: Vec<usize> = (0..declared).chain(judged.iter().map(|judged| judged.place)).collect();
        self.reorder(&order)?;
        Ok((found, named))
    }

    /// Puts the effects, with their parameters, into another order.
    pub(super) fn reorder(&mut self, order: &[usize]) -> Result<(), IdentificationError> {
        let design = self.design()?;
        let of_effects = order.iter().flat_map(|&place| design.effect_parameters(place));
        self.parameters = (0..self.fixed.base.count())
            .chain(of_effects)
            .map(|parameter| self.parameters[parameter])
            .collect();
        self.specs = order.iter().map(|&place| self.specs[place].clone()).collect();
        let found = order.iter().filter_map(|place| place.checked_sub(self.declared));
        self.chosen.alternatives = found.map(|found| self.chosen.alternatives[found].clone()).collect();
        Ok(())
    }
}

/// The probability of the chosen one, and the rivals with theirs: e^(−excess/2), the criterion being twice a
/// negative log-likelihood, and the odds that it is none of them.
fn odds(alternatives: &[(EffectSpec, f64)]) -> (f64, Vec<RivalEffect>) {
    let weigh = |excess: f64| (-0.5 * excess.max(0.0)).exp();
    let sum: f64 =
        1.0 + OF_NO_KNOWN_FORM + alternatives.iter().map(|(_, excess)| weigh(*excess)).sum::<f64>();
    let rival = |(spec, excess): &(EffectSpec, f64)| RivalEffect {
        spec: spec.clone(),
        confidence: weigh(*excess) / sum,
    };
    let rivals = alternatives.iter().map(rival).filter(|rival| rival.confidence >= LEAST_RIVAL).collect();
    (1.0 / sum, rivals)
}
