//! The data of one sample that an effect's columns are computed from.

use phiw_telemetry::Block;

/// What columns need beside the signals; computed only when some effect asks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Needs {
    /// The torques of the reference model.
    pub torque: bool,
    /// The rates of change of its torques, first and second of the rigid body's, first of the total.
    pub rates: bool,
    /// The torque of the reference model with its effects in it. A column made of it can stand for any of
    /// those effects, so it must not be compared with one of them.
    pub total_torque: bool,
    /// The derivatives of the reference model's torques by position, velocity and acceleration of each joint.
    pub derivatives: bool,
    /// Torques of unit gravity along x, y, z with the reference model's inertia.
    pub gravity: bool,
    /// The regressor's pairs at rest under unit gravity along x, y, z.
    pub statics: bool,
}

impl Needs {
    /// What either needs.
    pub fn union(self, other: Self) -> Self {
        Needs {
            torque: self.torque || other.torque,
            rates: self.rates || other.rates,
            total_torque: self.total_torque || other.total_torque,
            derivatives: self.derivatives || other.derivatives,
            gravity: self.gravity || other.gravity,
            statics: self.statics || other.statics,
        }
    }

    /// Whether a reference model is needed.
    pub fn of_reference(self) -> bool {
        self.torque || self.rates || self.total_torque || self.derivatives || self.gravity
    }

    /// Whether nothing is needed.
    pub fn is_empty(self) -> bool {
        self == Self::default()
    }
}

/// The reference model over a block, `[sample × joint]` (or `[sample × joint × joint]`, row the torque's),
/// empty where no effect needs it.
#[derive(Clone, Debug, Default)]
pub struct BlockReference {
    /// Torque of the rigid body \[N·m, N\].
    pub torque: Vec<f64>,
    /// Its rate of change \[N·m/s\].
    pub torque_rate: Vec<f64>,
    /// Its second rate of change \[N·m/s²\].
    pub torque_second_rate: Vec<f64>,
    /// Torque of the rigid body and of the reference's effects \[N·m, N\].
    pub total_torque: Vec<f64>,
    /// Its rate of change \[N·m/s\].
    pub total_torque_rate: Vec<f64>,
    /// ∂τ/∂q \[N·m/rad\].
    pub by_position: Vec<f64>,
    /// ∂τ/∂q̇ \[N·m·s/rad\].
    pub by_velocity: Vec<f64>,
    /// ∂τ/∂q̈, the mass matrix \[kg·m²\].
    pub by_acceleration: Vec<f64>,
    /// Torque of unit gravity along world x, y, z: `[sample × 3 × joint]`.
    pub gravity: Vec<f64>,
}

/// One sample, as an effect sees it. Slices are over the joints.
#[derive(Clone, Copy)]
pub struct Sample<'a> {
    pub(crate) block: &'a Block,
    pub(crate) reference: &'a BlockReference,
    pub(crate) index: usize,
    pub(crate) regressor: &'a [f64],
    pub(crate) statics: &'a [f64],
}

