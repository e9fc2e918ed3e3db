//! What is certain to be impossible leaves the model.

use super::search::Search;
use super::tracing::Withdrawn;
use phiw_identification::fitting::Fit;
use phiw_identification::{Design, IdentificationError};

impl Search<'_> {
    /// The places, ascending, of the effects of which a parameter is certain to be beyond its bounds: its
    /// 95 % interval is. Constants that were refined since it was chosen may have led there, or a point of
    /// linearisation that has moved; or it was declared. Of declared effects none where these stay.
    pub(super) fn impossible(&self, design: &Design, fit: &Fit) -> Vec<(usize, Withdrawn)> {
        let first = if self.declared_stays { self.declared } else { 0 };
        let beyond = |place: usize| {
            let effect = &design.effects()[place];
            let mut own = design.effect_parameters(place).zip(effect.parameters());
            own.find_map(|(parameter, info)| {
                let interval_95 = fit.intervals_95[parameter];
                let (low, high) = info.bounds;
                (interval_95[1] < low || interval_95[0] > high).then(|| Withdrawn {
                    spec: self.specs[place].clone(),
                    name: info.name,
                    unit: info.unit,
                    interval_95,
                    bounds: info.bounds,
                    kept: false,
                })
            })
        };
        (first..self.specs.len()).filter_map(|place| Some((place, beyond(place)?))).collect()
    }

    /// Removes effects that are certain to be impossible, and remembers those that were declared.
    pub(super) fn remove_impossible(
        &mut self,
        impossible: Vec<(usize, Withdrawn)>,
    ) -> Result<(), IdentificationError> {
        for (place, withdrawn) in impossible.into_iter().rev() {
            if place < self.declared {
                self.withdrawn.push(withdrawn);
            }
            self.remove(place)?;
        }
        Ok(())
    }

    /// Takes out of the model what was declared and is certain to be impossible beside all that was found.
    /// Whether there was any.
    pub(super) fn withdraw(&mut self) -> Result<bool, IdentificationError> {
        if self.declared == 0 || self.declared_stays {
            return Ok(false);
        }
        let fitted = self.final_fit(false)?;
        let mut impossible = self.impossible(&fitted.design, &fitted.fit);
        impossible.retain(|(place, _)| *place < self.declared);
        let any = !impossible.is_empty();
        self.remove_impossible(impossible)?;
        if any {
            self.refine()?;
        }
        Ok(any)
    }
}
