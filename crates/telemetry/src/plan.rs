//! A conditioning applied to one log.

use crate::clock::{Clock, ClockChoice};
use crate::cutoff::BANDWIDTHS;
use crate::kernel::{LowPass, SmoothingKernel};
use crate::parallel_filter::ParallelFilter;
use crate::{Conditioning, LogError, Survey};
use std::fmt;
use std::sync::Arc;

/// What a [`Conditioning`] comes to for one log.
#[derive(Debug, Clone)]
pub struct LogPlan {
    /// Distance of the conditioned samples, in seconds.
    pub period: f64,
    /// How the stamps are read.
    pub clock: Clock,
    /// Whether samples are interpolated to equal distances.
    pub resample: bool,
    /// The low-pass over positions, with its derivatives.
    pub kernel: SmoothingKernel,
    /// Frequency up to which the positions move, in Hz.
    pub motion_bandwidth_hz: f64,
    /// The filter over columns and torque.
    pub parallel: Arc<ParallelFilter>,
    /// Samples at each end of a segment that are not used: there the cut kernel would more than double the
    /// noise of the acceleration.
    pub edge: usize,
    /// Samples that a segment needs at least.
    pub shortest: usize,
    /// Leading samples of a block that no output covers.
    pub warm_up: usize,
    /// Outputs of a block, at most.
    pub outputs_per_block: usize,
    /// For each joint, whether its measured velocity is used.
    pub measured_velocity: Vec<bool>,
    /// For each joint, whether its measured acceleration is used.
    pub measured_acceleration: Vec<bool>,
}

/// Jitter below which the two clocks are the same.
const EVEN: f64 = 1e-4;
/// Attenuation of the positions' low-pass outside its band, in dB.
const ATTENUATION_DB: f64 = 80.0;
/// Times the noise of the acceleration may grow where the kernel is cut.
const NOISE_AT_EDGE: f64 = 2.0;

impl Conditioning {
    /// What the conditioning comes to for one log: kernels for its sample rate, its clock, its measured
    /// derivatives.
    ///
    /// # Errors
    /// [`LogError::Cutoff`] for a cut-off that the log's sample rate can't carry.
    pub fn plan(&self, survey: &Survey) -> Result<LogPlan, LogError> {
        self.check(survey)?;
        Ok(LogPlan::new(self, survey))
    }
}

impl LogPlan {
    fn new(conditioning: &Conditioning, survey: &Survey) -> Self {
        let options = &conditioning.options;
        let clock = match options.clock {
            ClockChoice::Auto => survey.clock,
            ClockChoice::Fixed(clock) => clock,
        };
        let period = survey.period;
        let [cutoff_hz, parallel_cutoff_hz] = conditioning.cutoffs_for(survey);
        let kernel = SmoothingKernel::new(LowPass::new(cutoff_hz, ATTENUATION_DB), period);
        let parallel = ParallelFilter::new(parallel_cutoff_hz, period, options.decimation);
        let edge = edge(&kernel);
        // One logger wrote the velocities of all joints. Of a joint that moves slowly it shows less whether
        // they are late, and its torque is none the less.
        let on_time = !survey.joints.iter().any(|joint| joint.velocity.is_some_and(|own| own.is_late()));
        let measured = |plausible: &dyn Fn(&crate::joint_survey::JointSurvey) -> bool| {
            survey.joints.iter().map(|joint| options.use_measured_derivatives && plausible(joint)).collect()
        };
        LogPlan {
            period,
            clock,
            resample: clock == Clock::Stamped && survey.jitter > EVEN,
            edge,
            shortest: (kernel.half_length() + 1).max(2 * edge + 1),
            warm_up: (options.warm_up / period).ceil() as usize,
            // Bounded so that sample numbers can't overflow.
            outputs_per_block: (options.block_samples / parallel.decimation()).clamp(1, 1 << 32),
            measured_velocity: measured(&|joint| {
                on_time && joint.velocity.is_some_and(|velocity| velocity.plausible())
            }),
            measured_acceleration: measured(&|joint| {
                joint.acceleration.is_some_and(|signal| signal.plausible())
            }),
            motion_bandwidth_hz: cutoff_hz / BANDWIDTHS,
            kernel,
            parallel: Arc::new(parallel),
        }
    }

    /// Samples from one output to the next.
    pub fn decimation(&self) -> usize {
        self.parallel.decimation()
    }

    /// Rate of the outputs, in Hz.
    pub fn output_rate_hz(&self) -> f64 {
        1.0 / (self.period * self.decimation() as f64)
    }
}

/// The noise falls with every sample more, so the place is found by bisection.
fn edge(kernel: &SmoothingKernel) -> usize {
    let highest = NOISE_AT_EDGE * kernel.noise_gain()[2];
    let (mut low, mut high) = (0, kernel.half_length());
    while low < high {
        let middle = low.midpoint(high);
        match kernel.noise_gain_at_end(middle)[2] > highest {
            true => low = middle + 1,
            false => high = middle,
        }
    }
    low
}

impl fmt::Display for LogPlan {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let rate = 1.0 / self.period;
        write!(
            f,
            "{rate:.1} Hz, {} clock, low-pass of {} taps, ",
            self.clock,
            2 * self.kernel.half_length() + 1
        )?;
        write!(f, "one output in {} samples ({:.1} Hz)", self.decimation(), self.output_rate_hz())
    }
}
