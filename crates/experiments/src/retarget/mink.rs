//! mink, frame by frame, on the same markers: as near to the same problem as its tasks go.

use super::mjcf;
use super::page::Page;
use super::scene::{Example, Scene};
use crate::oracle::python::Python;
use anyhow::Context;
use phiw_bspline_retarget::human::{Segment, Side};
use phiw_bspline_retarget::markers::MarkerRecording;
use phiw_bspline_retarget::robot::{BodyPoint, RobotModel};
use phiw_bspline_retarget::{RetargetOptions, Retargeted};
use phiw_dynamics::Placement;
use serde::{Deserialize, Serialize};
use std::path::Path;
use std::time::Instant;

const SCRIPT: &str = include_str!("mink_peer.py");
const REQUIREMENTS: &str = include_str!("requirements.txt");
/// Samples of the motion, as in figure 9.
const SAMPLES: usize = 740;
/// Steps that mink takes for each frame, of the human and of the robot.
const ITERATIONS: usize = 2;
/// Retargetings of ours, of which the fastest counts.
const RUNS: usize = 3;

/// A point of the robot.
#[derive(Serialize)]
struct Point {
    link: String,
    local: [f64; 3],
    kind: &'static str,
    /// The point that it is seen from; none for a shoulder.
    from: Option<usize>,
    /// The human's vector that it should be at from there: one for each of the request's segments \[m\].
    human: Vec<[f64; 3]>,
}

#[derive(Serialize)]
struct Request {
    points: Vec<Point>,
    /// Joints of the human model whose frames are those of the segments that vectors are fixed to.
    segments: Vec<usize>,
    pelvis: usize,
    markers: usize,
    /// Where the human's coordinates rest.
    rest: Vec<f64>,
    rate_hz: f64,
    iterations: usize,
}

#[derive(Deserialize)]
struct Answer {
    seconds: f64,
    /// What its process used: less than `seconds` on a machine that does other things, too.
    cpu_seconds: f64,
    marker_rms_m: f64,
    elbow_rms_m: f64,
    hand_rms_m: f64,
    jerk_rms: f64,
}

/// Retargets a motion, lets mink do it frame by frame, and compares.
///
/// # Errors
/// mink cannot be installed or fails, or the motion cannot be retargeted.
pub fn compare(scene: &Scene, seed: u64, python: &str, page: &mut Page) -> anyhow::Result<()> {
    let python = Python::install(python, "mink-python", REQUIREMENTS)?;
    let Example { retargeter, mut recording, calibration, name } =
        scene.example(seed, RetargetOptions::default())?;
    recording.positions_m.truncate(SAMPLES * recording.labels.len());
    let mut motion = retargeter.retarget(&recording, calibration.as_ref())?;
    let mut ours = f64::INFINITY;
    for _ in 0..RUNS {
        let start = Instant::now();
        motion = retargeter.retarget(&recording, calibration.as_ref())?;
        ours = ours.min(start.elapsed().as_secs_f64());
    }
    page.heading(&format!("mink {} on {} frames of {name}", python.version("mink")?, motion.frames));

    let folder = tempfile::tempdir()?;
    let path = |name: &str| folder.path().join(name);
    let request = request(retargeter.robot(), &motion)?;
    let parameters: Vec<f64> = motion.parameters.iter().map(|&(_, value)| value).collect();
    std::fs::write(path("human.xml"), mjcf::human(&motion.body, &parameters))?;
    std::fs::write(path("robot.urdf"), fixed(&std::fs::read_to_string(&scene.urdf)?, &scene.hold))?;
    std::fs::write(path("request.json"), serde_json::to_string(&request)?)?;
    write_markers(&path("markers"), &recording, &motion)?;
    let answer = python.run(SCRIPT, [folder.path()]).context("mink fails")?;
    let answer: Answer = serde_json::from_str(&answer)?;
    page.say(
        "Ours minimises (15) over all frames at once: markers, robot against human, joint limits; lengths of the person, places of the \
         markers and both motions are unknown, and both are splines.",
    );
    page.say(&format!(
        "mink minimises, frame by frame ({ITERATIONS} steps each from the frame before), first the distance of the human model's markers from \
         the recorded ones, then that of the robot's elbows, wrists and hands from where the human's are at the robot's size, seen from \
         the shoulder, inside the joint limits. It cannot estimate what is the same in all frames: lengths, places of markers and what \
         keeps still are given to it, from our result."
    ));
    let arm = motion.quality.arm_length_m;
    let line = |who: &str, seconds: f64, markers: f64, elbows: f64, hands: f64, jerk: f64| {
        format!(
            "{who}: {seconds:.3} s ({:.0} times real time), markers {:.1} mm, hands {:.2} % and elbows {:.2} % of the arm, jerk {jerk:.0} rad/s³",
            motion.frames as f64 / motion.rate_hz / seconds,
            1e3 * markers,
            1e2 * hands / arm,
            1e2 * elbows / arm,
        )
    };
    let quality = &motion.quality;
    page.say(&line(
        "ours",
        ours,
        quality.marker_rms_m,
        quality.elbow_rms_m,
        quality.hand_rms_m,
        quality.jerk_rms,
    ));
    page.say(&line(
        "mink",
        answer.seconds,
        answer.marker_rms_m,
        answer.elbow_rms_m,
        answer.hand_rms_m,
        answer.jerk_rms,
    ));
    page.say(&format!(
        "mink takes {:.0} times as long ({:.3} s of processor time: {:.0} times)",
        answer.seconds / ours,
        answer.cpu_seconds,
        answer.cpu_seconds / ours
    ));
    Ok(())
}

