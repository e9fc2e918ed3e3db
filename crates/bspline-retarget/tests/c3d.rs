//! The C3D reader: what is written is read, real files are read, and no bytes make it panic.

use phiw_bspline_retarget::c3d::{C3dError, C3dFormat, Processor, Storage, read_c3d, write_c3d};
use phiw_bspline_retarget::markers::{MarkerRecording, read_recording};
use proptest::prelude::*;
use std::path::{Path, PathBuf};

const PROCESSORS: [Processor; 3] = [Processor::Intel, Processor::Dec, Processor::Sgi];

fn recording(markers: usize, frames: usize) -> MarkerRecording {
    let coordinate = |i: usize| ((i * 7919) % 4001) as f64 / 1000.0 - 2.0;
    let positions_m =
        (0..markers * frames)
            .map(|i| {
                if i % 7 == 3 { [f64::NAN; 3] } else { [coordinate(i), coordinate(i + 1), coordinate(i + 2)] }
            })
            .collect();
    let labels = (0..markers).map(|marker| format!("M{marker}")).collect();
    MarkerRecording { rate_hz: 100.0, labels, positions_m }
}

/// Equal up to `tolerance` metres, missing for missing.
fn check_equal(read: &MarkerRecording, written: &MarkerRecording, tolerance: f64) {
    assert_eq!(
        (&read.labels, read.rate_hz, read.frames()),
        (&written.labels, written.rate_hz, written.frames())
    );
    for (read, written) in read.positions_m.iter().zip(&written.positions_m) {
        for (read, written) in read.iter().zip(written) {
            assert!(
                read.is_nan() && written.is_nan() || (read - written).abs() <= tolerance,
                "{read} instead of {written}"
            );
        }
    }
}

fn format(processor: Processor, integer: bool, millimetres: bool) -> C3dFormat {
    let scale = if millimetres { 0.1 } else { 0.0001 };
    let storage = if integer { Storage::Integer { scale } } else { Storage::Real };
    C3dFormat { processor, storage, millimetres }
}

#[test]
fn what_is_written_is_read_in_every_format() {
    let written = recording(5, 40);
    for processor in PROCESSORS {
        for integer in [false, true] {
            for millimetres in [false, true] {
                let bytes = write_c3d(
                    &written,
                    format(processor, integer, millimetres),
                    &[("SUBJECTS", "NAMES", "Anna")],
                );
                let file = read_c3d(&bytes).unwrap();
                assert_eq!(file.processor, processor);
                assert_eq!(file.parameters.texts("SUBJECTS", "NAMES"), ["Anna"]);
                let tolerance = if integer { 0.5e-4 + 1e-8 } else { 2e-7 };
                check_equal(&file.recording(None).unwrap(), &written, tolerance);
            }
        }
    }
}

#[test]
fn many_markers_and_many_frames_go_beyond_a_word() {
    let many_markers = recording(300, 3);
    let read = read_c3d(&write_c3d(&many_markers, C3dFormat::default(), &[])).unwrap();
    check_equal(&read.recording(None).unwrap(), &many_markers, 2e-7);
    let long = recording(1, 70_001);
    for processor in PROCESSORS {
        let read = read_c3d(&write_c3d(&long, format(processor, true, true), &[])).unwrap();
        check_equal(&read.recording(None).unwrap(), &long, 0.6e-4);
    }
}

#[test]
fn labels_are_found_behind_a_prefix_if_it_is_clear_which() {
    let mut recording = recording(4, 1);
    recording.labels = ["Anna:LSHO", "Anna:RSHO", "Bert:RSHO", "STRN"].map(str::to_owned).to_vec();
    for (name, index) in
        [("LSHO", Some(0)), ("RSHO", None), ("Bert:RSHO", Some(2)), ("STRN", Some(3)), ("SHO", None)]
    {
        assert_eq!(recording.marker(name), index, "{name}");
    }
}

/// A sound file with some bytes replaced at the offsets given.
fn spoiled(changes: &[(usize, &[u8])]) -> Result<phiw_bspline_retarget::c3d::C3d, C3dError> {
    let mut bytes = write_c3d(&recording(3, 10), C3dFormat::default(), &[]);
    for &(at, new) in changes {
        bytes[at..at + new.len()].copy_from_slice(new);
    }
    read_c3d(&bytes)
}

/// Where the data of a parameter without dimensions start in the sound file.
fn data_of(name: &str) -> usize {
    let bytes = write_c3d(&recording(3, 10), C3dFormat::default(), &[]);
    let at = bytes.windows(name.len()).position(|window| window == name.as_bytes()).unwrap();
    at + name.len() + 4
}

