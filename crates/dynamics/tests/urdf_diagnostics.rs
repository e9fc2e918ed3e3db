//! What is wrong with a URDF is said: findings where it can be read, an error where it cannot.

use phiw_dynamics::urdf::{UrdfOptions, UrdfReading, read_urdf, read_urdf_file};

const SOLID: &str =
    "<inertial><mass value='2'/><inertia ixx='1' ixy='0' ixz='0' iyy='1' iyz='0' izz='1'/></inertial>";
const LIMIT: &str = "<limit lower='-1' upper='1' effort='5' velocity='2'/>";

fn link(name: &str, content: &str) -> String {
    format!("<link name='{name}'>{content}</link>")
}

fn joint(name: &str, kind: &str, parent: &str, child: &str, content: &str) -> String {
    format!(
        "<joint name='{name}' type='{kind}'><parent link='{parent}'/><child link='{child}'/>{content}</joint>"
    )
}

/// A robot of one revolute joint: link contents, joint contents.
fn single(arm: &str, pivot: &str) -> String {
    link("base", "") + &link("arm", arm) + &joint("pivot", "revolute", "base", "arm", pivot)
}

/// Two slides in a row, the second with this content.
fn pair(second: &str) -> String {
    single(SOLID, LIMIT)
        + &link("hand", SOLID)
        + &joint("wrist", "prismatic", "arm", "hand", &(LIMIT.to_owned() + second))
}

fn held(names: &[(&str, f64)]) -> UrdfOptions {
    UrdfOptions {
        held: names.iter().map(|&(name, at)| (name.to_owned(), at)).collect(),
        ..UrdfOptions::default()
    }
}

fn read(content: &str, options: &UrdfOptions) -> Result<UrdfReading, String> {
    read_urdf(&format!("<robot name='r'>{content}</robot>"), options).map_err(|error| error.to_string())
}

/// The URDF is read, with just these findings (each contains the text given for it).
#[track_caller]
fn finds(content: &str, expected: &[&str]) -> UrdfReading {
    let reading = read(content, &UrdfOptions::default()).unwrap();
    let found: Vec<String> = reading.findings.iter().map(ToString::to_string).collect();
    assert_eq!(found.len(), expected.len(), "{found:#?}");
    for (found, expected) in found.iter().zip(expected) {
        assert!(found.contains(expected), "`{found}` does not contain `{expected}`");
    }
    reading
}

/// The URDF is refused with a message that contains this.
#[track_caller]
fn refuses(content: &str, options: &UrdfOptions, expected: &str) {
    let message = read(content, options).unwrap_err();
    assert!(message.contains(expected), "`{message}` does not contain `{expected}`");
}

#[track_caller]
fn refuses_text(xml: &str, expected: &str) {
    let message = read_urdf(xml, &UrdfOptions::default()).unwrap_err().to_string();
    assert!(message.contains(expected), "`{message}` does not contain `{expected}`");
}

#[test]
fn sound_robots_have_no_findings() {
    finds(&single(SOLID, LIMIT), &[]);
    finds(&(single(SOLID, LIMIT) + &link("tool", "") + &joint("mount", "fixed", "arm", "tool", "")), &[]);
}

#[test]
fn masses() {
    finds(&single("", LIMIT), &["no moving link has an <inertial> with mass"]);
    finds(
        &single(
            "<inertial><mass value='0'/><inertia ixx='0' ixy='0' ixz='0' iyy='0' iyz='0' izz='0'/></inertial>",
            LIMIT,
        ),
        &["no moving link has", "link `arm`: its mass is zero"],
    );
    finds(
        &single(&SOLID.replace("value='2'", "value='-2'"), LIMIT),
        &["link `arm`: its mass is negative (-2 kg)"],
    );
    let massless_end = pair("").replacen(&link("hand", SOLID), &link("hand", ""), 1);
    finds(&massless_end, &["joint `wrist` moves link `hand`, and nothing behind it has mass"]);
    let massless_middle = pair("").replacen(&link("arm", SOLID), &link("arm", ""), 1);
    finds(&massless_middle, &["joint `pivot` moves link `arm`, which has no mass of its own"]);
    let carried = massless_end + &link("tool", SOLID) + &joint("mount", "fixed", "hand", "tool", "");
    finds(&carried, &[]);
}

