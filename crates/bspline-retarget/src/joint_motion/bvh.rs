//! BVH: a hierarchy of joints with their offsets and channels, then one line of numbers for each frame
//! (Meredith and Maddock, "Motion Capture File Formats Explained", 2001; as LAFAN1 writes it).
//!
//! Angles are in degrees and applied in the order of the channels, the first one outermost. Positions replace
//! the joint's offset. The world's y is up. The file has no unit: centimetres, if nothing else is said.

use super::{IDENTITY, Rotation, Skeleton, about_axis, product, z_up};
use crate::recording::{MarkerRecording, RATES_HZ, metres};
use phiw_limits::Limits;

/// Length of what continues a last bone whose end the file does not place, as a share of the bone before it.
const CONTINUED: f64 = 1.0 / 3.0;
/// Offsets below this are none \[m\].
const NO_LENGTH_M: f64 = 1e-6;
/// Joints of a skeleton; one with all fingers has about 75.
const MOST_JOINTS: usize = 1000;

/// What a number of a frame moves.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Channel {
    Position(usize),
    Rotation(usize),
}

/// The hierarchy, and what each number of a frame moves.
struct Hierarchy {
    skeleton: Skeleton,
    channels: Vec<(usize, Channel)>,
}

/// The centres of the joints as points named after them, and each end as `<joint>_end`; lengths in `units`,
/// or else in centimetres.
///
/// # Errors
/// What is wrong, where, and the mend.
pub(crate) fn parse(text: &str, units: Option<&str>) -> Result<MarkerRecording, String> {
    let unit = units.unwrap_or("cm");
    let unit_m = metres(unit).ok_or_else(|| format!("unit `{unit}`: known are m, dm, cm, mm, in and ft"))?;
    let mut words = Words::of(text);
    words.expect("HIERARCHY")?;
    words.expect("ROOT")?;
    let mut hierarchy = Hierarchy { skeleton: Skeleton::default(), channels: Vec::new() };
    read_joint(&mut words, &mut hierarchy, unit_m)?;
    let Hierarchy { mut skeleton, channels } = hierarchy;
    continue_ends(&mut skeleton);
    words.expect("MOTION")?;
    words.expect("Frames:")?;
    let (word, line) = words.next("the number of frames")?;
    let frames: usize =
        word.parse().map_err(|_| format!("line {line}: `{word}` is not a number of frames"))?;
    words.expect("Frame")?;
    words.expect("Time:")?;
    let step = words.number("the time of a frame")?;
    if !RATES_HZ.contains(&(1.0 / step)) {
        return Err(format!("a frame lasts {step} s, no camera's (1 Hz to 100 kHz); give it in seconds"));
    }
    if frames < 2 {
        return Err(format!("{frames} frames; a motion needs at least 2"));
    }
    check_size(frames, skeleton.names.len())?;
    let mut positions_m = Vec::new();
    for frame in 0..frames {
        let mut offsets = skeleton.offsets_m.clone();
        let mut rotations: Vec<Rotation> = vec![IDENTITY; skeleton.names.len()];
        for (joint, channel) in &channels {
            let value = words.number_of(frame, frames)?;
            match channel {
                Channel::Position(axis) => offsets[*joint][*axis] = value * unit_m,
                Channel::Rotation(axis) => {
                    rotations[*joint] = product(&rotations[*joint], &about_axis(*axis, value.to_radians()))
                }
            }
        }
        positions_m.extend(skeleton.centres(&offsets, &rotations).into_iter().map(z_up));
    }
    if let Ok((word, line)) = words.next("") {
        return Err(format!("line {line}: `{word}` follows the last of {frames} frames; check `Frames:`"));
    }
    Ok(MarkerRecording { rate_hz: 1.0 / step, labels: skeleton.names, positions_m })
}

