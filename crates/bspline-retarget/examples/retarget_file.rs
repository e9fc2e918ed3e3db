//! Retargets recordings of the set `ue_adl` and tells what came out:
//! `cargo run --release --example retarget_file -- ROBOT.urdf STATIC.c3d MOTION.c3d…`

use phiw_bspline_retarget::human::MarkerMap;
use phiw_bspline_retarget::markers::read_recording;
use phiw_bspline_retarget::{RetargetOptions, Retargeter};
use phiw_dynamics::urdf::{UrdfOptions, read_urdf_file};
use std::path::Path;
use std::time::Instant;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [urdf, static_trial, motions @ ..] = &arguments[..] else {
        return Err("give a URDF, a static trial and motions".into());
    };
    let tree = read_urdf_file(urdf, &UrdfOptions::default())?.tree;
    let retargeter = Retargeter::new(tree, MarkerMap::ue_adl()?, RetargetOptions::default())?;
    let calibration = retargeter.calibrate(&read_recording(Path::new(static_trial), None)?)?;
    println!("lengths {:.3?} m", calibration.lengths_m);
    for file in motions {
        let recording = read_recording(Path::new(file), None)?;
        let start = Instant::now();
        let motion = retargeter.retarget(&recording, Some(&calibration))?;
        println!(
            "{file}: {} frames in {:.0} ms, {} steps; markers {:.1} mm, hands {:.2} % of the arm",
            motion.frames,
            1e3 * start.elapsed().as_secs_f64(),
            motion.iterations,
            1e3 * motion.quality.marker_rms_m,
            1e2 * motion.quality.hand_share()
        );
    }
    Ok(())
}
