//! Derivatives of sampled trajectories by backward differences, equation (16).

/// Velocities and accelerations of a sampled trajectory as the paper takes them (16): zero at the first
/// sample, then differences with the sample before.
///
/// `positions`, `velocities`, `accelerations`: sample by sample, `dimension` values each; units are those of
/// the positions, per s and s². For smooth results take the analytic derivatives of a
/// [`Curve`](crate::bspline::Curve) instead.
///
/// # Errors
/// A slice's length is not that of the positions, or the positions are not a whole number of samples.
pub fn backward_differences(
    positions: &[f64],
    dimension: usize,
    time_step_s: f64,
    velocities: &mut [f64],
    accelerations: &mut [f64],
) -> Result<(), phiw_dynamics::DimensionError> {
    let whole = positions.len() - positions.len() % dimension.max(1);
    phiw_dynamics::check::check_size("the positions", positions.len(), whole)?;
    phiw_dynamics::check::check_size("the velocities", velocities.len(), positions.len())?;
    phiw_dynamics::check::check_size("the accelerations", accelerations.len(), positions.len())?;
    differences(positions, dimension, time_step_s, velocities);
    differences(velocities, dimension, time_step_s, accelerations);
    Ok(())
}

fn differences(signal: &[f64], dimension: usize, time_step_s: f64, derivative: &mut [f64]) {
    let first = dimension.min(derivative.len());
    derivative[..first].fill(0.0);
    for index in first..signal.len() {
        derivative[index] = (signal[index] - signal[index - dimension]) / time_step_s;
    }
}