/// Refuses points that memory could not hold.
pub(crate) fn check_size(frames: usize, joints: usize) -> Result<(), String> {
    let bytes = (frames as u64).saturating_mul(joints as u64).saturating_mul(size_of::<[f64; 3]>() as u64);
    let most = Limits::default().recording_bytes;
    match bytes > most {
        true => Err(format!(
            "{frames} frames of {joints} joints take {bytes} bytes, more than {most}; cut the recording"
        )),
        false => Ok(()),
    }
}

/// Reads a joint after `ROOT` or `JOINT`, and those that hang on it. A loop, since a file could nest deeper
/// than the stack is.
fn read_joint(words: &mut Words<'_>, hierarchy: &mut Hierarchy, unit_m: f64) -> Result<(), String> {
    let mut open: Vec<usize> = vec![begin_joint(words, hierarchy, None, unit_m)?];
    while let Some(&joint) = open.last() {
        let (word, line) = words.next("`JOINT`, `End Site` or `}`")?;
        match word {
            "JOINT" => open.push(begin_joint(words, hierarchy, Some(joint), unit_m)?),
            "End" => {
                words.expect("Site")?;
                words.expect("{")?;
                let offset = read_offset(words, unit_m)?;
                words.expect("}")?;
                let name = end_of(&hierarchy.skeleton.names[joint]);
                push_joint(&mut hierarchy.skeleton, name, Some(joint), offset, line)?;
            }
            "CHANNELS" => read_channels(words, hierarchy, joint)?,
            "}" => {
                open.pop();
            }
            word => {
                return Err(format!(
                    "line {line}: `{word}`, where JOINT, End Site, CHANNELS or }} is expected"
                ));
            }
        }
    }
    Ok(())
}

fn begin_joint(
    words: &mut Words<'_>,
    hierarchy: &mut Hierarchy,
    parent: Option<usize>,
    unit_m: f64,
) -> Result<usize, String> {
    let (name, line) = words.name()?;
    words.expect("{")?;
    let offset = read_offset(words, unit_m)?;
    push_joint(&mut hierarchy.skeleton, name.to_owned(), parent, offset, line)
}

fn push_joint(
    skeleton: &mut Skeleton,
    name: String,
    parent: Option<usize>,
    offset_m: [f64; 3],
    line: usize,
) -> Result<usize, String> {
    if skeleton.names.contains(&name) {
        return Err(format!("line {line}: a second joint `{name}`; give each its own name"));
    }
    if skeleton.names.len() == MOST_JOINTS {
        return Err(format!("line {line}: more than {MOST_JOINTS} joints, which no person has"));
    }
    skeleton.names.push(name);
    skeleton.parents.push(parent);
    skeleton.offsets_m.push(offset_m);
    Ok(skeleton.names.len() - 1)
}

fn read_offset(words: &mut Words<'_>, unit_m: f64) -> Result<[f64; 3], String> {
    words.expect("OFFSET")?;
    let mut offset = [0.0; 3];
    for value in &mut offset {
        *value = words.number("an offset")? * unit_m;
    }
    Ok(offset)
}

fn read_channels(words: &mut Words<'_>, hierarchy: &mut Hierarchy, joint: usize) -> Result<(), String> {
    let (word, line) = words.next("the number of channels")?;
    let count = word.parse::<usize>().ok().filter(|count| *count <= 6);
    let count = count.ok_or_else(|| format!("line {line}: `{word}` channels; a joint has at most 6"))?;
    for _ in 0..count {
        let (word, line) = words.next("a channel")?;
        let axis = "XYZ".find(word.get(..1).unwrap_or(" "));
        let channel = match (axis, word.get(1..)) {
            (Some(axis), Some("position")) => Channel::Position(axis),
            (Some(axis), Some("rotation")) => Channel::Rotation(axis),
            _ => {
                return Err(format!(
                    "line {line}: channel `{word}`; known are Xposition, Zrotation and so on"
                ));
            }
        };
        hierarchy.channels.push((joint, channel));
    }
    Ok(())
}

