//! Robots that stand: where the two ZMPs differ, and which of them a force plate measures.

use crate::plants;

use phiw_dynamics::{BackendError, Placement, SimulationBackend, Tree, Vec3, World};
use phiw_plant::{ComputedTorque, Gains, Plant, PlantRun, PlantSetup, RigidBodyModel, Timing};
use phiw_sim_rapier::RapierBackend;
use phiw_zmp::{
    MotionBalance, Stance, SupportPolygon, ZmpModel, ZmpWorkspace, feet_from_toml, standing_parameters,
};
use plants::model;
use std::f64::consts::TAU;

/// The 18-joint upper body on a fixed base, and the parameters of all that stands.
fn upper_body() -> (Tree, Vec<f64>) {
    let (tree, floating) = (model("upper_body18", false), model("upper_body18", true));
    let parameters = standing_parameters(&floating.bodies()[0].inertial, &tree.inertial_parameters());
    (tree, parameters)
}

/// The support file of a model, for its tree with a floating base.
fn feet(name: &str, tree: &Tree) -> Vec<phiw_dynamics::Foot> {
    let path = format!("{}/../../models/{name}.support.toml", env!("CARGO_MANIFEST_DIR"));
    feet_from_toml(&std::fs::read_to_string(&path).expect(&path), tree).unwrap()
}

/// What a model stands on when its base is upright at the origin and `raised` above the floor.
fn support(name: &str, raised: f64) -> SupportPolygon {
    let tree = model(name, true);
    let mut placements = vec![Placement::identity(); tree.bodies().len()];
    tree.forward_kinematics(&tree.neutral_configuration(), &mut placements).unwrap();
    SupportPolygon::from_feet(&feet(name, &tree), &placements, -raised, 1e-3).unwrap()
}

/// The upper body on its bounds, as the paper has it.
fn stance() -> Stance {
    let region = support("upper_body18", 0.0).bounds().polygon().unwrap();
    Stance::new(region, [0.0, 0.0], 0.0).unwrap()
}

/// Angle, speed and acceleration of a swing that fades in from rest, at a time after its start.
fn swing(amplitude: f64, frequency: f64, t: f64) -> [f64; 3] {
    let (rate, fade) = (TAU * frequency, 1.0);
    let (sine, cosine) = (rate * t).sin_cos();
    // 3x² − 2x³ over the first second.
    let x = (t / fade).clamp(0.0, 1.0);
    let [w, dw, ddw] =
        [x * x * (3.0 - 2.0 * x), 6.0 * x * (1.0 - x) / fade, (6.0 - 12.0 * x) / (fade * fade)];
    let ddw = if t < fade { ddw } else { 0.0 };
    let [s, ds, dds] = [sine, rate * cosine, -rate * rate * sine].map(|s| amplitude * s);
    [w * s, dw * s + w * ds, ddw * s + 2.0 * dw * ds + w * dds]
}

/// Joints that swing, each with its share of the amplitude.
type Swinging = &'static [(&'static str, f64)];
const ARMS_TOGETHER: Swinging = &[("left_shoulder_pitch", 1.0), ("right_shoulder_pitch", 1.0)];
const ARMS_APART: Swinging = &[("left_shoulder_pitch", 1.0), ("right_shoulder_pitch", -1.0)];
const BOW: Swinging = &[("waist_lower", 1.0)];

/// `[q, v, a]` of all joints at a time after the swing's start.
fn swing_of(tree: &Tree, joints: Swinging, amplitude: f64, frequency: f64, t: f64) -> [Vec<f64>; 3] {
    let mut motion = [0, 1, 2].map(|_| vec![0.0; tree.joint_count()]);
    for (joint, share) in joints {
        let joint = tree.joint_index(joint).unwrap();
        for (values, value) in motion.iter_mut().zip(swing(amplitude, frequency, t)) {
            values[joint] = share * value;
        }
    }
    motion
}

/// The balance of five seconds of it.
fn swung(joints: Swinging, amplitude: f64, frequency: f64) -> MotionBalance {
    let (tree, parameters) = upper_body();
    let samples: Vec<[Vec<f64>; 3]> =
        (0..500).map(|k| swing_of(&tree, joints, amplitude, frequency, 0.01 * f64::from(k))).collect();
    let motion = samples.iter().map(|sample| [0, 1, 2].map(|part| &sample[part][..]));
    MotionBalance::of_motion(&tree, &parameters, &stance(), motion, &mut ZmpWorkspace::new(&tree)).unwrap()
}

