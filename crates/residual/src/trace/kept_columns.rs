//! One pass over the logs. What a column is made of is mostly the motion alone: such columns are the same in
//! every pass, and are evaluated once.
//!
//! What is in force changes few of them. A measured torque that is shifted is another right-hand side. A
//! torque whose log is a multiple has its columns times that factor. Links that are not where their encoders
//! are have other columns of the rigid body. Only another motion has other columns throughout.

use crate::selection::Products;
use faer::Mat;
use phiw_identification::design::RowLayout;
use phiw_identification::effect::{Entry, ReferenceModel};
use phiw_identification::fitting::{FilteredRows, map_filtered_rows};
use phiw_identification::{BlockSource, Design, Effect, EffectSpec, Fold, IdentificationError};
use phiw_regressor::RegressorError;
use rayon::prelude::*;
use std::collections::{HashMap, HashSet};
use std::ops::Range;
use std::sync::Arc;

/// Columns that are kept, at most \[bytes\].
const KEPT_BYTES: usize = 256 << 20;

/// Whether columns come again in other passes.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Keep {
    /// Those of candidates that are judged in every choice.
    Always,
    /// Those of constants on trial may come again, and are kept while half of the room is left.
    WhileThereIsRoom,
}

/// What is asked of a pass.
pub(super) struct Pass<'a> {
    /// The model's effects, then the candidates', without a reference model.
    pub design: &'a Design,
    /// Effects of the model that are in force in the signals or the torques themselves.
    pub in_force: Vec<EffectSpec>,
    pub reference: ReferenceModel,
    pub folds: &'a [Fold],
    pub sources: &'a [&'a dyn BlockSource],
    pub keep: Keep,
}

/// What a pass gives.
pub(super) struct PassProducts {
    /// For each torque the products of each fold.
    pub torques: Vec<Vec<Products>>,
    /// Candidates whose columns are not finite.
    pub not_finite: Vec<usize>,
}

/// Filtered columns of earlier passes.
#[derive(Default)]
pub(super) struct KeptColumns {
    /// The effects that corrected the motion: with others every column is another.
    of_motion: Vec<EffectSpec>,
    blocks: Vec<KeptBlock>,
    /// Where the columns of an effect are among those of effects.
    effects: HashMap<Key, Range<usize>>,
    /// Number of columns of effects.
    columns: usize,
    /// Rows of all blocks together, once they are known.
    rows: Option<usize>,
}

/// The columns of one block, of torques that are logged as they are.
struct KeptBlock {
    /// For each torque whether a row counts.
    counts: Vec<Vec<bool>>,
    /// For each torque the rigid body's columns, of links that are where their encoders are.
    rigid_body: Vec<Vec<Vec<f64>>>,
    effects: Vec<Vec<f64>>,
}

/// An effect's kind, joints and constants.
type Key = (String, Vec<String>, Vec<(String, u64)>);

fn key(spec: &EffectSpec) -> Key {
    let constants = spec.constants.iter().map(|(name, value)| (name.clone(), value.to_bits()));
    (spec.kind.clone(), spec.joints.clone(), constants.collect())
}

/// Where a column is.
#[derive(Clone, Copy)]
enum Place {
    Kept(usize),
    Evaluated(usize),
}

/// What one block adds.
struct Piece {
    /// For each fold that it has rows in, the products of each torque.
    products: Vec<(usize, Vec<Products>)>,
    rows: usize,
    /// What is kept of a block that nothing is kept of yet.
    block: Option<KeptBlock>,
    /// New columns of effects.
    effects: Vec<Vec<f64>>,
}

/// What a pass evaluates.
struct Evaluated {
    design: Design,
    has_rigid_body: bool,
    /// Whether links lag behind their encoders: then the rigid body's columns are of this pass alone.
    lags: bool,
    /// For each torque where its effects' columns are.
    places: Vec<Vec<Place>>,
    /// Torque and column of the evaluation of what is kept from now on.
    kept: Vec<(usize, usize)>,
}

