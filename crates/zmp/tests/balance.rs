//! The balance against inverse dynamics, finite differences and closed forms.

use crate::robots;

use phiw_dynamics::inertia::Inertia;
use phiw_dynamics::urdf::{UrdfOptions, read_urdf};
use phiw_dynamics::{AnalyticBackend, DynamicsBackend, Placement, Spatial, Tree, Vec3};
use phiw_zmp::{Balance, ZmpModel, ZmpWorkspace, standing_parameters};
use proptest::prelude::*;
use robots::{Built, assert_close, robot, upper_body};

fn evaluate(tree: &Tree, parameters: &[f64], [q, v, a]: [&[f64]; 3]) -> Balance {
    ZmpWorkspace::new(tree).evaluate(tree, parameters, q, v, a).unwrap()
}

/// Mass, first moment, and linear and angular momentum about the world's origin, of bodies (and a base link
/// at rest) by Jacobians: nothing of the recursion that is tested.
fn momentum(tree: &Tree, parameters: &[f64], q: &[f64], v: &[f64]) -> (f64, [f64; 3], [f64; 6]) {
    let mut placements = vec![Placement::identity(); tree.bodies().len()];
    tree.forward_kinematics(q, &mut placements).unwrap();
    let inertia = |ten: &[f64]| Inertia::from_parameters(ten.try_into().unwrap());
    let (base, bodies) = parameters.split_at(if tree.is_floating() { 0 } else { 10 });
    let (mut mass, mut moment, mut total) = (0.0, Vec3::zero(), Spatial::zero());
    if !base.is_empty() {
        let base: Inertia<f64> = inertia(base);
        (mass, moment) = (base.mass, base.moment);
    }
    let mut jacobian = vec![0.0; 6 * v.len()];
    for (index, ten) in bodies.chunks_exact(10).enumerate() {
        let in_world = inertia(ten).moved(placements[index]);
        tree.point_jacobian(
            &placements,
            index,
            placements[index].inverse().point(Vec3::zero()),
            &mut jacobian,
        )
        .unwrap();
        let rate = |row: usize| jacobian[row * v.len()..][..v.len()].iter().zip(v).map(|(j, v)| j * v).sum();
        let velocity = Spatial { linear: Vec3([0, 1, 2].map(rate)), angular: Vec3([3, 4, 5].map(rate)) };
        total = total + in_world.times(velocity);
        mass += in_world.mass;
        moment += in_world.moment;
    }
    let ([px, py, pz], [lx, ly, lz]) = (total.linear.0, total.angular.0);
    (mass, moment.0, [px, py, pz, lx, ly, lz])
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(96))]

    /// The floor's wrench is the one of inverse dynamics, and the weight of the base link on top of it.
    #[test]
    fn wrench_is_that_of_inverse_dynamics(robot in robot()) {
        let Built { tree, state, parameters } = robot.build();
        let balance = evaluate(&tree, &parameters, [&state.q, &state.v, &state.a]);
        let mut backend = AnalyticBackend::new(tree.clone());
        let mut force = vec![0.0; tree.velocity_size()];
        backend.inverse_dynamics(&state.q, &state.v, &state.a, &mut force).unwrap();
        let mut expected = backend.base_wrench();
        if !tree.is_floating() {
            let [mass, x, y, _, ..] = parameters[..] else { panic!("ten parameters of the base link") };
            let weight = -tree.gravity[2];
            prop_assert_eq!(&tree.gravity[..2], &[0.0, 0.0]);
            expected[2] += mass * weight;
            expected[3] += y * weight;
            expected[4] -= x * weight;
        }
        assert_close(&balance.wrench, &expected, 1e-11);
    }

    /// Newton and Euler for the whole: what the floor and gravity give is the rate of the momentum, by
    /// central differences.
    #[test]
    fn floor_and_gravity_change_the_momentum(robot in robot()) {
        const STEP: f64 = 1e-5;
        let Built { tree, state, parameters } = robot.build();
        let balance = evaluate(&tree, &parameters, [&state.q, &state.v, &state.a]);
        // Two instants of a motion that has this velocity and acceleration in its middle: the configuration
        // moves by v·t ± a·t²/2, for which the mean velocity until then is taken.
        let at = |time: f64| {
            let velocity: Vec<f64> = state.v.iter().zip(&state.a).map(|(v, a)| v + a * time).collect();
            let mean: Vec<f64> = state.v.iter().zip(&state.a).map(|(v, a)| v + 0.5 * a * time).collect();
            let mut q = state.q.clone();
            tree.integrate(&state.q, &mean, time, &mut q).unwrap();
            momentum(&tree, &parameters, &q, &velocity)
        };
        let ((mass, after, after_p), (_, before, before_p)) = (at(STEP), at(-STEP));
        let (_, moment, p) = momentum(&tree, &parameters, &state.q, &state.v);
        let center = balance.center_of_mass;
        prop_assert!((center.mass - mass).abs() < 1e-12 * mass);
        assert_close(&center.position, &moment.map(|x| x / mass), 1e-12);
        let rate: Vec<f64> = after_p.iter().zip(before_p).map(|(after, before)| (after - before) / (2.0 * STEP)).collect();
        let weight = tree.gravity.map(|g| g * mass);
        let pull = Vec3(center.position).cross(Vec3(weight)).0;
        let gravity = [weight[0], weight[1], weight[2], pull[0], pull[1], pull[2]];
        let expected: Vec<f64> = rate.iter().zip(gravity).map(|(rate, gravity)| rate - gravity).collect();
        assert_close(&balance.wrench, &expected, 1e-6);
        // The centre of mass's acceleration is the second difference of its place, and the first of its
        // momentum.
        let second = [0, 1, 2].map(|i| (after[i] - 2.0 * moment[i] + before[i]) / (mass * STEP * STEP));
        assert_close(&center.acceleration, &second, 2e-3);
        assert_close(&center.acceleration, &[0, 1, 2].map(|i| rate[i] / mass), 1e-6);
        prop_assert!(p.iter().all(|x| x.is_finite()));
    }

    /// The two ZMPs differ by the rate of the angular momentum about the centre of mass, and by nothing else.
    #[test]
    fn the_two_differ_by_the_angular_momentum(robot in robot(), floor_height in -1.0..1.0) {
        let Built { tree, state, parameters } = robot.build();
        let balance = evaluate(&tree, &parameters, [&state.q, &state.v, &state.a]);
        let [point, bodies] = [ZmpModel::PointMass, ZmpModel::MultiBody].map(|model| balance.zmp(model, floor_height));
        let upward = balance.wrench[2];
        prop_assert_eq!(point.is_some(), upward > 0.0);
        prop_assert_eq!(bodies.is_some(), upward > 0.0);
        let (Some(point), Some(bodies)) = (point, bodies) else { return Ok(()) };
        let [x, y, _] = balance.angular_momentum_rate();
        let scale = point.iter().chain(&bodies).fold(1.0_f64, |scale, p| scale.max(p.abs()));
        for (found, expected) in [(bodies[0] - point[0], -y / upward), (bodies[1] - point[1], x / upward)] {
            prop_assert!((found - expected).abs() < 1e-10 * scale, "{} instead of {}", found, expected);
        }
    }

    /// A robot at rest has both ZMPs below its centre of mass, wherever the floor is.
    #[test]
    fn at_rest_both_are_below_the_center_of_mass(robot in robot(), floor_height in -1.0..1.0) {
        let Built { tree, state, parameters } = robot.build();
        let still = vec![0.0; tree.velocity_size()];
        let balance = evaluate(&tree, &parameters, [&state.q, &still, &still]);
        let [x, y, _] = balance.center_of_mass.position;
        assert_close(&balance.center_of_mass.acceleration, &[0.0; 3], 1e-12);
        for model in [ZmpModel::PointMass, ZmpModel::MultiBody] {
            assert_close(&balance.zmp(model, floor_height).unwrap(), &[x, y], 1e-11);
        }
    }
}

