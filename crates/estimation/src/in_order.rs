//! Rows beside those of the period before: what noise that is correlated in time asks for.
//!
//! Where the noise of a period is ρ times that of the period before and something new, the rows Φ_t −
//! ρ·Φ_{t−1} have the new alone. ρ is not known when a log is read, but R of \[Φ_{t−1} Φ_t\] gives R of these
//! rows for any ρ. What the log's torque has beside the command ([`MotionLog::commands`]) is a column of its
//! own, so that how much of it the motion felt can be asked later, too.

use super::turning::Believed;
use crate::{EstimationError, Evidence, MotionLog, foresight};
use faer::Mat;
use phiw_identification::Design;
use phiw_regressor::RegressorError;
use phiw_regressor::factor::{Factor, FactorBuilder};
use phiw_regressor::least_squares::{Group, GroupedFactor};

/// R of the rows of all torques with those before them.
///
/// The columns of a torque are `[Φ d u]` of the period before, then of the period: u the command, d what the
/// log's torque has beside it.
#[derive(Clone, Debug)]
pub(super) struct InOrder {
    /// Named so that they are parameters of a grouped factor, which merges and is written down like any.
    factor: GroupedFactor,
    parameters: usize,
}

/// How the noise of a torque is counted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Colour {
    /// ρ, its correlation from a period to the next.
    pub correlation: f64,
    /// Share of d that the motion felt.
    pub felt: f64,
}

/// Columns of a torque beside those of Φ: d and u.
const BESIDE: usize = 2;

impl InOrder {
    pub fn none(design: &Design) -> Result<Self, EstimationError> {
        let (parameters, groups) = (design.parameter_count(), design.rows().len());
        let named = |group: usize, own: &[usize]| {
            let block = parameters + BESIDE * groups;
            let of = |first: usize| {
                own.iter()
                    .map(move |parameter| first + parameter)
                    .chain((0..BESIDE).map(move |beside| first + parameters + BESIDE * group + beside))
            };
            let mut all: Vec<usize> = of(0).chain(of(block)).collect();
            // The command of the period is the right-hand side.
            all.pop();
            all
        };
        let group = |(index, layout): (usize, &phiw_identification::design::RowLayout)| {
            let names = named(index, &layout.parameters);
            Group { factor: Factor::empty(names.len() + 1), parameters: names }
        };
        let all = design.rows().iter().enumerate().map(group).collect();
        let factor = GroupedFactor::new(2 * (parameters + BESIDE * groups), all)?;
        Ok(InOrder { factor, parameters })
    }

    /// Of what has been written down.
    pub fn of_factor(factor: GroupedFactor) -> Self {
        let parameters = factor.parameter_count() / 2 - BESIDE * factor.groups().len();
        InOrder { factor, parameters }
    }

    /// Of a torque: its factor, half the number of its columns, and the parameters of Φ's.
    pub fn torque(&self, torque: usize) -> (&Group, usize, Vec<usize>) {
        let group = &self.factor.groups()[torque];
        let half = group.factor.columns() / 2;
        let first = self.factor.parameter_count() / 2;
        let own = group.parameters[half..2 * half - BESIDE].iter();
        (group, half, own.map(|parameter| parameter - first).collect())
    }

    /// Whether the log's torque has anything beside the command, but rounding.
    pub fn differs(&self, torque: usize) -> bool {
        let factor = &self.factor.groups()[torque].factor;
        let beside = factor.as_mat().col(factor.columns() - BESIDE);
        beside.squared_norm_l2() > DIFFERS * factor.right_hand_side_sum_of_squares()
    }

    pub fn factor(&self) -> &GroupedFactor {
        &self.factor
    }

