//! Each effect, seen from outside: what the log's torque has beyond the rigid body's inverse dynamics along
//! the true motion is the effect's own formula. The effect is felt by the motion (the loop is closed), and
//! the log is the plant's ordinary one.

use crate::plants;

use phiw_dynamics::{Placement, Tree, Vec3, Workspace, World};
use phiw_plant::{Coupling, Friction, Mechanism, PlantEffect, PlantRun, Presliding, Sensors};
use plants::{TrueStep, model, rms, rotors, run, setup, true_steps};

/// What an effect adds to a joint's torque, step by step.
type Formula<'a> = &'a dyn Fn(&Tree, &[TrueStep], usize) -> Vec<f64>;

/// Runs `name` with the effect and compares each joint's torque beyond the declared rigid body with the
/// formula: RMS of the difference over RMS of the largest joint's formula stays below `tolerance`, and the
/// motion is tracked poorly.
fn check(name: &str, effect: PlantEffect, tolerance: f64, formula: Formula) {
    let tree = model(name, false);
    let world = rotors(&tree);
    let kind = effect.kind();
    let run = run(&tree, &world, setup(&tree, &world, vec![effect]), 3);
    assert!(run.tracking_error.iter().any(|&error| error > 0.02), "{kind}: tracked too well");
    let steps = true_steps(&run.history, &tree, &world);
    let rigid = |joint: usize| -> Vec<f64> { steps.iter().map(|step| step.rigid[joint]).collect() };
    let expected: Vec<Vec<f64>> =
        (0..tree.joint_count()).map(|joint| at_rows(&run, &formula(&tree, &steps, joint))).collect();
    let largest = expected.iter().map(|values| rms(values.iter().copied())).fold(0.0, f64::max);
    assert!(largest > 1e-3, "{kind}: the formula gives nothing");
    for (joint, expected) in expected.iter().enumerate() {
        let logged = run.recording.tau.iter().skip(joint).step_by(tree.joint_count());
        let rigid = at_rows(&run, &rigid(joint));
        let beyond = logged.zip(&rigid).map(|(logged, rigid)| logged - rigid);
        let error = rms(beyond.zip(expected).map(|(found, expected)| found - expected));
        // Inverse dynamics in the middle of a step are the backend's to a millionth.
        let allowed = tolerance * largest + 1e-6 * rms(rigid.iter().copied());
        assert!(error < allowed, "{kind}: joint {joint} is off by {error:.2e} of {largest:.3}");
    }
}

/// Means over the windows of the log's rows.
fn at_rows(run: &PlantRun, series: &[f64]) -> Vec<f64> {
    let half = 0.5 * Sensors::default().torque_window_s;
    let mean = |&stamp: &f64| {
        let t_s = stamp - run.recording.t[0];
        run.history.mean(series, 1, 0, t_s - half, t_s + half)
    };
    run.recording.t.iter().map(mean).collect()
}

/// A formula of one joint's present state.
fn on(joint: usize, formula: impl Fn(&TrueStep) -> f64) -> impl Fn(&Tree, &[TrueStep], usize) -> Vec<f64> {
    move |_, steps, asked| steps.iter().map(|step| if asked == joint { formula(step) } else { 0.0 }).collect()
}

#[test]
fn frictions_of_the_present_speed() {
    let check = |law: Friction, formula: &dyn Fn(f64) -> f64| {
        check("puma560", PlantEffect::Friction { joint: 1, law }, 1e-4, &on(1, |step| formula(step.v[1])));
    };
    check(Friction::Viscous { coefficient: 9.0 }, &|v| 9.0 * v);
    check(Friction::Quadratic { coefficient: 20.0 }, &|v| 20.0 * v * v.abs());
    // From wide to stiff: a width of 1 mrad/s is a damper of 8 000 N·m·s/rad.
    for width in [0.05, 0.01, 0.001] {
        check(Friction::Coulomb { torque: 8.0, width }, &|v| 8.0 * (v / width).tanh());
    }
    check(Friction::Stribeck { torque: 6.0, speed: 0.1, exponent: 1.3, width: 0.01 }, &|v| {
        6.0 * (-(v / 0.1).abs().powf(1.3)).exp() * (v / 0.01).tanh()
    });
    check(Friction::Asymmetric { positive: false, coefficient: 7.0, torque: 3.0, width: 0.01 }, &|v| {
        if v < 0.0 { 7.0 * v + 3.0 * (v / 0.01).tanh() } else { 0.0 }
    });
}

