//! Robots read from MJCF: what MuJoCo makes of the same file, and what is refused.

use phiw_dynamics::random_tree::{RandomNumbers, RandomTreeOptions, random_state, random_tree};
use phiw_dynamics::urdf::{Extent, UrdfOptions, link_shapes, read_urdf};
use phiw_dynamics::{JointType, Tree, Workspace};
use phiw_mjcf::{JointModel, MjcfReading, RobotModel, is_mjcf, read_mjcf, read_mjcf_with, write_mjcf};
use phiw_sim_mujoco::{MjcfFile, MujocoError};

fn tree_of(reading: &MjcfReading) -> Tree {
    read_urdf(&reading.urdf, &UrdfOptions::default()).unwrap().tree
}

/// Torques with the damping that the URDF has and the armature that was read beside it.
fn torques(reading: &MjcfReading, tree: &Tree, [q, v, a]: [&[f64]; 3]) -> Vec<f64> {
    let mut torque = vec![0.0; tree.joint_count()];
    tree.inverse_dynamics(q, v, a, &mut Workspace::new(tree), &mut torque).unwrap();
    for (joint, torque) in torque.iter_mut().enumerate() {
        let body = tree.joint(joint);
        let armature = reading.armature.iter().find(|(name, _)| *name == body.joint);
        *torque += body.damping * v[joint] + armature.map_or(0.0, |(_, armature)| armature * a[joint]);
    }
    torque
}

#[test]
fn a_robot_that_we_have_written_is_read_as_it_was() {
    for seed in 0..40 {
        let options = RandomTreeOptions {
            joints: 1 + seed as usize % 9,
            mimic: seed % 2 == 1,
            ..RandomTreeOptions::default()
        };
        let tree = random_tree(seed, &options).unwrap();
        let mut random = RandomNumbers::new(seed);
        let mut robot = RobotModel::new(&tree);
        for joint in &mut robot.joints {
            *joint = JointModel { armature: random.uniform(0.1, 0.5), damping: 2.0, ..JointModel::default() };
        }
        let reading = read_mjcf(&write_mjcf(&robot).unwrap()).unwrap();
        let read = tree_of(&reading);
        assert!(read.joint_names().eq(tree.joint_names()));
        for _ in 0..5 {
            let state = random_state(&tree, &mut random);
            let state = [&state.q[..], &state.v, &state.a];
            let mut expected = vec![0.0; tree.joint_count()];
            tree.inverse_dynamics(state[0], state[1], state[2], &mut Workspace::new(&tree), &mut expected)
                .unwrap();
            for (joint, model) in robot.joints.iter().enumerate() {
                expected[joint] += model.armature * state[2][joint] + 2.0 * state[1][joint];
            }
            let found = torques(&reading, &read, state);
            let scale = expected.iter().fold(1.0_f64, |largest, x| largest.max(x.abs()));
            for (found, expected) in found.iter().zip(&expected) {
                assert!((found - expected).abs() < 1e-12 * scale, "{seed}: {found} {expected}");
            }
        }
    }
}

