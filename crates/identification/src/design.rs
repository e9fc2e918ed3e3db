//! The columns of a model: which parameter acts on which torque, and the numbers of one sample.

use crate::effect::{Effect, EffectParameter, Evaluator};
use crate::model::with_masses;
use crate::pairs::PairsOfBlock;
use crate::reference::ReferenceModel;
use crate::rests::moves;
use crate::sample::{BlockReference, Needs, Sample};
use phiw_dynamics::check::check_size;
use phiw_dynamics::inertia::PARAMETERS_PER_BODY;
use phiw_dynamics::{DimensionError, Tree};
use phiw_regressor::{BaseParameters, JointTorqueRegressor, RegressorError};
use phiw_telemetry::Block;
use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// The columns of one torque, in the order of its row.
#[derive(Clone, Debug)]
pub struct RowLayout {
    /// The parameter of each column: base parameters first, then those of the effects.
    pub parameters: Vec<usize>,
    /// Where the row stands in the concatenation of all rows; its last number is the measured torque.
    pub range: Range<usize>,
    /// For the inertial columns, their place in the regressor's pairs.
    gather: Vec<usize>,
    /// For the effects' columns, their place in the concatenation of all effects' columns.
    effects: Vec<usize>,
}

impl RowLayout {
    /// The model's torque \[N·m, N\]: the row's columns times their parameters, given an evaluation of all
    /// rows ([`DesignScratch::evaluate`]) and all parameters of the design.
    pub fn torque(&self, evaluation: &[f64], parameters: &[f64]) -> f64 {
        let columns = &evaluation[self.range.clone()];
        columns.iter().zip(&self.parameters).map(|(column, &parameter)| column * parameters[parameter]).sum()
    }

    /// The measured torque \[N·m, N\] of an evaluation of all rows; zero where the block has none.
    pub fn measured_torque(&self, evaluation: &[f64]) -> f64 {
        evaluation[self.range.end - 1]
    }
}

/// A robot's rigid body plus effects, as columns.
pub struct Design {
    tree: Tree,
    base: BaseParameters,
    regressor: JointTorqueRegressor,
    effects: Vec<Arc<dyn Effect>>,
    /// First parameter of each effect, and one past the last.
    effect_parameters: Vec<Range<usize>>,
    effect_columns: Vec<Range<usize>>,
    rows: Vec<RowLayout>,
    width: usize,
    needs: Needs,
    /// Whether some column is made of the regressor's pairs.
    needs_pairs: bool,
    reference: Option<ReferenceModel>,
    rest_speeds: Vec<f64>,
    /// What each torque is multiplied by in the log.
    logged_factors: Vec<f64>,
    /// Effects from this one on are candidates.
    candidates_from: usize,
    /// Whether a candidate's columns held a number that is not finite. Set while blocks are evaluated, in
    /// parallel.
    not_finite: Vec<AtomicBool>,
}

/// Working memory to evaluate a design over one block.
pub struct DesignScratch<'a> {
    design: &'a Design,
    evaluators: Vec<Box<dyn Evaluator + 'a>>,
    pairs_of_block: PairsOfBlock,
    pairs: Vec<f64>,
    /// The pairs at rest under unit gravity along x, y, z, where some effect needs them.
    statics: Vec<f64>,
    unit_gravity: Vec<(Tree, PairsOfBlock)>,
    columns: Vec<f64>,
    reference: BlockReference,
    /// Where the links are, if that is not where their encoders are.
    links: Option<Block>,
}

impl Design {
    /// The columns of the base parameters and of `effects`, in that order.
    pub fn new(tree: Tree, base: BaseParameters, effects: Vec<Box<dyn Effect>>) -> Self {
        Self::of_shared(tree, base, effects.into_iter().map(Arc::from).collect())
    }

    fn of_shared(tree: Tree, base: BaseParameters, effects: Vec<Arc<dyn Effect>>) -> Self {
        Self::of_columns(tree, base, effects, true)
    }

