//! Real robots' URDFs are read as what they are.

use phiw_dynamics::urdf::{UrdfOptions, UrdfReading, read_urdf_file};
use std::path::PathBuf;

fn read(path: &str, options: &UrdfOptions) -> Option<UrdfReading> {
    let file = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data").join(path);
    if !file.exists() {
        println!("skipped: no {}", file.display());
        return None;
    }
    Some(read_urdf_file(&file, options).unwrap_or_else(|error| panic!("{path}: {error}")))
}

fn check(path: &str, held: &[&str], joints: usize) {
    let held = held.iter().map(|joint| (joint.to_string(), 0.0)).collect();
    for floating_base in [false, true] {
        let options = UrdfOptions { floating_base, held: Vec::clone(&held), ..UrdfOptions::default() };
        let Some(UrdfReading { tree, findings, .. }) = read(path, &options) else { return };
        println!("{path}: {} bodies, {} joints", tree.bodies().len(), tree.joint_count());
        findings.iter().for_each(|finding| println!("  {finding}"));
        assert_eq!(tree.joint_count(), joints, "{path}");
        assert_eq!(tree.velocity_size(), joints + if floating_base { 6 } else { 0 }, "{path}");
    }
}

#[test]
fn robots_have_their_joints() {
    check("robots/torobo20/torobo20.urdf", &[], 20);
    check("robots/torobo20/torobo20.urdf", &["torso/joint_3", "head/joint_1"], 18);
    check("logs/tx40/tx40.urdf", &[], 6);
    check("logs/emps/emps.urdf", &[], 1);
    check("logs/kr300/kr300.urdf", &[], 6);
    check("robots/g1/g1_29dof_rev_1_0.urdf", &[], 29);
    check("robots/talos/talos_full_v2.urdf", &[], 32);
    check("robots/talos/talos_reduced.urdf", &[], 32);
}
