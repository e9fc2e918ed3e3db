//! Spikes: a few samples far off, after which the signal goes on where it was. A broken encoder reading, a torn message.

use crate::columns::Layout;
use crate::histogram::Histogram;
use crate::reader::{Row, Rows};
use crate::segments::GapReason;
use crate::{LogError, SpikeCount};
use std::collections::VecDeque;
use std::path::Path;

/// The most samples in a row that are taken for one spike.
const LONGEST: usize = 3;
/// Samples that a spike is judged by. Where a segment begins with one there are more behind it than another can have.
pub(crate) const WINDOW: usize = 2 * LONGEST + 1;
/// Fewer samples that differ from the mean of their neighbours than this say nothing of what is usual in a column.
const FEWEST: u64 = 16;

/// When a sample is a spike.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpikeSettings {
    /// How far a signal must leave the line between the samples before and behind, and come back to it, to be a spike: a multiple of what 98 %
    /// of the samples that differ from the mean of their neighbours differ from it by.
    ///
    /// On six sets of real logs the largest multiple is 8.4 for a position, 7.3 for a velocity, 9.2 for a torque (`cargo test -p phiw-telemetry
    /// real_logs -- --nocapture` prints them); normal noise reaches 2.5 in 10⁷ samples.
    pub multiple: f64,
}

impl Default for SpikeSettings {
    fn default() -> Self {
        SpikeSettings { multiple: 25.0 }
    }
}

/// By how much the samples 1… of a window (of three or more) leave the line between sample 0 and the sample behind them, less what that line rises: for one, two
/// or three samples, with the number of samples for which it is most. A step gives less than nothing, since it does not come back.
fn excursion(window: &[f64]) -> (f64, usize) {
    let before = window[0];
    let mut most = (f64::NEG_INFINITY, 1);
    for length in 1..=LONGEST.min(window.len() - 2) {
        let behind = window[length + 1];
        let mut least = f64::INFINITY;
        for (place, &sample) in window[1..=length].iter().enumerate() {
            let share = (place + 1) as f64 / (length + 1) as f64;
            least = least.min((sample - before - share * (behind - before)).abs());
        }
        let excess = least - (behind - before).abs();
        if excess > most.0 {
            most = (excess, length);
        }
    }
    most
}

/// The same for samples 0… of a window, where a segment begins (or, backwards, ends): by how much they are off all samples behind
/// them, less what the signal can have moved meanwhile at its fastest step there.
fn excursion_at_edge(window: &[f64]) -> (f64, usize) {
    let mut most = (f64::NEG_INFINITY, 1);
    for length in 1..=LONGEST.min(window.len() - 2) {
        let (off, behind) = window.split_at(length);
        let distance =
            |sample: &f64| behind.iter().fold(f64::INFINITY, |least, x| least.min((sample - x).abs()));
        let least = off.iter().map(distance).fold(f64::INFINITY, f64::min);
        let fastest = behind.windows(2).map(|pair| (pair[1] - pair[0]).abs()).fold(0.0, f64::max);
        let excess = least - WINDOW as f64 * fastest;
        if excess > most.0 {
            most = (excess, length);
        }
    }
    most
}

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
        let bend = window[2] - 0.5 * (window[1] + window[3]);
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
        // What the samples behind them are too few for in `push`.
        for start in 1..WINDOW - 2 {
            *most = most.max(excursion(&window[start..]).0);
        }
        window.reverse();
        *most = most.max(excursion_at_edge(&window).0);
    }

    /// What an excursion of each place must exceed to be a spike, where any does; infinite where spikes are not looked for.
    pub fn bounds(&self, layout: &Layout, settings: SpikeSettings) -> Option<Vec<f64>> {
        let bound = |place: usize, (usual, _): &(Histogram, f64)| match place {
            // Stamps are judged by the segments; a temperature is no part of the fit.
            0 => f64::INFINITY,
            place if layout.may_be_missing(place) => f64::INFINITY,
            _ if usual.total() < FEWEST => 0.0,
            _ => settings.multiple * usual.quantile(0.98),
        };
        let bounds: Vec<f64> =
            self.columns.iter().enumerate().map(|(place, column)| bound(place, column)).collect();
        self.columns.iter().zip(&bounds).any(|((_, most), bound)| most > bound).then_some(bounds)
    }

    /// The largest excursion of each column but the time, as a multiple of what is usual; 0 where that is not known.
    pub fn multiples(&self) -> Vec<f64> {
        let multiple = |(usual, most): &(Histogram, f64)| match usual.total() {
            FEWEST.. => most.max(0.0) / usual.quantile(0.98),
            _ => 0.0,
        };
        self.columns.iter().skip(1).map(multiple).collect()
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
        let mut window = [0.0; WINDOW];
        let sample = |index: usize| self.ahead[index].values[place];
        let over = |(most, length): (f64, usize)| if most > self.bounds[place] { length } else { 0 };
        match &self.before {
            [Some(before), earlier] => {
                window[0] = before[place];
                let size = WINDOW.min(samples + 1);
                (1..size).for_each(|index| window[index] = sample(index - 1));
                let inside = if size > 2 { over(excursion(&window[..size])) } else { 0 };
                match earlier {
                    // The segment ends within the window: all that is left of it may be off.
                    Some(earlier) if inside == 0 && samples <= LONGEST => {
                        (0..samples).for_each(|index| window[index] = sample(samples - 1 - index));
                        window[samples] = before[place];
                        window[samples + 1] = earlier[place];
                        let length = over(excursion_at_edge(&window[..samples + 2]));
                        if length == samples { length } else { 0 }
                    }
                    _ => inside,
                }
            }
            [None, _] if samples >= WINDOW => {
                (0..WINDOW).for_each(|index| window[index] = sample(index));
                over(excursion_at_edge(&window))
            }
            [None, _] => 0,
        }
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
            // The segment is over: nothing before is compared with.
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
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Recording, TorqueColumns};
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
        fn spikes_are_found_wherever_they_are(
            at in 0_usize..1000,
            length in 1_usize..=LONGEST,
            size in prop_oneof![0.1..1e6, -1e6..-0.1],
        ) {
            let mut q: Vec<f64> = (0..1000).map(swing).collect();
            let end = (at + length).min(1000);
            q[at..end].iter_mut().for_each(|x| *x += size);
            let survey = recording(q).survey().unwrap();
            let [found] = survey.spikes.as_slice() else { panic!("{:?}", survey.spikes) };
            prop_assert_eq!((found.samples as usize, found.first_line as usize), (end - at, at + 2));
            prop_assert!(survey.joints[0].q_max < 1.01 && survey.joints[0].q_min > -1.01);
        }

        #[test]
        fn steps_and_coarse_readings_are_no_spikes(step in 1e-3..1.0_f64, at in 5_usize..995, size in -1e3..1e3_f64) {
            let coarse: Vec<f64> = (0..1000).map(|sample| (swing(sample) / step).round() * step).collect();
            prop_assert!(recording(coarse).survey().unwrap().spikes.is_empty());
            let stepped = (0..1000).map(|sample| swing(sample) + if sample < at { 0.0 } else { size }).collect();
            prop_assert!(recording(stepped).survey().unwrap().spikes.is_empty());
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