#[test]
fn inertias() {
    let tensor = |values: [f64; 6]| {
        let [xx, xy, xz, yy, yz, zz] = values;
        single(
            &format!(
                "<inertial><mass value='2'/><inertia ixx='{xx}' ixy='{xy}' ixz='{xz}' iyy='{yy}' iyz='{yz}' izz='{zz}'/></inertial>"
            ),
            LIMIT,
        )
    };
    finds(&tensor([0.0; 6]), &["link `arm`: 2 kg but no rotational inertia"]);
    finds(&tensor([1.0, 0.0, 0.0, 1.0, 0.0, -0.5]), &["negative principal moment -5.000e-1"]);
    finds(&tensor([1.0, 2.0, 0.0, 1.0, 0.0, 3.0]), &["negative principal moment -1.000e0"]);
    finds(&tensor([1.0, 0.0, 0.0, 1.0, 0.0, 2.5]), &["principal moment 2.500e0 kg·m² exceeds the sum"]);
    // A thin plate is at the edge, and the file's rounding puts it over.
    finds(&tensor([1.0, 0.0, 0.0, 1.0, 0.0, 2.000001]), &[]);
    finds(
        &single("<inertial><mass value='2'/></inertial>", LIMIT),
        &["lacks inertia", "no rotational inertia"],
    );
    let partial = "<inertial><mass value='2'/><inertia ixx='1' iyy='1' izz='1'/></inertial>";
    finds(&single(partial, LIMIT), &["link `arm`: <inertial> lacks ixy, ixz, iyz: taken as zero"]);
    finds(
        &single("<inertial/>", LIMIT),
        &["no moving link has", "link `arm`: <inertial> lacks mass, inertia", "link `arm`: its mass is zero"],
    );
}

#[test]
fn limits() {
    let limits = |reading: UrdfReading| reading.tree.joint(0).limits;
    let all =
        limits(finds(&single(SOLID, ""), &["joint `pivot`: no limit for lower, upper, velocity, effort"]));
    assert_eq!(
        (all.lower, all.upper, all.velocity, all.effort),
        (-f64::INFINITY, f64::INFINITY, f64::INFINITY, f64::INFINITY)
    );
    let some =
        limits(finds(&single(SOLID, "<limit lower='-1' upper='1' effort='5'/>"), &["no limit for velocity"]));
    assert_eq!((some.lower, some.velocity, some.effort), (-1.0, f64::INFINITY, 5.0));
    // URDF: a single bound that is left out is zero.
    let one = limits(finds(&single(SOLID, "<limit upper='1' effort='5' velocity='2'/>"), &[]));
    assert_eq!((one.lower, one.upper), (0.0, 1.0));
    finds(
        &single(SOLID, "<limit lower='-1' upper='1' effort='0' velocity='0'/>"),
        &["no limit for velocity, effort"],
    );
    let swapped = limits(finds(
        &single(SOLID, "<limit lower='1' upper='-2' effort='5' velocity='2'/>"),
        &["joint `pivot`: its lower limit 1 is above its upper limit -2: swapped"],
    ));
    assert_eq!((swapped.lower, swapped.upper), (-2.0, 1.0));
    finds(&single(SOLID, "<limit lower='1' upper='1' effort='5' velocity='2'/>"), &["both limits are 1"]);
    finds(&single(SOLID, "").replace("revolute", "continuous"), &[]);
}

#[test]
fn axes() {
    let reading = finds(&single(SOLID, &format!("{LIMIT}<axis xyz='0 3 -4'/>")), &["its axis has length 5"]);
    assert_eq!(reading.tree.joint(0).axis.0, [0.0, 0.6, -0.8]);
    let reading =
        finds(&single(SOLID, &format!("{LIMIT}<axis xyz='0 0 1e-200'/>")), &["its axis has length"]);
    assert_eq!(reading.tree.joint(0).axis.0, [0.0, 0.0, 1.0]);
    refuses(
        &single(SOLID, "<axis xyz='0 0 0'/>"),
        &UrdfOptions::default(),
        "the axis of joint `pivot` is zero",
    );
}

