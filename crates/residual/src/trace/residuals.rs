//! One pass over the logs with a fitted model: what it leaves, sample by sample, in constant memory.

use phiw_effects::SignalRanges;
use phiw_identification::{BlockSource, Data, Design, Fold, IdentificationError};
use phiw_telemetry::filter::FilterScratch;

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
/// Highest spatial frequency that is tried \[1/rad\].
const HIGHEST_FREQUENCY: f64 = 130.0;

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
    let positions: Vec<(f64, f64)> = ranges.joints.iter().map(|joint| joint.position).collect();
    let shape = residual_shape(design, parameters, &data.train, &data.sources, &positions)?;
    ranges.ripple_frequencies = shape.ripple_frequencies;
    ranges.joints.iter_mut().zip(shape.rms).for_each(|(joint, rms)| joint.residual_rms = rms);
    Ok(ranges)
}

struct Collector {
    /// Distances in outputs, ascending.
    lags: [usize; LAGS.len()],
    /// What noise has there after the filter.
    of_noise: [f64; LAGS.len()],
    ring: Vec<Vec<f64>>,
    filled: usize,
    /// For each torque and distance: sum of the products, sum of the squares.
    products: Vec<[(f64, f64); LAGS.len()]>,
    /// For each torque: sum of the squares, rows that count.
    squares: Vec<(f64, f64)>,
    grids: Vec<Grid>,
    /// The same of the residual times the torque of the model.
    loads: Vec<Grid>,
    /// The same with the sign of the speed.
    frictions: Vec<Grid>,
    /// Over the time.
    times: Vec<Grid>,
}

/// One filtered row.
#[derive(Default)]
struct FilteredRow {
    /// What the model leaves of each torque; nothing where the row does not count.
    residual: Vec<f64>,
    /// The torques of the model.
    fitted: Vec<f64>,
}

/// Fourier sums of a residual over the position.
struct Grid {
    first: f64,
    step: f64,
    sums: Vec<(f64, f64)>,
}

impl Grid {
    /// Frequencies from one and a half periods over the range, four to a bin's width.
    fn new(range: (f64, f64)) -> Self {
        let width = (range.1 - range.0).max(1e-6);
        let first = 1.5 * std::f64::consts::TAU / width;
        let step = 0.25 * std::f64::consts::TAU / width;
        let count =
            if first < HIGHEST_FREQUENCY { ((HIGHEST_FREQUENCY - first) / step) as usize + 1 } else { 0 };
        // Short strokes have few bins; very long ones (linear axes in mm) are not followed without end.
        Grid { first, step, sums: vec![(0.0, 0.0); count.min(2000)] }
    }

