//! Where the solver starts.

use crate::Calibration;
use crate::problem::Problem;
use crate::solver::{Arrow, Pattern};
use phiw_dynamics::Vec3;
use phiw_dynamics::scalar::Lanes;

/// The pose of the static trial over all time, or rest, turned and moved to where the markers are.
pub(crate) fn start(problem: &Problem<'_>, calibration: Option<&Calibration>) -> Vec<f64> {
    let mut variables = problem.rest();
    let Some(calibration) = calibration else {
        align(problem, &mut variables);
        return variables;
    };
    let (n, first) = (problem.coordinates(), problem.coordinates() * problem.basis().control_points());
    for (column, coordinate) in problem.body.trajectories.iter().enumerate() {
        if let Some(&value) = calibration.pose.get(&coordinate.name) {
            variables[..first].iter_mut().skip(column).step_by(n).for_each(|variable| *variable = value);
        }
    }
    for (variable, parameter) in variables[first..].iter_mut().zip(&problem.body.parameters) {
        if let Some(&value) = calibration.pose.get(&parameter.name) {
            *variable = value;
        }
    }
    variables
}

/// Weight of a control point to be at the pose itself, against the curve's going through it.
const AT_POSE: f64 = 0.02;

/// Replaces coordinates from `first` on by those of a curve that goes through poses, one for each control
/// point, near where that pulls most.
pub(crate) fn through(problem: &Problem<'_>, poses: &[Vec<f64>], variables: &mut [f64], first: usize) {
    let (n, basis) = (problem.coordinates(), problem.basis());
    let order = basis.degree() + 1;
    let mut fit = Arrow::new(1, poses.len(), basis.degree(), 0);
    let alone = Pattern::dense(1, 0);
    let mut places = Vec::new();
    for point in 0..poses.len() {
        let mut values = vec![0.0; order];
        let at = basis.derivative(0, problem.time_s(problem.sample_near(point)), &mut values);
        let products: Vec<Lanes<1>> =
            values.iter().flat_map(|a| values.iter().map(move |b| Lanes([a * b]))).collect();
        let sums: Vec<Lanes<1>> = values.iter().map(|&value| Lanes([value])).collect();
        fit.add_windows(at, &alone, &products, &sums, [&[1.0]]);
        *fit.diagonal_mut(point) += AT_POSE;
        places.push((at, values));
    }
    // Basis functions are positive somewhere, so the diagonal is positive and the factor exists.
    if !fit.factor() {
        return;
    }
    for coordinate in 0..poses.first().map_or(0, Vec::len) {
        let mut right = vec![0.0; poses.len()];
        for (point, (at, values)) in places.iter().enumerate() {
            let value = poses[point][coordinate];
            right[point] += AT_POSE * value;
            for (sum, weight) in right[*at..].iter_mut().zip(values) {
                *sum += weight * value;
            }
        }
        fit.solve(&mut right);
        for (point, value) in right.iter().enumerate() {
            variables[point * n + first + coordinate] = *value;
        }
    }
}

/// Turns the body about the vertical and moves it so that its markers at rest lie on those that are seen: for
/// each control point of its own if the pelvis moves.
pub(crate) fn align(problem: &Problem<'_>, variables: &mut [f64]) {
    let (n, points) = (problem.coordinates(), problem.basis().control_points());
    let body = problem.body;
    let mut columns = variables[..n].to_vec();
    columns.extend_from_slice(&variables[n * points..]);
    let mut scratch = body.kinematics.scratch();
    body.kinematics.place(&columns, &mut scratch);
    let rest: Vec<Vec3<f64>> =
        (0..body.markers.len()).map(|point| body.kinematics.position(point, &scratch)).collect();
    let names = ["pelvis_x", "pelvis_y", "pelvis_z", "pelvis_yaw"];
    let trajectory = |name: &str| body.trajectories.iter().position(|c| c.name == name);
    let parameter = |name: &str| body.parameters.iter().position(|c| c.name == name);
    let mut last_yaw: Option<f64> = None;
    for point in 0..points {
        let sample = problem.sample_near(point);
        let seen: Vec<(Vec3<f64>, Vec3<f64>)> = rest
            .iter()
            .enumerate()
            .filter_map(|(point, &rest)| problem.measured_at(sample, point).map(|measured| (rest, measured)))
            .collect();
        let Some(mut pose) = pose(&seen) else { continue };
        // Yaw is unwrapped: it continues from the last value.
        if let Some(last) = last_yaw {
            let turns = ((last - pose[3]) / std::f64::consts::TAU).round();
            pose[3] += turns * std::f64::consts::TAU;
        }
        let is_first = last_yaw.is_none();
        last_yaw = Some(pose[3]);
        for (name, value) in names.into_iter().zip(pose) {
            if let Some(column) = trajectory(name) {
                variables[point * n + column] = value;
                if is_first {
                    (0..point).for_each(|earlier| variables[earlier * n + column] = value);
                }
            } else if let Some(index) = parameter(name).filter(|_| is_first) {
                variables[n * points + index] = value;
            }
        }
    }
}

/// x, y, z and yaw that bring points at rest to those measured (least squares about the vertical); `None` if
/// they are fewer than two.
fn pose(seen: &[(Vec3<f64>, Vec3<f64>)]) -> Option<[f64; 4]> {
    if seen.len() < 2 {
        return None;
    }
    let zero = (Vec3([0.0; 3]), Vec3([0.0; 3]));
    let (a, b) = seen.iter().fold(zero, |(a, b), (rest, measured)| (a + *rest, b + *measured));
    let share = 1.0 / seen.len() as f64;
    let (a, b) = (a.scale(share), b.scale(share));
    let (mut sine, mut cosine) = (0.0, 0.0);
    for (rest, measured) in seen {
        let ([x, y, _], [u, v, _]) = ((*rest - a).0, (*measured - b).0);
        cosine += x * u + y * v;
        sine += x * v - y * u;
    }
    let yaw = sine.atan2(cosine);
    let (sine, cosine) = yaw.sin_cos();
    let [x, y, z] = a.0;
    let turned = Vec3([cosine * x - sine * y, sine * x + cosine * y, z]);
    let [x, y, z] = (b - turned).0;
    Some([x, y, z, yaw])
}