#[test]
fn mimics() {
    let follower = "<mimic joint='pivot' multiplier='2' offset='0.5'/>";
    let tree = finds(&pair(follower), &["joint `wrist` follows `pivot` (ratio 2, offset 0.5)"]).tree;
    let body = &tree.bodies()[1];
    assert_eq!((body.velocity_index, body.ratio, body.offset, body.mimic), (0, 2.0, 0.5, true));
    assert_eq!((tree.joint_count(), tree.velocity_size()), (1, 1));

    // thumb = −3·wrist + 1 = −3·(2·pivot + 0.5) + 1, and the chain's first follower comes first in the file.
    let chain = joint(
        "thumb",
        "revolute",
        "hand",
        "tip",
        &format!("{LIMIT}<mimic joint='wrist' multiplier='-3' offset='1'/>"),
    ) + &link("tip", SOLID)
        + &pair(follower);
    let thumb =
        finds(&chain, &["`wrist` follows `pivot`", "`thumb` follows `pivot`"]).tree.bodies()[2].clone();
    assert_eq!((thumb.ratio, thumb.offset, thumb.velocity_index), (-6.0, -0.5, 0));

    let none = UrdfOptions::default();
    // Two multipliers that are numbers, and a product that is none.
    let steep =
        chain.replace("multiplier='-3'", "multiplier='1e40'").replace("multiplier='2'", "multiplier='1e40'");
    refuses(&steep, &none, "joint `thumb`: what the chain of its mimics multiplies up to is not");
    finds(&pair("<mimic joint='pivot' multiplier='0' offset='0.2'/>"), &["taken as fixed at 0.2"]);
    refuses(
        &pair("<mimic joint='pivott'/>"),
        &none,
        "mimics `pivott`, but the URDF has no joint of that name; did you mean `pivot`?",
    );
    refuses(&pair("<mimic joint='wrist'/>"), &none, "mimics itself");
    refuses(&pair(follower), &held(&[("pivot", 0.0)]), "no joint of the URDF moves");
}

#[test]
fn held_joints() {
    let reading = read(&pair(""), &held(&[("pivot", std::f64::consts::FRAC_PI_2)])).unwrap();
    let [body] = reading.tree.bodies() else { panic!("one body") };
    assert_eq!((body.joint.as_str(), body.parent), ("wrist", None));
    refuses(
        &pair(""),
        &held(&[("wirst", 0.0)]),
        "cannot hold the joint `wirst`: the URDF has no joint of that name; did you mean `wrist`?",
    );
    refuses(&pair(""), &held(&[("zzz", 0.0)]), "has no joint of that name");
    refuses(
        &pair(""),
        &held(&[("wrist", f64::NAN)]),
        "joint `wrist`: the held position is not a finite number",
    );
    refuses(&pair(""), &held(&[("pivot", 0.0), ("wrist", 0.0)]), "no joint of the URDF moves");

    // The leader is held at 0.3: the follower is fixed at 2·0.3 + 0.5.
    let led = pair("<mimic joint='pivot' multiplier='2' offset='0.5'/>")
        + &link("tool", SOLID)
        + &joint("turn", "continuous", "hand", "tool", "");
    let reading = read(&led, &held(&[("pivot", 0.3)])).unwrap();
    assert_eq!(
        reading.findings[0].to_string(),
        "joint `wrist` follows a joint that does not move: taken as fixed at 1.1"
    );
    assert_eq!(reading.tree.joint_names().collect::<Vec<_>>(), ["turn"]);
}

#[test]
fn floating_bases() {
    let robot = link("world", "") + &joint("free", "floating", "world", "base", "") + &pair("");
    let tree = read(&robot, &UrdfOptions::default()).unwrap().tree;
    assert_eq!((tree.bodies()[0].joint.as_str(), tree.bodies()[0].link.as_str()), ("floating_base", "base"));
    assert_eq!((tree.velocity_size(), tree.configuration_size(), tree.joint_count()), (8, 9, 2));
    assert_eq!(read(&robot, &held(&[("free", 0.0)])).unwrap().tree.velocity_size(), 2);
    let inside = pair("").replace("prismatic", "floating");
    refuses(
        &inside,
        &UrdfOptions::default(),
        "joint `wrist` is floating but not the only joint of the root link",
    );
}

