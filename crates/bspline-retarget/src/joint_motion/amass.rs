//! The npz files of AMASS and of SMPL-X (Mahmood et al., "AMASS: Archive of Motion Capture as Surface
//! Shapes", ICCV 2019): joint rotations `poses` \[rad, axis times angle\], `trans` \[m\], and the frame rate.
//! The world's z is up.
//!
//! The files hold no lengths: those follow from `betas` by a body model that has to be asked for. The joints
//! are put together with the lengths of the mean person instead, and `betas` is not looked at. Retargeting
//! estimates the person's lengths from the points anyway, and gives the robot angles, not lengths.

use super::bvh::check_size;
use super::{IDENTITY, Rotation, Skeleton, about_vector};
use crate::npz::{Array, Npz};
use crate::recording::{MarkerRecording, RATES_HZ};
use phiw_limits::Limits;

/// The joints of the body, in the order of `poses`, with the one that each hangs on and where it is in its
/// frame in the T-pose \[mm\]: x left, y up, z forward. The mean of SMPL's neutral body, left and right made
/// alike, rounded to a millimetre; of the paired joints the left one is given.
const BODY: [(&str, Option<usize>, [f64; 3]); 22] = [
    ("pelvis", None, [0.0, 0.0, 0.0]),
    ("left_hip", Some(0), [69.0, -91.0, -6.0]),
    ("right_hip", Some(0), [-69.0, -91.0, -6.0]),
    ("spine1", Some(0), [0.0, 109.0, -27.0]),
    ("left_knee", Some(1), [36.0, -379.0, -7.0]),
    ("right_knee", Some(2), [-36.0, -379.0, -7.0]),
    ("spine2", Some(3), [0.0, 135.0, 1.0]),
    ("left_ankle", Some(4), [-15.0, -398.0, -43.0]),
    ("right_ankle", Some(5), [15.0, -398.0, -43.0]),
    ("spine3", Some(6), [0.0, 53.0, 25.0]),
    ("left_foot", Some(7), [26.0, -52.0, 121.0]),
    ("right_foot", Some(8), [-26.0, -52.0, 121.0]),
    ("neck", Some(9), [0.0, 214.0, -43.0]),
    ("left_collar", Some(9), [80.0, 120.0, -36.0]),
    ("right_collar", Some(9), [-80.0, 120.0, -36.0]),
    ("head", Some(12), [0.0, 65.0, 51.0]),
    ("left_shoulder", Some(13), [94.0, 32.0, -9.0]),
    ("right_shoulder", Some(14), [-94.0, 32.0, -9.0]),
    ("left_elbow", Some(16), [257.0, -13.0, -24.0]),
    ("right_elbow", Some(17), [-257.0, -13.0, -24.0]),
    ("left_wrist", Some(18), [252.0, 8.0, -3.0]),
    ("right_wrist", Some(19), [-252.0, 8.0, -3.0]),
];

/// Points that are fixed to a joint's bone, which say how it is turned about itself: beside the elbow and the
/// wrist, on hand and head.
const FIXED: [(&str, usize, [f64; 3]); 10] = [
    ("left_epicondyle", 16, [257.0, 32.0, -24.0]),
    ("right_epicondyle", 17, [-257.0, 32.0, -24.0]),
    ("left_radius", 18, [252.0, 8.0, 27.0]),
    ("right_radius", 19, [-252.0, 8.0, 27.0]),
    ("left_hand", 20, [84.0, -7.0, -13.0]),
    ("right_hand", 21, [-84.0, -7.0, -13.0]),
    ("left_thumb", 20, [40.0, 0.0, 40.0]),
    ("right_thumb", 21, [-40.0, 0.0, 40.0]),
    ("head_top", 15, [0.0, 150.0, 0.0]),
    ("head_front", 15, [0.0, 0.0, 150.0]),
];

/// Names of the frame rate, as different releases have it.
const RATES: [&str; 3] = ["mocap_framerate", "mocap_frame_rate", "fps"];

