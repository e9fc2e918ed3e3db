//! The path of the EM algorithm, and a shorter way to its end.
//!
//! A smoothing and the estimate after it lead from what is believed of a robot and its noise to what is most
//! likely of them under motions that follow from that belief. Its fixed point is what is wanted. Where
//! encoders tell little of the noise, the steps shrink slowly: after every second one the path is carried on
//! to where it leads (SQUAREM: Varadhan & Roland 2008, scheme S3).

use super::in_order::Colour;
use faer::Mat;

/// Longest extrapolation at first, in steps; and what it grows and shrinks by.
const FIRST_REACH: f64 = 4.0;
/// Largest correlation that has a finite place on the path.
const NEARLY_ONE: f64 = 1.0 - 1e-9;

/// What is believed of a robot and its noise.
#[derive(Clone)]
pub(super) struct Believing {
    /// Standard parameters of its bodies, then those of effects.
    pub x: Mat<f64>,
    pub colours: Vec<Colour>,
    /// Standard deviation of what is new in the noise of each torque \[N·m, N\].
    pub std: Vec<f64>,
}

impl Believing {
    /// All that the steps change, as numbers that may be any: x, then ln σ and artanh ρ of each torque.
    fn place(&self) -> Vec<f64> {
        let x = (0..self.x.nrows()).map(|row| self.x[(row, 0)]);
        let sizes = self.std.iter().map(|std| std.max(f64::MIN_POSITIVE).ln());
        let correlations =
            self.colours.iter().map(|own| own.correlation.clamp(-NEARLY_ONE, NEARLY_ONE).atanh());
        x.chain(sizes).chain(correlations).collect()
    }

    /// What is believed at a place; how much was felt is not on the path.
    fn at(&self, place: &[f64]) -> Self {
        let (x, noise) = place.split_at(self.x.nrows());
        let (sizes, correlations) = noise.split_at(self.std.len());
        let mut at = self.clone();
        at.x = Mat::from_fn(x.len(), 1, |row, _| x[row]);
        at.std = sizes.iter().map(|size| size.exp()).collect();
        at.colours.iter_mut().zip(correlations).for_each(|(own, place)| own.correlation = place.tanh());
        at
    }
}

/// Standard deviations of the numbers of a place: of x from its covariance, of the noise's from the number of
/// its rows.
pub(super) fn scales(covariance: &Mat<f64>, rows: &[f64]) -> Vec<f64> {
    let of_x = (0..covariance.nrows()).map(|k| covariance[(k, k)].max(f64::MIN_POSITIVE).sqrt());
    let sizes = rows.iter().map(|rows| (2.0 * rows.max(1.0)).sqrt().recip());
    let correlations = rows.iter().map(|rows| rows.max(1.0).sqrt().recip());
    of_x.chain(sizes).chain(correlations).collect()
}

/// The last places of the path.
pub(super) struct Path {
    places: Vec<Vec<f64>>,
    reach: f64,
    /// Length of the first step after the last extrapolation.
    last_step: f64,
}

impl Path {
    pub fn from(start: &Believing) -> Self {
        Path { places: vec![start.place()], reach: FIRST_REACH, last_step: f64::INFINITY }
    }

    /// Where to go on after a step that has led to `reached`, and the RMS of that step in the standard
    /// deviations of a place, `scales`. Where the path leads has to be possible.
    pub fn on(
        &mut self,
        reached: Believing,
        scales: &[f64],
        is_possible: impl Fn(&Believing) -> bool,
    ) -> (Believing, f64) {
        self.places.push(reached.place());
        let difference = |one: &[f64], other: &[f64]| -> Vec<f64> {
            one.iter().zip(other).zip(scales).map(|((one, other), scale)| (one - other) / scale).collect()
        };
        let length = |along: &[f64]| {
            (along.iter().map(|own| own * own).sum::<f64>() / along.len().max(1) as f64).sqrt()
        };
        let [.., before, here] = self.places.as_slice() else { return (reached, f64::INFINITY) };
        let moved = length(&difference(here, before));
        let [first, second, third] = self.places.as_slice() else { return (reached, moved) };
        let step = difference(second, first);
        let bend: Vec<f64> = difference(third, second).iter().zip(&step).map(|(a, b)| a - b).collect();
        // An extrapolation that has led away from the path is not to be as long again.
        if length(&step) > self.last_step {
            self.reach = (self.reach / FIRST_REACH).max(1.0);
        }
        self.last_step = length(&step);
        let wanted = length(&step) / length(&bend);
        let mut share = if wanted.is_finite() { wanted.clamp(1.0, self.reach) } else { 1.0 };
        if wanted >= self.reach {
            self.reach *= FIRST_REACH;
        }
        let origin = first.clone();
        let mut next = reached.clone();
        while share > 1.0 {
            let along = step.iter().zip(&bend).zip(scales);
            let along =
                along.map(|((step, bend), scale)| (2.0 * share * step + share * share * bend) * scale);
            let place: Vec<f64> = origin.iter().zip(along).map(|(origin, along)| origin + along).collect();
            let trial = reached.at(&place);
            if trial.std.iter().all(|std| std.is_normal()) && is_possible(&trial) {
                next = trial;
                break;
            }
            share = if share > 1.1 { 0.5 * (share + 1.0) } else { 1.0 };
        }
        self.places = vec![next.place()];
        (next, moved)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Steps that go a fiftieth of the way in one direction and a fifth in another.
    #[test]
    fn a_slow_path_is_followed_to_its_end() {
        let believing = |x: [f64; 2], std: f64, correlation: f64| Believing {
            x: Mat::from_fn(2, 1, |row, _| x[row]),
            colours: vec![Colour { correlation, felt: 0.3 }],
            std: vec![std],
        };
        let step = |own: &Believing| {
            let toward = |from: f64, to: f64, share: f64| from + share * (to - from);
            let std = toward(own.std[0].ln(), 0.01_f64.ln(), 0.05).exp();
            let x = [toward(own.x[(0, 0)], 3.0, 0.02), toward(own.x[(1, 0)], -1.0, 0.2)];
            believing(x, std, toward(own.colours[0].correlation, 0.4, 0.1))
        };
        let scales =
            scales(&Mat::from_fn(2, 2, |row, column| if row == column { 0.01 } else { 0.0 }), &[800.0]);
        let end = |is_possible: fn(&Believing) -> bool| {
            let mut own = believing([0.0, 0.0], 0.1, -0.5);
            let (mut path, mut steps) = (Path::from(&own), 0);
            loop {
                let (next, moved) = path.on(step(&own), &scales, is_possible);
                (own, steps) = (next, steps + 1);
                if moved < 1e-3 || steps == 1000 {
                    return (own, steps);
                }
            }
        };
        let (plain, plain_steps) = end(|_| false);
        let (found, steps) = end(|own| own.x[(0, 0)] < 4.0);
        assert!(steps * 4 < plain_steps, "{steps} steps, {plain_steps} without extrapolation");
        for own in [plain, found] {
            assert!((own.x[(0, 0)] - 3.0).abs() < 0.02 && (own.x[(1, 0)] + 1.0).abs() < 0.02);
            assert!(
                (own.std[0] / 0.01 - 1.0).abs() < 0.05 && (own.colours[0].correlation - 0.4).abs() < 0.05
            );
            assert_eq!(own.colours[0].felt, 0.3);
        }
    }
}
