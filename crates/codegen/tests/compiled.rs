//! Generated code, compiled and run against this workspace's own algorithms.

use phiw_codegen::{Expression, Function, JointTorque, Model, write_c, write_rust};
use phiw_dynamics::random_tree::{RandomNumbers, RandomTreeOptions, random_state, random_tree};
use phiw_dynamics::{Tree, Workspace};
use std::path::Path;
use std::process::Command;

/// Reads states of q, v and a as doubles, and writes torques.
const C_DRIVER: &str = r#"
#include <stdio.h>
int main(int count, char **names) {
    double state[3 * PHIW_JOINTS], torque[PHIW_JOINTS];
    FILE *in = count > 2 ? fopen(names[1], "rb") : 0, *out = in ? fopen(names[2], "wb") : 0;
    if (!out) return 1;
    while (fread(state, sizeof state, 1, in) == 1) {
        phiw_inverse_dynamics(state, state + PHIW_JOINTS, state + 2 * PHIW_JOINTS, torque);
        fwrite(torque, sizeof torque, 1, out);
    }
    return fclose(out);
}
"#;

const RUST_DRIVER: &str = r#"
use generated::{JOINTS, inverse_dynamics};
fn main() -> std::io::Result<()> {
    let names: Vec<String> = std::env::args().collect();
    let bytes = std::fs::read(&names[1])?;
    let numbers: Vec<f64> = bytes.chunks(8).map(|b| f64::from_le_bytes(b.try_into().unwrap())).collect();
    let mut out = Vec::new();
    for state in numbers.chunks(3 * JOINTS) {
        let [q, v, a]: [[f64; JOINTS]; 3] =
            std::array::from_fn(|at| state[at * JOINTS..(at + 1) * JOINTS].try_into().unwrap());
        inverse_dynamics(&q, &v, &a).iter().for_each(|torque| out.extend(torque.to_le_bytes()));
    }
    std::fs::write(&names[2], out)
}
"#;

/// Compiles and runs; the torques, or `None` where there is no compiler.
fn run(folder: &Path, compile: &mut [Command], states: &[f64]) -> Option<Vec<f64>> {
    let bytes: Vec<u8> = states.iter().flat_map(|value| value.to_le_bytes()).collect();
    std::fs::write(folder.join("states"), bytes).unwrap();
    for command in compile {
        match command.current_dir(folder).output() {
            Err(_) => {
                println!("skipped: {} is not here", command.get_program().to_string_lossy());
                return None;
            }
            Ok(output) => assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr)),
        }
    }
    let status = Command::new(folder.join("driver")).args(["states", "torques"]).current_dir(folder).status();
    assert!(status.unwrap().success());
    let bytes = std::fs::read(folder.join("torques")).unwrap();
    Some(bytes.as_chunks::<8>().0.iter().map(|&bytes| f64::from_le_bytes(bytes)).collect())
}

fn in_c(text: &str, states: &[f64]) -> Option<Vec<f64>> {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("driver.c"), format!("{text}{C_DRIVER}")).unwrap();
    let mut compile = Command::new("cc");
    compile.args(["-std=c99", "-Wall", "-Werror", "-O2", "-o", "driver", "driver.c", "-lm"]);
    run(folder.path(), &mut [compile], states)
}

fn in_rust(text: &str, states: &[f64]) -> Option<Vec<f64>> {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("generated.rs"), text).unwrap();
    std::fs::write(folder.path().join("driver.rs"), RUST_DRIVER).unwrap();
    let rustc = |arguments: &[&str]| {
        let mut rustc = Command::new("rustc");
        rustc.args(["--edition", "2021", "-D", "warnings", "-C", "opt-level=2"]).args(arguments);
        rustc
    };
    let library = rustc(&["--crate-type", "lib", "generated.rs"]);
    run(
        folder.path(),
        &mut [library, rustc(&["--extern", "generated=libgenerated.rlib", "driver.rs"])],
        states,
    )
}

