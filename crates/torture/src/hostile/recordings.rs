//! Marker recordings with one thing wrong.

use super::bytes;
use super::case::{Case, Class, Expectation};
use super::ground::Ground;
use phiw_bspline_retarget::c3d::{C3dFormat, write_c3d};
use phiw_bspline_retarget::markers::MarkerRecording;
use rand::RngExt;
use rand::seq::IndexedRandom;
use rand_chacha::ChaCha8Rng;

/// The classes.
pub fn classes() -> Vec<Class> {
    vec![
        Class::new("bytes of a C3D damaged", 120, damaged),
        Class::new("bytes of a C3D header or parameter block damaged", 150, damaged_head),
        Class::new("another kind of file for a recording", 30, another_kind),
        Class::wrong("marker samples far off", 60, spikes),
        Class::wrong("frozen or absent markers", 60, frozen),
        Class::wrong("a recording in another unit", 40, unit),
        Class::new("odd rates, counts and values", 60, odd),
    ]
}

fn case(ground: &Ground, expectation: Expectation, story: String, bytes: Vec<u8>) -> Case {
    Case::new(ground, "retarget", expectation, story).file("recording.c3d", bytes)
}

fn damaged(ground: &Ground, random: &mut ChaCha8Rng) -> Case {
    let (bytes, story) = bytes::damage(ground.file("recording.c3d"), random);
    case(ground, Expectation::Orderly, story, bytes)
}

fn damaged_head(ground: &Ground, random: &mut ChaCha8Rng) -> Case {
    let mut file = ground.file("recording.c3d").to_vec();
    let count = random.random_range(1..6);
    let mut places = Vec::new();
    for _ in 0..count {
        let at = if random.random_bool(0.5) {
            random.random_range(0..40)
        } else {
            random.random_range(512..2048.min(file.len()))
        };
        file[at] = *[0, 1, 0x7f, 0x80, 0xff, random.random()].choose(random).unwrap_or(&0);
        places.push(at.to_string());
    }
    case(ground, Expectation::Orderly, format!("bytes {} changed", places.join(", ")), file)
}

fn another_kind(ground: &Ground, random: &mut ChaCha8Rng) -> Case {
    let (bytes, story) = bytes::another_kind(random);
    case(ground, Expectation::Refused, story, bytes)
}

/// The good recording, changed.
fn changed(ground: &Ground, change: impl FnOnce(&mut MarkerRecording)) -> Vec<u8> {
    let mut recording = ground.recording().clone();
    change(&mut recording);
    write_c3d(&recording, C3dFormat::default(), &[])
}

fn spikes(ground: &Ground, random: &mut ChaCha8Rng) -> Case {
    let size_m = 10_f64.powf(random.random_range(0.0..4.0));
    let count = random.random_range(1..5);
    let bytes = changed(ground, |recording| {
        for _ in 0..count {
            let at = random.random_range(0..recording.positions_m.len());
            recording.positions_m[at][random.random_range(0..3)] += size_m;
        }
    });
    case(ground, Expectation::Same, format!("{count} samples off by {size_m:.1} m"), bytes)
}

fn frozen(ground: &Ground, random: &mut ChaCha8Rng) -> Case {
    let zero = random.random_bool(0.5);
    let count = random.random_range(1..4);
    let bytes = changed(ground, |recording| {
        let markers = recording.labels.len();
        for _ in 0..count {
            let marker = random.random_range(0..markers);
            let at = if zero { [0.0; 3] } else { recording.positions_m[marker] };
            recording
                .positions_m
                .iter_mut()
                .skip(marker)
                .step_by(markers)
                .for_each(|position| *position = at);
        }
    });
    case(
        ground,
        Expectation::SameOrSaid,
        format!("{count} markers {}", if zero { "zero" } else { "frozen" }),
        bytes,
    )
}

fn unit(ground: &Ground, random: &mut ChaCha8Rng) -> Case {
    let factor = *[1000.0, 0.001, 0.01, 100.0, 25.4].choose(random).unwrap_or(&1000.0);
    let bytes = changed(ground, |recording| {
        recording.positions_m.iter_mut().flatten().for_each(|value| *value *= factor);
    });
    case(ground, Expectation::Refused, format!("positions × {factor}"), bytes)
}

fn odd(ground: &Ground, random: &mut ChaCha8Rng) -> Case {
    let (story, bytes) = match random.random_range(0..6) {
        0 => {
            let rate_hz = *[1e-6, 0.0, -100.0, 1e9, f64::NAN, f64::INFINITY].choose(random).unwrap_or(&0.0);
            (format!("{rate_hz} Hz"), changed(ground, |recording| recording.rate_hz = rate_hz))
        }
        1 => {
            let frames = random.random_range(0..5);
            let cut = |recording: &mut MarkerRecording| {
                recording.positions_m.truncate(frames * recording.labels.len())
            };
            (format!("{frames} frames"), changed(ground, cut))
        }
        2 => (
            "labels all the same".to_owned(),
            changed(ground, |recording| recording.labels.fill("STRN".to_owned())),
        ),
        3 => (
            "labels that no map names".to_owned(),
            changed(ground, |recording| recording.labels.fill("*12\u{1b}[2J".to_owned())),
        ),
        4 => {
            let value = *[f64::NAN, f64::INFINITY, 1e33, -1e300].choose(random).unwrap_or(&0.0);
            (
                format!("all positions {value}"),
                changed(ground, |recording| recording.positions_m.fill([value; 3])),
            )
        }
        _ => {
            let share = random.random_range(0.3..1.0);
            let gaps = |recording: &mut MarkerRecording| {
                for position in recording.positions_m.iter_mut() {
                    if random.random_bool(share) {
                        *position = [f64::NAN; 3];
                    }
                }
            };
            (format!("{:.0} % of the samples missing", 100.0 * share), changed(ground, gaps))
        }
    };
    case(ground, Expectation::Orderly, story, bytes)
}
