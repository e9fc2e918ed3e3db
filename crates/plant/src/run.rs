//! What a run gives.

use crate::History;
use phiw_telemetry::Recording;

/// What the plant did when it followed a reference.
#[derive(Clone, Debug, PartialEq)]
pub struct PlantRun {
    /// The log: what a real robot would have written. Its stamps go on from run to run of one plant.
    pub recording: Recording,
    /// What the floor (or the mounting of a fixed base) gave to the robot, one for each row of the recording.
    pub reactions: Vec<Reaction>,
    /// When a standing robot's base had tilted too far, since the motion's start \[s\]; the run ends there.
    pub fell_at_s: Option<f64>,
    /// RMS of each joint's tracking error over the motion \[rad, m\].
    pub tracking_error: Vec<f64>,
    /// The truth, for tests and for scores; no identification may see it.
    pub history: History,
}

/// Force and moment between robot and floor, as a force plate measures them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reaction {
    /// Force \[N\], then moment about the world's origin \[N·m\], along the world's axes; a mean over the
    /// torque's window.
    pub wrench: [f64; 6],
    /// The ZMP on the floor z = 0 \[m\]; none while the robot does not press on the floor.
    pub zmp: Option<[f64; 2]>,
}

impl Reaction {
    /// The ZMP is where the floor's moment about level axes vanishes: x = −m_y/f_z, y = m_x/f_z.
    pub fn of_wrench(wrench: [f64; 6]) -> Self {
        let [_, _, force, moment_x, moment_y, _] = wrench;
        let presses = force > 0.0;
        Reaction { wrench, zmp: presses.then(|| [-moment_y / force, moment_x / force]) }
    }
}