/// The body's joints, and the points fixed to their bones, as points.
///
/// # Errors
/// What is wrong, where, and the mend.
pub(crate) fn parse(bytes: &[u8]) -> Result<MarkerRecording, String> {
    let mut npz = Npz::new(bytes, Limits::default().recording_bytes)?;
    let poses = poses(&mut npz)?;
    let frames = poses.shape[0];
    let trans = matrix(npz.array("trans")?, "trans")?;
    if trans.shape != [frames, 3] {
        return Err(format!(
            "`trans` is {:?}, `poses` has {frames} frames: [{frames}, 3] is expected",
            trans.shape
        ));
    }
    let mut rate = None;
    for name in RATES {
        rate = rate.or(npz.array(name)?.and_then(|rate| rate.values.first().copied()));
    }
    let rate_hz = rate.ok_or_else(|| lacking(&npz, RATES[0]))?;
    if !RATES_HZ.contains(&rate_hz) {
        return Err(format!("`{}` is {rate_hz} Hz, no camera's (1 Hz to 100 kHz)", RATES[0]));
    }
    if frames < 2 {
        return Err(format!("{frames} frames; a motion needs at least 2"));
    }
    let skeleton = skeleton();
    check_size(frames, skeleton.names.len())?;
    let mut offsets = skeleton.offsets_m.clone();
    let mut rotations: Vec<Rotation> = vec![IDENTITY; skeleton.names.len()];
    let mut positions_m = Vec::with_capacity(frames * skeleton.names.len());
    let numbers = poses.values.chunks_exact(poses.shape[1].max(1)).zip(trans.values.as_chunks::<3>().0);
    for (frame, (angles, root)) in numbers.enumerate() {
        let angles = angles.as_chunks::<3>().0.iter().take(BODY.len());
        for (joint, (rotation, vector)) in rotations.iter_mut().zip(angles).enumerate() {
            if !vector.iter().all(|value| value.is_finite()) {
                return Err(format!("frame {}: the rotation of {} is no number", frame + 1, BODY[joint].0));
            }
            *rotation = about_vector(*vector);
        }
        offsets[0] = *root;
        positions_m.extend(skeleton.centres(&offsets, &rotations));
    }
    Ok(MarkerRecording { rate_hz, labels: skeleton.names, positions_m })
}

fn skeleton() -> Skeleton {
    let body = BODY.into_iter();
    let fixed = FIXED.into_iter().map(|(name, joint, place)| (name, Some(joint), place));
    let mut skeleton = Skeleton::default();
    for (name, parent, place_mm) in body.chain(fixed) {
        skeleton.names.push(name.to_owned());
        skeleton.parents.push(parent);
        skeleton.offsets_m.push(place_mm.map(|x| 1e-3 * x));
    }
    skeleton
}

/// `poses`, or the root and the body where a release keeps them apart: at least three numbers for each joint
/// of the body.
fn poses(npz: &mut Npz<'_>) -> Result<Array, String> {
    let wanted = 3 * BODY.len();
    if let Some(poses) = npz.array("poses")? {
        let poses = matrix(Some(poses), "poses")?;
        return match poses.shape[1] >= wanted {
            true => Ok(poses),
            false => Err(format!(
                "`poses` has {} numbers in each frame, a body {wanted}: three for each of its 22 joints",
                poses.shape[1]
            )),
        };
    }
    let (Some(root), Some(body)) = (npz.array("root_orient")?, npz.array("pose_body")?) else {
        return Err(lacking(npz, "poses"));
    };
    let (root, body) = (matrix(Some(root), "root_orient")?, matrix(Some(body), "pose_body")?);
    if root.shape[1] != 3 || body.shape[1] != wanted - 3 || root.shape[0] != body.shape[0] {
        let (root, body) = (root.shape, body.shape);
        return Err(format!(
            "`root_orient` is {root:?} and `pose_body` {body:?}; [N, 3] and [N, 63] are expected"
        ));
    }
    let rows = root.values.chunks_exact(3).zip(body.values.chunks_exact(wanted - 3));
    let values = rows.flat_map(|(root, body)| root.iter().chain(body)).copied().collect();
    Ok(Array { shape: vec![root.shape[0], wanted], values })
}

