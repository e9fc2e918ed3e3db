//! The filter that goes over regressor columns and torques alike, decimating.

use crate::kernel::LowPass;

/// A decimating zero-phase low-pass over rows of any width.
///
/// The same linear operator goes over the columns and the torque, so it takes noise away without bias
/// (parallel filtering). At the end of a segment its kernel is cut and scaled to sum one.
#[derive(Debug, Clone, PartialEq)]
pub struct ParallelFilter {
    half_length: usize,
    decimation: usize,
    /// Taps at offsets −half…half, sum one.
    taps: Vec<f64>,
    /// Sum of the taps before each: the weight of a cut kernel is a difference of two.
    sums: Vec<f64>,
}

impl ParallelFilter {
    /// Attenuation outside the band, in dB. It only has to keep noise from folding back.
    const ATTENUATION_DB: f64 = 60.0;
    /// Output rate over cut-off: half of it lies above the transition band's end.
    const OVERSAMPLING: f64 = 4.0;

    /// The filter for samples `period` seconds apart. `decimation` samples lie between two outputs; by
    /// default as many as the cut-off allows.
    pub fn new(cutoff_hz: f64, period: f64, decimation: Option<usize>) -> Self {
        let low_pass = LowPass::new(cutoff_hz, Self::ATTENUATION_DB);
        let half_length = low_pass.half_length(period);
        let decimation =
            decimation.unwrap_or((1.0 / (Self::OVERSAMPLING * cutoff_hz * period)) as usize).max(1);
        let mut taps: Vec<f64> =
            (0..=2 * half_length).map(|j| low_pass.at((j as f64 - half_length as f64) * period)[0]).collect();
        let sum: f64 = taps.iter().sum();
        taps.iter_mut().for_each(|tap| *tap /= sum);
        let mut sums = vec![0.0];
        for (i, tap) in taps.iter().enumerate() {
            sums.push(sums[i] + tap);
        }
        ParallelFilter { half_length, decimation, taps, sums }
    }

    /// The filter that leaves everything as it is.
    pub(crate) fn identity() -> Self {
        ParallelFilter { half_length: 0, decimation: 1, taps: vec![1.0], sums: vec![0.0, 1.0] }
    }

    /// Samples on one side of the middle one.
    pub fn half_length(&self) -> usize {
        self.half_length
    }

    /// Samples from one output to the next.
    pub fn decimation(&self) -> usize {
        self.decimation
    }

    /// Taps at offsets −half…half.
    pub fn taps(&self) -> &[f64] {
        &self.taps
    }

    /// Autocorrelation that white noise has after the filter, `lag` samples apart.
    pub fn noise_autocorrelation(&self, lag: usize) -> f64 {
        let product: f64 = self.taps.iter().zip(self.taps.iter().skip(lag)).map(|(a, b)| a * b).sum();
        product / self.taps.iter().map(|tap| tap * tap).sum::<f64>()
    }

    /// Filters rows of `width` values. `range` are the samples at hand, `outputs` the samples to put out,
    /// ascending. `evaluate` fills the row of a sample (asked once for each that an output covers,
    /// ascending); `emit` gets each output's place in `outputs` and its row.
    ///
    /// # Errors
    /// What either of them returns; nothing more is asked then.
    pub(crate) fn run<E>(
        &self,
        range: std::ops::Range<usize>,
        outputs: &[usize],
        width: usize,
        scratch: &mut FilterScratch,
        mut evaluate: impl FnMut(usize, &mut [f64]) -> Result<(), E>,
        mut emit: impl FnMut(usize, &[f64]) -> Result<(), E>,
    ) -> Result<(), E> {
        let (Some(&first), Some(&last)) = (outputs.first(), outputs.last()) else { return Ok(()) };
        // The widest vector instructions of the processor are used, since rows can have thousands of numbers.
        let arch = pulp::Arch::new();
        let slots = 2 * self.half_length / self.decimation + 2;
        scratch.resize(width, slots);
        let covered = |output: usize| {
            (output.saturating_sub(self.half_length)).max(range.start)
                ..(output + self.half_length + 1).min(range.end)
        };
        // Outputs begun and finished so far.
        let (mut begun, mut finished) = (0, 0);
        for sample in covered(first).start..covered(last).end {
            while begun < outputs.len() && covered(outputs[begun]).start <= sample {
                let slot = begun % slots;
                scratch.sums[slot * width..(slot + 1) * width].fill(0.0);
                begun += 1;
            }
            if finished == begun {
                continue;
            }
            evaluate(sample, &mut scratch.row)?;
            for index in finished..begun {
                let tap = self.taps[sample + self.half_length - outputs[index]];
                let slot = index % slots;
                let sums = &mut scratch.sums[slot * width..(slot + 1) * width];
                let row = &scratch.row;
                arch.dispatch(
                    #[inline(always)]
                    || sums.iter_mut().zip(row).for_each(|(sum, value)| *sum += tap * value),
                );
            }
            while finished < begun && covered(outputs[finished]).end == sample + 1 {
                let slot = finished % slots;
                let sums = &mut scratch.sums[slot * width..(slot + 1) * width];
                let scale = 1.0 / self.weight(covered(outputs[finished]), outputs[finished]);
                sums.iter_mut().for_each(|sum| *sum *= scale);
                emit(finished, sums)?;
                finished += 1;
            }
        }
        Ok(())
    }

    /// Sum of the taps that fall on `covered`.
    fn weight(&self, covered: std::ops::Range<usize>, output: usize) -> f64 {
        self.sums[covered.end + self.half_length - output]
            - self.sums[covered.start + self.half_length - output]
    }
}

/// What [`Block::filter`](crate::Block::filter) works in; make it once and use it for every block.
#[derive(Debug, Clone, Default)]
pub struct FilterScratch {
    row: Vec<f64>,
    /// One accumulator for each output under way, flat.
    sums: Vec<f64>,
}

impl FilterScratch {
    fn resize(&mut self, width: usize, slots: usize) {
        self.row.clear();
        self.row.resize(width, 0.0);
        self.sums.resize(width * slots, 0.0);
    }
}
