//! The files of an identified robot: what MuJoCo, Pinocchio and Rapier make of them.

use super::driven;
use super::generated::{self, Run};
use super::python::Python;
use crate::consistent::robots::{Robot, robots};
use anyhow::{Context, ensure};
use nalgebra::DMatrix;
use phiw::arguments::{ExportArguments, SessionArguments};
use phiw::console::Console;
use phiw::export::export;
use phiw::identify::identify;
use phiw_dynamics::random_tree::{RandomNumbers, random_state};
use phiw_dynamics::urdf::{UrdfOptions, read_urdf};
use phiw_dynamics::{AnalyticBackend, DynamicsBackend, Tree, Workspace, World};
use phiw_effects::Catalogue;
use phiw_identification::effect::JointProperty;
use phiw_identification::reproduction::{Plant, ReproductionSettings, Window, reproduce};
use phiw_identification::{Design, EffectCatalogue, Model, predict};
use phiw_sim_rapier::RapierBackend;
use phiw_telemetry::Block;
use serde::{Deserialize, Serialize};
use std::path::Path;
use std::time::Instant;

/// What runs in Python.
const SCRIPT: &str = include_str!("export_oracle.py");
/// The packages, pinned.
const PINNED: &str = "mujoco==3.17.0\npin==4.1.0\n";
/// The newest MuJoCo that PyPI has.
const LATEST: &str = "mujoco\n";
/// The largest difference of a torque, over the largest torque of its joint, that is rounding.
const TOLERANCE: f64 = 1e-9;
/// The same of generated code.
const CODE_TOLERANCE: f64 = 1e-12;
/// The largest error of a motion without friction, over its travel.
const MOTION_TOLERANCE: f64 = 1e-3;
/// Time between two rows of a motion \[s\], and its length \[s\].
const PERIOD: f64 = 1e-3;
const STROKE_S: f64 = 0.5;
/// Times that all states are gone through, for the time of a call.
const ROUNDS: usize = 500;
/// States whose torques are compared.
const STATES: usize = 200;
/// Poses whose mass matrix is looked at.
const POSES: usize = 10_000;
/// Slowest speed of a state \[rad/s, m/s\]: beyond it a sign of at most 0.064 rad/s (m/s) has turned to the
/// last digit, and programs that smooth theirs in another way agree.
const SLOWEST: f64 = 1.4;
const FASTEST: f64 = 3.0;
/// What is declared: all of it can be expressed in MJCF.
const DECLARED: [&str; 4] = ["viscous_friction", "coulomb_friction", "rotor_inertia", "torque_offset"];

#[derive(Serialize)]
struct Request<'a> {
    joints: Vec<&'a str>,
}

/// What a program says of a file.
#[derive(Deserialize)]
struct Answer {
    reader: String,
    #[serde(default)]
    refused: Option<String>,
    #[serde(default)]
    torque: Vec<f64>,
    #[serde(default)]
    least: f64,
    #[serde(default)]
    motion: Option<Motion>,
    /// The same motion with no dry friction in the file.
    #[serde(default)]
    without_friction: Option<Motion>,
}

/// A motion that MuJoCo has made of the file, a row each [`PERIOD`].
#[derive(Deserialize)]
struct Motion {
    q: Vec<f64>,
    v: Vec<f64>,
    torque: Vec<f64>,
}

/// Motions: slices over the states, one row each.
struct Motions {
    q: Vec<f64>,
    v: Vec<f64>,
    a: Vec<f64>,
    poses: Vec<f64>,
}

/// An identified robot.
pub(super) struct Identified {
    /// With its possible bodies.
    pub(super) tree: Tree,
    pub(super) model: Model,
    /// `identified.urdf`.
    urdf: String,
}

