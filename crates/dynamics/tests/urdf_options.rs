//! Joints held by patterns of their names, and right angles made exact.

use phiw_dynamics::urdf::{UrdfOptions, UrdfReading, held_joints, read_urdf};

/// A chain of joints, each with what stands inside its element.
fn chain(joints: &[(&str, &str)]) -> String {
    let mass =
        "<inertial><mass value='1'/><inertia ixx='1' iyy='1' izz='1' ixy='0' ixz='0' iyz='0'/></inertial>";
    let link = |index: usize| format!("<link name='link_{index}'>{mass}</link>");
    let joint = |(index, (name, content)): (usize, &(&str, &str))| {
        let kind = if content.contains("fixed") { "fixed" } else { "continuous" };
        format!(
            "<joint name='{name}' type='{kind}'><parent link='link_{index}'/><child link='link_{}'/>{content}</joint>",
            index + 1
        )
    };
    let links: String = (0..=joints.len()).map(link).collect();
    let joints: String = joints.iter().enumerate().map(joint).collect();
    format!("<robot name='r'>{links}{joints}</robot>")
}

fn read(xml: &str, held: &[(&str, f64)], snap: bool) -> Result<UrdfReading, String> {
    let held = held.iter().map(|&(name, at)| (name.to_owned(), at)).collect();
    read_urdf(xml, &UrdfOptions { held, snap, ..UrdfOptions::default() }).map_err(|error| error.to_string())
}

const LEGS: [(&str, &str); 5] = [
    ("left_hip", ""),
    ("left_knee", ""),
    ("left_toe", "<mimic joint='left_knee' multiplier='2' offset='0.1'/>"),
    ("left_flange", "<!-- fixed -->"),
    ("right_hip", ""),
];

/// Names of the joints that still move, or the message.
fn check(held: &[(&str, f64)], expected: Result<&[&str], &str>) {
    let xml = chain(&LEGS);
    match (read(&xml, held, false), expected) {
        (Ok(reading), Ok(moving)) => assert_eq!(reading.tree.joint_names().collect::<Vec<_>>(), moving),
        (Err(message), Err(part)) => assert!(message.contains(part), "{message}"),
        (read, expected) => panic!("{held:?}: {:?}, not {expected:?}", read.map(|reading| reading.held)),
    }
}

#[test]
fn joints_are_held_by_patterns_of_their_names() {
    check(&[("left_*", 0.2)], Ok(&["right_hip"]));
    check(&[("*_hip", 0.0)], Ok(&["left_knee"]));
    check(&[("?ight_hip", 0.0)], Ok(&["left_hip", "left_knee"]));
    check(&[("left_*", 0.2), ("left_hip", 0.2)], Ok(&["right_hip"]));
    check(&[("left_*", 0.2), ("left_hip", 0.3)], Err("hold the joint `left_hip` at 0.2 and at 0.3"));
    check(&[("left_hip", 0.2), ("left_hip", 0.3)], Err("name it once"));
    check(&[("arm_*", 0.0)], Err("cannot hold `arm_*`: no joint that moves by itself is called so"));
    // What is fixed or follows another joint needs not be held.
    check(&[("*_toe", 0.0)], Err("joints are `left_hip`, `left_knee`, `right_hip`"));
    check(&[("*_flange", 0.0)], Err("cannot hold `*_flange`"));
    check(&[("left_hop", 0.0)], Err("did you mean `left_hip`?"));
    check(&[("*", 0.0)], Err("no joint of the URDF moves"));
}

#[test]
fn what_is_held_is_told_by_name() {
    let xml = chain(&LEGS);
    let expected = [("left_hip".to_owned(), 0.2), ("left_knee".to_owned(), 0.2)];
    assert_eq!(read(&xml, &[("left_*", 0.2)], false).unwrap().held, expected);
    assert_eq!(held_joints(&xml, &[("left_*".to_owned(), 0.2)]).unwrap(), expected);
    // A joint is called as it is called, whatever its letters.
    let odd = chain(&[("a*", ""), ("ab", "")]);
    assert_eq!(read(&odd, &[("a*", 0.0)], false).unwrap().held, [("a*".to_owned(), 0.0)]);
}

#[test]
fn right_angles_are_made_exact_where_it_is_asked_for() {
    let origin = |rpy: &str| format!("<origin xyz='0.1 0.2 0.3' rpy='{rpy}'/><axis xyz='0 0 1'/>");
    let axis = |xyz: &str| format!("<axis xyz='{xyz}'/>");
    for (content, snapped, exact) in [
        (origin("1.5708 0 -3.1416"), 2, origin("1.5707963267948966 0 -3.141592653589793")),
        (origin("0.00009 -1.5707 6.2832"), 3, origin("0 -1.5707963267948966 6.283185307179586")),
        // As exact as a double, or nearly so: nothing to be said.
        (origin("1.5707963267948966 0 3.14159265359"), 0, origin("1.5707963267948966 0 3.141592653589793")),
        // A robot's own angles.
        (origin("1.5706 0.0002 0.7854"), 0, origin("1.5706 0.0002 0.7854")),
        (axis("0.00005 0 -1"), 1, axis("0 0 -1")),
        (axis("0 -2 0.0001"), 1, axis("0 -2 0")),
        (axis("0 1 0.0002"), 0, axis("0 1 0.0002")),
        (axis("1 1 0"), 0, axis("1 1 0")),
    ] {
        let (as_written, exact) = (chain(&[("a", ""), ("b", &content)]), chain(&[("a", ""), ("b", &exact)]));
        let reading = read(&as_written, &[], true).unwrap();
        let wanted = read(&exact, &[], false).unwrap();
        assert_eq!(reading.snapped, snapped, "{content}");
        let frame = |reading: &UrdfReading| {
            let body = &reading.tree.bodies()[1];
            (body.origin.rotation.0, body.origin.translation.0, body.axis.0)
        };
        assert_eq!(frame(&reading), frame(&wanted), "{content}");
        assert_eq!(read(&as_written, &[], false).unwrap().snapped, 0);
    }
}
