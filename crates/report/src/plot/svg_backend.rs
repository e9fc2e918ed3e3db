//! A plotters backend that writes small SVG.
//!
//! The one that comes with plotters writes one element a shape in whole pixels; a report of 18 joints
//! would be tens of megabytes, with visible steps. This one works in tenths of a pixel, writes relative
//! coordinates, and joins consecutive shapes of one style into one path.

use plotters_backend::text_anchor::{HPos, VPos};
use plotters_backend::{
    BackendColor, BackendCoord, BackendStyle, BackendTextStyle, DrawingBackend, DrawingErrorKind,
};
use std::convert::Infallible;
use std::fmt::Write;

/// Units of the picture's coordinates in a CSS pixel.
pub(super) const UNITS_PER_PIXEL: i32 = 10;

/// What all shapes and words of a picture share: round ends (a dot is a line of no length) and the font.
pub(super) const ATTRIBUTES: &str =
    "stroke-linecap=\"round\" stroke-linejoin=\"round\" font-family=\"sans-serif\" font-size=\"120\"";
/// Size of all words, as in [`ATTRIBUTES`], in CSS pixels.
pub(super) const TEXT_PIXELS: i32 = 12;

type Drawn = Result<(), DrawingErrorKind<Infallible>>;

/// Writes the inside of an `<svg>` element to `out`; complete after `present`. The element itself carries
/// [`ATTRIBUTES`] for all that is in it.
pub(super) struct SvgBackend<'a> {
    out: &'a mut String,
    size: (u32, u32),
    /// Attributes of the path that is being joined, and its data.
    style: String,
    data: String,
}

impl<'a> SvgBackend<'a> {
    pub(super) fn new(out: &'a mut String, size: (u32, u32)) -> Self {
        Self { out, size, style: String::new(), data: String::new() }
    }

    fn flush(&mut self) {
        if !self.data.is_empty() {
            let _ = writeln!(self.out, "<path {} d=\"{}\"/>", self.style, self.data);
            self.data.clear();
        }
    }

    /// Adds to the path of this style, or begins it.
    fn path(&mut self, style: String) -> &mut String {
        if style != self.style {
            self.flush();
            self.style = style;
        }
        &mut self.data
    }

    fn polyline(&mut self, style: String, points: impl IntoIterator<Item = BackendCoord>, close: bool) {
        let data = self.path(style);
        let mut last: Option<BackendCoord> = None;
        for (x, y) in points {
            match last {
                None => {
                    let _ = write!(data, "M{x} {y}l");
                }
                Some((last_x, last_y)) => {
                    let (dx, dy) = (x - last_x, y - last_y);
                    // A minus separates numbers as well as a space does.
                    if dx >= 0 && !data.ends_with('l') {
                        data.push(' ');
                    }
                    let _ = write!(data, "{dx}");
                    if dy >= 0 {
                        data.push(' ');
                    }
                    let _ = write!(data, "{dy}");
                }
            }
            last = Some((x, y));
        }
        if data.ends_with('l') {
            // A single point: a line of no length, which round caps make a dot.
            data.push_str("0 0");
        }
        if close && last.is_some() {
            data.push('z');
        }
    }
}

fn stroke(color: BackendColor, width: u32) -> String {
    let opacity = opacity("stroke-opacity", color);
    format!("fill=\"none\" stroke=\"{}\" stroke-width=\"{width}\"{opacity}", hex(color))
}

fn fill(color: BackendColor) -> String {
    format!("fill=\"{}\"{}", hex(color), opacity("fill-opacity", color))
}

fn hex(color: BackendColor) -> String {
    let (r, g, b) = color.rgb;
    format!("#{r:02x}{g:02x}{b:02x}")
}

fn opacity(attribute: &str, color: BackendColor) -> String {
    if color.alpha < 1.0 { format!(" {attribute}=\"{:.2}\"", color.alpha) } else { String::new() }
}

fn escape(out: &mut String, text: &str) {
    for c in text.chars() {
        match c {
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '&' => out.push_str("&amp;"),
            '"' => out.push_str("&quot;"),
            // XML has no place for these, escaped or not.
            c if c.is_control() => out.push(' '),
            '\u{FFFE}' | '\u{FFFF}' => out.push(' '),
            c => out.push(c),
        }
    }
}

/// `text` as it can stand in an attribute.
pub(super) fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    escape(&mut out, text);
    out
}

impl DrawingBackend for SvgBackend<'_> {
    type ErrorType = Infallible;

    fn get_size(&self) -> (u32, u32) {
        self.size
    }

    fn ensure_prepared(&mut self) -> Drawn {
        Ok(())
    }

    fn present(&mut self) -> Drawn {
        self.flush();
        Ok(())
    }

    fn draw_pixel(&mut self, (x, y): BackendCoord, color: BackendColor) -> Drawn {
        let _ = write!(self.path(fill(color)), "M{x} {y}h1v1h-1z");
        Ok(())
    }

    fn draw_line<S: BackendStyle>(&mut self, from: BackendCoord, to: BackendCoord, style: &S) -> Drawn {
        self.polyline(stroke(style.color(), style.stroke_width()), [from, to], false);
        Ok(())
    }

    fn draw_rect<S: BackendStyle>(
        &mut self,
        (left, top): BackendCoord,
        (right, bottom): BackendCoord,
        style: &S,
        filled: bool,
    ) -> Drawn {
        let style = if filled { fill(style.color()) } else { stroke(style.color(), style.stroke_width()) };
        let (width, height) = (right - left, bottom - top);
        let _ = write!(self.path(style), "M{left} {top}h{width}v{height}h{}z", -width);
        Ok(())
    }

    fn draw_path<S: BackendStyle, I: IntoIterator<Item = BackendCoord>>(
        &mut self,
        path: I,
        style: &S,
    ) -> Drawn {
        self.polyline(stroke(style.color(), style.stroke_width()), path, false);
        Ok(())
    }

    fn fill_polygon<S: BackendStyle, I: IntoIterator<Item = BackendCoord>>(
        &mut self,
        path: I,
        style: &S,
    ) -> Drawn {
        self.polyline(fill(style.color()), path, true);
        Ok(())
    }

    fn draw_circle<S: BackendStyle>(
        &mut self,
        (x, y): BackendCoord,
        radius: u32,
        style: &S,
        filled: bool,
    ) -> Drawn {
        if filled {
            // A line of no length with round caps is a disc, in some ten bytes.
            let _ = write!(self.path(stroke(style.color(), 2 * radius)), "M{x} {y}h0");
        } else {
            let r = radius as i32;
            let data = self.path(stroke(style.color(), style.stroke_width()));
            let _ = write!(data, "M{} {y}a{r} {r} 0 1 0 {} 0a{r} {r} 0 1 0 {} 0", x - r, 2 * r, -2 * r);
        }
        Ok(())
    }

    fn draw_text<S: BackendTextStyle>(&mut self, text: &str, style: &S, (x, y): BackendCoord) -> Drawn {
        self.flush();
        let anchor = match style.anchor().h_pos {
            HPos::Left => "",
            HPos::Center => " text-anchor=\"middle\"",
            HPos::Right => " text-anchor=\"end\"",
        };
        let baseline = match style.anchor().v_pos {
            VPos::Top => y + (0.8 * style.size()) as i32,
            VPos::Center => y + (0.35 * style.size()) as i32,
            VPos::Bottom => y,
        };
        let _ = write!(self.out, "<text x=\"{x}\" y=\"{baseline}\"{anchor} {}>", fill(style.color()));
        escape(self.out, text);
        self.out.push_str("</text>\n");
        Ok(())
    }
}