/// Classes in classes, degrees, every way to write an orientation, several joints in a body, positions that
/// are not zero in the file's pose, frames, and inertias from geometry.
const ARM: &str = r#"<?xml version="1.0"?>
<!-- by hand -->
<mujoco model="arm">
  <compiler angle="degree" eulerseq="zyX" boundmass="0.01" boundinertia="1e-5"/>
  <default>
    <joint damping="0.5" armature="0.01"/>
    <geom density="800"/>
    <default class="elbow"><joint damping="0.2" axis="0 1 0"/>
      <default class="wrist"><joint armature="0.02" type="hinge"/><geom type="capsule" size="0.03"/></default>
    </default>
  </default>
  <asset><mesh name="hull" file="nowhere.stl"/></asset>
  <worldbody>
    <geom type="plane" size="1 1 1"/>
    <frame pos="0.1 0 0.2" euler="20 -30 40">
      <body name="base" pos="0 0 0.3" axisangle="1 2 3 25">
        <inertial pos="0.1 0.2 0.3" mass="2" fullinertia="0.2 0.3 0.25 0.01 -0.02 0.03"/>
        <geom type="mesh" mesh="hull"/>
        <joint name="yaw" pos="0.05 -0.1 0.02" axis="0 0.6 2" range="-90 90" ref="15"/>
        <joint name="lift" type="slide" axis="1 0 1" range="-0.2 0.3" ref="0.1"/>
        <body name="plate" pos="0.1 0.1 0" quat="1 1 0 0"><inertial pos="0 0 0.1" quat="1 2 3 4" mass="0.7" diaginertia="0.01 0.02 0.015"/></body>
        <body name="upper" childclass="elbow" pos="0.3 0 0" xyaxes="0 1 0 -1 0.2 0">
          <joint name="elbow" damping="0.9"/>
          <geom type="box" size="0.1 0.05 0.02" pos="0.05 0 0" euler="10 20 30"/>
          <geom type="cylinder" size="0.04 0.2" mass="1.2" zaxis="1 1 0"/>
          <geom type="ellipsoid" size="0.1 0.06 0.03" pos="0 0.1 0"/>
          <body pos="0 0 0.4" childclass="wrist">
            <joint/>
            <joint name="roll" class="elbow" axis="1 0 0" pos="0 0 0.01" limited="false" range="-1 1"/>
            <geom fromto="0 0 0 0.1 0.2 0.3"/>
            <geom class="main" size="0.05" pos="0 0.1 0"/>
            <frame pos="0 0 0.1" euler="0 0 90"><geom type="cylinder" size="0.02 0.1" pos="0.1 0 0" euler="0 90 0"/></frame>
            <geom type="box" size="1 1 1" mass="0"/>
          </body>
        </body>
      </body>
    </frame>
  </worldbody>
  <actuator><motor joint="elbow" gear="2" forcerange="-10 5"/></actuator>
</mujoco>"#;

