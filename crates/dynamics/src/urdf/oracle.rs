//! Our reading of a URDF against that of `urdf-rs`, field by field and bit by bit.

use super::reading::read;
use super::robot::{Inertial, Joint, Link, Pose, Robot};
use super::source::parse;
use crate::random_tree::{RandomNumbers, RandomTreeOptions, random_urdf};
use proptest::prelude::*;
use std::path::{Path, PathBuf};

/// Fails unless both readings are the same.
#[track_caller]
fn agrees(xml: &str) {
    let ours = read(&parse(xml).unwrap()).unwrap();
    let theirs = urdf_rs::read_from_string(xml).unwrap();
    compare(&ours, &theirs);
}

#[track_caller]
fn compare(ours: &Robot, theirs: &urdf_rs::Robot) {
    assert_eq!(ours.name, theirs.name);
    assert_eq!((ours.links.len(), ours.joints.len()), (theirs.links.len(), theirs.joints.len()));
    for (ours, theirs) in ours.links.iter().zip(&theirs.links) {
        compare_links(ours, theirs);
    }
    for (ours, theirs) in ours.joints.iter().zip(&theirs.joints) {
        compare_joints(ours, theirs);
    }
}

#[track_caller]
fn compare_links(ours: &Link, theirs: &urdf_rs::Link) {
    assert_eq!(ours.name, theirs.name);
    let none = Inertial::default();
    let inertial = ours.inertial.as_ref().unwrap_or(&none);
    let i = &theirs.inertial.inertia;
    let what = |field| format!("the {field} of link `{}`", ours.name);
    same_pose(&inertial.origin, &theirs.inertial.origin, &what("inertial"));
    same(&[inertial.mass], &[theirs.inertial.mass.value], &what("mass"));
    same(&inertial.inertia, &[i.ixx, i.ixy, i.ixz, i.iyy, i.iyz, i.izz], &what("inertia"));
}

#[track_caller]
fn compare_joints(ours: &Joint, theirs: &urdf_rs::Joint) {
    assert_eq!(
        (&ours.name, &ours.parent, &ours.child),
        (&theirs.name, &theirs.parent.link, &theirs.child.link)
    );
    assert_eq!(ours.kind.name(), format!("{:?}", theirs.joint_type).to_lowercase());
    let what = |field| format!("the {field} of joint `{}`", ours.name);
    same_pose(&ours.origin, &theirs.origin, &what("origin"));
    same(&ours.axis, &theirs.axis.xyz.0, &what("axis"));
    // What the file leaves out is zero or infinite in their reading, and `None` in ours.
    let left_out = |number: f64| number == 0.0 || number.is_infinite();
    match ours.limit.range {
        Some(range) => same(&range, &[theirs.limit.lower, theirs.limit.upper], &what("range")),
        None => assert!(left_out(theirs.limit.lower) && left_out(theirs.limit.upper), "{}", what("range")),
    }
    for (ours, theirs, field) in [
        (ours.limit.velocity, theirs.limit.velocity, "velocity limit"),
        (ours.limit.effort, theirs.limit.effort, "effort limit"),
    ] {
        match ours {
            Some(number) => same(&[number], &[theirs], &what(field)),
            None => assert!(left_out(theirs), "{}", what(field)),
        }
    }
    let friction = theirs.dynamics.clone().unwrap_or_default();
    same(&[ours.damping, ours.friction], &[friction.damping, friction.friction], &what("dynamics"));
    assert_eq!(ours.mimic.is_some(), theirs.mimic.is_some(), "{}", what("mimic"));
    if let (Some(ours), Some(theirs)) = (&ours.mimic, &theirs.mimic) {
        assert_eq!(ours.joint, theirs.joint);
        let (multiplier, offset) = (theirs.multiplier.unwrap_or(1.0), theirs.offset.unwrap_or(0.0));
        same(&[ours.multiplier, ours.offset], &[multiplier, offset], &what("mimic"));
    }
}

#[track_caller]
fn same_pose(ours: &Pose, theirs: &urdf_rs::Pose, what: &str) {
    same(&ours.xyz, &theirs.xyz.0, what);
    same(&ours.rpy, &theirs.rpy.0, what);
}

#[track_caller]
fn same(ours: &[f64], theirs: &[f64], what: &str) {
    let bits = |numbers: &[f64]| numbers.iter().map(|number| number.to_bits()).collect::<Vec<_>>();
    assert_eq!(bits(ours), bits(theirs), "{what}: {ours:?} instead of {theirs:?}");
}

