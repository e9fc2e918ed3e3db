//! What Rapier can not hold is refused by name.

use phiw_dynamics::urdf::{UrdfOptions, read_urdf};
use phiw_dynamics::{BackendError, DynamicsBackend, SimulationBackend, World};
use phiw_sim_rapier::RapierBackend;

const ROUND: &str = r#"ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0""#;
const ROD: &str = r#"ixx="0" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0""#;

/// Two links in a row.
fn backend(mass: f64, inertia: &str) -> Result<RapierBackend, BackendError> {
    let urdf = format!(
        r#"<robot name="arm"><link name="base"/>
          <link name="upper"><inertial><mass value="1"/><inertia {ROUND}/></inertial></link>
          <link name="fore"><inertial><mass value="{mass}"/><inertia {inertia}/></inertial></link>
          <joint name="shoulder" type="continuous"><parent link="base"/><child link="upper"/><axis xyz="0 1 0"/></joint>
          <joint name="elbow" type="continuous"><parent link="upper"/><child link="fore"/><origin xyz="0 0 1"/>
            <axis xyz="0 1 0"/></joint></robot>"#
    );
    RapierBackend::new(&read_urdf(&urdf, &UrdfOptions::default()).unwrap().tree, &World::default())
}

#[test]
fn robots_that_do_not_fit() {
    for (refused, expected) in [
        (backend(1.0, ROD), "moments of inertia of fore are 0.000e0, 1.000e-1 and 1.000e-1"),
        (backend(-1.0, ROUND), "fore has the mass -1 kg"),
    ] {
        let message = refused.err().unwrap().to_string();
        assert!(message.contains(expected), "{message}");
    }
}

#[test]
fn no_solver_iterations() {
    let refused = backend(1.0, ROUND).unwrap().with_solver_iterations(0).err().unwrap();
    assert_eq!(refused.to_string(), "rapier: a step needs at least one solver iteration");
}

/// A last link without mass has inverse dynamics, but no forward dynamics.
#[test]
fn joint_that_moves_nothing() {
    let nothing = r#"ixx="0" iyy="0" izz="0" ixy="0" ixz="0" iyz="0""#;
    let mut backend = backend(0.0, nothing).unwrap();
    let (state, mut force) = ([0.3, -0.2], [0.0; 2]);
    backend.inverse_dynamics(&state, &state, &state, &mut force).unwrap();
    assert!((force[0] - 0.03).abs() < 1e-15 && force[1].abs() < 1e-15, "{force:?}");
    let singular = backend.forward_dynamics(&state, &state, &force.clone(), &mut force);
    assert_eq!(singular, Err(BackendError::Singular));
}

/// The engine stops a motion that has diverged; it must not be taken for rest.
#[test]
fn torque_beyond_numbers() {
    let mut backend = backend(1.0, ROUND).unwrap();
    backend.set_state(&[0.1, 0.2], &[0.3, 0.4]).unwrap();
    assert_eq!(backend.step(&[1e300, 0.0], 1e-3), Err(BackendError::Singular));
    let (mut q, mut v) = ([0.0; 2], [0.0; 2]);
    backend.state(&mut q, &mut v).unwrap();
    assert_eq!((q, v), ([0.1, 0.2], [0.3, 0.4]));
    backend.step(&[0.0, 0.0], 1e-3).unwrap();
}
