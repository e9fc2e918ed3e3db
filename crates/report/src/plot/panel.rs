//! Axes, grid and legend around data: what all pictures have in common.

use super::axis::Axis;
use super::canvas::{Drawn, Sheet, px};
use super::drawable;
use super::palette::{Colour, GRID, INK, MUTED, NOISE, ZERO};
use super::svg_backend::{SvgBackend, TEXT_PIXELS};
use plotters::coord::cartesian::Cartesian2d;
use plotters::coord::types::RangedCoordf64;
use plotters::drawing::DrawingArea;
use plotters::element::{Circle, PathElement, Rectangle, Text};
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{Color, IntoFont, ShapeStyle, TextStyle};

/// The inside of a panel, in the data's coordinates.
pub(super) type Plot<'a> = DrawingArea<SvgBackend<'a>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;

/// Left of the plot, for tick labels; the same everywhere so that panels above one another align.
const LEFT: i32 = 58;
const RIGHT: i32 = 10;
/// Above the plot, for the ordinate's label and the legend.
pub(super) const HEADER: i32 = 24;
/// Below the plot, for tick labels.
const FOOTER: i32 = 22;
/// Height of a line of words.
const LINE: i32 = 15;

/// How the legend shows a series.
#[derive(Debug, Clone, Copy)]
pub(super) enum Mark {
    Line,
    Area,
    Dot,
}

/// One series in the legend.
pub(super) struct Legend<'a>(pub(super) &'a str, pub(super) Mark, pub(super) Colour);

/// Draws axes on the sheet and gives the area for the data. The ordinate's label stands above the axis, the
/// abscissa's at its end, the legend above the plot at the right, so that nothing covers data.
pub(super) fn panel<'a>(sheet: &Sheet<'a>, x: &Axis, y: &Axis, legend: &[Legend<'_>]) -> Drawn<Plot<'a>> {
    let (width, height) = sheet.dim_in_pixel();
    let (width, height) = (width as i32, height as i32);
    let (left, right) = (px(LEFT), (width - px(RIGHT)).max(px(LEFT + 1)));
    let footer = if x.names && !x.label.is_empty() { FOOTER + LINE } else { FOOTER };
    let (top, bottom) = (px(HEADER), (height - px(footer)).max(px(HEADER + 1)));
    let to_x = |value: f64| left + (share(value, x.range) * f64::from(right - left)).round() as i32;
    let to_y = |value: f64| bottom - (share(value, y.range) * f64::from(bottom - top)).round() as i32;

    let grid = GRID.rgb().stroke_width(px(1) as u32);
    let zero = ZERO.rgb().stroke_width(px(1) as u32);
    for (value, _) in x.ticks.iter().filter(|_| !x.names) {
        sheet.draw(&PathElement::new(vec![(to_x(*value), top), (to_x(*value), bottom)], grid))?;
    }
    for (value, label) in &y.ticks {
        let style = if label == "0" { zero } else { grid };
        sheet.draw(&PathElement::new(vec![(left, to_y(*value)), (right, to_y(*value))], style))?;
    }
    // The abscissa's label takes the place of tick labels at the right end, or has a line of its own under
    // names.
    let (label_line, label_from) = if x.label.is_empty() || x.names {
        (bottom + px(5 + LINE), i32::MAX)
    } else {
        (bottom + px(5), right - text_width(&x.label) - px(8))
    };
    for (value, label) in &x.ticks {
        if to_x(*value) + text_width(label) / 2 < label_from {
            text(sheet, label, (to_x(*value), bottom + px(5)), HPos::Center, VPos::Top, MUTED)?;
        }
    }
    text(sheet, &x.label, (right, label_line), HPos::Right, VPos::Top, INK)?;
    for (value, label) in &y.ticks {
        text(sheet, label, (left - px(6), to_y(*value)), HPos::Right, VPos::Center, MUTED)?;
    }
    text(sheet, &y.label, (px(2), px(14)), HPos::Left, VPos::Bottom, INK)?;
    draw_legend(sheet, legend, right)?;

    Ok(sheet.clone().apply_coord_spec(Cartesian2d::<RangedCoordf64, RangedCoordf64>::new(
        x.range.0..x.range.1,
        y.range.0..y.range.1,
        absolute(sheet, left..right, bottom..top),
    )))
}

/// The legend, ending about at `right`; fonts differ, so each name has some room to spare.
pub(super) fn draw_legend(sheet: &Sheet<'_>, legend: &[Legend<'_>], right: i32) -> Drawn {
    const MARK: i32 = px(16);
    const SPACE: i32 = px(6);
    const GAP: i32 = px(20);
    let middle = px(10);
    let width = |Legend(name, ..): &Legend<'_>| MARK + SPACE + text_width(name) + GAP;
    let mut x = right + GAP - legend.iter().map(width).sum::<i32>();
    for entry in legend {
        let Legend(name, mark, colour) = entry;
        match mark {
            Mark::Line => line_mark(sheet, (x, x + MARK), middle, *colour)?,
            Mark::Area => sheet.draw(&Rectangle::new(
                [(x, middle - px(4)), (x + MARK, middle + px(4))],
                colour.rgb().mix(if *colour == NOISE { 0.35 } else { 1.0 }).filled(),
            ))?,
            Mark::Dot => {
                sheet.draw(&Circle::new((x + MARK - px(3), middle), px(3), colour.rgb().filled()))?
            }
        }
        text(sheet, name, (x + MARK + SPACE, middle), HPos::Left, VPos::Center, MUTED)?;
        x += width(entry);
    }
    Ok(())
}

