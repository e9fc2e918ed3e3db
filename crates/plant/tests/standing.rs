//! Robots that stand on their feet in a physics engine, under the plant's controller.

use crate::plants;

use phiw_dynamics::{BackendError, SimulationBackend, Tree, World};
use phiw_plant::{ComputedTorque, Gains, Plant, PlantRun, PlantSetup, Reference, RigidBodyModel, Timing};
use phiw_sim_rapier::RapierBackend;
use phiw_zmp::feet_from_toml;
use plants::{model, random};

fn rapier(tree: &Tree, world: &World) -> Result<Box<dyn SimulationBackend>, BackendError> {
    Ok(Box::new(RapierBackend::new(tree, world)?.with_solver_iterations(4)?))
}

/// A model on its soles follows a reference for `duration_s`. The controller takes the base as held, so legs
/// must be stiff: all gains are those of position-controlled humanoids, in proportion to the joints' effort
/// limits.
fn stand(name: &str, reference: &dyn Reference, duration_s: f64) -> PlantRun {
    let tree = model(name, true);
    let path = format!("{}/../../models/{name}.support.toml", env!("CARGO_MANIFEST_DIR"));
    let feet = feet_from_toml(&std::fs::read_to_string(&path).expect(&path), &tree).unwrap();
    let of_effort = |share: f64| -> Vec<f64> {
        (0..tree.joint_count()).map(|joint| share * tree.joint(joint).limits.effort).collect()
    };
    let rotor_inertia = of_effort(1e-3);
    let world = World { feet, rotor_inertia, ..World::default() };
    let gains = Gains { position: of_effort(6.0), velocity: of_effort(0.25) };
    let controller = ComputedTorque::new(RigidBodyModel::new(tree.clone(), vec![]).unwrap(), gains);
    let timing = Timing { control_period_s: 0.002, longest_step_s: 1e-3, settle_s: 0.5 };
    let setup = PlantSetup { timing, ..PlantSetup::new(controller) };
    Plant::new(&tree, &world, setup, rapier).unwrap().run(reference, duration_s, &mut random(1)).unwrap()
}

/// All joints at 0 but one, which swings by a cosine's way to `reach` and back, `times` in a second.
fn swing(joint: usize, reach: f64, times: f64) -> impl Fn(f64, &mut [f64], &mut [f64], &mut [f64]) {
    move |t_s, q, v, a| {
        [&mut *q, &mut *v, &mut *a].into_iter().for_each(|values| values.fill(0.0));
        let rate = std::f64::consts::TAU * times;
        let (sine, cosine) = (rate * t_s).sin_cos();
        q[joint] = 0.5 * reach * (1.0 - cosine);
        v[joint] = 0.5 * reach * rate * sine;
        a[joint] = 0.5 * reach * rate * rate * cosine;
    }
}

#[test]
fn a_slow_motion_leaves_the_upper_body_standing_and_a_violent_one_topples_it() {
    let waist = 0;
    let slow = stand("upper_body18", &swing(waist, 0.15, 0.25), 4.0);
    assert_eq!(slow.fell_at_s, None);
    assert_eq!(slow.recording.len(), 401);
    let weight = model("upper_body18", true).mass() * 9.81;
    let inside = |run: &PlantRun| {
        run.reactions
            .iter()
            .filter(|reaction| {
                reaction.zmp.is_some_and(|[x, y]| (-0.15..=0.19).contains(&x) && y.abs() <= 0.18)
            })
            .count()
    };
    assert_eq!(inside(&slow), slow.recording.len(), "the ZMP of what stands is under its sole");
    let mean = slow.reactions.iter().map(|reaction| reaction.wrench[2]).sum::<f64>() / 401.0;
    assert!((mean / weight - 1.0).abs() < 0.01, "{mean} N carry {weight} N");
    let forward: Vec<f64> = slow.reactions.iter().filter_map(|reaction| Some(reaction.zmp?[0])).collect();
    // Leaning forward by 0.15 rad brings the centre of mass forward by some centimetres, and the ZMP with it.
    assert!(forward[200] - forward[0] > 0.02, "{} m, then {} m", forward[0], forward[200]);
    let violent = stand("upper_body18", &swing(waist, 0.9, 0.9), 4.0);
    let fell_at_s = violent.fell_at_s.expect("it must topple");
    assert!((violent.recording.len() as f64 * 0.01 - fell_at_s).abs() < 0.03, "the log ends with the fall");
}

#[test]
fn a_humanoid_on_two_feet_stands_and_moves_an_arm() {
    let tree = model("humanoid30", true);
    let shoulder = tree.joint_index("left_shoulder_pitch").unwrap();
    let run = stand("humanoid30", &swing(shoulder, -0.8, 0.4), 2.5);
    assert_eq!(run.fell_at_s, None);
    let weight = tree.mass() * 9.81;
    assert!(run.reactions.iter().all(|reaction| (reaction.wrench[2] / weight - 1.0).abs() < 0.3));
    assert!(run.tracking_error.iter().all(|&error| error < 0.1), "{:?}", run.tracking_error);
}
