//! An actuator that clips: the joint is simulated under control, with what is delivered and not with what is
//! commanded.
//!
//! The other joints follow their references exactly (hybrid dynamics), so one equation of motion is
//! integrated. The controller is computed torque with a PD, evaluated at each step of the integration: a
//! sampled controller's hold would be a delay of its own.

use super::case::{even_times, is_simulated};
use super::plant::{Ordinary, States, rigid_torque};
use super::rng::CaseRng;
use super::secret::Secret;
use super::trajectory::{Excess, JointMotion, Trajectory};
use phiw_dynamics::{Tree, Workspace};

/// Step of the integration \[s\].
const STEP: f64 = 1e-3;
/// Share of the time for which the limit is hit.
pub const CLIPPED: [f64; 2] = [0.05, 0.15];
/// Limits and gains tried for one case.
const TRIALS: usize = 10;

/// Finds a limit and gains with which the clipping is as often and as large as asked, and puts the simulated
/// motions in place.
///
/// Returns the size reached; `None` if no trial was fit.
pub fn install(
    secret: &mut Secret,
    wanted: f64,
    tree: &Tree,
    ordinary: &Ordinary,
    motions: &mut [Trajectory],
    rng: &mut CaseRng,
) -> Option<f64> {
    let joint = *secret.joints.first()?;
    if motions.iter().any(is_simulated) {
        return None;
    }
    let mut needed: Vec<f64> = Vec::new();
    for motion in &*motions {
        let states = States::of_motion(motion, &even_times(motion, 50.0));
        let torque = rigid_torque(&states, |_| tree);
        needed.extend((0..states.samples()).map(|sample| {
            let friction = ordinary.coulomb[joint] * ordinary.sign(states.v(sample, joint))
                + ordinary.viscous[joint] * states.v(sample, joint);
            (torque[sample * tree.joint_count() + joint] + friction).abs()
        }));
    }
    needed.sort_by(f64::total_cmp);
    let mut quantile = 0.93_f64;
    for _ in 0..TRIALS {
        secret.scale = needed[((needed.len() - 1) as f64 * quantile) as usize];
        let bandwidth = rng.uniform(6.0, 14.0);
        let simulated: Option<Vec<Trajectory>> = motions
            .iter()
            .map(|motion| simulate(tree, ordinary, motion, joint, secret.scale, bandwidth))
            .collect();
        let Some(simulated) = simulated else {
            quantile = (quantile + 0.02).min(0.995);
            continue;
        };
        let clipped = simulated.iter().map(clipped_share).sum::<f64>() / simulated.len() as f64;
        let times: Vec<Vec<f64>> = simulated.iter().map(|motion| even_times(motion, 100.0)).collect();
        let size = secret.size(tree, ordinary, &simulated, &times);
        if (CLIPPED[0]..=CLIPPED[1]).contains(&clipped)
            && (super::case::SIZES[0]..=super::case::SIZES[1]).contains(&size)
        {
            motions.clone_from_slice(&simulated);
            return Some(size);
        }
        let less = clipped > CLIPPED[1] || size > wanted.max(super::case::SIZES[0]);
        quantile = (quantile + if less { 0.015 } else { -0.02 }).clamp(0.5, 0.995);
    }
    None
}

fn clipped_share(motion: &Trajectory) -> f64 {
    let torque = motion.excess.as_ref().map_or(&[][..], |excess| &excess.torque);
    torque.iter().filter(|torque| **torque != 0.0).count() as f64 / torque.len().max(1) as f64
}