/// A rod on a hinge at the origin, under a base link without mass.
fn pendulum() -> Tree {
    let urdf = r#"
      <robot name="pendulum"><link name="base"/>
        <link name="rod"><inertial><origin xyz="0 0 0.8"/><mass value="5"/>
          <inertia ixx="0.4" iyy="0.3" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>
        <joint name="hinge" type="continuous"><parent link="base"/><child link="rod"/><axis xyz="0 1 0"/></joint>
      </robot>"#;
    read_urdf(urdf, &UrdfOptions::default()).unwrap().tree
}

#[test]
fn inverted_pendulum_has_its_closed_form() {
    let (tree, mass, length, about_center, g) = (pendulum(), 5.0, 0.8_f64, 0.3, 9.81);
    let parameters = standing_parameters(&[0.0; 10], &tree.inertial_parameters());
    for (angle, speed, acceleration) in [(0.0, 0.0, 2.0), (0.3, 1.0, -4.0), (-0.7, 2.0, 6.0)] {
        let (sine, cosine) = f64::sin_cos(angle);
        // The bob is at (l sin θ, l cos θ).
        let (x, z) = (length * sine, length * cosine);
        let (xdd, zdd) = (acceleration * z - speed * speed * x, -acceleration * x - speed * speed * z);
        let found = evaluate(&tree, &parameters, [&[angle], &[speed], &[acceleration]]);
        assert_close(&found.center_of_mass.position, &[x, 0.0, z], 1e-14);
        assert_close(&found.center_of_mass.acceleration, &[xdd, 0.0, zdd], 1e-13);
        for floor in [0.0, -0.4] {
            let point = x - (z - floor) * xdd / (zdd + g);
            // The rod's own turning adds I θ̈ about y.
            let bodies = point - about_center * acceleration / (mass * (zdd + g));
            assert_close(&found.zmp(ZmpModel::PointMass, floor).unwrap(), &[point, 0.0], 1e-13);
            assert_close(&found.zmp(ZmpModel::MultiBody, floor).unwrap(), &[bodies, 0.0], 1e-13);
        }
    }
}

