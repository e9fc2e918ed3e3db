//! Spikes in a log, found in the survey's pass and left out in the passes that follow.

use crate::LogError;
use crate::columns::Layout;
use crate::gap::GapReason;
use crate::histogram::Histogram;
use crate::reader::{Row, Rows};
use crate::segments::{RowCounts, SpikeCount};
use phiw_spikes::{SpikeSettings, WINDOW, bend, excursion, excursion_at_edge, spike_length};
use std::collections::VecDeque;
use std::path::Path;

/// What is usual in each column of a log, and the largest excursion: whether there are spikes.
pub(crate) struct SpikeFinder {
    columns: Vec<(Histogram, f64)>,
}

impl SpikeFinder {
    pub fn new(layout: &Layout) -> Self {
        SpikeFinder { columns: (0..layout.width).map(|_| (Histogram::new(), f64::NEG_INFINITY)).collect() }
    }

    /// The latest samples of a column, oldest first; `first` if they begin a segment.
    pub fn push(&mut self, place: usize, window: [f64; WINDOW], first: bool) {
        let (usual, most) = &mut self.columns[place];
        let bend = bend([window[1], window[2], window[3]]);
        if bend != 0.0 {
            usual.push(bend);
        }
        *most = most.max(excursion(&window).0);
        if first {
            *most = most.max(excursion_at_edge(&window).0);
        }
    }

    /// The last samples of a segment.
    pub fn end(&mut self, place: usize, mut window: [f64; WINDOW]) {
        let most = &mut self.columns[place].1;
        // Samples at the end of a segment, which `push` has not judged as too few samples follow them.
        for start in 1..WINDOW - 2 {
            *most = most.max(excursion(&window[start..]).0);
        }
        window.reverse();
        *most = most.max(excursion_at_edge(&window).0);
    }

    /// What an excursion of each place must exceed to be a spike, where any does; infinite where spikes are
    /// not looked for.
    pub fn bounds(&self, layout: &Layout, settings: SpikeSettings) -> Option<Vec<f64>> {
        let bound = |place: usize, (usual, _): &(Histogram, f64)| match place {
            // Stamps are checked where segments are split; a temperature is not fitted.
            0 => f64::INFINITY,
            place if layout.may_be_missing(place) => f64::INFINITY,
            _ => settings.bound(usual.total() as usize, |share| usual.quantile(share)),
        };
        let bounds: Vec<f64> =
            self.columns.iter().enumerate().map(|(place, column)| bound(place, column)).collect();
        self.columns.iter().zip(&bounds).any(|((_, most), bound)| most > bound).then_some(bounds)
    }

    /// By how much a sample of a column usually differs from the mean of its neighbours: the median, of those
    /// that do.
    pub fn median_bend(&self, place: usize) -> f64 {
        self.columns[place].0.quantile(0.5)
    }

    /// The largest excursion of each column but the time, as a multiple of what is usual; 0 where that is not
    /// known.
    pub fn multiples(&self, settings: SpikeSettings) -> Vec<f64> {
        self.columns
            .iter()
            .skip(1)
            .map(|(usual, most)| {
                let bound = settings.bound(usual.total() as usize, |share| usual.quantile(share));
                if bound.is_finite() && bound > 0.0 { settings.multiple * most.max(0.0) / bound } else { 0.0 }
            })
            .collect()
    }
}

/// Rows with spikes turned into gaps.
pub(crate) struct WithoutSpikes<R> {
    rows: R,
    bounds: Vec<f64>,
    /// Rows read ahead, oldest first; the samples among them are of one segment, and what ends it is last.
    ahead: VecDeque<Ahead>,
    /// Buffers to be used again.
    spare: Vec<Vec<f64>>,
    /// The last two samples that were no spikes, the later first.
    before: [Option<Vec<f64>>; 2],
    /// Spikes of each place, and the line of the first.
    counts: Vec<(u64, u64)>,
}

struct Ahead {
    row: Row,
    values: Vec<f64>,
    spike: bool,
}

impl<R: Rows> WithoutSpikes<R> {
    /// `bounds` as [`SpikeFinder::bounds`] gives them.
    pub fn new(rows: R, bounds: Vec<f64>) -> Self {
        let counts = vec![(0, 0); bounds.len()];
        WithoutSpikes {
            rows,
            bounds,
            ahead: VecDeque::new(),
            spare: Vec::new(),
            before: [None, None],
            counts,
        }
    }

    /// The rows without the filter.
    pub fn into_inner(self) -> R {
        self.rows
    }

    /// Where spikes were, by column.
    pub fn counts(&self, joints: &[String]) -> Vec<SpikeCount> {
        let counted = self.counts.iter().enumerate().filter(|(_, (samples, _))| *samples > 0);
        counted
            .map(|(place, &(samples, first_line))| SpikeCount {
                column: self.rows.layout().name(place, joints),
                samples,
                first_line,
            })
            .collect()
    }

    /// Reads on until a window is full or the segment ends.
    fn fill(&mut self) -> Result<(), LogError> {
        let ended = |ahead: &VecDeque<Ahead>| {
            ahead.back().is_some_and(|last| !matches!(last.row, Row::Sample { .. }))
        };
        while self.ahead.len() < WINDOW && !ended(&self.ahead) {
            let mut values = self.spare.pop().unwrap_or_else(|| vec![0.0; self.bounds.len()]);
            let row = self.rows.next(&mut values)?;
            self.ahead.push_back(Ahead { row, values, spike: false });
        }
        Ok(())
    }

