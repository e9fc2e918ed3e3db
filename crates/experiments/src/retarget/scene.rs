//! The robot, the recordings and what is needed to retarget one, for all measurements.

use crate::environment;
use anyhow::Context;
use phiw_bspline_retarget::human::MarkerMap;
use phiw_bspline_retarget::markers::{MarkerRecording, read_recording};
use phiw_bspline_retarget::{Calibration, RetargetOptions, Retargeter};
use phiw_dynamics::Tree;
use phiw_dynamics::urdf::{UrdfOptions, read_urdf_file};
use std::path::PathBuf;

/// Joints of the 20-joint Torobo that the paper's 18-joint robot has not.
const HELD: [&str; 2] = ["torso/joint_3", "head/joint_1"];

/// The robot, the person and the files that the measurements are made on.
pub(super) struct Scene {
    pub(super) urdf: PathBuf,
    pub(super) hold: Vec<(String, f64)>,
    pub(super) tree: Tree,
    /// The folder of the set `ue_adl`, if it is there.
    pub(super) seated: Option<PathBuf>,
}

impl Scene {
    /// The Torobo and the seated set of the shared data; the project's own robot where they are absent.
    pub(super) fn find() -> anyhow::Result<Self> {
        let root = environment::workspace_root()?;
        let torobo = root.join("../shared/data/robots/torobo20/torobo20.urdf");
        let (urdf, hold) = if torobo.is_file() {
            (torobo, HELD.map(|joint| (joint.to_owned(), 0.0)).to_vec())
        } else {
            println!("skipped: ../shared/data/robots is absent; the robot is models/upper_body18.urdf");
            (root.join("models/upper_body18.urdf"), vec![])
        };
        let options = UrdfOptions { held: hold.clone(), ..UrdfOptions::default() };
        let tree = read_urdf_file(&urdf, &options)?.tree;
        let seated = Some(root.join("../shared/data/motions/ue_adl/c3d")).filter(|folder| folder.is_dir());
        if seated.is_none() {
            println!("skipped: ../shared/data/motions is absent; the embedded motions stand in");
        }
        Ok(Scene { urdf, hold, tree, seated })
    }

    pub(super) fn retargeter(&self, map: MarkerMap, options: RetargetOptions) -> anyhow::Result<Retargeter> {
        Ok(Retargeter::new(self.tree.clone(), map, options)?)
    }

    /// A drinking motion of the seated set, or an embedded one.
    pub(super) fn example(&self, seed: u64, options: RetargetOptions) -> anyhow::Result<Example> {
        let Some(folder) = &self.seated else {
            let retargeter = self.retargeter(MarkerMap::embedded()?, options)?;
            let motion =
                phiw_bspline_retarget::embedded::embedded_motions(seed)?.find(|motion| motion.task == "Pour");
            let motion = motion.context("no embedded motion")?;
            return Ok(Example {
                retargeter,
                recording: motion.recording,
                calibration: None,
                name: motion.name,
            });
        };
        let retargeter = self.retargeter(MarkerMap::ue_adl()?, options)?;
        let calibration = retargeter.calibrate(&read_recording(&folder.join("ADL001_static.c3d"), None)?)?;
        let recording = read_recording(&folder.join("ADL001DR1.c3d"), None)?;
        Ok(Example { retargeter, recording, calibration: Some(calibration), name: "ADL001DR1".to_owned() })
    }
}

/// One recording and what is needed to retarget it.
pub(super) struct Example {
    pub(super) retargeter: Retargeter,
    pub(super) recording: MarkerRecording,
    pub(super) calibration: Option<Calibration>,
    pub(super) name: String,
}
