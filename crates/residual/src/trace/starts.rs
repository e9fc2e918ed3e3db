//! Where the search starts, whatever was declared, and how what was declared joins its end.

use super::harm::Harm;
use super::search::Search;
use super::tracing::Tracing;
use crate::selection::LEAST_STEP;
use phiw_identification::{EffectSpec, IdentificationError};

impl Search<'_> {
    /// The search from where it starts to its end.
    ///
    /// - Where the declared model lacks anything, the start has what the textbook has of every joint,
    ///   declared by nobody, and nothing of what was declared. What is chosen early, beside all that is still
    ///   missing, may stand for something else to the end; the more is there at the start, the less can be
    ///   taken for it. And the end is the same whatever was declared: that joins it afterwards, once what
    ///   does harm has left.
    /// - That start has the limits of drives beyond which a command was logged (`limits.rs`).
    /// - Where the torques agree better once one of them is a multiple of what is logged, and still do in the
    ///   end, another start has that in force, too: to first order a factor of two is no factor, and other
    ///   effects would stand for it.
    /// - Where the end leaves more than noise, and an effect makes the error on motion held out larger, it is
    ///   searched again from there without that: what is chosen early may keep out to the end what would do
    ///   its work better.
    /// - Where it leaves structure, and that led nowhere, it is searched again from there with nothing
    ///   refuted any more: what was refuted beside all that was still missing may be right beside what was
    ///   found since.
    /// - Where there is still structure, another search from the same start seeks what makes frictions vary
    ///   at once (`variation.rs`): many effects together had stood for that, and left it no work. Whether
    ///   there is structure is asked of all logs, which end is the better one of the training logs alone,
    ///   unless it leaves more of the motion held out.
    pub(super) fn run(self) -> Result<Tracing, IdentificationError> {
        let start = if self.fixed.prior.is_none() { self.textbook_start()? } else { None };
        let joins = start.is_some() && self.declared > 0;
        let (end, tracing) = start.unwrap_or_else(|| self.clone()).best_end()?;
        if joins { self.with_declared(end)?.finish() } else { Ok(tracing) }
    }

    /// The best end that is found from this start, and what comes of it.
    fn best_end(self) -> Result<(Self, Tracing), IdentificationError> {
        let mut best = self.clone().searched()?;
        if let Some(with_multiples) = self.with_multiples()?
            && best.still_asks_for(&with_multiples.specs[self.specs.len()..])?
        {
            let other = with_multiples.searched()?;
            if other.is_better_than(&best)? {
                best = other;
            }
        }
        let mut tracing = best.clone().finish()?;
        let mut is_another = false;
        if !tracing.remaining.is_noise()
            && let Some(without) = best.without_suspect(&tracing)?
        {
            let names = best.names();
            (best, tracing) = best.or_better_as_ended((tracing, without.searched()?))?;
            is_another = best.names() != names;
        }
        if tracing.remaining.joints.is_empty() {
            return Ok((best, tracing));
        }
        if !is_another {
            let mut again = Search { refuted: Vec::new(), ..best.clone() }.searched()?;
            again.forget_what_came_back();
            (best, tracing) = best.or_better((tracing, again))?;
        }
        if tracing.remaining.joints.is_empty() || !self.may_vary() {
            return Ok((best, tracing));
        }
        let varying = Search { asks_of_variation: true, ..self }.searched()?;
        best.or_better((tracing, varying))
    }

    /// This end, which leaves structure, and what came of it, or another and what comes of that, where the
    /// criterion is smaller there and motion held out is no worse ([`super::Thresholds::same_error`]). Of two
    /// models that are both known to lack something the likelier is the better, whether or not it is so
    /// throughout.
    fn or_better(self, (tracing, other): (Tracing, Self)) -> Result<(Self, Tracing), IdentificationError> {
        let rows = &self.chosen.rows;
        if other.value(rows)? >= self.value(rows)? - LEAST_STEP {
            return Ok((self, tracing));
        }
        let of_other = other.clone().finish()?;
        Ok(self.or_if_no_worse_held_out(tracing, (other, of_other)))
    }

    /// The same, where the criterion is smaller of what came of the other end: once what does harm has left
    /// both.
    fn or_better_as_ended(
        self,
        (tracing, other): (Tracing, Self),
    ) -> Result<(Self, Tracing), IdentificationError> {
        let of_other = other.clone().finish()?;
        let as_ended = |tracing: &Tracing| {
            let (specs, parameters) = (tracing.specs.clone(), tracing.model.fit.parameters.clone());
            Search { specs, parameters, ..self.clone() }.value(&self.chosen.rows)
        };
        if as_ended(&of_other)? >= as_ended(&tracing)? - LEAST_STEP {
            return Ok((self, tracing));
        }
        let (end, tracing) = self.or_if_no_worse_held_out(tracing, (other, of_other));
        // What was suspected, was so for motion held out.
        Ok((Search { held_out_had_a_say: true, ..end }, Tracing { held_out_had_a_say: true, ..tracing }))
    }

    /// This end and what came of it, or the other, where that leaves no more of the motion held out.
    fn or_if_no_worse_held_out(self, tracing: Tracing, other: (Self, Tracing)) -> (Self, Tracing) {
        let [own, before] = [&other.1, &tracing].map(|end| self.counted(&end.model.held_out));
        if own <= before * self.options.thresholds.same_error {
            return other;
        }
        let end = Search { held_out_had_a_say: true, ..self };
        (end, Tracing { held_out_had_a_say: true, ..tracing })
    }

    /// The start that has what the textbook has of every joint and limits of drives, all of it declared by
    /// nobody; `None` where nothing is lacking in what is declared and no command was beyond a limit.
    fn textbook_start(&self) -> Result<Option<Self>, IdentificationError> {
        let mut start = self.clone();
        (start.specs, start.declared) = (Vec::new(), 0);
        start.parameters = vec![0.0; self.fixed.base.count()];
        for spec in start.textbook_of_other_joints()? {
            start.add(spec)?;
        }
        start.refine()?;
        let has_limits = start.add_limits()?;
        Ok((has_limits || self.lacks_something()?).then_some(start))
    }

    /// Whether anything is to be added to what is declared.
    fn lacks_something(&self) -> Result<bool, IdentificationError> {
        let mut search = self.clone();
        search.refine()?;
        search.choose()?;
        Ok(search.specs.len() > search.declared)
    }

    /// An end that was reached with nothing declared, with what was declared put into it: what that does the
    /// work of leaves, and nothing enters. Before that leaves
    ///
    /// - what does harm: with what was declared beside it, another effect may look harmful in its place;
    /// - what was declared and is certain to be impossible, since nothing else is missing any more: what it
    ///   did the work of would be missing after it.
    fn with_declared(&self, mut end: Self) -> Result<Self, IdentificationError> {
        end.refine_together()?;
        end.without_harm(Harm::EachTorque)?;
        let found = end.names();
        end.put_in_front(&self.specs[..self.declared])?;
        while end.withdraw()? {}
        if end.names() != found {
            end = Search { grows: false, ..end }.searched()?;
            end.grows = true;
        }
        Ok(end)
    }

    /// Whether the criterion is smaller here than there, and the motion says so throughout, with the
    /// effective rows of that end: what does no more than chance could do leaves the end that was there.
    fn is_better_than(&self, other: &Self) -> Result<bool, IdentificationError> {
        let rows = &other.chosen.rows;
        let (own, other) = (self.judged(rows)?, other.judged(rows)?);
        let tail = own.tail_of_being_better(&other, rows);
        let is_smaller = own.value() < other.value() - LEAST_STEP;
        Ok(is_smaller && tail < self.options.thresholds.false_name_probability)
    }

    /// Counts effects as declared, and adds those that the model lacks.
    fn put_in_front(&mut self, declared: &[EffectSpec]) -> Result<(), IdentificationError> {
        let mut front = Vec::new();
        for spec in declared {
            let is_it = |own: &EffectSpec| own.kind == spec.kind && own.joints == spec.joints;
            front.push(match self.specs.iter().position(is_it) {
                Some(place) => place,
                None => {
                    self.add(spec.clone())?;
                    self.specs.len() - 1
                }
            });
        }
        let others = (0..self.specs.len()).filter(|place| !front.contains(place));
        let order: Vec<usize> = front.iter().copied().chain(others).collect();
        self.reorder(&order)?;
        self.chosen.alternatives.drain(..declared.len());
        self.declared = declared.len();
        self.forget_what_came_back();
        Ok(())
    }

    /// What had left for what it does to motion held out, and is in the model again, has not left.
    fn forget_what_came_back(&mut self) {
        let specs = &self.specs;
        self.left_out_by_held_out
            .retain(|out| !specs.iter().any(|own| own.kind == out.kind && own.joints == out.joints));
    }
}