/// A base link that does not move takes its share of the weight: torques never feel it, the ZMP does.
#[test]
fn a_heavy_base_draws_the_zmp_to_itself() {
    let (tree, mut parameters) = upper_body();
    let q: Vec<f64> = (0..18).map(|joint| if joint == 0 { 0.4 } else { 0.0 }).collect();
    let still = [0.0; 18];
    let zmp = |parameters: &[f64]| {
        evaluate(&tree, parameters, [&q, &still, &still]).zmp(ZmpModel::PointMass, 0.0).unwrap()
    };
    let before = zmp(&parameters);
    let mass: f64 = parameters.iter().step_by(10).sum();
    // 1000 kg in the origin.
    parameters[0] += 1000.0;
    let expected = before.map(|p| p * mass / (mass + 1000.0));
    assert_close(&zmp(&parameters), &expected, 1e-12);
    assert!(before[0] > 0.05, "leaning forward: {before:?}");
}

#[test]
fn a_floating_base_at_rest_balances_like_a_fixed_one() {
    let (fixed, parameters) = upper_body();
    let floating = robots::model("upper_body18", true);
    let motion: Vec<f64> = (0..18).map(|joint| 0.1 * (joint as f64 + 1.0).sin()).collect();
    let upright = floating.neutral_configuration();
    let (q, still) = ([&upright[..7], &motion].concat(), [0.0; 6]);
    let v = [&still[..], &motion].concat();
    let on_floor = evaluate(&fixed, &parameters, [&motion; 3].map(|x| &x[..]));
    let afloat = evaluate(&floating, &floating.inertial_parameters(), [&q, &v, &v]);
    assert_close(&on_floor.wrench, &afloat.wrench, 1e-12);
    assert_close(&on_floor.center_of_mass.position, &afloat.center_of_mass.position, 1e-13);
}

#[test]
fn nothing_presses_in_free_fall_or_without_mass() {
    let floating = robots::model("humanoid30", true);
    let q = floating.neutral_configuration();
    let still = vec![0.0; floating.velocity_size()];
    let mut falling = still.clone();
    falling[2] = -9.81;
    let parameters = floating.inertial_parameters();
    let balance = evaluate(&floating, &parameters, [&q, &still, &falling]);
    assert_close(&balance.wrench, &[0.0; 6], 1e-12);
    let massless = vec![0.0; parameters.len()];
    for balance in [balance, evaluate(&floating, &massless, [&q, &still, &still])] {
        if balance.wrench[2] <= 0.0 {
            assert_eq!(balance.zmp(ZmpModel::PointMass, 0.0), None);
            assert_eq!(balance.zmp(ZmpModel::MultiBody, 0.0), None);
        } else {
            panic!("{balance:?}");
        }
    }
}

#[test]
fn sizes_that_do_not_fit_are_named() {
    let (tree, parameters) = upper_body();
    let still = [0.0; 18];
    let check = |parameters: &[f64], [q, v, a]: [&[f64]; 3], message: &str| {
        let error = ZmpWorkspace::new(&tree).evaluate(&tree, parameters, q, v, a).unwrap_err();
        assert_eq!(error.to_string(), message);
    };
    let good: &[f64] = &still;
    check(&parameters[10..], [good; 3], "the standing parameters has 180 elements, but this robot needs 190");
    check(
        &parameters,
        [&still[1..], good, good],
        "the configuration q has 17 elements, but this robot needs 18",
    );
    check(&parameters, [good, &still[1..], good], "the velocity v has 17 elements, but this robot needs 18");
    check(&parameters, [good, good, &[]], "the acceleration a has 0 elements, but this robot needs 18");
    let other = pendulum();
    let error = ZmpWorkspace::new(&other).evaluate(&tree, &parameters, good, good, good).unwrap_err();
    assert_eq!(error.to_string(), "the ZMP workspace has 1 elements, but this robot needs 18");
}