#[test]
fn frictions_of_load_and_time() {
    let rotor = rotors(&model("puma560", false)).rotor_inertia[1];
    check(
        "puma560",
        PlantEffect::Friction { joint: 1, law: Friction::LoadDependent { coefficient: 0.2, width: 0.02 } },
        5e-3,
        &on(1, |step| 0.2 * (step.rigid[1] - rotor * step.a[1]).abs() * (step.v[1] / 0.02).tanh()),
    );
    // The motor delivers the load's torque over the one efficiency, or times the other.
    let law = Friction::Efficiency { driving: 0.8, driven: 0.6, width: 0.02 };
    check(
        "puma560",
        PlantEffect::Friction { joint: 1, law },
        5e-3,
        &on(1, |step| {
            let load = step.rigid[1] - rotor * step.a[1];
            let at_motor = if load * step.v[1] > 0.0 { load / 0.8 } else { load * 0.6 };
            (at_motor - load) * (step.v[1] / 0.02).tanh().abs()
        }),
    );
    // A second to settle comes before the motion, and time runs then too.
    let law = Friction::Thermal { coefficient: 6.0, torque: 5.0, time_constant_s: 3.0, width: 0.02 };
    check(
        "puma560",
        PlantEffect::Friction { joint: 1, law },
        1e-3,
        &on(1, |step| {
            (-(step.end_s + 1.0) / 3.0).exp() * (6.0 * step.v[1] + 5.0 * (step.v[1] / 0.02).tanh())
        }),
    );
}

#[test]
fn every_joint_of_a_humanoid_may_stick() {
    let tree = model("upper_body18", false);
    for joint in [0, 2, 8, 17] {
        // The speed at a step's end is predicted to some 2e-5 rad/s: a hundredth of the width.
        let torque = 0.03 * tree.joint(joint).limits.effort;
        let law = Friction::Coulomb { torque, width: 0.002 };
        check(
            "upper_body18",
            PlantEffect::Friction { joint, law },
            0.03,
            &on(joint, |step| torque * (step.v[joint] / 0.002).tanh()),
        );
    }
}

#[test]
fn presliding_follows_the_way_since_the_reversal() {
    // Springs and bristles recomputed from the true angles alone.
    let elements = [[0.02, 2.0], [0.08, 5.0]];
    let maxwell = |_: &Tree, steps: &[TrueStep], joint: usize| -> Vec<f64> {
        let (mut forces, mut last) = ([0.0; 2], steps[0].q[1]);
        steps
            .iter()
            .map(|step| {
                let way = step.q[1] - std::mem::replace(&mut last, step.q[1]);
                for (force, [yield_way, limit]) in forces.iter_mut().zip(elements) {
                    *force = (*force + way * limit / yield_way).clamp(-limit, limit);
                }
                if joint == 1 { forces.iter().sum() } else { 0.0 }
            })
            .collect()
    };
    let law = Presliding::MaxwellSlip { elements: elements.to_vec() };
    check("puma560", PlantEffect::Presliding { joint: 1, law }, 5e-3, &maxwell);
    let lugre = |_: &Tree, steps: &[TrueStep], joint: usize| -> Vec<f64> {
        let (mut bent, mut last) = (0.0, steps[0].q[1]);
        steps
            .iter()
            .map(|step| {
                let way = step.q[1] - std::mem::replace(&mut last, step.q[1]);
                bent += (way.signum() - bent) * (1.0 - (-way.abs() / 0.004_f64).exp());
                if joint == 1 { 7.0 * bent } else { 0.0 }
            })
            .collect()
    };
    let law = Presliding::LuGre { torque: 7.0, way: 0.004 };
    check("puma560", PlantEffect::Presliding { joint: 1, law }, 5e-3, &lugre);
}