#[test]
fn structure() {
    let none = UrdfOptions::default();
    refuses("", &none, "the URDF has no link");
    refuses(&link("base", ""), &none, "no joint of the URDF moves");
    refuses(
        &(single(SOLID, LIMIT) + &link("lost", "")),
        &none,
        "several links have no parent (`base`, `lost`)",
    );
    refuses(&(single(SOLID, LIMIT) + &link("arm", "")), &none, "two links are called `arm`");
    refuses(
        &(link("a", "")
            + &link("b", "")
            + &joint("ab", "revolute", "a", "b", "")
            + &joint("ba", "revolute", "b", "a", "")),
        &none,
        "follow each other in a circle",
    );
    let aside = link("x", "")
        + &link("y", "")
        + &joint("xy", "revolute", "x", "y", "")
        + &joint("yx", "revolute", "y", "x", "");
    refuses(&(single(SOLID, LIMIT) + &aside), &none, "no root reaches them: `x`, `y`");
    refuses(
        &(single(SOLID, LIMIT) + &link("other", "") + &joint("second", "revolute", "other", "arm", "")),
        &none,
        "the child of both joint `pivot` and joint `second`",
    );
    refuses(
        &single(SOLID, LIMIT).replace("child link='arm'", "child link='army'"),
        &none,
        "joint `pivot` names the link `army`, which the URDF does not define; did you mean `arm`?",
    );
    refuses(
        &pair("").replace("prismatic", "planar"),
        &none,
        "joint `wrist` is of the type planar, which is not supported: hold it (`--hold wrist`)",
    );
    assert_eq!(
        read(&pair("").replace("prismatic", "planar"), &held(&[("wrist", 0.0)])).unwrap().tree.joint_count(),
        1
    );
    refuses(
        &(pair("") + &joint("wrist", "fixed", "hand", "base", "")),
        &none,
        "two joints are called `wrist`",
    );
}

#[test]
fn numbers() {
    let none = UrdfOptions::default();
    refuses(
        &single(&SOLID.replace("value='2'", "value='nan'"), LIMIT),
        &none,
        "link `arm`: its mass is not a finite number",
    );
    refuses(&single(&SOLID.replace("izz='1'", "izz='inf'"), LIMIT), &none, "link `arm`: its inertia is not");
    refuses(
        &single(SOLID, &format!("{LIMIT}<origin xyz='0 NaN 0'/>")),
        &none,
        "joint `pivot`: its origin is not",
    );
    refuses(&single(SOLID, &LIMIT.replace("'-1'", "'nan'")), &none, "joint `pivot`: its lower limit is not");
    refuses(
        &pair("<mimic joint='pivot' multiplier='inf'/>"),
        &none,
        "joint `wrist`: the multiplier of its mimic is not",
    );
    refuses(
        &single(&SOLID.replace("value='2'", "value='heavy'"), LIMIT),
        &none,
        "line 1, link `arm`: value=\"heavy\" is not a number",
    );
    refuses(
        &single(SOLID, "<axis xyz='0 0'/>"),
        &none,
        "line 1, joint `pivot`: xyz=\"0 0\" is not three numbers",
    );
    refuses(&single(SOLID, "<axis xyz='0 x 0 1'/>"), &none, "xyz=\"0 x 0 1\" is not three numbers");
    refuses(&single(SOLID, "<dynamics damping='${d}'/>"), &none, "damping=\"${d}\" is not a number");
}

#[test]
fn missing_parts() {
    let none = UrdfOptions::default();
    let robot = single(SOLID, LIMIT);
    refuses(
        &robot.replace("<parent link='base'/>", "\n"),
        &none,
        "line 1: joint `pivot` lacks a <parent link=…>",
    );
    refuses(&robot.replace("child link", "child name"), &none, "joint `pivot` lacks a <child link=…>");
    refuses(&robot.replace(" type='revolute'", ""), &none, "joint `pivot` lacks a type");
    refuses(
        &format!("\n{}", robot.replace("joint name='pivot'", "joint")),
        &none,
        "line 2: joint `` lacks a name",
    );
    refuses(
        &robot.replace("revolute", "ball"),
        &none,
        "joint `pivot` is of the type ball, which is not supported: URDF has revolute",
    );
    refuses(
        &format!("\n{}", single(SOLID, "<axis/>")),
        &none,
        "line 2: joint `pivot` lacks the xyz of its <axis>: add it",
    );
    refuses(&single(SOLID, "<mimic/>"), &none, "line 1: joint `pivot` lacks the joint of its <mimic>");
    refuses(&robot.replace("<link name='arm'", "<link"), &none, "line 1: link `` lacks a name");
}

