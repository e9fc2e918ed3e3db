//! Good inputs and what comes of them: what each spoiled input is compared with.

use super::case::Case;
use super::table::Table;
use super::trial::{Answer, Trial};
use phiw_bspline_retarget::embedded::embedded_motions;
use phiw_bspline_retarget::markers::MarkerRecording;
use phiw_dynamics::urdf::{UrdfOptions, read_urdf};
use phiw_dynamics::{JointType, Tree, Workspace};
use phiw_telemetry::Recording;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::collections::BTreeMap;
use std::f64::consts::TAU;
use std::path::{Path, PathBuf};

const SCARA: &str = include_str!("../../../../models/scara4.urdf");
const PLANAR: &str = include_str!("../../../../models/planar2.urdf");
const UPPER_BODY: &str = include_str!("../../../../models/upper_body18.urdf");
const UPPER_BODY_SUPPORT: &str = include_str!("../../../../models/upper_body18.support.toml");
/// Rows a second of the logs.
const RATE_HZ: f64 = 100.0;
/// Standard deviation of the torques' noise, as a share of their RMS.
const NOISE: f64 = 0.02;

/// The good inputs can't be made, or the program fails on them.
#[derive(Debug, thiserror::Error)]
pub enum GroundError {
    /// A file of the ground can't be written or read.
    #[error("{}: {source}", path.display())]
    File {
        /// Which.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// A good input can't be made.
    #[error("the good inputs: {0}")]
    Made(String),
    /// The program fails on a good input.
    #[error("phiw {words}: {story}; the good inputs must give a result before spoiled ones can be judged")]
    Fails {
        /// The command line.
        words: String,
        /// What it did.
        story: String,
    },
}

/// One run of the command that gives a result.
#[derive(Clone, Debug)]
pub struct GoodRun {
    /// The command line after `phiw`.
    pub words: Vec<String>,
    /// Its input files by name.
    pub files: Vec<String>,
    /// Its result.
    pub answer: Answer,
}

/// The good inputs, and what the program makes of them.
pub struct Ground {
    phiw: PathBuf,
    files: BTreeMap<String, Vec<u8>>,
    runs: BTreeMap<&'static str, GoodRun>,
    recording: MarkerRecording,
}

impl Ground {
    /// How far a result may be from that of the good input and still be the same: a share of the good
    /// held-out error, and as much again in percentage points of a hundredth. Losing a few per cent of the
    /// rows moves the error by less.
    pub const TOLERANCE: f64 = 0.15;

    /// Makes the good inputs and runs the program `phiw` on them.
    ///
    /// # Errors
    /// [`GroundError`].
    pub fn new(phiw: &Path, seed: u64) -> Result<Self, GroundError> {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let (files, recording) = good_files(&mut random)?;
        let mut ground = Ground { phiw: phiw.to_owned(), files, runs: BTreeMap::new(), recording };
        let fit = "identify --urdf robot.urdf --train train.csv --validate validate.csv --declare viscous_friction --out out";
        let fit_files = ["robot.urdf", "train.csv", "validate.csv"];
        ground.add("identify", fit, &fit_files)?;
        let alone = "identify --urdf robot.urdf --train train.csv --declare viscous_friction --out out";
        ground.add("held out by itself", alone, &fit_files[..2])?;
        ground.add(
            "explain",
            &fit.replace("identify", "explain").replace(" --declare viscous_friction", ""),
            &fit_files,
        )?;
        let next = "next --urdf robot.urdf --motions motions --measured train.csv --declare viscous_friction --out plan.csv";
        let motions: Vec<String> =
            ground.files.keys().filter(|name| name.starts_with("motions/")).cloned().collect();
        let next_files: Vec<&str> =
            ["robot.urdf", "train.csv"].into_iter().chain(motions.iter().map(String::as_str)).collect();
        ground.add("next", next, &next_files)?;
        let retarget = "retarget --urdf human.urdf --c3d recording.c3d --out out";
        ground.add("retarget", retarget, &["human.urdf", "recording.c3d"])?;
        let model = ground.trial("identify", &[])?.result_file("model.json");
        let model =
            model.ok_or_else(|| GroundError::Made("`identify` has written no model.json".to_owned()))?;
        ground.files.insert("model.json".to_owned(), model);
        let held = "explain --urdf robot.urdf --train validate.csv --model model.json --out out";
        ground.add("held model", held, &["robot.urdf", "validate.csv", "model.json"])?;
        let predict = "predict --model model.json validate.csv --out predicted.csv";
        ground.add("predict", predict, &["validate.csv", "model.json"])?;
        let simulate = "simulate --model model.json validate.csv --out out";
        ground.add("simulate", simulate, &["validate.csv", "model.json"])?;
        Ok(ground)
    }

