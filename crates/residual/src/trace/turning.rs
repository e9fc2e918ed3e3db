//! Friction that turns over a way, in the place of what mended how it turned.

use super::search::Search;
use phiw_identification::IdentificationError;

impl Search<'_> {
    /// Lets the frictions of a joint turn over a way, as bristles do, in the place of a hysteresis or a delay of
    /// that joint, where the criterion is then smaller. Whether any do.
    ///
    /// Constants are refined one effect after the other, and each is best as it is beside what mends it.
    pub(super) fn turn_over_a_way(&mut self) -> Result<bool, IdentificationError> {
        let catalogue = self.fixed.catalogue;
        let mut own = None;
        let mut any = false;
        for place in (self.declared..self.specs.len()).rev() {
            let joints = self.specs[place].joints.clone();
            if joints.len() != 1 || !catalogue.kind(&self.specs[place].kind)?.mends_turning() {
                continue;
            }
            let mut branch = self.clone();
            let mut turn = 0;
            for other in 0..self.specs.len() {
                let spec = &mut branch.specs[other];
                if spec.joints != joints || self.is_held(other) {
                    continue;
                }
                if let Some(turned) = catalogue.kind(&spec.kind)?.turned_over_a_way(&spec.constants) {
                    spec.constants = turned;
                    turn += 1;
                }
            }
            if turn == 0 {
                continue;
            }
            branch.remove(place)?;
            branch.refine()?;
            let value = branch.value(&branch.chosen.rows)?;
            let present = match own {
                Some(own) => own,
                None => *own.insert(self.value(&self.chosen.rows)?),
            };
            if value < present {
                *self = branch;
                own = Some(value);
                any = true;
            }
        }
        Ok(any)
    }
}
