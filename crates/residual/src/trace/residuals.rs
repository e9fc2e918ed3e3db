//! One pass over the logs with a fitted model: what it leaves, sample by sample, in the memory of a few
//! blocks.

use phiw_effects::{JointRange, SignalRanges};
use phiw_identification::block_source::try_for_each_batch;
use phiw_identification::design::DesignScratch;
use phiw_identification::{BlockSource, Data, Design, Fold, IdentificationError};
use phiw_telemetry::Block;
use phiw_telemetry::filter::FilterScratch;
use rayon::prelude::*;

/// What the residual of each torque looks like on some folds.
#[derive(Clone, Debug, Default)]
pub struct ResidualShape {
    /// RMS of each torque's residual \[N·m, N\].
    pub rms: Vec<f64>,
    /// Autocorrelation of each torque's residual, less what the filter alone gives to noise: the largest of
    /// those 0.25 to 0.5 s apart. Near zero for noise, whatever its colour within the filter's band. At
    /// several distances, since that of a residual that swings once a second is zero at one of them.
    pub autocorrelation: Vec<f64>,
    /// The same, signed, of samples 2.5 s apart: near one for what wanders slowly, near zero for noise.
    pub wander: Vec<f64>,
    /// For each joint, spatial frequencies \[periods·2π over the unit of position\] at which its residual has
    /// peaks, strongest first.
    pub ripple_frequencies: Vec<Vec<f64>>,
    /// The same of its residual times the torque of the model.
    pub load_ripple_frequencies: Vec<Vec<f64>>,
    /// The same of its residual with the sign of the speed.
    pub friction_ripple_frequencies: Vec<Vec<f64>>,
    /// For each joint, angular frequencies \[rad/s\] at which its residual has peaks over the time of the
    /// session, strongest first.
    pub time_frequencies: Vec<Vec<f64>>,
    /// Filtered rows that were looked at.
    pub rows: u64,
}

/// Distances of two samples whose correlation is structure and not the noise's colour \[s\].
const STRUCTURE_LAGS: [f64; 3] = [0.25, 0.35, 0.5];
/// All distances \[s\]: those, and that at which only what wanders is still correlated.
const LAGS: [f64; 4] = [0.25, 0.35, 0.5, 2.5];
/// Peaks of the residual over the position that are tried as ripple.
const PEAKS: usize = 4;
/// Highest frequency that is tried over a position, however fast the joint moves \[1/rad, 1/m\], and over the
/// time \[rad/s\].
const HIGHEST_FREQUENCY: f64 = 130.0;
/// Highest frequency over a position at which friction is tried \[1/rad, 1/m\]: what varies faster along a
/// turn is a bearing's or a tooth's, and averages out within a motion.
const HIGHEST_OF_FRICTION: f64 = 32.0;
/// Angular frequency of a ripple at the RMS of a joint's speed up to which it is tried \[rad/s\]: what swings
/// faster is filtered from the torques. The teeth of a screw are a few millimetres apart.
const HIGHEST_IN_TIME: f64 = 62.8;

/// What the training motion covers, with the frequencies of what a model leaves of it.
///
/// # Errors
/// A log cannot be read.
pub fn ranges_of_residual(
    design: &Design,
    parameters: &[f64],
    data: &Data<'_>,
    mut ranges: SignalRanges,
) -> Result<SignalRanges, IdentificationError> {
    let (train, sources) = (&data.train, &data.sources);
    let shape = residual_shape(design, parameters, train, sources, &ranges.joints, Peaks::OverPosition)?;
    ranges.ripple_frequencies = shape.ripple_frequencies;
    ranges.friction_frequencies = shape.friction_ripple_frequencies;
    ranges.joints.iter_mut().zip(shape.rms).for_each(|(joint, rms)| joint.residual_rms = rms);
    Ok(ranges)
}

/// Which frequencies are looked for.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Peaks {
    /// Those over the position alone, of friction the long ones.
    OverPosition,
    /// All of [`ResidualShape`].
    All,
}

