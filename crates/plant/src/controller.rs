//! The computed-torque controller, equation (13).

use crate::PlantError;
use crate::error::check_value;
use crate::step_solver::inverse;
use phiw_dynamics::check::check_size;
use phiw_dynamics::dense::Cholesky;
use phiw_dynamics::{DimensionError, Tree, Workspace};

/// What a controller believes that a motion needs.
pub trait TorqueModel {
    /// Writes the torque of each joint for positions `q` \[rad, m\], velocities `v` and accelerations `a` of
    /// the joints.
    ///
    /// # Errors
    /// A slice does not fit the model.
    fn torque(&mut self, q: &[f64], v: &[f64], a: &[f64], torque: &mut [f64]) -> Result<(), DimensionError>;
}

/// Rigid bodies with viscous friction: φ(q, q̇, q̈)·w of the paper. A floating base is believed to stand
/// still, upright.
#[derive(Clone, Debug)]
pub struct RigidBodyModel {
    tree: Tree,
    viscous: Vec<f64>,
    workspace: Workspace<f64>,
    /// Coordinates of base and joints: q, v, a, force.
    full: [Vec<f64>; 4],
}

impl RigidBodyModel {
    /// The tree's own parameters, which may be as wrong as one likes, and a coefficient of viscous friction
    /// for each joint \[N·m·s/rad, N·s/m\]; none if empty.
    ///
    /// # Errors
    /// The coefficients are not one for each joint.
    pub fn new(tree: Tree, viscous: Vec<f64>) -> Result<Self, DimensionError> {
        if !viscous.is_empty() {
            check_size("the model's viscous friction", viscous.len(), tree.joint_count())?;
        }
        let zeros = || vec![0.0; tree.velocity_size()];
        let full = [tree.neutral_configuration(), zeros(), zeros(), zeros()];
        Ok(RigidBodyModel { workspace: Workspace::new(&tree), tree, viscous, full })
    }
}

impl TorqueModel for RigidBodyModel {
    fn torque(&mut self, q: &[f64], v: &[f64], a: &[f64], torque: &mut [f64]) -> Result<(), DimensionError> {
        let joints = self.tree.joint_count();
        let names = ["the model's q", "the model's v", "the model's a"];
        for ((full, part), name) in self.full.iter_mut().zip([q, v, a]).zip(names) {
            check_size(name, part.len(), joints)?;
            let first_joint = full.len() - joints;
            full[first_joint..].copy_from_slice(part);
        }
        check_size("the model's torque", torque.len(), joints)?;
        let [full_q, full_v, full_a, force] = &mut self.full;
        self.tree.inverse_dynamics(full_q, full_v, full_a, &mut self.workspace, force)?;
        torque.copy_from_slice(&force[force.len() - joints..]);
        for ((torque, viscous), speed) in torque.iter_mut().zip(&self.viscous).zip(v) {
            *torque += viscous * speed;
        }
        Ok(())
    }
}

/// Gains of a controller, one for each joint.
#[derive(Clone, Debug, PartialEq)]
pub struct Gains {
    /// Position gains Kp \[N·m/rad, N/m\].
    pub position: Vec<f64>,
    /// Velocity gains Kd \[N·m·s/rad, N·s/m\].
    pub velocity: Vec<f64>,
}

impl Gains {
    /// Gains that would make each joint a critically damped oscillator of `bandwidth` \[rad/s\], with its
    /// [`apparent_inertia`] in configuration `q`.
    ///
    /// The paper's gains are small: 3 to 6 rad/s track poorly.
    ///
    /// # Errors
    /// A list does not fit the robot.
    pub fn critically_damped(
        tree: &Tree,
        rotor_inertia: &[f64],
        q: &[f64],
        bandwidth: f64,
    ) -> Result<Self, DimensionError> {
        let inertia = apparent_inertia(tree, rotor_inertia, q)?;
        Ok(Gains {
            position: inertia.iter().map(|inertia| bandwidth * bandwidth * inertia).collect(),
            velocity: inertia.iter().map(|inertia| 2.0 * bandwidth * inertia).collect(),
        })
    }
}