impl<'a> Sample<'a> {
    fn row(&self, values: &'a [f64]) -> &'a [f64] {
        values.get(self.block.row(self.index)).unwrap_or(&[])
    }
    fn matrix(&self, values: &'a [f64], rows: usize) -> &'a [f64] {
        let size = rows * self.block.joints;
        values.get(self.index * size..(self.index + 1) * size).unwrap_or(&[])
    }
    /// Which log of the session it is from, counted from 0.
    pub fn log(&self) -> usize {
        self.block.log
    }
    /// Time in the session \[s\].
    pub fn time(&self) -> f64 {
        self.block.t[self.index] + self.block.session_offset
    }
    /// Time since the log's first sample \[s\].
    pub fn time_in_log(&self) -> f64 {
        self.block.t[self.index] - self.block.log_start
    }
    /// Step to the next sample \[s\].
    pub fn period(&self) -> f64 {
        match self.block.t.as_slice() {
            [first, second, ..] => second - first,
            _ => 0.0,
        }
    }
    /// The band that positions, velocities and accelerations were smoothed to \[Hz\].
    pub fn motion_bandwidth_hz(&self) -> f64 {
        self.block.motion_bandwidth_hz
    }
    /// Positions \[rad, m\].
    pub fn q(&self) -> &'a [f64] {
        self.row(&self.block.q)
    }
    /// Velocities \[rad/s, m/s\].
    pub fn qd(&self) -> &'a [f64] {
        self.row(&self.block.qd)
    }
    /// Accelerations \[rad/s², m/s²\].
    pub fn qdd(&self) -> &'a [f64] {
        self.row(&self.block.qdd)
    }
    /// Measured torques, unfiltered \[N·m, N\].
    pub fn tau(&self) -> &'a [f64] {
        self.row(&self.block.tau)
    }
    /// Temperatures \[°C\], NaN where a joint has none; empty where no joint has.
    pub fn temperature(&self) -> &'a [f64] {
        self.block.temp.as_deref().map_or(&[], |temperatures| self.row(temperatures))
    }
    /// Torques of the reference model \[N·m, N\].
    pub fn reference_torque(&self) -> &'a [f64] {
        self.row(&self.reference.torque)
    }
    /// Rate of change of the reference torques \[N·m/s\].
    pub fn reference_torque_rate(&self) -> &'a [f64] {
        self.row(&self.reference.torque_rate)
    }
    /// Second rate of change of the reference torques \[N·m/s²\].
    pub fn reference_torque_second_rate(&self) -> &'a [f64] {
        self.row(&self.reference.torque_second_rate)
    }
    /// Torques of the reference model and its effects \[N·m, N\].
    pub fn total_torque(&self) -> &'a [f64] {
        self.row(&self.reference.total_torque)
    }
    /// Rate of change of the total torques \[N·m/s\].
    pub fn total_torque_rate(&self) -> &'a [f64] {
        self.row(&self.reference.total_torque_rate)
    }
    /// Second rate of change of the total torque of a joint, see [`second_rate`].
    pub fn total_torque_second_rate(&self, joint: usize) -> f64 {
        second_rate(self.block, &self.reference.total_torque, joint, self.index)
    }
    /// ∂τ/∂q, row-major, a row for each torque.
    pub fn torque_by_position(&self) -> &'a [f64] {
        self.matrix(&self.reference.by_position, self.block.joints)
    }
    /// ∂τ/∂q̇, row-major, a row for each torque.
    pub fn torque_by_velocity(&self) -> &'a [f64] {
        self.matrix(&self.reference.by_velocity, self.block.joints)
    }
    /// ∂τ/∂q̈ (the mass matrix), row-major.
    pub fn torque_by_acceleration(&self) -> &'a [f64] {
        self.matrix(&self.reference.by_acceleration, self.block.joints)
    }
    /// Torques of unit gravity along world x, y and z: three rows.
    pub fn torque_by_gravity(&self) -> &'a [f64] {
        self.matrix(&self.reference.gravity, 3)
    }
    /// The joint torque regressor's pairs of this sample (see `phiw_regressor::JointTorqueRegressor`), for
    /// effects that need [`statics`](Needs::statics).
    pub fn regressor_pairs(&self) -> &'a [f64] {
        self.regressor
    }
    /// The same at rest under unit gravity along world x, then y, then z.
    pub fn static_regressor_pairs(&self) -> &'a [f64] {
        self.statics
    }
}

/// Second differences are taken over this share of the shortest period that the motion has. Behind two
/// filters of known corners (`cargo xtask undeclared --case 1500006`, and 1500066) a sixteenth made time
/// constants a fifth too long, a sixty-fourth 1 and 2 %; less makes the noise of single samples larger, and
/// was not tried.
const STRIDE: f64 = 1.0 / 64.0;

/// Second rate of change of a joint's value at a sample, by the values a sixty-fourth of the motion's
/// shortest period before and after it; zero where the block has none. `values` are `[sample × joint]` over
/// the block.
pub fn second_rate(block: &Block, values: &[f64], joint: usize, sample: usize) -> f64 {
    let [first, .., last] = block.t.as_slice() else { return 0.0 };
    let period = (last - first) / (block.t.len() - 1) as f64;
    let stride = (STRIDE / (block.motion_bandwidth_hz * period)).round().max(1.0) as usize;
    let at = |sample: usize| values.get(sample * block.joints + joint);
    let neighbours = (sample.checked_sub(stride).and_then(at), at(sample), at(sample + stride));
    match neighbours {
        (Some(before), Some(here), Some(after)) => {
            (before - 2.0 * here + after) / (stride as f64 * period).powi(2)
        }
        _ => 0.0,
    }
}
