//! The robots of the experiment, from `models/`.

use anyhow::Context;
use phiw_dynamics::Tree;
use phiw_dynamics::urdf::{UrdfOptions, read_urdf};

/// A robot: its URDF, as handed to the tracer, and the tree read from it, which is the truth.
pub struct Robot {
    /// File name without ending.
    pub name: &'static str,
    /// The file's text.
    pub urdf: &'static str,
    /// The truth.
    pub tree: Tree,
}

const MODELS: [(&str, &str); 5] = [
    ("planar2", include_str!("../../../../models/planar2.urdf")),
    ("scara4", include_str!("../../../../models/scara4.urdf")),
    ("puma560", include_str!("../../../../models/puma560.urdf")),
    ("arm7", include_str!("../../../../models/arm7.urdf")),
    ("upper_body18", include_str!("../../../../models/upper_body18.urdf")),
];

/// All robots, small ones first.
pub fn robots() -> anyhow::Result<Vec<Robot>> {
    let read = |(name, urdf)| {
        let reading =
            read_urdf(urdf, &UrdfOptions::default()).with_context(|| format!("models/{name}.urdf"))?;
        Ok(Robot { name, urdf, tree: reading.tree })
    };
    MODELS.into_iter().map(read).collect()
}

impl Robot {
    /// Number of joints.
    pub fn joints(&self) -> usize {
        self.tree.joint_count()
    }

    /// Names of these joints.
    pub fn names(&self, joints: &[usize]) -> Vec<String> {
        joints.iter().map(|&joint| self.tree.joint(joint).joint.clone()).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::robots;
    use phiw_dynamics::random_tree::{RandomNumbers, RandomState, random_state};
    use phiw_dynamics::urdf::{UrdfOptions, read_urdf};
    use phiw_dynamics::{Body, Inertia, Workspace};
    use phiw_regressor::{BaseParameters, BaseParametersOptions};

    /// `irregular`: links whose published inertia is no body's.
    fn check(name: &str, joints: usize, base_parameters: usize, irregular: &[&str]) {
        let robots = robots().expect("the models read");
        let robot = robots.iter().find(|robot| robot.name == name).expect(name);
        let findings = read_urdf(robot.urdf, &UrdfOptions::default()).expect(name).findings;
        assert_eq!(findings.len(), irregular.len(), "{name}: {findings:?}");
        assert_eq!(robot.joints(), joints, "{name}");
        let base = BaseParameters::of_tree(&robot.tree, BaseParametersOptions::default()).expect(name);
        assert_eq!(base.count(), base_parameters, "{name}");
        for body in robot.tree.bodies() {
            let is_physical = Inertia::<f64>::from_parameters(&body.inertial).is_physical();
            assert_eq!(is_physical, !irregular.contains(&body.link.as_str()), "{name}: {}", body.link);
            assert!(
                body.limits.effort.is_finite() && body.limits.velocity.is_finite(),
                "{name}: {}",
                body.joint
            );
        }
    }

    /// The figures measured for the PUMA's link 3 miss the triangle inequality by a tenth, and no torque
    /// tells: what lies along joint 3's axis may as well belong to link 2.
    #[test]
    fn the_pumas_third_link_is_as_good_as_a_body() {
        let robots = robots().expect("the models read");
        let puma = &robots.iter().find(|robot| robot.name == "puma560").expect("puma560").tree;
        let mut moved = puma.inertial_parameters();
        for (link, share) in [(1, -0.004), (2, 0.004)] {
            moved[10 * link + 4] += share; // Ixx
            moved[10 * link + 6] += share; // Iyy
        }
        let mut mended = puma.clone();
        mended.set_inertial_parameters(&moved).expect("sizes fit");
        let is_physical = |body: &Body| Inertia::<f64>::from_parameters(&body.inertial).is_physical();
        assert!(mended.bodies().iter().all(is_physical));
        let (mut rng, mut workspace) = (RandomNumbers::new(1), Workspace::new(puma));
        let [mut as_published, mut as_mended] = [[0.0; 6]; 2];
        for _ in 0..20 {
            let RandomState { q, v, a } = random_state(puma, &mut rng);
            puma.inverse_dynamics(&q, &v, &a, &mut workspace, &mut as_published).expect("sizes fit");
            mended.inverse_dynamics(&q, &v, &a, &mut workspace, &mut as_mended).expect("sizes fit");
            assert!(as_published.iter().zip(&as_mended).all(|(a, b)| (a - b).abs() < 1e-9));
        }
    }

    #[test]
    fn models_read_and_are_physical() {
        check("planar2", 2, 6, &[]);
        check("scara4", 4, 8, &[]);
        check("puma560", 6, 36, &["link_3"]);
        check("arm7", 7, 43, &[]);
        check("upper_body18", 18, 114, &[]);
    }
}
