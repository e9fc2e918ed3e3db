//! The first pass over a log: what is in it, without changing anything.

use crate::LogError;
use crate::check_settings::CheckSettings;
use crate::clock::{Clock, uniform_interpolation_error};
use crate::columns::{Layout, TorqueColumns};
use crate::gap::GapReason;
use crate::histogram::Histogram;
use crate::hold::HeldRowFinder;
use crate::joint_survey::JointSurvey;
use crate::joint_survey::{Five, JointCollector};
use crate::log_rows::open_log;
use crate::log_source::LogSource;
use crate::mending::{Mended, Mending, without};
use crate::reader::Rows;
use crate::repeated::RepetitionFinder;
use crate::segments::{GapCount, Segment};
use crate::segments::{RowCounts, SegmentSink, SpikeCount, split};
use crate::session::Session;
use crate::spectrum::Spectrum;
use crate::spectrum::SpectrumEstimator;
use crate::spike::{SpikeFinder, WithoutSpikes};
use crate::steps::Steps;
use crate::still::StillFinder;
use crate::zero_rows::{ZeroRowFinder, ZeroRows};
use phiw_spikes::{SpikeSettings, WINDOW};
use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize};
use std::path::{Path, PathBuf};

/// What is in a log: the result of [`survey`], and what [`stream`](crate::stream) needs to read it again.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Survey {
    /// The log.
    pub path: PathBuf,
    /// How it is read.
    #[serde(skip, default = "LogSource::nowhere")]
    pub source: LogSource,
    /// What lines are counted in: `line`, `message` or `row`.
    #[serde(deserialize_with = "known_rows")]
    pub rows_are: RowsAre,
    /// How the rows came about, where the log does not say it plainly.
    pub notes: Vec<String>,
    /// Place in the session, see [`arrange_session`](crate::arrange_session).
    pub session: Session,
    /// What was asked for when it was surveyed.
    pub torque: TorqueColumns,
    /// Rows below the header.
    pub rows: u64,
    /// Rows that are usable: part of a segment.
    pub used_rows: u64,
    /// Stretches without a gap of at least [`SHORTEST_KEPT`](Survey::SHORTEST_KEPT) rows, in order.
    pub segments: Vec<Segment>,
    /// Shorter stretches.
    pub short_segments: u64,
    /// Why rows were skipped and segments split, in the order of first occurrence.
    pub gaps: Vec<GapCount>,
    /// Columns with spikes; their rows are counted as gaps, too.
    pub spikes: Vec<SpikeCount>,
    /// The largest excursion of each column `q.<joint>`, `tau.<joint>`, … of a row, as a multiple of what is
    /// usual in it, see [`SpikeSettings::multiple`]; without spikes that were left out.
    #[serde(with = "crate::any_number::list")]
    pub excursions: Vec<f64>,
    /// What an excursion must exceed to be a spike, by place in a row; empty where the log has none.
    #[serde(with = "crate::any_number::list")]
    pub(crate) spike_bounds: Vec<f64>,
    /// First and last stamp of stretches in which no torque changes though the robot moves, in seconds: their
    /// rows are counted as gaps.
    pub still: Vec<[f64; 2]>,
    /// First and last stamp of stretches that repeat earlier rows to the last digit, in seconds: their rows
    /// are counted as gaps.
    #[serde(default)]
    pub repeated: Vec<[f64; 2]>,
    /// What was mended in its rows.
    #[serde(default)]
    pub(crate) mending: Mending,
    /// Columns in the header that are not used.
    pub ignored_columns: Vec<String>,
    /// Median distance of consecutive stamps, in seconds; exact over the first 65536, checked against a
    /// histogram over all.
    #[serde(with = "crate::any_number")]
    pub median_period: f64,
    /// Mean distance of consecutive stamps inside segments, in seconds: the sample period.
    #[serde(with = "crate::any_number")]
    pub period: f64,
    /// Root mean square deviation of the distances inside segments from the median, relative to it.
    #[serde(with = "crate::any_number")]
    pub jitter: f64,
    /// Longest distance of stamps, in seconds, that does not split: 1.25 times the 99th percentile, within
    /// 1.5 to 2.5 medians.
    #[serde(with = "crate::any_number")]
    pub longest_step: f64,
    /// The clock under which the positions are smoother: the median error of a sample against the cubic
    /// through its four neighbours is compared at places where the stamps are uneven. [`Clock::Uniform`] must
    /// win by a tenth.
    pub clock: Clock,
    /// One entry a joint, in the order asked for.
    pub joints: Vec<JointSurvey>,
    /// Hash of the file's bytes: two files of equal content have the same.
    pub content_hash: u64,
    /// Power spectra.
    pub spectrum: Spectrum,
}