/// Which of two would count is not for the reader to choose.
#[test]
fn a_part_that_is_there_twice_is_refused_with_its_line() {
    let none = UrdfOptions::default();
    let twice = |content: &str| format!("{content}\n{content}");
    refuses(
        &single(&twice(SOLID), LIMIT),
        &none,
        "line 2: link `arm` has a second <inertial>: remove one of them",
    );
    let masses = SOLID.replace("<mass value='2'/>", &twice("<mass value='2'/>"));
    refuses(&single(&masses, LIMIT), &none, "line 2: link `arm` has a second <mass>");
    for part in ["<origin/>", "<axis xyz='1 0 0'/>", LIMIT, "<dynamics/>", "<mimic joint='pivot'/>"] {
        let tag = part[1..].split([' ', '/']).next().unwrap();
        refuses(
            &single(SOLID, &twice(part)),
            &none,
            &format!("line 2: joint `pivot` has a second <{tag}>: remove one of them"),
        );
    }
}

/// The limits went by the joint's name, which two XML readers spelled in two ways.
#[test]
fn a_joint_whose_name_holds_a_line_break_keeps_its_limits() {
    let reading = finds(&single(SOLID, LIMIT).replace("'pivot'", "'pi\nvot'"), &[]);
    assert_eq!(reading.tree.joint(0).joint, "pi vot");
    assert_eq!((reading.tree.joint(0).limits.lower, reading.tree.joint(0).limits.effort), (-1.0, 5.0));
}

/// `version` of the robot, content of a joint: the origin's rotation and the limits.
#[test]
fn versions() {
    let reads = |version: &str, content: &str| {
        let robot = format!("<robot name='r' version='{version}'>{}</robot>", single(SOLID, content));
        let tree = read_urdf(&robot, &UrdfOptions::default()).unwrap().tree;
        let joint = tree.joint(0);
        (joint.origin.rotation.0[1].map(|x| x.round()), joint.limits.lower, joint.limits.upper)
    };
    let content = "<origin quat_xyzw='0 0 1 1'/><limit upper='1'/>";
    assert_eq!(reads("1.0", content), ([0.0, 1.0, 0.0], 0.0, 1.0));
    assert_eq!(reads("1.1", content), ([1.0, 0.0, 0.0], 0.0, 1.0));
    assert_eq!(reads("1.2", content), ([1.0, 0.0, 0.0], -f64::INFINITY, 1.0));
    let refuses_content = |content: &str, expected: &str| {
        let robot = format!("<robot name='r' version='1.1'>{}</robot>", single(SOLID, content));
        refuses_text(&robot, expected);
    };
    refuses_content(
        "<origin rpy='0 0 0' quat_xyzw='0 0 0 1'/>",
        "line 1: an <origin> of joint `pivot` has both rpy and quat_xyzw: remove one of them",
    );
    refuses_content("<origin quat_xyzw='0 0 1'/>", "quat_xyzw=\"0 0 1\" is not four numbers");
    refuses_content("<origin quat_xyzw='0 0 nan 1'/>", "joint `pivot`: its origin is not a finite number");
    refuses_content("<origin quat_xyzw='0 0 1e200 1'/>", "joint `pivot`: its origin is not a finite number");
}

#[test]
fn not_a_urdf() {
    refuses_text("", "not a URDF: it is not XML");
    refuses_text("t,q.joint\n0,1\n", "not a URDF: it is not XML");
    refuses_text("<robot name='r'><link name='a'></robot>", "not a URDF: it is not XML");
    refuses_text("<mujoco/>", "its outermost element is <mujoco>, not <robot>");
    refuses_text(
        "<robot xmlns:xacro='http://www.ros.org/wiki/xacro'><xacro:arm/></robot>",
        "expand it first",
    );
    let error = read_urdf_file("no/such/robot.urdf", &UrdfOptions::default()).unwrap_err().to_string();
    assert!(error.starts_with("cannot read `no/such/robot.urdf`: "), "{error}");
}