    /// Without the rigid body the base parameters have no columns.
    fn of_columns(
        tree: Tree,
        base: BaseParameters,
        effects: Vec<Arc<dyn Effect>>,
        has_rigid_body: bool,
    ) -> Self {
        let regressor = JointTorqueRegressor::new(&tree);
        let (mut effect_parameters, mut effect_columns) = (Vec::new(), Vec::new());
        let (mut parameter, mut column) = (base.count(), 0);
        let mut columns_of_row = vec![Vec::new(); regressor.rows()];
        for effect in &effects {
            let entries = effect.entries();
            for (index, entry) in entries.iter().enumerate() {
                columns_of_row[entry.row].push((parameter + entry.parameter, column + index));
            }
            let count = effect.parameters().len();
            effect_parameters.push(parameter..parameter + count);
            effect_columns.push(column..column + entries.len());
            parameter += count;
            column += entries.len();
        }
        let mut rows = Vec::with_capacity(regressor.rows());
        let mut start = 0;
        for (row, effect_columns) in columns_of_row.into_iter().enumerate() {
            let mut layout =
                RowLayout { parameters: Vec::new(), range: 0..0, gather: Vec::new(), effects: Vec::new() };
            let pairs = regressor.row_range(row).step_by(PARAMETERS_PER_BODY);
            for (pair, &body) in pairs.zip(regressor.row_bodies(row)).filter(|_| has_rigid_body) {
                let own = body * PARAMETERS_PER_BODY..(body + 1) * PARAMETERS_PER_BODY;
                let first = base.independent().partition_point(|&column| column < own.start);
                for (parameter, &column) in base.independent().iter().enumerate().skip(first) {
                    if column >= own.end {
                        break;
                    }
                    layout.parameters.push(parameter);
                    layout.gather.push(pair + column - own.start);
                }
            }
            for (parameter, column) in effect_columns {
                layout.parameters.push(parameter);
                layout.effects.push(column);
            }
            layout.range = start..start + layout.parameters.len() + 1;
            start = layout.range.end;
            rows.push(layout);
        }
        let mut logged_factors = vec![1.0; rows.len()];
        for (row, factor) in effects.iter().filter_map(|effect| effect.logged_factor()) {
            logged_factors[row] *= factor;
        }
        let needs = effects.iter().fold(Needs::default(), |needs, effect| needs.union(effect.needs()));
        Design {
            candidates_from: effects.len(),
            not_finite: effects.iter().map(|_| AtomicBool::new(false)).collect(),
            tree,
            base,
            regressor,
            needs_pairs: has_rigid_body || needs.statics,
            effects,
            effect_parameters,
            effect_columns,
            rows,
            width: start,
            needs,
            logged_factors,
            reference: None,
            rest_speeds: Vec::new(),
        }
    }

    /// The same with the speed of each torque's joint below which it stands still \[rad/s, m/s\].
    ///
    /// A joint at rest may carry any torque within its static friction, whatever the model: a filtered row
    /// counts for a torque only if its joint moves in at least nine tenths of the filter's window. Passing
    /// through zero at a reversal takes less, unless it is a slow one.
    pub fn with_rest_speeds(mut self, rest_speeds: Vec<f64>) -> Self {
        self.rest_speeds = rest_speeds;
        self
    }

    /// For each torque the speed of its joint below which it stands still \[rad/s, m/s\]; empty where all
    /// rows count.
    pub fn rest_speeds(&self) -> &[f64] {
        &self.rest_speeds
    }

    /// The same with the effects from `first` on as candidates: where one's columns are not finite on the
    /// logs, they count as zero and [`not_finite`](Design::not_finite) says so, instead of an error. `first`
    /// is at most the number of effects.
    pub fn with_candidates_from(mut self, first: usize) -> Self {
        self.candidates_from = first;
        self
    }

    /// Candidates whose columns were not finite somewhere in the blocks that were evaluated so far.
    pub fn not_finite(&self) -> Vec<usize> {
        (0..self.effects.len()).filter(|&effect| self.not_finite[effect].load(Ordering::Relaxed)).collect()
    }

    /// Numbers that [`DesignScratch::evaluate`] writes: all rows, then for each torque one while its joint
    /// moves and zero while it rests.
    pub fn evaluation_width(&self) -> usize {
        self.width + self.rows.len()
    }

    /// Whether a filtered evaluation counts for the torque `row`.
    pub fn counts(&self, evaluation: &[f64], row: usize) -> bool {
        moves(evaluation[self.width + row])
    }

