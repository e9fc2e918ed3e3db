//! What is written is what MuJoCo reads: the same torques.

use phiw_dynamics::random_tree::{RandomNumbers, RandomTreeOptions, random_state, random_tree};
use phiw_dynamics::{Tree, Workspace};
use phiw_mjcf::{FixedTendon, JointModel, RobotModel, impossible_bodies, write_mjcf};
use phiw_sim_mujoco::{MjcfFile, MujocoError};

/// The robot in MuJoCo; says so and gives `None` where MuJoCo is not there.
fn read(robot: &RobotModel<'_>) -> Option<Result<MjcfFile, MujocoError>> {
    match MjcfFile::read(&write_mjcf(robot).unwrap(), robot.tree) {
        Err(MujocoError::NotFound { .. }) => {
            println!("skipped: MuJoCo not found, run cargo xtask mujoco");
            None
        }
        read => Some(read),
    }
}

fn robot(seed: u64, joints: usize) -> Tree {
    random_tree(seed, &RandomTreeOptions { joints, ..RandomTreeOptions::default() }).unwrap()
}

/// The torques of the model, by phiw's own algorithms.
fn torques(robot: &RobotModel<'_>, q: &[f64], v: &[f64], a: &[f64]) -> Vec<f64> {
    let mut torque = vec![0.0; q.len()];
    robot.tree.inverse_dynamics(q, v, a, &mut Workspace::new(robot.tree), &mut torque).unwrap();
    for (joint, model) in robot.joints.iter().enumerate() {
        torque[joint] += model.armature * a[joint]
            + model.damping * v[joint]
            + model.friction * v[joint].signum()
            + model.stiffness * (q[joint] - model.spring_reference);
    }
    for tendon in &robot.tendons {
        let sum = |of: &[f64]| tendon.joints.iter().map(|&(joint, factor)| factor * of[joint]).sum::<f64>();
        let force = tendon.armature * sum(a) + tendon.damping * sum(v) + tendon.friction * sum(v).signum();
        tendon.joints.iter().for_each(|&(joint, factor)| torque[joint] += factor * force);
    }
    torque
}

/// MuJoCo's torques are those of the model, in states inside the joints' limits; friction turns within
/// MuJoCo's time constant of the sign, so speeds stay away from zero.
fn check(robot: &RobotModel<'_>, random: &mut RandomNumbers) {
    let Some(read) = read(robot) else { return };
    let mut file = read.unwrap();
    let mut found = vec![0.0; robot.tree.joint_count()];
    for _ in 0..20 {
        let state = random_state(robot.tree, random);
        let fast = |v: &f64| v + v.signum() * 2.0;
        let q: Vec<f64> = (0..state.q.len())
            .map(|joint| {
                let limits = robot.tree.joint(joint).limits;
                state.q[joint].clamp(limits.lower + 1e-3, limits.upper - 1e-3)
            })
            .collect();
        let v: Vec<f64> = state.v.iter().map(fast).collect();
        let expected = torques(robot, &q, &v, &state.a);
        file.inverse_dynamics(&q, &v, &state.a, &mut found).unwrap();
        let scale = expected.iter().fold(1.0_f64, |largest, x| largest.max(x.abs()));
        for (found, expected) in found.iter().zip(&expected) {
            assert!(
                (found - expected).abs() < 1e-9 * scale,
                "{found} {expected} {:?} {:?} v {v:?} a {:?}",
                robot.tendons,
                robot.joints,
                state.a
            );
        }
    }
}

#[test]
fn mujoco_finds_the_torques_of_random_robots() {
    for seed in 0..30 {
        let tree = robot(seed, 1 + seed as usize % 9);
        assert!(impossible_bodies(&tree).is_empty());
        let mut random = RandomNumbers::new(seed);
        let mut model = RobotModel::new(&tree);
        check(&model, &mut random);
        for joint in &mut model.joints {
            *joint = JointModel {
                armature: random.uniform(0.0, 0.5),
                damping: random.uniform(0.0, 2.0),
                stiffness: random.uniform(0.0, 3.0),
                spring_reference: random.uniform(-1.0, 1.0),
                ..JointModel::default()
            };
        }
        check(&model, &mut random);
    }
}

#[test]
fn mujoco_finds_the_torques_of_couplings_and_friction() {
    for seed in 0..10 {
        let tree = robot(seed, 4);
        let mut random = RandomNumbers::new(seed);
        let mut model = RobotModel::new(&tree);
        model.joints.iter_mut().for_each(|joint| joint.armature = 0.1);
        let pairs = (0..4).filter_map(|joint| Some((tree.bodies()[joint].parent?, joint)));
        model.tendons = pairs
            .zip([1.0, -1.0, 1.0])
            .map(|((parent, joint), factor)| FixedTendon {
                name: format!("coupling of {joint}"),
                joints: [(parent, 1.0), (joint, factor)],
                armature: random.uniform(0.0, 0.1),
                damping: random.uniform(0.0, 1.0),
                friction: 0.0,
                friction_width: 0.0,
            })
            .collect();
        check(&model, &mut random);
        // Friction is a soft constraint of MuJoCo's: exact wherever it slides.
        model.tendons.iter_mut().for_each(|tendon| tendon.armature = 0.0);
        model.joints.iter_mut().for_each(|joint| joint.friction = random.uniform(0.05, 0.2));
        check(&model, &mut random);
    }
}

