//! Steps in empty space. How accurate they are is the backend's own, so some limits are the caller's.

use crate::contract::state_of;
use crate::measured::{largest_difference, worse};
use crate::motion::{Controller, Swing, Target};
use crate::{Builder, Failure, Measured};
use phiw_dynamics::dense::dot;
use phiw_dynamics::random_tree::{RandomNumbers, RandomState, random_state};
use phiw_dynamics::{
    AnalyticBackend, DimensionError, DynamicsBackend, Placement, SimulationBackend, Tree, Workspace, World,
};

/// Joints under PD control and gravity compensation, on a smooth motion of 5 s, against the same with a
/// `reference` backend.
///
/// The closed loop forgets small errors, so that both can be compared over seconds, which a free swing is too
/// chaotic for. For a fixed base. `dt` \[s\] is the step and the controller's period.
///
/// # Errors
/// The largest difference of a joint's position is above `limit` \[rad, m\].
pub fn tracking_difference(
    build: &Builder,
    reference: &Builder,
    tree: &Tree,
    dt: f64,
    limit: f64,
) -> Result<Measured, Failure> {
    let track = |build: &Builder| -> Result<Vec<Vec<f64>>, Failure> {
        let mut backend = build(tree, &World::default())?;
        let (swing, mut controller) = (Swing::new(tree), Controller::new(tree));
        backend.set_state(&swing.at(0.0).q, &vec![0.0; tree.velocity_size()])?;
        (0..(5.0 / dt).round() as usize)
            .map(|step| {
                let (q, v) = state_of(backend.as_ref())?;
                backend.step(controller.pull(&q, &v, &swing.at(step as f64 * dt))?, dt)?;
                Ok(q)
            })
            .collect()
    };
    let (found, expected) = (track(build)?, track(reference)?);
    let largest = found
        .iter()
        .zip(&expected)
        .fold(0.0, |largest, (found, expected)| worse(largest, largest_difference(found, expected)));
    Measured::check("closed-loop motion against the reference", largest, limit, "rad or m")
}

/// A free swing from a pose at random without friction: the largest change of the energy over the largest
/// kinetic energy.
///
/// # Errors
/// It is above `limit`.
pub fn energy_drift(
    build: &Builder,
    tree: &Tree,
    dt: f64,
    duration: f64,
    limit: f64,
) -> Result<Measured, Failure> {
    let mut backend = build(tree, &World::default())?;
    let RandomState { q, .. } = random_state(tree, &mut RandomNumbers::new(8));
    backend.set_state(&q, &vec![0.0; tree.velocity_size()])?;
    let torque = vec![0.0; tree.joint_count()];
    let [_, start] = energies(tree, backend.as_ref())?; // at rest
    let (mut drift, mut most_kinetic) = (0.0, 1e-12);
    for _ in 0..(duration / dt).round() as usize {
        backend.step(&torque, dt)?;
        let [kinetic, potential] = energies(tree, backend.as_ref())?;
        drift = worse(drift, (kinetic + potential - start).abs());
        most_kinetic = worse(most_kinetic, kinetic);
    }
    Measured::check("energy drift of a free swing over its kinetic energy", drift / most_kinetic, limit, "")
}

/// A floating robot without a floor: its centre of mass falls like a stone for 0.4 s, whatever its joints do.
///
/// # Errors
/// The centre of mass is off by more than `limit` \[m\].
pub fn falls_freely(build: &Builder, tree: &Tree, dt: f64, limit: f64) -> Result<Measured, Failure> {
    let mut backend = build(tree, &World::default())?;
    let RandomState { q, v, .. } = random_state(tree, &mut RandomNumbers::new(9));
    backend.set_state(&q, &v)?;
    let (start, velocity) = center_of_mass(tree, &q, &v)?;
    let steps = (0.4 / dt).round() as usize;
    for _ in 0..steps {
        backend.step(&vec![0.0; tree.joint_count()], dt)?;
    }
    let time = steps as f64 * dt;
    let expected: Vec<f64> = (0..3)
        .map(|axis| start[axis] + velocity[axis] * time + 0.5 * tree.gravity[axis] * time * time)
        .collect();
    let (q, v) = state_of(backend.as_ref())?;
    let (end, _) = center_of_mass(tree, &q, &v)?;
    let difference = largest_difference(&end, &expected);
    Measured::check("centre of mass of a falling robot", difference, limit, "m")
}