#[test]
fn wrong_files_get_an_error_that_says_what_is_wrong() {
    let sound = write_c3d(&recording(3, 10), C3dFormat::default(), &[]);
    assert!(matches!(read_c3d(b"PK\x03\x04 a zip"), Err(C3dError::NotC3d { found: b'K' })));
    assert!(matches!(read_c3d(&[]), Err(C3dError::Truncated { what: "the header", .. })));
    assert!(matches!(read_c3d(&sound[..600]), Err(C3dError::Truncated { .. })));
    assert!(matches!(
        read_c3d(&sound[..sound.len() - 512]),
        Err(C3dError::Truncated { what: "the frames", .. })
    ));
    assert!(matches!(spoiled(&[(515, &[9])]), Err(C3dError::Processor { found: 9, at: 515 })));
    assert!(matches!(spoiled(&[(0, &[1])]), Err(C3dError::ParameterSection { .. })));
    assert!(matches!(spoiled(&[(0, &[200])]), Err(C3dError::Truncated { .. })));
    // The section lies about its length: an entry that points behind the file, and one that points into
    // itself.
    assert!(matches!(spoiled(&[(523, &[0xff, 0xff])]), Err(C3dError::Truncated { .. })));
    assert!(matches!(spoiled(&[(523, &[1, 0])]), Err(C3dError::ParameterSection { at: 523, .. })));
    assert!(matches!(spoiled(&[(data_of("USED"), &[0, 0])]), Err(C3dError::Empty { what: "points" })));
    let no_rate = [(data_of("RATE"), &[0u8; 4][..]), (20, &[0; 4])];
    assert!(matches!(spoiled(&no_rate), Err(C3dError::Rate { rate_hz: 0.0 })));
    let nan = f32::NAN.to_le_bytes();
    assert!(matches!(spoiled(&[(data_of("SCALE"), &nan)]), Err(C3dError::Parameter { .. })));
    let mut none = recording(3, 0);
    none.positions_m.clear();
    assert!(matches!(
        read_c3d(&write_c3d(&none, C3dFormat::default(), &[])),
        Err(C3dError::Empty { what: "frames" })
    ));
    let mut unknown = read_c3d(&sound).unwrap();
    unknown.units = "furlong".to_owned();
    assert!(matches!(unknown.recording(None), Err(C3dError::Units { .. })));
    assert!(unknown.recording(Some("cm")).is_ok());
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 600, ..Default::default() })]

    /// Whatever the bytes, the reader gives points or an error.
    #[test]
    fn spoiled_bytes_never_panic(
        processor in 0..3usize,
        integer: bool,
        changes in proptest::collection::vec((0usize..1600, any::<u8>()), 0..24),
        keep in 0usize..5000,
    ) {
        let mut bytes =
            write_c3d(&recording(3, 40), format(PROCESSORS[processor], integer, true), &[("A", "B", "note")]);
        for (at, new) in changes {
            let at = at % bytes.len();
            bytes[at] = new;
        }
        bytes.truncate(keep);
        if let Ok(file) = read_c3d(&bytes) {
            prop_assert!(!file.labels.is_empty() && file.frames() > 0);
            prop_assert_eq!(file.points.len(), file.frames() * file.labels.len());
        }
    }

    #[test]
    fn random_bytes_never_panic(mut bytes in proptest::collection::vec(any::<u8>(), 0..2048)) {
        // Random bytes would never come past the mark and the processor.
        for (at, byte) in [(0, 2), (1, 0x50), (515, 84)] {
            if let Some(place) = bytes.get_mut(at) {
                *place = byte;
            }
        }
        let _ = read_c3d(&bytes);
    }
}

fn c3d_files(folder: &Path) -> Vec<PathBuf> {
    let entries = folder.read_dir().into_iter().flatten().flatten();
    let mut files: Vec<PathBuf> = entries
        .map(|entry| entry.path())
        .filter(|path| path.extension().is_some_and(|e| e == "c3d"))
        .collect();
    files.sort();
    files
}

/// Against `trials.csv`, which another program wrote; the oracle compares coordinates.
#[test]
fn real_files_hold_what_is_listed_of_them() {
    let motions = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data/motions");
    let Ok(list) = std::fs::read_to_string(motions.join("ue_adl/trials.csv")) else {
        println!("skipped: shared/data/motions is absent");
        return;
    };
    let mut trials = 0;
    for line in list.lines().skip(1) {
        let cells: Vec<&str> = line.split(',').collect();
        let recording = read_recording(&motions.join(format!("ue_adl/c3d/{}.c3d", cells[0])), None).unwrap();
        assert_eq!(recording.frames(), cells[4].parse::<usize>().unwrap(), "{}", cells[0]);
        // The list leaves out markers that are missing in more than half of the frames.
        let frames = recording.frames();
        let missing = |marker: &usize| {
            (0..frames).filter(|&frame| recording.position_m(frame, *marker)[0].is_nan()).count()
        };
        let missing: Vec<usize> =
            (0..recording.labels.len()).map(|marker| missing(&marker)).filter(|&m| 2 * m <= frames).collect();
        assert_eq!(missing.len(), cells[6].parse::<usize>().unwrap(), "{}", cells[0]);
        let share = missing.iter().sum::<usize>() as f64 / (missing.len() * frames) as f64;
        assert!((share - cells[7].parse::<f64>().unwrap()).abs() < 6e-5, "{}", cells[0]);
        assert!(recording.marker("RHAN1").is_some() && (recording.rate_hz - 100.0).abs() < 1e-3);
        trials += 1;
    }
    assert_eq!(trials, 128);
    let gaps = c3d_files(&motions.join("c3d_with_gaps"));
    assert_eq!(gaps.len(), 4);
    for file in gaps {
        let share = read_recording(&file, None).unwrap().missing_share();
        assert!((0.005..0.4).contains(&share), "{}: {share}", file.display());
    }
}

/// A rate of a millionth made the resampling ask for 15 GB.
#[test]
fn rates_that_no_camera_has_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("motion.c3d");
    let read = |rate_hz: f64| {
        let recording = MarkerRecording { rate_hz, ..recording(4, 10) };
        std::fs::write(&path, write_c3d(&recording, C3dFormat::default(), &[])).unwrap();
        read_recording(&path, None).map_err(|error| error.to_string())
    };
    assert!(read(100.0).is_ok());
    for rate_hz in [1e-6, 1e9] {
        let error = read(rate_hz).unwrap_err();
        assert!(error.contains("motion.c3d") && error.contains("no camera's"), "{error}");
    }
}
