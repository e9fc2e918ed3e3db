//! What changes the rigid body itself: a payload, a tilted base, a load picked up on the way; and forces on
//! links.

use super::plant::{Scene, States};
use super::secret::{Form, Secret};
use phiw_dynamics::inertia::Inertia;
use phiw_dynamics::{Mat3, Placement, Tree, Vec3};

/// The rigid body as it is, which is not always as it is declared.
pub struct Loads {
    tree: Tree,
    /// The tree with its load, and when it is held \[s\].
    stepped: Option<(Tree, Vec<[f64; 2]>)>,
}

/// A body held at a link, for 1 kg.
#[derive(Clone, Copy, Debug)]
pub struct HeldBody {
    /// Index of the body that holds it.
    pub body: usize,
    /// Centre of mass in the joint's frame \[m\].
    pub center: [f64; 3],
    /// Radii of gyration \[m\].
    pub radii: [f64; 3],
}

impl HeldBody {
    fn attach(&self, tree: &mut Tree, mass: f64) {
        let [x, y, z] = self.radii.map(|radius| mass * radius * radius);
        let tensor = Mat3([[x, 0.0, 0.0], [0.0, y, 0.0], [0.0, 0.0, z]]);
        let added = Inertia::from_center_of_mass(mass, Vec3(self.center), tensor).parameters();
        let mut parameters = tree.inertial_parameters();
        for (parameter, added) in parameters[10 * self.body..].iter_mut().zip(added) {
            *parameter += added;
        }
        let set = tree.set_inertial_parameters(&parameters);
        debug_assert!(set.is_ok(), "the sizes come from the tree itself");
    }
}

impl Loads {
    /// The rigid body with all loads and tilts among the secrets.
    pub fn new(tree: &Tree, secrets: &[&Secret]) -> Self {
        let mut loads = Loads { tree: tree.clone(), stepped: None };
        for secret in secrets {
            match &secret.form {
                Form::Payload(held) => held.attach(&mut loads.tree, secret.scale),
                Form::Tilt { heading } => loads.tree.gravity = tilted(tree.gravity, *heading, secret.scale),
                Form::LoadStep { held, when } => {
                    let mut loaded = tree.clone();
                    held.attach(&mut loaded, secret.scale);
                    loads.stepped = Some((loaded, when.clone()));
                }
                _ => {}
            }
        }
        loads
    }

    /// The rigid body at a session time.
    pub fn tree_at(&self, time: f64) -> &Tree {
        match &self.stepped {
            Some((loaded, when)) if when.iter().any(|[from, to]| (*from..*to).contains(&time)) => loaded,
            _ => &self.tree,
        }
    }
}

/// Gravity turned by an angle about a horizontal axis of the given heading (Rodrigues).
fn tilted(gravity: [f64; 3], heading: f64, angle: f64) -> [f64; 3] {
    let axis = Vec3([heading.cos(), heading.sin(), 0.0]);
    let (gravity, (sine, cosine)) = (Vec3(gravity), angle.sin_cos());
    (gravity.scale(cosine) + axis.cross(gravity).scale(sine) + axis.scale(axis.dot(gravity) * (1.0 - cosine)))
        .0
}

/// A force that keeps its direction in the world, on a point of a link.
#[derive(Clone, Copy, Debug)]
pub struct WorldForce {
    /// Index of the body.
    pub body: usize,
    /// The point, in the joint's frame \[m\].
    pub point: [f64; 3],
    /// Unit vector in the world.
    pub direction: [f64; 3],
}

impl WorldForce {
    /// Adds what the joints must deliver against the force: −Jᵀf.
    pub fn add_torque(&self, scene: &Scene, force: f64, torque: &mut [f64]) {
        self.add_torque_along(scene.tree, &scene.link, |_| force, torque);
    }

    /// The same of a force that is another in each sample of `states`.
    pub fn add_torque_along(
        &self,
        tree: &Tree,
        states: &States,
        force: impl Fn(usize) -> f64,
        torque: &mut [f64],
    ) {
        let joints = tree.joint_count();
        let mut placements = vec![Placement::identity(); tree.bodies().len()];
        let mut jacobian = vec![0.0; 6 * joints];
        for (sample, torque) in torque.chunks_exact_mut(joints).enumerate() {
            let force = force(sample);
            if force == 0.0 {
                continue;
            }
            let [q, ..] = states.at(sample);
            let placed = tree.forward_kinematics(q, &mut placements);
            let moved = tree.point_jacobian(&placements, self.body, Vec3(self.point), &mut jacobian);
            debug_assert!(placed.is_ok() && moved.is_ok(), "the sizes come from the tree itself");
            for (joint, torque) in torque.iter_mut().enumerate() {
                let along: f64 = (0..3).map(|row| jacobian[row * joints + joint] * self.direction[row]).sum();
                *torque -= force * along;
            }
        }
    }
}
