//! Spectra on logarithmic axes, with the filter's cut-off.

use super::Line;
use super::axis::{Axis, log10};
use super::canvas::{Svg, WIDTH, picture};
use super::decimation::{LINE_POINTS, decimate};
use super::palette::{MUTED, series};
use super::panel::{Legend, Mark, line, panel, stroke};

/// One signal's spectrum.
#[derive(Debug, Clone, Copy)]
pub struct SpectrumLine<'a> {
    /// The signal's name for the legend.
    pub name: &'a str,
    /// Frequency (Hz) and amplitude or density; what is not positive is left out.
    pub line: Line<'a>,
}

/// What [`spectrum`] shows.
#[derive(Debug, Clone, Copy)]
pub struct SpectrumPlot<'a> {
    /// The spectra, told apart by colour up to six.
    pub lines: &'a [SpectrumLine<'a>],
    /// The quantity, with its unit: `torque [N·m/√Hz]`.
    pub y_label: &'a str,
    /// The low-pass filter's cut-off (Hz), an upright line.
    pub cut_off: Option<f64>,
}

/// Spectra over frequency, both axes logarithmic.
pub fn spectrum(input: &SpectrumPlot<'_>) -> Svg {
    let cut_off = input.cut_off.filter(|&f| super::drawable(f) && f > 0.0);
    let shown: Vec<(Vec<f64>, Vec<f64>)> = input
        .lines
        .iter()
        .map(|signal| signal.line.points().filter(|&(f, a)| f > 0.0 && a > 0.0).unzip())
        .collect();
    let frequencies = shown.iter().flat_map(|(f, _)| f.iter().copied()).chain(cut_off);
    let x = Axis::logarithmic("f [Hz]", frequencies);
    let y = Axis::logarithmic(input.y_label, shown.iter().flat_map(|(_, a)| a.iter().copied()));
    let mut legend: Vec<_> = input
        .lines
        .iter()
        .enumerate()
        .map(|(index, signal)| Legend(signal.name, Mark::Line, series(index)))
        .collect();
    if cut_off.is_some() {
        legend.push(Legend("cut-off", Mark::Line, MUTED));
    }
    picture(WIDTH, 220, &format!("spectrum of {}", input.y_label), |sheet| {
        let plot = panel(sheet, &x, &y, &legend)?;
        if let Some(cut_off) = cut_off.map(log10) {
            line(&plot, [(cut_off, y.range.0), (cut_off, y.range.1)], stroke(MUTED, 15))?;
        }
        for (index, (frequency, amplitude)) in shown.iter().enumerate() {
            let frequency: Vec<f64> = frequency.iter().copied().map(log10).collect();
            let amplitude: Vec<f64> = amplitude.iter().copied().map(log10).collect();
            let thinned = decimate(&frequency, &amplitude, LINE_POINTS);
            line(&plot, Line::from(&thinned).points(), stroke(series(index), 12))?;
        }
        Ok(())
    })
}
