//! The robot as it is built, which is not always as it is declared: payloads, a base that is not level, other
//! rotors.

use crate::{PlantEffect, PlantError};
use phiw_dynamics::{Inertia, Mat3, PARAMETERS_PER_BODY, Tree, Vec3, World};

/// The tree and the world with all effects that change them. Rotors behind springs are taken out of the world
/// and returned, joint by joint, 0 where there is none.
pub(crate) fn robot_as_built(
    tree: &Tree,
    world: &World,
    effects: &[PlantEffect],
) -> Result<(Tree, World, Vec<f64>), PlantError> {
    let (mut tree, mut world) = (tree.clone(), world.clone());
    let joints = tree.joint_count();
    if world.rotor_inertia.is_empty() {
        world.rotor_inertia = vec![0.0; joints];
    }
    for effect in effects {
        match effect {
            PlantEffect::Payload { body, mass, center, radii } => {
                attach(&mut tree, *body, *mass, *center, *radii)?
            }
            PlantEffect::GravityTilt { heading, angle } => {
                tree.gravity = turned(tree.gravity, *heading, *angle)
            }
            PlantEffect::RotorInertia { joint, inertia } => world.rotor_inertia[*joint] += inertia,
            _ => {}
        }
    }
    let mut motors = vec![0.0; joints];
    for effect in effects {
        if let PlantEffect::Flexibility { joint, .. } = effect {
            let name = || tree.joint(*joint).joint.clone();
            if motors[*joint] > 0.0 {
                return Err(PlantError::TwiceFlexible { joint: name() });
            }
            motors[*joint] = std::mem::take(&mut world.rotor_inertia[*joint]);
            if motors[*joint] <= 0.0 {
                return Err(PlantError::FlexibleWithoutRotor { joint: name() });
            }
        }
    }
    if world.rotor_inertia.iter().all(|&inertia| inertia == 0.0) {
        world.rotor_inertia.clear();
    }
    Ok((tree, world, motors))
}

fn attach(
    tree: &mut Tree,
    body: usize,
    mass: f64,
    center: [f64; 3],
    radii: [f64; 3],
) -> Result<(), PlantError> {
    let [x, y, z] = radii.map(|radius| mass * radius * radius);
    let tensor = Mat3([[x, 0.0, 0.0], [0.0, y, 0.0], [0.0, 0.0, z]]);
    let added = Inertia::from_center_of_mass(mass, Vec3(center), tensor).parameters();
    let mut parameters = tree.inertial_parameters();
    for (parameter, added) in parameters[PARAMETERS_PER_BODY * body..].iter_mut().zip(added) {
        *parameter += added;
    }
    Ok(tree.set_inertial_parameters(&parameters)?)
}

/// Gravity turned about a level axis (Rodrigues).
fn turned(gravity: [f64; 3], heading: f64, angle: f64) -> [f64; 3] {
    let axis = Vec3([heading.cos(), heading.sin(), 0.0]);
    let (gravity, (sine, cosine)) = (Vec3(gravity), angle.sin_cos());
    (gravity.scale(cosine) + axis.cross(gravity).scale(sine) + axis.scale(axis.dot(gravity) * (1.0 - cosine)))
        .0
}
