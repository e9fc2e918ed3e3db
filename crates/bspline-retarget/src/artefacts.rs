//! What cameras and files do to markers: samples that are no measurements, found and taken out.

use crate::recording::MarkerRecording;
use phiw_spikes::{SpikeSettings, find_spikes};
use std::collections::BTreeMap;
use std::fmt;

/// Samples of a marker that were taken out.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Artefact {
    /// The marker's label.
    pub marker: String,
    /// What they are.
    pub kind: ArtefactKind,
    /// How many.
    pub samples: usize,
    /// The frame of the first, counted from 1.
    pub first_frame: usize,
}

/// What a sample is that is no measurement.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum ArtefactKind {
    /// Exactly 0, 0, 0: what software writes where a marker was not seen.
    Zero,
    /// Far off for a few frames.
    Spike,
    /// The marker never moves by a bit, while others do.
    Frozen,
}

impl fmt::Display for Artefact {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Artefact { marker, samples, first_frame, kind } = self;
        let what = match kind {
            ArtefactKind::Zero => "at exactly 0, 0, 0",
            ArtefactKind::Spike => "far off",
            ArtefactKind::Frozen => "frozen at one place while others move",
        };
        write!(f, "marker `{marker}` is {what} in {samples} frames (first {first_frame}): taken as not seen")
    }
}

/// What is far off for a marker: by more than 50 mm, too. Where markers rest, cameras' glitches of a few millimetres are many times what is usual
/// there, and do no harm. None of 144 recordings of `ue_adl` has a spike by this (`cargo test -p phiw-bspline-retarget --test c3d`).
pub fn marker_spikes() -> SpikeSettings {
    SpikeSettings { smallest: 0.05, ..SpikeSettings::default() }
}

impl MarkerRecording {
    /// Takes samples that are no measurements for missing ones, and says which.
    pub fn remove_artefacts(&mut self, settings: SpikeSettings) -> Vec<Artefact> {
        let mut found: BTreeMap<(usize, ArtefactKind), (usize, usize)> = BTreeMap::new();
        let markers = self.labels.len().max(1);
        let mut remove = |place: usize, kind: ArtefactKind, positions: &mut [[f64; 3]]| {
            let (frame, marker) = (place / markers, place % markers);
            let (samples, first) = found.entry((marker, kind)).or_insert((0, frame + 1));
            *samples += 1;
            *first = (*first).min(frame + 1);
            positions[place] = [f64::NAN; 3];
        };
        for place in 0..self.positions_m.len() {
            if self.positions_m[place] == [0.0; 3] {
                remove(place, ArtefactKind::Zero, &mut self.positions_m);
            }
        }
        let range = |marker: usize| self.range_m(marker);
        let ranges: Vec<f64> = (0..self.labels.len()).map(range).collect();
        // One frame, or a person who stands still in a synthetic file, says nothing.
        let others_move = ranges.iter().filter(|range| **range > 0.0).count() > self.labels.len() / 2;
        for (marker, range) in ranges.into_iter().enumerate() {
            let places = (marker..self.positions_m.len()).step_by(markers);
            if range == 0.0 && others_move {
                let seen: Vec<usize> =
                    places.filter(|&place| self.positions_m[place][0].is_finite()).collect();
                seen.into_iter().for_each(|place| remove(place, ArtefactKind::Frozen, &mut self.positions_m));
                continue;
            }
            let mut spikes: Vec<usize> = (0..3)
                .flat_map(|axis| {
                    let samples: Vec<f64> =
                        places.clone().map(|place| self.positions_m[place][axis]).collect();
                    find_spikes(&samples, settings)
                })
                .collect();
            spikes.sort_unstable();
            spikes.dedup();
            for frame in spikes {
                remove(frame * markers + marker, ArtefactKind::Spike, &mut self.positions_m);
            }
        }
        let artefact = |((marker, kind), (samples, first_frame)): ((usize, _), _)| Artefact {
            marker: self.labels[marker].clone(),
            kind,
            samples,
            first_frame,
        };
        found.into_iter().map(artefact).collect()
    }

    /// The largest extent of a marker's way along an axis \[m\]; NaN if it is never seen.
    fn range_m(&self, marker: usize) -> f64 {
        let mut most = f64::NAN;
        for axis in 0..3 {
            let positions = self.positions_m.iter().skip(marker).step_by(self.labels.len().max(1));
            let mut range = [f64::INFINITY, f64::NEG_INFINITY];
            for position in positions.filter(|position| position[0].is_finite()) {
                range = [range[0].min(position[axis]), range[1].max(position[axis])];
            }
            if range[0] <= range[1] {
                most = most.max(range[1] - range[0]);
            }
        }
        most
    }

    /// The diagonal of the box around all markers that a frame shows, at least four: the median over the frames \[m\]. None without such a frame.
    pub fn extent_m(&self) -> Option<f64> {
        let diagonal = |frame: &[[f64; 3]]| {
            let seen = || frame.iter().filter(|position| position[0].is_finite());
            let side = |axis: usize| {
                let (low, high) = seen().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), position| {
                    (low.min(position[axis]), high.max(position[axis]))
                });
                high - low
            };
            (seen().count() >= 4).then(|| (side(0).powi(2) + side(1).powi(2) + side(2).powi(2)).sqrt())
        };
        let frames = self.positions_m.chunks_exact(self.labels.len().max(1));
        let mut diagonals: Vec<f64> = frames.filter_map(diagonal).collect();
        diagonals.sort_by(f64::total_cmp);
        diagonals.get(diagonals.len() / 2).copied()
    }
}
