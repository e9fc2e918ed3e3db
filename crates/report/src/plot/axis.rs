//! Where an axis begins and ends and what is written at its ticks.

use super::drawable;
use crate::number;

/// One axis of a panel.
#[derive(Debug, Clone)]
pub(super) struct Axis {
    /// What it shows, with its unit.
    pub(super) label: String,
    /// From, to; `from < to`.
    pub(super) range: (f64, f64),
    /// Positions and labels of the ticks, inside the range.
    pub(super) ticks: Vec<(f64, String)>,
    /// Whether the ticks are names rather than numbers; they have no lines of the grid.
    pub(super) names: bool,
}

impl Axis {
    /// An axis that shows all the `values`, with a little air if `padded`, and about so many ticks.
    pub(super) fn linear(
        label: impl Into<String>,
        values: impl IntoIterator<Item = f64>,
        padded: bool,
        tick_count: usize,
    ) -> Self {
        let (low, high) = extent(values);
        let (low, high) = if padded && low < high {
            let air = 0.06 * (high - low);
            (low - air, high + air)
        } else {
            (low, high)
        };
        let range = snapped(widened(low, high), tick_count);
        Self { label: label.into(), range, ticks: linear_ticks(range, tick_count), names: false }
    }

    /// An axis from 0 to a little over the largest of the `values`.
    pub(super) fn from_zero(
        label: impl Into<String>,
        values: impl IntoIterator<Item = f64>,
        tick_count: usize,
    ) -> Self {
        let (_, high) = extent(values.into_iter().chain([0.0]));
        let range = widened(0.0, if high > 0.0 { 1.08 * high } else { 1.0 });
        Self { label: label.into(), range, ticks: linear_ticks(range, tick_count), names: false }
    }

    /// A logarithmic axis: positions are log₁₀ of the values; those that are not positive do not count.
    pub(super) fn logarithmic(label: impl Into<String>, values: impl IntoIterator<Item = f64>) -> Self {
        let (low, high) = extent(values.into_iter().map(log10));
        let (low, high) = if low > high { (0.0, 1.0) } else { (low, high) };
        let (mut low, mut high) = (low - 0.02, high + 0.02);
        if high - low < 1.0 {
            (low, high) = between_round_values((low, high));
        }
        let (first, last) = (low.ceil() as i32, high.floor() as i32);
        let ticks = if last - first < 2 { few_decades((low, high)) } else { decades(first, last) };
        Self { label: label.into(), range: (low, high), ticks, names: false }
    }

    /// An axis of named places 0, 1, … Labels are left out evenly where there is no room for `room` of them.
    pub(super) fn categories(label: impl Into<String>, names: &[String], room: usize) -> Self {
        let stride = names.len().div_ceil(room.max(1)).max(1);
        Self {
            label: label.into(),
            range: (-0.5, names.len().max(1) as f64 - 0.5),
            ticks: names
                .iter()
                .enumerate()
                .step_by(stride)
                .map(|(place, name)| (place as f64, name.clone()))
                .collect(),
            names: true,
        }
    }
}

/// Whole decades, evenly left out where there are many.
fn decades(first: i32, last: i32) -> Vec<(f64, String)> {
    let stride = ((last - first) / 7 + 1) as usize;
    (first..=last).step_by(stride).map(|exponent| (f64::from(exponent), number::decade(exponent))).collect()
}

/// 1, 2 and 5 times the decades inside a range that has hardly two.
fn few_decades((low, high): (f64, f64)) -> Vec<(f64, String)> {
    (low.floor() as i32..=high.ceil() as i32)
        .flat_map(|exponent| [1.0, 2.0, 5.0].map(|multiple| multiple * 10f64.powi(exponent)))
        .map(|value| (value.log10(), number::tick(value, 10f64.powf(value.log10().floor()))))
        .filter(|(position, _)| (low..=high).contains(position))
        .collect()
}

/// The nearest of 1, 2 and 5 times the decades below and above a range, so that a narrow one has ticks and is
/// not lost between whole decades.
fn between_round_values((low, high): (f64, f64)) -> (f64, f64) {
    let round = || {
        let exponents = low.floor() as i32..=high.ceil() as i32;
        exponents
            .flat_map(|exponent| [1.0, 2.0, 5.0].map(|multiple| (multiple * 10f64.powi(exponent)).log10()))
    };
    let below = round().filter(|value| *value <= low).fold(low.floor(), f64::max);
    let above = round().filter(|value| *value >= high).fold(high.ceil(), f64::min);
    (below, above)
}