/// Identified parameters need not be those of a real body: the file is written all the same, and the links
/// are named that MuJoCo will refuse.
#[test]
fn an_impossible_body_is_written_and_named() {
    let mut tree = robot(3, 3);
    let mut parameters = tree.inertial_parameters();
    parameters[10] = -1.0;
    parameters[20..30].fill(0.0);
    tree.set_inertial_parameters(&parameters).unwrap();
    let named = impossible_bodies(&tree);
    assert_eq!(named, [tree.bodies()[1].link.clone(), tree.bodies()[2].link.clone()]);
    let model = RobotModel::new(&tree);
    if let Some(read) = read(&model) {
        assert!(matches!(read, Err(MujocoError::Refused { .. })));
    }
}

/// Names are the user's, and a comment ends at two hyphens.
#[test]
fn names_and_comments_with_the_signs_of_xml_are_read_back() {
    let urdf = r#"<robot name="a&amp;b"><link name="base"/>
      <link name="&lt;arm&gt; &quot;1&quot;"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
      <joint name="p -- &amp; q" type="continuous"><parent link="base"/><child link="&lt;arm&gt; &quot;1&quot;"/></joint></robot>"#;
    let tree = phiw_dynamics::urdf::read_urdf(urdf, &Default::default()).unwrap().tree;
    let mut model = RobotModel::new(&tree);
    model.header = vec!["joint p -- & q ---> is here\u{1}".to_owned()];
    check(&model, &mut RandomNumbers::new(1));
    let text = write_mjcf(&model).unwrap();
    let document = text.split_once("-->").unwrap();
    assert!(!document.0.trim_start_matches("<!--").contains("--") && document.1.contains("p -- &amp; q"));
}

#[test]
fn what_does_not_fit_the_robot_is_refused() {
    let tree = robot(1, 2);
    let mut model = RobotModel::new(&tree);
    model.joints[1].damping = f64::NAN;
    let message = write_mjcf(&model).unwrap_err().to_string();
    assert!(message.contains("the damping") && message.contains(&tree.joint(1).joint), "{message}");
    model.joints.pop();
    assert!(write_mjcf(&model).is_err());
    let mut model = RobotModel::new(&tree);
    let joints = [(0, 1.0), (2, 1.0)];
    model.tendons = vec![FixedTendon {
        name: "coupling".to_owned(),
        joints,
        armature: 0.0,
        damping: 1.0,
        friction: 0.0,
        friction_width: 0.0,
    }];
    assert!(write_mjcf(&model).unwrap_err().to_string().contains("joint 2"));
}

/// With MuJoCo's default softness the friction of a light joint is a damper up to 0.2 rad/s, and an exported
/// arm moved another way than its model though all torques of fast states agreed.
#[test]
fn friction_turns_within_its_own_width_whatever_the_inertia() {
    for (seed, width) in [(0, 0.002), (1, 0.01), (2, 0.05)] {
        let tree = robot(seed, 1);
        let mut model = RobotModel::new(&tree);
        let friction = 3.0;
        let q = [0.0];
        let mut found = [0.0];
        let mut bare = |model: &RobotModel<'_>, v: f64| {
            let mut file = read(model)?.unwrap();
            file.inverse_dynamics(&q, &[v], &[0.0], &mut found).unwrap();
            Some(found[0])
        };
        model.joints[0] = JointModel { armature: 0.01, ..JointModel::default() };
        let without = model.clone();
        model.joints[0].friction = friction;
        model.joints[0].friction_width = width;
        // The area under 1 − tanh(v/w) is w·ln 2, that under a line twice as much over its end.
        let end = 2.0 * 2.0_f64.ln() * width;
        for share in [-1.5, -1.0, -0.5, 0.25, 0.75, 1.0, 2.0] {
            let Some(whole) = bare(&model, share * end) else { return };
            let own = whole - bare(&without, share * end).unwrap();
            let expected = friction * share.clamp(-1.0, 1.0);
            assert!((own - expected).abs() < 1e-6 * friction, "{own} {expected}, {share} of {end} rad/s");
        }
    }
}

#[test]
fn a_motor_that_is_late_has_a_memory_as_long_as_its_delay() {
    let tree = robot(1, 2);
    let mut model = RobotModel::new(&tree);
    model.joints[1].motor_delay = 0.0051;
    let text = write_mjcf(&model).unwrap();
    assert_eq!(text.matches(" delay=").count(), 1);
    assert!(text.contains(r#"delay="0.0051" nsample="53" interp="linear""#), "{text}");
    if let Some(read) = read(&model) {
        read.unwrap();
    }
}
