//! Signals over time: a single one, torque measured against predicted, and what is left between them.

use super::axis::Axis;
use super::canvas::{Svg, WIDTH, picture};
use super::decimation::{LINE_POINTS, decimate};
use super::palette::{MEASURED, NOISE, PREDICTED, RESIDUAL};
use super::panel::{Legend, Mark, line, panel, stroke};
use super::{Line, drawable};
use plotters::element::Rectangle;
use plotters::style::Color;

/// Width of a picture of one signal in CSS pixels: three stand side by side on a page.
const SIGNAL_WIDTH: i32 = 400;

/// What [`signal_panel`] shows.
#[derive(Debug, Clone, Copy)]
pub struct SignalPanel<'a> {
    /// The signal over time (s); NaN at a gap.
    pub line: Line<'a>,
    /// The quantity, with its unit: `q [rad]`.
    pub label: &'a str,
}

/// One signal over time, small, thinned to what the eye can tell apart.
pub fn signal_panel(input: &SignalPanel<'_>) -> Svg {
    let SignalPanel { line: samples, label } = *input;
    let x = Axis::linear("t [s]", samples.points().map(|point| point.0), false, 4);
    let y = Axis::linear(label, samples.points().map(|point| point.1), true, 3);
    picture(SIGNAL_WIDTH, 170, &format!("{label} over time"), |sheet| {
        let plot = panel(sheet, &x, &y, &[])?;
        let thinned = decimate(samples.x, samples.y, LINE_POINTS);
        line(&plot, Line::from(&thinned).points(), stroke(MEASURED, 11))
    })
}

/// What [`torque_panel`] shows.
#[derive(Debug, Clone, Copy)]
pub struct TorquePanel<'a> {
    /// Measured torque over time (s).
    pub measured: Line<'a>,
    /// The model's torque over time (s).
    pub predicted: Line<'a>,
    /// Unit of the torque, `N·m` or `N`.
    pub unit: &'a str,
}

/// Measured and predicted torque of one joint over time, thinned to what the eye can tell apart.
pub fn torque_panel(input: &TorquePanel<'_>) -> Svg {
    let TorquePanel { measured, predicted, unit } = *input;
    let both = || measured.points().chain(predicted.points());
    let x = Axis::linear("t [s]", both().map(|point| point.0), false, 9);
    let y = Axis::linear(format!("torque [{unit}]"), both().map(|point| point.1), true, 5);
    let legend = [Legend("measured", Mark::Line, MEASURED), Legend("predicted", Mark::Line, PREDICTED)];
    picture(WIDTH, 200, "measured and predicted torque over time", |sheet| {
        let plot = panel(sheet, &x, &y, &legend)?;
        for (samples, colour, width) in [(measured, MEASURED, 14), (predicted, PREDICTED, 11)] {
            let thinned = decimate(samples.x, samples.y, LINE_POINTS);
            line(&plot, Line::from(&thinned).points(), stroke(colour, width))?;
        }
        Ok(())
    })
}

/// What [`residual_panel`] shows.
#[derive(Debug, Clone, Copy)]
pub struct ResidualPanel<'a> {
    /// Measured minus predicted torque over time (s).
    pub residual: Line<'a>,
    /// The torque above it (s), whose times are shown, so that the two stand in line though the residual may
    /// have gaps at its ends.
    pub torque: Line<'a>,
    /// RMS of the noise, drawn as a band of ± this; none is drawn where it is not known.
    pub noise_floor: Option<f64>,
    /// Unit of the torque.
    pub unit: &'a str,
}

/// The residual of one joint over time with its noise floor, to stand under a [`torque_panel`].
pub fn residual_panel(input: &ResidualPanel<'_>) -> Svg {
    let ResidualPanel { residual, torque, noise_floor, unit } = *input;
    let floor = noise_floor.filter(|&floor| drawable(floor) && floor > 0.0);
    let x = Axis::linear("t [s]", residual.points().chain(torque.points()).map(|point| point.0), false, 9);
    let band = floor.into_iter().flat_map(|floor| [-floor, floor]);
    let y = Axis::linear(
        format!("residual [{unit}]"),
        residual.points().map(|point| point.1).chain(band).chain([0.0]),
        true,
        3,
    );
    let legend = [Legend("residual", Mark::Line, RESIDUAL), Legend("± noise floor", Mark::Area, NOISE)];
    let legend = if floor.is_some() { &legend[..] } else { &legend[..1] };
    picture(WIDTH, 130, "residual torque over time", |sheet| {
        let plot = panel(sheet, &x, &y, legend)?;
        if let Some(floor) = floor {
            let corners = [(x.range.0, -floor), (x.range.1, floor)];
            plot.draw(&Rectangle::new(corners, NOISE.rgb().mix(0.28).filled()))?;
        }
        let thinned = decimate(residual.x, residual.y, LINE_POINTS);
        line(&plot, Line::from(&thinned).points(), stroke(RESIDUAL, 10))
    })
}