#[test]
fn the_torques_are_those_that_mujoco_finds() {
    let reading = read_mjcf(ARM).unwrap();
    let tree = tree_of(&reading);
    let names: Vec<&str> = tree.joint_names().collect();
    assert_eq!(names, ["yaw", "lift", "elbow", "body_5_hinge", "roll"]);
    assert_eq!(tree.joint(2).damping, 0.9);
    assert_eq!(tree.joint(2).limits.effort, 20.0);
    assert_eq!(tree.joint(3).damping, 0.2);
    assert_eq!(tree.joint(4).joint_type, JointType::Continuous);
    assert!((tree.joint(0).limits.upper - std::f64::consts::FRAC_PI_2).abs() < 1e-15);
    assert_eq!(reading.armature[3], ("body_5_hinge".to_owned(), 0.02));
    // MuJoCo would look for the mesh, and add the forces of contacts.
    let text = ARM
        .replace(
            r#"<asset><mesh name="hull" file="nowhere.stl"/></asset>"#,
            r#"<option><flag contact="disable"/></option>"#,
        )
        .replace(r#"<geom type="mesh" mesh="hull"/>"#, "");
    let mut file = match MjcfFile::read_sized(&text, 5, 4) {
        Err(MujocoError::NotFound { .. }) => {
            return println!("skipped: MuJoCo not found, run cargo xtask mujoco");
        }
        file => file.unwrap(),
    };
    let mut random = RandomNumbers::new(1);
    let mut found = vec![0.0; 5];
    for _ in 0..50 {
        let state = random_state(&tree, &mut random);
        let q: Vec<f64> = (0..5)
            .map(|joint| {
                let limits = tree.joint(joint).limits;
                state.q[joint].clamp(limits.lower + 0.01, limits.upper - 0.01)
            })
            .collect();
        let expected = torques(&reading, &tree, [&q, &state.v, &state.a]);
        file.inverse_dynamics(&q, &state.v, &state.a, &mut found).unwrap();
        let scale = expected.iter().fold(1.0_f64, |largest, x| largest.max(x.abs()));
        for (found, expected) in found.iter().zip(&expected) {
            assert!((found - expected).abs() < 1e-9 * scale, "{found:?} {expected:?}");
        }
    }
}

/// A robot of one body `b` with a hinge `j`, and something more in it, before or behind it.
fn one_joint(in_body: &str, beside: &str) -> String {
    format!(
        r#"<mujoco><worldbody><body name="b"><inertial pos="0 0 0.1" mass="1" diaginertia="1 1 1"/><joint name="j"/>{in_body}</body></worldbody>{beside}</mujoco>"#
    )
}

#[test]
fn a_joint_follows_another_as_the_equality_says() {
    let second = r#"<body name="c" pos="0 0 1"><inertial pos="0 0 0.1" mass="1" diaginertia="1 1 1"/><joint name="k" ref="10"/></body>"#;
    let text =
        one_joint(second, r#"<equality><joint joint1="k" joint2="j" polycoef="0.3 -2 0 0 0"/></equality>"#);
    let tree = tree_of(&read_mjcf(&text).unwrap());
    assert_eq!(tree.joint_count(), 1);
    let follower = &tree.bodies()[1];
    assert!(follower.mimic && follower.ratio == -2.0);
    assert!((follower.offset - 0.3 - 10.0_f64.to_radians()).abs() < 1e-15);
    let bent = text.replace("0.3 -2 0 0 0", "0 1 2 0 0");
    let reading = read_mjcf(&bent).unwrap();
    assert_eq!(reading.left_out, ["joint equality"]);
    assert_eq!(tree_of(&reading).joint_count(), 2);
}

#[test]
fn a_free_joint_is_a_floating_base() {
    let body = r#"<body name="torso"><freejoint/><inertial pos="0 0 0.1" mass="3" diaginertia="1 1 1"/>
      <body name="leg"><joint name="hip"/><inertial pos="0 0 -0.1" mass="1" diaginertia="0.1 0.1 0.1"/></body></body>"#;
    let tree = tree_of(&read_mjcf(&format!("<mujoco><worldbody>{body}</worldbody></mujoco>")).unwrap());
    assert!(tree.is_floating());
    assert_eq!((tree.joint_count(), tree.velocity_size()), (1, 7));
    assert_eq!(tree.bodies()[0].inertial[0], 3.0);
}

#[test]
fn what_a_urdf_cannot_say_is_named() {
    let more = r#"<geom type="mesh" mesh="m"/><body gravcomp="1" name="c"><joint name="k" stiffness="3" armature="0.1"/><geom type="mesh" mesh="m"/></body>"#;
    let text = one_joint(
        more,
        r#"<tendon><fixed name="t"><joint joint="j" coef="1"/></fixed></tendon><equality><weld name="w" body1="b" body2="c"/></equality><option gravity="0 0 -1.62"/>"#,
    );
    let expected = [
        "gravcomp of c",
        "stiffness of k",
        "inertia of c, whose meshes or shells are not read",
        "fixed tendon t",
        "weld equality w",
        "gravity 0 0 -1.62, taken as 0 0 -9.81",
        "armature of k (declare rotor_inertia)",
    ];
    assert_eq!(read_mjcf(&text).unwrap().left_out, expected);
}

#[test]
fn what_cannot_be_read_is_refused_with_its_line_and_the_way_out() {
    let refuses = |text: &str, expected: &str| {
        let error = read_mjcf(text).unwrap_err().to_string();
        assert!(error.contains(expected), "{error}");
    };
    refuses("<robot/>", "<robot>, not <mujoco>");
    refuses("<mujoco>", "line 1");
    refuses("<mujoco/>", "nothing moves");
    refuses("<mujoco>\n<include file=\"a.xml\"/></mujoco>", "line 2: it includes `a.xml`");
    refuses(&one_joint("\n<joint type=\"ball\"/>", ""), "line 2: a ball joint is not read");
    refuses(&one_joint("<replicate count=\"2\"/>", ""), "<replicate> makes bodies by a rule");
    refuses(&one_joint("<joint axis=\"0 0 0\"/>", ""), "a direction that is not zero");
    refuses(&one_joint("<joint axis=\"0 1\"/>", ""), "expected 3 numbers");
    refuses(&one_joint("<joint damping=\"nan\"/>", ""), "expected finite numbers");
    refuses(&one_joint("<joint name=\"j\"/>", ""), "called `j`");
    refuses(&one_joint("<joint class=\"soft\"/>", ""), "the class `soft` has no <default>");
    refuses(&one_joint("<body><freejoint/></body>", ""), "belongs to a body of the world");
    refuses(
        &one_joint("", "<equality><joint joint1=\"j\" joint2=\"x\"/></equality>"),
        "no joint is called `x`",
    );
    refuses(
        &one_joint("<body><joint/><geom type=\"box\" size=\"1 -1 1\"/></body>", ""),
        "positive sizes of a box",
    );
    refuses(
        &one_joint("<body><inertial pos=\"0 0 0\" mass=\"1\"/></body>", ""),
        "no diaginertia or fullinertia",
    );
    refuses(&format!("<mujoco>{}</mujoco>", "<a>".repeat(100)), "inside each other");
}

#[test]
fn mjcf_is_known_by_its_first_element() {
    for text in
        ["<mujoco>", "\u{feff}<?xml version=\"1.0\"?>\n<!-- <robot> -->\n<mujoco model=\"a\">", "<mujoco/>"]
    {
        assert!(is_mjcf(text), "{text}");
    }
    for text in ["<robot name=\"mujoco\">", "", "<mujocos/>", "<!-- <mujoco>"] {
        assert!(!is_mjcf(text), "{text}");
    }
}

/// Cut off, with bytes exchanged, and with numbers that are too large: an answer or a refusal, never a panic;
/// and what is answered is a URDF that is read or refused in turn.
#[test]
fn a_damaged_file_is_read_or_refused() {
    let mut random = RandomNumbers::new(7);
    let words = ["1e308", "-1", "0", "nan", "", "true", "\"", "<", ">", "&a;", "ref", "free", "é"];
    for _ in 0..3000 {
        let mut text = ARM.to_owned();
        for _ in 0..1 + random.index(3) {
            let mut from = random.index(text.len());
            while !text.is_char_boundary(from) {
                from -= 1;
            }
            let mut to = (from + random.index(12)).min(text.len());
            while !text.is_char_boundary(to) {
                to -= 1;
            }
            text.replace_range(from..to.max(from), words[random.index(words.len())]);
        }
        if random.chance(0.1) {
            let mut end = random.index(text.len());
            while !text.is_char_boundary(end) {
                end -= 1;
            }
            text.truncate(end);
        }
        if let Ok(reading) = read_mjcf(&text) {
            let _ = read_urdf(&reading.urdf, &UrdfOptions::default());
        }
    }
}

/// Files by name, as a folder would have them.
fn from_files<'a>(files: &'a [(&'a str, &'a str)]) -> impl FnMut(&str) -> Result<String, String> + 'a {
    |name| {
        let file = files.iter().find(|(known, _)| *known == name);
        file.map(|(_, text)| (*text).to_owned()).ok_or_else(|| "it is not there".to_owned())
    }
}

