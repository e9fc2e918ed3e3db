//! Human and robot in one sample, for whoever looks at a solution.

use super::correspondence::robot_vector;
use super::{Problem, Scratch};
use crate::robot::{BodyPoint, RobotModel, world};
use phiw_dynamics::Vec3;

impl Problem<'_> {
    /// Places human and robot as they are in a sample.
    fn place(&self, variables: &[f64], sample: usize, scratch: &mut Scratch) {
        let (n, order) = (self.coordinates(), self.basis.degree() + 1);
        scratch.columns[n..].copy_from_slice(&variables[n * self.basis.control_points()..]);
        let weights = &self.values[sample * order..][..order];
        self.coordinates_at(variables, self.firsts[sample], weights, &mut scratch.columns[..n]);
        self.body.kinematics.place(&scratch.columns, &mut scratch.human);
        if let Some(robot) = self.robot {
            let q = &scratch.columns[self.body.trajectories.len()..n];
            // The sizes are those of this robot.
            let _ = robot.tree.forward_kinematics(q, &mut scratch.placements);
        }
    }

    /// |p^h − p^m|² \[m²\] of the markers in a sample; NaN where one is missing.
    pub(crate) fn marker_errors(
        &self,
        variables: &[f64],
        sample: usize,
        scratch: &mut Scratch,
        errors: &mut [f64],
    ) {
        self.place(variables, sample, scratch);
        for (point, (error, measured)) in errors.iter_mut().zip(self.measured_at(sample)).enumerate() {
            let residual = self.body.kinematics.position(point, &scratch.human) - Vec3(*measured);
            *error = residual.dot(residual);
        }
    }

    /// p^r − p^h \[m\] of elbow, wrist and hand, left then right.
    pub(crate) fn arm_residuals(
        &self,
        robot: &RobotModel,
        variables: &[f64],
        sample: usize,
        scratch: &mut Scratch,
    ) -> [Vec3<f64>; 6] {
        self.place(variables, sample, scratch);
        std::array::from_fn(|index| {
            let line = &robot.correspondences[index];
            robot_vector(line, &scratch.placements) - self.human_vector(line, &scratch.human)
        })
    }

    /// From shoulder to hand, left and right, of the human at the robot's size, seen from the pelvis \[m\].
    pub(crate) fn human_hands(
        &self,
        robot: &RobotModel,
        variables: &[f64],
        sample: usize,
        scratch: &mut Scratch,
    ) -> [Vec3<f64>; 2] {
        self.place(variables, sample, scratch);
        [2, 5].map(|hand| self.human_vector(&robot.correspondences[hand], &scratch.human))
    }

    /// The human's vectors of all correspondences in a sample, or those that replace them \[m\].
    pub(crate) fn human_vectors(
        &self,
        robot: &RobotModel,
        variables: &[f64],
        sample: usize,
        scratch: &mut Scratch,
    ) -> Vec<Vec3<f64>> {
        self.place(variables, sample, scratch);
        let replaced = |index| self.targets.iter().find(|(target, _)| *target == index);
        let vector = |(index, line)| match replaced(index) {
            Some((_, vectors)) => vectors[sample],
            None => self.human_vector(line, &scratch.human),
        };
        robot.correspondences.iter().enumerate().map(vector).collect()
    }

    /// The sample nearest to where a control point pulls most.
    pub(crate) fn sample_near(&self, point: usize) -> usize {
        let degree = self.basis.degree();
        let (start, end) = self.basis.domain();
        let knots = &self.basis.knots()[point + 1..=point + degree.max(1)];
        let t = knots.iter().sum::<f64>() / knots.len() as f64;
        let share = ((t - start) / (end - start)).clamp(0.0, 1.0);
        (share * self.samples.saturating_sub(1) as f64).round() as usize
    }

    /// Where points of the robot are when all its joints are at zero \[m\].
    pub(crate) fn zero_points<const N: usize>(
        &self,
        points: [BodyPoint; N],
        scratch: &mut Scratch,
    ) -> [Vec3<f64>; N] {
        if let Some(robot) = self.robot {
            let _ =
                robot.tree.forward_kinematics(&robot.tree.neutral_configuration(), &mut scratch.placements);
        }
        points.map(|point| world(&scratch.placements, point))
    }
}