/// Prints the table; whether every file is read, every body possible, every mass matrix positive definite,
/// and every torque ours.
///
/// # Errors
/// A log cannot be read, or a package not installed.
pub fn compare(python: &str, workspace: &Path, seed: u64) -> anyhow::Result<bool> {
    let mut pythons = vec![Python::install(python, "oracle-export", PINNED)?];
    match Python::install(python, "oracle-mujoco-latest", LATEST) {
        Ok(latest) => pythons.push(latest),
        Err(error) => println!("skipped: the newest MuJoCo: {error:#}"),
    }
    println!("Identified with {}; {STATES} states, {POSES} poses, seed {seed}\n", DECLARED.join(", "));
    println!(
        "| robot | possible bodies | program, file | largest difference of a torque | least eigenvalue of M(q) over the largest | motion, error over travel | the same without friction |\n|---|--:|---|--:|--:|--:|--:|"
    );
    let (mut agrees, mut times) = (true, Vec::new());
    for robot in robots(&workspace.join("../shared/data/logs"))? {
        agrees &= robot_agrees(&robot, &pythons, seed, &mut times).with_context(|| robot.name.to_owned())?;
    }
    println!(
        "\n| robot | joints | lines of C | C, largest difference | Rust, largest difference | ours, bodies alone, ns | C, ns | Rust, ns |\n|---|--:|--:|--:|--:|--:|--:|--:|"
    );
    times.iter().for_each(|line| println!("{line}"));
    agrees &= driven::compare(&pythons, seed)?;
    let verdict = if agrees { "All agree" } else { "NOT all agree" };
    println!("\n{verdict} to {TOLERANCE:.0e}; every M(q) must be positive definite, every body possible.");
    Ok(agrees)
}

fn robot_agrees(
    robot: &Robot,
    pythons: &[Python],
    seed: u64,
    times: &mut Vec<String>,
) -> anyhow::Result<bool> {
    let folder = tempfile::tempdir()?;
    let identified = identified(robot, &DECLARED, folder.path())?;
    let Identified { tree, urdf, .. } = &identified;
    let files = read_urdf(urdf, &UrdfOptions::default())?.tree;
    let impossible = phiw_mjcf::impossible_bodies(&files).len();
    let bodies = files.bodies().len();
    let motions = motions(tree, seed);
    let joints = tree.joint_count();
    // Other programs take a URDF's angles as they are written.
    let of_urdf = torques_of_urdf(&identified, &files, &motions)?;
    let of_model = torques_of_model(&identified, &motions)?;
    let mut answers = vec![in_rapier(&files, &motions)?];
    write_case(folder.path(), tree, &motions)?;
    for python in pythons {
        let text = python.run(SCRIPT, [folder.path()])?;
        answers.extend(serde_json::from_str::<Vec<Answer>>(&text)?);
    }
    let mut agrees = impossible == 0;
    agrees &= code_agrees(robot.name, folder.path(), tree, &of_model, &motions, times)?;
    for answer in answers {
        let name = format!("| {} | {} of {bodies} | {}", robot.name, bodies - impossible, answer.reader);
        if let Some(refused) = answer.refused {
            println!("{name} | refused: {refused} | | |");
            agrees = false;
            continue;
        }
        let ours = if answer.reader.ends_with("MJCF") { &of_model } else { &of_urdf };
        ensure!(answer.torque.len() == ours.len(), "{} answers with other torques", answer.reader);
        let difference = difference(ours, &answer.torque, joints);
        let error = |motion: Option<Motion>, friction| {
            motion.map(|motion| motion_error(&identified, motion, friction)).transpose()
        };
        let with_friction = error(answer.motion, true)?;
        let without = error(answer.without_friction, false)?;
        let told =
            |error: Option<f64>| error.map_or(String::new(), |error| format!("{:.3} %", 100.0 * error));
        let motions = format!("{} | {}", told(with_friction), told(without));
        println!("{name} | {difference:.1e} | {:.1e} | {motions} |", answer.least);
        agrees &= difference < TOLERANCE && answer.least > 0.0;
        agrees &= without.is_none_or(|error| error < MOTION_TOLERANCE);
    }
    Ok(agrees)
}