#[test]
fn torques_of_the_angle() {
    let check = |law: Mechanism, tolerance: f64, formula: &dyn Fn(f64) -> f64| {
        check(
            "puma560",
            PlantEffect::Mechanism { joint: 2, law },
            tolerance,
            &on(2, |step| formula(step.q[2])),
        );
    };
    check(Mechanism::Spring { stiffness: 5.0, rest: 0.3 }, 1e-5, &|q| 5.0 * (q - 0.3));
    check(Mechanism::Ripple { torque: 2.0, cycles: 30.0, phase: 0.4 }, 1e-3, &|q| {
        2.0 * (30.0 * q + 0.4).sin()
    });
    // A curve that a table with steps of 0.02 rad knows to some 1e-3 of it.
    let curve = |q: f64| 3.0 * (-(3.0 * (q - 0.2)).powi(2)).exp() + (2.0 * q).sin();
    let points = (-200..=200).map(|step| 0.02 * f64::from(step)).map(|q| [q, curve(q)]).collect();
    check(Mechanism::Cable { points }, 5e-3, &curve);
    let balancer = Mechanism::Balancer { torque: 6.0, zero: 0.2, arm: 0.4, rest: 0.3 };
    check(balancer, 1e-4, &|q| {
        let third_side = (1.0 + 0.16 - 0.8 * (q - 0.2_f64).cos()).sqrt();
        6.0 * (q - 0.2).sin() * (1.0 - 0.3 / third_side)
    });
    for (upper, exponent) in [(true, 1.0), (false, 1.5)] {
        let tree = model("puma560", false);
        let middle = {
            let world = rotors(&tree);
            let run = run(&tree, &world, setup(&tree, &world, vec![]), 3);
            let angles = run.recording.q.iter().skip(2).step_by(6);
            angles.sum::<f64>() / run.recording.len() as f64
        };
        let law = Mechanism::EndStop { threshold: middle, upper, torque: 4.0, depth: 0.02, exponent };
        check(law, 0.02, &|q| {
            let side = if upper { 1.0 } else { -1.0 };
            side * 4.0 * (side * (q - middle) / 0.02).max(0.0).powf(exponent)
        });
    }
}

#[test]
fn actuators_and_rotors() {
    let torque_offset = PlantEffect::TorqueOffset { joint: 1, torque: -4.0 };
    check("puma560", torque_offset, 1e-5, &on(1, |_| -4.0));
    check(
        "puma560",
        PlantEffect::RotorInertia { joint: 2, inertia: 0.5 },
        1e-5,
        &on(2, |step| 0.5 * step.a[2]),
    );
    // What is logged is 1.2 times what the rigid body gets.
    check(
        "puma560",
        PlantEffect::TorqueGain { joint: 1, share: 0.2 },
        1e-5,
        &on(1, |step| 0.2 * step.rigid[1]),
    );
}

/// A formula of (step, the joint itself, the other) on each of two joints.
fn felt_by_both(
    [one, other]: [usize; 2],
    formula: &dyn Fn(&TrueStep, usize, usize) -> f64,
) -> impl Fn(&Tree, &[TrueStep], usize) -> Vec<f64> + '_ {
    move |_, steps, joint| {
        let felt = |step: &TrueStep| match joint {
            _ if joint == one => formula(step, one, other),
            _ if joint == other => formula(step, other, one),
            _ => 0.0,
        };
        steps.iter().map(felt).collect()
    }
}

#[test]
fn couplings() {
    let joints = [1, 2];
    let both = |formula| felt_by_both(joints, formula);
    let shared = Coupling::SharedFriction { joints, coefficient: 3.0, torque: 2.0, width: 0.01 };
    let friction = |step: &TrueStep, one: usize, other: usize| {
        let sum = step.v[one] + step.v[other];
        3.0 * sum + 2.0 * (sum / 0.01).tanh()
    };
    check("puma560", PlantEffect::Coupling(shared), 1e-3, &both(&friction));
    let shared = Coupling::SharedInertia { joints, inertia: 0.15 };
    check("puma560", PlantEffect::Coupling(shared), 2e-3, &both(&|step, _, other| 0.15 * step.a[other]));
    let driven = Coupling::Driven { driven: 1, driver: 2, coefficient: -4.0, torque: 2.0, width: 0.01 };
    let felt = on(1, |step| -4.0 * step.v[2] + 2.0 * (step.v[2] / 0.01).tanh());
    check("puma560", PlantEffect::Coupling(driven), 1e-3, &felt);
}

