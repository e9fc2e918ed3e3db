//! Torques whose zero differs from log to log: what was found is taken off the logs.

use crate::Error;
use crate::session::Session;
use phiw_effects::torque_zeros;
use phiw_identification::{Data, EffectSpec, Identified, LogSet, predict};
use phiw_report::number::significant;
use phiw_residual::trace::Tracing;

/// The zeros of the logs' torques, as traces have found them.
#[derive(Clone, Debug, PartialEq)]
pub struct ZerosOfLogs {
    /// For each log, training first, what its torques are off by, joint by joint \[N·m, N\]; none where the
    /// zero is the same in all training logs.
    of_logs: Vec<Vec<f64>>,
    /// Joints whose zeros have no offset in common any more.
    without_offset: Vec<usize>,
}

impl ZerosOfLogs {
    /// What a trace has found, beside what was `known` and taken off before; none if that is nothing. Of a
    /// log that is all held out, it is the mean of what the model leaves of it.
    ///
    /// # Errors
    /// A log cannot be read any more.
    pub fn of(
        session: &Session,
        data: &Data<'_>,
        tracing: &Tracing,
        known: Option<&Self>,
    ) -> Result<Option<Self>, Error> {
        let Identified { design, fit, .. } = &tracing.model;
        let joint_of =
            |spec: &EffectSpec| spec.joints.first().and_then(|joint| session.tree.joint_index(joint));
        let values = |place: usize| &fit.parameters[design.effect_parameters(place)];
        let specs: Vec<EffectSpec> = design.effects().iter().map(|effect| effect.spec()).collect();
        let found: Vec<_> = specs
            .iter()
            .enumerate()
            .filter_map(|(place, spec)| Some((joint_of(spec)?, torque_zeros(spec, values(place))?)))
            .collect();
        if found.is_empty() {
            return Ok(None);
        }
        // An offset that was found is a part of the zeros; one that is declared is the model's.
        let declared = specs.len() - tracing.effects.len() - tracing.refinements.len();
        let offset = |joint: usize| -> f64 {
            let is_its = |place: &usize| {
                specs[*place].kind == "torque_offset" && joint_of(&specs[*place]) == Some(joint)
            };
            (declared..specs.len()).filter(is_its).map(|place| values(place)[0]).sum()
        };
        let is_declared = |joint: usize| {
            let own = specs[..declared].iter().filter(|spec| spec.kind == "torque_offset");
            own.filter_map(joint_of).any(|other| other == joint)
        };
        let mut zeros = known.cloned().unwrap_or_else(|| ZerosOfLogs {
            of_logs: vec![vec![0.0; session.tree.joint_count()]; session.logs.surveys().len()],
            without_offset: Vec::new(),
        });
        let training = session.logs.training().len();
        let left = mean_residuals(session, data, &tracing.model)?;
        for (joint, own) in found {
            let offset = offset(joint);
            let held_out = left[training..].iter().map(|means| means[joint]);
            for (log, zero) in zeros.of_logs.iter_mut().zip(own.of_logs.iter().copied().chain(held_out)) {
                log[joint] += zero + offset;
            }
            if !is_declared(joint)
                && (own.have_mean || offset != 0.0)
                && !zeros.without_offset.contains(&joint)
            {
                zeros.without_offset.push(joint);
            }
        }
        Ok(Some(zeros))
    }

    /// Takes them off the logs.
    pub fn take_off(&self, logs: &mut LogSet) {
        for (log, zeros) in self.of_logs.iter().enumerate() {
            logs.set_torque_zeros(log, zeros.clone());
        }
    }

    /// What is not sought any more: an offset of the torques whose zeros, with their mean, were taken off;
    /// and, at `last`, other zeros.
    pub fn excluded(&self, session: &Session, last: bool) -> Vec<EffectSpec> {
        let name = |joint: usize| session.tree.joint(joint).joint.as_str();
        let offsets =
            self.without_offset.iter().map(|&joint| EffectSpec::new("torque_offset", &[name(joint)]));
        let zeros = (0..session.tree.joint_count())
            .filter(|_| last)
            .map(|joint| EffectSpec::new("torque_zero_by_log", &[name(joint)]));
        offsets.chain(zeros).collect()
    }

    /// What a reader should know of them, if any differ by more than this share of the joint's torque (RMS).
    pub fn warning(&self, session: &Session, least_size: f64) -> Option<String> {
        let surveys = session.logs.training();
        let span = |joint: usize| {
            let own = self.of_logs[..surveys.len()].iter().map(|zeros| zeros[joint]);
            own.clone().fold(f64::NEG_INFINITY, f64::max) - own.fold(f64::INFINITY, f64::min)
        };
        let torque = |joint: usize| {
            let own = surveys.iter().filter_map(|survey| survey.joints[joint].torque);
            own.map(|torque| torque.rms).fold(0.0, f64::max)
        };
        let differs = |joint: &usize| span(*joint) > least_size * torque(*joint);
        let differs = (0..session.tree.joint_count()).filter(differs);
        let in_words: Vec<String> = differs
            .map(|joint| {
                let (name, unit) = (&session.tree.joint(joint).joint, session.torque_unit(joint));
                format!("{name} by {} {unit}", significant(span(joint), 2))
            })
            .collect();
        if in_words.is_empty() {
            return None;
        }
        let elsewhere = match session.logs.splits_training_logs() {
            true => "a log's end that is held out has the zero of its beginning",
            false => {
                "those of the logs held out are the means of what the model left there, and their errors are \
                 without these means"
            }
        };
        Some(format!(
            "the zeros of torques differ from log to log ({}) and were taken off; {elsewhere}",
            in_words.join(", ")
        ))
    }
}

/// The mean of what a model leaves of each torque in each log, of the motion held out \[N·m, N\].
fn mean_residuals(session: &Session, data: &Data<'_>, model: &Identified) -> Result<Vec<Vec<f64>>, Error> {
    let joints = session.tree.joint_count();
    let mut sums = vec![vec![(0.0, 0.0); joints]; session.logs.surveys().len()];
    predict(&model.design, &model.fit.parameters, &data.sources, &mut |prediction| {
        if !data.held_out.iter().any(|fold| fold.contains(prediction.log, prediction.t)) {
            return;
        }
        for (joint, (sum, count)) in sums[prediction.log].iter_mut().enumerate() {
            if prediction.counts(joint) {
                *sum += prediction.residual(joint);
                *count += 1.0;
            }
        }
    })?;
    let mean = |&(sum, count): &(f64, f64)| sum / f64::max(count, 1.0);
    Ok(sums.iter().map(|log| log.iter().map(mean).collect()).collect())
}
