//! One function for each kind of file.

use crate::structured;
use phiw_bspline_retarget::c3d::read_c3d;
use phiw_bspline_retarget::human::MarkerMap;
use phiw_bspline_retarget::markers::{MarkerRecording, MarkerSettings, read_recording};
use phiw_dynamics::urdf::{UrdfOptions, read_urdf};
use phiw_dynamics::{Tree, Workspace};
use phiw_effects::Catalogue;
use phiw_identification::Model;
use phiw_mjcf::read_mjcf_with;
use phiw_telemetry::{Conditioning, ConditioningOptions, TorqueColumns, stream, survey};
use phiw_zmp::feet_from_toml;
use std::io::Write;
use std::ops::ControlFlow;
use tempfile::NamedTempFile;

/// The robot that files other than URDFs are read for.
const ROBOT: &str = include_str!("../../../models/planar2.urdf");

fn robot() -> Option<Tree> {
    read_urdf(ROBOT, &UrdfOptions::default()).ok().map(|reading| reading.tree)
}

/// A file of these bytes with that ending; none where the system gives none.
fn file(bytes: &[u8], ending: &str) -> Option<NamedTempFile> {
    let mut file = tempfile::Builder::new().suffix(ending).tempfile().ok()?;
    file.write_all(bytes).ok()?;
    Some(file)
}

/// A URDF: refused, or a robot whose torques can be computed.
pub fn urdf(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    for floating_base in [false, true] {
        let Ok(reading) = read_urdf(text, &UrdfOptions { floating_base, ..UrdfOptions::default() }) else {
            continue;
        };
        let tree = reading.tree;
        let mut q = vec![0.3; tree.configuration_size()];
        if floating_base {
            q[..7].copy_from_slice(&[0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]);
        }
        let v = vec![0.2; tree.velocity_size()];
        let mut torque = vec![0.0; tree.velocity_size()];
        let outcome = tree.inverse_dynamics(&q, &v, &v, &mut Workspace::new(&tree), &mut torque);
        assert!(outcome.is_ok(), "{outcome:?}");
        // A joint that follows one that follows another may be as fast as the file likes.
        assert!(tree.has_mimic() || torque.iter().all(|torque| torque.is_finite()), "{torque:?}");
    }
}

/// An MJCF file that includes others, all of these bytes: refused, or a URDF, as [`urdf`].
pub fn mjcf(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    // After the first file whatever is included is a small one.
    let mut load = |name: &str| match name.len() % 3 {
        0 => Err("it is not there".to_owned()),
        1 => Ok(text.to_owned()),
        _ => Ok("<mujocoinclude><option timestep=\"0.01\"/></mujocoinclude>".to_owned()),
    };
    if let Ok(reading) = read_mjcf_with(text, &mut load) {
        urdf(reading.urdf.as_bytes());
    }
}

/// A robot made of the bytes, as [`urdf`].
pub fn random_robot(bytes: &[u8]) {
    if let Ok(text) = structured::robot(bytes) {
        urdf(text.as_bytes());
    }
}

/// A log: refused, or blocks of finite numbers.
pub fn log(bytes: &[u8]) {
    let Some(file) = file(bytes, ".csv") else { return };
    let joints: Vec<String> = structured::JOINTS.map(str::to_owned).to_vec();
    let Ok(survey) = survey(file.path(), &joints, TorqueColumns::Optional, &mut |_, _| ()) else { return };
    assert!(survey.used_rows <= survey.rows);
    let Ok(conditioning) =
        Conditioning::choose(std::slice::from_ref(&survey), &ConditioningOptions::default())
    else {
        return;
    };
    let mut finite = true;
    let mut sink = |block: phiw_telemetry::Block| {
        finite &= [&block.q, &block.qd, &block.qdd, &block.tau].into_iter().flatten().all(|x| x.is_finite());
        ControlFlow::Continue(())
    };
    let streamed = stream(&survey, &conditioning, &mut |_, _| (), &mut sink);
    assert!(streamed.is_err() || finite, "a block holds a number that is not finite");
}

/// A log made of the bytes, as [`log`].
pub fn random_log(bytes: &[u8]) {
    if let Ok(text) = structured::log(bytes) {
        log(text.as_bytes());
    }
}

/// Whether a recording holds what its sizes say, with and without its artefacts.
fn check_recording(mut recording: MarkerRecording) {
    assert_eq!(recording.positions_m.len(), recording.frames() * recording.labels.len());
    let markers: Vec<usize> = (0..recording.labels.len()).collect();
    recording.remove_artefacts(&markers, &MarkerSettings::default());
    let _ = recording.extent_m(&markers);
    assert!((0.0..=1.0).contains(&recording.missing_share()));
}

/// A C3D file.
pub fn c3d(bytes: &[u8]) {
    if read_c3d(bytes).is_err() {
        return;
    }
    let Some(file) = file(bytes, ".c3d") else { return };
    for units in [None, Some("m"), Some("mm")] {
        if let Ok(recording) = read_recording(file.path(), units) {
            check_recording(recording);
        }
    }
}

/// A table of named points.
pub fn point_csv(bytes: &[u8]) {
    let Some(file) = file(bytes, ".csv") else { return };
    if let Ok(recording) = read_recording(file.path(), None) {
        check_recording(recording);
    }
}

/// A recording whose format its content tells: BVH, TRC, npz of AMASS.
pub fn motion(bytes: &[u8]) {
    let Some(file) = file(bytes, "") else { return };
    if let Ok(recording) = read_recording(file.path(), None) {
        check_recording(recording);
    }
}

/// A marker map.
pub fn marker_map(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    if let Ok(map) = MarkerMap::from_toml(text) {
        assert!(map.marker_spread_m >= 0.0);
    }
}

/// What a robot stands on.
pub fn support(bytes: &[u8]) {
    let (Ok(text), Some(tree)) = (std::str::from_utf8(bytes), robot()) else { return };
    let _ = feet_from_toml(text, &tree);
}

/// A model.json: refused, or one whose columns and factor can be made.
pub fn model_json(bytes: &[u8]) {
    let (Ok(model), Some(tree)) = (serde_json::from_slice::<Model>(bytes), robot()) else { return };
    if model.check().is_err() {
        return;
    }
    let again = serde_json::to_vec(&model).ok().and_then(|json| serde_json::from_slice::<Model>(&json).ok());
    assert!(again.is_some(), "a model that can't be read again");
    let _ = model.design(&tree, &Catalogue::default());
    let _ = model.factor.factor();
}