/// What is gathered of one torque, row by row.
struct Collector {
    /// Distances in outputs, ascending.
    lags: [usize; LAGS.len()],
    /// What noise has there after the filter.
    of_noise: [f64; LAGS.len()],
    ring: Vec<f64>,
    filled: usize,
    /// For each distance: sum of the products, sum of the squares.
    products: [(f64, f64); LAGS.len()],
    /// Sum of the squares, rows that count.
    squares: (f64, f64),
    positions: Grid,
    /// The same of the residual times the torque of the model.
    loads: Grid,
    /// The same with the sign of the speed.
    frictions: Grid,
    /// Over the time.
    times: Grid,
}

/// The filtered rows of one block.
struct FilteredRows {
    /// Whether they are of a log and a segment that the block before was of.
    continues: bool,
    /// Distances in outputs, and what noise has there after the filter; none where there are not two rows.
    lags: Option<([usize; LAGS.len()], [f64; LAGS.len()])>,
    /// Session time \[s\]; none where the row is in no fold.
    times: Vec<Option<f64>>,
    /// What the model leaves of each torque, nothing where the row does not count; the torque of the model;
    /// position; speed.
    torques: Vec<[f64; 4]>,
}

/// Fourier sums of a residual over the position.
struct Grid {
    first: f64,
    step: f64,
    sums: Vec<(f64, f64)>,
}

impl Grid {
    /// Frequencies over a joint's position.
    fn over_position(joint: &JointRange) -> Self {
        let highest = HIGHEST_IN_TIME / joint.velocity_rms.max(1e-6);
        Self::new(joint.position, highest.max(HIGHEST_FREQUENCY))
    }

    /// Frequencies from one and a half periods over the range up to the highest, four to a bin's width.
    fn new(range: (f64, f64), highest: f64) -> Self {
        let width = (range.1 - range.0).max(1e-6);
        let first = 1.5 * std::f64::consts::TAU / width;
        let step = 0.25 * std::f64::consts::TAU / width;
        let count = if first < highest { ((highest - first) / step) as usize + 2 } else { 0 };
        // Short strokes have few bins; very long ones (linear axes in mm) are not followed without end.
        Grid { first, step, sums: vec![(0.0, 0.0); count.min(2000)] }
    }

    /// Looks for nothing.
    fn empty() -> Self {
        Grid { first: 0.0, step: 0.0, sums: Vec::new() }
    }

    fn add(&mut self, position: f64, residual: f64) {
        if self.sums.is_empty() {
            return;
        }
        let (mut sine, mut cosine) = (self.first * position).sin_cos();
        let (step_sine, step_cosine) = (self.step * position).sin_cos();
        for sum in &mut self.sums {
            sum.0 += residual * cosine;
            sum.1 += residual * sine;
            (sine, cosine) =
                (sine * step_cosine + cosine * step_sine, cosine * step_cosine - sine * step_sine);
        }
    }

    fn peaks(&self) -> Vec<f64> {
        let power: Vec<f64> = self.sums.iter().map(|(re, im)| re * re + im * im).collect();
        let mut peaks: Vec<usize> = (1..power.len().saturating_sub(1))
            .filter(|&bin| power[bin] >= power[bin - 1] && power[bin] > power[bin + 1])
            .collect();
        peaks.sort_by(|&a, &b| power[b].total_cmp(&power[a]));
        peaks.truncate(PEAKS);
        let refined = |bin: usize| {
            let (low, here, high) = (power[bin - 1], power[bin], power[bin + 1]);
            let curvature = low - 2.0 * here + high;
            let shift = if curvature < 0.0 { 0.5 * (low - high) / curvature } else { 0.0 };
            self.first + self.step * (bin as f64 + shift.clamp(-0.5, 0.5))
        };
        peaks.into_iter().map(refined).collect()
    }
}

