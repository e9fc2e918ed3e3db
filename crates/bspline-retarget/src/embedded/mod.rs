//! Synthetic motions for a machine without data: the tasks of the paper's Table 1 with its counts and
//! durations.
//!
//! **These are not measured on people.** Joint angles are smooth patterns that resemble each task (stirring
//! circles, cutting strokes, …), on bodies of different size, with markers misplaced on the skin, noise of
//! the cameras, and occlusions. They exercise the whole way from a C3D file to a robot's motion, and excite a
//! robot's joints broadly; they say nothing about people.

mod task;

use task::normal;
pub use task::{TASKS, Task};

use crate::c3d::{C3dFormat, write_c3d};
use crate::human::{HumanBody, MapError, MarkerMap, SEGMENT_PARAMETERS};
use crate::recording::MarkerRecording;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::collections::BTreeMap;

/// Frames per second \[Hz\].
const RATE_HZ: f64 = 100.0;
/// Standard deviation of the cameras' noise \[m\].
const NOISE_M: f64 = 0.0005;
/// Standard deviation of where a marker is glued \[m\].
const PLACEMENT_M: f64 = 0.008;
/// Standard deviation of a person's size, as a share.
const SIZE_SPREAD: f64 = 0.06;
/// Time that a hand needs to its place of work and back \[s\].
const APPROACH_S: f64 = 1.2;
/// Occlusions of a marker in a minute, and their longest duration \[s\].
const OCCLUSIONS_PER_MIN: f64 = 3.0;
const LONGEST_OCCLUSION_S: f64 = 0.5;

/// A synthetic motion.
#[derive(Clone, Debug, PartialEq)]
pub struct EmbeddedMotion {
    /// `stir_07`.
    pub name: String,
    /// What is done.
    pub task: &'static str,
    /// What the cameras saw.
    pub recording: MarkerRecording,
    /// The human's coordinates by name \[rad, m\], frame by frame: the truth behind the markers.
    pub coordinates: Vec<(String, Vec<f64>)>,
    /// The lengths ξ^h of the person \[m\].
    pub lengths_m: Vec<f64>,
}

impl EmbeddedMotion {
    /// The motion as a C3D file, which says of itself that it is synthetic.
    pub fn to_c3d(&self) -> Vec<u8> {
        let notes = [
            ("MANUFACTURER", "SOFTWARE", "phiw, synthetic: not measured on a person"),
            ("SUBJECTS", "TASK", self.task),
        ];
        write_c3d(&self.recording, C3dFormat::default(), &notes)
    }
}

/// All motions of Table 1, 110 of them, the same for the same seed.
///
/// # Errors
/// None, as long as the embedded map fits itself, which is tested; as [`MarkerMap::embedded`] otherwise.
pub fn embedded_motions(seed: u64) -> Result<impl Iterator<Item = EmbeddedMotion>, MapError> {
    let model = Model::new()?;
    let numbered = TASKS.iter().flat_map(|task| (0..task.count).map(move |number| (task, number)));
    Ok(numbered.enumerate().map(move |(index, (task, number))| {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        random.set_stream(index as u64 + 1);
        motion(&model, task, number, &mut random)
    }))
}

/// The human model of the embedded map, and its markers' labels.
struct Model {
    body: HumanBody,
    labels: Vec<String>,
}

impl Model {
    fn new() -> Result<Self, MapError> {
        let map = MarkerMap::embedded()?;
        let labels: Vec<String> = map
            .segments
            .values()
            .flat_map(|segment| segment.at.keys().chain(segment.at_end.keys()))
            .cloned()
            .collect();
        // A body is made for a recording: one that shows every marker.
        let positions_m = vec![[0.0; 3]; labels.len()];
        let recording = MarkerRecording { rate_hz: RATE_HZ, labels: labels.clone(), positions_m };
        let body = HumanBody::new(&map, &recording, &BTreeMap::new(), None, false, 0)?;
        Ok(Model { body, labels })
    }
}

