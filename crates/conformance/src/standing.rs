//! A robot that stands on the floor and can topple.

use crate::contract::state_of;
use crate::measured::worse;
use crate::motion::{Controller, Target, smooth_step};
use crate::step::center_of_mass;
use crate::{Builder, Failure, Measured};
use phiw_dynamics::dense::dot;
use phiw_dynamics::inertia::Inertia;
use phiw_dynamics::{AnalyticBackend, DynamicsBackend, Placement, Spatial, Tree, Vec3, World};
use std::f64::consts::TAU;

/// Step of the simulation and period of the controller \[s\].
const DT: f64 = 1e-3;

/// The robot finds its rest on the floor for as long before a motion begins \[s\].
const SETTLING: f64 = 0.5;

/// A tilt of the base beyond this \[rad\] is a fall.
const FALLEN: f64 = 0.3;

/// Time over which a contact force is averaged \[steps\]: the 10 ms at which robots measure theirs.
const WINDOW: usize = 10;

/// One instant of a simulated motion.
struct Instant {
    q: Vec<f64>,
    v: Vec<f64>,
    /// Of the step that begins here.
    wrench: [f64; 6],
}

/// A robot that holds still on its feet for two seconds has its weight as contact force, below its centre of
/// mass.
///
/// # Errors
/// The force is off by more than 1e-3 of the weight, or the measured ZMP by more than 1 mm from the centre of
/// mass's place, or the base tilts by more than 0.01 rad.
pub fn rests_on_its_feet(build: &Builder, tree: &Tree, world: &World) -> Result<Measured, Failure> {
    let home = home(tree);
    let instants = simulate(build, tree, world, SETTLING + 1.5, |_| Target::still(home.clone()))?;
    let late = &instants[instants.len() - 500..];
    let wrench = mean_wrench(late);
    let weight = tree.mass() * dot(&tree.gravity, &tree.gravity).sqrt();
    let tilted = late.iter().fold(0.0, |largest, instant| worse(largest, tilt(&instant.q)));
    Measured::check("tilt of a robot at rest", tilted, 0.01, "rad")?;
    let (center, _) = center_of_mass(tree, &late[0].q, &late[0].v)?;
    let [x, y] = zero_moment_point(wrench);
    let aside = (x - center[0]).hypot(y - center[1]);
    Measured::check("measured ZMP from below the resting centre of mass", aside, 1e-3, "m")?;
    let error = [wrench[0], wrench[1], wrench[2] - weight].iter().fold(0.0, |sum, x| worse(sum, x.abs()));
    Measured::check("contact force of a robot at rest against its weight", error / weight, 1e-3, "")
}