/// How far our own model goes another way than MuJoCo's, under the same torques from the same state: RMS over
/// the joints of the position's error after [`STROKE_S`], over their travel. With friction it is told, not
/// judged: MuJoCo's turns in a straight line, ours as a hyperbolic tangent, and nothing holds the two
/// together.
fn motion_error(identified: &Identified, motion: Motion, friction: bool) -> anyhow::Result<f64> {
    let Identified { tree, model, .. } = identified;
    let joints = tree.joint_count();
    let catalogue = Catalogue::default();
    let (design, mut parameters) = possible_design(identified)?;
    for (effect, spec) in model.effects.iter().map(|effect| &effect.spec).enumerate() {
        if !friction && catalogue.joint_property(spec) == Some(JointProperty::Friction) {
            parameters[design.effect_parameters(effect)].fill(0.0);
        }
    }
    let Motion { q, v, torque } = motion;
    let travel: Vec<f64> = (0..joints)
        .map(|joint| {
            let own = || q.iter().skip(joint).step_by(joints).copied();
            own().fold(f64::MIN, f64::max) - own().fold(f64::MAX, f64::min)
        })
        .collect();
    let window = Window { log: 0, start: 0.0, period: PERIOD, joints, q, qd: v, tau: torque };
    let settings = ReproductionSettings { window_s: STROKE_S, ..ReproductionSettings::default() };
    let plant =
        || Ok(Plant::new(Box::new(AnalyticBackend::new(tree.clone()))).with_effects(&design, &parameters)?);
    let growth = reproduce(&plant, &[window], &travel, None, &settings)?;
    growth.share_of_travel.last().copied().context("a horizon")
}

/// The model's design with the effects of its possible bodies.
pub(super) fn possible_design(identified: &Identified) -> anyhow::Result<(Design, Vec<f64>)> {
    let Identified { tree, model, .. } = identified;
    let (design, mut parameters) = model.design(tree, &Catalogue::default())?;
    for effect in 0..design.effects().len() {
        for (at, parameter) in design.effect_parameters(effect).enumerate() {
            parameters[parameter] = model.consistent_effect(effect, at).context("an effect of the model")?;
        }
    }
    Ok((design, parameters))
}

/// Notes how generated code compares; whether its torques are ours.
fn code_agrees(
    name: &str,
    folder: &Path,
    tree: &Tree,
    ours: &[f64],
    motions: &Motions,
    times: &mut Vec<String>,
) -> anyhow::Result<bool> {
    let joints = tree.joint_count();
    let lines = std::fs::read_to_string(folder.join("inverse_dynamics.c"))?.lines().count();
    let runs = [generated::in_c(folder)?, generated::in_rust(folder)?];
    let cell = |run: &Option<Run>| match run {
        Some(run) => {
            let difference = difference(ours, &run.torque, joints);
            (difference, format!("{difference:.1e}"), format!("{:.0}", run.nanoseconds))
        }
        None => (0.0, "no compiler".to_owned(), String::new()),
    };
    let [(c, of_c, time_of_c), (rust, of_rust, time_of_rust)] = runs.each_ref().map(cell);
    let own = nanoseconds(tree, motions)?;
    times.push(format!(
        "| {name} | {joints} | {lines} | {of_c} | {of_rust} | {own:.0} | {time_of_c} | {time_of_rust} |"
    ));
    Ok(c.max(rust) < CODE_TOLERANCE)
}

/// Time of one inverse dynamics of the bodies by our own algorithm \[ns\].
fn nanoseconds(tree: &Tree, motions: &Motions) -> anyhow::Result<f64> {
    let joints = tree.joint_count();
    let (mut workspace, mut torque) = (Workspace::new(tree), vec![0.0; joints]);
    let begin = Instant::now();
    for _ in 0..ROUNDS {
        for row in 0..STATES {
            let at = row * joints..(row + 1) * joints;
            let (q, v, a) = (&motions.q[at.clone()], &motions.v[at.clone()], &motions.a[at]);
            tree.inverse_dynamics(q, v, a, &mut workspace, &mut torque)?;
        }
    }
    Ok(begin.elapsed().as_secs_f64() * 1e9 / (ROUNDS * STATES) as f64)
}

