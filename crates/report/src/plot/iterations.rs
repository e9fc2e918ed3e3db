//! A quantity over the iterations of a procedure, one line a variant.

use super::Line;
use super::axis::{Axis, log10};
use super::canvas::{Svg, WIDTH, picture};
use super::decimation::{LINE_POINTS, decimate};
use super::palette::series;
use super::panel::{Legend, Mark, dots, line, panel, stroke};

/// One variant's line.
#[derive(Debug, Clone, Copy)]
pub struct IterationLine<'a> {
    /// The variant's name for the legend.
    pub name: &'a str,
    /// Its values, one for each iteration; NaN where there is none.
    pub values: &'a [f64],
}

/// What [`iterations`] shows.
#[derive(Debug, Clone, Copy)]
pub struct Iterations<'a> {
    /// The lines, told apart by colour up to six.
    pub lines: &'a [IterationLine<'a>],
    /// What is iterated: `iteration`.
    pub x_label: &'a str,
    /// The quantity, with its unit.
    pub y_label: &'a str,
    /// Number of the first: 1, or 0 where it is what was before.
    pub first: usize,
    /// Whether the ordinate is logarithmic; values that are not positive are then left out.
    pub logarithmic: bool,
}

/// Beyond so many iterations dots would run into one another.
const DOTTED: usize = 100;

/// Lines with a dot at each iteration, as long as there is room for dots.
pub fn iterations(input: &Iterations<'_>) -> Svg {
    let values = input.lines.iter().flat_map(|line| line.values.iter().copied());
    let count = input.lines.iter().map(|line| line.values.len()).max().unwrap_or(0);
    let y = if input.logarithmic {
        Axis::logarithmic(input.y_label, values)
    } else {
        Axis::linear(input.y_label, values, true, 6)
    };
    let names: Vec<String> = (0..count).map(|iteration| (input.first + iteration).to_string()).collect();
    let x = Axis::categories(input.x_label, &names, 20);
    let legend: Vec<_> = input
        .lines
        .iter()
        .enumerate()
        .map(|(index, line)| Legend(line.name, Mark::Line, series(index)))
        .collect();
    picture(WIDTH, 280, &format!("{} over {}", input.y_label, input.x_label), |sheet| {
        let plot = panel(sheet, &x, &y, &legend)?;
        for (index, variant) in input.lines.iter().enumerate() {
            let places: Vec<f64> = (0..variant.values.len()).map(|iteration| iteration as f64).collect();
            let heights: Vec<f64> = variant
                .values
                .iter()
                .map(|&value| if input.logarithmic { log10(value) } else { value })
                .collect();
            let thinned = decimate(&places, &heights, LINE_POINTS);
            line(&plot, Line::from(&thinned).points(), stroke(series(index), 18))?;
            if count <= DOTTED {
                dots(&plot, Line::from(&thinned).points(), 32, stroke(series(index), 10).filled())?;
            }
        }
        Ok(())
    })
}