/// The README's numbers, of the 18-joint upper body.
#[test]
fn the_two_zmps_part_when_bodies_turn_fast() {
    let motions = [
        ("arms swing together, 0.4 rad at 0.2 Hz", swung(ARMS_TOGETHER, 0.4, 0.2)),
        ("arms swing together, 0.4 rad at 1.2 Hz", swung(ARMS_TOGETHER, 0.4, 1.2)),
        ("arms swing apart, 0.4 rad at 1.2 Hz", swung(ARMS_APART, 0.4, 1.2)),
        ("bows, 0.1 rad at 0.6 Hz", swung(BOW, 0.1, 0.6)),
    ];
    for (name, balance) in &motions {
        println!(
            "{name}: apart by {:.1} mm at most; worst margin {:.1} mm by (8), {:.1} mm with angular momentum",
            1e3 * balance.largest_difference,
            1e3 * balance.point_mass.margin,
            1e3 * balance.multi_body.margin
        );
        // The worst of each is what its margin says.
        assert_eq!(balance.samples, 500);
        for model in [ZmpModel::PointMass, ZmpModel::MultiBody] {
            let worst = balance.of(model);
            assert_eq!(stance().support().signed_margin(worst.zmp.unwrap()), worst.margin);
            assert!(worst.is_allowed(worst.largest_reduction - 1e-9));
            assert!(!worst.is_allowed(worst.largest_reduction + 1e-9));
        }
    }
    let [slow, fast, apart, bow] = motions.map(|(_, balance)| balance);
    assert!(slow.largest_difference < 2e-3, "a slow motion hardly turns anything");
    assert!(fast.largest_difference > 8e-3);
    assert!(apart.largest_difference < 0.2 * fast.largest_difference, "they turn against each other");
    // The point mass errs on either side.
    assert!(fast.multi_body.margin > fast.point_mass.margin + 5e-3);
    assert!(bow.multi_body.margin < bow.point_mass.margin - 5e-3);
}

#[test]
fn a_jump_is_never_allowed() {
    let (tree, parameters) = upper_body();
    let still = [0.0; 18];
    let mut duck = still;
    // The waist bends so fast that the trunk pulls the base up.
    (duck[0], duck[1]) = (400.0, -400.0);
    let bent: Vec<f64> = [1.2, 0.4].into_iter().chain([0.0; 16]).collect();
    let motion = [[&still[..], &still, &still], [&bent, &still, &duck]];
    let mut workspace = ZmpWorkspace::new(&tree);
    let last = workspace.evaluate(&tree, &parameters, motion[1][0], motion[1][1], motion[1][2]).unwrap();
    assert!(last.wrench[2] < 0.0, "{last:?}");
    let balance = MotionBalance::of_motion(&tree, &parameters, &stance(), motion, &mut workspace).unwrap();
    for worst in [balance.point_mass, balance.multi_body] {
        assert_eq!((worst.margin, worst.sample, worst.zmp), (f64::NEG_INFINITY, 1, None));
        assert!(!worst.is_allowed(0.0));
    }
    let nothing = MotionBalance::of_motion(&tree, &parameters, &stance(), [], &mut workspace).unwrap();
    assert_eq!(nothing, MotionBalance::NONE);
}

/// A humanoid on two feet: the hull spans both, and its ZMP at rest is inside.
#[test]
fn a_humanoid_stands_between_its_feet() {
    let tree = model("humanoid30", true);
    let mut placements = vec![Placement::identity(); tree.bodies().len()];
    let mut q = tree.neutral_configuration();
    tree.forward_kinematics(&q, &mut placements).unwrap();
    let feet = feet("humanoid30", &tree);
    // Stand it on the floor.
    q[2] = -placements[feet[0].body].point(Vec3(feet[0].sole[0])).0[2];
    tree.forward_kinematics(&q, &mut placements).unwrap();
    let polygon = SupportPolygon::from_feet(&feet, &placements, 0.0, 1e-3).unwrap();
    assert_eq!(polygon.corners().len(), 4);
    let still = vec![0.0; tree.velocity_size()];
    let balance =
        ZmpWorkspace::new(&tree).evaluate(&tree, &tree.inertial_parameters(), &q, &still, &still).unwrap();
    let zmp = balance.zmp(ZmpModel::MultiBody, 0.0).unwrap();
    assert!(polygon.signed_margin(zmp) > 0.02, "{zmp:?} in {polygon:?}");
    assert!(zmp[1].abs() < 0.01, "between the feet: {zmp:?}");
}

