//! The table of torque errors, joint by joint.

use super::JointSection;
use super::parts::share_bar;
use crate::number::{ABSENT, percent, significant};
use crate::plot::{BarGroup, JointBars, joint_bars};
use maud::{Markup, PreEscaped, html};

/// Torque errors per joint and pooled.
#[derive(Debug, Clone, Default)]
pub struct ErrorTable {
    /// One row a joint, in the robot's order.
    pub rows: Vec<ErrorRow>,
    /// All joints and samples together.
    pub pooled: PooledError,
    /// What the reader should know about these numbers: which part was held out, how.
    pub note: String,
}

/// Errors of one joint, all in the joint's unit.
#[derive(Debug, Clone, Default)]
pub struct ErrorRow {
    /// The joint's name.
    pub joint: String,
    /// `N·m` or `N`.
    pub unit: String,
    /// RMS of the measured torque, on held-out motion where there is some.
    pub rms_torque: f64,
    /// RMS error on the motion that the model was fitted to.
    pub train: Option<f64>,
    /// RMS error on held-out motion.
    pub held_out: Option<f64>,
    /// The declared model's RMS error on held-out motion, where effects were added to it.
    pub before: Option<f64>,
    /// RMS of the noise.
    pub noise_floor: Option<f64>,
}

impl ErrorRow {
    /// The error over the RMS torque, held out where it is known.
    fn relative(&self) -> f64 {
        self.held_out.or(self.train).map_or(f64::NAN, |error| error / self.rms_torque)
    }

    fn share(&self, value: Option<f64>) -> Option<f64> {
        value.map(|value| value / self.rms_torque)
    }
}

/// RMS error over RMS torque, all joints and samples pooled; 1 is all.
#[derive(Debug, Clone, Default)]
pub struct PooledError {
    /// On the motion that the model was fitted to.
    pub train: Option<f64>,
    /// On held-out motion.
    pub held_out: Option<f64>,
    /// The declared model on held-out motion, where effects were added to it.
    pub before: Option<f64>,
}

impl ErrorTable {
    pub(super) fn markup(&self, joints: &[JointSection]) -> Markup {
        let rows = &self.rows;
        if rows.is_empty() {
            return html! {};
        }
        let before = rows.iter().any(|row| row.before.is_some());
        let held_out = rows.iter().any(|row| row.held_out.is_some());
        let floor = rows.iter().any(|row| row.noise_floor.is_some());
        let scale = rows
            .iter()
            .flat_map(|row| [Some(row.relative()), row.share(row.before), row.share(row.noise_floor)])
            .flatten()
            .filter(|share| share.is_finite())
            // A joint that hardly loads may be off by several times its torque; the others shall stay
            // readable.
            .fold(0.01, |scale: f64, share| scale.max(share.min(1.0)));
        let pooled = &self.pooled;
        let pooled_relative = pooled.held_out.or(pooled.train).unwrap_or(f64::NAN);
        let percentage = |share: Option<f64>| share.map_or(ABSENT.into(), |share| percent(share) + " %");
        html! {
            @if !self.note.is_empty() { p.note { (self.note) } }
            div.scroll { table.errors {
                thead {
                    tr {
                        th rowspan="2" { "Joint" } th rowspan="2" { "Unit" } th.number rowspan="2" { "RMS torque" }
                        th.group colspan=(1 + usize::from(before) + usize::from(held_out)) { "RMSE" }
                        @if floor { th.number rowspan="2" { "Noise floor" } }
                        th.number rowspan="2" { "Error / RMS" }
                        th.wide rowspan="2" { span.key {
                            @if before { i.before {} "before" }
                            @if floor { i.floor {} "noise floor" }
                        } }
                    }
                    tr {
                        th.number { "train" }
                        @if before { th.number { "before" } }
                        @if held_out { th.number { "held-out" } }
                    }
                }
                tbody { @for row in rows { tr {
                    td { (joint_link(&row.joint, joints)) }
                    td.muted { (row.unit) }
                    td.number { (significant(row.rms_torque, 3)) }
                    td.number { (optional(row.train)) }
                    @if before { td.number.muted { (optional(row.before)) } }
                    @if held_out { td.number { (optional(row.held_out)) } }
                    @if floor { td.number.muted { (optional(row.noise_floor)) } }
                    td.number { strong { (percent(row.relative())) } " %" }
                    td { (share_bar(row.relative(), scale, row.share(row.before), row.share(row.noise_floor))) }
                } } }
                tfoot { tr {
                    td colspan="2" { "All, pooled" } td {}
                    td.number { (percentage(pooled.train)) }
                    @if before { td.number.muted { (percentage(pooled.before)) } }
                    @if held_out { td.number { (percentage(pooled.held_out)) } }
                    @if floor { td {} }
                    td.number { strong { (percent(pooled_relative)) } " %" }
                    td { (share_bar(pooled_relative, scale, pooled.before, None)) }
                } }
            } }
            @if before { figure { (PreEscaped(self.picture().inline())) } }
        }
    }

    /// Bars before and after; in percent where the joints' units differ.
    fn picture(&self) -> crate::plot::Svg {
        let unit = self.rows.first().map_or("", |row| row.unit.as_str());
        let one_unit = self.rows.iter().all(|row| row.unit == unit);
        let bars: Vec<BarGroup> = self
            .rows
            .iter()
            .map(|row| {
                let shown = |value: Option<f64>| {
                    if one_unit { value } else { row.share(value).map(|share| 100.0 * share) }
                };
                BarGroup {
                    joint: row.joint.clone(),
                    before: shown(row.before),
                    after: shown(row.held_out.or(row.train)),
                    noise_floor: shown(row.noise_floor),
                }
            })
            .collect();
        let label =
            if one_unit { format!("held-out RMSE [{unit}]") } else { "error [% of RMS torque]".into() };
        joint_bars(&JointBars { groups: &bars, label: &label })
    }
}

fn optional(value: Option<f64>) -> String {
    value.map_or(ABSENT.into(), |value| significant(value, 3))
}

/// The joint's name, leading to its pictures where there are some.
fn joint_link(joint: &str, joints: &[JointSection]) -> Markup {
    match joints.iter().position(|section| section.joint == joint) {
        Some(index) => html! { a href={ "#joint-" (index + 1) } { (joint) } },
        None => html! { (joint) },
    }
}