/// Name of the end of a joint's bone.
fn end_of(joint: &str) -> String {
    format!("{joint}_end")
}

/// An end that is where its joint is, as LAFAN1 has it, continues the bone before it.
fn continue_ends(skeleton: &mut Skeleton) {
    let length = |offset: [f64; 3]| offset.iter().map(|x| x * x).sum::<f64>().sqrt();
    for joint in 0..skeleton.names.len() {
        let Some(parent) = skeleton.parents[joint] else { continue };
        let is_end = skeleton.names[joint] == end_of(&skeleton.names[parent]);
        if is_end && length(skeleton.offsets_m[joint]) < NO_LENGTH_M {
            skeleton.offsets_m[joint] = skeleton.offsets_m[parent].map(|x| CONTINUED * x);
        }
    }
}

/// The words of a text with their lines.
struct Words<'a> {
    lines: std::iter::Enumerate<std::str::Lines<'a>>,
    line: usize,
    /// What is left of the line.
    rest: &'a str,
}

impl<'a> Words<'a> {
    fn of(text: &'a str) -> Self {
        Words { lines: text.lines().enumerate(), line: 0, rest: "" }
    }

    fn next(&mut self, what: &str) -> Result<(&'a str, usize), String> {
        loop {
            let rest = self.rest.trim_start();
            if let Some(word) = rest.split_whitespace().next() {
                self.rest = &rest[word.len()..];
                return Ok((word, self.line));
            }
            let Some((index, line)) = self.lines.next() else {
                return Err(format!("the file ends where {what} is expected; it is cut short"));
            };
            (self.line, self.rest) = (index + 1, line);
        }
    }

    /// A joint's name. The brace after it may stand on the same line.
    fn name(&mut self) -> Result<(&'a str, usize), String> {
        let (word, line) = self.next("a joint's name")?;
        match self.rest.trim() {
            more if more.is_empty() || more.starts_with('{') => Ok((word, line)),
            more => {
                Err(format!("line {line}: `{more}` follows the joint's name `{word}`; write it as one word"))
            }
        }
    }

    fn expect(&mut self, expected: &str) -> Result<(), String> {
        match self.next(&format!("`{expected}`"))? {
            (word, _) if word == expected => Ok(()),
            (word, line) => Err(format!("line {line}: `{word}`, where `{expected}` is expected")),
        }
    }

    fn number(&mut self, what: &str) -> Result<f64, String> {
        let (word, line) = self.next(what)?;
        let number = word.parse::<f64>().ok().filter(|number| number.is_finite());
        number.ok_or_else(|| format!("line {line}: `{word}` is not a number, where {what} is expected"))
    }

