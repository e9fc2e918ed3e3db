//! The robots in `models/`: their soles fit them, and what a plant needs of them is there.

use crate::plants;

use phiw_dynamics::Placement;
use phiw_zmp::{FeetError, feet_from_toml};
use plants::model;

#[test]
fn every_model_has_limits() {
    for (name, joints) in
        [("planar2", 2), ("scara4", 4), ("puma560", 6), ("arm7", 7), ("upper_body18", 18), ("humanoid30", 30)]
    {
        let tree = model(name, false);
        assert_eq!(tree.joint_count(), joints, "{name}");
        for joint in 0..joints {
            let body = tree.joint(joint);
            let limits = body.limits;
            assert!(
                limits.lower < limits.upper && limits.lower.is_finite() && limits.upper.is_finite(),
                "{name}: {}",
                body.joint
            );
            assert!(limits.velocity > 0.0 && limits.velocity.is_finite(), "{name}: {}", body.joint);
            assert!(limits.effort > 0.0 && limits.effort.is_finite(), "{name}: {}", body.joint);
        }
    }
}

/// The model stands in its zero posture: soles level, all at one height, the centre of mass above their hull.
fn check_standing(name: &str, feet: usize, mass: [f64; 2]) {
    let tree = model(name, true);
    let path = format!("{}/../../models/{name}.support.toml", env!("CARGO_MANIFEST_DIR"));
    let found = feet_from_toml(&std::fs::read_to_string(&path).expect(&path), &tree).unwrap();
    assert_eq!(found.len(), feet, "{name}");
    let mut placements = vec![Placement::identity(); tree.bodies().len()];
    tree.forward_kinematics(&tree.neutral_configuration(), &mut placements).unwrap();
    let corners: Vec<[f64; 3]> = found
        .iter()
        .flat_map(|foot| {
            foot.sole.iter().map(|&corner| placements[foot.body].point(phiw_dynamics::Vec3(corner)).0)
        })
        .collect();
    assert!(corners.iter().all(|corner| (corner[2] - corners[0][2]).abs() < 1e-9), "{name}: {corners:?}");
    let center = tree.center_of_mass(&placements).unwrap().0;
    for axis in 0..2 {
        let (low, high) = corners.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), corner| {
            (low.min(corner[axis]), high.max(corner[axis]))
        });
        assert!(center[axis] > low + 0.02 && center[axis] < high - 0.02, "{name}: {center:?}");
    }
    assert!(center[2] > corners[0][2] + 0.3);
    assert!((mass[0]..mass[1]).contains(&tree.mass()), "{name}: {} kg", tree.mass());
}

#[test]
fn standing_models_stand() {
    check_standing("upper_body18", 1, [50.0, 90.0]);
    check_standing("humanoid30", 2, [50.0, 90.0]);
}

#[test]
fn a_bad_support_file_says_what_is_wrong() {
    let tree = model("upper_body18", true);
    let check = |text: &str, expected: &str| {
        let error = feet_from_toml(text, &tree).unwrap_err();
        assert!(error.to_string().contains(expected), "{error}");
    };
    check("foot = 3", "not a support file");
    check("[[foot]]\nlink = \"base\"\nsole = [[0, 0, 0]]\ncolour = 1", "colour");
    check("[[foot]]\nlink = \"tail\"\nsole = [[0.0, 0.0, 0.0]]", "\"tail\" is none of");
    check("[[foot]]\nlink = \"base\"\nsole = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]", "fewer than three");
    check("[[foot]]\nlink = \"base\"\nsole = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]]", "no area");
    check(
        "[[foot]]\nlink = \"base\"\nsole = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.1]]",
        "not flat",
    );
    let fixed = model("upper_body18", false);
    let text = "[[foot]]\nlink = \"base\"\nsole = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0]]";
    assert!(matches!(feet_from_toml(text, &fixed), Err(FeetError::NoSuchLink { .. })));
}