fn motion(model: &Model, task: &'static Task, number: usize, random: &mut ChaCha8Rng) -> EmbeddedMotion {
    // The shortest and the longest of a task are as Table 1 says.
    let share = match number {
        0 => 0.0,
        1 => 1.0,
        _ => random.random::<f64>(),
    };
    let duration_s = task.shortest_s + share * (task.longest_s - task.shortest_s);
    let frames = (duration_s * RATE_HZ).round() as usize + 1;
    let Model { body, labels } = model;
    let positions_m = vec![[0.0; 3]; frames * labels.len()];
    let mut recording = MarkerRecording { rate_hz: RATE_HZ, labels: labels.clone(), positions_m };
    let size = 1.0 + SIZE_SPREAD * normal(random);
    let lengths_m: Vec<f64> = SEGMENT_PARAMETERS
        .iter()
        .map(|parameter| size * parameter.typical_m + 0.3 * parameter.spread_m * normal(random))
        .collect();
    let mut columns = vec![0.0; body.trajectories.len()];
    columns.extend(&lengths_m);
    let placed = body.parameters[lengths_m.len()..].iter();
    columns.extend(placed.map(|parameter| parameter.mean + PLACEMENT_M * normal(random)));
    let patterns = task.patterns(random);
    let place = [0.4 * normal(random), 0.4 * normal(random), 0.95 * size, 0.5 * normal(random)];
    let mut coordinates: Vec<(String, Vec<f64>)> =
        body.trajectories.iter().map(|c| (c.name.clone(), Vec::with_capacity(frames))).collect();
    let mut scratch = body.kinematics.scratch();
    for frame in 0..frames {
        let t = frame as f64 / RATE_HZ;
        let work = smooth(t / APPROACH_S) * smooth((duration_s - t) / APPROACH_S);
        for (column, (name, values)) in coordinates.iter_mut().enumerate() {
            let rest = match name.as_str() {
                "pelvis_x" => place[0],
                "pelvis_y" => place[1],
                "pelvis_z" => place[2],
                "pelvis_yaw" => place[3],
                _ => task::standing(name),
            };
            let pattern = patterns.iter().filter(|pattern| pattern.joint == *name);
            let away: f64 = pattern.map(|pattern| pattern.at(t)).sum();
            columns[column] = rest + work * away;
            values.push(columns[column]);
        }
        body.kinematics.place(&columns, &mut scratch);
        for (point, &marker) in body.markers.iter().enumerate() {
            let position = body.kinematics.position(point, &scratch).0;
            let at = frame * recording.labels.len() + marker;
            recording.positions_m[at] = position.map(|coordinate| coordinate + NOISE_M * normal(random));
        }
    }
    occlude(&mut recording, random);
    EmbeddedMotion {
        name: format!("{}_{:02}", task.name.to_lowercase(), number + 1),
        task: task.name,
        recording,
        coordinates,
        lengths_m,
    }
}

/// Hides markers for a while.
fn occlude(recording: &mut MarkerRecording, random: &mut ChaCha8Rng) {
    let (frames, markers) = (recording.frames(), recording.labels.len());
    let chance = OCCLUSIONS_PER_MIN / 60.0 / RATE_HZ;
    for marker in 0..markers {
        let mut hidden = 0usize;
        for frame in 0..frames {
            if random.random::<f64>() < chance {
                hidden = (random.random::<f64>() * LONGEST_OCCLUSION_S * RATE_HZ) as usize;
            }
            if hidden > 0 {
                hidden -= 1;
                recording.positions_m[frame * markers + marker] = [f64::NAN; 3];
            }
        }
    }
}

/// From 0 to 1 with no velocity, acceleration or jerk at the ends.
fn smooth(share: f64) -> f64 {
    let s = share.clamp(0.0, 1.0);
    s.powi(4) * (35.0 - 84.0 * s + 70.0 * s * s - 20.0 * s.powi(3))
}