    fn number_of(&mut self, frame: usize, frames: usize) -> Result<f64, String> {
        self.number(&format!("a number of frame {} of {frames}", frame + 1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A root that moves, an arm of two bones along x, and an end without length.
    const FILE: &str = "HIERARCHY
ROOT Hips
{
  OFFSET 7.0 8.0 9.0
  CHANNELS 6 Xposition Yposition Zposition Zrotation Yrotation Xrotation
  JOINT Arm {
    OFFSET 0.0 10.0 0.0
    CHANNELS 3 Zrotation Yrotation Xrotation
    JOINT Hand
    {
      OFFSET 30.0 0.0 0.0
      CHANNELS 3 Zrotation Yrotation Xrotation
      End Site
      {
        OFFSET 0.0 0.0 0.0
      }
    }
  }
}
MOTION
Frames: 2
Frame Time: 0.033333
0 100 0  0 0 0  0 0 0  0 0 0
50 100 0  0 90 0  90 0 0  0 0 90
";

    fn near(found: [f64; 3], expected: [f64; 3]) {
        assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12), "{found:?} {expected:?}");
    }

    #[test]
    fn joints_are_where_the_angles_put_them() {
        let recording = parse(FILE, None).unwrap();
        assert_eq!(recording.labels, ["Hips", "Arm", "Hand", "Hand_end"]);
        assert!((recording.rate_hz - 30.0).abs() < 1e-3);
        // y is up in the file, z in the recording; x of the file is to the left.
        near(recording.position_m(0, 0), [0.0, 0.0, 1.0]);
        near(recording.position_m(0, 1), [0.0, 0.0, 1.1]);
        near(recording.position_m(0, 2), [0.0, 0.3, 1.1]);
        // The end continues the arm by a third of it.
        near(recording.position_m(0, 3), [0.0, 0.4, 1.1]);
        // The hips have turned by 90 degrees about the vertical, the arm points up.
        near(recording.position_m(1, 0), [0.0, 0.5, 1.0]);
        near(recording.position_m(1, 1), [0.0, 0.5, 1.1]);
        near(recording.position_m(1, 2), [0.0, 0.5, 1.4]);
        near(recording.position_m(1, 3), [0.0, 0.5, 1.5]);
    }

    #[test]
    fn the_first_channel_is_the_outermost() {
        // Turned by z first, then by x in the frame that has been turned.
        let file = FILE.replace("50 100 0  0 90 0  90 0 0", "0 100 0  0 0 0  90 0 90");
        let recording = parse(&file.replace("OFFSET 30.0 0.0 0.0", "OFFSET 0.0 30.0 0.0"), None).unwrap();
        // y of the arm becomes z by x, and z stays under z.
        near(recording.position_m(1, 2), [0.3, 0.0, 1.1]);
    }

    #[test]
    fn units_are_taken_at_their_word() {
        let recording = parse(FILE, Some("m")).unwrap();
        near(recording.position_m(0, 0), [0.0, 0.0, 100.0]);
        assert!(parse(FILE, Some("ell")).unwrap_err().contains("`ell`"));
    }

    #[test]
    fn what_is_wrong_is_said_with_its_line() {
        let check = |from: &str, to: &str, said: &str| {
            let error = parse(&FILE.replacen(from, to, 1), None).unwrap_err();
            assert!(error.contains(said), "{error}");
        };
        check("HIERARCHY", "HIERARCHI", "line 1: `HIERARCHI`, where `HIERARCHY`");
        check("OFFSET 30.0", "OFFSET thirty", "line 11: `thirty` is not a number");
        check("CHANNELS 6 Xposition", "CHANNELS 9 Xposition", "line 5: `9` channels");
        check("Zposition", "Wposition", "line 5: channel `Wposition`");
        check("JOINT Hand", "JOINT Arm", "line 9: a second joint `Arm`");
        check("JOINT Hand", "JOINT Left Hand", "line 9: `Hand` follows the joint's name `Left`");
        check("Frames: 2", "Frames: 3", "cut short");
        check("Frames: 2", "Frames: 1", "1 frames");
        check("Frames: 2", "Frames: 99999999999", "99999999999 frames of 4 joints take");
        check("Frame Time: 0.033333", "Frame Time: 0", "a frame lasts 0 s");
        check("0 0 90\n", "0 0 90 17\n", "`17` follows the last of 2 frames");
        check("0 100 0", "0 nan 0", "`nan` is not a number");
    }

    #[test]
    fn a_file_that_is_cut_anywhere_is_refused() {
        for length in 0..FILE.trim_end().len() - 1 {
            let Err(error) = parse(&FILE[..length], None) else {
                panic!("cut after {length} bytes it is read")
            };
            assert!(!error.contains('\n'), "{error}");
        }
    }

    #[test]
    fn nesting_deeper_than_the_stack_is_refused() {
        let mut deep = "HIERARCHY\nROOT j0 { OFFSET 0 0 0\n".to_owned();
        (1..200_000).for_each(|joint| deep += &format!("JOINT j{joint} {{ OFFSET 0 0 0\n"));
        assert!(parse(&deep, None).unwrap_err().contains("more than 1000 joints"));
    }
}