/// A name that is known beforehand, under a name of its own: a reference would be read from the text.
type RowsAre = &'static str;

/// What lines can be counted in.
const ROWS_ARE: [&str; 3] = ["line", "message", "row"];

fn known_rows<'de, D: Deserializer<'de>>(deserializer: D) -> Result<&'static str, D::Error> {
    let written = String::deserialize(deserializer)?;
    let known = ROWS_ARE.into_iter().find(|known| *known == written);
    known.ok_or_else(|| D::Error::custom(format!("rows are `{written}`; known are {}", ROWS_ARE.join(", "))))
}

impl Survey {
    /// Rows from which on a stretch is listed in [`segments`](Survey::segments); no filter can use a shorter
    /// one.
    pub const SHORTEST_KEPT: usize = 8;

    /// Sample rate, in Hz.
    pub fn rate_hz(&self) -> f64 {
        1.0 / self.period
    }

    /// First and last usable stamp, in seconds.
    pub fn time_range(&self) -> (f64, f64) {
        let start = self.segments.first().map_or(0.0, |segment| segment.t_start);
        (start, self.segments.last().map_or(start, |segment| segment.t_end))
    }

    /// Rows for which each reading stands in the log, where it stands there several times; the repeats are
    /// counted as gaps.
    pub fn held_rows(&self) -> Option<usize> {
        (self.mending.held > 1).then_some(self.mending.held)
    }

    /// Rows of zeros that a driver logged for what it had not got; they are counted as gaps, and bridged.
    pub fn zero_rows(&self) -> ZeroRows {
        self.mending.zero_rows
    }

    /// How often the position of each joint jumped by a turn: it runs on there.
    pub fn turns(&self) -> &[u64] {
        &self.mending.turns
    }

    /// Time covered by the segments, in seconds.
    pub fn duration(&self) -> f64 {
        self.segments.iter().map(|segment| segment.t_end - segment.t_start).sum()
    }
}

/// Reads a log once and says what is in it.
///
/// Constant memory: statistics, histograms and spectra, and one small record a segment. `progress` is
/// called with the bytes done and the bytes in total now and then.
///
/// # Errors
/// A file that can't be read, columns that are missing, cells that are not numbers, time that runs backwards,
/// no usable row.
pub fn survey(
    source: impl Into<LogSource>,
    joints: &[String],
    torque: TorqueColumns,
    progress: &mut dyn FnMut(u64, u64),
) -> Result<Survey, LogError> {
    let source = source.into();
    let mut open = || open_log(&source, joints, torque);
    let (mut survey, reader) = survey_rows(&mut open, joints, progress)?;
    survey.torque = torque;
    survey.ignored_columns = reader.ignored_columns().to_vec();
    survey.content_hash = reader.content_hash();
    survey.notes = reader.notes();
    survey.source = source;
    Ok(survey)
}

