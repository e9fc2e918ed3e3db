//! `cargo xtask consistent`: what it costs that identified bodies can exist, on every real log at hand.
//!
//! # What it asks
//!
//! How much larger the error on motion held out is over possible bodies and dissipative friction than by
//! least squares, how many of the least-squares bodies are impossible, and how long one fit takes.
//!
//! # How it is run
//!
//! `cargo xtask consistent`. It reads the logs in `../shared/data/logs` and skips those that are absent.
//!
//! # What it prints
//!
//! The tables of `docs/results/consistent.md`: one line for each robot, once with the declared effects of a
//! textbook and once with more; then the joints whose error grows by more than 2 %.
//!
//! # Where results go
//!
//! Nowhere but to standard output.

pub(crate) mod robots;

use crate::environment;
use anyhow::Context;
use phiw::arguments::SessionArguments;
use phiw::session::Session;
use phiw_dynamics::inertia::PARAMETERS_PER_BODY;
use phiw_identification::consistent::{Consistent, ConsistentSettings, consistent, impossible_bodies};
use phiw_identification::{Identified, Model, identify};
use robots::{Robot, robots};
use std::time::Instant;

/// Relative growth of an error that is told joint by joint.
const TOLD: f64 = 0.02;
/// Fits that the median time is of.
const TIMED: usize = 9;

/// Command line of `cargo xtask consistent`.
#[derive(clap::Args)]
pub struct Arguments {
    /// Effects that are declared, instead of the two sets of the documentation.
    #[arg(long, value_delimiter = ',')]
    declare: Vec<String>,
}

/// The effects of a textbook, and those with what hobby servos, gears and drives have beside.
const DECLARED: [&[&str]; 2] = [
    &["viscous_friction", "coulomb_friction", "rotor_inertia"],
    &["viscous_friction", "coulomb_friction", "rotor_inertia", "torque_offset"],
];

/// Prints the tables.
///
/// # Errors
/// A log cannot be read or does not fit its robot.
pub fn command(arguments: &Arguments) -> anyhow::Result<()> {
    let logs = environment::workspace_root()?.join("../shared/data/logs");
    let own: Vec<&str> = arguments.declare.iter().map(String::as_str).collect();
    let sets: Vec<&[&str]> = if own.is_empty() { DECLARED.to_vec() } else { vec![&own] };
    for declared in sets {
        println!("Declared: {}\n", declared.join(", "));
        println!(
            "| robot | bodies | impossible by least squares | held out, least squares | held out, possible bodies | change | prior's weight | gap | steps | ms |"
        );
        println!("|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|");
        let mut told = Vec::new();
        for robot in robots(&logs)? {
            told.extend(line(&robot, declared).with_context(|| robot.name.to_owned())?);
        }
        println!();
        told.iter().for_each(|line| println!("{line}"));
        println!();
    }
    Ok(())
}

/// Prints a robot's line; what is to be said of its joints.
fn line(robot: &Robot, declared: &[&str]) -> anyhow::Result<Vec<String>> {
    let arguments = SessionArguments {
        urdf: robot.urdf.clone(),
        train: robot.train.clone(),
        validate: robot.validate.clone(),
        declare: declared.iter().map(|kind| (*kind).to_owned()).collect(),
        ..SessionArguments::default()
    };
    let silent = |_: &str, _: u64, _: u64| ();
    let session = Session::open(&arguments, &silent)?;
    let sources = session.logs.sources(&silent);
    let identified =
        identify(&session.tree, session.effects(&session.data(&sources))?, &session.data(&sources))?;
    let Identified { design, fit, .. } = &identified;
    let model = Model::of_fit(design, fit, &session.declared, &[], (0.0, 0.0))?;
    let standard: Vec<f64> = model.bodies.iter().flat_map(|body| body.inertial).collect();
    let found = fitted(&identified, &ConsistentSettings::default())?;
    let (free, possible) = (&identified.held_out, &found.held_out);
    println!(
        "| {} | {} | {} | {:.2} % | {:.2} % | {:+.1} % | {} | {:.0e} | {} | {:.1} |",
        robot.name,
        standard.len() / PARAMETERS_PER_BODY,
        impossible_bodies(&standard).len(),
        100.0 * free.relative,
        100.0 * possible.relative,
        100.0 * (possible.relative / free.relative - 1.0),
        found.weight,
        found.gap,
        found.iterations,
        1e3 * seconds_of_one_fit(&identified, &found)?
    );
    let joints = session.tree.joint_names().zip(free.rmse.iter().zip(&possible.rmse));
    Ok(joints
        .filter(|(_, (free, possible))| **possible > (1.0 + TOLD) * **free)
        .map(|(joint, (free, possible))| {
            let change = 100.0 * (possible / free - 1.0);
            format!("- {} {joint}: {free:.4} → {possible:.4} ({change:+.1} %)", robot.name)
        })
        .collect())
}

fn fitted(identified: &Identified, settings: &ConsistentSettings) -> anyhow::Result<Consistent> {
    let Identified { design, fit, train_folds, held_out_folds, .. } = identified;
    Ok(consistent(design, fit, train_folds, held_out_folds, settings)?)
}

/// Median time of a fit at the weight that was found.
fn seconds_of_one_fit(identified: &Identified, found: &Consistent) -> anyhow::Result<f64> {
    let settings = ConsistentSettings { weights: vec![found.weight], ..ConsistentSettings::default() };
    let mut times = Vec::with_capacity(TIMED);
    for _ in 0..TIMED {
        let begin = Instant::now();
        fitted(identified, &settings)?;
        times.push(begin.elapsed().as_secs_f64());
    }
    times.sort_by(f64::total_cmp);
    Ok(times[TIMED / 2])
}