    /// What each torque is multiplied by in the log, by the effects in force ([`Effect::logged_factor`]).
    pub fn logged_factors(&self) -> &[f64] {
        &self.logged_factors
    }

    /// What the effects' columns need beside the signals.
    pub fn needs(&self) -> Needs {
        self.needs
    }

    /// The same with a rigid-body model for the effects whose columns need torques.
    pub fn with_reference(mut self, reference: ReferenceModel) -> Self {
        self.reference = Some(reference);
        self
    }

    /// The same with its own model as the reference: `parameters` are those of all its columns. So the
    /// columns of a fitted model are made wherever it is used.
    ///
    /// # Errors
    /// The parameters are not this design's.
    pub fn with_own_reference(self, parameters: &[f64]) -> Result<Self, RegressorError> {
        let all: Vec<usize> = (0..self.effects.len()).collect();
        let reference = self.reference_of(parameters, &all)?;
        Ok(self.with_reference(reference))
    }

    /// The model with these of its effects, as a reference; `parameters` are those of all columns.
    pub(crate) fn reference_of(
        &self,
        parameters: &[f64],
        effects: &[usize],
    ) -> Result<ReferenceModel, RegressorError> {
        check_size("parameters", parameters.len(), self.parameter_count())?;
        let mut tree = self.tree.clone();
        let inertial = &parameters[..self.base.count()];
        tree.set_inertial_parameters(&self.base.to_standard(inertial, &with_masses(&self.tree))?)?;
        let with_values = |&effect: &usize| {
            (Arc::clone(&self.effects[effect]), parameters[self.effect_parameters(effect)].to_vec())
        };
        Ok(ReferenceModel::new(tree).with_shared_effects(effects.iter().map(with_values).collect()))
    }

    /// The parameters that are factors of logged torques ([`Effect::with_logged_factor`]), ascending.
    pub(crate) fn logged_factor_parameters(&self) -> Vec<usize> {
        let of_effect = |(index, effect): (usize, &Arc<dyn Effect>)| {
            let own = self.effect_parameters(index);
            let is_factor = effect.with_logged_factor(&vec![0.0; own.len()]).is_some();
            if is_factor { own } else { 0..0 }
        };
        self.effects.iter().enumerate().flat_map(of_effect).collect()
    }

    /// The factor that is in force of the torque that this parameter is a factor of; 1 where none is.
    pub(crate) fn factor_in_force(&self, parameter: usize) -> f64 {
        let own = (0..self.effects.len()).find(|&index| self.effect_parameters(index).contains(&parameter));
        own.and_then(|index| self.effects[index].logged_factor()).map_or(1.0, |(_, factor)| factor)
    }

    /// The same with the factors of logged torques that `parameters` say in force
    /// ([`Effect::logged_factor`]), and the parameters that are left; `None` where no effect has one that is
    /// `least` away from what is in force.
    ///
    /// # Errors
    /// The parameters are not this design's.
    pub(crate) fn with_factors_in_force(
        &self,
        parameters: &[f64],
        least: f64,
    ) -> Result<Option<(Self, Vec<f64>)>, DimensionError> {
        check_size("parameters", parameters.len(), self.parameter_count())?;
        let (mut effects, mut left, mut any) = (self.effects.clone(), parameters.to_vec(), false);
        for (index, effect) in effects.iter_mut().enumerate() {
            let own = self.effect_parameters(index);
            if parameters[own.clone()].iter().all(|value| value.abs() < least) {
                continue;
            }
            if let Some(moved) = effect.with_logged_factor(&parameters[own.clone()]) {
                *effect = Arc::from(moved);
                left[own].fill(0.0);
                any = true;
            }
        }
        let moved = || Design {
            rest_speeds: self.rest_speeds.clone(),
            ..Design::of_shared(self.tree.clone(), self.base.clone(), effects)
        };
        Ok(any.then(|| (moved(), left)))
    }

    /// The design with only the `chosen` effects, in that order.
    pub fn keep(self, chosen: &[usize]) -> Self {
        let kept = chosen.iter().filter_map(|&effect| self.effects.get(effect).cloned()).collect();
        Design {
            reference: self.reference,
            rest_speeds: self.rest_speeds,
            ..Design::of_shared(self.tree, self.base, kept)
        }
    }

