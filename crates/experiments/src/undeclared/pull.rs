//! What pulls at a link and moves with it: a hose that is stretched, a load that swings.

use super::plant::Scene;
use phiw_dynamics::{Placement, Vec3};

/// Something that pulls at a point of a link.
#[derive(Clone, Copy, Debug)]
pub struct Pull {
    /// Index of the body.
    pub body: usize,
    /// The point, in the joint's frame \[m\].
    pub point: [f64; 3],
    /// What is there.
    pub carried: Carried,
}

/// What pulls.
#[derive(Clone, Copy, Debug)]
pub enum Carried {
    /// A cable to a fixed point, of 1 N/m; it pulls where it is longer than `slack` \[m\].
    Hose {
        /// The fixed point in the world \[m\].
        anchor: [f64; 3],
        /// Length from which on it pulls \[m\].
        slack: f64,
    },
    /// A mass of 1 kg on a damped spring, without weight: that is the rigid body's.
    Load {
        /// Its frequency \[rad/s\].
        omega: f64,
        /// Its damping ratio.
        damping: f64,
    },
}

/// Longest step of a load's integration \[s\].
const STEP_S: f64 = 2e-3;

impl Pull {
    /// Adds what the joints must deliver against the pull, which is `scale` times that of 1 N/m or 1 kg.
    pub fn add_torque(&self, scene: &Scene, scale: f64, torque: &mut [f64]) {
        let (tree, joints) = (scene.tree, scene.tree.joint_count());
        let mut placements = vec![Placement::identity(); tree.bodies().len()];
        let mut jacobian = vec![0.0; 6 * joints];
        let mut load: Option<Load> = None;
        for (sample, torque) in torque.chunks_exact_mut(joints).enumerate() {
            let [q, ..] = scene.link.at(sample);
            let placed = tree.forward_kinematics(q, &mut placements);
            let moved = tree.point_jacobian(&placements, self.body, Vec3(self.point), &mut jacobian);
            debug_assert!(placed.is_ok() && moved.is_ok(), "the sizes come from the tree itself");
            let point = placements[self.body].rotation * Vec3(self.point) + placements[self.body].translation;
            let force = match self.carried {
                Carried::Hose { anchor, slack } => {
                    let along = Vec3(anchor) - point;
                    along.scale((1.0 - slack / along.dot(along).sqrt().max(1e-9)).max(0.0))
                }
                Carried::Load { omega, damping } => {
                    let time = scene.times[sample];
                    let load = load.get_or_insert_with(|| Load::at_rest(point, time));
                    load.follow(point, time, omega, damping)
                }
            };
            for (joint, torque) in torque.iter_mut().enumerate() {
                let along: f64 = (0..3).map(|row| jacobian[row * joints + joint] * force.0[row]).sum();
                *torque -= scale * along;
            }
        }
    }
}

/// A mass on a damped spring whose other end moves.
struct Load {
    time: f64,
    point: Vec3<f64>,
    /// Where the mass is, and its velocity.
    mass: Vec3<f64>,
    velocity: Vec3<f64>,
}

impl Load {
    fn at_rest(point: Vec3<f64>, time: f64) -> Self {
        Load { time, point, mass: point, velocity: Vec3([0.0; 3]) }
    }

    /// The force of 1 kg on the point \[N\], which has moved evenly to where it is now.
    fn follow(&mut self, point: Vec3<f64>, time: f64, omega: f64, damping: f64) -> Vec3<f64> {
        let period = time - self.time;
        let steps = (period / STEP_S).ceil().max(1.0);
        let step = period / steps;
        let moves = (point - self.point).scale(if period > 0.0 { period.recip() } else { 0.0 });
        let mut pulls = Vec3([0.0; 3]);
        for number in 0..=steps as usize {
            let end = self.point + moves.scale(step * number as f64);
            pulls =
                (end - self.mass).scale(omega * omega) + (moves - self.velocity).scale(2.0 * damping * omega);
            if number < steps as usize {
                self.velocity += pulls.scale(step);
                self.mass += self.velocity.scale(step);
            }
        }
        (self.point, self.time) = (point, time);
        pulls.scale(-1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::Load;
    use phiw_dynamics::Vec3;

    /// After a jump it swings with its own frequency and dies down.
    #[test]
    fn a_load_swings_about_the_point_that_it_hangs_on() {
        let (omega, damping) = (std::f64::consts::TAU, 0.05);
        let mut load = Load::at_rest(Vec3([0.0; 3]), 0.0);
        let mut sum = 0.0;
        for row in 1..=1000 {
            let t = 0.01 * f64::from(row);
            let force = load.follow(Vec3([1.0, 0.0, 0.0]), t, omega, damping).0[0];
            // In the first row the point jumps, and the damper with it.
            if row == 1 {
                continue;
            }
            // y = x − 1 is −1 after the first row, and the damper has pulled the mass along: y' = 2ζω.
            let phase = omega * (t - 0.005);
            let damped = (1.0 - damping * damping).sqrt();
            let (sine, cosine) = (damped * phase).sin_cos();
            let decay = (-damping * phase).exp();
            let y = decay * (damping / damped * sine - cosine);
            let rate = decay * (2.0 * damping * cosine + (damped - damping * damping / damped) * sine);
            let expected = omega * omega * (y + 2.0 * damping * rate);
            sum += (force - expected).powi(2) / (omega * omega).powi(2);
        }
        assert!((sum / 1000.0).sqrt() < 0.05, "{sum}");
    }
}