/// The motion with the joint under control; `None` if it leaves its limits.
fn simulate(
    tree: &Tree,
    ordinary: &Ordinary,
    motion: &Trajectory,
    joint: usize,
    limit: f64,
    bandwidth: f64,
) -> Option<Trajectory> {
    let joints = tree.joint_count();
    let mut workspace = Workspace::new(tree);
    let [mut q, mut v, mut a, mut torque] = [0; 4].map(|_| vec![0.0; joints]);
    // Torque of the rigid body without the joint's acceleration, and what a unit of that adds, at (position,
    // speed, time).
    let mut equation = |position: f64, speed: f64, time: f64| -> Option<[f64; 2]> {
        for other in 0..joints {
            [q[other], v[other], a[other]] = motion.state(other, time);
        }
        (q[joint], v[joint], a[joint]) = (position, speed, 0.0);
        tree.inverse_dynamics(&q, &v, &a, &mut workspace, &mut torque).ok()?;
        let bias = torque[joint];
        a[joint] = 1.0;
        tree.inverse_dynamics(&q, &v, &a, &mut workspace, &mut torque).ok()?;
        Some([bias, torque[joint] - bias + ordinary.rotor[joint]])
    };
    let command = |[bias, inertia]: [f64; 2], position: f64, speed: f64, time: f64| {
        let [target, target_speed, target_acceleration] = motion.state(joint, time);
        let wanted = target_acceleration
            + 2.0 * bandwidth * (target_speed - speed)
            + bandwidth * bandwidth * (target - position);
        inertia * wanted
            + bias
            + ordinary.viscous[joint] * speed
            + ordinary.coulomb[joint] * ordinary.sign(target_speed)
            + ordinary.offset[joint]
    };
    let steps = (motion.duration / STEP) as usize + 1;
    let [mut position, mut speed, _] = motion.state(joint, motion.start);
    let (mut path, mut excess) = (Vec::with_capacity(steps), Vec::with_capacity(steps));
    let limits = tree.joint(joint).limits;
    for step in 0..steps {
        let time = motion.start + step as f64 * STEP;
        let start = equation(position, speed, time)?;
        let commanded = command(start, position, speed, time);
        path.push([position, speed]);
        excess.push(commanded - commanded.clamp(-limit, limit));
        // Half a step ahead for all that is smooth, implicitly for friction, which is stiff near rest.
        let net = |equation: [f64; 2], commanded: f64| {
            commanded.clamp(-limit, limit) - equation[0] - ordinary.offset[joint]
        };
        let half = implicit_speed(ordinary, joint, speed, start[1], net(start, commanded), 0.5 * STEP);
        let middle = [position + 0.25 * STEP * (speed + half), half, time + 0.5 * STEP];
        let ahead = equation(middle[0], middle[1], middle[2])?;
        let commanded = command(ahead, middle[0], middle[1], middle[2]);
        let next = implicit_speed(ordinary, joint, speed, ahead[1], net(ahead, commanded), STEP);
        position += 0.5 * STEP * (speed + next);
        speed = next;
        if !(limits.lower..=limits.upper).contains(&position) || speed.abs() > 1.5 * limits.velocity {
            return None;
        }
    }
    let speed_at = |step: usize| path[step.min(steps - 1)][1];
    let states = (0..steps)
        .map(|step| {
            let acceleration = (speed_at(step + 1) - speed_at(step.saturating_sub(1))) / (2.0 * STEP);
            [path[step][0], path[step][1], acceleration]
        })
        .collect();
    let mut simulated = motion.clone();
    simulated.joints[joint] = JointMotion::Simulated { step: STEP, states };
    simulated.excess = Some(Excess { joint, step: STEP, torque: excess });
    Some(simulated)
}

/// The speed v₁ with inertia·(v₁ − v₀)/h = net − friction(v₁): monotone in v₁, found by bisection.
fn implicit_speed(ordinary: &Ordinary, joint: usize, speed: f64, inertia: f64, net: f64, step: f64) -> f64 {
    let excess = |next: f64| {
        inertia * (next - speed) / step
            + ordinary.viscous[joint] * next
            + ordinary.coulomb[joint] * ordinary.sign(next)
            - net
    };
    let reach =
        step / inertia * (net.abs() + ordinary.coulomb[joint] + ordinary.viscous[joint] * speed.abs());
    let (mut low, mut high) = (speed - reach, speed + reach);
    for _ in 0..50 {
        let middle = 0.5 * (low + high);
        if excess(middle) > 0.0 { high = middle } else { low = middle }
    }
    0.5 * (low + high)
}