/// Torque of inverse dynamics that a change of the tree makes.
fn difference(changed: Tree) -> impl Fn(&Tree, &[TrueStep], usize) -> Vec<f64> {
    move |declared, steps, joint| {
        let mut workspace = Workspace::new(declared);
        let mut torque = |tree: &Tree, step: &TrueStep, before: &[f64]| {
            let middle: Vec<f64> = before.iter().zip(&step.v).map(|(x, y)| 0.5 * (x + y)).collect();
            let mut torque = vec![0.0; step.q.len()];
            tree.inverse_dynamics(&step.q, &middle, &step.a, &mut workspace, &mut torque).unwrap();
            torque[joint]
        };
        let mut before = vec![0.0; steps[0].v.len()];
        steps
            .iter()
            .map(|step| {
                let felt = torque(&changed, step, &before) - torque(declared, step, &before);
                before.clone_from(&step.v);
                felt
            })
            .collect()
    }
}

#[test]
fn payload_and_tilt_change_the_rigid_body() {
    let tree = model("puma560", false);
    let (mass, [x, y, z], [rx, ry, rz]) = (1.5, [0.03, -0.02, 0.08], [0.03, 0.04, 0.05]);
    let payload = PlantEffect::Payload { body: 5, mass, center: [x, y, z], radii: [rx, ry, rz] };
    let mut loaded = tree.clone();
    let mut parameters = loaded.inertial_parameters();
    let added = [
        mass,
        mass * x,
        mass * y,
        mass * z,
        mass * (rx * rx + y * y + z * z),
        -mass * x * y,
        mass * (ry * ry + x * x + z * z),
        -mass * x * z,
        -mass * y * z,
        mass * (rz * rz + x * x + y * y),
    ];
    parameters[50..].iter_mut().zip(added).for_each(|(parameter, added)| *parameter += added);
    loaded.set_inertial_parameters(&parameters).unwrap();
    check("puma560", payload, 1e-5, &difference(loaded));
    let mut tilted = tree.clone();
    // Turned about x by 0.1 rad.
    tilted.gravity = [0.0, 9.81 * 0.1_f64.sin(), -9.81 * 0.1_f64.cos()];
    check("puma560", PlantEffect::GravityTilt { heading: 0.0, angle: 0.1 }, 1e-5, &difference(tilted));
}

#[test]
fn an_external_force_pulls_at_its_point() {
    let (body, point, force) = (3, [0.05, -0.1, 0.02], [4.0, -9.0, 6.0]);
    // Virtual work: what the joint must deliver is minus the force times the point's way with the angle.
    let felt = move |tree: &Tree, steps: &[TrueStep], joint: usize| -> Vec<f64> {
        let mut placements = vec![Placement::identity(); tree.bodies().len()];
        let mut height = |q: &[f64]| -> f64 {
            tree.forward_kinematics(q, &mut placements).unwrap();
            let at = placements[body].point(Vec3(point)).0;
            (0..3).map(|axis| at[axis] * force[axis]).sum()
        };
        let mut work = |step: &TrueStep| {
            let [mut before, mut after] = [step.q.clone(), step.q.clone()];
            before[joint] -= 1e-5;
            after[joint] += 1e-5;
            -(height(&after) - height(&before)) / 2e-5
        };
        steps.iter().map(&mut work).collect()
    };
    check("puma560", PlantEffect::ExternalForce { body, point, force }, 1e-3, &felt);
}

#[test]
fn an_encoder_offset_is_believed_by_log_and_controller() {
    let tree = model("puma560", false);
    let world = rotors(&tree);
    let run = run(
        &tree,
        &world,
        setup(&tree, &world, vec![PlantEffect::EncoderOffset { joint: 1, angle: 0.2 }]),
        3,
    );
    for (row, &stamp) in run.recording.t.iter().enumerate() {
        for joint in 0..6 {
            let truth = run.history.drive_angle_at(joint, stamp - run.recording.t[0]);
            let offset = truth - run.recording.q[row * 6 + joint];
            assert!((offset - if joint == 1 { 0.2 } else { 0.0 }).abs() < 1e-12);
        }
    }
    // Had the controller seen the truth, the offset would not show in the tracking.
    assert!(run.tracking_error[1] > 0.1);
}