/// Identifies the robot; its files go into `out` of the folder, and beside it as the script reads them.
pub(super) fn identified(robot: &Robot, declared: &[&str], folder: &Path) -> anyhow::Result<Identified> {
    let arguments = SessionArguments {
        urdf: robot.urdf.clone(),
        train: robot.train.clone(),
        validate: robot.validate.clone(),
        declare: declared.iter().map(|kind| (*kind).to_owned()).collect(),
        out: folder.join("out"),
        ..SessionArguments::default()
    };
    identify(&arguments, &Console::silent())?;
    let text = |name: &str| std::fs::read_to_string(folder.join("out").join(name));
    let model: Model = serde_json::from_str(&text("model.json")?)?;
    let described = std::fs::read_to_string(&robot.urdf)?;
    let options = UrdfOptions { snap: true, ..UrdfOptions::default() };
    let tree = model.consistent_tree(&read_urdf(&described, &options)?.tree)?;
    let (model_file, out) = (folder.join("out/model.json"), folder.to_owned());
    export(&ExportArguments { model: model_file, out, ..ExportArguments::default() })?;
    std::fs::copy(folder.join("out/identified.urdf"), folder.join("identified.urdf"))?;
    Ok(Identified { tree, model, urdf: text("identified.urdf")? })
}

fn write_case(folder: &Path, tree: &Tree, motions: &Motions) -> anyhow::Result<()> {
    let request = Request { joints: tree.joint_names().collect() };
    std::fs::write(folder.join("case.json"), serde_json::to_string(&request)?)?;
    let rows = motions.q.chunks(tree.joint_count()).zip(motions.v.chunks(tree.joint_count()));
    let rows = rows.zip(motions.a.chunks(tree.joint_count()));
    let states: Vec<f64> = rows.flat_map(|((q, v), a)| [q, v, a].concat()).collect();
    let signals = [
        ("states", &states),
        ("q", &motions.q),
        ("v", &motions.v),
        ("a", &motions.a),
        ("poses", &motions.poses),
    ];
    for (name, values) in signals {
        let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
        std::fs::write(folder.join(name), bytes)?;
    }
    Ok(())
}

/// States inside the joints' limits, all joints fast enough, and poses.
fn motions(tree: &Tree, seed: u64) -> Motions {
    let mut random = RandomNumbers::new(seed);
    let mut motions = Motions { q: Vec::new(), v: Vec::new(), a: Vec::new(), poses: Vec::new() };
    for _ in 0..STATES {
        let state = random_state(tree, &mut random);
        motions.q.extend(state.q);
        motions.a.extend(state.a);
        motions.v.extend((0..tree.joint_count()).map(|_| {
            let speed = random.uniform(SLOWEST, FASTEST);
            if random.chance(0.5) { speed } else { -speed }
        }));
    }
    (0..POSES).for_each(|_| motions.poses.extend(random_state(tree, &mut random).q));
    motions
}

/// Rigid body, damping and friction: what URDF can express.
fn torques_of_urdf(identified: &Identified, files: &Tree, motions: &Motions) -> anyhow::Result<Vec<f64>> {
    let Identified { tree, model, .. } = identified;
    let (joints, catalogue) = (tree.joint_count(), Catalogue::default());
    let mut damping = vec![0.0; joints];
    let mut friction = vec![0.0; joints];
    for (index, effect) in model.effects.iter().enumerate() {
        let joint = effect.spec.joints.first().and_then(|joint| tree.joint_index(joint));
        let value = model.consistent_effect(index, 0).unwrap_or_default();
        match (catalogue.joint_property(&effect.spec), joint) {
            (Some(JointProperty::Damping), Some(joint)) => damping[joint] = value,
            (Some(JointProperty::Friction), Some(joint)) => friction[joint] = value,
            _ => {}
        }
    }
    let mut backend = AnalyticBackend::new(files.clone());
    let mut torques = torques(&mut backend, motions)?;
    for (place, torque) in torques.iter_mut().enumerate() {
        let (joint, v) = (place % joints, motions.v[place]);
        *torque += damping[joint] * v + friction[joint] * v.signum();
    }
    Ok(torques)
}

