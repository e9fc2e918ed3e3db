//! A robot that stands on the floor: contact forces, and falling over.

use crate::setup;

use phiw_dynamics::urdf::{UrdfOptions, read_urdf};
use phiw_dynamics::{AnalyticBackend, DynamicsBackend, SimulationBackend, Tree, World};
use phiw_sim_mujoco::Integrator;
use setup::{assert_close, mujoco, square_foot, state_of};

const GRAVITY: f64 = 9.81;
const DT: f64 = 1e-3;

/// A box of 8 kg whose floor is the frame's origin, and on it an arm of 2 kg that leans to the front.
fn robot() -> Tree {
    let urdf = r#"<robot name="leaning">
      <link name="box"><inertial><origin xyz="0 0 0.2"/><mass value="8"/>
        <inertia ixx="0.2" iyy="0.2" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>
      <link name="arm"><inertial><origin xyz="0 0 0.3"/><mass value="2"/>
        <inertia ixx="0.05" iyy="0.05" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
      <joint name="shoulder" type="continuous"><parent link="box"/><child link="arm"/><origin xyz="0 0 0.4"/>
        <axis xyz="0 1 0"/><limit effort="100" velocity="10"/></joint></robot>"#;
    read_urdf(urdf, &UrdfOptions { floating_base: true, ..UrdfOptions::default() }).unwrap().tree
}

fn floor(floor_friction: f64) -> World {
    World { feet: vec![square_foot(0.1, [0.0; 3])], floor_friction, ..World::default() }
}

/// Where the wrench has no horizontal moment.
fn zero_moment_point([_, _, force, x, y, _]: [f64; 6]) -> [f64; 2] {
    [-y / force, x / force]
}

#[test]
fn the_ground_carries_the_weight_below_the_center_of_mass() {
    for integrator in [Integrator::RungeKutta4, Integrator::Implicit] {
        let tree = robot();
        let Some(backend) = mujoco(&tree, &floor(0.8)) else { return };
        let mut backend = backend.with_integrator(integrator);
        let lean = 0.4_f64;
        let mut q = tree.neutral_configuration();
        q[7] = lean;
        backend.set_state(&q, &[0.0; 7]).unwrap();
        // What the arm needs at rest.
        let holding = -2.0 * GRAVITY * 0.3 * lean.sin();
        for _ in 0..2000 {
            let (q, v) = state_of(&backend);
            backend.step(&[holding - 200.0 * (q[7] - lean) - 20.0 * v[6]], DT).unwrap();
        }
        let (rest, v) = state_of(&backend);
        assert!(v.iter().all(|x| x.abs() < 1e-6), "it does not stand still: {v:?}");
        assert!((0..3).all(|axis| rest[axis].abs() < 1e-4), "it has moved: {:?}", &rest[..3]);
        let wrench = backend.base_wrench();
        assert_close(&wrench[..3], &[0.0, 0.0, 10.0 * GRAVITY], 1e-6);
        let center = 0.2 * 0.3 * lean.sin();
        assert_close(&zero_moment_point(wrench), &[center, 0.0], 1e-3);
    }
}

/// The contact forces are what the motion that they cause needs: over each step, the ZMP of their mean is
/// that of the motion seen, whose dynamics are phiw's own.
#[test]
fn the_measured_zmp_is_the_momentums() {
    let tree = robot();
    let Some(mut backend) = mujoco(&tree, &floor(0.8)) else { return };
    let mut analytic = AnalyticBackend::new(tree.clone());
    backend.set_state(&tree.neutral_configuration(), &[0.0; 7]).unwrap();
    let dt = 1e-4;
    let mut previous: Option<(Vec<f64>, Vec<f64>, [f64; 6])> = None;
    let (mut farthest, mut largest) = (0.0_f64, 0.0_f64);
    for step in 0..20_000 {
        let (q, v) = state_of(&backend);
        let target = 0.5 * (3.0 * step as f64 * dt).sin();
        backend.step(&[300.0 * (target - q[7]) - 30.0 * v[6]], dt).unwrap();
        let wrench = backend.base_wrench();
        // The first instants are those of the landing.
        if let (true, Some((q0, v0, wrench0))) = (step > 500, previous) {
            let acceleration: Vec<f64> = v.iter().zip(&v0).map(|(x, y)| (x - y) / dt).collect();
            let [q, v] = [(&q, &q0), (&v, &v0)].map(|(x, y)| mean(x, y));
            analytic.inverse_dynamics(&q, &v, &acceleration, &mut [0.0; 7]).unwrap();
            let expected = zero_moment_point(analytic.base_wrench());
            let found = zero_moment_point(mean(&wrench, &wrench0).try_into().unwrap());
            largest = largest.max((found[0] - expected[0]).hypot(found[1] - expected[1]));
            farthest = farthest.max(found[0].abs());
        }
        previous = Some((q, v, wrench));
    }
    println!("ZMPs up to {farthest} m, that differ by {largest} m");
    assert!(farthest > 0.02, "nothing was tested: the ZMP stays within {farthest} m");
    assert!(largest < 1e-4, "ZMPs differ by {largest} m");
}

