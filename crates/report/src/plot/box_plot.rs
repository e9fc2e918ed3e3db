//! Distributions over the iterations of a procedure: boxes, whiskers, outliers; groups side by side.

use super::axis::{Axis, log10};
use super::canvas::{Drawn, Svg, WIDTH, picture};
use super::drawable;
use super::palette::{Colour, series};
use super::panel::{Legend, Mark, Plot, dots, line, panel, stroke};
use crate::statistics::quantile;
use plotters::element::Rectangle;
use plotters::style::Color;

/// One variant's distributions.
#[derive(Debug, Clone, Copy)]
pub struct BoxGroup<'a> {
    /// The variant's name for the legend.
    pub name: &'a str,
    /// Its samples at each place of the abscissa; what is not finite is left out.
    pub samples: &'a [Vec<f64>],
}

/// What [`box_plot`] shows.
#[derive(Debug, Clone, Copy)]
pub struct BoxPlot<'a> {
    /// Groups side by side at each place, told apart by colour.
    pub groups: &'a [BoxGroup<'a>],
    /// Names of the places: iterations, joints.
    pub places: &'a [String],
    /// What the places are.
    pub x_label: &'a str,
    /// The quantity, with its unit.
    pub y_label: &'a str,
    /// Whether the ordinate is logarithmic; values that are not positive are then left out.
    pub logarithmic: bool,
}

/// Boxes from the first to the third quartile with the median, whiskers to the last sample within 1.5
/// times the box's height (Tukey), and each sample beyond as a ring.
pub fn box_plot(input: &BoxPlot<'_>) -> Svg {
    let values = input.groups.iter().flat_map(|group| group.samples.iter().flatten().copied());
    let y = if input.logarithmic {
        Axis::logarithmic(input.y_label, values)
    } else {
        Axis::linear(input.y_label, values, true, 6)
    };
    let longest = input.places.iter().map(|name| name.chars().count()).max().unwrap_or(0);
    let x = Axis::categories(input.x_label, input.places, (90 / (longest + 2)).max(1));
    let legend: Vec<_> = input
        .groups
        .iter()
        .enumerate()
        .map(|(index, group)| Legend(group.name, Mark::Area, series(index)))
        .collect();
    let width = 0.8 / input.groups.len().max(1) as f64;
    picture(WIDTH, 280, &format!("distribution of {} over {}", input.y_label, input.x_label), |sheet| {
        let plot = panel(sheet, &x, &y, &legend)?;
        for (index, group) in input.groups.iter().enumerate() {
            let offset = (index as f64 + 0.5) * width - 0.4;
            for (place, samples) in group.samples.iter().take(input.places.len()).enumerate() {
                let scaled = samples.iter().map(|&v| if input.logarithmic { log10(v) } else { v });
                if let Some(summary) = Summary::of(scaled) {
                    draw_box(&plot, place as f64 + offset, 0.36 * width, &summary, series(index))?;
                }
            }
        }
        Ok(())
    })
}

fn draw_box(plot: &Plot<'_>, centre: f64, half: f64, summary: &Summary, colour: Colour) -> Drawn {
    let Summary { quartiles: [q1, median, q3], whiskers: [low, high], ref outliers } = *summary;
    let thin = stroke(colour, 10);
    for (from, to) in [(low, q1), (q3, high)] {
        line(plot, [(centre, from), (centre, to)], thin)?;
    }
    for end in [low, high] {
        line(plot, [(centre - 0.5 * half, end), (centre + 0.5 * half, end)], thin)?;
    }
    let corners = [(centre - half, q1), (centre + half, q3)];
    plot.draw(&Rectangle::new(corners, colour.rgb().mix(0.25).filled()))?;
    plot.draw(&Rectangle::new(corners, thin))?;
    line(plot, [(centre - half, median), (centre + half, median)], stroke(colour, 22))?;
    dots(plot, outliers.iter().map(|&value| (centre, value)), 20, thin)
}

/// What a box shows.
#[derive(Debug, PartialEq)]
struct Summary {
    quartiles: [f64; 3],
    whiskers: [f64; 2],
    outliers: Vec<f64>,
}

impl Summary {
    fn of(values: impl Iterator<Item = f64>) -> Option<Self> {
        let mut sorted: Vec<f64> = values.filter(|&value| drawable(value)).collect();
        sorted.sort_by(f64::total_cmp);
        if sorted.is_empty() {
            return None;
        }
        let quartiles = [0.25, 0.5, 0.75].map(|share| quantile(&sorted, share));
        let reach = 1.5 * (quartiles[2] - quartiles[0]);
        let inside = |value: &f64| *value >= quartiles[0] - reach && *value <= quartiles[2] + reach;
        let whiskers = [
            sorted.iter().copied().find(inside).map_or(quartiles[0], |low| low.min(quartiles[0])),
            sorted.iter().copied().rfind(inside).map_or(quartiles[2], |high| high.max(quartiles[2])),
        ];
        let outliers = sorted.iter().copied().filter(|value| !inside(value)).collect();
        Some(Self { quartiles, whiskers, outliers })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn summary_by_hand() {
        let summary = Summary::of([3.0, 1.0, 2.0, f64::NAN, 4.0, 100.0].into_iter());
        let expected = Summary { quartiles: [2.0, 3.0, 4.0], whiskers: [1.0, 4.0], outliers: vec![100.0] };
        assert_eq!(summary, Some(expected));
        assert_eq!(Summary::of([f64::NAN].into_iter()), None);
    }
}