/// All of the model: its possible bodies, and the columns of its effects. Bodies go round base parameters,
/// whose map leaves out what motion hardly tells.
fn torques_of_model(identified: &Identified, motions: &Motions) -> anyhow::Result<Vec<f64>> {
    let tree = &identified.tree;
    let (design, mut parameters) = possible_design(identified)?;
    parameters[..design.base().count()].fill(0.0);
    let joints = tree.joint_count();
    let bodies = torques(&mut AnalyticBackend::new(tree.clone()), motions)?;
    let mut torques = Vec::with_capacity(motions.q.len());
    let rows = motions.q.chunks(joints).zip(motions.v.chunks(joints)).zip(motions.a.chunks(joints));
    for ((q, v), a) in rows {
        let signals = [q, v, a].map(<[f64]>::to_vec);
        let block = Block::unfiltered(joints, vec![0.0], signals, vec![0.0; joints]);
        let mut keep = |prediction: &phiw_identification::Prediction<'_>| {
            torques.extend_from_slice(prediction.predicted);
        };
        predict(&design, &parameters, &[&vec![block]], &mut keep)?;
    }
    torques.iter_mut().zip(bodies).for_each(|(torque, bodies)| *torque += bodies);
    Ok(torques)
}

/// Rapier over the robot that the URDF describes; the engine has no friction of joints.
fn in_rapier(read: &Tree, motions: &Motions) -> anyhow::Result<Answer> {
    let joints = read.joint_count();
    let mut backend = RapierBackend::new(read, &World::default())?;
    let mut torque = torques(&mut backend, motions)?;
    for (place, torque) in torque.iter_mut().enumerate() {
        let (body, v) = (read.joint(place % joints), motions.v[place]);
        *torque += body.damping * v + body.friction * v.signum();
    }
    let mut least = f64::INFINITY;
    for pose in motions.poses.chunks(joints) {
        least = least.min(least_eigenvalue(&mut backend, pose)?);
    }
    Ok(Answer {
        reader: "Rapier, URDF".to_owned(),
        refused: None,
        torque,
        least,
        motion: None,
        without_friction: None,
    })
}

/// The least eigenvalue over the largest of the mass matrix, whose columns are what unit accelerations need.
fn least_eigenvalue(backend: &mut dyn DynamicsBackend, q: &[f64]) -> anyhow::Result<f64> {
    let joints = backend.velocity_size();
    let (rest, mut a) = (vec![0.0; joints], vec![0.0; joints]);
    let mut gravity = vec![0.0; joints];
    backend.inverse_dynamics(q, &rest, &rest, &mut gravity)?;
    let mut matrix = DMatrix::zeros(joints, joints);
    let mut column = vec![0.0; joints];
    for joint in 0..joints {
        a[joint] = 1.0;
        backend.inverse_dynamics(q, &rest, &a, &mut column)?;
        a[joint] = 0.0;
        (0..joints).for_each(|row| matrix[(row, joint)] = column[row] - gravity[row]);
    }
    let values = (0.5 * (&matrix + matrix.transpose())).symmetric_eigenvalues();
    Ok(values.min() / values.max())
}

fn torques(backend: &mut dyn DynamicsBackend, motions: &Motions) -> anyhow::Result<Vec<f64>> {
    let joints = backend.velocity_size();
    let mut torques = vec![0.0; motions.q.len()];
    for (place, torque) in torques.chunks_mut(joints).enumerate() {
        let at = place * joints..(place + 1) * joints;
        let (q, v, a) = (&motions.q[at.clone()], &motions.v[at.clone()], &motions.a[at]);
        backend.inverse_dynamics(q, v, a, torque)?;
    }
    Ok(torques)
}

/// The largest difference, over the largest torque of its joint.
fn difference(ours: &[f64], theirs: &[f64], joints: usize) -> f64 {
    let of_joint = |joint: usize| {
        let own = || (joint..ours.len()).step_by(joints);
        let largest = own().map(|at| ours[at].abs()).fold(f64::MIN_POSITIVE, f64::max);
        own().map(|at| (ours[at] - theirs[at]).abs()).fold(0.0, f64::max) / largest
    };
    (0..joints).map(of_joint).fold(0.0, f64::max)
}
