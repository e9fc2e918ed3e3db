//! Swings over the time and over the position, at the frequencies at which the residual itself is largest.

use super::shape::{Shape, ShapeColumns, Torque, of_torque, torque_of};
use phiw_identification::effect::Needs;

/// Swings over a signal that are tried.
const LINES: usize = 2;
/// Share of a residual's variance that is enough: the frequencies were chosen on the same residual.
const LEAST_SHARE: f64 = 0.25;

/// Swings over the time; over the position as they are, with the sign of the speed, and in proportion to the
/// torque.
pub(super) fn swings(torque: &Torque<'_>) -> Vec<Shape> {
    let (row, load, peaks) = (torque.row, torque.torque(), torque.peaks);
    let sign = torque.sign();
    let strongest = |frequencies: &[Vec<f64>]| -> Vec<f64> {
        frequencies.get(row).into_iter().flatten().copied().take(LINES).collect()
    };
    let time = strongest(&peaks.time_frequencies);
    let plain = strongest(&peaks.ripple_frequencies);
    let friction = strongest(&peaks.friction_ripple_frequencies);
    let ripple = strongest(&peaks.load_ripple_frequencies);
    let shape = |signals: &[&str], frequencies: usize, needs: Needs, columns: ShapeColumns| Shape {
        least_share: LEAST_SHARE,
        ..torque.shape(signals, 2 * frequencies, needs, columns)
    };
    let all = [
        shape(
            &["t"],
            time.len(),
            Needs::default(),
            Box::new(move |sample, out| write(&time, sample.time(), 1.0, out)),
        ),
        shape(
            &["q"],
            plain.len(),
            Needs::default(),
            Box::new(move |sample, out| write(&plain, sample.q()[row], 1.0, out)),
        ),
        shape(
            &["q", "qd"],
            friction.len(),
            Needs::default(),
            Box::new(move |sample, out| write(&friction, sample.q()[row], sign(sample), out)),
        ),
        shape(
            &["q", "tau"],
            ripple.len(),
            of_torque(),
            Box::new(move |sample, out| write(&ripple, sample.q()[row], torque_of(sample, row) / load, out)),
        ),
    ];
    all.into_iter().filter(|shape| !shape.effect.parameters().is_empty()).collect()
}

fn write(frequencies: &[f64], place: f64, height: f64, columns: &mut [f64]) {
    for (pair, frequency) in columns.chunks_exact_mut(2).zip(frequencies) {
        let (sine, cosine) = (frequency * place).sin_cos();
        (pair[0], pair[1]) = (height * sine, height * cosine);
    }
}