/// log₁₀, NaN where there is none.
pub(super) fn log10(value: f64) -> f64 {
    if value > 0.0 { value.log10() } else { f64::NAN }
}

/// Smallest and largest of the drawable values; (∞, −∞) if there are none.
fn extent(values: impl IntoIterator<Item = f64>) -> (f64, f64) {
    values
        .into_iter()
        .filter(|&value| drawable(value))
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)))
}

/// A range that can be drawn: one of no width, or none at all, is given some.
fn widened(low: f64, high: f64) -> (f64, f64) {
    if low > high {
        return (0.0, 1.0);
    }
    let magnitude = low.abs().max(high.abs());
    if high - low > 1e-9 * magnitude && high - low > 1e-100 {
        return (low, high);
    }
    let half = if magnitude > 1e-90 { 0.5 * magnitude } else { 1.0 };
    (low - half, high + half)
}

/// The range with an end that all but reaches a tick moved onto it.
fn snapped((low, high): (f64, f64), count: usize) -> (f64, f64) {
    let step = tick_step((low, high), count);
    let slack = 0.01 * (high - low);
    let (below, above) = ((low / step).floor() * step, (high / step).ceil() * step);
    (if low - below < slack { below } else { low }, if above - high < slack { above } else { high })
}

/// 1, 2 or 5 times a power of ten that gives about `count` ticks.
fn tick_step((low, high): (f64, f64), count: usize) -> f64 {
    let raw = (high - low) / count.max(1) as f64;
    let decade = 10f64.powf(raw.log10().floor());
    [1.0, 2.0, 5.0, 10.0]
        .into_iter()
        .map(|multiple| multiple * decade)
        .min_by(|a, b| (a / raw).ln().abs().total_cmp(&(b / raw).ln().abs()))
        .unwrap_or(raw)
}

fn linear_ticks((low, high): (f64, f64), count: usize) -> Vec<(f64, String)> {
    let step = tick_step((low, high), count);
    // A tick at the very end of the range may fall outside by rounding.
    let (first, last) = ((low / step - 1e-9).ceil(), (high / step + 1e-9).floor());
    let mut ticks = Vec::new();
    let mut multiple = first;
    while multiple <= last && ticks.len() <= 4 * count {
        ticks.push((multiple * step, number::tick(multiple * step, step)));
        multiple += 1.0;
    }
    ticks
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn labels_are_what_a_person_would_write() {
        let labels =
            |axis: Axis| axis.ticks.into_iter().map(|(_, label)| label).collect::<Vec<_>>().join(" ");
        for (values, expected) in [
            ([0.0, 1.0], "0 0.2 0.4 0.6 0.8 1.0"),
            ([-0.31, 0.29], "−0.3 −0.2 −0.1 0 0.1 0.2"),
            ([3.0, 3.0], "1.5 2.0 2.5 3.0 3.5 4.0 4.5"),
            ([0.0, 60.2], "0 10 20 30 40 50 60"),
            ([f64::NAN, f64::INFINITY], "0 0.2 0.4 0.6 0.8 1.0"),
        ] {
            assert_eq!(labels(Axis::linear("", values, false, 6)), expected, "{values:?}");
        }
        assert_eq!(labels(Axis::logarithmic("", [0.02, 300.0, 0.0])), "0.1 1 10 100");
        assert_eq!(labels(Axis::logarithmic("", [66.0, 900.0])), "100 200 500");
        assert_eq!(labels(Axis::logarithmic("", [3300.0, 6400.0])), "2000 5000 10000");
        assert_eq!(labels(Axis::logarithmic("", [7.0])), "5 10");
        assert_eq!(labels(Axis::logarithmic("", [])), "1 2 5 10");
    }

    proptest! {
        #[test]
        fn ticks_lie_inside_and_rise(low in -1e6..1e6f64, span in prop_oneof![Just(0.0), 1e-6..1e6f64, 1e50..1e99f64]) {
            let axis = Axis::linear("", [low, low + span], true, 6);
            prop_assert!(axis.range.0 < axis.range.1);
            prop_assert!((2..=13).contains(&axis.ticks.len()), "{:?}", axis);
            prop_assert!(axis.ticks.is_sorted_by(|a, b| a.0 < b.0));
            let slack = 1e-9 * (axis.range.1 - axis.range.0);
            prop_assert!(axis.ticks.iter().all(|t| t.0 >= axis.range.0 - slack && t.0 <= axis.range.1 + slack));
            let mut labels: Vec<_> = axis.ticks.iter().map(|t| &t.1).collect();
            labels.dedup();
            prop_assert_eq!(labels.len(), axis.ticks.len());
        }
    }
}