#[cfg(test)]
mod tests {
    use super::{Search, Tracing};
    use crate::trace::stage::Fixed;
    use crate::trace::{TraceInput, TraceOptions, noise_floor};
    use phiw_dynamics::random_tree::{RandomNumbers, RandomTreeOptions, random_tree};
    use phiw_dynamics::{Tree, Workspace};
    use phiw_effects::{Catalogue, SignalRanges};
    use phiw_identification::{BlockSource, Data, EffectSpec, Fold, identify};
    use phiw_telemetry::{Conditioning, ConditioningOptions, Recording};

    /// Two joints that move together under sines of their own, and what their drives do beside the bodies.
    fn moved(tree: &Tree, drives: impl Fn(&[f64; 2], &mut [f64; 2])) -> Recording {
        let mut random = RandomNumbers::new(7);
        let mut workspace = Workspace::new(tree);
        let joints = tree.joint_names().map(str::to_owned).collect();
        let mut recording = Recording { joints, ..Recording::default() };
        for row in 0..9000 {
            let t = 0.004 * f64::from(row);
            let (mut q, mut qd, mut qdd) = ([0.0; 2], [0.0; 2], [0.0; 2]);
            for sine in 0..8 {
                let omega = 1.3 + 1.17 * f64::from(sine);
                let (phase, joint) = (0.7 * f64::from(sine * sine), sine as usize % 2);
                let (sine, cosine) = (omega * t + phase).sin_cos();
                q[joint] += 0.3 * sine;
                qd[joint] += 0.3 * omega * cosine;
                qdd[joint] -= 0.3 * omega * omega * sine;
            }
            let mut torque = [0.0; 2];
            tree.inverse_dynamics(&q, &qd, &qdd, &mut workspace, &mut torque).unwrap();
            drives(&qd, &mut torque);
            torque.iter_mut().for_each(|torque| *torque += 0.5 * random.uniform(-1.0, 1.0));
            recording.t.push(t);
            recording.q.extend(q);
            recording.tau.extend(torque);
        }
        recording
    }

