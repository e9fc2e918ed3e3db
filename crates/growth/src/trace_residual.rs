//! What the residual says that the model lacks, by a trace.

use crate::whiteness::{WhitenessSettings, coloured, residual};
use phiw_curriculum::CurriculumError;
use phiw_curriculum::growth::{Found, Growth};
use phiw_effects::{Catalogue, SignalRanges};
use phiw_estimation::{MotionLog, Robot, RobotModel, torques_along};
use phiw_identification::{BlockSource, Data, EffectCatalogue, EffectSpec, Fold, identify};
use phiw_residual::trace::{Thresholds, TraceInput, TraceOptions, trace};
use phiw_telemetry::{Block, Recording, Survey, arrange_session};
use std::sync::Arc;

/// Traces the residual with `phiw-residual`, where one is not white; effects that act on no such torque are
/// not asked for.
///
/// A trace judges by least squares, which takes motion that noise has caused for motion that has a cause: a
/// torque that noise helped is smaller than the motion asks for. So it sees each period as it was when it
/// began, before the period's own noise has moved the robot, with the torque that the belief would need
/// there, and what the belief leaves of the period.
#[derive(Clone)]
pub struct TraceResidual {
    /// The effects that are asked for; the robot's own catalogue has to know them. Default: all that phiw
    /// knows.
    pub catalogue: Arc<Catalogue>,
    /// When a candidate is believed.
    pub options: TraceOptions,
    /// Measured time below which nothing is looked for \[s\]. Default: 12.
    pub least_s: f64,
    /// A rival counts if it has at least this probability. Default: 0.1.
    pub least_rival: f64,
    /// −log L that an effect must save to be believed. Default: 20, more than six standard deviations, since
    /// one candidate of a thousand was picked.
    pub least_gain: f64,
    /// Which torques are traced.
    pub whiteness: WhitenessSettings,
    /// How logs are put together.
    pub session: SessionSettings,
}

/// How the logs of a curriculum become one session for a trace.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SessionSettings {
    /// Stretches that all logs together are cut into. Default: 14; a trace leaves out one after the other, so
    /// each costs time.
    pub stretches: usize,
    /// Stretches of each log at least. Default: 3, so that something is left beside the one that is held out
    /// and the one that is left out.
    pub least_stretches: usize,
    /// Stretches of each log at most. Default: 7.
    pub most_stretches: usize,
    /// Share of the stretches of each log, at its end, that is held out. Default: 2/7.
    pub held_out: f64,
    /// Time between two logs \[s\]. Default: 5; any time longer than a filter's reach does.
    pub pause_s: f64,
    /// Speed of a joint at rest over its RMS speed. Default: 0.01, not calibrated.
    pub rest_share: f64,
}

impl Default for SessionSettings {
    fn default() -> Self {
        SessionSettings {
            stretches: 14,
            least_stretches: 3,
            most_stretches: 7,
            held_out: 2.0 / 7.0,
            pause_s: 5.0,
            rest_share: 0.01,
        }
    }
}

impl Default for TraceResidual {
    /// From 12 s of logs on, three effects at most; a rival is what has a chance of one in ten. An effect may
    /// be small beside the noise: the estimator's likelihood has the last word.
    fn default() -> Self {
        TraceResidual {
            catalogue: Arc::default(),
            options: TraceOptions {
                most_effects: 3,
                thresholds: Thresholds { least_share: 0.01, ..Thresholds::default() },
                ..TraceOptions::default()
            },
            least_s: 12.0,
            least_rival: 0.1,
            least_gain: 20.0,
            whiteness: WhitenessSettings::default(),
            session: SessionSettings::default(),
        }
    }
}

impl Growth for TraceResidual {
    fn name(&self) -> &'static str {
        "trace"
    }

    fn least_gain(&self) -> f64 {
        self.least_gain
    }

    fn look(
        &self,
        robot: &Robot,
        model: &RobotModel,
        logs: &[MotionLog],
        doubted: bool,
        refuted: &[EffectSpec],
    ) -> Result<Found, CurriculumError> {
        if logs.iter().map(MotionLog::duration_s).sum::<f64>() < self.least_s {
            return Ok(Found::default());
        }
        let present = &model.specs()[robot.declared().len()..];
        let mut torques = coloured(robot, model, logs, &self.whiteness)?;
        if torques.is_empty() && !doubted {
            let answers = present.iter().map(|effect| vec![effect.clone()]).collect();
            return Ok(Found { answers, ..Found::default() });
        }
        let (tree, catalogue) = (robot.tree(), self.catalogue.as_ref());
        for spec in present {
            torques.extend(catalogue.build(spec, tree)?.entries().iter().map(|entry| entry.row));
        }
        let session = Session::of(robot, model, logs, &self.session)?;
        let data = session.data(&self.session);
        let mut declared = Vec::new();
        for spec in robot.declared() {
            declared.push(vec![catalogue.build(spec, tree)?]);
        }
        let identified = identify(tree, declared, &data)?;
        let input = TraceInput {
            tree,
            catalogue,
            data: &data,
            ranges: SignalRanges::of_surveys(&session.surveys),
            declared: robot.declared().to_vec(),
            parameters: identified.fit.parameters.clone(),
            residual_std: identified.fit.residual_std.clone(),
            held: None,
            noise_floor: session.noise.clone(),
            rows_per_independent: 1.0,
        };
        let options =
            TraceOptions { torques: Some(torques), excluded: refuted.to_vec(), ..self.options.clone() };
        let tracing = trace(input, &options)?;
        let mut found = Found::default();
        for effect in tracing.effects {
            for rival in effect.rivals.iter().filter(|rival| rival.confidence >= self.least_rival) {
                found.rivals.push([effect.spec.clone(), rival.spec.clone()]);
            }
            found.answers.push(vec![effect.spec]);
        }
        Ok(found)
    }
}