/// The robot's points and the human's vectors that they answer to.
fn request(robot: &RobotModel, motion: &Retargeted) -> anyhow::Result<Request> {
    let tree = robot.tree();
    let mut placements = vec![Placement::identity(); tree.bodies().len()];
    tree.forward_kinematics(&tree.neutral_configuration(), &mut placements)?;
    let sides = [Side::Left, Side::Right];
    let names = |side| [Segment::UpperArm(side), Segment::Forearm(side), Segment::Hand(side)];
    let segments: Vec<usize> =
        sides.into_iter().flat_map(names).map(|segment| motion.body.segment_joint(segment)).collect();
    let mut points: Vec<Point> = Vec::new();
    for (arm, first) in robot.arms().iter().zip([0, 3]) {
        let from = points.len();
        let mut human = vec![[0.0; 3]; segments.len()];
        let mut before = robot.place(arm.shoulder, &placements);
        points.push(point(robot, arm.shoulder, "shoulder", None, human.clone())?);
        for (index, (at, kind)) in
            [(arm.elbow, "elbow"), (arm.wrist, "wrist"), (arm.hand, "hand")].into_iter().enumerate()
        {
            let place = robot.place(at, &placements);
            // The human's segments have the robot's lengths.
            human[first + index] = [0.0, 0.0, -(place - before).dot(place - before).sqrt()];
            points.push(point(robot, at, kind, Some(from), human.clone())?);
            before = place;
        }
    }
    Ok(Request {
        points,
        segments,
        pelvis: motion.body.segment_joint(Segment::Pelvis),
        markers: motion.body.markers().len(),
        rest: motion.body.rest(),
        rate_hz: motion.rate_hz,
        iterations: ITERATIONS,
    })
}

fn point(
    robot: &RobotModel,
    at: BodyPoint,
    kind: &'static str,
    from: Option<usize>,
    human: Vec<[f64; 3]>,
) -> anyhow::Result<Point> {
    let body = at.body.with_context(|| format!("a {kind} of the robot is fixed to the world"))?;
    Ok(Point { link: robot.tree().bodies()[body].link.clone(), local: at.local.0, kind, from, human })
}

/// The markers that the human model has, frame by frame.
fn write_markers(file: &Path, recording: &MarkerRecording, motion: &Retargeted) -> anyhow::Result<()> {
    let markers = motion.body.markers();
    let mut bytes: Vec<u8> = Vec::new();
    for frame in 0..motion.frames {
        for marker in &markers {
            let position = recording.position_m(frame, marker.recorded);
            bytes.extend(position.iter().flat_map(|coordinate| coordinate.to_le_bytes()));
        }
    }
    Ok(std::fs::write(file, bytes)?)
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