impl KeptColumns {
    /// The products of a pass; columns that are at hand are not evaluated again.
    ///
    /// # Errors
    /// A log cannot be read, or a column of the model is not finite.
    pub fn products(&mut self, pass: Pass<'_>) -> Result<PassProducts, IdentificationError> {
        let corrects_motion = |spec: &&EffectSpec| {
            let effects = pass.design.effects();
            let place = effects.iter().position(|effect| effect.spec() == **spec);
            place.is_some_and(|place| pass.design.corrects_motion(place))
        };
        let of_motion: Vec<EffectSpec> = pass.in_force.iter().filter(corrects_motion).cloned().collect();
        let is_other = of_motion != self.of_motion;
        if is_other || self.rows.is_none() {
            let mut other = KeptColumns { of_motion, rows: self.rows, ..KeptColumns::default() };
            // A model on trial with another motion is no reason to forget what the model has.
            if is_other && pass.keep == Keep::WhileThereIsRoom {
                return other.evaluate(pass);
            }
            other.evaluate_rigid_body(&pass)?;
            *self = other;
        }
        self.evaluate(pass)
    }

    /// The rigid body's columns, and how many rows there are: so there is room for others in the first pass.
    fn evaluate_rigid_body(&mut self, pass: &Pass<'_>) -> Result<(), IdentificationError> {
        let effects = pass.design.effects().iter().enumerate();
        let of_motion = effects.filter(|(_, effect)| self.of_motion.contains(&effect.spec()));
        let of_motion: Vec<usize> = of_motion.map(|(place, _)| place).collect();
        let design = pass.design.part(&of_motion, true);
        let reference = ReferenceModel::new(design.tree().clone());
        let in_force = self.of_motion.clone();
        self.evaluate(Pass { design: &design, in_force, reference, ..*pass })?;
        Ok(())
    }

    fn evaluate(&mut self, pass: Pass<'_>) -> Result<PassProducts, IdentificationError> {
        let Pass { design, in_force, reference, folds, sources, keep } = pass;
        let in_force: HashSet<Key> = in_force.iter().map(key).collect();
        let keys: Vec<Key> = design.effects().iter().map(|effect| key(&effect.spec())).collect();
        let lags = design.effects().iter().any(|effect| effect.compliance().is_some());
        // Such columns are of this pass alone.
        let is_of_this_pass = |effect: usize| {
            let needs = design.effects()[effect].needs();
            needs.of_reference() || (lags && needs.statics) || in_force.contains(&keys[effect])
        };
        let is_evaluated =
            |&effect: &usize| is_of_this_pass(effect) || !self.effects.contains_key(&keys[effect]);
        let chosen: Vec<usize> = (0..keys.len()).filter(is_evaluated).collect();
        let has_rigid_body = lags || self.blocks.is_empty();
        let part = design.part(&chosen, has_rigid_body).with_reference(reference);
        let evaluated = columns_of_effects(&part);
        let mut new = Vec::new();
        let mut kept = Vec::new();
        for (at, &effect) in chosen.iter().enumerate() {
            let columns = &evaluated[at];
            let room = self.room(keep).saturating_sub(kept.len());
            if !is_of_this_pass(effect) && columns.len() <= room {
                let first = self.columns + kept.len();
                new.push((effect, first..first + columns.len()));
                kept.extend(columns);
            }
        }
        let mut places: Vec<Vec<Place>> = vec![Vec::new(); design.rows().len()];
        let mut next = chosen.iter().zip(&evaluated).peekable();
        for (effect, own) in design.effects().iter().enumerate() {
            if let Some((_, columns)) = next.next_if(|(chosen, _)| **chosen == effect) {
                columns.iter().for_each(|&(row, column)| places[row].push(Place::Evaluated(column)));
            } else if let Some(columns) = self.effects.get(&keys[effect]) {
                let entries = own.entries().into_iter().zip(columns.clone());
                entries.for_each(|(entry, column)| places[entry.row].push(Place::Kept(column)));
            }
        }
        let evaluated = Evaluated { design: part, has_rigid_body, lags, places, kept };
        let pieces = map_filtered_rows(&evaluated.design, sources, |block, rows| {
            self.piece(&evaluated, folds, block, &rows)
        })?;
        let not_finite: Vec<usize> = evaluated.design.not_finite().into_iter().map(|at| chosen[at]).collect();
        let torques = self.take(pieces, folds.len(), design);
        if !torques.iter().flatten().all(Products::is_finite) {
            return Err(RegressorError::NotFinite { row: 0 }.into());
        }
        self.columns += evaluated.kept.len();
        // What is not finite is asked for again, and says so again.
        new.retain(|(effect, _)| !not_finite.contains(effect));
        self.effects.extend(new.into_iter().map(|(effect, columns)| (keys[effect].clone(), columns)));
        Ok(PassProducts { torques, not_finite })
    }

