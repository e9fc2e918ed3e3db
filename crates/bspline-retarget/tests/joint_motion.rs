//! Motions that files give as joint angles, BVH and AMASS, from the file to the robot.

use phiw_bspline_retarget::human::MarkerMap;
use phiw_bspline_retarget::markers::{MarkerRecording, RecordingError, read_recording};
use phiw_bspline_retarget::npz::{Array, NpzWriter};
use phiw_bspline_retarget::{RetargetOptions, Retargeted, Retargeter};
use phiw_dynamics::urdf::{UrdfOptions, read_urdf_file};
use std::f64::consts::{FRAC_PI_2, TAU};
use std::fmt::Write;
use std::path::{Path, PathBuf};

const FRAMES: usize = 90;
const RATE_HZ: f64 = 30.0;

fn retargeted(recording: &MarkerRecording, map: MarkerMap) -> Retargeted {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models/upper_body18.urdf");
    let tree = read_urdf_file(path, &UrdfOptions::default()).unwrap().tree;
    let retargeter = Retargeter::new(tree, map, RetargetOptions::default()).unwrap();
    retargeter.retarget(recording, None).unwrap()
}

fn write(folder: &tempfile::TempDir, name: &str, content: &[u8]) -> PathBuf {
    let path = folder.path().join(name);
    std::fs::write(&path, content).unwrap();
    path
}

/// A swing from 0 to 1 and back within three seconds.
fn swing(frame: usize) -> f64 {
    0.5 - 0.5 * (TAU * frame as f64 / (FRAMES as f64)).cos()
}

/// A person of LAFAN1's joints in the T-pose, y up and z forward; arms are lowered and one elbow bends.
fn bvh() -> String {
    let mut text = "HIERARCHY\nROOT Hips\n{\nOFFSET 0 0 0\nCHANNELS 6 Xposition Yposition Zposition Zrotation Yrotation Xrotation\n".to_owned();
    let mut chain = |joints: &[(&str, [f64; 3])], closed: usize| {
        for (name, [x, y, z]) in joints {
            writeln!(text, "JOINT {name}\n{{\nOFFSET {x} {y} {z}\nCHANNELS 3 Zrotation Yrotation Xrotation")
                .unwrap();
        }
        text += "End Site\n{\nOFFSET 0 0 0\n}\n";
        text += &"}\n".repeat(closed);
    };
    chain(&[("LeftUpLeg", [10.5, 0.0, 1.9]), ("LeftLeg", [0.0, -43.5, 0.0])], 2);
    chain(&[("RightUpLeg", [-10.5, 0.0, 1.9]), ("RightLeg", [0.0, -43.5, 0.0])], 2);
    chain(&[("Spine", [0.0, 15.0, 0.0]), ("Neck", [0.0, 36.0, 1.9]), ("Head", [0.0, 9.0, 0.0])], 2);
    for (side, sign) in [("Left", 1.0), ("Right", -1.0)] {
        let names = ["Shoulder", "Arm", "ForeArm", "Hand"].map(|name| format!("{side}{name}"));
        let offsets = [
            [6.0 * sign, 29.9, 0.4],
            [11.0 * sign, 2.0, 1.5],
            [30.0 * sign, 0.0, 0.0],
            [26.0 * sign, 0.0, 0.0],
        ];
        let joints: Vec<(&str, [f64; 3])> = names.iter().map(String::as_str).zip(offsets).collect();
        chain(&joints, 4);
    }
    writeln!(text, "}}\n}}\nMOTION\nFrames: {FRAMES}\nFrame Time: {}", 1.0 / RATE_HZ).unwrap();
    for frame in 0..FRAMES {
        let bend = 90.0 * swing(frame);
        // Channels: hips, legs, spine to head, then shoulder, arm, forearm, hand of both sides.
        let mut row = vec![3.0 * swing(frame), 100.0, 5.0 * swing(frame), 0.0, 0.0, 0.0];
        row.extend([0.0; 12 + 9]);
        row.extend([0.0, 0.0, 0.0, -75.0, 0.0, 0.0, 0.0, -20.0 - bend, 0.0, 0.0, 0.0, 0.0]);
        row.extend([0.0, 0.0, 0.0, 75.0, 0.0, 0.0, 0.0, 20.0, 0.0, 0.0, 0.0, 0.0]);
        let row: Vec<String> = row.iter().map(f64::to_string).collect();
        text += &(row.join(" ") + "\n");
    }
    text
}

