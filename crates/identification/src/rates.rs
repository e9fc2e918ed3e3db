//! Rates of change of torques that are computed from smoothed motion.

use std::sync::{Arc, Mutex, OnceLock, PoisonError};

/// First and second rates by local polynomials of degree four, weighted towards the middle (Savitzky & Golay
/// 1964; Cleveland 1979).
///
/// A torque contains the acceleration already: two differences more would bring up what noise is left in it.
/// The window is as wide as the motion is slow, and at the ends it is one-sided, with the same degree.
pub(crate) struct LocalRates {
    windows: Arc<Windows>,
    /// Samples from one evaluation to the next; linear in between.
    stride: usize,
    period: f64,
}

/// The windows of one width, for samples one unit of time apart: those that are cut by an end are made when
/// they are asked for first, since every block of a log asks for them again.
pub(crate) struct Windows {
    /// Samples on one side of the middle one.
    half: usize,
    inner: Taps,
    /// With so many samples before the middle one as the place says, and all of those after it.
    cut: Vec<OnceLock<Taps>>,
}

/// [`Windows`] of all widths that were asked for.
#[derive(Default)]
pub(crate) struct WindowsByWidth(Mutex<Vec<Arc<Windows>>>);

/// Weights of the samples of a window for the two rates at one of them.
struct Taps {
    first: Vec<f64>,
    second: Vec<f64>,
}

/// Coefficients of a polynomial of degree four.
const TERMS: usize = 5;
/// Half-width of the window times the band's edge: there the value is down to about 70 %.
const HALF_WIDTH: f64 = 1.1;
/// Evaluations in a half window.
const EVALUATIONS: usize = 24;

impl WindowsByWidth {
    fn of_half_width(&self, half: usize) -> Arc<Windows> {
        let mut known = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(windows) = known.iter().find(|windows| windows.half == half) {
            return Arc::clone(windows);
        }
        let windows = Arc::new(Windows {
            half,
            inner: taps(-(half as isize)..half as isize + 1, half),
            cut: (0..half).map(|_| OnceLock::new()).collect(),
        });
        known.push(Arc::clone(&windows));
        windows
    }
}

impl LocalRates {
    /// For samples `period` \[s\] apart, of which what lies above `band_hz` is not wanted.
    pub fn new(period: f64, band_hz: f64, windows: &WindowsByWidth) -> Self {
        let half = ((HALF_WIDTH / (band_hz * period)).ceil() as usize).max(TERMS);
        LocalRates { windows: windows.of_half_width(half), stride: (half / EVALUATIONS).max(1), period }
    }

    /// Fills in both rates of rows of `width` values.
    pub fn apply(&self, width: usize, values: &[f64], first: &mut Vec<f64>, second: &mut Vec<f64>) {
        first.clear();
        second.clear();
        first.resize(values.len(), 0.0);
        second.resize(values.len(), 0.0);
        let samples = values.len() / width.max(1);
        if samples <= TERMS {
            return;
        }
        let half = self.windows.half;
        let (first_scale, second_scale) = (1.0 / self.period, (1.0 / self.period).powi(2));
        let mut before = None;
        let mut sample = 0_usize;
        loop {
            let (start, end) = (sample.saturating_sub(half), (sample + half + 1).min(samples));
            let (earlier, later) = (sample - start, end - 1 - sample);
            let short;
            // A window that is cut on the right is the mirror of one that is cut on the left.
            let (taps, is_mirror) = match (earlier == half, later == half) {
                (true, true) => (&self.windows.inner, false),
                (false, true) => (self.windows.cut(earlier), false),
                (true, false) => (self.windows.cut(later), true),
                (false, false) => {
                    short = taps(-(earlier as isize)..later as isize + 1, half);
                    (&short, false)
                }
            };
            let row = sample * width..(sample + 1) * width;
            let slope_scale = if is_mirror { -first_scale } else { first_scale };
            let of_rates =
                [(&mut *first, &taps.first, slope_scale), (&mut *second, &taps.second, second_scale)];
            for (rate, weights, scale) in of_rates {
                let rate = &mut rate[row.clone()];
                let rows = values[start * width..end * width].chunks_exact(width);
                let add = |(values, weight): (&[f64], &f64)| {
                    rate.iter_mut().zip(values).for_each(|(sum, value)| *sum += weight * scale * value);
                };
                match is_mirror {
                    false => rows.zip(weights).for_each(add),
                    true => rows.zip(weights.iter().rev()).for_each(add),
                }
            }
            if let Some(before) = before {
                interpolate(first, width, before, sample);
                interpolate(second, width, before, sample);
            }
            if sample == samples - 1 {
                return;
            }
            before = Some(sample);
            sample = (sample + self.stride).min(samples - 1);
        }
    }
}