    /// The `chosen` effects alone, in that order, with the rigid body's columns or without them. It has no
    /// reference model.
    #[must_use]
    pub fn part(&self, chosen: &[usize], has_rigid_body: bool) -> Self {
        let effects = chosen.iter().filter_map(|&effect| self.effects.get(effect).cloned()).collect();
        Design {
            candidates_from: chosen.partition_point(|&effect| effect < self.candidates_from),
            rest_speeds: self.rest_speeds.clone(),
            ..Design::of_columns(self.tree.clone(), self.base.clone(), effects, has_rigid_body)
        }
    }

    /// The robot.
    pub fn tree(&self) -> &Tree {
        &self.tree
    }
    /// The base parameters.
    pub fn base(&self) -> &BaseParameters {
        &self.base
    }
    /// The effects beside the rigid body.
    pub fn effects(&self) -> &[Arc<dyn Effect>] {
        &self.effects
    }
    /// The parameters of an effect, as indices into all parameters.
    pub fn effect_parameters(&self, effect: usize) -> Range<usize> {
        self.effect_parameters[effect].clone()
    }
    /// Number of parameters: base parameters, then those of each effect.
    pub fn parameter_count(&self) -> usize {
        self.effect_parameters.last().map_or(self.base.count(), |range| range.end)
    }
    /// The columns of each torque.
    pub fn rows(&self) -> &[RowLayout] {
        &self.rows
    }
    /// Numbers in the concatenation of all rows.
    pub fn width(&self) -> usize {
        self.width
    }
    /// Names, units and joints of the effects' parameters, in order.
    pub fn effect_parameter_info(&self) -> Vec<EffectParameter> {
        self.effects.iter().flat_map(|effect| effect.parameters()).collect()
    }

    /// Applies the effects' corrections of the signals.
    pub fn correct(&self, block: &mut Block) {
        self.effects.iter().for_each(|effect| effect.correct(block));
    }

    /// Whether an effect corrects the signals, by what it does to some.
    pub fn corrects_signals(&self, effect: usize) -> bool {
        let signals = |block: Block| [block.q, block.qd, block.qdd, block.tau];
        let [some, corrected] = self.some_signals_corrected(effect).map(signals);
        some != corrected
    }

    /// Whether an effect corrects the motion, and not the measured torques only.
    pub fn corrects_motion(&self, effect: usize) -> bool {
        let motion = |block: Block| [block.q, block.qd, block.qdd];
        let [some, corrected] = self.some_signals_corrected(effect).map(motion);
        some != corrected
    }

    /// Some signals, and the same as an effect corrects them.
    fn some_signals_corrected(&self, effect: usize) -> [Block; 2] {
        let joints = self.tree.joint_count();
        let t: Vec<f64> = (0..16).map(|sample| 0.01 * f64::from(sample)).collect();
        let signal = |phase: f64| -> Vec<f64> {
            let at = |t: &f64, joint: usize| (3.0 * t + phase + joint as f64).sin();
            t.iter().flat_map(|t| (0..joints).map(move |joint| at(t, joint))).collect()
        };
        let signals = [signal(0.0), signal(1.0), signal(2.0)];
        let block = Block::unfiltered(joints, t.clone(), signals, signal(3.0));
        let mut corrected = block.clone();
        self.effects[effect].correct(&mut corrected);
        [block, corrected]
    }

    /// Working memory for one block.
    pub fn scratch(&self) -> DesignScratch<'_> {
        let unit_gravity = |axis: usize| {
            let mut tree = self.tree.clone();
            tree.gravity = std::array::from_fn(|other| if other == axis { 1.0 } else { 0.0 });
            (tree, PairsOfBlock::new(&self.regressor, self.tree.velocity_size(), true))
        };
        let axes = if self.needs.statics { 0..3 } else { 0..0 };
        DesignScratch {
            design: self,
            statics: vec![0.0; axes.len() * self.regressor.buffer_size()],
            unit_gravity: axes.map(unit_gravity).collect(),
            evaluators: self.effects.iter().map(|effect| effect.evaluator()).collect(),
            pairs_of_block: PairsOfBlock::new(&self.regressor, self.tree.velocity_size(), false),
            pairs: vec![0.0; self.regressor.buffer_size()],
            columns: vec![0.0; self.effect_columns.last().map_or(0, |range| range.end)],
            reference: BlockReference::default(),
            links: None,
        }
    }
}

