//! The end of a path of steps that shrink slowly, from the last few of them (Anderson 1965; Walker & Ni 2011).

use faer::Mat;
use faer::Side;
use faer::prelude::Solve;

/// Steps that are remembered.
const REMEMBERED: usize = 5;
/// Where remembered steps are nearly the same direction, this share of their squares is added.
const ADDED: f64 = 1e-8;

/// Points from which steps were taken, and where each led.
#[derive(Default)]
pub(super) struct FixedPoint {
    taken: Vec<[Mat<f64>; 2]>,
}

impl FixedPoint {
    /// Where to take the next step from, after one from `from` led to `to`, and how long this was: RMS over
    /// the parameters, in standard deviations. It is `to` where what the steps promise is not possible.
    pub fn next(
        &mut self,
        from: Mat<f64>,
        to: Mat<f64>,
        covariance: &Mat<f64>,
        is_possible: impl Fn(&Mat<f64>) -> bool,
    ) -> (Mat<f64>, f64) {
        let in_deviations = |way: Mat<f64>| {
            let deviation = |k: usize| covariance[(k, k)].max(f64::MIN_POSITIVE).sqrt();
            Mat::from_fn(way.nrows(), 1, |k, _| way[(k, 0)] / deviation(k))
        };
        let step = in_deviations(&to - &from);
        let length = step.norm_l2() / (step.nrows().max(1) as f64).sqrt();
        // How steps and ends changed from each remembered step to this one.
        let steps: Vec<Mat<f64>> =
            self.taken.iter().map(|[from, to]| &step - in_deviations(to - from)).collect();
        let ends: Vec<Mat<f64>> = self.taken.iter().map(|[_, end]| &to - end).collect();
        let count = steps.len();
        let product = |a: &Mat<f64>, b: &Mat<f64>| (a.transpose() * b)[(0, 0)];
        let trace: f64 = steps.iter().map(|step| product(step, step)).sum();
        let gram = Mat::from_fn(count, count, |row, column| {
            product(&steps[row], &steps[column]) + if row == column { ADDED * trace } else { 0.0 }
        });
        let right = Mat::from_fn(count, 1, |row, _| product(&steps[row], &step));
        let mut next = to.clone();
        if let (true, Ok(factor)) = (count > 0, gram.llt(Side::Lower)) {
            let shares = factor.solve(right);
            for (place, end) in ends.iter().enumerate() {
                next -= end * faer::Scale(shares[(place, 0)]);
            }
            if !is_possible(&next) {
                next.clone_from(&to);
            }
        }
        if count == REMEMBERED {
            self.taken.remove(0);
        }
        self.taken.push([from, to]);
        (next, length)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Steps of a linear map with these rates along axes that are not the parameters'.
    fn step(x: &Mat<f64>, rates: &[f64; 4], end: &Mat<f64>) -> Mat<f64> {
        let turned = |row: usize, column: usize| ((1 + row) as f64 * (0.7 + column as f64)).sin();
        let axes = Mat::from_fn(4, 4, turned);
        let q = axes.qr().compute_Q();
        let along = q.transpose() * (x - end);
        end + &q * Mat::from_fn(4, 1, |k, _| rates[k] * along[(k, 0)])
    }

    proptest! {
        #[test]
        fn a_slow_path_ends_after_a_few_steps(
            rates in prop::array::uniform4(0.0_f64..0.99),
            end in prop::array::uniform4(-3.0_f64..3.0),
        ) {
            let end = Mat::from_fn(4, 1, |k, _| end[k]);
            let mut path = FixedPoint::default();
            let (mut x, mut length) = (Mat::zeros(4, 1), f64::INFINITY);
            for _ in 0..12 {
                let to = step(&x, &rates, &end);
                (x, length) = path.next(x, to, &Mat::identity(4, 4), |_| true);
            }
            prop_assert!(length < 1e-3 && (&x - &end).norm_l2() < 1e-2, "{length}, {:?} {:?}", x, end);
        }
    }

    #[test]
    fn what_is_not_possible_is_not_tried() {
        let end = Mat::from_fn(4, 1, |k, _| 1.0 + k as f64);
        let rates = [0.9; 4];
        let mut path = FixedPoint::default();
        let mut x = Mat::zeros(4, 1);
        for _ in 0..5 {
            let to = step(&x, &rates, &end);
            let (next, _) = path.next(x, to.clone(), &Mat::identity(4, 4), |_| false);
            assert_eq!(next, to);
            x = next;
        }
    }
}
