//! Kernels over many states: several side by side in a vector register, stretches of states on all threads.

use phiw_dynamics::DimensionError;
use phiw_dynamics::scalar::Lanes;
use rayon::prelude::*;

/// States side by side: two registers of AVX2, one of AVX-512.
pub const LANES: usize = 8;
/// States that a thread takes at a time: long against the cost of handing them over, short enough for all
/// threads to have some.
const STRETCH: usize = 64 * LANES;

/// A number of each of [`LANES`] states.
pub type Lane = Lanes<LANES>;

/// Inputs of a kernel: for each array its numbers, state by state, and how many a state has.
pub type Inputs<'a, const K: usize> = [(&'a [f64], usize); K];

/// Calls `kernel` for all states, [`LANES`] at a time, and puts its results of `width` numbers each into
/// `outputs`.
///
/// `kernel` gets scratch of its thread (from `scratch`), the inputs, and what it writes: the outputs of as
/// many states as there are.
///
/// # Errors
/// The first of `kernel`.
pub fn over_states<S: Send, const K: usize>(
    inputs: Inputs<'_, K>,
    width: usize,
    outputs: &mut [f64],
    scratch: impl Fn() -> S + Sync,
    kernel: impl Fn(&mut S, [&[Lane]; K], &mut [f64]) -> Result<(), DimensionError> + Sync,
) -> Result<(), DimensionError> {
    let states = outputs.len().checked_div(width).unwrap_or(0);
    let start = || (scratch(), inputs.map(|(_, width)| vec![Lanes([0.0; LANES]); width]));
    let work = |(scratch, lanes): &mut (S, [Vec<Lane>; K]), first: usize, outputs: &mut [f64]| {
        for (step, outputs) in outputs.chunks_mut(LANES * width).enumerate() {
            let first = first + step * LANES;
            let last = (states - 1).min(first + LANES - 1);
            for (lanes, (numbers, width)) in lanes.iter_mut().zip(inputs) {
                // Where there are fewer states than lanes, the last one fills the rest.
                for lane in 0..LANES {
                    let state = &numbers[(first + lane).min(last) * width..][..width];
                    lanes.iter_mut().zip(state).for_each(|(lanes, number)| lanes.0[lane] = *number);
                }
            }
            kernel(scratch, std::array::from_fn(|input| lanes[input].as_slice()), outputs)?;
        }
        Ok::<(), DimensionError>(())
    };
    if states == 0 {
        Ok(())
    } else if states <= STRETCH {
        work(&mut start(), 0, outputs)
    } else {
        let stretches = outputs.par_chunks_mut(STRETCH * width).enumerate();
        stretches.try_for_each_init(start, |own, (stretch, outputs)| work(own, stretch * STRETCH, outputs))
    }
}

/// Writes `values`, the outputs of [`LANES`] states side by side, state by state.
pub fn put(values: &[Lane], outputs: &mut [f64]) {
    for (lane, output) in outputs.chunks_exact_mut(values.len()).enumerate() {
        output.iter_mut().zip(values).for_each(|(output, value)| *output = value.0[lane]);
    }
}