/// [`survey`] of any source of rows, which `open` starts from the beginning; also gives back the source, read
/// to its end.
pub(crate) fn survey_rows<R: Rows>(
    open: &mut dyn FnMut() -> Result<R, LogError>,
    joints: &[String],
    progress: &mut dyn FnMut(u64, u64),
) -> Result<(Survey, R), LogError> {
    let mut mending = Mending::default();
    let (mut collector, mut counts, mut rows) = pass(open, &mending, progress)?;
    if let Some(hold) = collector.held.hold() {
        // Rows that were written several times look like steps: the pass is repeated with each once.
        mending.held = hold.rows;
        (collector, counts, rows) = pass(open, &mending, progress)?;
    }
    if let Some(bounds) = collector.zeros.bounds(|place| collector.spikes.median_bend(place)) {
        (mending.zero_bounds, mending.longest_step) = (bounds, collector.steps.longest());
        (collector, counts, rows) = pass(open, &mending, progress)?;
    }
    if let Some(held) = collector.held_positions() {
        mending.held_positions = held;
        (collector, counts, rows) = pass(open, &mending, progress)?;
    }
    let (mut spikes, mut spike_bounds) = (Vec::new(), Vec::new());
    if let Some(bounds) = collector.spikes.bounds(rows.layout(), SpikeSettings::default()) {
        // Spikes would distort all statistics: the pass is repeated without them.
        let steps = collector.steps;
        let mut without = WithoutSpikes::new(mending.of(open()?), bounds.clone());
        collector = Collector::new(without.layout(), steps, progress);
        counts = split(&mut without, steps.longest(), &mut collector)?;
        spikes = without.counts(joints);
        spike_bounds = bounds;
        rows = without.into_inner();
    }
    let still = collector.still.stretches(&CheckSettings::default());
    let repeated = collector.repeated.stretches();
    if !still.is_empty() || !repeated.is_empty() {
        // Rows without logged torques would bias all parameters towards zero, and copies make them look
        // better known than they are: the pass is repeated without them.
        let steps = collector.steps;
        let mut without = without(mending.of(open()?), &spike_bounds, &still, &repeated);
        collector = Collector::new(without.layout(), steps, progress);
        counts = split(&mut without, steps.longest(), &mut collector)?;
        let without = without.into_inner().into_inner();
        spikes = without.counts(joints);
        rows = without.into_inner();
    }
    let stands_still =
        |gap: &GapCount| gap.reason == GapReason::DuplicateStamp && gap.count + 1 == counts.rows;
    if counts.used == 1 && counts.gaps.iter().any(stands_still) {
        let stamp = collector.last_stamp.unwrap_or(f64::NAN);
        return Err(LogError::ConstantTime { path: rows.path().into(), stamp, rows: counts.rows });
    }
    if counts.used == 0 {
        return Err(match counts.rows {
            0 => LogError::Empty { path: rows.path().into() },
            n => LogError::NoUsableRows {
                path: rows.path().into(),
                rows: n,
                reasons: counts.reasons(rows.rows_are()),
            },
        });
    }
    let survey = collector.finish(rows.path(), rows.rows_are(), joints, counts);
    let rows = rows.into_inner();
    mending.turns = rows.counts().to_vec();
    let rows = rows.into_inner();
    mending.zero_rows = rows.counts();
    let survey = Survey { spikes, spike_bounds, still, repeated, mending, ..survey };
    Ok((survey, rows.into_inner().into_inner()))
}

/// What a pass over all rows gives: what it collected, its totals, and the rows at their end.
type Pass<'a, R> = (Collector<'a>, RowCounts, Mended<R>);

/// A pass over all rows, so mended.
fn pass<'a, R: Rows>(
    open: &mut dyn FnMut() -> Result<R, LogError>,
    mending: &Mending,
    progress: &'a mut dyn FnMut(u64, u64),
) -> Result<Pass<'a, R>, LogError> {
    let head = Steps::of_head(&mut mending.of(open()?))?;
    let mut rows = mending.of(open()?);
    let mut collector = Collector::new(rows.layout(), head, progress);
    let mut counts = split(&mut rows, head.longest(), &mut collector)?;
    let all = collector.all_steps();
    if !head.holds_for(all) {
        // The steps of the whole log differ from those of its head: the pass is repeated with them.
        rows = mending.of(open()?);
        collector = Collector::new(rows.layout(), all, collector.progress);
        counts = split(&mut rows, all.longest(), &mut collector)?;
    }
    Ok((collector, counts, rows))
}

