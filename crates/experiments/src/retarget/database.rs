//! Whole databases through `phiw retarget`: the seated set, two-handed motions made from it, the embedded
//! motions.

use super::page::Page;
use super::scene::Scene;
use anyhow::Context;
use phiw::arguments::{Derivatives, MotionFormat, RetargetArguments};
use phiw::console::Console;
use phiw_bspline_retarget::c3d::{C3dFormat, write_c3d};
use phiw_bspline_retarget::embedded::embedded_motions;
use phiw_bspline_retarget::markers::{MarkerRecording, read_recording};
use phiw_report::plot::{BoxGroup, BoxPlot, box_plot};
use phiw_report::statistics::median;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// What is known of one motion.
#[derive(serde::Deserialize)]
struct Facts {
    frames: usize,
    rate_hz: f64,
    marker_rms_m: f64,
    elbow_rms_m: f64,
    hand_rms_m: f64,
    arm_length_m: f64,
    limit_excess: f64,
    jerk_rms: f64,
}

/// Retargets every set and says what came out.
///
/// # Errors
/// A recording cannot be read, made or retargeted.
pub(super) fn measure(scene: &Scene, seed: u64, out: &Path, page: &mut Page) -> anyhow::Result<()> {
    page.heading("Databases");
    let folder = tempfile::tempdir()?;
    let mut sets: Vec<(&str, Vec<PathBuf>, bool)> = Vec::new();
    if let Some(seated) = &scene.seated {
        sets.push(("seated", c3d_files(seated)?, false));
        sets.push(("seated, torso from reach", c3d_files(seated)?, true));
        sets.push(("two-handed", two_handed(seated, folder.path())?, true));
    }
    sets.push(("embedded", embedded(seed, folder.path())?, false));
    let mut samples: [Vec<Vec<f64>>; 3] = Default::default();
    for (name, files, torso_from_reach) in &sets {
        let folder = out.join(name.replace([' ', ','], "_"));
        // A run that keeps what is there would measure nothing.
        if folder.exists() {
            std::fs::remove_dir_all(&folder)?;
        }
        let arguments = RetargetArguments {
            urdf: scene.urdf.clone(),
            c3d: files.clone(),
            map: None,
            hold: scene.hold.clone(),
            torso_from_reach: *torso_from_reach,
            velocity_limits: false,
            interval: 0.2,
            derivatives: Derivatives::Analytic,
            format: MotionFormat::Csv,
            out: folder.clone(),
            quiet: true,
        };
        let start = Instant::now();
        let outcome = phiw::retarget::retarget(&arguments, &Console::silent())?;
        let seconds = start.elapsed().as_secs_f64();
        for failure in &outcome.failures {
            page.say(&format!("failed: {}", failure.reason));
        }
        let facts = read_facts(&folder)?;
        let duration: f64 = facts.iter().map(|facts| facts.frames as f64 / facts.rate_hz).sum();
        let column = |value: &dyn Fn(&Facts) -> f64| -> Vec<f64> { facts.iter().map(value).collect() };
        let markers = column(&|facts| 1e3 * facts.marker_rms_m);
        let hands = column(&|facts| 1e2 * facts.hand_rms_m / facts.arm_length_m);
        let elbows = column(&|facts| 1e2 * facts.elbow_rms_m / facts.arm_length_m);
        let jerk = column(&|facts| facts.jerk_rms);
        page.say(&format!(
            "{name}: {} motions, {duration:.0} s in {seconds:.1} s ({:.0} times real time). Median (largest): markers {:.1} ({:.1}) mm, \
             hands {:.2} ({:.2}) and elbows {:.2} ({:.2}) % of the arm, jerk {:.0} ({:.0}) rad/s³; beyond limits {:.1e} rad",
            facts.len(),
            duration / seconds,
            median(&markers),
            largest(&markers),
            median(&hands),
            largest(&hands),
            median(&elbows),
            largest(&elbows),
            median(&jerk),
            largest(&jerk),
            largest(&column(&|facts| facts.limit_excess)),
        ));
        for (all, values) in samples.iter_mut().zip([markers, hands, jerk]) {
            all.push(values);
        }
    }
    let places: Vec<String> = sets.iter().map(|(name, ..)| (*name).to_owned()).collect();
    let labels = ["marker error [mm]", "hand error [% of the arm]", "jerk [rad/s³]"];
    for (samples, label) in samples.iter().zip(labels) {
        let groups = [BoxGroup { name: "motions", samples }];
        let plot =
            BoxPlot { groups: &groups, places: &places, x_label: "set", y_label: label, logarithmic: true };
        page.picture(box_plot(&plot).as_str(), &format!("{label}, RMS of each motion"));
    }
    Ok(())
}