impl DesignScratch<'_> {
    /// Makes ready for a block: the reference model's torques, and the memory of effects that have some.
    ///
    /// # Errors
    /// The block has not the robot's joints.
    pub fn begin(&mut self, block: &Block) -> Result<(), DimensionError> {
        if let Some(reference) = &self.design.reference {
            let compliances: Vec<(usize, f64)> =
                self.design.effects.iter().filter_map(|effect| effect.compliance()).collect();
            self.links = match compliances.is_empty() {
                true => None,
                false => Some(reference.deflected(block, &compliances)?),
            };
            let at = self.links.as_ref().unwrap_or(block);
            reference.evaluate(at, self.design.needs, &mut self.reference)?;
        }
        self.pairs_of_block.begin();
        self.unit_gravity.iter_mut().for_each(|(_, pairs)| pairs.begin());
        self.evaluators.iter_mut().for_each(|evaluator| evaluator.restart());
        for sample in 0..block.warm_up {
            self.evaluate_effects(block, sample);
        }
        Ok(())
    }

    /// What is known of the reference model's torques, for a simulation to put its own there.
    pub(crate) fn reference_mut(&mut self) -> &mut BlockReference {
        &mut self.reference
    }

    /// All rows of one sample, side by side as [`RowLayout::range`] says: columns, then the measured torque.
    /// After them, which joints move.
    ///
    /// Samples must come in order, from the block's warm-up on.
    ///
    /// # Errors
    /// The block has not the robot's joints.
    pub fn evaluate(&mut self, block: &Block, sample: usize, out: &mut [f64]) -> Result<(), DimensionError> {
        let design = self.design;
        let row = block.row(sample);
        let links = self.links.as_ref().unwrap_or(block);
        let regressor = &design.regressor;
        if design.needs_pairs {
            self.pairs_of_block.put(regressor, &design.tree, links, sample, &mut self.pairs)?;
        }
        let statics = self.statics.chunks_exact_mut(self.pairs.len().max(1));
        for ((tree, pairs_of_block), pairs) in self.unit_gravity.iter_mut().zip(statics) {
            pairs_of_block.put(regressor, tree, links, sample, pairs)?;
        }
        self.evaluate_effects(block, sample);
        for (joint, layout) in design.rows.iter().enumerate() {
            let out = &mut out[layout.range.clone()];
            let (inertial, rest) = out.split_at_mut(layout.gather.len());
            let factor = design.logged_factors[joint];
            let fill = |out: &mut [f64], places: &[usize], columns: &[f64]| {
                out.iter_mut().zip(places).for_each(|(value, &place)| *value = factor * columns[place]);
            };
            fill(inertial, &layout.gather, &self.pairs);
            fill(rest, &layout.effects, &self.columns);
            if let Some(last) = rest.last_mut() {
                *last = block.tau.get(row.start + joint).copied().unwrap_or_default();
            }
        }
        for (joint, moves) in out[design.width..].iter_mut().enumerate() {
            let rest_speed = design.rest_speeds.get(joint).copied().unwrap_or(-1.0);
            *moves = f64::from(u8::from(block.qd[row.start + joint].abs() > rest_speed));
        }
        Ok(())
    }

    fn evaluate_effects(&mut self, block: &Block, index: usize) {
        let sample = Sample {
            block,
            reference: &self.reference,
            index,
            regressor: &self.pairs,
            statics: &self.statics,
        };
        for (effect, (evaluator, range)) in
            self.evaluators.iter_mut().zip(&self.design.effect_columns).enumerate()
        {
            let columns = &mut self.columns[range.clone()];
            evaluator.evaluate(&sample, columns);
            if effect >= self.design.candidates_from && columns.iter().any(|value| !value.is_finite()) {
                columns.fill(0.0);
                self.design.not_finite[effect].store(true, Ordering::Relaxed);
            }
        }
    }
}