/// While the arms sway, the ZMP measured from the ground's reaction is the one that follows from the momentum
/// of the motion that is seen, over windows of 10 ms: rms over four seconds.
///
/// # Errors
/// It is above 1 mm, or the ZMP did not move by a centimetre so that nothing was tested.
pub fn measured_zmp_is_the_momentums(
    build: &Builder,
    tree: &Tree,
    world: &World,
) -> Result<Measured, Failure> {
    let home = home(tree);
    let sway = |time: f64| {
        let mut target = Target::still(home.clone());
        let [blend, rate, curvature] = smooth_step(time);
        // The waist stays: it would move the ZMP out of the feet.
        for joint in 2..tree.joint_count() {
            let (amplitude, frequency) = (0.3, TAU * (0.5 + 0.1 * (joint % 4) as f64));
            let (sine, cosine) = (frequency * time).sin_cos();
            target.q[joint] += amplitude * blend * sine;
            target.v[joint] = amplitude * (rate * sine + blend * frequency * cosine);
            target.a[joint] = amplitude
                * (curvature * sine + 2.0 * rate * frequency * cosine - blend * frequency * frequency * sine);
        }
        target
    };
    let instants = simulate(build, tree, world, SETTLING + 4.0, sway)?;
    let weight = tree.gravity.map(|g| g * tree.mass());
    let (mut sum, mut count, mut range) = (0.0, 0, [f64::INFINITY, f64::NEG_INFINITY]);
    let moving = &instants[(SETTLING / DT) as usize..];
    for start in (0..moving.len() - WINDOW).step_by(WINDOW) {
        let window = &moving[start..=start + WINDOW];
        let momentum = |instant: &Instant| momentum_about_origin(tree, &instant.q, &instant.v);
        let (before, after) = (momentum(&window[0])?, momentum(&window[WINDOW])?);
        let (center, _) = center_of_mass(tree, &window[WINDOW / 2].q, &window[WINDOW / 2].v)?;
        let pull = Vec3(center).cross(Vec3(weight)).0;
        let mut expected = [0.0; 6];
        for axis in 0..6 {
            let gravity = if axis < 3 { weight[axis] } else { pull[axis - 3] };
            expected[axis] = (after[axis] - before[axis]) / (WINDOW as f64 * DT) - gravity;
        }
        let [x, y] = zero_moment_point(expected);
        let [measured_x, measured_y] = zero_moment_point(mean_wrench(&window[..WINDOW]));
        sum += (measured_x - x).powi(2) + (measured_y - y).powi(2);
        count += 1;
        range = [range[0].min(x), range[1].max(x)];
    }
    if range[1] - range[0] < 0.01 {
        return Err(Failure::Wrong(format!("the ZMP stayed within {range:?} m: the motion is too slow")));
    }
    Measured::check("measured ZMP against the momentum's, rms", (sum / count as f64).sqrt(), 1e-3, "m")
}

/// A bow so fast that its ZMP would lie outside the feet topples the robot.
///
/// # Errors
/// The base did not tilt beyond 0.3 rad within three seconds: what was measured is how much is missing.
pub fn fast_motion_topples(build: &Builder, tree: &Tree, world: &World) -> Result<Measured, Failure> {
    let (planned, tilted) = bow(build, tree, world, 0.35)?;
    let front = front_edge(world);
    if planned <= front {
        return Err(Failure::Wrong(format!("the ZMP of the fast bow, {planned} m, is above the feet")));
    }
    Measured::check("tilt missing to a fall after a fast bow", (FALLEN - tilted).max(0.0), 0.0, "rad")
}

/// The same bow, slowly, leaves it standing.
///
/// # Errors
/// The base tilts by more than 0.01 rad.
pub fn slow_motion_stands(build: &Builder, tree: &Tree, world: &World) -> Result<Measured, Failure> {
    let (planned, tilted) = bow(build, tree, world, 3.0)?;
    let front = front_edge(world);
    if planned >= front {
        return Err(Failure::Wrong(format!("the ZMP of the slow bow, {planned} m, leaves the feet")));
    }
    Measured::check("tilt in a slow bow", tilted, 0.01, "rad")
}

/// Bends the first joint, a waist that pitches, within `duration` \[s\] and waits: the foremost ZMP of the
/// motion as planned \[m\], and the largest tilt of the base \[rad\].
fn bow(build: &Builder, tree: &Tree, world: &World, duration: f64) -> Result<(f64, f64), Failure> {
    let home = home(tree);
    let bend = |time: f64| {
        let [blend, rate, curvature] = smooth_step(time / duration);
        let mut target = Target::still(home.clone());
        let depth = 0.25;
        target.q[0] += depth * blend;
        target.v[0] = depth * rate / duration;
        target.a[0] = depth * curvature / (duration * duration);
        target
    };
    let mut analytic = AnalyticBackend::new(tree.clone());
    let mut planned = f64::NEG_INFINITY;
    for step in 0..(duration / DT) as usize {
        let Target { q, v, a } = bend(step as f64 * DT);
        let upright = tree.neutral_configuration();
        let still = [0.0; 6];
        let mut force = vec![0.0; tree.velocity_size()];
        analytic.inverse_dynamics(
            &[&upright[..7], &q].concat(),
            &[&still[..], &v].concat(),
            &[&still[..], &a].concat(),
            &mut force,
        )?;
        planned = planned.max(zero_moment_point(analytic.base_wrench())[0]);
    }
    let instants = simulate(build, tree, world, SETTLING + duration.max(3.0) + 0.5, bend)?;
    Ok((planned, instants.iter().fold(0.0, |largest, instant| worse(largest, tilt(&instant.q)))))
}