fn line_mark(sheet: &Sheet<'_>, (from, to): (i32, i32), y: i32, colour: Colour) -> Drawn {
    sheet.draw(&PathElement::new(vec![(from, y), (to, y)], stroke(colour, 20)))
}

/// A line through the points, broken where one cannot be drawn.
pub(super) fn line(
    plot: &Plot<'_>,
    points: impl IntoIterator<Item = (f64, f64)>,
    style: ShapeStyle,
) -> Drawn {
    let mut run: Vec<(f64, f64)> = Vec::new();
    for (x, y) in points {
        if drawable(x) && drawable(y) {
            run.push((x, y));
        } else if !run.is_empty() {
            plot.draw(&PathElement::new(std::mem::take(&mut run), style))?;
        }
    }
    if run.is_empty() { Ok(()) } else { plot.draw(&PathElement::new(run, style)) }
}

/// Dots of the given radius (tenths of a pixel).
pub(super) fn dots(
    plot: &Plot<'_>,
    points: impl IntoIterator<Item = (f64, f64)>,
    radius: i32,
    style: ShapeStyle,
) -> Drawn {
    points
        .into_iter()
        .filter(|&(x, y)| drawable(x) && drawable(y))
        .try_for_each(|point| plot.draw(&Circle::new(point, radius, style)))
}

/// A line's style: colour and width in tenths of a pixel.
pub(super) fn stroke(colour: Colour, tenths: u32) -> ShapeStyle {
    colour.rgb().stroke_width(tenths)
}

pub(super) fn text(
    sheet: &Sheet<'_>,
    words: &str,
    at: (i32, i32),
    horizontal: HPos,
    vertical: VPos,
    colour: Colour,
) -> Drawn {
    if words.is_empty() {
        return Ok(());
    }
    let colour = colour.rgb();
    let style = TextStyle::from(("sans-serif", px(TEXT_PIXELS)).into_font())
        .color(&colour)
        .pos(Pos::new(horizontal, vertical));
    sheet.draw(&Text::new(words, at, style))
}

/// About as wide as the text will be; fonts differ.
pub(super) fn text_width(words: &str) -> i32 {
    words.chars().count() as i32 * px(TEXT_PIXELS) * 60 / 100
}

fn share(value: f64, (from, to): (f64, f64)) -> f64 {
    (value - from) / (to - from)
}

/// Coordinates of this sheet as those of the whole picture, which plotters wants here.
fn absolute(
    sheet: &Sheet<'_>,
    x: std::ops::Range<i32>,
    y: std::ops::Range<i32>,
) -> (std::ops::Range<i32>, std::ops::Range<i32>) {
    let (x_range, y_range) = sheet.get_pixel_range();
    (x.start + x_range.start..x.end + x_range.start, y.start + y_range.start..y.end + y_range.start)
}
