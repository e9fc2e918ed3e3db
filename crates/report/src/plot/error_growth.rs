//! How an error changes with time, one line a variant.

use super::Line;
use super::axis::{Axis, log10};
use super::canvas::{Svg, WIDTH, picture};
use super::palette::series;
use super::panel::{Legend, Mark, line, panel, stroke};

/// One variant's line.
#[derive(Debug, Clone, Copy)]
pub struct GrowthLine<'a> {
    /// The variant's name for the legend.
    pub name: &'a str,
    /// Time \[s\] and error; errors that are not positive are left out.
    pub line: Line<'a>,
}

/// What [`error_growth`] shows.
#[derive(Debug, Clone, Copy)]
pub struct ErrorGrowth<'a> {
    /// The lines, told apart by colour up to six.
    pub lines: &'a [GrowthLine<'a>],
    /// What time: `horizon [s]`.
    pub x_label: &'a str,
    /// The error, with its unit.
    pub y_label: &'a str,
}

/// Errors over time; the ordinate is logarithmic.
pub fn error_growth(input: &ErrorGrowth<'_>) -> Svg {
    let shown: Vec<Vec<(f64, f64)>> = input
        .lines
        .iter()
        .map(|variant| variant.line.points().filter(|&(_, error)| error > 0.0).collect())
        .collect();
    let horizons = shown.iter().flatten().map(|&(horizon, _)| horizon);
    let x = Axis::linear(input.x_label, horizons.chain([0.0]), true, 6);
    let y = Axis::logarithmic(input.y_label, shown.iter().flatten().map(|&(_, error)| error));
    let name = |(index, variant): (usize, &GrowthLine<'_>)| (variant.name.to_owned(), series(index));
    let names: Vec<_> = input.lines.iter().enumerate().map(name).collect();
    let legend: Vec<_> = names.iter().map(|(name, colour)| Legend(name, Mark::Line, *colour)).collect();
    picture(WIDTH, 280, &format!("{} over {}", input.y_label, input.x_label), |sheet| {
        let plot = panel(sheet, &x, &y, &legend)?;
        for (index, points) in shown.iter().enumerate() {
            let points = points.iter().map(|&(horizon, error)| (horizon, log10(error)));
            line(&plot, points, stroke(series(index), 18))?;
        }
        Ok(())
    })
}