/// The URDFs in a folder and in those inside of it.
fn urdfs(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path());
    let (folders, files): (Vec<_>, Vec<_>) = entries.partition(|path| path.is_dir());
    let urdfs_inside = folders.iter().flat_map(|folder| urdfs(folder));
    urdfs_inside
        .chain(files.into_iter().filter(|path| path.extension().is_some_and(|end| end == "urdf")))
        .collect()
}

#[test]
fn models() {
    let models = urdfs(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models"));
    assert!(!models.is_empty());
    models.iter().for_each(|path| agrees(&std::fs::read_to_string(path).unwrap()));
}

#[test]
fn real_robots() {
    let robots = urdfs(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data"));
    if robots.is_empty() {
        println!("skipped: no shared/data");
    }
    robots.iter().for_each(|path| agrees(&std::fs::read_to_string(path).unwrap()));
}

/// Attributes and elements that a URDF may leave out, by how they begin.
const OPTIONAL: [&str; 10] = [
    " rpy=\"",
    " xyz=\"",
    " damping=\"",
    " friction=\"",
    " multiplier=\"",
    " offset=\"",
    " lower=\"",
    " upper=\"",
    " effort=\"",
    " version=\"",
];

/// The text without some of what it may leave out. An `<axis>` keeps its `xyz`.
fn without_some(xml: &str, random: &mut RandomNumbers) -> String {
    let mut result = String::new();
    let mut rest = xml;
    while let Some(start) = rest.find(" ") {
        let (before, from) = rest.split_at(start);
        result.push_str(before);
        let value = from.find('"').map(|quote| quote + 1);
        let end = value.and_then(|value| Some(value + from[value..].find('"')? + 1));
        match end {
            Some(end)
                if OPTIONAL.iter().any(|start| from.starts_with(start))
                    && !before.ends_with("<axis")
                    && random.chance(0.3) =>
            {
                rest = &from[end..];
            }
            _ => {
                result.push(' ');
                rest = &from[1..];
            }
        }
    }
    result + rest
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn random_robots(seed in any::<u64>(), joints in 1..=20_usize, version in 0..6_usize) {
        let options = RandomTreeOptions { joints, floating_base: false, mimic: true, fixed_links: true };
        let random = &mut RandomNumbers::new(seed);
        let mut xml = without_some(&random_urdf(seed, &options), random);
        let version = ["1.0", "1.1", "1.2", " 1.1 ", "2.0", "new"][version];
        xml = xml.replacen("<robot", &format!("<robot version=\"{version}\""), 1);
        if random.chance(0.5) {
            // Four numbers in the place of three; before 1.1 the attribute means nothing.
            xml = xml.replace("rpy=\"", "quat_xyzw=\"\t0.4 \n ");
        }
        agrees(&xml);
    }
}

/// One joint with these contents between two links, the second with those.
fn pair(joint: &str, link: &str) -> String {
    format!(
        "<robot name='r' version='1.1'><link name='a'/><link name='b'>{link}</link><joint name='j' type='revolute'>{joint}\
         <parent link='a'/><child link='b'/></joint></robot>"
    )
}

#[test]
fn spellings() {
    for joint in [
        "",
        "<origin/>",
        "<origin xyz='  1\t-2\n+3.5e-1 '/><axis xyz='.5 1. -0'/>",
        "<origin rpy='1 inf -0'/>",
        "<origin quat_xyzw='0 0 0 0'/>",
        "<origin quat_xyzw='0 7.1 0 7.1'/>",
        "<origin quat_xyzw='0.1 -7.1 -0.1 7.1'/>",
        "<limit lower=' -1 ' upper='&#50;' velocity='1e3'/><dynamics/>",
        "<!-- <origin/> --><mimic joint='&lt;k&gt; &amp;'/><dynamics friction='3'/>",
        "<safety_controller k_velocity='1'/><calibration rising='0'/>",
    ] {
        agrees(&pair(joint, ""));
    }
    let tensor = "<inertia ixx='1' ixy='2' ixz='3' iyy='4' iyz='5' izz='6'/>";
    agrees(&pair("", &format!("<inertial>{tensor}<mass value=' 7 '/></inertial>")));
    agrees(&pair(
        "",
        &format!("<inertial><mass value='1'/><origin quat_xyzw='1 2 3 4' xyz='1 2 3'/>{tensor}</inertial>"),
    ));
    for kind in ["continuous", "prismatic", "fixed", "floating", "planar", "spherical"] {
        agrees(&pair("", "").replace("revolute", kind));
    }
}
