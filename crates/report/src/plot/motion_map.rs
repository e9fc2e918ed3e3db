//! A dataset of motions as blocks, iteration by iteration: which were allowed, how good each was, which was
//! chosen.

use super::axis::{Axis, log10};
use super::canvas::{Svg, WIDTH, picture};
use super::drawable;
use super::palette::{GRID, INK, PREDICTED, RESIDUAL};
use super::panel::{Legend, Mark, dots, line, panel, stroke};
use plotters::element::Rectangle;
use plotters::style::Color;

/// One row of the map.
#[derive(Debug, Clone, Copy)]
pub struct MapRow<'a> {
    /// What it is: `1`, `2`, … for iterations.
    pub name: &'a str,
    /// A positive number for each motion, small where it is good; what is not finite stays blank.
    pub values: &'a [f64],
    /// The motions that were allowed; the others get no frame.
    pub allowed: &'a [usize],
    /// The motion that was chosen.
    pub chosen: Option<usize>,
}

/// What [`motion_map`] shows.
#[derive(Debug, Clone, Copy)]
pub struct MotionMap<'a> {
    /// The rows, the first on top.
    pub rows: &'a [MapRow<'a>],
    /// Names of the groups of motions that lie side by side, each with its first motion, ascending.
    pub groups: &'a [(String, usize)],
    /// What the rows are.
    pub y_label: &'a str,
    /// What the values are: `cond(Φ)`.
    pub value_label: &'a str,
}

/// Lightest and darkest part of the colour.
const SHADES: (f64, f64) = (0.06, 0.95);

/// A block for each motion in each row, the darker the smaller its value among the row's; allowed blocks are
/// framed, chosen ones dotted and joined by a line.
pub fn motion_map(input: &MotionMap<'_>) -> Svg {
    let count = input.rows.iter().map(|row| row.values.len()).max().unwrap_or(0);
    let names: Vec<String> = input.rows.iter().rev().map(|row| row.name.to_owned()).collect();
    let mut y = Axis::categories(input.y_label, &names, names.len());
    y.names = true;
    let mut x = Axis::categories("", &[], 1);
    x.range = (-0.5, count.max(1) as f64 - 0.5);
    let ends = input.groups.iter().skip(1).map(|group| group.1).chain([count]);
    x.ticks = input
        .groups
        .iter()
        .zip(ends)
        .map(|((name, first), end)| (0.5 * (first + end) as f64 - 0.5, name.clone()))
        .collect();
    let dark = format!("small {}", input.value_label);
    let mut legend = vec![Legend(&dark, Mark::Area, RESIDUAL)];
    if input.rows.iter().any(|row| row.chosen.is_some()) {
        legend.push(Legend("chosen", Mark::Dot, PREDICTED));
    }
    let height = 60 + 26 * input.rows.len().max(1) as i32;
    picture(WIDTH, height, &format!("{} of each motion", input.value_label), |sheet| {
        let plot = panel(sheet, &x, &y, &legend)?;
        let place = |row: usize| (input.rows.len() - 1 - row) as f64;
        for (index, row) in input.rows.iter().enumerate() {
            let middle = place(index);
            let logs: Vec<f64> = row.values.iter().map(|&value| log10(value)).collect();
            let extent = logs.iter().filter(|log| drawable(**log));
            let (low, high) = extent
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &log| (low.min(log), high.max(log)));
            for (motion, &log) in logs.iter().enumerate().filter(|(_, log)| drawable(**log)) {
                let share = if high > low { (high - log) / (high - low) } else { 1.0 };
                let shade = SHADES.0 + share * (SHADES.1 - SHADES.0);
                let [from, to] = [-0.42, 0.42].map(|shift| motion as f64 + shift);
                let corners = [(from, middle - 0.4), (to, middle + 0.4)];
                plot.draw(&Rectangle::new(corners, RESIDUAL.rgb().mix(shade).filled()))?;
                if row.allowed.contains(&motion) {
                    plot.draw(&Rectangle::new(corners, stroke(INK, 10)))?;
                }
            }
        }
        for first in input.groups.iter().skip(1).map(|group| group.1 as f64 - 0.5) {
            line(&plot, [(first, -0.5), (first, input.rows.len() as f64 - 0.5)], stroke(GRID, 10))?;
        }
        let chosen =
            |(index, row): (usize, &MapRow<'_>)| row.chosen.map(|motion| (motion as f64, place(index)));
        let path: Vec<(f64, f64)> = input.rows.iter().enumerate().filter_map(chosen).collect();
        line(&plot, path.iter().copied(), stroke(PREDICTED, 14))?;
        dots(&plot, path, 42, stroke(PREDICTED, 10).filled())
    })
}