/// The same in the angles of SMPL: arms lowered, the left elbow bends.
fn amass() -> Vec<u8> {
    let (mut poses, mut trans) = (Vec::new(), Vec::new());
    for frame in 0..FRAMES {
        let mut pose = vec![0.0; 156];
        pose[0] = FRAC_PI_2;
        pose[3 * 16 + 2] = -1.3;
        pose[3 * 17 + 2] = 1.3;
        pose[3 * 18 + 1] = -0.35 - 1.5 * swing(frame);
        pose[3 * 19 + 1] = 0.35;
        poses.extend(pose);
        trans.extend([0.03 * swing(frame), 0.05 * swing(frame), 0.95]);
    }
    let mut writer = NpzWriter::default();
    writer.names("gender", &["neutral".to_owned()]);
    writer.numbers("betas", &Array { shape: vec![16], values: vec![0.0; 16] });
    writer.numbers("poses", &Array { shape: vec![FRAMES, 156], values: poses });
    writer.numbers("trans", &Array { shape: vec![FRAMES, 3], values: trans });
    writer.numbers("mocap_framerate", &Array { shape: vec![], values: vec![RATE_HZ] });
    writer.finish().unwrap()
}

/// By how much the joints of one name, on both sides, move over a motion \[rad\].
fn travel(motion: &Retargeted, place: usize) -> f64 {
    let [q, ..] = motion.signals();
    let count = q.len() / motion.frames;
    let (mut least, mut most) = (f64::INFINITY, f64::NEG_INFINITY);
    for frame in 0..motion.frames {
        least = least.min(q[frame * count + place]);
        most = most.max(q[frame * count + place]);
    }
    most - least
}

/// The recording fits the human, and the robot bends its left elbow and keeps its right one.
fn check(recording: &MarkerRecording, map: MarkerMap, most_rms_m: f64) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models/upper_body18.urdf");
    let tree = read_urdf_file(path, &UrdfOptions::default()).unwrap().tree;
    let elbow = |side: &str| {
        let is_it = |name: &str| name.contains(side) && name.contains("elbow");
        tree.joint_names().position(is_it).unwrap()
    };
    let motion = retargeted(recording, map);
    assert!(motion.quality.marker_rms_m < most_rms_m, "{:?}", motion.quality);
    let (left, right) = (travel(&motion, elbow("left")), travel(&motion, elbow("right")));
    assert!(left > 1.0 && right < 0.2, "left {left}, right {right}");
}

#[test]
fn a_bvh_of_lafan1_moves_the_robot() {
    let folder = tempfile::tempdir().unwrap();
    // The format is told by the content, whatever the name.
    let recording = read_recording(&write(&folder, "walk.txt", bvh().as_bytes()), None).unwrap();
    assert_eq!((recording.frames(), recording.rate_hz), (FRAMES, RATE_HZ));
    check(&recording, MarkerMap::lafan1().unwrap(), 0.01);
}

#[test]
fn an_npz_of_amass_moves_the_robot() {
    let folder = tempfile::tempdir().unwrap();
    let recording = read_recording(&write(&folder, "poses.bin", &amass()), None).unwrap();
    assert_eq!((recording.frames(), recording.rate_hz), (FRAMES, RATE_HZ));
    check(&recording, MarkerMap::smpl().unwrap(), 0.01);
}

#[test]
fn each_format_says_what_is_wrong_with_its_file() {
    let folder = tempfile::tempdir().unwrap();
    let check = |name: &str, content: &[u8], said: &str| {
        let error = read_recording(&write(&folder, name, content), None).unwrap_err();
        assert!(matches!(error, RecordingError::Content { .. }), "{error}");
        let message = error.to_string();
        assert!(message.contains(name) && message.contains(said) && !message.contains('\n'), "{message}");
    };
    let (bvh, npz) = (bvh(), amass());
    check("cut.bvh", &bvh.as_bytes()[..bvh.len() / 2], "cut short");
    check("cut.npz", &npz[..npz.len() / 2], "no whole npz");
    check("bytes.bvh", b"HIERARCHY\n\xff\xfe", "byte 11 is no text");
    check("cut.trc", b"PathFileType\t4\n", "cut short");
}