    /// A good file.
    pub fn file(&self, name: &str) -> &[u8] {
        self.files.get(name).map_or(&[], Vec::as_slice)
    }

    /// All good files by name.
    pub fn files(&self) -> impl Iterator<Item = (&str, &[u8])> {
        self.files.iter().map(|(name, content)| (name.as_str(), content.as_slice()))
    }

    /// A good file's text.
    pub fn text(&self, name: &str) -> String {
        String::from_utf8_lossy(self.file(name)).into_owned()
    }

    /// A good log as cells.
    pub fn table(&self, name: &str) -> Table {
        Table::parse(&self.text(name))
    }

    /// The good run of that key; the keys are those of [`Ground::new`].
    pub fn run(&self, key: &str) -> &GoodRun {
        &self.runs[key]
    }

    /// What the good recording holds.
    pub fn recording(&self) -> &MarkerRecording {
        &self.recording
    }

    /// The program.
    pub fn phiw(&self) -> &Path {
        &self.phiw
    }

    fn add(&mut self, key: &'static str, words: &str, files: &[&str]) -> Result<(), GroundError> {
        let words: Vec<String> = words.split(' ').map(str::to_owned).collect();
        let files = files.iter().map(|&name| name.to_owned()).collect();
        self.runs.insert(key, GoodRun { words: words.clone(), files, answer: Answer::default() });
        let trial = self.trial(key, &[])?;
        match (trial.status, trial.answer.clone()) {
            (Some(0), Some(answer)) => {
                if let Some(run) = self.runs.get_mut(key) {
                    run.answer = answer;
                }
                Ok(())
            }
            _ => Err(GroundError::Fails { words: words.join(" "), story: trial.story() }),
        }
    }

