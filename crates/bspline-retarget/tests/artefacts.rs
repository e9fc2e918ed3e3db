//! Samples that are no measurements, and recordings that are no person's motion.

use phiw_bspline_retarget::c3d::{C3dFormat, write_c3d};
use phiw_bspline_retarget::embedded::embedded_motions;
use phiw_bspline_retarget::human::MarkerMap;
use phiw_bspline_retarget::markers::{
    Artefact, ArtefactKind, MarkerRecording, MarkerSettings, read_recording,
};
use phiw_bspline_retarget::{RetargetError, RetargetOptions, Retargeter};
use phiw_dynamics::urdf::{UrdfOptions, read_urdf_file};
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// One second of a motion of the embedded ones.
fn motion() -> MarkerRecording {
    let mut recording = embedded_motions(3).unwrap().nth(20).unwrap().recording;
    recording.positions_m.truncate(100 * recording.labels.len());
    recording
}

fn all(recording: &MarkerRecording) -> Vec<usize> {
    (0..recording.labels.len()).collect()
}

fn remove_artefacts(recording: &mut MarkerRecording) -> Vec<Artefact> {
    recording.remove_artefacts(&all(recording), &MarkerSettings::default())
}

/// Holds a marker where it is in the first frame that shows it.
fn freeze(recording: &mut MarkerRecording, marker: usize) {
    let at = (0..recording.frames()).map(|frame| recording.position_m(frame, marker));
    let at = at.into_iter().find(|position| position[0].is_finite()).unwrap();
    let markers = recording.labels.len();
    recording.positions_m.iter_mut().skip(marker).step_by(markers).for_each(|position| *position = at);
}

fn retargeter(change: impl FnOnce(&mut MarkerMap, &mut RetargetOptions)) -> Retargeter {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models/upper_body18.urdf");
    let tree = read_urdf_file(path, &UrdfOptions::default()).unwrap().tree;
    let (mut map, mut options) = (MarkerMap::embedded().unwrap(), RetargetOptions::default());
    change(&mut map, &mut options);
    Retargeter::new(tree, map, options).unwrap()
}

/// A table of points with every number multiplied, which is how another unit looks.
fn table(recording: &MarkerRecording, factor: f64) -> String {
    let mut text = "t".to_owned();
    for label in &recording.labels {
        write!(text, ",{label}.x,{label}.y,{label}.z").unwrap();
    }
    for frame in 0..recording.frames() {
        write!(text, "\n{}", frame as f64 / recording.rate_hz).unwrap();
        for marker in 0..recording.labels.len() {
            let [x, y, z] = recording.position_m(frame, marker).map(|x| x * factor);
            write!(text, ",{x},{y},{z}").unwrap();
        }
    }
    text
}

/// Such samples drew the whole person to them: a marker RMS of 15 m was a result.
#[test]
fn samples_that_are_no_measurements_are_taken_out_and_named() {
    let good = motion();
    let markers = good.labels.len();
    assert_eq!(remove_artefacts(&mut good.clone()), []);
    let mut spoiled = good.clone();
    spoiled.positions_m[50 * markers + 2][1] += 1e3;
    spoiled.positions_m[70 * markers + 3] = [0.0; 3];
    freeze(&mut spoiled, 4);
    let found = remove_artefacts(&mut spoiled);
    let expected = [
        (2, ArtefactKind::Spike, 1, 51),
        (3, ArtefactKind::Zero, 1, 71),
        (4, ArtefactKind::Frozen, good.frames(), 1),
    ];
    let expected = expected.map(|(marker, kind, samples, first_frame)| Artefact {
        marker: good.labels[marker].clone(),
        kind,
        samples,
        first_frame,
    });
    assert_eq!(found, expected);
    assert!(spoiled.position_m(50, 2)[0].is_nan() && !spoiled.is_ever_seen(4));
    assert_eq!(spoiled.position_m(51, 2), good.position_m(51, 2));
}

/// One sample elsewhere gave a frozen marker a range, and it held the person where it hung.
#[test]
fn a_frozen_marker_with_a_spike_counted_as_moving() {
    let mut spoiled = motion();
    let markers = spoiled.labels.len();
    freeze(&mut spoiled, 4);
    for frame in [0, 40, 41] {
        spoiled.positions_m[frame * markers + 4][2] += 0.3;
    }
    let found = remove_artefacts(&mut spoiled);
    assert_eq!(found.len(), 1, "{found:?}");
    assert_eq!((found[0].kind, found[0].samples), (ArtefactKind::Frozen, spoiled.frames()));
}

/// Where half of the markers hung, none was said to, and the person stood still with them.
#[test]
fn half_of_the_markers_frozen_were_taken_for_a_person_at_rest() {
    let retargeter = retargeter(|_, _| ());
    let mut spoiled = motion();
    let half = spoiled.labels.len().div_ceil(2);
    (0..half).for_each(|marker| freeze(&mut spoiled, marker));
    assert_eq!(remove_artefacts(&mut spoiled), []);
    let error = retargeter.retarget(&spoiled, None).unwrap_err();
    assert!(matches!(error, RetargetError::Frozen { frozen, .. } if frozen == half), "{error}");
    assert!(error.to_string().starts_with("most markers are frozen"), "{error}");
    // A static trial may be one pose.
    (0..spoiled.labels.len()).for_each(|marker| freeze(&mut spoiled, marker));
    assert!(retargeter.calibrate(&spoiled).is_ok());
}