/// Stands on the floor, settles, then follows `motion` from time 0 on; stops when the robot has fallen.
fn simulate(
    build: &Builder,
    tree: &Tree,
    world: &World,
    duration: f64,
    motion: impl Fn(f64) -> Target,
) -> Result<Vec<Instant>, Failure> {
    let mut backend = build(tree, world)?;
    let mut controller = Controller::new(tree);
    let start = [&tree.neutral_configuration()[..7], &motion(0.0).q].concat();
    backend.set_state(&start, &vec![0.0; tree.velocity_size()])?;
    let mut instants = Vec::new();
    for step in 0..(duration / DT).round() as usize {
        let (q, v) = state_of(backend.as_ref())?;
        backend.step(controller.follow(&q, &v, &motion(step as f64 * DT - SETTLING))?, DT)?;
        let fallen = tilt(&q) > FALLEN;
        instants.push(Instant { q, v, wrench: backend.base_wrench() });
        if fallen {
            break;
        }
    }
    Ok(instants)
}

/// All joints at zero, or at the limit next to it.
fn home(tree: &Tree) -> Vec<f64> {
    (0..tree.joint_count())
        .map(|joint| {
            let limits = tree.joint(joint).limits;
            0.0_f64.max(limits.lower).min(limits.upper)
        })
        .collect()
}

/// The point of the floor about which the wrench has no horizontal moment: x and y \[m\].
fn zero_moment_point([_, _, force, moment_x, moment_y, _]: [f64; 6]) -> [f64; 2] {
    [-moment_y / force, moment_x / force]
}

fn mean_wrench(instants: &[Instant]) -> [f64; 6] {
    let mut mean = [0.0; 6];
    for instant in instants {
        for (mean, component) in mean.iter_mut().zip(instant.wrench) {
            *mean += component / instants.len() as f64;
        }
    }
    mean
}

/// Angle between the base's upward axis and the world's \[rad\].
fn tilt(q: &[f64]) -> f64 {
    2.0 * q[3].hypot(q[4]).atan2(q[5].hypot(q[6]))
}

/// The soles' largest x \[m\] on an upright base.
fn front_edge(world: &World) -> f64 {
    world
        .feet
        .iter()
        .flat_map(|foot| &foot.sole)
        .fold(f64::NEG_INFINITY, |front, corner| front.max(corner[0]))
}

/// Linear momentum, and angular momentum about the world's origin.
fn momentum_about_origin(tree: &Tree, q: &[f64], v: &[f64]) -> Result<[f64; 6], Failure> {
    let mut placements = vec![Placement::identity(); tree.bodies().len()];
    tree.forward_kinematics(q, &mut placements)?;
    let mut jacobian = vec![0.0; 6 * v.len()];
    let mut total = Spatial::zero();
    for (index, body) in tree.bodies().iter().enumerate() {
        // The point of the body that passes the world's origin.
        let origin = placements[index].inverse().point(Vec3::zero());
        tree.point_jacobian(&placements, index, origin, &mut jacobian)?;
        let mut velocity = [0.0; 6];
        for (component, row) in velocity.iter_mut().zip(jacobian.chunks_exact(v.len())) {
            *component = dot(row, v);
        }
        let [x, y, z, rx, ry, rz] = velocity;
        let velocity = Spatial { linear: Vec3([x, y, z]), angular: Vec3([rx, ry, rz]) };
        total = total + Inertia::from_parameters(&body.inertial).moved(placements[index]).times(velocity);
    }
    let ([px, py, pz], [lx, ly, lz]) = (total.linear.0, total.angular.0);
    Ok([px, py, pz, lx, ly, lz])
}
