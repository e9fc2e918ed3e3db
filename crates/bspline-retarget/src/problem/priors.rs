//! w_η η, the third term of (15), and small priors on what the markers do not determine.

use super::{Collect, Problem};

impl Problem<'_> {
    /// Weight of what is known with a standard deviation; infinite: nothing is known.
    pub(super) fn certainty(&self, spread: f64) -> f64 {
        (self.weights.marker_deviation_m / spread).powi(2)
    }

    /// What is known of a column of a sample beforehand: its mean, and with what weight.
    pub(crate) fn known(&self, column: usize) -> (f64, f64) {
        match self.posture.get(column) {
            Some(&known) => known,
            None => {
                let parameter = &self.body.parameters[column - self.posture.len()];
                (parameter.mean, self.certainty(parameter.spread))
            }
        }
    }

    pub(super) fn parameter_prior(&self, parameters: &[f64], collect: &mut Collect<'_>) -> f64 {
        let first = self.coordinates() * self.basis.control_points();
        let mut cost = 0.0;
        for (index, (parameter, value)) in self.body.parameters.iter().zip(parameters).enumerate() {
            let weight = self.certainty(parameter.spread);
            let away = value - parameter.mean;
            cost += weight * away * away;
            match collect {
                Collect::Cost => {}
                Collect::Gradient(gradient) => gradient[first + index] += weight * away,
                Collect::Normal(arrow) => *arrow.diagonal_mut(first + index) += weight,
            }
        }
        cost
    }

    /// Accelerations of all coordinates over all samples: a quadratic form of the control points.
    pub(super) fn accelerations(&self, variables: &[f64], collect: &mut Collect<'_>) -> f64 {
        let (n, degree) = (self.coordinates(), self.basis.degree());
        let mut cost = 0.0;
        for point in 0..self.basis.control_points() {
            for other in point.saturating_sub(degree)..=point {
                let sum = self.accelerations[point * (degree + 1) + degree + other - point];
                let weight = self.weights.acceleration * sum;
                if weight == 0.0 {
                    continue;
                }
                // An element off the diagonal counts twice, as only one triangle is visited.
                let twice = if other == point { 1.0 } else { 2.0 };
                for coordinate in 0..n {
                    let (i, j) = (point * n + coordinate, other * n + coordinate);
                    cost += twice * weight * variables[i] * variables[j];
                    match collect {
                        Collect::Cost => {}
                        Collect::Gradient(gradient) => {
                            gradient[i] += weight * variables[j];
                            if i != j {
                                gradient[j] += weight * variables[i];
                            }
                        }
                        Collect::Normal(arrow) => arrow.add(point, other, coordinate, weight),
                    }
                }
            }
        }
        cost
    }

    /// w_η η: a curve stays inside the hull of its control points, so it is they that are kept inside the
    /// limits.
    pub(super) fn limits(&self, variables: &[f64], collect: &mut Collect<'_>) -> f64 {
        let Some(robot) = self.robot else { return 0.0 };
        let (n, first) = (self.coordinates(), self.body.trajectories.len());
        let control_points = self.basis.control_points();
        let mut cost = 0.0;
        for joint in 0..robot.tree.joint_count() {
            let limits = robot.tree.joint(joint).limits;
            let coordinate = first + joint;
            for point in 0..control_points {
                let value = variables[point * n + coordinate];
                let over = beyond(value, limits.lower, limits.upper);
                let weight = self.weights.limits;
                if over != 0.0 && weight > 0.0 {
                    cost += weight * over * over;
                    collect.add_diagonal(point * n + coordinate, weight * over, weight);
                }
                let weight = self.weights.velocity_limits;
                if point + 1 < control_points && weight > 0.0 {
                    let per_s = self.slope(point + 1);
                    let velocity = per_s * (variables[(point + 1) * n + coordinate] - value);
                    let over = beyond(velocity, -limits.velocity, limits.velocity);
                    if over != 0.0 {
                        cost += weight * over * over;
                        let (slope, curvature) = (weight * over * per_s, weight * per_s * per_s);
                        collect.add_diagonal(point * n + coordinate, -slope, curvature);
                        collect.add_diagonal((point + 1) * n + coordinate, slope, curvature);
                        if let Collect::Normal(arrow) = collect {
                            arrow.add(point + 1, point, coordinate, -curvature);
                        }
                    }
                }
            }
        }
        cost
    }

    /// What the difference of control points `point` and the one before is to be multiplied with, to be one
    /// of the velocity \[1/s\].
    pub(crate) fn slope(&self, point: usize) -> f64 {
        let degree = self.basis.degree();
        let knots = self.basis.knots();
        let width = knots[point + degree] - knots[point];
        if degree > 0 && width > 0.0 { degree as f64 / width } else { 0.0 }
    }
}

impl Collect<'_> {
    fn add_diagonal(&mut self, variable: usize, slope: f64, curvature: f64) {
        match self {
            Collect::Cost => {}
            Collect::Gradient(gradient) => gradient[variable] += slope,
            Collect::Normal(arrow) => *arrow.diagonal_mut(variable) += curvature,
        }
    }
}

/// How far a value is beyond its limits, with its sign.
fn beyond(value: f64, lower: f64, upper: f64) -> f64 {
    (value - upper).max(0.0) + (value - lower).min(0.0)
}
