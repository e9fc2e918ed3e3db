//! Pictures: each a function from plain slices to an [`Svg`].
//!
//! Every function accepts whatever it is given: numbers that are not finite, or beyond ±1e100, are left
//! out (a line breaks there); nothing to draw gives empty axes. Colours follow the page's light or dark
//! scheme when the picture stands in a [page](crate::page), and are the light ones when it stands alone.

mod axis;
mod box_plot;
mod canvas;
mod decimation;
mod error_growth;
mod iterations;
mod joint_bars;
mod motion_map;
mod palette;
mod panel;
mod residual_against_signal;
mod spectrum;
mod support_map;
mod svg_backend;
mod time_series;

pub use box_plot::{BoxGroup, BoxPlot, box_plot};
pub use canvas::Svg;
pub use decimation::{Decimator, LINE_POINTS, Polyline, decimate};
pub use error_growth::{ErrorGrowth, GrowthLine, error_growth};
pub use iterations::{IterationLine, Iterations, iterations};
pub use joint_bars::{BarGroup, JointBars, joint_bars};
pub use motion_map::{MapRow, MotionMap, motion_map};
pub use residual_against_signal::{ResidualAgainstSignal, residual_against_signal};
pub use spectrum::{SpectrumLine, SpectrumPlot, spectrum};
pub use support_map::{SupportMap, support_map};
pub use time_series::{ResidualPanel, SignalPanel, TorquePanel, residual_panel, signal_panel, torque_panel};

pub(crate) use palette::css as palette_css;

/// A line's samples; `x[i]` belongs to `y[i]`, and what one slice has more than the other is left out.
#[derive(Debug, Clone, Copy, Default)]
pub struct Line<'a> {
    /// Abscissae.
    pub x: &'a [f64],
    /// Ordinates. A NaN breaks the line: put one at each gap of a log.
    pub y: &'a [f64],
}

impl<'a> Line<'a> {
    /// The samples in pairs.
    pub fn points(self) -> impl Iterator<Item = (f64, f64)> + Clone + 'a {
        self.x.iter().copied().zip(self.y.iter().copied())
    }
}

impl<'a> From<&'a Polyline> for Line<'a> {
    fn from(polyline: &'a Polyline) -> Self {
        Line { x: &polyline.x, y: &polyline.y }
    }
}

/// Numbers that a picture can show.
fn drawable(value: f64) -> bool {
    value.abs() <= 1e100
}
