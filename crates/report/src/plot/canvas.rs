//! The finished picture and the sheet that it is drawn on.

use super::svg_backend::{ATTRIBUTES, SvgBackend, UNITS_PER_PIXEL, escaped};
use plotters::coord::Shift;
use plotters::drawing::{DrawingArea, DrawingAreaErrorKind, IntoDrawingArea};
use std::convert::Infallible;
use std::fmt;

/// A picture as SVG text, made by one of this module's functions; well-formed, with nothing to load.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Svg(String);

impl Svg {
    /// The text, a whole SVG document without an XML declaration.
    pub fn as_str(&self) -> &str {
        &self.0
    }

    /// The text for the inside of an HTML page, where `<svg>` needs no namespace.
    pub(crate) fn inline(&self) -> String {
        self.0.replacen(NAMESPACE, "", 1)
    }
}

impl fmt::Display for Svg {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl From<Svg> for String {
    fn from(svg: Svg) -> String {
        svg.0
    }
}

const NAMESPACE: &str = " xmlns=\"http://www.w3.org/2000/svg\"";

/// Width of the pictures of a report in CSS pixels; on the page they are scaled to its width.
pub(super) const WIDTH: i32 = 800;

pub(super) type Sheet<'a> = DrawingArea<SvgBackend<'a>, Shift>;
pub(super) type Drawn<T = ()> = Result<T, DrawingAreaErrorKind<Infallible>>;

/// CSS pixels in units of the picture.
pub(super) const fn px(pixels: i32) -> i32 {
    pixels * UNITS_PER_PIXEL
}

/// Draws on a sheet of the given size (CSS pixels); `description` is for readers who do not see it.
pub(super) fn picture(
    width: i32,
    height: i32,
    description: &str,
    draw: impl FnOnce(&Sheet<'_>) -> Drawn,
) -> Svg {
    let mut inside = String::new();
    let drawn = {
        let backend = SvgBackend::new(&mut inside, (px(width) as u32, px(height) as u32));
        let sheet = backend.into_drawing_area();
        draw(&sheet).and_then(|()| sheet.present())
    };
    if drawn.is_err() {
        // The backend cannot fail, and sheets are not shared: leave what was drawn so far.
        inside.push_str("<!-- incomplete -->");
    }
    Svg(format!(
        "<svg{NAMESPACE} width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {} {}\" {ATTRIBUTES} role=\"img\" aria-label=\"{}\">\n{inside}</svg>\n",
        px(width),
        px(height),
        escaped(description),
    ))
}
