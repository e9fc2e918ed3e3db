//! Drives at their limit whose command is logged.

use super::robot::{RATE, SECONDS, URDF, folds, named, traced_recording};
use phiw_dynamics::random_tree::RandomNumbers;
use phiw_dynamics::urdf::{UrdfOptions, read_urdf};
use phiw_dynamics::{Tree, Workspace};
use phiw_residual::trace::{Tracing, Verdict};
use phiw_telemetry::Recording;
use std::f64::consts::TAU;

/// Simulation steps from one row of the log to the next.
const STEPS: usize = 8;
/// Gains of the controller of each joint \[N·m/rad, N·m·s/rad\].
const GAINS: [[f64; 2]; 2] = [[900.0, 40.0], [250.0, 9.0]];

/// A minute of a robot under a stiff controller, which follows a Fourier motion as far as the elbow's drive
/// lets it; the command is logged.
fn commanded(tree: &Tree, limit: f64) -> Recording {
    let mut random = RandomNumbers::new(11);
    let sines: Vec<[f64; 3]> = (0..10)
        .map(|k| {
            let frequency = 0.15 + 0.18 * f64::from(k % 5) + random.uniform(0.0, 0.05);
            [random.uniform(0.2, 0.5), TAU * frequency, random.uniform(0.0, TAU)]
        })
        .collect();
    let reference = |joint: usize, t: f64| -> [f64; 2] {
        let own = sines[5 * joint..5 * joint + 5].iter();
        own.fold([0.0; 2], |[q, v], [amplitude, omega, phase]| {
            let (sine, cosine) = (omega * t + phase).sin_cos();
            [q + amplitude * sine, v + amplitude * omega * cosine]
        })
    };
    let mut workspace = Workspace::new(tree);
    let mut recording = Recording { joints: vec!["shoulder".into(), "elbow".into()], ..Recording::default() };
    let (mut q, mut v) =
        ([0, 1].map(|joint| reference(joint, 0.0)[0]), [0, 1].map(|joint| reference(joint, 0.0)[1]));
    let step = 1.0 / (RATE * STEPS as f64);
    for row in 0..(RATE * SECONDS) as usize * STEPS {
        let t = row as f64 * step;
        let command = [0, 1].map(|joint| {
            let [position, velocity] = reference(joint, t);
            GAINS[joint][0] * (position - q[joint]) + GAINS[joint][1] * (velocity - v[joint])
        });
        if row % STEPS == 0 {
            let normal =
                |random: &mut RandomNumbers| (0..12).map(|_| random.uniform(0.0, 1.0)).sum::<f64>() - 6.0;
            recording.t.push(t);
            recording.q.extend(q);
            recording.tau.extend(command.map(|torque| torque + 0.02 * normal(&mut random)));
        }
        let delivered = [command[0], command[1].clamp(-limit, limit)];
        let (mut mass, mut bias) = ([0.0; 4], [0.0; 2]);
        tree.mass_matrix(&q, &mut workspace, &mut mass).unwrap();
        tree.inverse_dynamics(&q, &v, &[0.0; 2], &mut workspace, &mut bias).unwrap();
        let [one, two] = [0, 1]
            .map(|joint| delivered[joint] - bias[joint] - 0.4 * v[joint] - 0.6 * (v[joint] / 0.01).tanh());
        let determinant = mass[0] * mass[3] - mass[1] * mass[2];
        v[0] += step * (mass[3] * one - mass[1] * two) / determinant;
        v[1] += step * (mass[0] * two - mass[2] * one) / determinant;
        (0..2).for_each(|joint| q[joint] += step * v[joint]);
    }
    recording
}

fn limit_of(tracing: &Tracing) -> Option<f64> {
    let is_it = |spec: &&phiw_identification::EffectSpec| spec.kind == "actuator_saturation";
    tracing.specs.iter().find(is_it).map(|spec| spec.constants["limit"])
}

/// Commands of many times what the drive delivers outweighed all else: no limit was found, most of the torque
/// was left, and it was called explained.
#[test]
fn a_drive_whose_command_winds_up_is_at_its_limit() {
    let tree = read_urdf(URDF, &UrdfOptions::default()).unwrap().tree;
    for limit in [4.0, 5.0, 6.0] {
        let log = commanded(&tree, limit);
        let peak = log.tau.chunks(2).map(|torque| torque[1].abs()).fold(0.0, f64::max);
        assert!(peak > 10.0 * limit, "{peak}");
        for declared in [&[][..], &["viscous_friction", "coulomb_friction"]] {
            let tracing = traced_recording(&tree, &log, None, folds().0, declared);
            let expected = ("actuator_saturation".to_owned(), vec!["elbow".to_owned()]);
            assert!(named(&tracing).contains(&expected), "{limit}: {:?}", named(&tracing));
            let found = limit_of(&tracing).unwrap();
            assert!((found / limit - 1.0).abs() < 0.1, "{limit}: {found}");
            assert_eq!(tracing.verdict, Verdict::Explained);
            assert!(tracing.model.held_out.relative < 0.01, "{limit}: {}", tracing.model.held_out.relative);
        }
    }
}