    /// Takes in a log.
    pub fn add(
        &mut self,
        design: &Design,
        foreseen: &[bool],
        (measured, believed): (&MotionLog, Option<&Believed>),
    ) -> Result<(), EstimationError> {
        let limits: Vec<f64> =
            (0..measured.joints).map(|joint| design.tree().joint(joint).limits.effort).collect();
        let commands = measured.commands(&limits);
        let counted = measured.counted_rows();
        let none;
        let foreseen = match foreseen {
            [] => {
                none = vec![false; design.parameter_count()];
                &none
            }
            foreseen => foreseen,
        };
        let mut builders: Vec<FactorBuilder> =
            self.factor.groups().iter().map(|group| FactorBuilder::new(group.factor.columns())).collect();
        let mut before: Vec<Vec<f64>> =
            self.factor.groups().iter().map(|group| vec![0.0; group.factor.columns() / 2]).collect();
        let (mut index, mut joined) = (0, Vec::new());
        foresight::rows(design, foreseen, (measured, believed), |row| {
            let here = counted[index];
            let follows = index > 0 && counted[index - 1] + 1 == here;
            index += 1;
            for (torque, layout) in design.rows().iter().enumerate() {
                let values = &row[layout.range.clone()];
                let (logged, columns) = (values[values.len() - 1], &values[..values.len() - 1]);
                let command = commands[here * measured.joints + torque];
                joined.clear();
                joined.extend_from_slice(&before[torque]);
                joined.extend_from_slice(columns);
                joined.extend_from_slice(&[logged - command, command]);
                if follows {
                    builders[torque].push_row(&joined)?;
                }
                let own = joined.len() / 2;
                before[torque].copy_from_slice(&joined[own..]);
            }
            Ok(())
        })?;
        let groups = builders
            .iter_mut()
            .zip(self.factor.groups())
            .map(|(builder, group)| Group { parameters: group.parameters.clone(), factor: builder.factor() });
        let added = GroupedFactor::new(self.factor.parameter_count(), groups.collect())?;
        self.factor = self.factor.merge(&added)?;
        Ok(())
    }

    /// R of \[Φ f\] of each torque as white noise would have left it: f is the command and the share of d
    /// that the motion felt.
    pub fn whitened(&self, colours: &[Colour]) -> Result<GroupedFactor, RegressorError> {
        let group = |(group, colour): (&Group, &Colour)| {
            let half = group.factor.columns() / 2;
            let own = half - BESIDE;
            let share = |row: usize, column: usize| match (row, column) {
                _ if row < own => f64::from(u8::from(row == column)),
                _ if column < own => 0.0,
                _ if row == own => colour.felt,
                _ => 1.0,
            };
            let map = Mat::from_fn(2 * half, own + 1, |row, column| match row.checked_sub(half) {
                Some(row) => share(row, column),
                None => -colour.correlation * share(row, column),
            });
            let parameters = group.parameters[half..half + own].iter();
            let first = self.factor.parameter_count() / 2;
            Ok(Group {
                parameters: parameters.map(|parameter| parameter - first).collect(),
                factor: group.factor.combine(map.as_ref())?,
            })
        };
        let groups: Result<Vec<Group>, RegressorError> =
            self.factor.groups().iter().zip(colours).map(group).collect();
        GroupedFactor::new(self.parameters, groups?)
    }

    /// The colour of each torque's noise under parameters `w`: the felt share and the correlation that leave
    /// least, found one after the other until they stay. `least` is the variance of each torque's noise that
    /// nothing is believed to fall short of, and that is white: a residual below it has no colour. `beside`
    /// are the squares and products of each torque's residual that the rows do not show
    /// ([`super::smoothing::Smoothed::noise`]).
    pub fn colours(&self, w: &[f64], least: &[f64], largest: f64, beside: &[[f64; 3]]) -> Vec<Colour> {
        let colour = |(torque, (group, least)): (usize, (&Group, &f64))| {
            let [before, across, after] = beside.get(torque).copied().unwrap_or_default();
            let least = least * group.factor.rows() as f64;
            let half = group.factor.columns() / 2;
            let own = half - BESIDE;
            let first = self.factor.parameter_count() / 2;
            let parameters = &group.parameters[half..half + own];
            // What is left of the period before and of the period, and d of both.
            let map = Mat::from_fn(2 * half, 4, |row, column| {
                let (row, period) = (row % half, row / half);
                match (row, column) {
                    (_, column) if column % 2 != period => 0.0,
                    (row, 0 | 1) if row < own => w[parameters[row] - first],
                    (row, 0 | 1) if row == own + 1 => -1.0,
                    (row, 2 | 3) if row == own => 1.0,
                    _ => 0.0,
                }
            });
            let parts = group.factor.as_mat() * map;
            let product = |a: usize, b: usize| {
                let unseen = match (a, b) {
                    (0, 0) => before,
                    (0, 1) | (1, 0) => across,
                    (1, 1) => after,
                    _ => 0.0,
                };
                parts.col(a).transpose() * parts.col(b) + unseen
            };
            let command = group.factor.right_hand_side_sum_of_squares();
            let mut colour = Colour { correlation: 0.0, felt: 0.0 };
            let logs_differ = product(3, 3) > DIFFERS * command;
            for _ in 0..ROUNDS {
                let Colour { correlation, .. } = colour;
                if logs_differ {
                    let across = |a: usize, b: usize| {
                        product(a + 1, b + 1) - correlation * (product(a + 1, b) + product(a, b + 1))
                            + correlation * correlation * product(a, b)
                    };
                    colour.felt = across(2, 0) / across(2, 2);
                }
                let felt = colour.felt;
                let left = |a: usize, b: usize| {
                    product(a, b) - felt * (product(a, b + 2) + product(a + 2, b))
                        + felt * felt * product(a + 2, b + 2)
                };
                colour.correlation = (left(1, 0) / (left(0, 0) + least)).clamp(-largest, largest);
                if !(colour.correlation.is_finite() && colour.felt.is_finite()) {
                    return Colour { correlation: 0.0, felt: 0.0 };
                }
            }
            colour
        };
        self.factor.groups().iter().zip(least).enumerate().map(colour).collect()
    }
}