/// Torques of every form, each at a joint of its own, and what they are.
fn added(tree: &Tree) -> Vec<JointTorque> {
    let names: Vec<&str> = tree.joint_names().collect();
    let (q, v, a) = (Expression::position, Expression::velocity, Expression::acceleration);
    let load = Expression::BodyTorque(names[1].to_owned()).magnitude();
    let total = Expression::MotionTorque(names[0].to_owned());
    let stribeck = (-(2.0 * v(names[2])).of(Function::Power(1.3))).of(Function::Exponential);
    let stop = (q(names[3]) + Expression::Constant(-0.2)).of(Function::PositivePart);
    let ripple = (7.0 * q(names[4])).of(Function::Sine) + (7.0 * q(names[4])).of(Function::Cosine);
    vec![
        JointTorque::new(names[0], 0.3 * v(names[0]) + 0.1 * a(names[0])),
        JointTorque::new(names[0], 0.05 * total),
        JointTorque::new(names[1], 0.2 * load * v(names[1]).sign(0.03)),
        JointTorque::new(names[2], stribeck * v(names[2]).sign(0.0)),
        JointTorque::new(names[3], 40.0 * stop),
        JointTorque::new(names[4], ripple + Expression::Constant(0.7)),
    ]
}

fn of_added(q: &[f64], v: &[f64], a: &[f64], bodies: &[f64]) -> [f64; 5] {
    let own = 0.3 * v[0] + 0.1 * a[0];
    [
        own + 0.05 * (bodies[0] + own),
        0.2 * bodies[1].abs() * (v[1] / 0.03).tanh(),
        (-(2.0 * v[2]).abs().powf(1.3)).exp() * v[2].signum(),
        40.0 * (q[3] - 0.2).max(0.0),
        (7.0 * q[4]).sin() + (7.0 * q[4]).cos() + 0.7,
    ]
}

#[test]
fn generated_code_gives_our_torques() {
    for (seed, joints, mimic) in [(1, 6, false), (2, 18, false), (3, 7, true)] {
        let tree = random_tree(seed, &RandomTreeOptions { joints, mimic, ..Default::default() }).unwrap();
        let count = tree.joint_count();
        let model = Model { tree: &tree, torques: added(&tree), header: vec!["A */ robot.".to_owned()] };
        let (mut random, mut workspace) = (RandomNumbers::new(seed), Workspace::new(&tree));
        let (mut states, mut ours) = (Vec::new(), Vec::new());
        for _ in 0..200 {
            let state = random_state(&tree, &mut random);
            let mut torque = vec![0.0; count];
            tree.inverse_dynamics(&state.q, &state.v, &state.a, &mut workspace, &mut torque).unwrap();
            let added = of_added(&state.q, &state.v, &state.a, &torque);
            torque.iter_mut().zip(added).for_each(|(torque, added)| *torque += added);
            ours.extend(torque);
            [state.q, state.v, state.a].iter().for_each(|signal| states.extend_from_slice(signal));
        }
        let (c, rust) = (write_c(&model).unwrap(), write_rust(&model).unwrap());
        let largest = ours.iter().fold(0.0_f64, |largest, torque| largest.max(torque.abs()));
        for (language, torques) in [("C", in_c(&c, &states)), ("Rust", in_rust(&rust, &states))] {
            let Some(torques) = torques else { continue };
            assert_eq!(torques.len(), ours.len(), "{language}");
            for (torque, ours) in torques.iter().zip(&ours) {
                let difference = (torque - ours).abs();
                assert!(
                    difference < 1e-12 * (largest + ours.abs()),
                    "{language}, seed {seed}: {torque} {ours}"
                );
            }
        }
    }
}

#[test]
fn what_is_not_of_the_robot_is_refused() {
    let tree = random_tree(1, &RandomTreeOptions { joints: 2, ..Default::default() }).unwrap();
    let name = tree.joint_names().next().unwrap().to_owned();
    for (torque, message) in [
        (JointTorque::new("elbow", Expression::Constant(1.0)), "a formula names the joint `elbow`"),
        (JointTorque::new(&name, Expression::velocity("elbow")), "a formula names the joint `elbow`"),
        (JointTorque::new(&name, f64::NAN * Expression::velocity(&name)), "not finite"),
    ] {
        let model = Model { tree: &tree, torques: vec![torque], header: Vec::new() };
        let refused = write_c(&model).unwrap_err().to_string();
        assert!(refused.contains(message), "{refused}");
        assert_eq!(write_rust(&model).unwrap_err().to_string(), refused);
    }
}