/// The embedded motions as C3D files.
///
/// # Errors
/// One cannot be written.
pub fn embedded(seed: u64, folder: &Path) -> anyhow::Result<Vec<PathBuf>> {
    let folder = folder.join("embedded");
    std::fs::create_dir_all(&folder)?;
    embedded_motions(seed)?
        .map(|motion| {
            let file = folder.join(format!("{}.c3d", motion.name));
            std::fs::write(&file, motion.to_c3d())?;
            Ok(file)
        })
        .collect()
}

/// Each left trial played with the right trial of the same subject and task, as C3D files beside the static
/// trials.
///
/// # Errors
/// A recording cannot be read or written.
pub fn two_handed(seated: &Path, folder: &Path) -> anyhow::Result<Vec<PathBuf>> {
    let folder = folder.join("two_handed");
    std::fs::create_dir_all(&folder)?;
    let mut files = Vec::new();
    for left_file in c3d_files(seated)? {
        let name = left_file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        if name.ends_with("_static") {
            std::fs::copy(&left_file, folder.join(format!("{name}.c3d")))?;
            continue;
        }
        let Some(stem) = name.strip_suffix("L1") else { continue };
        let [left, right] =
            [left_file.clone(), seated.join(format!("{stem}R1.c3d"))].map(|file| read_recording(&file, None));
        let file = folder.join(format!("{stem}B1.c3d"));
        std::fs::write(&file, write_c3d(&both(&left?, &right?), C3dFormat::default(), &[]))?;
        files.push(file);
    }
    Ok(files)
}

/// Markers of the right side from one recording, the others from the other, for as long as both last.
fn both(left: &MarkerRecording, right: &MarkerRecording) -> MarkerRecording {
    let frames = left.frames().min(right.frames());
    let mut both = left.clone();
    let count = both.labels.len();
    both.positions_m.truncate(frames * count);
    for (marker, label) in left.labels.iter().enumerate() {
        let Some(source) = right.marker(label).filter(|_| label.starts_with('R')) else { continue };
        for frame in 0..frames {
            both.positions_m[frame * count + marker] = right.position_m(frame, source);
        }
    }
    both
}

fn read_facts(folder: &Path) -> anyhow::Result<Vec<Facts>> {
    let mut facts = Vec::new();
    for entry in folder.read_dir().with_context(|| folder.display().to_string())? {
        let path = entry?.path();
        if path.extension().is_some_and(|extension| extension == "json") {
            facts.push(serde_json::from_str(&std::fs::read_to_string(path)?)?);
        }
    }
    Ok(facts)
}

/// The C3D files of a folder, sorted.
///
/// # Errors
/// The folder cannot be read.
pub fn c3d_files(folder: &Path) -> anyhow::Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    for entry in folder.read_dir().with_context(|| folder.display().to_string())? {
        let path = entry?.path();
        if path.extension().is_some_and(|extension| extension == "c3d") {
            files.push(path);
        }
    }
    files.sort();
    Ok(files)
}

fn largest(values: &[f64]) -> f64 {
    values.iter().copied().fold(f64::NEG_INFINITY, f64::max)
}