#[test]
fn included_files_are_as_if_they_stood_there() {
    let whole = one_joint(
        "<body name=\"c\"><joint name=\"k\" axis=\"1 0 0\"/><inertial pos=\"0 0 1\" mass=\"2\" diaginertia=\"1 1 1\"/></body>",
        "<option gravity=\"0 0 -9.81\"/>",
    );
    let files = [
        (
            "parts/c.xml",
            "<mujoco><!-- c --><include file=\"rest.xml\"/>\n<body name=\"c\"><joint name=\"k\" axis=\"1 0 0\"/><include file=\"i.xml\"/></body></mujoco>",
        ),
        ("rest.xml", "<mujocoinclude/>"),
        (
            "i.xml",
            "<?xml version=\"1.0\"?><mujocoinclude><inertial pos=\"0 0 1\" mass=\"2\" diaginertia=\"1 1 1\"/></mujocoinclude>",
        ),
        ("o.xml", "<mujocoinclude><option gravity=\"0 0 -9.81\"/></mujocoinclude>"),
    ];
    let parts = one_joint("<include file=\"parts/c.xml\"/>", "<include file=\"o.xml\"><!-- --></include>");
    let found = read_mjcf_with(&parts, &mut from_files(&files)).unwrap();
    assert_eq!(found, read_mjcf(&whole).unwrap());
    assert_eq!(read_mjcf_with(&whole, &mut from_files(&[])).unwrap(), found, "nothing is asked for");
}

