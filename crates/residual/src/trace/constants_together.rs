//! All constants at once: the way along which two of them make up for each other is not found by one after
//! the other.

use super::scanned::{ScannedConstant, scanned_constants_of};
use super::search::Search;
use super::verdict::errors;
use crate::selection::LEAST_STEP;
use phiw_identification::fitting::{FreeConstant, accumulate, fit};
use phiw_identification::{IdentificationError, Identified};

/// Steps at most.
const STEPS: usize = 3;
/// Times that a step is taken again, half as long, where the criterion is larger after it.
const HALVINGS: usize = 2;

/// A constant: its effect's place and its name.
type Constant = (usize, String);

impl Search<'_> {
    /// Takes all scanned constants to where the fit is best with all of them free, if the criterion is
    /// smaller there (Gauss and Newton's steps, the linear parameters projected out).
    ///
    /// Each constant that moves must be worth a step of the criterion: noise alone makes it a little smaller.
    /// What ends beyond what its kind would try is put at the last that it would, and the others once more to
    /// where the fit is best with that.
    pub(super) fn refine_together(&mut self) -> Result<(), IdentificationError> {
        if self.fixed.prior.is_some() || self.specs.iter().all(|spec| spec.constants.is_empty()) {
            return Ok(());
        }
        let start = self.value(&self.chosen.rows)?;
        let mut branch = self.clone();
        let mut at_their_end = Vec::new();
        let mut value = branch.step_together(start, &at_their_end)?;
        while branch.end_within_the_ranges_of(self, &mut at_their_end)? {
            value = branch.value(&branch.chosen.rows)?;
            value = branch.step_together(value, &at_their_end)?;
        }
        let moved = self.specs.iter().zip(&branch.specs).flat_map(|(own, other)| {
            own.constants.iter().filter(|(name, value)| other.constants.get(*name) != Some(value))
        });
        if value < start - LEAST_STEP * moved.count() as f64 {
            *self = branch;
        }
        Ok(())
    }

    /// Steps while each makes the criterion, which is `value`, smaller; what it is in the end. The constants
    /// `known` stay.
    fn step_together(&mut self, mut value: f64, known: &[Constant]) -> Result<f64, IdentificationError> {
        for _ in 0..STEPS {
            let ways = self.ways_to_the_best(known)?;
            if ways.is_empty() {
                break;
            }
            let mut share = 1.0;
            let mut better = None;
            for _ in 0..=HALVINGS {
                let mut branch = self.clone();
                for ((place, name), way) in &ways {
                    if let Some(constant) = branch.specs[*place].constants.get_mut(name) {
                        *constant += share * way;
                    }
                }
                let after = branch.value(&branch.chosen.rows)?;
                if after < value {
                    better = Some((after, branch));
                    break;
                }
                share *= 0.5;
            }
            let Some((after, branch)) = better else { break };
            *self = branch;
            let gained = value - after;
            value = after;
            if gained < LEAST_STEP {
                break;
            }
        }
        Ok(value)
    }

    /// For each scanned constant that the logs tell, but for those `known`, how far it is from the best
    /// value.
    fn ways_to_the_best(&self, known: &[Constant]) -> Result<Vec<(Constant, f64)>, IdentificationError> {
        let data = self.fixed.data;
        let design = self.design()?;
        let folds = accumulate(&design, &data.train, &data.sources)?;
        let fitted = fit(&design, &folds)?;
        let (train, held_out) = errors(&folds, &folds, &fitted.parameters)?;
        let (train_folds, held_out_folds) = (folds, Vec::new());
        let mut model = Identified { design, fit: fitted, train, held_out, train_folds, held_out_folds };
        let (catalogue, ranges) = (self.fixed.catalogue, &self.input.ranges);
        let is_known = |place: usize, name: &str| known.iter().any(|own| own.0 == place && own.1 == name);
        let constants =
            scanned_constants_of(catalogue, ranges, &mut model, data, |place, name| !is_known(place, name))?;
        let way = |ScannedConstant { effect, name, value, free }: ScannedConstant| {
            let FreeConstant { interval_95: [low, high], .. } = free?;
            Some(((effect, name), 0.5 * (low + high) - value))
        };
        Ok(constants.into_iter().filter_map(way).collect())
    }

    /// Puts the constants that are beyond what their kinds would try next to those of `start` at the last of
    /// that, and adds them to those `known`. Whether there were any.
    fn end_within_the_ranges_of(
        &mut self,
        start: &Self,
        known: &mut Vec<Constant>,
    ) -> Result<bool, IdentificationError> {
        let before = known.len();
        for (place, spec) in start.specs.iter().enumerate() {
            let near = self.fixed.catalogue.refined(spec, self.fixed.tree, &self.input.ranges, 0)?;
            for (name, &value) in &spec.constants {
                let tried = || near.iter().filter_map(|near| near.get(name)).copied();
                let (first, last) = (tried().fold(value, f64::min), tried().fold(value, f64::max));
                let constants = &mut self.specs[place].constants;
                let Some(own) = constants.get_mut(name) else { continue };
                if (first..=last).contains(own) {
                    continue;
                }
                *own = own.clamp(first, last);
                // Where the simplest of a kind is without the constant, that is the last one.
                if near.iter().any(|near| !near.contains_key(name)) {
                    constants.remove(name);
                }
                known.push((place, name.clone()));
            }
        }
        Ok(known.len() > before)
    }
}