/// A place is uneven where the stamp is off its neighbours' grid by this share of the period.
const UNEVEN: f64 = 1e-3;

struct Collector<'a> {
    layout: Layout,
    steps: Steps,
    joints: Vec<JointCollector>,
    spectrum: SpectrumEstimator,
    spikes: SpikeFinder,
    still: StillFinder,
    repeated: RepetitionFinder,
    held: HeldRowFinder,
    zeros: ZeroRowFinder,
    segments: Vec<Segment>,
    short_segments: u64,
    /// The [`WINDOW`] latest samples of the segment, oldest first, flat.
    recent: Vec<f64>,
    in_segment: usize,
    last_stamp: Option<f64>,
    step_histogram: Histogram,
    step_count: f64,
    step_sum: f64,
    step_square: f64,
    progress: &'a mut dyn FnMut(u64, u64),
}

impl<'a> Collector<'a> {
    /// [`Mending::held_positions`]; `None` where all positions are read anew in every row.
    fn held_positions(&self) -> Option<Vec<f64>> {
        let held: Vec<Option<f64>> = self.joints.iter().map(JointCollector::held_position).collect();
        held.iter().any(Option::is_some).then(|| held.iter().map(|rows| rows.unwrap_or(1.0)).collect())
    }

    fn new(layout: &Layout, steps: Steps, progress: &'a mut dyn FnMut(u64, u64)) -> Self {
        Collector {
            joints: (0..layout.joints)
                .map(|i| {
                    let has = |places: &[Option<usize>]| places[i].is_some();
                    let optional = [&layout.qd, &layout.qdd, &layout.temp].map(|places| has(places));
                    JointCollector::new(steps.median, layout.torque, optional)
                })
                .collect(),
            spectrum: SpectrumEstimator::new(layout, steps.median),
            spikes: SpikeFinder::new(layout),
            still: StillFinder::new(layout),
            repeated: RepetitionFinder::new(),
            held: HeldRowFinder::new(layout),
            zeros: ZeroRowFinder::new(layout),
            steps,
            segments: Vec::new(),
            short_segments: 0,
            recent: vec![0.0; WINDOW * layout.width],
            in_segment: 0,
            last_stamp: None,
            step_histogram: Histogram::new(),
            step_count: 0.0,
            step_sum: 0.0,
            step_square: 0.0,
            layout: layout.clone(),
            progress,
        }
    }

    fn all_steps(&self) -> Steps {
        if self.step_histogram.total() == 0 {
            return self.steps;
        }
        Steps { median: self.step_histogram.median(), high: self.step_histogram.quantile(0.99) }
    }

    fn step(&mut self, step: f64) {
        self.step_count += 1.0;
        self.step_sum += step;
        self.step_square += (step / self.steps.median - 1.0).powi(2);
    }

    fn five(&self, place: Option<usize>) -> Five {
        let first = WINDOW - 5;
        std::array::from_fn(|i| {
            place.map_or(f64::NAN, |place| self.recent[(first + i) * self.layout.width + place])
        })
    }

    fn window(&self, place: usize) -> [f64; WINDOW] {
        std::array::from_fn(|i| self.recent[i * self.layout.width + place])
    }

    fn finish(self, path: &Path, rows_are: &'static str, joints: &[String], counts: RowCounts) -> Survey {
        let votes: Vec<f64> = self.joints.iter().filter_map(JointCollector::smoother_when_uniform).collect();
        let mean = votes.iter().sum::<f64>() / votes.len().max(1) as f64;
        let jitter = (self.step_square / self.step_count.max(1.0)).sqrt();
        let uneven = jitter > UNEVEN;
        let clock = if uneven && mean < UNIFORM_WINS { Clock::Stamped } else { Clock::Uniform };
        let period = if self.step_count > 0.0 { self.step_sum / self.step_count } else { self.steps.median };
        Survey {
            path: path.into(),
            source: LogSource::from(path),
            rows_are,
            notes: Vec::new(),
            session: Session::default(),
            torque: if self.layout.torque { TorqueColumns::Required } else { TorqueColumns::Absent },
            rows: counts.rows,
            used_rows: counts.used,
            segments: self.segments,
            short_segments: self.short_segments,
            gaps: counts.gaps,
            spikes: Vec::new(),
            spike_bounds: Vec::new(),
            still: Vec::new(),
            repeated: Vec::new(),
            mending: Mending::default(),
            excursions: self.spikes.multiples(SpikeSettings::default()),
            ignored_columns: Vec::new(),
            median_period: self.steps.median,
            period,
            jitter,
            longest_step: self.steps.longest(),
            clock,
            joints: (self.joints.iter().zip(joints))
                .map(|(joint, name)| joint.finish(name, clock == Clock::Stamped))
                .collect(),
            content_hash: 0,
            spectrum: self.spectrum.finish(self.layout.joints),
        }
    }
}

