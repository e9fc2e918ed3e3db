//! The residual against the signal that it follows, before an effect was added and after.

use super::axis::Axis;
use super::canvas::{Svg, WIDTH, picture, px};
use super::palette::{BEFORE, INK, PREDICTED, RESIDUAL};
use super::panel::{HEADER, Legend, Mark, dots, draw_legend, line, panel, stroke, text};
use super::{Line, drawable};
use crate::statistics::median;
use plotters::style::Color;
use plotters::style::text_anchor::{HPos, VPos};

/// Dots of one half of the picture at most.
const DOTS: usize = 1500;
const BINS: usize = 40;
/// A median of fewer samples says more about chance than about the joint.
const SAMPLES_PER_BIN: usize = 5;

/// What [`residual_against_signal`] shows.
#[derive(Debug, Clone, Copy)]
pub struct ResidualAgainstSignal<'a> {
    /// The signal, with its unit: `q̇ of joint_5 [rad/s]`.
    pub signal: &'a str,
    /// The residual, with its unit: `residual of joint_5 [N·m]`.
    pub residual: &'a str,
    /// The signal (x) and the residual of the model without the effect (y).
    pub before: Line<'a>,
    /// The same with the effect in the model; empty where there is none, and the picture has one half.
    pub after: Line<'a>,
}

/// Scatter of the residual over a signal with the median in bins of the signal, before and after side by
/// side on the same axes.
pub fn residual_against_signal(input: &ResidualAgainstSignal<'_>) -> Svg {
    let ResidualAgainstSignal { signal, residual, before, after } = *input;
    let both = || before.points().chain(after.points()).filter(|&(x, y)| drawable(x) && drawable(y));
    let pair = after.points().next().is_some();
    let x = Axis::linear(signal, both().map(|point| point.0), true, if pair { 4 } else { 8 });
    let y = Axis::linear("", both().map(|point| point.1).chain([0.0]), true, 5);
    let halves = if pair {
        vec![("before", before, BEFORE), ("after", after, RESIDUAL)]
    } else {
        vec![("", before, BEFORE)]
    };
    picture(WIDTH, 250, &format!("{residual} against {signal}"), |sheet| {
        let (header, body) = sheet.split_vertically(px(HEADER));
        text(&header, residual, (px(2), px(14)), HPos::Left, VPos::Bottom, INK)?;
        let legend = [Legend("samples", Mark::Dot, BEFORE), Legend("median", Mark::Line, PREDICTED)];
        draw_legend(&header, &legend, px(WIDTH - 10))?;
        for ((title, points, colour), half) in halves.iter().zip(body.split_evenly((1, halves.len()))) {
            let plot = panel(&half, &x, &y, &[])?;
            text(&half, title, (px(58), px(18)), HPos::Left, VPos::Bottom, INK)?;
            let stride = points.points().count().div_ceil(DOTS).max(1);
            dots(&plot, points.points().step_by(stride), 13, colour.rgb().mix(0.6).filled())?;
            line(&plot, binned_median(*points, x.range), stroke(PREDICTED, 20))?;
        }
        Ok(())
    })
}

/// Medians of y in bins of equal width of x; NaN for a bin with too few samples.
fn binned_median(points: Line<'_>, (from, to): (f64, f64)) -> Vec<(f64, f64)> {
    let mut bins = vec![Vec::new(); BINS];
    for (x, y) in points.points().filter(|&(x, y)| drawable(x) && drawable(y)) {
        let bin = ((x - from) / (to - from) * BINS as f64) as usize;
        bins[bin.min(BINS - 1)].push(y);
    }
    let centre = |bin: usize| from + (bin as f64 + 0.5) / BINS as f64 * (to - from);
    bins.iter_mut()
        .enumerate()
        .map(|(bin, ys)| {
            let enough = ys.len() >= SAMPLES_PER_BIN;
            (centre(bin), if enough { median(ys) } else { f64::NAN })
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn medians_of_a_step_are_its_two_levels() {
        let x: Vec<f64> = (0..2000).map(|i| i as f64 / 1000.0 - 1.0).collect();
        let y: Vec<f64> = x.iter().map(|x| 3.0 * x.signum() + 0.1 * (1000.0 * x).sin()).collect();
        for (at, median) in binned_median(Line { x: &x, y: &y }, (-1.0, 1.0)) {
            assert!((median - 3.0 * at.signum()).abs() < 0.1, "{median} at {at}");
        }
        assert!(binned_median(Line::default(), (0.0, 1.0)).iter().all(|(_, median)| median.is_nan()));
    }
}
