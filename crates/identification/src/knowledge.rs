//! What a model that is held knows of its parameters, and what it left unexplained.

use crate::factor_rows::FactorRows;
use crate::{IdentificationError, Model};
use phiw_regressor::factor::Factor;

impl Model {
    /// What the model left of each torque when it was identified \[N·m, N\]: on the motion that it was fitted
    /// to or on that which was held out, whichever is larger.
    pub fn left(&self) -> Vec<f64> {
        let held_out = |torque: usize| self.held_out_rmse.as_ref().map_or(0.0, |rmse| rmse[torque]);
        self.residual_std.iter().enumerate().map(|(torque, std)| std.max(held_out(torque))).collect()
    }

    /// What the model's logs know of its parameters: its factor, loosened by its covariance.
    ///
    /// The factor takes every row for independent and every constant of an effect for known. The covariance
    /// of folds that are left out counts neither so, but its rank is that of the folds. So the parameters are
    /// w + V·u, where the factor tells w, V·Vᵀ is the covariance, and u is unknown with deviations of 1; what
    /// is left to be known of the sum is the factor's rows once u has been eliminated from them. A friction
    /// whose sign turns over another speed than the model says is then not taken for one that has changed.
    ///
    /// # Errors
    /// The factor or the covariance has not its own size.
    pub fn knowledge(&self) -> Result<Factor, IdentificationError> {
        let factor = self.factor.factor()?;
        let Some(covariance) = &self.covariance else { return Ok(factor) };
        let parameters = &self.factor.parameters;
        let count = parameters.iter().chain(&covariance.parameters).max().map_or(0, |last| last + 1);
        let deviations = covariance.deviations(count)?;
        let (unknown, size) = (deviations.len(), parameters.len() + 1);
        let triangle = factor.triangle();
        let mut rows = Vec::with_capacity((unknown + size) * (unknown + size));
        for row in 0..unknown {
            rows.extend((0..unknown + size).map(|column| f64::from(u8::from(column == row))));
        }
        let mut first = 0;
        for row in 0..size {
            let entries = &triangle[first..first + size - row];
            first += entries.len();
            let shifted = |deviation: &Vec<f64>| -> f64 {
                let of = parameters[row.min(parameters.len())..].iter().zip(entries);
                -of.map(|(&parameter, entry)| entry * deviation[parameter]).sum::<f64>()
            };
            rows.extend(deviations.iter().map(shifted));
            rows.extend(std::iter::repeat_n(0.0, row).chain(entries.iter().copied()));
        }
        let whole = Factor::of_rows(unknown + size, &rows)?.triangle();
        let eliminated = (0..unknown).map(|row| unknown + size - row).sum::<usize>();
        let known = FactorRows {
            parameters: parameters.clone(),
            rows: self.factor.rows,
            entries: whole[eliminated..].to_vec(),
        };
        known.factor()
    }
}
