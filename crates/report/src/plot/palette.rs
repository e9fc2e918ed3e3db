//! The colours of pictures and page, once: each has a role, a light and a dark form.

use plotters::style::RGBColor;
use std::fmt::Write;

/// A colour by its role.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Colour {
    name: &'static str,
    light: u32,
    dark: u32,
}

impl Colour {
    pub(super) fn rgb(self) -> RGBColor {
        RGBColor((self.light >> 16) as u8, (self.light >> 8) as u8, self.light as u8)
    }
}

const fn colour(name: &'static str, light: u32, dark: u32) -> Colour {
    Colour { name, light, dark }
}

pub(super) const INK: Colour = colour("ink", 0x1F2933, 0xE4E7EB);
pub(super) const MUTED: Colour = colour("muted", 0x616E7C, 0x9AA5B1);
pub(super) const GRID: Colour = colour("grid", 0xE1E5EA, 0x323F4B);
pub(super) const ZERO: Colour = colour("zero", 0xB8C1CC, 0x52606D);
pub(super) const MEASURED: Colour = colour("measured", 0x52606D, 0xCBD2D9);
pub(super) const PREDICTED: Colour = colour("predicted", 0xD9480F, 0xFF9354);
pub(super) const RESIDUAL: Colour = colour("residual", 0x1864AB, 0x74B3F0);
pub(super) const BEFORE: Colour = colour("before", 0x9BA7B4, 0x76828F);
pub(super) const NOISE: Colour = colour("noise", 0x2B8A3E, 0x69DB7C);
const PURPLE: Colour = colour("purple", 0x7048E8, 0xB197FC);
const PINK: Colour = colour("pink", 0xC2255C, 0xF783AC);
const BACKGROUND: Colour = colour("background", 0xFFFFFF, 0x14191F);
const SURFACE: Colour = colour("surface", 0xF5F7FA, 0x1C232B);
const WARNING: Colour = colour("warning", 0x8A5A00, 0xF0C060);

const ALL: [Colour; 14] = [
    INK, MUTED, GRID, ZERO, MEASURED, PREDICTED, RESIDUAL, BEFORE, NOISE, PURPLE, PINK, BACKGROUND, SURFACE,
    WARNING,
];

/// The colour of the `index`th of several equal series; told apart by colour-blind readers up to the fifth.
pub(super) fn series(index: usize) -> Colour {
    const SERIES: [Colour; 6] = [RESIDUAL, PREDICTED, NOISE, PURPLE, MEASURED, PINK];
    SERIES[index % SERIES.len()]
}

/// Style sheet: each colour as a variable, dark where the reader's screen is, and pictures bound to them.
///
/// Pictures carry their light colours as attributes, which any style rule overrides.
pub(crate) fn css() -> String {
    let mut css = String::from(":root{");
    for Colour { name, light, .. } in ALL {
        let _ = write!(css, "--{name}:#{light:06x};");
    }
    css.push_str("}\n@media screen and (prefers-color-scheme:dark){:root{");
    for Colour { name, dark, .. } in ALL {
        let _ = write!(css, "--{name}:#{dark:06x};");
    }
    css.push_str("}}\n");
    for Colour { name, light, .. } in ALL {
        let _ = writeln!(
            css,
            "svg [fill=\"#{light:06x}\"]{{fill:var(--{name})}}svg [stroke=\"#{light:06x}\"]{{stroke:var(--{name})}}"
        );
    }
    css
}