/// ln of how much smoother (on the mean over joints) positions must be at equal distances before the stamps
/// are disbelieved.
const UNIFORM_WINS: f64 = 0.1;

impl SegmentSink for Collector<'_> {
    fn sample(&mut self, values: &[f64]) -> bool {
        let (width, n) = (self.layout.width, self.layout.joints);
        // Steps across splits count too, as the splits may come from a head that differs from the rest.
        if let Some(last) = self.last_stamp.replace(values[0]) {
            self.step_histogram.push(values[0] - last);
        }
        if self.in_segment > 0 {
            self.step(values[0] - self.recent[(WINDOW - 1) * width]);
        }
        self.held.push(values);
        let before = &self.recent[(WINDOW - 1) * width..];
        self.zeros.push((self.in_segment > 0).then_some(before), values);
        self.recent.copy_within(width.., 0);
        self.recent[(WINDOW - 1) * width..].copy_from_slice(values);
        self.in_segment += 1;

        let (q, tau) = (self.layout.q(), self.layout.tau());
        let torques = if self.layout.torque { &values[tau..tau + n] } else { &[] };
        self.spectrum.push(&values[q..q + n], torques);
        if self.layout.torque {
            self.still.push(values[0], &values[q..q + n], torques);
            self.repeated.push(&self.layout, values);
        }
        let optional = |place: Option<usize>| place.map_or(f64::NAN, |place| values[place]);
        for (i, joint) in self.joints.iter_mut().enumerate() {
            let torque = torques.get(i).copied().unwrap_or(f64::NAN);
            let [qd, qdd] = [&self.layout.qd, &self.layout.qdd].map(|places| optional(places[i]));
            joint.push(values[0], values[q + i], torque, qd, qdd);
        }
        if self.in_segment >= WINDOW {
            for place in 1..width {
                let window = self.window(place);
                self.spikes.push(place, window, self.in_segment == WINDOW);
            }
        }
        if self.in_segment >= 5 {
            let t = self.five(Some(0));
            let uneven = uniform_interpolation_error(t).abs() > UNEVEN * self.steps.median;
            for i in 0..n {
                let torque = self.layout.torque.then_some(tau + i);
                let (q, tau) = (self.five(Some(q + i)), self.five(torque));
                let (qd, qdd) = (self.five(self.layout.qd[i]), self.five(self.layout.qdd[i]));
                self.joints[i].push_five(t, uneven, q, tau, qd, qdd);
            }
        }
        true
    }

    fn end(&mut self, segment: Segment) -> bool {
        match segment.rows {
            rows if rows < Survey::SHORTEST_KEPT => self.short_segments += 1,
            _ => self.segments.push(segment),
        }
        if self.in_segment >= WINDOW {
            for place in 1..self.layout.width {
                let window = self.window(place);
                self.spikes.end(place, window);
            }
        }
        self.in_segment = 0;
        self.still.end();
        self.repeated.end();
        self.held.end_segment();
        self.zeros.end_segment();
        self.joints.iter_mut().for_each(JointCollector::end_segment);
        self.spectrum.end_segment();
        true
    }

    fn progress(&mut self, done: u64, total: u64) {
        (self.progress)(done, total);
    }
}