/// The shape of what `parameters` leave on the folds. `ranges` are what the joints' motion covers.
///
/// # Errors
/// A log cannot be read.
pub fn residual_shape(
    design: &Design,
    parameters: &[f64],
    folds: &[Fold],
    sources: &[&dyn BlockSource],
    ranges: &[JointRange],
    peaks: Peaks,
) -> Result<ResidualShape, IdentificationError> {
    let duration: f64 = folds.iter().map(|fold| fold.end - fold.start).sum();
    let mut collectors: Vec<Collector> =
        ranges.iter().map(|range| Collector::new(range, duration, peaks)).collect();
    let (mut last, mut rows) = (None, 0);
    try_for_each_batch(sources, |batch| {
        let continues: Vec<bool> = batch
            .iter()
            .map(|block| last.replace((block.log, block.segment)) == Some((block.log, block.segment)))
            .collect();
        let filtered: Result<Vec<FilteredRows>, IdentificationError> = batch
            .into_par_iter()
            .zip(continues)
            .map_init(
                || (design.scratch(), FilterScratch::default()),
                |scratch, (block, continues)| {
                    FilteredRows::of(design, parameters, folds, block, continues, scratch)
                },
            )
            .collect();
        let filtered = filtered?;
        rows += filtered.iter().flat_map(|block| &block.times).flatten().count() as u64;
        let torques = collectors.len();
        collectors.par_iter_mut().enumerate().for_each(|(torque, collector)| {
            filtered.iter().for_each(|block| collector.take(block, torque, torques));
        });
        Ok::<(), IdentificationError>(())
    })?;
    Ok(shape(&collectors, rows))
}

impl FilteredRows {
    fn of(
        design: &Design,
        parameters: &[f64],
        folds: &[Fold],
        mut block: Block,
        continues: bool,
        (scratch, filter): &mut (DesignScratch<'_>, FilterScratch),
    ) -> Result<Self, IdentificationError> {
        design.correct(&mut block);
        scratch.begin(&block)?;
        let outputs = block.outputs.clone();
        let lags = match outputs[..] {
            [first, second, ..] => {
                let period = block.t[second] - block.t[first];
                let lags = LAGS.map(|lag| (lag / period).round().max(1.0) as usize);
                let parallel = block.parallel_filter();
                Some((lags, lags.map(|lag| parallel.noise_autocorrelation(lag * parallel.decimation()))))
            }
            _ => None,
        };
        let mut rows = FilteredRows { continues, lags, times: Vec::new(), torques: Vec::new() };
        block.try_filter(
            design.evaluation_width(),
            filter,
            |sample, row| Ok(scratch.evaluate(&block, sample, row)?),
            |output, t, row| {
                let inside = folds.iter().any(|fold| fold.contains(block.log, t));
                rows.times.push(inside.then_some(t + block.session_offset));
                let [q, qd] = [&block.q, &block.qd].map(|signal| &signal[block.row(outputs[output])]);
                for (torque, layout) in design.rows().iter().enumerate() {
                    let columns = &row[layout.range.clone()];
                    let value = |parameter: usize| parameters.get(parameter).copied().unwrap_or_default();
                    let own = layout.parameters.iter().zip(columns);
                    let fitted: f64 = own.map(|(&parameter, column)| value(parameter) * column).sum();
                    let measured = columns[layout.parameters.len()];
                    let left = if design.counts(row, torque) { measured - fitted } else { 0.0 };
                    rows.torques.push([left, fitted, q[torque], qd[torque]]);
                }
                Ok::<(), IdentificationError>(())
            },
        )?;
        Ok(rows)
    }
}

fn shape(collectors: &[Collector], rows: u64) -> ResidualShape {
    let correlation = |&(product, square): &(f64, f64)| if square > 0.0 { product / square } else { 0.0 };
    let largest = |of: &Collector| {
        let by_size = |a: &f64, b: &f64| a.abs().total_cmp(&b.abs());
        of.products[..STRUCTURE_LAGS.len()].iter().map(correlation).max_by(by_size).unwrap_or_default()
    };
    let peaks =
        |of: fn(&Collector) -> &Grid| collectors.iter().map(|collector| of(collector).peaks()).collect();
    ResidualShape {
        rms: collectors.iter().map(|of| (of.squares.0 / of.squares.1.max(1.0)).sqrt()).collect(),
        autocorrelation: collectors.iter().map(largest).collect(),
        wander: collectors.iter().map(|of| correlation(&of.products[STRUCTURE_LAGS.len()])).collect(),
        ripple_frequencies: peaks(|of| &of.positions),
        load_ripple_frequencies: peaks(|of| &of.loads),
        friction_ripple_frequencies: peaks(|of| &of.frictions),
        time_frequencies: peaks(|of| &of.times),
        rows,
    }
}

impl Collector {
    fn new(range: &JointRange, duration: f64, peaks: Peaks) -> Self {
        let all = |grid: &dyn Fn() -> Grid| match peaks {
            Peaks::All => grid(),
            Peaks::OverPosition => Grid::empty(),
        };
        Collector {
            lags: Default::default(),
            of_noise: Default::default(),
            ring: Vec::new(),
            filled: 0,
            products: Default::default(),
            squares: (0.0, 0.0),
            positions: Grid::over_position(range),
            loads: all(&|| Grid::over_position(range)),
            frictions: match peaks {
                Peaks::All => Grid::over_position(range),
                Peaks::OverPosition => Grid::new(range.position, HIGHEST_OF_FRICTION),
            },
            times: all(&|| Grid::new((0.0, duration), HIGHEST_FREQUENCY)),
        }
    }

