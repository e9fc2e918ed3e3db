//! Artefacts of cameras and files: samples of markers that are no measurements are found and removed.

use crate::marker_settings::MarkerSettings;
use crate::recording::MarkerRecording;
use phiw_spikes::find_spikes;
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
    /// The marker never moves by a bit, but for spikes, while others do.
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

impl MarkerRecording {
    /// Takes samples of these markers that are no measurements for missing ones, and says which; markers are
    /// indices of labels.
    ///
    /// Frozen markers stay where they are [most](MarkerSettings::still_share) of all.
    pub fn remove_artefacts(&mut self, markers: &[usize], settings: &MarkerSettings) -> Vec<Artefact> {
        let zeros: Vec<Option<Artefact>> = markers
            .iter()
            .map(|&marker| {
                let frames = self.frames_where(marker, |position| position == [0.0; 3]);
                self.take_out(marker, ArtefactKind::Zero, &frames)
            })
            .collect();
        let frozen = self.frozen(markers, settings);
        let still = self.is_still(markers, settings);
        let mut artefacts = Vec::new();
        for (&marker, zeros) in markers.iter().zip(zeros) {
            artefacts.extend(zeros);
            let (kind, frames) = if frozen.contains(&marker) && !still {
                (ArtefactKind::Frozen, self.frames_where(marker, |_| true))
            } else {
                (ArtefactKind::Spike, self.spikes(marker, settings))
            };
            artefacts.extend(self.take_out(marker, kind, &frames));
        }
        artefacts
    }

    /// Whether [most](MarkerSettings::still_share) of those of these markers that are seen are frozen.
    pub fn is_still(&self, markers: &[usize], settings: &MarkerSettings) -> bool {
        let frozen = self.frozen(markers, settings).len();
        let seen = markers.iter().filter(|&&marker| self.is_ever_seen(marker)).count();
        frozen > 0 && frozen as f64 >= settings.still_share * seen as f64
    }

    /// Which of these markers are [frozen](MarkerSettings::frozen_share). One frame alone says nothing.
    pub fn frozen(&self, markers: &[usize], settings: &MarkerSettings) -> Vec<usize> {
        let is_frozen = |&marker: &usize| {
            let seen = self.frames_where(marker, |_| true);
            let most = self.frames_at_one_place(marker);
            seen.len() > 1 && most as f64 > settings.frozen_share * seen.len() as f64
        };
        markers.iter().copied().filter(is_frozen).collect()
    }

    /// In how many frames a marker is at one and the same place, if it is there in more than half of the
    /// frames that show it; else a number that is no more than half.
    fn frames_at_one_place(&self, marker: usize) -> usize {
        // Boyer and Moore's vote: the place of the majority, if there is one.
        let (mut place, mut votes) = ([f64::NAN; 3], 0_usize);
        for frame in self.frames_where(marker, |_| true) {
            let position = self.position_m(frame, marker);
            if votes == 0 {
                place = position;
            }
            votes = if position == place { votes + 1 } else { votes - 1 };
        }
        self.frames_where(marker, |position| position == place).len()
    }

    /// Frames that show a marker, and show it so.
    fn frames_where(&self, marker: usize, so: impl Fn([f64; 3]) -> bool) -> Vec<usize> {
        (0..self.frames())
            .filter(|&frame| {
                let position = self.position_m(frame, marker);
                position[0].is_finite() && so(position)
            })
            .collect()
    }

    /// Frames in which a coordinate of a marker is far off.
    fn spikes(&self, marker: usize, settings: &MarkerSettings) -> Vec<usize> {
        let mut frames: Vec<usize> = (0..3)
            .flat_map(|axis| {
                let samples: Vec<f64> =
                    (0..self.frames()).map(|frame| self.position_m(frame, marker)[axis]).collect();
                find_spikes(&samples, settings.spikes)
            })
            .collect();
        frames.sort_unstable();
        frames.dedup();
        frames
    }

    /// Takes these frames of a marker, in order, as not seen.
    fn take_out(&mut self, marker: usize, kind: ArtefactKind, frames: &[usize]) -> Option<Artefact> {
        let markers = self.labels.len();
        frames.iter().for_each(|frame| self.positions_m[frame * markers + marker] = [f64::NAN; 3]);
        let first = frames.first()?;
        let marker = self.labels[marker].clone();
        Some(Artefact { marker, kind, samples: frames.len(), first_frame: first + 1 })
    }

    /// The diagonal of the box around those of these markers that a frame shows, at least four: the median
    /// over the frames \[m\]. None without such a frame.
    pub fn extent_m(&self, markers: &[usize]) -> Option<f64> {
        let diagonal = |frame: &[[f64; 3]]| {
            let seen =
                || markers.iter().map(|&marker| frame[marker]).filter(|position| position[0].is_finite());
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