fn mean(x: &[f64], y: &[f64]) -> Vec<f64> {
    x.iter().zip(y).map(|(x, y)| 0.5 * (x + y)).collect()
}

/// How far the base has turned after a second in which the arm is swung to the front.
fn tilt_after_swinging_by(angle: f64, seconds: f64) -> Option<f64> {
    let tree = robot();
    let mut backend = mujoco(&tree, &floor(0.8))?;
    backend.set_state(&tree.neutral_configuration(), &[0.0; 7]).unwrap();
    for step in 0..1000 {
        let (q, v) = state_of(&backend);
        let target = angle * (step as f64 * DT / seconds).min(1.0);
        backend.step(&[400.0 * (target - q[7]) - 20.0 * v[6]], DT).unwrap();
    }
    let (q, _) = state_of(&backend);
    Some(2.0 * q[3].hypot(q[4]).atan2(q[5].hypot(q[6])))
}

#[test]
fn a_motion_whose_zmp_leaves_the_foot_topples_the_robot() {
    let (Some(slow), Some(fast)) = (tilt_after_swinging_by(0.8, 0.9), tilt_after_swinging_by(1.6, 0.1))
    else {
        return;
    };
    assert!(slow < 0.01, "a slow motion tilts it by {slow} rad");
    assert!(fast > 0.2, "a fast motion tilts it by {fast} rad only");
}

/// On a floor that leans by a quarter, friction of 0.8 holds and 0 does not.
#[test]
fn friction_holds_on_a_slope_up_to_its_coefficient() {
    for (friction, slides) in [(0.8, false), (0.3, false), (0.2, true), (0.0, true)] {
        let mut tree = robot();
        let slope = 0.25_f64.atan();
        tree.gravity = [-GRAVITY * slope.sin(), 0.0, -GRAVITY * slope.cos()];
        let mut world = floor(friction);
        world.feet = vec![square_foot(0.3, [0.0; 3])];
        let Some(mut backend) = mujoco(&tree, &world) else { return };
        backend.set_state(&tree.neutral_configuration(), &[0.0; 7]).unwrap();
        for _ in 0..1000 {
            let (q, v) = state_of(&backend);
            backend.step(&[-400.0 * q[7] - 20.0 * v[6]], DT).unwrap();
        }
        let way = -state_of(&backend).0[0];
        let expected = if slides { 0.5 * GRAVITY * (slope.sin() - friction * slope.cos()) } else { 0.0 };
        assert!(
            (way - expected).abs() < 0.02 * expected + 1e-3,
            "friction {friction}: {way} m, not {expected} m"
        );
    }
}

/// A foot that leaves the floor is not held back, and what flies has no wrench.
#[test]
fn the_floor_does_not_pull() {
    let tree = robot();
    let Some(mut backend) = mujoco(&tree, &floor(0.8)) else { return };
    let mut q = tree.neutral_configuration();
    q[2] = 1e-3;
    backend.set_state(&q, &[0.0, 0.0, 3.0, 0.0, 0.0, 0.0, 0.0]).unwrap();
    (0..300).for_each(|_| backend.step(&[0.0], DT).unwrap());
    assert_eq!(backend.base_wrench(), [0.0; 6]);
    let height = state_of(&backend).0[2];
    assert!((height - (1e-3 + 3.0 * 0.3 - 0.5 * GRAVITY * 0.09)).abs() < 1e-6, "{height} m");
}