/// How stiff a controller is whose commands are held for a control period T.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GainSettings {
    /// Bandwidth that is wanted of each joint \[rad/s\]; 0 for none.
    pub bandwidth: f64,
    /// Position gain over the effort limit \[1/rad, 1/m\] that a joint has at least, as dry friction would
    /// hold a light joint wherever it is.
    pub stiffness: f64,
    /// Where the robot's weight would pull it over from the neutral configuration, however well the model
    /// knows it: position gain over what just holds a joint, that each has at least. 0 to let it fall.
    pub gravity: f64,
    /// Largest K_p·T² over the joint's inertia, as commands that are held are a delay: the square of the
    /// largest bandwidth times T.
    pub held_inertia: f64,
    /// Largest K_p·T over the joint's viscous friction, which allows that much more.
    pub held_friction: f64,
}

impl Default for GainSettings {
    /// Small gains, as the paper's: half of the effort limit for a radian, of which a robot's own weight
    /// pulls a third, and no less than its weight asks for. The bounds of held commands leave the loops of
    /// `cargo xtask paper` (0.01 s) stable in both engines.
    fn default() -> Self {
        GainSettings { bandwidth: 0.0, stiffness: 0.5, gravity: 1.5, held_inertia: 0.04, held_friction: 0.3 }
    }
}

impl Gains {
    /// Critically damped gains that stay stable when commands are held for `period_s` \[s\].
    ///
    /// `inertia` is what each joint feels \[kg·m², kg\], as [`apparent_inertia`] or
    /// [`least_apparent_inertia`] computes it, and `viscous` the viscous friction that damps it already
    /// \[N·m·s/rad, N·s/m\]; none if empty.
    ///
    /// # Errors
    /// A list does not fit the robot.
    pub fn held(
        tree: &Tree,
        inertia: &[f64],
        viscous: &[f64],
        period_s: f64,
        settings: &GainSettings,
    ) -> Result<Self, DimensionError> {
        let joints = tree.joint_count();
        check_size("the joints' inertias", inertia.len(), joints)?;
        if !viscous.is_empty() {
            check_size("the joints' viscous friction", viscous.len(), joints)?;
        }
        let GainSettings { bandwidth, stiffness, gravity, held_inertia, held_friction } = *settings;
        let pulls = weight_pulls(tree)?;
        let viscous = |joint: usize| viscous.get(joint).copied().unwrap_or(0.0);
        let stiff = |joint: usize, against_weight: f64| {
            let wanted = (bandwidth * bandwidth * inertia[joint])
                .max(stiffness * tree.joint(joint).limits.effort)
                .max(gravity * against_weight);
            let most =
                held_inertia * inertia[joint] / period_s.powi(2) + held_friction * viscous(joint) / period_s;
            wanted.min(most)
        };
        let mut position: Vec<f64> = (0..joints).map(|joint| stiff(joint, 0.0)).collect();
        let stands = |row: usize, column: usize| {
            let own = if row == column { position[row] } else { 0.0 };
            own - 0.5 * (pulls[row][column] + pulls[column][row])
        };
        if Cholesky::of(joints, stands).is_none() {
            // More than a row's sum on the diagonal makes all joints together stand (Gershgorin).
            let row = |joint: usize| -> f64 {
                let others = pulls[joint].iter().enumerate().filter(|(other, _)| *other != joint);
                pulls[joint][joint] + others.map(|(_, pull)| pull.abs()).sum::<f64>()
            };
            position = (0..joints).map(|joint| stiff(joint, row(joint))).collect();
        }
        let damping =
            |joint: usize| (2.0 * (position[joint] * inertia[joint]).sqrt() - viscous(joint)).max(0.0);
        Ok(Gains { velocity: (0..joints).map(damping).collect(), position })
    }
}

/// The torque per radian (force per metre) with which the robot's weight pulls each joint away from the
/// neutral configuration where another joint moves, and where it moves itself, as an inverted pendulum.
fn weight_pulls(tree: &Tree) -> Result<Vec<Vec<f64>>, DimensionError> {
    const STEP: f64 = 1e-4;
    let (size, joints) = (tree.velocity_size(), tree.joint_count());
    let (neutral, rest) = (tree.neutral_configuration(), vec![0.0; size]);
    let mut workspace = Workspace::new(tree);
    let mut held = |joint: usize, step: f64| -> Result<Vec<f64>, DimensionError> {
        let (mut q, mut torque) = (neutral.clone(), vec![0.0; size]);
        q[neutral.len() - joints + joint] += step;
        tree.inverse_dynamics(&q, &rest, &rest, &mut workspace, &mut torque)?;
        Ok(torque.split_off(size - joints))
    };
    let of_joint = |joint: usize| {
        let (before, after) = (held(joint, -STEP)?, held(joint, STEP)?);
        Ok(before.iter().zip(&after).map(|(before, after)| (before - after) / (2.0 * STEP)).collect())
    };
    (0..joints).map(of_joint).collect()
}

