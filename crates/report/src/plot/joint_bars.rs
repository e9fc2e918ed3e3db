//! One group of bars a joint: errors before and after, with the noise floor across them.

use super::axis::Axis;
use super::canvas::{Svg, WIDTH, picture};
use super::drawable;
use super::palette::{BEFORE, NOISE, RESIDUAL};
use super::panel::{Legend, Mark, panel, stroke};
use plotters::element::{PathElement, Rectangle};
use plotters::style::Color;

/// The bars of one joint; what is absent, negative or not finite is left out.
#[derive(Debug, Clone, Default)]
pub struct BarGroup {
    /// The joint's name.
    pub joint: String,
    /// Error of the declared model.
    pub before: Option<f64>,
    /// Error of the final model.
    pub after: Option<f64>,
    /// The noise floor, a line across the bars.
    pub noise_floor: Option<f64>,
}

/// What [`joint_bars`] shows.
#[derive(Debug, Clone, Copy)]
pub struct JointBars<'a> {
    /// One group a joint, in the robot's order.
    pub groups: &'a [BarGroup],
    /// What the bars measure, with its unit: `RMSE [N·m]`, or `error [% of RMS torque]` where units differ.
    pub label: &'a str,
}

/// Bars per joint before and after, noise floor across them.
pub fn joint_bars(input: &JointBars<'_>) -> Svg {
    let groups = input.groups;
    let values = groups.iter().flat_map(|group| [group.before, group.after, group.noise_floor]).flatten();
    let y = Axis::from_zero(input.label, values, 5);
    let names: Vec<String> = groups.iter().map(|group| group.joint.clone()).collect();
    let longest = names.iter().map(|name| name.chars().count()).max().unwrap_or(0);
    let x = Axis::categories("", &names, (100 / (longest + 2)).max(1));
    let has = |value: fn(&BarGroup) -> Option<f64>| groups.iter().any(|group| value(group).is_some());
    let mut legend = Vec::new();
    if has(|group| group.before) {
        legend.push(Legend("before", Mark::Area, BEFORE));
    }
    if has(|group| group.after) {
        legend.push(Legend("after", Mark::Area, RESIDUAL));
    }
    if has(|group| group.noise_floor) {
        legend.push(Legend("noise floor", Mark::Line, NOISE));
    }
    picture(WIDTH, 220, "error per joint", |sheet| {
        let plot = panel(sheet, &x, &y, &legend)?;
        for (place, group) in groups.iter().enumerate() {
            let place = place as f64;
            for (value, from, to, colour) in
                [(group.before, -0.34, -0.01, BEFORE), (group.after, 0.01, 0.34, RESIDUAL)]
            {
                if let Some(value) = value.filter(shown) {
                    let corners = [(place + from, 0.0), (place + to, value)];
                    plot.draw(&Rectangle::new(corners, colour.rgb().filled()))?;
                }
            }
            if let Some(floor) = group.noise_floor.filter(shown) {
                let across = vec![(place - 0.42, floor), (place + 0.42, floor)];
                plot.draw(&PathElement::new(across, stroke(NOISE, 20)))?;
            }
        }
        Ok(())
    })
}

fn shown(value: &f64) -> bool {
    drawable(*value) && *value >= 0.0
}
