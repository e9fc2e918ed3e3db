//! The experiments of this project: what phiw's crates can do, measured, on robots and logs that are made on
//! the spot.
//!
//! Each experiment is a module with a page of documentation: what it asks, how it is run, what it prints, and
//! where its results go. Each has its command line, `Arguments`, and `command(&Arguments)`, which does it.
//! `cargo xtask` is the way in.
//!
//! | module | asks |
//! |---|---|
//! | [`mod@run`] | does the whole chain work, from motions and logs to a model with its missing effect found? |
//! | [`paper`] | do the results of the paper's section 5 come out, with balance and undeclared effects as well? |
//! | [`noise`] | what does the curriculum learn from a robot whose noise nobody knows? |
//! | [`undeclared`] | which undeclared effects does `phiw explain` find in logs, and what does it invent? |
//! | [`added`] | does it find an effect that was added to the torques of a real robot? |
//! | [`plant`] | does it find them in the closed loop of a physics engine, tracked poorly? |
//! | [`retarget`] | how fast and how close is retargeting, over whole databases and against others? |
//! | [`oracle`] | do dynamics, C3D reader and exported files agree with Pinocchio, ezc3d and MuJoCo? |
//! | [`consistent`] | what does it cost that identified bodies can exist? |
//! | [`conventions`] | are signs, units and mountings told that differ between a log and its URDF? |
//! | [`coverage`] | how often do 95 % intervals and bands hold the truth? |
//! | [`fleet`] | do logs that are reduced apart give the files of one process, and what is gained? |
//! | [`synthetic_log`] | does memory grow with the length of a log? It makes the log. |
//!
//! Unlike the library crates, experiments print, and write where they are told.

pub mod added;
pub mod consistent;
pub mod conventions;
pub mod coverage;
pub mod environment;
pub mod fleet;
pub mod noise;
pub mod oracle;
pub mod paper;
pub mod plant;
pub mod retarget;
pub mod run;
pub mod synthetic_log;
pub mod undeclared;