    fn add(&mut self, position: f64, residual: f64) {
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

/// The shape of what `parameters` leave on the folds. `ranges` are the joints' ranges of position.
///
/// # Errors
/// A log cannot be read.
pub fn residual_shape(
    design: &Design,
    parameters: &[f64],
    folds: &[Fold],
    sources: &[&dyn BlockSource],
    ranges: &[(f64, f64)],
) -> Result<ResidualShape, IdentificationError> {
    let torques = design.rows().len();
    let duration: f64 = folds.iter().map(|fold| fold.end - fold.start).sum();
    let mut collector = Collector {
        lags: Default::default(),
        of_noise: Default::default(),
        ring: Vec::new(),
        filled: 0,
        products: vec![Default::default(); torques],
        squares: vec![(0.0, 0.0); torques],
        grids: ranges.iter().map(|&range| Grid::new(range)).collect(),
        loads: ranges.iter().map(|&range| Grid::new(range)).collect(),
        frictions: ranges.iter().map(|&range| Grid::new(range)).collect(),
        times: ranges.iter().map(|_| Grid::new((0.0, duration))).collect(),
    };
    let mut scratch = design.scratch();
    let mut filter = FilterScratch::default();
    let mut filtered = FilteredRow { residual: vec![0.0; torques], fitted: vec![0.0; torques] };
    let mut failure = None;
    let mut rows = 0;
    for source in sources {
        let mut last = None;
        source.blocks(&mut |mut block| {
            design.correct(&mut block);
            if let Err(error) = scratch.begin(&block) {
                failure.get_or_insert(error);
                return;
            }
            let continues = last == Some((block.log, block.segment));
            last = Some((block.log, block.segment));
            let outputs = block.outputs.clone();
            if let [first, second, ..] = outputs[..] {
                let period = block.t[second] - block.t[first];
                let lags = LAGS.map(|lag| (lag / period).round().max(1.0) as usize);
                collector.begin(lags, continues);
                let filter = block.parallel_filter();
                collector.of_noise = lags.map(|lag| filter.noise_autocorrelation(lag * filter.decimation()));
            }
            let mut evaluated = Ok(());
            block.filter(
                design.evaluation_width(),
                &mut filter,
                |sample, row| {
                    if evaluated.is_ok() {
                        evaluated = scratch.evaluate(&block, sample, row);
                    }
                },
                |output, t, row| {
                    if !folds.iter().any(|fold| fold.log == block.log && fold.start <= t && t < fold.end) {
                        return collector.begin(collector.lags, false);
                    }
                    rows += 1;
                    filtered.set(design, parameters, row);
                    let [q, qd] = [&block.q, &block.qd].map(|signal| &signal[block.row(outputs[output])]);
                    collector.add(&filtered, q, qd, t + block.session_offset);
                },
            );
            if let Err(error) = evaluated {
                failure.get_or_insert(error);
            }
        })?;
    }
    if let Some(error) = failure {
        return Err(error.into());
    }
    Ok(collector.shape(rows))
}

impl FilteredRow {
    fn set(&mut self, design: &Design, parameters: &[f64], row: &[f64]) {
        for (torque, layout) in design.rows().iter().enumerate() {
            let columns = &row[layout.range.clone()];
            let value = |parameter: usize| parameters.get(parameter).copied().unwrap_or_default();
            let own = layout.parameters.iter().zip(columns);
            let fitted: f64 = own.map(|(&parameter, column)| value(parameter) * column).sum();
            let measured = columns[layout.parameters.len()];
            self.fitted[torque] = fitted;
            self.residual[torque] = if design.counts(row, torque) { measured - fitted } else { 0.0 };
        }
    }
}

impl Collector {
    fn shape(&self, rows: u64) -> ResidualShape {
        let correlation = |&(product, square): &(f64, f64)| if square > 0.0 { product / square } else { 0.0 };
        let largest = |sums: &[(f64, f64); LAGS.len()]| {
            let by_size = |a: &f64, b: &f64| a.abs().total_cmp(&b.abs());
            sums[..STRUCTURE_LAGS.len()].iter().map(correlation).max_by(by_size).unwrap_or_default()
        };
        let rms = |&(sum, rows): &(f64, f64)| (sum / rows.max(1.0)).sqrt();
        ResidualShape {
            rms: self.squares.iter().map(rms).collect(),
            autocorrelation: self.products.iter().map(largest).collect(),
            wander: self.products.iter().map(|sums| correlation(&sums[STRUCTURE_LAGS.len()])).collect(),
            ripple_frequencies: self.grids.iter().map(Grid::peaks).collect(),
            load_ripple_frequencies: self.loads.iter().map(Grid::peaks).collect(),
            friction_ripple_frequencies: self.frictions.iter().map(Grid::peaks).collect(),
            time_frequencies: self.times.iter().map(Grid::peaks).collect(),
            rows,
        }
    }

    fn begin(&mut self, lags: [usize; LAGS.len()], continues: bool) {
        if lags != self.lags {
            let longest = lags.into_iter().max().unwrap_or_default();
            self.ring = vec![vec![0.0; self.products.len()]; longest];
            self.lags = lags;
            self.filled = 0;
        } else if !continues {
            self.filled = 0;
        }
    }

    fn add(&mut self, row: &FilteredRow, positions: &[f64], speeds: &[f64], time: f64) {
        let residual = &row.residual;
        for (joint, &left) in residual.iter().enumerate() {
            if left != 0.0 {
                self.squares[joint].0 += left * left;
                self.squares[joint].1 += 1.0;
                let position = positions[joint];
                self.grids[joint].add(position, left);
                self.loads[joint].add(position, left * row.fitted[joint]);
                self.frictions[joint].add(position, left * speeds[joint].signum());
                self.times[joint].add(time, left);
            }
        }
        let size = self.ring.len();
        if size == 0 {
            return;
        }
        for (place, lag) in self.lags.into_iter().enumerate().filter(|(_, lag)| *lag <= self.filled) {
            let before = &self.ring[(self.filled - lag) % size];
            for ((sums, before), now) in self.products.iter_mut().zip(before).zip(residual) {
                sums[place].0 += before * now - self.of_noise[place] * now * now;
                sums[place].1 += now * now;
            }
        }
        self.ring[self.filled % size].copy_from_slice(residual);
        self.filled += 1;
    }
}
