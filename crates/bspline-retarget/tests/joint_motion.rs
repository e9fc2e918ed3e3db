//! Motions that files give as joint angles, BVH and AMASS, from the file to the robot.

use phiw_bspline_retarget::human::MarkerMap;
use phiw_bspline_retarget::markers::{MarkerRecording, RecordingError, read_recording};
use phiw_bspline_retarget::npz::{Array, NpzWriter};
use phiw_bspline_retarget::{RetargetOptions, Retargeted, Retargeter};
use phiw_dynamics::urdf::{UrdfOptions, read_urdf_file};
use proptest::prelude::*;
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
fn the_humanoids_at_hand_follow_amass() {
    let folder = tempfile::tempdir().unwrap();
    let recording = read_recording(&write(&folder, "poses.npz", &amass()), None).unwrap();
    let robots = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data/robots");
    for name in ["torobo20/torobo20.urdf", "talos/talos_reduced.urdf", "g1/g1_29dof_rev_1_0.urdf"] {
        let path = robots.join(name);
        if !path.is_file() {
            println!("skipped: {} is absent", path.display());
            continue;
        }
        let tree = read_urdf_file(path, &UrdfOptions::default()).unwrap().tree;
        let retargeter =
            Retargeter::new(tree, MarkerMap::smpl().unwrap(), RetargetOptions::default()).unwrap();
        let quality = retargeter.retarget(&recording, None).unwrap().quality;
        assert!(quality.marker_rms_m < 0.005 && quality.hand_share() < 0.01, "{name}: {quality:?}");
        assert_eq!(quality.limit_excess, 0.0, "{name}");
    }
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

/// A quaternion w, x, y, z: an oracle beside the reader's matrices.
#[derive(Clone, Copy)]
struct Quaternion([f64; 4]);

impl Quaternion {
    fn about(axis: usize, degrees: f64) -> Self {
        let (sine, cosine) = (0.5 * degrees.to_radians()).sin_cos();
        let mut all = [cosine, 0.0, 0.0, 0.0];
        all[1 + axis] = sine;
        Quaternion(all)
    }

    fn after(self, Quaternion([d, x, y, z]): Self) -> Self {
        let Quaternion([w, a, b, c]) = self;
        Quaternion([
            w * d - a * x - b * y - c * z,
            w * x + a * d + b * z - c * y,
            w * y - a * z + b * d + c * x,
            w * z + a * y - b * x + c * d,
        ])
    }

    fn turn(self, [x, y, z]: [f64; 3]) -> [f64; 3] {
        let Quaternion([w, a, b, c]) = self;
        let Quaternion([_, x, y, z]) =
            self.after(Quaternion([0.0, x, y, z])).after(Quaternion([w, -a, -b, -c]));
        [x, y, z]
    }
}

/// A joint: the one it hangs on (before it), its offset, the order of its rotations, and their angles in two
/// frames.
type AnyJoint = (usize, [f64; 3], usize, [[f64; 3]; 2]);

const ORDERS: [[usize; 3]; 6] = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];

/// The file of a skeleton, and the order in which its joints stand there.
fn any_bvh(joints: &[AnyJoint]) -> (String, Vec<usize>) {
    fn put(text: &mut String, order: &mut Vec<usize>, joints: &[AnyJoint], joint: usize) {
        let (_, [x, y, z], rotations, _) = joints[joint];
        let kind = if joint == 0 { "ROOT" } else { "JOINT" };
        let names = ORDERS[rotations].map(|axis| format!("{}rotation", ["X", "Y", "Z"][axis])).join(" ");
        let (count, slides) = if joint == 0 { (6, "Xposition Yposition Zposition ") } else { (3, "") };
        write!(text, "{kind} j{joint}\n{{ OFFSET {x} {y} {z}\nCHANNELS {count} {slides}{names}\n").unwrap();
        order.push(joint);
        for child in (joint + 1..joints.len()).filter(|&child| joints[child].0 % child == joint) {
            put(text, order, joints, child);
        }
        *text += "}\n";
    }
    let (mut text, mut order) = ("HIERARCHY\n".to_owned(), Vec::new());
    put(&mut text, &mut order, joints, 0);
    text += "MOTION\nFrames: 2\nFrame Time: 0.01\n";
    for frame in 0..2 {
        text += "1 2 3";
        for &joint in &order {
            let (_, _, rotations, angles) = joints[joint];
            let angles = ORDERS[rotations].map(|axis| angles[frame][axis]);
            angles.iter().for_each(|angle| write!(text, " {angle}").unwrap());
        }
        text.push('\n');
    }
    (text, order)
}

proptest! {
    #[test]
    fn any_skeleton_stands_where_quaternions_put_it(
        joints in prop::collection::vec(
            (any::<usize>(), prop::array::uniform3(-40.0..40.0), 0_usize..6,
                prop::array::uniform2(prop::array::uniform3(-180.0..180.0))), 1..9),
    ) {
        let (text, order) = any_bvh(&joints);
        let folder = tempfile::tempdir().unwrap();
        let recording = read_recording(&write(&folder, "any.bvh", text.as_bytes()), None).unwrap();
        prop_assert_eq!(&recording.labels, &order.iter().map(|joint| format!("j{joint}")).collect::<Vec<_>>());
        for frame in 0..2 {
            let mut frames: Vec<(Quaternion, [f64; 3])> = Vec::new();
            for (joint, (parent, offset, rotations, angles)) in joints.iter().enumerate() {
                let own = ORDERS[*rotations].iter().fold(Quaternion([1.0, 0.0, 0.0, 0.0]), |turned, &axis| {
                    turned.after(Quaternion::about(axis, angles[frame][axis]))
                });
                frames.push(match joint {
                    0 => (own, [1.0, 2.0, 3.0]),
                    _ => {
                        let (turned, from) = frames[parent % joint];
                        let at = turned.turn(*offset);
                        (turned.after(own), std::array::from_fn(|axis| from[axis] + at[axis]))
                    }
                });
                // Centimetres with y up become metres with z up.
                let [x, y, z] = frames[joint].1.map(|value| 0.01 * value);
                let place = order.iter().position(|&other| other == joint).unwrap();
                let found = recording.position_m(frame, place);
                let far = found.iter().zip([z, x, y]).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                prop_assert!(far < 1e-9, "joint {joint} of frame {frame} is {far} m off");
            }
        }
    }
}
