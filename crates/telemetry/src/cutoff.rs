//! A cut-off frequency from the data's own spectrum.

use crate::Survey;
use crate::spectrum::Spectrum;
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;
use std::fmt;

/// A cut-off for one joint of one log.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CutoffSuggestion {
    /// Name of the joint.
    pub joint: String,
    /// Place of its log among those surveyed.
    pub log: usize,
    /// The cut-off, in Hz.
    #[serde(with = "crate::any_number")]
    pub cutoff_hz: f64,
    /// What set it.
    pub bound: Bound,
}

/// What set a cut-off.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Bound {
    /// A higher one would let more noise into the acceleration than it saves of the signal.
    Noise,
    /// It is eight times the frequency below which all but a thousandth of the velocity's power lies:
    /// vibration above it is no motion of the rigid body.
    Motion,
    /// The sample rate allows no more.
    SampleRate,
    /// The segments are too short for less.
    Duration,
}

impl fmt::Display for Bound {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(match self {
            Bound::Noise => "noise",
            Bound::Motion => "eight times the motion's bandwidth",
            Bound::SampleRate => "sample rate",
            Bound::Duration => "segments' length",
        })
    }
}

/// Highest cut-off as a share of the sample rate.
pub(crate) const HIGHEST_SHARE: f64 = 0.2;
/// An error's power this many times the least is near it: when in doubt the cut-off is higher, since noise
/// averages out and bias does not.
const NEAR: f64 = 1.5;
/// An error of this share of the acceleration's power is as good as none.
const NEGLIGIBLE: f64 = 1e-6;
/// Share of the velocity's power that may lie above the motion's bandwidth.
const VELOCITY_SHARE_ABOVE: f64 = 1e-3;
/// Cut-off over the motion's bandwidth: above the five of Gautier, Janot and Vandanjon (2013), since
/// trapezoidal and minimum-jerk motions have corners that those still round.
pub(crate) const BANDWIDTHS: f64 = 8.0;

/// A cut-off for each joint of a log that moves.
pub(crate) fn suggest(survey: &Survey, log: usize) -> Vec<CutoffSuggestion> {
    let highest = HIGHEST_SHARE * survey.rate_hz();
    let longest = survey.segments.iter().map(|segment| segment.t_end - segment.t_start).fold(0.0, f64::max);
    let lowest = (LEAST_PERIODS / longest).min(highest);
    let moving = survey.joints.iter().enumerate().filter(|(_, joint)| joint.travel() > 0.0);
    let suggestion = |(index, joint): (usize, &crate::joint_survey::JointSurvey)| {
        let (cutoff, bound) = match survey.spectrum.windows {
            0 => (highest, Bound::SampleRate),
            _ => from_spectrum(&survey.spectrum, index),
        };
        let (cutoff_hz, bound) = match cutoff {
            c if c > highest => (highest, Bound::SampleRate),
            c if c < lowest => (lowest, Bound::Duration),
            c => (c, bound),
        };
        CutoffSuggestion { joint: joint.name.clone(), log, cutoff_hz, bound }
    };
    moving.map(suggestion).collect()
}

/// Periods of the cut-off that the longest segment must hold.
const LEAST_PERIODS: f64 = 10.0;

/// The highest cut-off whose expected error in the acceleration, signal taken away and noise let in, is near
/// the least.
///
/// Signal is what rises to twice the noise. The noise's density does not fall with frequency (it is a
/// position's, differentiated twice), so it is no more than the lowest density at any higher frequency; under
/// the signal it goes on as a white position noise would, with ω⁴.
fn from_spectrum(spectrum: &Spectrum, joint: usize) -> (f64, Bound) {
    let density = smoothed(&spectrum.acceleration[joint]);
    let bins = density.len();
    let (mut signal, mut noise) = (vec![0.0; bins], density.clone());
    let mut floor = (f64::INFINITY, bins);
    for bin in (1..bins).rev() {
        if density[bin] < floor.0 {
            floor = (density[bin], bin);
        }
        if density[bin] > 2.0 * floor.0 {
            noise[bin] = floor.0 * (bin as f64 / floor.1 as f64).powi(4);
            signal[bin] = density[bin] - noise[bin];
        }
    }
    noise[0] = 0.0;
    let velocity: Vec<f64> = (0..bins).map(|bin| signal[bin] / (bin.max(1) as f64).powi(2)).collect();

    let error = |cutoff: usize| -> f64 {
        (1..bins)
            .map(|bin| {
                let gain = gain(bin as f64 / cutoff as f64);
                signal[bin] * (1.0 - gain).powi(2) + noise[bin] * gain * gain
            })
            .sum()
    };
    let errors: Vec<f64> = (1..bins).map(error).collect();
    let least = errors.iter().copied().fold(f64::INFINITY, f64::min);
    let near = NEAR * (least + NEGLIGIBLE * signal.iter().sum::<f64>());
    let best = errors.iter().rposition(|&error| error <= near).map_or(bins, |index| index + 1);
    let highest = BANDWIDTHS * band(&velocity, VELOCITY_SHARE_ABOVE);
    let (bin, bound) = match best as f64 {
        best if best <= highest => (best, Bound::Noise),
        _ => (highest, Bound::Motion),
    };
    (bin * spectrum.resolution_hz, bound)
}

/// Gain of the low-pass, nearly, at a frequency relative to its cut-off.
fn gain(relative: f64) -> f64 {
    0.5 * (1.0 + (PI * (relative.clamp(0.6, 1.4) - 0.6) / 0.8).cos())
}

/// The bin above which no more than `share` of the power lies.
fn band(power: &[f64], share: f64) -> f64 {
    let total: f64 = power.iter().sum();
    let mut above = 0.0;
    let first_out = power.iter().rposition(|power| {
        above += power;
        above > share * total
    });
    first_out.map_or(0, |bin| bin + 1) as f64
}

/// Means over neighbouring bins, wider at higher frequency: the variance of a single bin is as large as its
/// mean.
fn smoothed(density: &[f64]) -> Vec<f64> {
    let mut sums = vec![0.0];
    density.iter().for_each(|x| sums.push(sums[sums.len() - 1] + x));
    (0..density.len())
        .map(|bin| {
            let reach = 1 + bin / 10;
            let (from, to) = (bin.saturating_sub(reach), (bin + reach + 1).min(density.len()));
            (sums[to] - sums[from]) / (to - from) as f64
        })
        .collect()
}
