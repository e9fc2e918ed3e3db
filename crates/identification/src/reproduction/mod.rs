//! How well a model reproduces a log: started from a measured state and driven by the measured torque, how
//! fast it goes another way.

mod errors;
mod plant;
mod windows;

pub use errors::{ErrorGrowth, reproduce};
pub use plant::{Plant, PlantError};
pub use windows::{Window, collect_windows};

/// How logs are reproduced.
#[derive(Clone, Debug, PartialEq)]
pub struct ReproductionSettings {
    /// Length of a window \[s\]: errors are told after 0.5, 1 and 2 s.
    pub window_s: f64,
    /// Distance of the horizons at which the error is taken \[s\].
    pub horizon_step_s: f64,
    /// Longest step of the integration \[s\]. Half of it changes the errors on tx40, emps and kr300 by at
    /// most a hundredth of themselves.
    pub longest_step_s: f64,
    /// Windows of all logs together; they are spread evenly over the logs.
    pub most_windows: usize,
    /// In closed loop, the natural frequency \[rad/s\] of each joint's error under its own inertia;
    /// critically damped. Slow against a real drive's loop, so that what the model lacks is not hidden.
    pub loop_frequency: f64,
}

impl Default for ReproductionSettings {
    fn default() -> Self {
        ReproductionSettings {
            window_s: 2.0,
            horizon_step_s: 0.05,
            longest_step_s: 0.5e-3,
            most_windows: 40,
            loop_frequency: 10.0,
        }
    }
}