/// A marker of the laboratory is none of the person's: it does not move, and may be anywhere.
#[test]
fn markers_that_the_map_does_not_name_had_a_say() {
    let mut recording = motion();
    let own = recording.labels.len();
    let frames: Vec<Vec<[f64; 3]>> = recording.positions_m.chunks(own).map(<[_]>::to_vec).collect();
    let fixed: Vec<[f64; 3]> = (0..own + 1).map(|index| [9.0, index as f64, 0.5]).collect();
    recording.positions_m = frames.iter().flat_map(|frame| frame.iter().chain(&fixed)).copied().collect();
    recording.labels.extend((0..fixed.len()).map(|index| format!("floor{index}")));
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("motion.c3d");
    std::fs::write(&path, write_c3d(&recording, C3dFormat::default(), &[])).unwrap();
    let retargeter = retargeter(|_, _| ());
    let (read, artefacts) = retargeter.read(&path).unwrap();
    assert_eq!(artefacts, []);
    assert!(retargeter.retarget(&read, None).is_ok());
}

#[test]
fn units_that_make_no_person_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("motion.c3d");
    let read = |factor: f64| {
        let mut recording = motion();
        recording.positions_m.iter_mut().flatten().for_each(|x| *x *= factor);
        std::fs::write(&path, write_c3d(&recording, C3dFormat::default(), &[])).unwrap();
        retargeter(|_, _| ()).read(&path).map_err(|error| error.to_string())
    };
    assert!(read(1.0).is_ok());
    for (factor, words) in [(1e3, "in mm, not m"), (1e-3, "in m, not mm"), (1e30, "set `units` in the map")] {
        let error = read(factor).unwrap_err();
        assert!(error.contains("motion.c3d: the markers span") && error.contains(words), "{error}");
    }
}

/// The advice of the message, `units` in the map, changed nothing for a table.
#[test]
fn a_table_in_millimetres_was_refused_whatever_the_map_said() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("motion.csv");
    std::fs::write(&path, table(&motion(), 1e3)).unwrap();
    let error = retargeter(|_, _| ()).read(&path).unwrap_err().to_string();
    assert!(error.contains("set `units` in the map (as if they were in mm, not m)"), "{error}");
    let told = retargeter(|map, _| map.units = Some("mm".to_owned()));
    let (read, artefacts) = told.read(&path).unwrap();
    assert_eq!(artefacts, []);
    assert!((read.position_m(9, 5)[0] - motion().position_m(9, 5)[0]).abs() < 1e-12);
}

/// Zeros stretched the box around the person to the origin, and the unit was blamed.
#[test]
fn zeros_counted_for_the_extent_of_the_person() {
    let mut recording = motion();
    // Markers that are not seen are at the origin, and the person is far from it.
    let missing = |at: usize| at.is_multiple_of(5);
    for (at, position) in recording.positions_m.iter_mut().enumerate() {
        *position = if missing(at) { [0.0; 3] } else { [position[0] + 20.0, position[1], position[2]] };
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("motion.csv");
    std::fs::write(&path, table(&recording, 1.0)).unwrap();
    let (read, artefacts) = retargeter(|_, _| ()).read(&path).unwrap();
    assert!(!artefacts.is_empty() && artefacts.iter().all(|artefact| artefact.kind == ArtefactKind::Zero));
    assert!(read.missing_share() > 0.19);
}

/// Markers that are swapped are seen well and fit no person.
#[test]
fn markers_that_fit_no_person_made_a_motion() {
    let mut recording = motion();
    let markers = recording.labels.len();
    recording.positions_m.chunks_mut(markers).skip(30).step_by(10).for_each(<[_]>::reverse);
    let error = retargeter(|_, _| ()).retarget(&recording, None).map(|motion| motion.quality).unwrap_err();
    let RetargetError::FarOff { rms_m, marker, marker_rms_m } = &error else { panic!("{error}") };
    assert!(*rms_m > 0.1 && marker_rms_m >= rms_m && recording.marker(marker).is_some(), "{error}");
    assert!(error.to_string().contains(marker), "{error}");
}

/// A tenth of a microsecond between control points asked for all the memory that there is.
#[test]
fn control_points_had_no_bound() {
    for interval_s in [1e-7, 1e-300] {
        let retargeter = retargeter(|_, options| options.interval_s = interval_s);
        let error = retargeter.basis(&motion()).unwrap_err();
        assert!(matches!(error, RetargetError::TooManyControlPoints { .. }), "{error}");
    }
}

/// The C3D files of the folders of real recordings.
fn real_files() -> Vec<PathBuf> {
    let motions = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data/motions");
    let mut files: Vec<PathBuf> = ["ue_adl/c3d", "c3d_with_gaps"]
        .iter()
        .flat_map(|folder| motions.join(folder).read_dir().into_iter().flatten().flatten())
        .map(|entry| entry.path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "c3d"))
        .collect();
    files.sort();
    files
}

/// Of 148 recordings one has artefacts: two markers of a foot change places for one frame.
#[test]
fn real_recordings_have_no_artefacts_but_two_markers_that_change_places() {
    let files = real_files();
    if files.is_empty() {
        println!("skipped: no recordings in ../shared/data/motions");
        return;
    }
    assert_eq!(files.len(), 148);
    let half = MarkerSettings { frozen_share: 0.5, ..MarkerSettings::default() };
    for file in files {
        let mut recording = read_recording(&file, None).unwrap();
        assert_eq!(recording.frozen(&all(&recording), &half), [0_usize; 0], "{}", file.display());
        let exchanged: &[_] =
            if file.ends_with("walkingOptiTrack.c3d") { &["Foot_Marker3", "Foot_Marker5"] } else { &[] };
        let expected: Vec<Artefact> = exchanged
            .iter()
            .map(|&marker| Artefact {
                marker: marker.to_owned(),
                kind: ArtefactKind::Spike,
                samples: 1,
                first_frame: 1953,
            })
            .collect();
        assert_eq!(remove_artefacts(&mut recording), expected, "{}", file.display());
    }
}
