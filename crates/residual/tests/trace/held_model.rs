//! What has changed since a model was identified.

use super::robot::{DECLARED, State, URDF, folds, named, traced_on};
use phiw_dynamics::Workspace;
use phiw_dynamics::urdf::{UrdfOptions, read_urdf};
use std::cell::RefCell;

/// The shoulder's rotor cannot be told from its link's inertia, so the held model has the one and not the
/// other; the one that it has not must not take up the inertia of what the arm holds.
#[test]
fn a_payload_is_found_beside_a_rotor_that_was_not_determined() {
    let declared = ["viscous_friction", "coulomb_friction", "rotor_inertia"];
    let tree = read_urdf(URDF, &UrdfOptions::default()).unwrap().tree;
    let with = {
        let mut with = tree.clone();
        let mut parameters = tree.inertial_parameters();
        // 1 kg at 0.25 m on the lower link.
        for (place, value) in [(10, 1.0), (11, 0.25), (16, 0.0625), (19, 0.0625)] {
            parameters[place] += value;
        }
        with.set_inertial_parameters(&parameters).unwrap();
        with
    };
    let mut workspace = Workspace::new(&tree);
    let workspace = RefCell::new(&mut workspace);
    let payload = |state: &State<'_>, torque: &mut [f64]| {
        let mut loaded = [0.0; 2];
        with.inverse_dynamics(state.q, state.qd, state.qdd, &mut workspace.borrow_mut(), &mut loaded)
            .unwrap();
        let mut bare = [0.0; 2];
        tree.inverse_dynamics(state.q, state.qd, state.qdd, &mut workspace.borrow_mut(), &mut bare).unwrap();
        (0..2).for_each(|joint| torque[joint] += loaded[joint] - bare[joint]);
    };
    let tracing = traced_on(folds().0, &declared, 11, &payload, true);
    assert_eq!(named(&tracing), [("payload".to_owned(), vec!["elbow".to_owned()])]);
    let place = tracing.model.design.effects().len() - 1;
    let mass = tracing.model.fit.parameters[tracing.model.design.effect_parameters(place).start];
    assert!((mass - 1.0).abs() < 0.1, "{mass} kg");
}

/// Once an effect that grew has been found beside a held model, it is no candidate again.
#[test]
fn a_friction_that_grew_is_named_once() {
    let grown = |state: &State<'_>, torque: &mut [f64]| torque[1] += 0.5 * state.qd[1];
    let tracing = traced_on(folds().0, &DECLARED, 11, &grown, true);
    assert_eq!(named(&tracing), [("viscous_friction".to_owned(), vec!["elbow".to_owned()])]);
}

/// A gain scales all of the torque, friction included. Beside a held model nothing else can take up the
/// friction's part, which was once named a friction of its own.
#[test]
fn a_gain_scales_the_held_friction_too() {
    let gain = |_: &State<'_>, torque: &mut [f64]| torque[1] *= 1.15;
    let tracing = traced_on(folds().0, &DECLARED, 11, &gain, true);
    assert_eq!(named(&tracing), [("torque_gain".to_owned(), vec!["elbow".to_owned()])]);
}