#[test]
fn a_delay_makes_logged_torques_old() {
    let tree = model("puma560", false);
    let delay = PlantEffect::TimeDelay { joints: vec![0, 2], delay_s: 0.02 };
    let [plain, delayed] = [vec![], vec![delay]]
        .map(|effects| run(&tree, &World::default(), setup(&tree, &World::default(), effects), 3).recording);
    assert_eq!(plain.q, delayed.q);
    for row in 2..plain.len() {
        for joint in 0..6 {
            let then = if [0, 2].contains(&joint) { row - 2 } else { row };
            assert!((delayed.tau[row * 6 + joint] - plain.tau[then * 6 + joint]).abs() < 1e-9);
        }
    }
}

#[test]
fn a_saturated_actuator_delivers_less_than_it_is_told() {
    let tree = model("puma560", false);
    let world = rotors(&tree);
    let run =
        run(&tree, &world, setup(&tree, &world, vec![PlantEffect::Saturation { joint: 1, torque: 25.0 }]), 3);
    let steps = true_steps(&run.history, &tree, &world);
    let mut clipped = 0;
    for (k, step) in steps.iter().enumerate() {
        let command = run.history.command[k * 6 + 1];
        assert!((step.rigid[1] - command.clamp(-25.0, 25.0)).abs() < 1e-3);
        clipped += usize::from(command.abs() > 26.0);
    }
    assert!(clipped > steps.len() / 50, "clipped {clipped} times only");
}

/// The motor's equation (all friction on its side) and the spring's, from the true states of both sides.
fn check_flexible(stiffness: f64, damping: f64, backlash: f64, tolerance: f64) {
    let tree = model("planar2", false);
    let motor_inertia = [0.3, 0.08];
    let world = World { rotor_inertia: motor_inertia.to_vec(), ..World::default() };
    let effects = vec![
        PlantEffect::Flexibility { joint: 0, stiffness, damping, backlash },
        PlantEffect::Friction { joint: 0, law: Friction::Coulomb { torque: 3.0, width: 0.01 } },
    ];
    let run = run(&tree, &world, setup(&tree, &world, effects), 3);
    // The link's torque does not hold the rotor, which turns by itself.
    let links =
        true_steps(&run.history, &tree, &World { rotor_inertia: vec![0.0, 0.08], ..World::default() });
    let (mut through, mut across, mut size) = (Vec::new(), Vec::new(), Vec::new());
    let at = |values: &[f64], k: usize| values[2 * k];
    for (k, link) in links.iter().enumerate() {
        let [before, after] = [k, k + 1].map(|k| at(&run.history.drive_speed, k));
        let acceleration = (after - before) / run.history.step_s;
        let spring = link.rigid[0];
        through.push(
            at(&run.history.command, k)
                - motor_inertia[0] * acceleration
                - 3.0 * (after / 0.01).tanh()
                - spring,
        );
        let twist = |k: usize| at(&run.history.drive_angle, k) - at(&run.history.link_angle, k);
        let rate = |k: usize| at(&run.history.drive_speed, k) - at(&run.history.link_speed, k);
        let mean = 0.5 * (twist(k) + twist(k + 1));
        let beyond = mean.signum() * (mean.abs() - 0.5 * backlash).max(0.0);
        let damped = if beyond == 0.0 { 0.0 } else { 0.5 * damping * (rate(k) + rate(k + 1)) };
        across.push(stiffness * beyond + damped - spring);
        size.push(spring);
    }
    let size = rms(size);
    let [through, across] = [through, across].map(|errors| rms(errors) / size);
    assert!(
        through < tolerance && across < tolerance,
        "motor {through:.1e}, spring {across:.1e} of {size:.1}"
    );
    // The encoder sits on the motor.
    let half_way = run.recording.len() / 2;
    let t_s = run.recording.t[half_way] - run.recording.t[0];
    let (motor, link) = (run.history.drive_angle_at(0, t_s), link_angle(&run, t_s));
    assert!((run.recording.q[2 * half_way] - motor).abs() < 1e-12);
    assert!((motor - link).abs() > 1e-4);
}

fn link_angle(run: &PlantRun, t_s: f64) -> f64 {
    run.history.mean(&run.history.link_angle, 2, 0, t_s, t_s)
}

#[test]
fn a_flexible_transmission_has_a_motor_of_its_own() {
    check_flexible(2000.0, 2.0, 0.0, 1e-3);
    // As soft as a series elastic actuator, and without damping.
    check_flexible(300.0, 0.0, 0.0, 1e-3);
}

#[test]
fn backlash_is_a_spring_with_play() {
    check_flexible(3000.0, 1.0, 0.02, 0.02);
}