/// The least [`apparent_inertia`] of each joint over configurations.
///
/// # Errors
/// A list does not fit the robot.
pub fn least_apparent_inertia(
    tree: &Tree,
    rotor_inertia: &[f64],
    configurations: impl IntoIterator<Item = Vec<f64>>,
) -> Result<Vec<f64>, DimensionError> {
    let mut inertia = vec![f64::INFINITY; tree.joint_count()];
    for q in configurations {
        let felt = apparent_inertia(tree, rotor_inertia, &q)?;
        inertia.iter_mut().zip(felt).for_each(|(least, felt)| *least = least.min(felt));
    }
    Ok(inertia)
}

/// What each joint feels of the robot when all other joints are free and the base is held \[kg·m², kg\]:
/// 1/(M⁻¹)ⱼⱼ, with `rotor_inertia` on the mass matrix's diagonal (none if empty).
///
/// It is never more than what the joint feels when the others are locked, and often much less. A velocity
/// gain that is held for a control period must stay below twice this inertia over the period, or the loop is
/// unstable.
///
/// # Errors
/// A list does not fit the robot.
pub fn apparent_inertia(tree: &Tree, rotor_inertia: &[f64], q: &[f64]) -> Result<Vec<f64>, DimensionError> {
    let (size, joints) = (tree.velocity_size(), tree.joint_count());
    if !rotor_inertia.is_empty() {
        check_size("the rotor inertias", rotor_inertia.len(), joints)?;
    }
    let mut matrix = vec![0.0; size * size];
    tree.mass_matrix(q, &mut Workspace::new(tree), &mut matrix)?;
    let first = size - joints;
    for (joint, inertia) in rotor_inertia.iter().enumerate() {
        matrix[(first + joint) * (size + 1)] += inertia;
    }
    let mobility = inverse(&matrix, size, first);
    Ok((0..joints).map(|joint| 1.0 / mobility[joint * (joints + 1)]).collect())
}

/// Equation (13): the model's torque for the reference, and a PD on what the encoders say.
pub struct ComputedTorque {
    model: Box<dyn TorqueModel>,
    gains: Gains,
}

impl ComputedTorque {
    /// A controller with this model and these gains.
    pub fn new(model: impl TorqueModel + 'static, gains: Gains) -> Self {
        ComputedTorque { model: Box::new(model), gains }
    }

    pub(crate) fn check(&self, joints: usize) -> Result<(), PlantError> {
        for (name, gains) in [("Kp", &self.gains.position), ("Kd", &self.gains.velocity)] {
            check_size(
                if name == "Kp" { "the position gains" } else { "the velocity gains" },
                gains.len(),
                joints,
            )?;
            for &gain in gains {
                check_value(|| name.to_owned(), gain, "≥ 0", |gain| gain >= 0.0)?;
            }
        }
        Ok(())
    }

    /// The torque that the model gives for a reference `[q*, q̇*, q̈*]` by itself, without the PD.
    ///
    /// # Errors
    /// A slice does not fit the model.
    pub fn feed_forward(&mut self, [q, v, a]: [&[f64]; 3], torque: &mut [f64]) -> Result<(), DimensionError> {
        self.model.torque(q, v, a, torque)
    }

