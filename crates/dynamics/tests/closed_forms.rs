//! Robots whose equations of motion are in every textbook.

use crate::arbitrary;

use arbitrary::{assert_close, inverse_dynamics};
use phiw_dynamics::Tree;
use phiw_dynamics::urdf::{UrdfOptions, read_urdf};

const G: f64 = 9.81;

fn link(name: &str, mass: f64, center: f64, inertia: f64) -> String {
    format!(
        "<link name=\"{name}\"><inertial><origin xyz=\"{center} 0 0\"/><mass value=\"{mass}\"/>\
         <inertia ixx=\"{inertia}\" ixy=\"0\" ixz=\"0\" iyy=\"{inertia}\" iyz=\"0\" izz=\"{inertia}\"/></inertial></link>"
    )
}

fn joint(name: &str, kind: &str, parent: &str, child: &str, origin: &str, axis: &str) -> String {
    format!(
        "<joint name=\"{name}\" type=\"{kind}\"><parent link=\"{parent}\"/><child link=\"{child}\"/>\
         <origin {origin}/><axis xyz=\"{axis}\"/><limit lower=\"-3\" upper=\"3\" effort=\"1\" velocity=\"1\"/></joint>"
    )
}

fn tree(parts: &[String]) -> Tree {
    let xml = format!("<robot name=\"textbook\"><link name=\"base\"/>{}</robot>", parts.concat());
    read_urdf(&xml, &UrdfOptions::default()).unwrap().tree
}

/// Hanging along x, turning about −y: at q the arm points up by q.
#[test]
fn pendulum() {
    let (mass, length, inertia) = (2.0, 0.7, 0.05);
    let tree = tree(&[
        link("arm", mass, length, inertia),
        joint("pivot", "revolute", "base", "arm", "xyz=\"0 0 1\"", "0 -1 0"),
    ]);
    for (q, v, a) in [(0.0, 0.0, 0.0), (0.4, 1.0, -2.0), (-1.3, 3.0, 5.0)] {
        let expected = (inertia + mass * length * length) * a + mass * G * length * f64::cos(q);
        assert_close(&inverse_dynamics(&tree, &[q], &[v], &[a]), &[expected], 1e-13);
    }
}

/// The planar arm of two links in the vertical plane (Siciliano et al. 2009, § 7.3.2).
#[test]
fn two_link_arm() {
    let ([m1, m2], [l1, c1, c2], [i1, i2]) = ([1.5, 0.8], [0.6, 0.25, 0.3], [0.03, 0.02]);
    let tree = tree(&[
        link("upper", m1, c1, i1),
        link("fore", m2, c2, i2),
        joint("shoulder", "revolute", "base", "upper", "xyz=\"0 0 0\"", "0 -1 0"),
        joint("elbow", "revolute", "upper", "fore", &format!("xyz=\"{l1} 0 0\""), "0 -1 0"),
    ]);
    let (q, v, a) = ([0.3, -0.9], [1.2, -0.7], [2.0, 3.0]);
    let (sine, cosine) = f64::sin_cos(q[1]);
    let b22 = i2 + m2 * c2 * c2;
    let b12 = i2 + m2 * (c2 * c2 + l1 * c2 * cosine);
    let b11 = i1 + m1 * c1 * c1 + i2 + m2 * (l1 * l1 + c2 * c2 + 2.0 * l1 * c2 * cosine);
    let h = -m2 * l1 * c2 * sine;
    let g2 = m2 * G * c2 * f64::cos(q[0] + q[1]);
    let g1 = (m1 * c1 + m2 * l1) * G * f64::cos(q[0]) + g2;
    let expected = [
        b11 * a[0] + b12 * a[1] + h * v[1] * (2.0 * v[0] + v[1]) + g1,
        b12 * a[0] + b22 * a[1] - h * v[0] * v[0] + g2,
    ];
    assert_close(&inverse_dynamics(&tree, &q, &v, &a), &expected, 1e-13);
}

#[test]
fn slide_on_an_incline() {
    let (mass, slope) = (3.0, 0.5_f64);
    let tree = tree(&[
        link("carriage", mass, 0.2, 0.1),
        joint("slide", "prismatic", "base", "carriage", &format!("rpy=\"0 {} 0\"", -slope), "1 0 0"),
    ]);
    let expected = mass * 1.5 + mass * G * slope.sin();
    assert_close(&inverse_dynamics(&tree, &[0.7], &[2.0], &[1.5]), &[expected], 1e-13);
}

/// Two equal fingers, one leading: the leader carries both.
#[test]
fn mimic_doubles_the_load() {
    let (mass, ratio) = (0.4, -2.0);
    let follower = joint("right", "prismatic", "base", "right_finger", "xyz=\"0 0 0\"", "0 0 1").replace(
        "</joint>",
        &format!("<mimic joint=\"left\" multiplier=\"{ratio}\" offset=\"0.1\"/></joint>"),
    );
    // The follower comes first in the file.
    let tree = tree(&[
        link("right_finger", mass, 0.0, 1.0),
        link("left_finger", mass, 0.0, 1.0),
        follower,
        joint("left", "prismatic", "base", "left_finger", "xyz=\"0 0 0\"", "0 0 1"),
    ]);
    assert_eq!(tree.joint_names().collect::<Vec<_>>(), ["left"]);
    let expected = mass * (1.0 + ratio * ratio) * 2.0 + mass * G * (1.0 + ratio);
    assert_close(&inverse_dynamics(&tree, &[0.1], &[0.3], &[2.0]), &[expected], 1e-13);
}
