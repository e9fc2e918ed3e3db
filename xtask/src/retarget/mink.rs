//! mink, frame by frame, after the same points: the robot's half of the problem only.

use super::page::Page;
use super::{Example, Scene};
use crate::oracle::python::Python;
use anyhow::Context;
use phiw_bspline_retarget::RetargetOptions;
use phiw_dynamics::Placement;
use serde::{Deserialize, Serialize};
use std::time::Instant;

const SCRIPT: &str = include_str!("mink_peer.py");
const REQUIREMENTS: &str = include_str!("requirements.txt");
/// Samples of the motion, as in figure 9.
const SAMPLES: usize = 740;
/// Steps that mink takes for each frame.
const ITERATIONS: usize = 2;

#[derive(Serialize)]
struct Point {
    link: String,
    local: [f64; 3],
}

#[derive(Serialize)]
struct Request {
    points: Vec<Point>,
    rate_hz: f64,
    iterations: usize,
}

#[derive(Deserialize)]
struct Answer {
    seconds: f64,
    error_rms_m: f64,
    jerk_rms: f64,
}

/// Retargets a motion, gives mink the points of elbows, wrists and hands that came out, and compares.
///
/// # Errors
/// mink cannot be installed or fails, or the motion cannot be retargeted.
pub fn compare(scene: &Scene, seed: u64, python: &str, page: &mut Page) -> anyhow::Result<()> {
    let python = Python::install(python, "mink-python", REQUIREMENTS)?;
    let Example { retargeter, mut recording, calibration, name } =
        scene.example(seed, RetargetOptions::default())?;
    recording.positions_m.truncate(SAMPLES * recording.labels.len());
    let start = Instant::now();
    let motion = retargeter.retarget(&recording, calibration.as_ref())?;
    let ours = start.elapsed().as_secs_f64();
    page.heading(&format!("mink {} on {} frames of {name}", python.version("mink")?, motion.frames));

    let tree = retargeter.robot().tree();
    let arms = retargeter.robot().arms();
    let points: Vec<_> = arms.iter().flat_map(|arm| [arm.elbow, arm.wrist, arm.hand]).collect();
    let mut placements = vec![Placement::identity(); tree.bodies().len()];
    let (mut q, mut scratch) = (vec![0.0; tree.joint_count()], vec![0.0; motion.robot.basis().degree() + 1]);
    let mut targets: Vec<u8> = Vec::new();
    for frame in 0..motion.frames {
        motion.robot.evaluate(0, frame as f64 / motion.rate_hz, &mut scratch, &mut q);
        tree.forward_kinematics(&q, &mut placements)?;
        for point in &points {
            let position = point.body.map_or(point.local, |body| placements[body].point(point.local));
            targets.extend(position.0.iter().flat_map(|coordinate| coordinate.to_le_bytes()));
        }
    }
    let request = Request {
        points: points
            .iter()
            .filter_map(|point| {
                Some(Point { link: tree.bodies()[point.body?].link.clone(), local: point.local.0 })
            })
            .collect(),
        rate_hz: motion.rate_hz,
        iterations: ITERATIONS,
    };
    let folder = tempfile::tempdir()?;
    std::fs::write(
        folder.path().join("robot.urdf"),
        fixed(&std::fs::read_to_string(&scene.urdf)?, &scene.hold),
    )?;
    std::fs::write(folder.path().join("request.json"), serde_json::to_string(&request)?)?;
    std::fs::write(folder.path().join("targets"), targets)?;
    let answer = python.run(SCRIPT, [folder.path()]).context("mink fails")?;
    let answer: Answer = serde_json::from_str(&answer)?;
    page.say(&format!(
        "All of (15), person and robot: {ours:.3} s, jerk {:.0} rad/s³. mink, the robot's half alone after points that it can reach, \
         {ITERATIONS} steps a frame: {:.3} s ({:.1} times as long), {:.2} mm off, jerk {:.0} rad/s³",
        motion.quality.jerk_rms,
        answer.seconds,
        answer.seconds / ours,
        1e3 * answer.error_rms_m,
        answer.jerk_rms
    ));
    Ok(())
}

/// The URDF with joints fixed where they are at zero, and links kept where they are.
fn fixed(urdf: &str, hold: &[(String, f64)]) -> String {
    let mut urdf = urdf.to_owned();
    for (joint, _) in hold {
        for kind in ["revolute", "continuous"] {
            urdf = urdf.replace(
                &format!("name=\"{joint}\" type=\"{kind}\""),
                &format!("name=\"{joint}\" type=\"fixed\""),
            );
        }
    }
    urdf.replacen(
        "</robot>",
        "<mujoco><compiler fusestatic=\"false\" discardvisual=\"true\"/></mujoco></robot>",
        1,
    )
}