/// Logs as one session, as they were before noise moved the robot.
struct Session {
    surveys: Vec<Survey>,
    blocks: Vec<Vec<Block>>,
    /// Standard deviation of each torque's noise: of what of the residual is new in each period \[N·m, N\].
    noise: Vec<f64>,
    rest_speeds: Vec<f64>,
}

impl Session {
    fn of(
        robot: &Robot,
        model: &RobotModel,
        logs: &[MotionLog],
        settings: &SessionSettings,
    ) -> Result<Self, CurriculumError> {
        let joints = robot.tree().joint_count();
        let (design, parameters) = (robot.design_of(model)?, model.parameters(robot)?);
        let (mut surveys, mut blocks) = (Vec::with_capacity(logs.len()), Vec::with_capacity(logs.len()));
        let (mut squares, mut pairs) = (vec![0.0; joints], 0_usize);
        let mut start_s = 0.0;
        for (index, log) in logs.iter().enumerate() {
            let residual = residual(robot, model, log)?;
            for (at, next) in residual.iter().skip(joints).enumerate() {
                squares[at % joints] += 0.5 * (next - residual[at]).powi(2);
            }
            pairs += (residual.len() / joints.max(1)).saturating_sub(1);
            let mut block = log.before_noise(residual);
            let needed = torques_along(&design, &parameters, &mut block.clone(), 1)?;
            block.tau.iter_mut().zip(needed).for_each(|(torque, needed)| *torque += needed);
            block.t.iter_mut().for_each(|t| *t += start_s);
            block.log = index;
            surveys.push(recording(robot, &block).survey()?);
            blocks.push(vec![block]);
            start_s += log.duration_s() + settings.pause_s;
        }
        arrange_session(&mut surveys);
        let speed = |joint: usize| {
            let squares = surveys.iter().map(|survey| survey.joints[joint].velocity_rms.powi(2));
            settings.rest_share * (squares.sum::<f64>() / surveys.len() as f64).sqrt()
        };
        let rest_speeds = (0..joints).map(speed).collect();
        let noise = squares.iter().map(|sum| (sum / pairs.max(1) as f64).sqrt()).collect();
        Ok(Session { surveys, blocks, noise, rest_speeds })
    }

    fn data(&self, settings: &SessionSettings) -> Data<'_> {
        let all = settings.stretches.div_ceil(self.surveys.len().max(1));
        let all = all.max(settings.least_stretches).min(settings.most_stretches);
        let trained = all - ((settings.held_out * all as f64) as usize).max(1);
        let (mut train, mut held_out) = (Vec::new(), Vec::new());
        for (log, survey) in self.surveys.iter().enumerate() {
            let (start, end) = survey.time_range();
            let edge = |piece: usize| start + (end - start) * piece as f64 / all as f64;
            for piece in 0..all {
                // The last moment belongs to the last stretch.
                let end = if piece + 1 == all { end + 1e-6 } else { edge(piece + 1) };
                let fold = Fold { log, start: edge(piece), end };
                if piece < trained { train.push(fold) } else { held_out.push(fold) }
            }
        }
        let sources = self.blocks.iter().map(|blocks| blocks as &dyn BlockSource).collect();
        Data { train, held_out, sources, rest_speeds: self.rest_speeds.clone() }
    }
}

/// A block as other crates survey it.
fn recording(robot: &Robot, block: &Block) -> Recording {
    Recording {
        joints: robot.tree().joint_names().map(str::to_owned).collect(),
        t: block.t.clone(),
        q: block.q.clone(),
        tau: block.tau.clone(),
        qd: Some(block.qd.clone()),
        qdd: Some(block.qdd.clone()),
        temp: None,
    }
}
