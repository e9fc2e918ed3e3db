//! Poses of human and robot in one sample of a solution.

use super::Problem;
use super::correspondence::robot_vector;
use crate::human::HumanScratch;
use crate::robot::{BodyPoint, RobotModel, world};
use phiw_dynamics::{Placement, Vec3};

/// Room for one pose.
pub(crate) struct PoseScratch {
    columns: Vec<f64>,
    human: HumanScratch<f64>,
    placements: Vec<Placement<f64>>,
}

impl Problem<'_> {
    pub(crate) fn pose_scratch(&self) -> PoseScratch {
        let bodies = self.robot.map_or(0, |robot| robot.tree.bodies().len());
        PoseScratch {
            columns: vec![0.0; self.coordinates() + self.body.parameters.len()],
            human: self.body.kinematics.scratch(),
            placements: vec![Placement::identity(); bodies],
        }
    }

    /// Places human and robot as they are in a sample.
    pub(crate) fn pose(&self, variables: &[f64], sample: usize, scratch: &mut PoseScratch) {
        let n = self.coordinates();
        let (coordinates, parameters) = scratch.columns.split_at_mut(n);
        self.coordinates_at(variables, sample, coordinates);
        parameters.copy_from_slice(&variables[n * self.basis.control_points()..]);
        self.body.kinematics.place(&scratch.columns, &mut scratch.human);
        if let Some(robot) = self.robot {
            let q = &scratch.columns[self.body.trajectories.len()..n];
            // The sizes are those of this robot.
            let _ = robot.tree.forward_kinematics(q, &mut scratch.placements);
        }
    }

    /// |p^h − p^m|² \[m²\] of the markers in a sample that has been placed; NaN where one is missing.
    pub(crate) fn marker_errors(&self, sample: usize, scratch: &PoseScratch, errors: &mut [f64]) {
        for (point, error) in errors.iter_mut().enumerate() {
            *error = self.measured_at(sample, point).map_or(f64::NAN, |measured| {
                let residual = self.body.kinematics.position(point, &scratch.human) - measured;
                residual.dot(residual)
            });
        }
    }

    /// p^r − p^h \[m\] of elbow, wrist and hand, left then right, in a sample that has been placed.
    pub(crate) fn arm_residuals(&self, robot: &RobotModel, scratch: &PoseScratch) -> [Vec3<f64>; 6] {
        std::array::from_fn(|index| {
            let line = &robot.correspondences[index];
            robot_vector(line, &scratch.placements) - self.human_vector(line, &scratch.human)
        })
    }

    /// The human's vectors of all correspondences in a sample that has been placed, or those that replace
    /// them \[m\].
    pub(crate) fn human_vectors(
        &self,
        robot: &RobotModel,
        sample: usize,
        scratch: &PoseScratch,
    ) -> Vec<Vec3<f64>> {
        robot
            .correspondences
            .iter()
            .enumerate()
            .map(|(index, line)| match self.target(index) {
                Some(vectors) => vectors[sample],
                None => self.human_vector(line, &scratch.human),
            })
            .collect()
    }

    /// The sample nearest to where a control point pulls most.
    pub(crate) fn sample_near(&self, point: usize) -> usize {
        let degree = self.basis.degree();
        let (start, end) = self.basis.domain();
        let knots = &self.basis.knots()[point + 1..=point + degree.max(1)];
        let t = knots.iter().sum::<f64>() / knots.len() as f64;
        let share = ((t - start) / (end - start)).clamp(0.0, 1.0);
        (share * self.samples().saturating_sub(1) as f64).round() as usize
    }

    /// Where points of the robot are when all its joints are at zero \[m\].
    pub(crate) fn zero_points<const N: usize>(
        &self,
        points: [BodyPoint; N],
        scratch: &mut PoseScratch,
    ) -> [Vec3<f64>; N] {
        if let Some(robot) = self.robot {
            let _ =
                robot.tree.forward_kinematics(&robot.tree.neutral_configuration(), &mut scratch.placements);
        }
        points.map(|point| world(&scratch.placements, point))
    }
}