    /// The search that starts from what is declared, on three quarters of a log.
    fn searching(
        log: &Recording,
        tree: &Tree,
        declared: &[&str],
        options: &TraceOptions,
        ask: impl FnOnce(Search<'_>),
    ) {
        let surveys = [log.survey().unwrap()];
        let conditioning = Conditioning::choose(&surveys, &ConditioningOptions::default()).unwrap();
        let blocks = log.blocks(&conditioning).unwrap();
        let sources: Vec<&dyn BlockSource> = vec![&blocks];
        let folds = |pieces: std::ops::Range<u8>| -> Vec<Fold> {
            let fold = |start: f64| Fold { log: 0, start, end: start + 3.0 };
            pieces.map(|piece| fold(3.0 * f64::from(piece))).collect()
        };
        let data = Data { train: folds(0..8), held_out: folds(8..12), sources, rest_speeds: vec![0.01; 2] };
        let (catalogue, ranges) = (Catalogue::default(), SignalRanges::of_surveys(&surveys));
        let kinds = declared.iter().map(|kind| catalogue.declare(kind, tree, &ranges).unwrap());
        let start = identify(tree, kinds.flatten().collect(), &data).unwrap();
        let input = TraceInput {
            tree,
            catalogue: &catalogue,
            data: &data,
            declared: start.design.effects().iter().map(|effect| effect.spec()).collect(),
            parameters: start.fit.parameters.clone(),
            residual_std: start.fit.residual_std.clone(),
            held: None,
            noise_floor: noise_floor(tree, &[0.0; 2], &surveys, &conditioning, &data.sources).unwrap(),
            rows_per_independent: 1.0,
            ranges,
        };
        let fixed = Fixed::new(&input, &data, options).unwrap();
        ask(Search::of_declared(&fixed, &data, &input, options).unwrap());
    }

    /// What was refuted beside all that was still missing was not asked of again: it is, where the end leaves
    /// structure.
    #[test]
    fn what_was_refuted_is_asked_of_again_where_the_end_leaves_structure() {
        let tree = random_tree(5, &RandomTreeOptions { joints: 2, ..Default::default() }).unwrap();
        // The speed of each joint brakes the other.
        let log = moved(&tree, |qd, torque| {
            (0..2).for_each(|joint| torque[joint] += 8.0 * qd[joint] + 5.0 * qd[1 - joint]);
        });
        // A saturation stood for the coupling, too, and left it no work.
        let saturation = |joint| EffectSpec::new("actuator_saturation", &[joint]);
        let excluded = tree.joint_names().map(saturation).collect();
        let options = TraceOptions { excluded, ..TraceOptions::default() };
        searching(&log, &tree, &["viscous_friction"], &options, |declared| {
            let joints: Vec<&str> = tree.joint_names().collect();
            let coupling = EffectSpec::new("transmission_coupling", &joints);
            let is_found = |tracing: &Tracing| {
                tracing.specs.iter().any(|own| (&own.kind, &own.joints) == (&coupling.kind, &coupling.joints))
            };
            let mut without = options.clone();
            without.excluded.push(coupling.clone());
            let excluded = Search { options: &without, ..declared.clone() }.best_end().unwrap().1;
            let remaining = &excluded.remaining;
            assert!(
                !is_found(&excluded) && !remaining.joints.is_empty(),
                "{:?} {remaining:?} {:?}",
                excluded.specs,
                excluded.model.held_out
            );
            let refuted = Search { refuted: vec![coupling.clone()], ..declared }.best_end().unwrap().1;
            assert!(is_found(&refuted) && refuted.remaining.joints.is_empty(), "{:?}", refuted.specs);
        });
    }

    /// A filter of all torques stood for how their frictions turn, in 12 of 28 logs: beside it the width of
    /// each was never looked for, and without it and without that the criterion was larger.
    #[test]
    fn a_filter_of_all_torques_does_not_stand_for_how_frictions_turn() {
        let tree = random_tree(5, &RandomTreeOptions { joints: 2, ..Default::default() }).unwrap();
        let log = moved(&tree, |qd, torque| {
            (0..2).for_each(|joint| torque[joint] += 40.0 * (qd[joint] / 0.08).tanh());
        });
        searching(&log, &tree, &[], &TraceOptions::default(), |declared| {
            let mut search = declared.textbook_start().unwrap().unwrap();
            let joints: Vec<&str> = tree.joint_names().collect();
            search.chosen.rows = vec![1000.0; 2];
            search.add(EffectSpec::new("torque_smoothing", &joints)).unwrap();
            search.refine().unwrap();
            let smoothing = search.specs.last().unwrap().constants["time_constant_squared"];
            assert!(smoothing > 5e-6, "{smoothing}");
            search.leave_out_what_is_not_realised().unwrap();
            let widths: Vec<_> = search.specs.iter().filter(|spec| spec.kind == "coulomb_friction").collect();
            assert!(search.specs.iter().all(|spec| spec.kind != "torque_smoothing"), "{:?}", search.specs);
            assert!(
                widths.iter().all(|spec| (0.04..0.16).contains(&spec.constants["sign_width"])),
                "{widths:?}"
            );
        });
    }

    /// Where nothing was found, an end that what was declared had yet to join was taken for the declared
    /// model: it had effects that nothing counted, and the trace of a right model ended in a panic.
    #[test]
    fn an_end_that_the_declared_have_yet_to_join_is_no_declared_model() {
        let tree = random_tree(5, &RandomTreeOptions { joints: 2, ..Default::default() }).unwrap();
        let log = moved(&tree, |_, _| ());
        searching(&log, &tree, &["viscous_friction"], &TraceOptions::default(), |declared| {
            let parameters = vec![0.0; declared.fixed.base.count()];
            let bare = Search { specs: Vec::new(), declared: 0, parameters: parameters.clone(), ..declared };
            let end = bare.searched().unwrap();
            assert!(end.specs.is_empty(), "{:?}", end.specs);
            // Worse than the declared model.
            let tracing = Search { parameters, ..end }.finish().unwrap();
            assert!(tracing.specs.is_empty() && tracing.effects.is_empty(), "{:?}", tracing.specs);
        });
    }
}