    /// The torque command for a reference `[q*, q̇*, q̈*]` and the state `[q, q̇]` as measured.
    pub(crate) fn command(
        &mut self,
        [q_ref, v_ref, a_ref]: [&[f64]; 3],
        [q, v]: [&[f64]; 2],
        command: &mut [f64],
    ) -> Result<(), DimensionError> {
        self.model.torque(q_ref, v_ref, a_ref, command)?;
        for (joint, command) in command.iter_mut().enumerate() {
            *command += self.gains.position[joint] * (q_ref[joint] - q[joint])
                + self.gains.velocity[joint] * (v_ref[joint] - v[joint]);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use phiw_dynamics::random_tree::{RandomTreeOptions, random_tree};

    /// Each case asks for more or less than a held command allows: K_p and K_d of inertias of 0.5 kg·m² at a
    /// limit that the settings name.
    #[test]
    fn gains_are_as_stiff_as_wanted_and_held_commands_allow() -> Result<(), Box<dyn std::error::Error>> {
        let tree = random_tree(3, &RandomTreeOptions::default())?;
        let joints = tree.joint_count();
        let (inertia, friction) = (vec![0.5; joints], vec![2.0; joints]);
        let effort = |joint: usize| tree.joint(joint).limits.effort;
        let settings = |bandwidth, stiffness| GainSettings {
            bandwidth,
            stiffness,
            gravity: 0.0,
            held_inertia: 0.04,
            held_friction: 0.3,
        };
        for joint in 0..joints {
            let stiff = 3.0 / effort(joint);
            for (settings, viscous, period_s, position) in [
                // 8² · 0.5, and what the stiffness asks for if that is more.
                (settings(8.0, 0.0), &[][..], 0.01, 32.0),
                (settings(1.0, stiff), &[], 0.01, 3.0),
                // 0.04 · 0.5 / 0.1², and with friction 0.3 · 2 / 0.1 more.
                (settings(8.0, 0.0), &[], 0.1, 2.0),
                (settings(8.0, 0.0), &friction, 0.1, 8.0),
            ] {
                let gains = Gains::held(&tree, &inertia, viscous, period_s, &settings)?;
                let damping = 2.0 * (0.5_f64 * position).sqrt() - viscous.get(joint).copied().unwrap_or(0.0);
                assert!((gains.position[joint] - position).abs() < 1e-9, "{settings:?}: {gains:?}");
                assert!((gains.velocity[joint] - damping).abs() < 1e-9, "{settings:?}: {gains:?}");
            }
        }
        // Friction that damps more than enough leaves nothing to do.
        let gains = Gains::held(&tree, &inertia, &vec![1e3; joints], 0.01, &settings(1.0, 0.0))?;
        assert!(gains.velocity.iter().all(|&gain| gain == 0.0));
        assert!(Gains::held(&tree, &inertia[1..], &[], 0.01, &GainSettings::default()).is_err());
        assert!(Gains::held(&tree, &inertia, &friction[1..], 0.01, &GainSettings::default()).is_err());
        Ok(())
    }

    /// A rod of 8 kg that stands upright, its centre of mass 0.5 m above the joint: m·g·c = 39.24 N·m/rad.
    #[test]
    fn a_body_that_stands_above_its_joint_is_held() -> Result<(), Box<dyn std::error::Error>> {
        let urdf = |z: f64| {
            format!(
                r#"<robot name="rod"><link name="base"/>
                <link name="rod"><inertial><origin xyz="0 0 {z}"/><mass value="8"/>
                  <inertia ixx="0.7" iyy="0.7" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
                <joint name="hip" type="revolute"><parent link="base"/><child link="rod"/><axis xyz="0 1 0"/>
                  <limit lower="-1" upper="1" effort="40" velocity="4"/></joint></robot>"#
            )
        };
        let position = |z: f64, gravity: f64| -> Result<f64, Box<dyn std::error::Error>> {
            let tree = phiw_dynamics::urdf::read_urdf(&urdf(z), &Default::default())?.tree;
            let settings = GainSettings { gravity, ..GainSettings::default() };
            Ok(Gains::held(&tree, &[2.7], &[], 0.01, &settings)?.position[0])
        };
        // Half of the effort limit would let it fall.
        assert!((position(0.5, 0.0)? - 20.0).abs() < 1e-9);
        assert!((position(0.5, 1.5)? - 1.5 * 39.24).abs() < 1e-3, "{}", position(0.5, 1.5)?);
        // One that hangs needs no more.
        assert!((position(-0.5, 1.5)? - 20.0).abs() < 1e-9);
        Ok(())
    }

    #[test]
    fn the_least_inertia_is_below_that_of_each_configuration() -> Result<(), Box<dyn std::error::Error>> {
        use phiw_dynamics::random_tree::{RandomNumbers, random_state};
        let tree = random_tree(5, &RandomTreeOptions::default())?;
        let mut rng = RandomNumbers::new(2);
        let poses: Vec<Vec<f64>> = (0..10).map(|_| random_state(&tree, &mut rng).q).collect();
        let least = least_apparent_inertia(&tree, &[], poses.iter().cloned())?;
        let felt = poses.iter().map(|q| apparent_inertia(&tree, &[], q)).collect::<Result<Vec<_>, _>>()?;
        for joint in 0..tree.joint_count() {
            assert!(felt.iter().all(|felt| least[joint] <= felt[joint]));
            assert!(felt.iter().any(|felt| least[joint] == felt[joint]));
        }
        Ok(())
    }
}