    /// Marks the spikes that begin at the oldest row read ahead.
    fn mark(&mut self) {
        let samples = self.ahead.iter().take_while(|ahead| matches!(ahead.row, Row::Sample { .. })).count();
        for place in 0..self.bounds.len() {
            if self.bounds[place] == f64::INFINITY {
                continue;
            }
            let length = self.spike(place, samples);
            for ahead in self.ahead.iter_mut().take(length) {
                ahead.spike = true;
                if let Row::Sample { line } = ahead.row {
                    let (count, first) = &mut self.counts[place];
                    if *count == 0 {
                        *first = line;
                    }
                    *count += 1;
                }
            }
        }
    }
}

impl<R: Rows> WithoutSpikes<R> {
    /// How many of the `samples` read ahead are a spike of that place, from the oldest on.
    fn spike(&self, place: usize, samples: usize) -> usize {
        let mut ahead = [0.0; WINDOW];
        for (sample, place_ahead) in self.ahead.iter().zip(&mut ahead[..samples]) {
            *place_ahead = sample.values[place];
        }
        let before = self.before.each_ref().map(|values| values.as_ref().map(|values| values[place]));
        spike_length(before, &ahead[..samples], self.bounds[place])
    }
}

impl<R: Rows> Rows for WithoutSpikes<R> {
    fn layout(&self) -> &Layout {
        self.rows.layout()
    }

    fn next(&mut self, values: &mut [f64]) -> Result<Row, LogError> {
        self.fill()?;
        if self.ahead.front().is_some_and(|ahead| !ahead.spike && matches!(ahead.row, Row::Sample { .. })) {
            self.mark();
        }
        let Some(next) = self.ahead.pop_front() else { return Ok(Row::End) };
        values.copy_from_slice(&next.values);
        let row = match next.row {
            Row::Sample { line } if next.spike => {
                Row::Gap { line, reason: GapReason::Spike, t: Some(next.values[0]) }
            }
            row => row,
        };
        let emptied = match row {
            Row::Sample { .. } => {
                self.before.swap(0, 1);
                self.before[0].replace(next.values)
            }
            Row::Gap { reason: GapReason::Spike, .. } => Some(next.values),
            // A new segment starts: it is not compared with samples of the one before.
            _ => {
                self.spare.extend(self.before.iter_mut().filter_map(Option::take));
                Some(next.values)
            }
        };
        self.spare.extend(emptied);
        Ok(row)
    }

    fn progress(&self) -> (u64, u64) {
        self.rows.progress()
    }

    fn path(&self) -> &Path {
        self.rows.path()
    }

    fn account(&self, counts: &mut RowCounts) {
        self.rows.account(counts);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Conditioning, ConditioningOptions, Recording, TorqueColumns};
    use phiw_spikes::LONGEST;
    use proptest::prelude::*;
    use std::path::PathBuf;

    /// A signal of 1000 samples with a little noise, on a swing.
    fn swing(sample: usize) -> f64 {
        let noise = ((sample * 7919) % 101) as f64 / 101.0 - 0.5;
        (0.01 * sample as f64).sin() + 1e-3 * noise
    }

    fn recording(q: Vec<f64>) -> Recording {
        let t = (0..q.len()).map(|row| 0.01 * row as f64).collect();
        Recording { joints: vec!["a".to_owned()], t, q, ..Recording::default() }
    }

    proptest! {
        #[test]
        fn the_survey_and_the_blocks_are_without_spikes(at in 0_usize..1000, length in 1_usize..=LONGEST, size in 0.1..1e6_f64) {
            let mut q: Vec<f64> = (0..1000).map(swing).collect();
            let end = (at + length).min(1000);
            q[at..end].iter_mut().for_each(|x| *x += size);
            let recording = recording(q);
            let survey = recording.survey().unwrap();
            let expected = SpikeCount { column: "q.a".to_owned(), samples: (end - at) as u64, first_line: at as u64 + 2 };
            prop_assert_eq!(&survey.spikes, &[expected]);
            prop_assert!(survey.joints[0].q_max < 1.01 && survey.joints[0].q_min > -1.01);
            let conditioning = Conditioning::choose(&[survey], &ConditioningOptions::default()).unwrap();
            for block in recording.blocks(&conditioning).unwrap() {
                prop_assert!(block.q.iter().all(|q| q.abs() < 1.01));
            }
        }
    }

    /// A cell of 3.4e38 made the whole error 1e33.
    #[test]
    fn a_spike_in_a_column_at_rest_is_found() {
        let mut q = vec![0.25; 500];
        q[200] = 3.4e38;
        assert_eq!(recording(q).survey().unwrap().spikes.len(), 1);
    }

    #[test]
    fn real_logs_have_no_spikes() {
        let logs = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data/logs");
        if !logs.is_dir() {
            println!("skipped: there are no logs at {}", logs.display());
            return;
        }
        let mut files: Vec<PathBuf> = Vec::new();
        for set in
            std::fs::read_dir(&logs).unwrap().map(|entry| entry.unwrap().path()).filter(|path| path.is_dir())
        {
            let entries = std::fs::read_dir(set).unwrap().map(|entry| entry.unwrap().path());
            files.extend(entries.filter(|path| path.extension().is_some_and(|extension| extension == "csv")));
        }
        assert!(!files.is_empty());
        for file in files {
            let header = std::fs::read_to_string(&file).unwrap();
            let names = header.lines().next().unwrap().split(',');
            let joints: Vec<String> =
                names.filter_map(|name| name.strip_prefix("q.")).map(str::to_owned).collect();
            let recording = Recording::from_csv(&file, &joints, TorqueColumns::Required).unwrap();
            let survey = recording.survey().unwrap();
            assert!(survey.spikes.is_empty(), "{}: {:?}", file.display(), survey.spikes);
            println!("{} {:.1?}", file.display(), survey.excursions);
        }
    }
}