/// An array that is there and has rows and columns.
fn matrix(array: Option<Array>, name: &str) -> Result<Array, String> {
    let array = array.ok_or_else(|| {
        format!("there is no array `{name}`; an AMASS file has poses, trans and mocap_framerate")
    })?;
    match array.shape.len() {
        2 => Ok(array),
        _ => Err(format!("`{name}` is {:?}; frames times numbers are expected", array.shape)),
    }
}

fn lacking(npz: &Npz<'_>, name: &str) -> String {
    format!(
        "there is no array `{name}` among {}; an AMASS file has poses, trans and mocap_framerate",
        npz.names().join(", ")
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::npz::NpzWriter;

    fn file(columns: usize, change: impl FnOnce(&mut Vec<f64>)) -> Vec<u8> {
        let mut poses = vec![0.0; 2 * columns];
        // The world's z is up: the T-pose is turned up about x.
        poses[0] = std::f64::consts::FRAC_PI_2;
        poses[columns] = std::f64::consts::FRAC_PI_2;
        change(&mut poses);
        let mut writer = NpzWriter::default();
        writer.numbers("poses", &Array { shape: vec![2, columns], values: poses });
        writer.numbers("trans", &Array { shape: vec![2, 3], values: vec![0.0, 0.0, 0.9, 1.0, 2.0, 0.9] });
        writer.numbers("mocap_framerate", &Array { shape: vec![], values: vec![120.0] });
        writer.finish().unwrap()
    }

    fn near(found: [f64; 3], expected: [f64; 3]) {
        assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12), "{found:?} {expected:?}");
    }

    #[test]
    fn the_t_pose_stands_upright_with_its_arms_to_the_sides() {
        for columns in [66, 72, 156, 165] {
            let recording = parse(&file(columns, |_| ())).unwrap();
            assert_eq!((recording.frames(), recording.rate_hz), (2, 120.0));
            let at = |name: &str| recording.position_m(1, recording.marker(name).unwrap());
            near(at("pelvis"), [1.0, 2.0, 0.9]);
            // Turned up about x, forward is −y and left is x.
            near(at("left_wrist"), [1.0 + 0.683, 2.0 + 0.027 - 0.001 - 0.025 + 0.036 + 0.036, 0.9 + 0.444]);
            near(at("head_front"), {
                let head = at("head");
                [head[0], head[1] - 0.15, head[2]]
            });
        }
    }

    #[test]
    fn an_elbow_turns_what_hangs_on_it() {
        // The left elbow bends forward by a right angle: about y, which is up in the person's frame.
        let bent = file(66, |poses| poses[66 + 3 * 18 + 1] = -std::f64::consts::FRAC_PI_2);
        let recording = parse(&bent).unwrap();
        let at = |name: &str| recording.position_m(1, recording.marker(name).unwrap());
        let (elbow, wrist) = (at("left_elbow"), at("left_wrist"));
        near(wrist, [elbow[0] + 0.003, elbow[1] - 0.252, elbow[2] + 0.008]);
        let straight = recording.position_m(0, recording.marker("left_elbow").unwrap());
        near([elbow[0] - 1.0, elbow[1] - 2.0, elbow[2]], straight);
    }

    #[test]
    fn what_is_wrong_is_said() {
        let check = |bytes: &[u8], said: &str| {
            let error = parse(bytes).unwrap_err();
            assert!(error.contains(said) && !error.contains('\n'), "{error}");
        };
        check(b"PK\x03\x04", "no whole npz");
        check(&file(63, |_| ()), "`poses` has 63 numbers");
        check(&file(66, |poses| poses[66 + 4] = f64::NAN), "frame 2: the rotation of left_hip");
        let mut writer = NpzWriter::default();
        writer.numbers("joint_pos", &Array { shape: vec![1], values: vec![0.0] });
        check(&writer.finish().unwrap(), "no array `poses` among joint_pos");
        let whole = file(66, |_| ());
        for length in (0..whole.len()).step_by(101) {
            assert!(parse(&whole[..length]).is_err());
        }
    }
}