#[test]
fn what_cannot_be_included_is_refused_in_words() {
    let refuses = |include: &str, files: &[(&str, &str)], expected: &str| {
        let text = one_joint("", &format!("\n<include{include}/>"));
        let error = read_mjcf_with(&text, &mut from_files(files)).unwrap_err().to_string();
        assert!(error.contains(expected) && error.lines().count() == 1, "{error}");
    };
    let a = " file=\"a.xml\"";
    let again = "<mujoco><include file=\"a.xml\"/></mujoco>";
    refuses("", &[], "line 2: <include> has no file");
    refuses(a, &[], "line 2: it includes `a.xml`, which cannot be read: it is not there");
    refuses(a, &[("a.xml", again)], "included `a.xml`: line 1: it includes `a.xml` twice");
    refuses(a, &[("a.xml", "<robot/>")], "included `a.xml`: the root element is <robot>");
    refuses(a, &[("a.xml", "<mujoco>")], "included `a.xml`: line 1");
    refuses(
        a,
        &[("a.xml", "<mujoco><default class=\"x\"><default/></default></mujoco>")],
        "with its included files written in, line 2",
    );
    let large = format!("<mujoco><!--{}--></mujoco>", "x".repeat(9 << 20));
    let twice = "<mujoco><include file=\"b.xml\"/><include file=\"c.xml\"/></mujoco>";
    refuses(a, &[("a.xml", twice), ("b.xml", &large), ("c.xml", &large)], "bytes");
}

/// Of the same geometry in MuJoCo's words and a URDF's the extents agree.
#[test]
fn geometry_is_carried_over() {
    let geoms = r#"<geom type="capsule" size="0.1" fromto="0 0 0 1 0 0"/><frame pos="0 1 0"><geom type="box" size="0.1 0.2 0.3" pos="0 0 1"/></frame>
      <geom size="0.05" pos="0 0 -2"/><geom type="ellipsoid" size="0.1 0.1 0.4"/><geom type="mesh" mesh="hull" pos="0 0 5"/><geom type="mesh" mesh="nobody"/><geom type="box" size="no"/>"#;
    let asset =
        r#"<compiler meshdir="meshes/"/><asset><mesh name="hull" file="hull.stl" scale="2 2 2"/></asset>"#;
    let reading = read_mjcf(&one_joint(geoms, asset)).unwrap();
    let shapes = link_shapes(&reading.urdf).unwrap();
    let mut extent = Extent::EMPTY;
    for shape in &shapes {
        assert_eq!((shape.link.as_str(), shape.visual), ("b", true));
        extent = shape.shape.extent(shape.placement).map_or(extent, |own| extent.with(own));
    }
    for (found, expected) in
        extent.lower.into_iter().chain(extent.upper).zip([-0.1, -0.1, -2.05, 1.1, 1.2, 1.3])
    {
        assert!((found - expected).abs() < 1e-12, "{extent:?}");
    }
    assert!(reading.urdf.contains(r#"<mesh filename="meshes/hull.stl" scale="2 2 2"/>"#), "{}", reading.urdf);
    assert_eq!(shapes.len(), 7, "a capsule is three");
}
