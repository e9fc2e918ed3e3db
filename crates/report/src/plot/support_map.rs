//! Points on the floor and the regions that they should stay in, seen from above.

use super::Line;
use super::axis::Axis;
use super::canvas::{Svg, picture};
use super::palette::{NOISE, PREDICTED, ZERO};
use super::panel::{Legend, Mark, dots, line, panel, stroke};

/// What [`support_map`] shows.
#[derive(Debug, Clone, Copy)]
pub struct SupportMap<'a> {
    /// The points, such as a motion's ZMP \[m\].
    pub points: Line<'a>,
    /// Corners of the region that carries \[m\].
    pub support: &'a [[f64; 2]],
    /// Corners of the region that is allowed \[m\]; may be empty.
    pub allowed: &'a [[f64; 2]],
    /// What the picture is about, above it.
    pub title: &'a str,
}

/// Points with both regions' outlines, at one scale along both axes.
pub fn support_map(input: &SupportMap<'_>) -> Svg {
    let corners = || input.support.iter().chain(input.allowed).copied();
    let xs = || corners().map(|corner| corner[0]).chain(input.points.x.iter().copied());
    let ys = || corners().map(|corner| corner[1]).chain(input.points.y.iter().copied());
    // The panel leaves so much around the plot that this is nearly square for equal ranges.
    const SIZE: (i32, i32) = (300, 278);
    let mut x = Axis::linear("x [m]", xs(), true, 4);
    let mut y = Axis::linear(input.title, ys(), true, 4);
    let half = 0.5 * (x.range.1 - x.range.0).max(y.range.1 - y.range.0);
    for axis in [&mut x, &mut y] {
        let middle = 0.5 * (axis.range.0 + axis.range.1);
        *axis = Axis::linear(axis.label.clone(), [middle - half, middle + half], false, 4);
    }
    let legend = [Legend("support", Mark::Line, ZERO), Legend("allowed", Mark::Line, NOISE)];
    let legend = if input.allowed.is_empty() { &legend[..1] } else { &legend[..] };
    picture(SIZE.0, SIZE.1, input.title, |sheet| {
        let plot = panel(sheet, &x, &y, legend)?;
        for (region, style) in [(input.support, stroke(ZERO, 22)), (input.allowed, stroke(NOISE, 18))] {
            let closed = region.iter().chain(region.first()).map(|&[x, y]| (x, y));
            line(&plot, closed, style)?;
        }
        dots(&plot, input.points.points(), 12, stroke(PREDICTED, 5).filled())
    })
}