/// Times that the felt share and the correlation are found one after the other: each hardly changes the
/// other.
const ROUNDS: usize = 5;
/// Share of a command's square below which what a log has beside it is rounding.
const DIFFERS: f64 = 1e-12;

impl Evidence {
    /// The rows with those before them, where they were asked for.
    pub(super) fn in_order(&self) -> Result<&InOrder, EstimationError> {
        self.in_order.as_ref().ok_or(EstimationError::Log(
            "its rows were not taken in order: ask the evidence for them (EvidenceSettings::in_order)",
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use phiw_dynamics::random_tree::{RandomTreeOptions, random_tree};
    use phiw_regressor::BaseParameters;

    /// Rows that are whitened one by one are the oracle.
    #[test]
    fn the_factor_of_whitened_rows_follows_for_any_colour() -> Result<(), Box<dyn std::error::Error>> {
        let tree = random_tree(5, &RandomTreeOptions::default())?;
        let design =
            Design::new(tree.clone(), BaseParameters::of_tree(&tree, Default::default())?, Vec::new());
        let (joints, rows) = (tree.joint_count(), 40);
        let wave = |shift: f64| -> Vec<f64> {
            (0..rows * joints).map(|index| ((0.7 + shift) * index as f64 + shift).sin()).collect()
        };
        let [q, qd, tau, command] = [0.1, 0.3, 0.5, 0.8].map(wave);
        let log = MotionLog { joints, period_s: 0.01, q, qd, tau, command, ..MotionLog::default() };
        let mut in_order = InOrder::none(&design)?;
        in_order.add(&design, &[], (&log, None))?;
        let colour = Colour { correlation: 0.6, felt: 0.3 };
        let whitened = in_order.whitened(&vec![colour; design.rows().len()])?;
        let mut all = Vec::new();
        foresight::rows(&design, &vec![false; design.parameter_count()], (&log, None), |row| {
            all.push(row.to_vec());
            Ok(())
        })?;
        for (torque, (layout, group)) in design.rows().iter().zip(whitened.groups()).enumerate() {
            let own = |row: usize| {
                let mut values = all[row][layout.range.clone()].to_vec();
                let last = values.len() - 1;
                let command = log.command[row * joints + torque];
                values[last] = command + colour.felt * (values[last] - command);
                values
            };
            let mut builder = FactorBuilder::new(layout.range.len());
            for row in 1..all.len() {
                let pairs = own(row).into_iter().zip(own(row - 1));
                builder.push_row(&pairs.map(|(now, before)| now - 0.6 * before).collect::<Vec<_>>())?;
            }
            let w: Vec<f64> = (0..layout.parameters.len()).map(|index| 0.1 * index as f64).collect();
            let (found, expected) =
                (group.factor.residual_sum_of_squares(&w)?, builder.factor().residual_sum_of_squares(&w)?);
            assert!((found / expected - 1.0).abs() < 1e-9, "{torque}: {found}, {expected}");
            assert_eq!(group.parameters, layout.parameters);
        }
        Ok(())
    }
}
