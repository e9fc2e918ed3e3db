#![doc = include_str!("../README.md")]

mod readers;
pub mod structured;

pub use readers::{
    c3d, log, marker_map, mjcf, model_json, motion, point_csv, random_log, random_robot, support, urdf,
};

/// A function that a fuzzer calls.
pub type Target = fn(&[u8]);

/// All targets by name; the corpus has a folder for each.
pub const TARGETS: [(&str, Target); 11] = [
    ("urdf", urdf),
    ("mjcf", mjcf),
    ("random_robot", random_robot),
    ("log", log),
    ("random_log", random_log),
    ("c3d", c3d),
    ("point_csv", point_csv),
    ("motion", motion),
    ("marker_map", marker_map),
    ("support", support),
    ("model_json", model_json),
];