    /// Columns of effects that there is still room for: none before the number of rows is known.
    fn room(&self, keep: Keep) -> usize {
        let Some(rows) = self.rows.filter(|_| !self.blocks.is_empty()) else { return 0 };
        let rigid_body = self.blocks.first().map_or(0, |block| block.rigid_body.iter().map(Vec::len).sum());
        let bytes = match keep {
            Keep::Always => KEPT_BYTES,
            Keep::WhileThereIsRoom => KEPT_BYTES / 2,
        };
        (bytes / size_of::<f64>() / rows.max(1)).saturating_sub(rigid_body + self.columns)
    }

    fn piece(&self, evaluated: &Evaluated, folds: &[Fold], block: usize, rows: &FilteredRows) -> Piece {
        let design = &evaluated.design;
        let own = evaluated.has_rigid_body.then(|| KeptBlock {
            counts: (0..design.rows().len()).map(|torque| rows.counts(torque).collect()).collect(),
            rigid_body: rigid_body_of(design, rows),
            effects: Vec::new(),
        });
        let kept = self.blocks.get(block);
        let products = match own.as_ref().or(kept) {
            Some(block) => {
                let effects = kept.map_or(&[][..], |kept| &kept.effects);
                products_of(evaluated, folds, block, effects, rows)
            }
            None => Vec::new(),
        };
        let effects = evaluated.kept.iter().map(|&(torque, column)| {
            let factor = design.logged_factors()[torque];
            rows.column(column).iter().map(|value| value / factor).collect()
        });
        Piece {
            products,
            rows: rows.t.len(),
            effects: effects.collect(),
            block: own.filter(|_| !evaluated.lags),
        }
    }

    /// Keeps what the pieces bring, and puts the products of each fold together, in the order of the blocks.
    fn take(&mut self, pieces: Vec<Piece>, folds: usize, design: &Design) -> Vec<Vec<Products>> {
        self.rows = Some(pieces.iter().map(|piece| piece.rows).sum());
        let mut of_torques: Vec<Vec<(usize, Products)>> = vec![Vec::new(); design.rows().len()];
        for (place, piece) in pieces.into_iter().enumerate() {
            self.blocks.extend(piece.block);
            if let Some(block) = self.blocks.get_mut(place) {
                block.effects.extend(piece.effects);
            }
            for (fold, products) in piece.products {
                let torques = of_torques.iter_mut().zip(products);
                torques.for_each(|(own, products)| own.push((fold, products)));
            }
        }
        let numbers = self.blocks.first().map_or(0, |block| block.rigid_body.iter().map(Vec::len).sum());
        if numbers * self.rows.unwrap_or_default() * size_of::<f64>() > KEPT_BYTES {
            self.blocks.clear();
        }
        let base = design.base().count();
        let whole = |(pieces, layout): (Vec<(usize, Products)>, &RowLayout)| {
            let mut sums: Vec<Option<Products>> = vec![None; folds];
            for (fold, products) in pieces {
                match &mut sums[fold] {
                    Some(sum) => sum.add(&products),
                    empty => *empty = Some(products),
                }
            }
            let zero = || Products::zero(layout.parameters.len() + 1);
            let rigid_body = layout.parameters.partition_point(|&parameter| parameter < base);
            sums.into_iter().map(|sum| sum.unwrap_or_else(zero).without_rounding(rigid_body)).collect()
        };
        of_torques.into_par_iter().zip(design.rows()).map(whole).collect()
    }
}

/// For each effect of a design, the torque and the column of the evaluation of each of its entries.
fn columns_of_effects(design: &Design) -> Vec<Vec<(usize, usize)>> {
    let first = design.base().count();
    let mut next: Vec<usize> = design
        .rows()
        .iter()
        .map(|row| row.range.start + row.parameters.partition_point(|&parameter| parameter < first))
        .collect();
    let mut of_effect = |effect: &Arc<dyn Effect>| {
        let place = |entry: Entry| {
            next[entry.row] += 1;
            (entry.row, next[entry.row] - 1)
        };
        effect.entries().into_iter().map(place).collect()
    };
    design.effects().iter().map(&mut of_effect).collect()
}

