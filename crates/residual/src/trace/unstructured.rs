//! Noise that is larger than its floor: what is left of a torque, coloured or not, and follows nothing.

use super::naming::Judged;
use super::probe;
use super::search::Search;
use super::trial::Trial;
use phiw_identification::IdentificationError;

impl Search<'_> {
    /// Takes for noise what the model leaves of torques on which an effect is certain and has no name, but
    /// may have one, where that is more than the floor and training motion foretells none of it. Whether it
    /// has for any torque.
    ///
    /// The floor is told by what is above the band of the motion. Of coloured noise, or noise that the drive
    /// filtered, it has a small part, and what noise leaves would be a gap that effects have left.
    pub(super) fn take_for_noise(
        &mut self,
        trial: &Trial,
        judged: &[Judged],
    ) -> Result<bool, IdentificationError> {
        let may = |judged: &&Judged| judged.certain && !judged.named && self.may_have_a_name(judged.place);
        let nameless = judged.iter().filter(may);
        let members = nameless.filter_map(|judged| trial.member(judged.place));
        let rows = members
            .flat_map(|member| trial.problem.hypotheses[member.hypothesis].torques.iter().copied())
            .collect();
        self.take_for_noise_of(trial, rows)
    }

    /// The same for the torques on which effects were found that have a special case: what they take beyond
    /// it is judged beside what is left.
    pub(super) fn take_for_noise_beside_special_cases(&mut self) -> Result<(), IdentificationError> {
        let has_special_case = |place: &usize| {
            let kind = self.fixed.catalogue.kind(&self.specs[*place].kind);
            kind.is_ok_and(|kind| kind.special_case().is_some())
        };
        let places: Vec<usize> = (self.declared..self.specs.len()).filter(has_special_case).collect();
        if places.is_empty() {
            return Ok(());
        }
        let trial = self.trial()?;
        let rows = places
            .into_iter()
            .filter_map(|place| trial.member(place))
            .flat_map(|member| trial.problem.hypotheses[member.hypothesis].torques.iter().copied())
            .collect();
        self.take_for_noise_of(&trial, rows)?;
        Ok(())
    }

    /// The same for these torques, as far as it is more than the floor and follows nothing.
    fn take_for_noise_of(
        &mut self,
        trial: &Trial,
        mut rows: Vec<usize>,
    ) -> Result<bool, IdentificationError> {
        rows.sort_unstable();
        rows.dedup();
        let squares = trial.foretold_squares(&trial.fit);
        let left = |row: usize| (squares[row] / trial.torque(row).rows().max(1.0)).sqrt();
        rows.retain(|&row| left(row) > self.options.thresholds.same_error * self.noise[row]);
        if rows.is_empty() {
            return Ok(false);
        }
        let folds = &self.fixed.data.train;
        let shape = self.shape_of_residual(folds)?;
        let following = probe::following(self.probed(folds, &shape), &rows)?;
        rows.retain(|row| !following.contains(row) && !self.wanders(&shape, *row));
        rows.iter().for_each(|&row| self.noise[row] = left(row));
        Ok(!rows.is_empty())
    }
}