    /// The rows of a block, of which this is the `torque`-th of `torques`.
    fn take(&mut self, block: &FilteredRows, torque: usize, torques: usize) {
        if let Some((lags, of_noise)) = block.lags {
            self.begin(lags, block.continues);
            self.of_noise = of_noise;
        }
        for (row, time) in block.times.iter().enumerate() {
            match time {
                Some(time) => self.add(block.torques[row * torques + torque], *time),
                None => self.begin(self.lags, false),
            }
        }
    }

    fn begin(&mut self, lags: [usize; LAGS.len()], continues: bool) {
        if lags != self.lags {
            self.ring = vec![0.0; lags.into_iter().max().unwrap_or_default()];
            self.lags = lags;
            self.filled = 0;
        } else if !continues {
            self.filled = 0;
        }
    }

    fn add(&mut self, [left, fitted, position, speed]: [f64; 4], time: f64) {
        if left != 0.0 {
            self.squares.0 += left * left;
            self.squares.1 += 1.0;
            self.positions.add(position, left);
            self.loads.add(position, left * fitted);
            self.frictions.add(position, left * speed.signum());
            self.times.add(time, left);
        }
        let size = self.ring.len();
        if size == 0 {
            return;
        }
        for (place, lag) in self.lags.into_iter().enumerate().filter(|(_, lag)| *lag <= self.filled) {
            let before = self.ring[(self.filled - lag) % size];
            let sums = &mut self.products[place];
            sums.0 += before * left - self.of_noise[place] * left * left;
            sums.1 += left * left;
        }
        self.ring[self.filled % size] = left;
        self.filled += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::Grid;
    use phiw_effects::JointRange;

    /// A slide of 100 mm had ripples longer than 48 mm only: the highest frequency was that of joints that
    /// turn, in 1/m.
    #[test]
    fn the_ripple_of_a_slide_is_found_down_to_millimetres() {
        let slide = JointRange { position: (0.02, 0.12), velocity_rms: 0.035, ..JointRange::default() };
        let wrist = JointRange { position: (-1.4, 1.6), velocity_rms: 0.18, ..JointRange::default() };
        for (joint, frequency) in
            [(slide, 129.2), (slide, 628.3), (slide, 1256.6), (wrist, 320.0), (wrist, 9.0)]
        {
            let mut grid = Grid::over_position(&joint);
            let (low, high) = joint.position;
            for row in 0..4000 {
                let position = 0.5 * (low + high) + 0.5 * (high - low) * (0.0173 * f64::from(row)).sin();
                grid.add(position, (frequency * position + 0.4).sin());
            }
            let peak = grid.peaks()[0];
            let slip = (peak - frequency).abs() * (high - low);
            assert!(slip < 0.7, "{frequency}: found {peak}, {slip} rad over the range");
        }
    }
}