/// For each torque the columns before those of effects.
fn rigid_body_of(design: &Design, rows: &FilteredRows) -> Vec<Vec<Vec<f64>>> {
    let first = design.base().count();
    let of_torque = |(row, factor): (&RowLayout, &f64)| {
        let own = row.parameters.partition_point(|&parameter| parameter < first);
        let column = |column: usize| rows.column(column).iter().map(|value| value / factor).collect();
        (row.range.start..row.range.start + own).map(column).collect()
    };
    design.rows().iter().zip(design.logged_factors()).map(of_torque).collect()
}

/// For each fold that has rows in a block, the products of each torque.
fn products_of(
    evaluated: &Evaluated,
    folds: &[Fold],
    block: &KeptBlock,
    kept: &[Vec<f64>],
    rows: &FilteredRows,
) -> Vec<(usize, Vec<Products>)> {
    let fold_of = |t: &f64| folds.iter().position(|fold| fold.contains(rows.log, *t));
    let fold_of_row: Vec<Option<usize>> = rows.t.iter().map(fold_of).collect();
    let mut present: Vec<usize> = fold_of_row.iter().flatten().copied().collect();
    present.sort_unstable();
    present.dedup();
    let of_torque = |fold: usize, torque: usize| {
        let counts = &block.counts[torque];
        let own: Vec<usize> =
            (0..counts.len()).filter(|&row| counts[row] && fold_of_row[row] == Some(fold)).collect();
        let factor = evaluated.design.logged_factors()[torque];
        let effects = evaluated.places[torque].iter().map(|place| match *place {
            Place::Kept(column) => (factor, kept[column].as_slice()),
            Place::Evaluated(column) => (1.0, rows.column(column)),
        });
        let measured = rows.column(evaluated.design.rows()[torque].range.end - 1);
        let rigid_body = block.rigid_body[torque].iter().map(|column| (factor, column.as_slice()));
        let columns: Vec<(f64, &[f64])> = rigid_body.chain(effects).chain([(1.0, measured)]).collect();
        Products::of_rows(
            Mat::from_fn(own.len(), columns.len(), |row, column| {
                let (factor, values) = columns[column];
                factor * values[own[row]]
            })
            .as_ref(),
        )
    };
    present
        .into_iter()
        .map(|fold| (fold, (0..evaluated.places.len()).map(|torque| of_torque(fold, torque)).collect()))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use phiw_dynamics::Tree;
    use phiw_dynamics::random_tree::{RandomNumbers, RandomTreeOptions, random_tree};
    use phiw_effects::Catalogue;
    use phiw_identification::EffectCatalogue;
    use phiw_identification::fitting::accumulate;
    use phiw_regressor::BaseParameters;
    use phiw_telemetry::Block;

    /// Two blocks of one log.
    fn blocks(joints: usize) -> Vec<Block> {
        let block = |first: usize| {
            let time = |sample: usize| 0.01 * (first + sample) as f64;
            let signal = |phase: f64| -> Vec<f64> {
                let at = |sample: usize, joint: usize| (2.0 * time(sample) + phase + joint as f64).sin();
                (0..200).flat_map(|sample| (0..joints).map(move |joint| at(sample, joint))).collect()
            };
            let t = (0..200).map(time).collect();
            Block::unfiltered(joints, t, [signal(0.0), signal(1.5), signal(3.0)], signal(0.7))
        };
        vec![block(0), block(200)]
    }

    /// (kind, joint) of effects of the motion alone, one of them with memory, and of the model's torque.
    const EFFECTS: [(&str, &str); 5] = [
        ("viscous_friction", "joint_1"),
        ("torque_gain", "joint_1"),
        ("hysteresis", "joint_2"),
        ("coulomb_friction", "joint_2"),
        ("joint_spring", "joint_1"),
    ];

    fn products(
        kept: &mut KeptColumns,
        tree: &Tree,
        effects: &[EffectSpec],
        in_force: Vec<EffectSpec>,
        keep: Keep,
    ) -> (Vec<Vec<Products>>, Vec<Vec<Products>>) {
        let base = BaseParameters::of_tree(tree, Default::default()).unwrap();
        let built = || effects.iter().map(|spec| Catalogue::default().build(spec, tree).unwrap()).collect();
        let design = || Design::new(tree.clone(), base.clone(), built()).with_rest_speeds(vec![0.2; 2]);
        let reference = || ReferenceModel::new(tree.clone());
        let blocks = blocks(2);
        let sources: [&dyn BlockSource; 1] = [&blocks];
        let folds = [0.0, 1.3, 2.6].map(|start| Fold { log: 0, start, end: start + 1.3 });
        let asked = Pass {
            design: &design(),
            in_force,
            reference: reference(),
            folds: &folds,
            sources: &sources,
            keep,
        };
        let found = kept.products(asked).unwrap().torques;
        let factors = accumulate(&design().with_reference(reference()), &folds, &sources).unwrap();
        let of_torque = |torque: usize| {
            factors.iter().map(|fold| Products::of_factor(&fold.groups()[torque].factor)).collect()
        };
        (found, (0..2).map(of_torque).collect())
    }

    fn assert_equal((found, expected): (Vec<Vec<Products>>, Vec<Vec<Products>>)) {
        for (found, expected) in found.iter().flatten().zip(expected.iter().flatten()) {
            assert!(found.rows() > 0.0 && found.rows() == expected.rows());
            let size = expected.column(0).len();
            let square = |column: usize| expected.column(column)[column];
            for column in 0..size {
                for (other, value) in found.column(column).iter().enumerate() {
                    let scale = (square(column) * square(other)).sqrt();
                    let difference = (value - expected.column(column)[other]).abs();
                    assert!(difference <= 1e-10 * scale, "{difference:e} of {scale:e}");
                }
            }
        }
    }

    /// Whatever was asked before: the products are those of factors, which evaluate all columns.
    #[test]
    fn columns_that_are_kept_are_those_that_would_be_evaluated() {
        let tree = random_tree(5, &RandomTreeOptions { joints: 2, ..Default::default() }).unwrap();
        let joints: Vec<String> = tree.joint_names().map(str::to_owned).collect();
        let spec = |(kind, joint): (&str, &str)| {
            EffectSpec::new(kind, &[joints[usize::from(joint == "joint_2")].as_str()])
        };
        let all = EFFECTS.map(spec);
        let absent = |kind: &str| Catalogue::default().build(&spec((kind, "joint_2")), &tree).unwrap();
        let in_force = [
            absent("joint_elasticity").relinearised(&[3e-3]).unwrap().spec(),
            absent("time_delay").relinearised(&[0.013]).unwrap().spec(),
            absent("torque_gain").with_logged_factor(&[0.4]).unwrap().spec(),
            absent("encoder_offset").relinearised(&[0.3]).unwrap().spec(),
        ];
        let mut kept = KeptColumns::default();
        let mut random = RandomNumbers::new(3);
        for round in 0..24 {
            let keep = if random.uniform(0.0, 1.0) < 0.5 { Keep::Always } else { Keep::WhileThereIsRoom };
            let effects = match round % 3 {
                0 => all.to_vec(),
                1 => all[..3].to_vec(),
                _ => all.iter().rev().cloned().collect(),
            };
            let in_force: Vec<EffectSpec> =
                in_force.iter().filter(|_| random.uniform(0.0, 1.0) < 0.4).cloned().collect();
            let effects: Vec<EffectSpec> = in_force.iter().chain(&effects).cloned().collect();
            assert_equal(products(&mut kept, &tree, &effects, in_force, keep));
        }
        // What is kept is what is used: once it is changed, so are the products.
        let products = |kept: &mut KeptColumns| products(kept, &tree, &all, Vec::new(), Keep::Always);
        (0..2).for_each(|_| assert_equal(products(&mut kept)));
        let first = kept.effects[&key(&all[0])].start;
        kept.blocks[0].effects[first].iter_mut().for_each(|value| *value += 1.0);
        let (found, expected) = products(&mut kept);
        let square = |products: &Products, column: usize| products.column(column)[column];
        let (found, expected) = (&found[0][0], &expected[0][0]);
        let differs = |column| square(found, column) > 1.1 * square(expected, column);
        assert!((0..expected.column(0).len()).any(differs), "what is kept is not used");
    }
}