impl Windows {
    /// The weights with so many samples before the middle one, and all of those after it.
    fn cut(&self, earlier: usize) -> &Taps {
        self.cut[earlier].get_or_init(|| taps(-(earlier as isize)..self.half as isize + 1, self.half))
    }
}

/// The weights for samples at `offsets` from the one where the rates are wanted, one unit of time apart: from
/// polynomials that are orthogonal on the window.
fn taps(offsets: std::ops::Range<isize>, half: usize) -> Taps {
    let scale = 1.0 / (half as f64 + 1.0);
    let places: Vec<f64> = offsets.map(|offset| offset as f64 * scale).collect();
    // Biweight. A one-sided window reaches as far as the whole one.
    let weights: Vec<f64> = places.iter().map(|place| (1.0 - place * place).powi(2)).collect();
    let evaluate =
        |polynomial: &[f64; TERMS], at: f64| polynomial.iter().rev().fold(0.0, |sum, c| sum * at + c);
    let mut taps = Taps { first: vec![0.0; places.len()], second: vec![0.0; places.len()] };
    let mut basis: Vec<[f64; TERMS]> = Vec::with_capacity(TERMS);
    let product = |a: &[f64; TERMS], b: &[f64; TERMS]| -> f64 {
        places.iter().zip(&weights).map(|(&at, weight)| weight * evaluate(a, at) * evaluate(b, at)).sum()
    };
    for degree in 0..TERMS {
        let mut polynomial = [0.0; TERMS];
        polynomial[degree] = 1.0;
        for _ in 0..2 {
            for other in &basis {
                let along = product(&polynomial, other);
                polynomial.iter_mut().zip(other).for_each(|(c, other)| *c -= along * other);
            }
        }
        let norm = product(&polynomial, &polynomial).sqrt();
        if norm <= f64::EPSILON {
            break;
        }
        polynomial.iter_mut().for_each(|c| *c /= norm);
        basis.push(polynomial);
        let slope = polynomial[1] * scale;
        let curvature = 2.0 * polynomial[2] * scale.powi(2);
        for (place, (&at, weight)) in places.iter().zip(&weights).enumerate() {
            let value = weight * evaluate(&polynomial, at);
            taps.first[place] += slope * value;
            taps.second[place] += curvature * value;
        }
    }
    taps
}

/// Fills in the rows between two that are known.
pub(crate) fn interpolate(values: &mut [f64], width: usize, first: usize, last: usize) {
    for sample in first + 1..last {
        let share = (sample - first) as f64 / (last - first) as f64;
        for column in 0..width {
            let (a, b) = (values[first * width + column], values[last * width + column]);
            values[sample * width + column] = a + share * (b - a);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{LocalRates, WindowsByWidth};

    /// A polynomial of degree four is differentiated exactly, at the ends too.
    #[test]
    fn polynomials_are_exact() {
        let period = 0.002;
        let rates = LocalRates::new(period, 3.0, &WindowsByWidth::default());
        let time = |sample: usize| sample as f64 * period - 0.7;
        let value = |t: f64| 0.3 - t + 2.0 * t * t + 0.5 * t.powi(3) - 0.8 * t.powi(4);
        let slope = |t: f64| -1.0 + 4.0 * t + 1.5 * t * t - 3.2 * t.powi(3);
        let curvature = |t: f64| 4.0 + 3.0 * t - 9.6 * t * t;
        let values: Vec<f64> = (0..700).map(|sample| value(time(sample))).collect();
        let (mut first, mut second) = (Vec::new(), Vec::new());
        rates.apply(1, &values, &mut first, &mut second);
        for sample in [0, rates.stride, 10 * rates.stride, 699 / rates.stride * rates.stride, 699] {
            let t = time(sample);
            assert!((first[sample] - slope(t)).abs() < 1e-7, "{} {}", first[sample], slope(t));
            assert!((second[sample] - curvature(t)).abs() < 1e-5, "{} {}", second[sample], curvature(t));
        }
    }

    /// A sine inside the band keeps its rates to a few percent, one far above it is gone.
    #[test]
    fn the_band_passes_and_the_rest_is_gone() {
        let (period, band) = (0.002, 3.0);
        let rates = LocalRates::new(period, band, &WindowsByWidth::default());
        let gain = |hz: f64| {
            let omega = 2.0 * std::f64::consts::PI * hz;
            let values: Vec<f64> = (0..2000).map(|sample| (omega * sample as f64 * period).sin()).collect();
            let (mut first, mut second) = (Vec::new(), Vec::new());
            rates.apply(1, &values, &mut first, &mut second);
            let largest = second[500..1500].iter().fold(0.0, |most: f64, rate| most.max(rate.abs()));
            largest / (omega * omega)
        };
        assert!((gain(0.3 * band) - 1.0).abs() < 0.03, "{}", gain(0.3 * band));
        assert!(gain(4.0 * band) < 0.02, "{}", gain(4.0 * band));
    }
}
