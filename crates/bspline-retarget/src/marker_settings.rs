//! Which samples of markers are no measurements of a person's motion.

use phiw_spikes::SpikeSettings;
use std::ops::RangeInclusive;

/// Which samples of markers are taken for no measurements.
#[derive(Clone, Debug, PartialEq)]
pub struct MarkerSettings {
    /// What is far off for a coordinate of a marker \[m\]. Where markers rest, cameras' glitches of a few
    /// millimetres are many times what is usual there, and do no harm: only what is off by more than 50 mm
    /// counts.
    pub spikes: SpikeSettings,
    /// A marker is frozen if it is at one and the same place, to the last bit, in more than this share of the
    /// frames that show it (0.5 to 1). The rest may be spikes. No marker of 148 real recordings is at one
    /// place in half of its frames.
    pub frozen_share: f64,
    /// Where this share of the markers or more is frozen (0 to 1), a recording that hangs cannot be
    /// distinguished from a person who stands still: the markers are kept, and the recording is refused as no
    /// motion.
    pub still_share: f64,
    /// How large the box around a person's markers is, from corner to corner \[m\]: those of one arm alone,
    /// and those of the tallest with arms stretched.
    pub person_m: RangeInclusive<f64>,
}

impl Default for MarkerSettings {
    /// Of 144 recordings of `ue_adl` and four with gaps these take out two samples of one, where two markers
    /// change places (`cargo test -p phiw-bspline-retarget --test artefacts`).
    fn default() -> Self {
        MarkerSettings {
            spikes: SpikeSettings { smallest: 0.05, ..SpikeSettings::default() },
            frozen_share: 0.9,
            still_share: 0.5,
            person_m: 0.2..=4.0,
        }
    }
}