fn rapier(tree: &Tree, world: &World) -> Result<Box<dyn SimulationBackend>, BackendError> {
    Ok(Box::new(RapierBackend::new(tree, world)?.with_solver_iterations(4)?))
}

/// The upper body on its sole in a physics engine, while its arms swing.
fn simulated_swing(amplitude: f64, frequency: f64, duration_s: f64) -> PlantRun {
    let tree = model("upper_body18", true);
    let of_effort = |share: f64| -> Vec<f64> {
        (0..tree.joint_count()).map(|joint| share * tree.joint(joint).limits.effort).collect()
    };
    let world =
        World { feet: feet("upper_body18", &tree), rotor_inertia: of_effort(1e-3), ..World::default() };
    let gains = Gains { position: of_effort(6.0), velocity: of_effort(0.25) };
    let controller = ComputedTorque::new(RigidBodyModel::new(tree.clone(), vec![]).unwrap(), gains);
    let timing = Timing { control_period_s: 0.002, longest_step_s: 1e-3, settle_s: 0.5 };
    let setup = PlantSetup { timing, ..PlantSetup::new(controller) };
    let fixed = model("upper_body18", false);
    let reference = move |t_s: f64, q: &mut [f64], v: &mut [f64], a: &mut [f64]| {
        let motion = swing_of(&fixed, ARMS_TOGETHER, amplitude, frequency, t_s.max(0.0));
        [q, v, a].into_iter().zip(motion).for_each(|(to, from)| to.copy_from_slice(&from));
    };
    let mut random = <rand_chacha::ChaCha8Rng as rand::SeedableRng>::seed_from_u64(1);
    Plant::new(&tree, &world, setup, rapier).unwrap().run(&reference, duration_s, &mut random).unwrap()
}

/// The force plate of a simulated floor sees the ZMP with angular momentum, computed here from the joints'
/// motion alone; the point mass's is somewhere else.
#[test]
fn a_force_plate_measures_the_multi_body_zmp() {
    let run = simulated_swing(0.4, 1.0, 3.0);
    assert_eq!(run.fell_at_s, None);
    let (tree, parameters) = upper_body();
    let history = &run.history;
    let row = |values: &[f64], t_s: f64| {
        let row = ((t_s - history.start_s) / history.step_s).round() as usize;
        values[row * 18..][..18].to_vec()
    };
    let mut workspace = ZmpWorkspace::new(&tree);
    let mut squares = [0.0; 2];
    let (mut count, mut range) = (0, [f64::INFINITY, f64::NEG_INFINITY]);
    for (sample, reaction) in run.reactions.iter().enumerate().skip(50).take(200) {
        // A measured force is a mean over 10 ms around its stamp.
        let t_s = 0.01 * sample as f64;
        let (q, v) = (row(&history.link_angle, t_s), row(&history.link_speed, t_s));
        let (after, before) = (row(&history.link_speed, t_s + 0.005), row(&history.link_speed, t_s - 0.005));
        let a: Vec<f64> = after.iter().zip(&before).map(|(after, before)| (after - before) / 0.01).collect();
        let balance = workspace.evaluate(&tree, &parameters, &q, &v, &a).unwrap();
        let measured = reaction.zmp.unwrap();
        for (sum, model) in squares.iter_mut().zip([ZmpModel::MultiBody, ZmpModel::PointMass]) {
            let zmp = balance.zmp(model, 0.0).unwrap();
            *sum += (zmp[0] - measured[0]).powi(2) + (zmp[1] - measured[1]).powi(2);
        }
        count += 1;
        range = [range[0].min(measured[0]), range[1].max(measured[0])];
    }
    let [bodies, point] = squares.map(|sum: f64| (sum / f64::from(count)).sqrt());
    println!(
        "measured ZMP moves by {:.1} mm; with angular momentum {:.2} mm rms off, as a point mass {:.2} mm",
        1e3 * (range[1] - range[0]),
        1e3 * bodies,
        1e3 * point
    );
    assert!(range[1] - range[0] > 0.03, "{range:?}");
    assert!(bodies < 2e-3, "{bodies} m");
    assert!(point > 2.5 * bodies, "{point} m by a point mass, {bodies} m by bodies");
}