    /// A run on the good files of that key, and on `more` in their place.
    fn trial(&self, key: &str, more: &[(String, Vec<u8>)]) -> Result<Trial, GroundError> {
        let run = &self.runs[key];
        let files =
            run.files.iter().map(|name| (name.clone(), self.file(name).to_vec())).chain(more.iter().cloned());
        Trial::run(&self.phiw, files, &run.words, Case::PLAIN)
            .map_err(|source| GroundError::File { path: self.phiw.clone(), source })
    }
}

fn good_files(random: &mut ChaCha8Rng) -> Result<(BTreeMap<String, Vec<u8>>, MarkerRecording), GroundError> {
    let made = |error: &dyn std::fmt::Display| GroundError::Made(error.to_string());
    let tree = read_urdf(SCARA, &UrdfOptions::default()).map_err(|error| made(&error))?.tree;
    let mut files = BTreeMap::new();
    let mut put = |name: &str, content: Vec<u8>| files.insert(name.to_owned(), content);
    put("robot.urdf", SCARA.into());
    put("other.urdf", PLANAR.into());
    put("human.urdf", UPPER_BODY.into());
    put("human.support.toml", UPPER_BODY_SUPPORT.into());
    for (name, seconds) in [("train.csv", 12.0), ("validate.csv", 8.0)] {
        let mut text = Vec::new();
        let log = log(&tree, seconds, random).map_err(|error| made(&error))?;
        log.write_to(&mut text).map_err(|error| made(&error))?;
        put(name, text);
    }
    for number in 0..6 {
        let mut text = Vec::new();
        motion(&tree, 0.4 + 0.1 * f64::from(number), random)
            .write_to(&mut text)
            .map_err(|error| made(&error))?;
        put(&format!("motions/m{number}.csv"), text);
    }
    let mut recording = embedded_motions(3)
        .map_err(|error| made(&error))?
        .nth(20)
        .ok_or_else(|| GroundError::Made("there are fewer than 21 embedded motions".to_owned()))?;
    let markers = recording.recording.labels.len();
    recording.recording.positions_m.truncate(120 * markers);
    put("recording.c3d", recording.to_c3d());
    Ok((files, recording.recording))
}

/// Amplitude, angular frequency and phase of the sines that a joint follows.
fn sines(tree: &Tree, strength: f64, random: &mut ChaCha8Rng) -> Vec<[[f64; 3]; 4]> {
    let mut joint = |joint: usize| {
        // A slide of a small arm moves by centimetres.
        let reach = if tree.joint(joint).joint_type == JointType::Prismatic { 0.03 } else { 0.3 };
        std::array::from_fn(|harmonic| {
            let frequency_hz = 0.15 * (harmonic + 1) as f64 + random.random_range(0.0..0.1);
            [
                strength * reach * random.random_range(0.5..1.0),
                TAU * frequency_hz,
                random.random_range(0.0..TAU),
            ]
        })
    };
    (0..tree.joint_count()).map(&mut joint).collect()
}

fn sum(sines: &[[[f64; 3]; 4]], term: impl Fn(&[f64; 3]) -> f64) -> Vec<f64> {
    sines.iter().map(|sines| sines.iter().map(&term).sum()).collect()
}

/// A robot with viscous friction, following sines.
fn log(
    tree: &Tree,
    seconds: f64,
    random: &mut ChaCha8Rng,
) -> Result<Recording, phiw_dynamics::DimensionError> {
    let sines = sines(tree, 1.0, random);
    let joints = tree.joint_count();
    let mut log =
        Recording { joints: tree.joint_names().map(str::to_owned).collect(), ..Recording::default() };
    let mut workspace = Workspace::new(tree);
    let mut torque = vec![0.0; joints];
    for row in 0..(seconds * RATE_HZ) as usize {
        let t = row as f64 / RATE_HZ;
        let q = sum(&sines, |[a, w, p]| a * (w * t + p).sin());
        let v = sum(&sines, |[a, w, p]| a * w * (w * t + p).cos());
        let a = sum(&sines, |[a, w, p]| -a * w * w * (w * t + p).sin());
        tree.inverse_dynamics(&q, &v, &a, &mut workspace, &mut torque)?;
        log.t.push(t);
        log.q.extend(q);
        log.tau.extend(torque.iter().zip(v).map(|(torque, v)| torque + 3.0 * v));
    }
    for joint in 0..joints {
        let of_joint = || log.tau.iter().skip(joint).step_by(joints);
        let rms = (of_joint().map(|torque| torque * torque).sum::<f64>() / log.t.len() as f64).sqrt();
        for torque in log.tau.iter_mut().skip(joint).step_by(joints) {
            // A sum of uniform numbers is near enough to a normal one.
            let noise: f64 = (0..12).map(|_| random.random_range(-0.5..0.5)).sum();
            *torque += NOISE * rms * noise;
        }
    }
    Ok(log)
}

/// A reference motion of 5 s that begins and ends at rest, with its derivatives.
fn motion(tree: &Tree, strength: f64, random: &mut ChaCha8Rng) -> Recording {
    let sines = sines(tree, strength, random);
    let joints = tree.joint_names().map(str::to_owned).collect();
    let mut motion =
        Recording { joints, qd: Some(Vec::new()), qdd: Some(Vec::new()), ..Recording::default() };
    let rate = TAU / 10.0;
    for row in 0..=500 {
        let t = f64::from(row) / RATE_HZ;
        // sin⁴: at rest at both ends.
        let (sine, cosine) = (rate * t).sin_cos();
        let [w, dw, ddw] = [
            sine.powi(4),
            4.0 * rate * sine.powi(3) * cosine,
            rate * rate * (12.0 * sine.powi(2) * cosine.powi(2) - 4.0 * sine.powi(4)),
        ];
        let q = sum(&sines, |[a, w, p]| a * (w * t + p).sin());
        let v = sum(&sines, |[a, w, p]| a * w * (w * t + p).cos());
        let a = sum(&sines, |[a, w, p]| -a * w * w * (w * t + p).sin());
        for ((q, v), a) in q.iter().zip(v).zip(a) {
            motion.q.push(w * q);
            motion.qd.as_mut().unwrap_or(&mut Vec::new()).push(dw * q + w * v);
            motion.qdd.as_mut().unwrap_or(&mut Vec::new()).push(ddw * q + 2.0 * dw * v + w * a);
        }
        motion.t.push(t);
    }
    motion
}
