//! Plants for tests: models of this workspace over the analytic backend, tracked poorly.
#![allow(dead_code, reason = "each test file uses its own part")]

use phiw_dynamics::urdf::{UrdfOptions, read_urdf};
use phiw_dynamics::{AnalyticBackend, BackendError, SimulationBackend, Tree, Workspace, World};
use phiw_plant::{
    ComputedTorque, Gains, History, MultiSine, Plant, PlantEffect, PlantRun, PlantSetup, RigidBodyModel,
};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// A model of this workspace.
pub fn model(name: &str, floating_base: bool) -> Tree {
    let path = format!("{}/../../models/{name}.urdf", env!("CARGO_MANIFEST_DIR"));
    let xml = std::fs::read_to_string(&path).expect(&path);
    read_urdf(&xml, &UrdfOptions { floating_base, ..UrdfOptions::default() }).expect(&path).tree
}

/// The analytic backend, as a plant's builder.
pub fn analytic(tree: &Tree, world: &World) -> Result<Box<dyn SimulationBackend>, BackendError> {
    Ok(Box::new(AnalyticBackend::in_world(tree.clone(), world)?))
}

/// Rotors that turn with the joints: a tenth of the inertia that each joint feels at its middle.
pub fn rotors(tree: &Tree) -> World {
    let mut matrix = vec![0.0; tree.velocity_size() * tree.velocity_size()];
    let q = tree.neutral_configuration();
    tree.mass_matrix(&q, &mut Workspace::new(tree), &mut matrix).unwrap();
    let first = tree.velocity_size() - tree.joint_count();
    let rotor = |joint: usize| 0.1 * matrix[(first + joint) * (tree.velocity_size() + 1)] + 1e-3;
    World { rotor_inertia: (0..tree.joint_count()).map(rotor).collect(), ..World::default() }
}

/// A controller whose model has every mass a fifth too small, with small gains.
pub fn poor_controller(tree: &Tree, world: &World) -> ComputedTorque {
    let mut wrong = tree.clone();
    let parameters: Vec<f64> = tree.inertial_parameters().iter().map(|x| 0.8 * x).collect();
    wrong.set_inertial_parameters(&parameters).unwrap();
    let gains =
        Gains::critically_damped(tree, &world.rotor_inertia, &tree.neutral_configuration(), 6.0).unwrap();
    ComputedTorque::new(RigidBodyModel::new(wrong, Vec::new()).unwrap(), gains)
}

/// A setup with these effects and a poor controller.
pub fn setup(tree: &Tree, world: &World, effects: Vec<PlantEffect>) -> PlantSetup {
    PlantSetup { effects, ..PlantSetup::new(poor_controller(tree, world)) }
}

/// A random motion that leaves room for poor tracking.
pub fn motion(tree: &Tree, duration_s: f64, seed: u64) -> MultiSine {
    MultiSine::random(tree, duration_s, 1.0, [0.5, 0.5], &mut random(seed))
}

/// A seeded generator.
pub fn random(seed: u64) -> ChaCha8Rng {
    ChaCha8Rng::seed_from_u64(seed)
}

/// Six seconds of motion of a plant.
pub fn run(tree: &Tree, world: &World, setup: PlantSetup, seed: u64) -> PlantRun {
    let mut plant = Plant::new(tree, world, setup, analytic).unwrap();
    plant.run(&motion(tree, 6.0, seed), 6.0, &mut random(seed)).unwrap()
}

/// What is true of all joints over one integration step.
pub struct TrueStep {
    /// Time of its end since the motion's start \[s\].
    pub end_s: f64,
    /// Angles of the links in its middle.
    pub q: Vec<f64>,
    /// Speeds of the links at its end.
    pub v: Vec<f64>,
    /// Mean accelerations of the links.
    pub a: Vec<f64>,
    /// Torque of rigid bodies and rotors that the motion needs, from inverse dynamics in the step's middle.
    pub rigid: Vec<f64>,
}

/// The steps of a run's history, by `tree` and `world`: what is true, or what is declared.
pub fn true_steps(history: &History, tree: &Tree, world: &World) -> Vec<TrueStep> {
    let (joints, step) = (history.joints, history.step_s);
    let mut workspace = Workspace::new(tree);
    let row = |values: &[f64], row: usize| values[row * joints..][..joints].to_vec();
    (0..history.steps())
        .map(|k| {
            let (q0, v0) = (row(&history.link_angle, k), row(&history.link_speed, k));
            let (q1, v1) = (row(&history.link_angle, k + 1), row(&history.link_speed, k + 1));
            let mean =
                |x: &[f64], y: &[f64]| -> Vec<f64> { x.iter().zip(y).map(|(x, y)| 0.5 * (x + y)).collect() };
            let (q, middle) = (mean(&q0, &q1), mean(&v0, &v1));
            let a: Vec<f64> = v0.iter().zip(&v1).map(|(v0, v1)| (v1 - v0) / step).collect();
            let mut rigid = vec![0.0; joints];
            tree.inverse_dynamics(&q, &middle, &a, &mut workspace, &mut rigid).unwrap();
            for (joint, inertia) in world.rotor_inertia.iter().enumerate() {
                rigid[joint] += inertia * a[joint];
            }
            TrueStep { end_s: history.start_s + (k + 1) as f64 * step, q, v: v1, a, rigid }
        })
        .collect()
}

/// Root mean square.
pub fn rms(values: impl IntoIterator<Item = f64>) -> f64 {
    let (mut sum, mut count) = (0.0, 0);
    for value in values {
        sum += value * value;
        count += 1;
    }
    (sum / f64::from(count)).sqrt()
}
