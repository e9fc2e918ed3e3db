//! Measured against predicted torque, joint by joint.

use crate::plot::{
    LINE_POINTS, Line, Polyline, ResidualPanel, TorquePanel, decimate, residual_panel, torque_panel,
};
use maud::{Markup, PreEscaped, html};

/// Points of a line that all logs of a joint share, so that many logs do not make a large page.
const JOINT_POINTS: usize = 6000;

/// One joint's pictures.
#[derive(Debug, Clone, Default)]
pub struct JointSection {
    /// The joint's name.
    pub joint: String,
    /// Unit of its torque, `N·m` or `N`.
    pub unit: String,
    /// A line under the name, such as its errors; may be empty.
    pub summary: String,
    /// RMS of the noise, drawn into the residual.
    pub noise_floor: Option<f64>,
    /// Held-out motion, one trace a log.
    pub held_out: Vec<TorqueTrace>,
    /// The motion that the model was fitted to, one trace a log; folded where there is held-out motion.
    pub train: Vec<TorqueTrace>,
}

/// One joint's torque over one log. A long log is best thinned while it streams (see
/// [`Decimator`](crate::plot::Decimator)): the page draws no more than [`LINE_POINTS`]
/// a line, and fewer where a joint has many logs.
#[derive(Debug, Clone, Default)]
pub struct TorqueTrace {
    /// The log's name.
    pub log: String,
    /// Measured torque over time (s); NaN at a gap.
    pub measured: Polyline,
    /// The model's torque.
    pub predicted: Polyline,
    /// Measured minus predicted.
    pub residual: Polyline,
}

pub(super) fn markup(joints: &[JointSection]) -> Markup {
    html! { @for (index, joint) in joints.iter().enumerate() { (joint.markup(index + 1)) } }
}

impl JointSection {
    fn markup(&self, number: usize) -> Markup {
        html! {
            article.joint id={ "joint-" (number) } {
                h3 { (self.joint) @if !self.summary.is_empty() { span.summary { (self.summary) } } }
                @for trace in &self.held_out { (self.trace(trace, "held out")) }
                @if self.held_out.is_empty() {
                    @for trace in &self.train { (self.trace(trace, "train")) }
                } @else if !self.train.is_empty() {
                    details {
                        summary { "Training motion" @if self.train.len() > 1 { ", " (self.train.len()) " logs" } }
                        @for trace in &self.train { (self.trace(trace, "train")) }
                    }
                }
            }
        }
    }

    fn trace(&self, trace: &TorqueTrace, part: &str) -> Markup {
        let logs = self.held_out.len() + self.train.len();
        let points = (JOINT_POINTS / logs.max(1)).clamp(100, LINE_POINTS);
        let [measured, predicted, residual] = [&trace.measured, &trace.predicted, &trace.residual]
            .map(|line| decimate(&line.x, &line.y, points));
        let torque = torque_panel(&TorquePanel {
            measured: Line::from(&measured),
            predicted: Line::from(&predicted),
            unit: &self.unit,
        });
        let residual = residual_panel(&ResidualPanel {
            residual: Line::from(&residual),
            torque: Line::from(&measured),
            noise_floor: self.noise_floor,
            unit: &self.unit,
        });
        html! {
            figure {
                (PreEscaped(torque.inline()))
                (PreEscaped(residual.inline()))
                figcaption { (part) @if !trace.log.is_empty() { " · " code { (trace.log) } } }
            }
        }
    }
}