/// After a short step the base wrench is that of Newton and Euler for the motion that the step made.
///
/// # Errors
/// The largest difference, over the largest component or the weight, is above 1e-3.
pub fn base_wrench_of_a_step(build: &Builder, tree: &Tree) -> Result<Measured, Failure> {
    const DT: f64 = 1e-6;
    let mut backend = build(tree, &World::default())?;
    let mut analytic = AnalyticBackend::new(tree.clone());
    let random = &mut RandomNumbers::new(10);
    let mut largest = 0.0;
    for _ in 0..20 {
        let RandomState { q, v, a } = random_state(tree, random);
        let mut force = vec![0.0; v.len()];
        analytic.inverse_dynamics(&q, &v, &a, &mut force)?;
        backend.set_state(&q, &v)?;
        backend.step(&force[v.len() - tree.joint_count()..], DT)?;
        let (_, after) = state_of(backend.as_ref())?;
        let moved: Vec<f64> = after.iter().zip(&v).map(|(after, v)| (after - v) / DT).collect();
        analytic.inverse_dynamics(&q, &v, &moved, &mut force)?;
        let weight = tree.mass() * 9.81;
        let scale = analytic.base_wrench().iter().fold(weight, |largest, x| largest.max(x.abs()));
        largest = worse(largest, largest_difference(&backend.base_wrench(), &analytic.base_wrench()) / scale);
    }
    Measured::check("base wrench of a step against the motion's", largest, 1e-3, "")
}

/// With [`World::position_limits`], a joint that is pulled against its upper limit for half a second stops
/// there; one joint after the other, on a fixed base.
///
/// # Errors
/// A joint is beyond its limit by more than 0.02 rad or m, or has not come to it within as much; no joint has
/// a limit.
pub fn position_limits_hold(build: &Builder, tree: &Tree) -> Result<Measured, Failure> {
    let mut backend = build(tree, &World { position_limits: true, ..World::default() })?;
    let mut controller = Controller::new(tree);
    let middle = Swing::new(tree).at(0.0).q;
    let mut largest = f64::NAN;
    for joint in (0..tree.joint_count()).filter(|joint| tree.joint(*joint).limits.upper.is_finite()) {
        let upper = tree.joint(joint).limits.upper;
        let mut start = middle.clone();
        start[joint] = start[joint].max(upper - 0.2);
        let mut target = Target::still(start.clone());
        target.q[joint] = upper + 0.1;
        backend.set_state(&start, &vec![0.0; tree.velocity_size()])?;
        let mut beyond = 0.0;
        for _ in 0..500 {
            let (q, v) = state_of(backend.as_ref())?;
            backend.step(controller.pull(&q, &v, &target)?, 1e-3)?;
            beyond = worse(beyond, q[joint] - upper);
        }
        let (q, _) = state_of(backend.as_ref())?;
        largest = largest.max(worse(beyond, (q[joint] - upper).abs()));
    }
    // Not a number if there was no limit.
    Measured::check("distance from the position limit", largest, 0.02, "rad or m")
}

/// Kinetic and potential energy \[J\].
fn energies(tree: &Tree, backend: &dyn SimulationBackend) -> Result<[f64; 2], Failure> {
    let (q, v) = state_of(backend)?;
    let mut mass = vec![0.0; v.len() * v.len()];
    tree.mass_matrix(&q, &mut Workspace::new(tree), &mut mass)?;
    let momentum = mass.chunks_exact(v.len()).map(|row| dot(row, &v));
    let kinetic = 0.5 * momentum.zip(&v).map(|(p, v)| p * v).sum::<f64>();
    let (center, _) = center_of_mass(tree, &q, &v)?;
    Ok([kinetic, -tree.mass() * dot(&center, &tree.gravity)])
}

/// Position and velocity of the centre of mass.
pub(crate) fn center_of_mass(
    tree: &Tree,
    q: &[f64],
    v: &[f64],
) -> Result<([f64; 3], Vec<f64>), DimensionError> {
    let mut placements = vec![Placement::identity(); tree.bodies().len()];
    tree.forward_kinematics(q, &mut placements)?;
    let mut jacobian = vec![0.0; 3 * v.len()];
    tree.center_of_mass_jacobian(&placements, &mut jacobian)?;
    let velocity = jacobian.chunks_exact(v.len()).map(|row| dot(row, v)).collect();
    Ok((tree.center_of_mass(&placements)?.0, velocity))
}
