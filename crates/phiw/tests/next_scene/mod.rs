//! A small robot that stands, motions of it, and logs of what it has run.
#![allow(dead_code, reason = "each test file uses its own part")]

use crate::synthetic;
use assert_cmd::Command;
use phiw_dynamics::Tree;
use phiw_dynamics::random_tree::RandomNumbers;
use phiw_dynamics::urdf::{UrdfOptions, read_urdf};
use phiw_telemetry::{Recording, TorqueColumns};
use serde_json::Value;
use std::f64::consts::TAU;
use std::path::PathBuf;
use tempfile::TempDir;

pub const JOINTS: usize = 3;
pub const SUPPORT: &str = "[[foot]]\nlink = \"base\"\nsole = [[0.22, 0.2, 0.0], [-0.2, 0.2, 0.0], [-0.2, -0.2, 0.0], [0.22, -0.2, 0.0]]\n";
const BASE: &str = r#"<link name="base"><inertial><origin xyz="0 0 0.1"/><mass value="40"/><inertia ixx="0.5" iyy="0.5" izz="0.5" ixy="0" ixz="0" iyz="0"/></inertial></link>"#;

/// The true robot, on a heavy base.
pub fn urdf() -> String {
    synthetic::URDF.replace("<link name=\"base\"/>", BASE)
}

pub fn tree(urdf: &str, floating_base: bool) -> Tree {
    read_urdf(urdf, &UrdfOptions { floating_base, ..UrdfOptions::default() }).unwrap().tree
}

/// A motion of 6 s at 100 Hz that begins and ends at rest: sines under a smooth window, `speed` times as fast
/// as a slow one.
pub fn motion(seed: u64, reach: f64, speed: f64) -> Recording {
    let mut random = RandomNumbers::new(seed);
    let sines: Vec<[f64; 3]> = (0..JOINTS)
        .map(|_| {
            [
                reach * random.uniform(0.5, 1.0),
                TAU * speed * random.uniform(0.2, 0.4),
                random.uniform(0.0, TAU),
            ]
        })
        .collect();
    let joints = tree(&urdf(), false).joint_names().map(str::to_owned).collect();
    let mut motion =
        Recording { joints, qd: Some(Vec::new()), qdd: Some(Vec::new()), ..Recording::default() };
    for row in 0..600 {
        let t = 0.01 * f64::from(row);
        // sin⁴: at rest at both ends.
        let (sine, cosine) = (TAU / 12.0 * t).sin_cos();
        let rate = TAU / 12.0;
        let w = sine.powi(4);
        let dw = 4.0 * rate * sine.powi(3) * cosine;
        let ddw = rate * rate * (12.0 * sine.powi(2) * cosine.powi(2) - 4.0 * sine.powi(4));
        for [amplitude, omega, phase] in &sines {
            let (s, c) = (omega * t + phase).sin_cos();
            let [q, v, a] = [amplitude * s, amplitude * omega * c, -amplitude * omega * omega * s];
            motion.q.push(w * q);
            motion.qd.as_mut().unwrap().push(dw * q + w * v);
            motion.qdd.as_mut().unwrap().push(ddw * q + 2.0 * dw * v + w * a);
        }
        motion.t.push(t);
    }
    motion
}

/// A folder with the robot, its support and twenty motions from calm to violent.
pub struct Scene(TempDir);

impl Scene {
    pub fn new(urdf: &str) -> Self {
        let scene = Scene(tempfile::tempdir().unwrap());
        std::fs::create_dir(scene.path("motions")).unwrap();
        for number in 0..20_u32 {
            let strength = 0.3 + 0.12 * f64::from(number);
            let recording = motion(u64::from(number), 0.3 * strength.min(1.5), strength);
            recording.write_csv(&scene.path(&format!("motions/m{number:02}.csv"))).unwrap();
        }
        std::fs::write(scene.path("robot.urdf"), urdf).unwrap();
        std::fs::write(scene.path("support.toml"), SUPPORT).unwrap();
        // Logs of the true robot.
        for (name, seed) in [("log_1.csv", 21), ("log_2.csv", 22)] {
            let log = synthetic::recording_of(&self::urdf(), seed, 15.0);
            log.write_csv(&scene.path(name)).unwrap();
        }
        scene
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// Exit status, standard output, standard error; `DIR` in the words stands for the folder.
    pub fn run(&self, words: &str) -> (i32, String, String) {
        let folder = self.0.path().display().to_string();
        let words = words.split_whitespace().map(|word| word.replace("DIR", &folder));
        let output = Command::cargo_bin("phiw").unwrap().args(words).output().unwrap();
        let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
        (output.status.code().unwrap(), text(output.stdout), text(output.stderr))
    }

    /// A run that must succeed: what it printed, and its report.
    pub fn next(&self, more: &str) -> (String, String, Value) {
        let line = format!("next --urdf DIR/robot.urdf --motions DIR/motions --out DIR/next.csv {more}");
        let (status, summary, warnings) = self.run(&line);
        assert_eq!(status, 0, "{warnings}");
        let report = std::fs::read_to_string(self.path("next.json")).unwrap();
        (summary, warnings, serde_json::from_str(&report).unwrap())
    }

    pub fn planned(&self) -> Recording {
        let joints: Vec<String> = tree(&urdf(), false).joint_names().map(str::to_owned).collect();
        Recording::from_csv(&self.path("next.csv"), &joints, TorqueColumns::Required).unwrap()
    }
}
