//! Bases and curves against closed forms and independent ways to compute the same.

use phiw_bspline_retarget::backward_differences;
use phiw_bspline_retarget::bspline::{Basis, BasisError, Curve};
use proptest::prelude::*;

/// Cox and de Boor's recursion, function by function, exactly as it stands in a textbook.
fn naive(knots: &[f64], degree: usize, index: usize, t: f64) -> f64 {
    if degree == 0 {
        return f64::from(u8::from(knots[index] <= t && t < knots[index + 1]));
    }
    let part = |factor: f64, width: f64, lower: usize| {
        if width == 0.0 { 0.0 } else { factor / width * naive(knots, degree - 1, lower, t) }
    };
    part(t - knots[index], knots[index + degree] - knots[index], index)
        + part(knots[index + degree + 1] - t, knots[index + degree + 1] - knots[index + 1], index + 1)
}

fn basis() -> impl Strategy<Value = Basis> {
    (1usize..6, 0usize..9, 0.05f64..3.0, -2.0f64..2.0, 0..3).prop_flat_map(
        |(degree, more, length, start, kind)| {
            let count = degree + 1 + more;
            proptest::collection::vec(0.0f64..1.0, count + degree + 1).prop_map(move |mut steps| match kind {
                0 => Basis::uniform(degree, count, start, start + length).unwrap(),
                1 => Basis::clamped(degree, count, start, start + length).unwrap(),
                _ => {
                    // Some knots coincide, but never so many that the curve jumps.
                    let mut knot = start;
                    steps.iter_mut().enumerate().for_each(|(index, step)| {
                        knot += if *step < 0.15 && index % 2 == 0 && more > 0 { 0.0 } else { 0.1 + *step };
                        *step = knot;
                    });
                    Basis::from_knots(degree, steps).unwrap()
                }
            })
        },
    )
}

/// All functions' derivatives at `t`, zeros included.
fn all(basis: &Basis, order: usize, t: f64) -> Vec<f64> {
    let mut local = vec![0.0; basis.degree() + 1];
    let first = basis.derivative(order, t, &mut local);
    let mut values = vec![0.0; basis.control_points()];
    values[first..=first + basis.degree()].copy_from_slice(&local);
    values
}

proptest! {
    #[test]
    fn values_are_those_of_the_textbook_and_sum_to_one(basis in basis(), share in 0.0f64..1.0) {
        let (start, end) = basis.domain();
        let t = start + share * (end - start);
        let values = all(&basis, 0, t);
        prop_assert!((values.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        for (index, &value) in values.iter().enumerate() {
            prop_assert!(value >= -1e-15);
            prop_assert!((value - naive(basis.knots(), basis.degree(), index, t)).abs() < 1e-12);
        }
    }

    #[test]
    fn every_derivative_is_the_slope_of_the_one_below(basis in basis(), share in 0.0f64..1.0) {
        let (start, end) = basis.domain();
        let t = start + share * (end - start);
        // A piece is a polynomial: its central difference is exact to the third derivative, if no knot is
        // between.
        let step = 1e-4;
        prop_assume!(basis.first(t - step) == basis.first(t + step));
        for order in 1..=basis.degree() {
            let slope = all(&basis, order, t);
            let (before, after) = (all(&basis, order - 1, t - step), all(&basis, order - 1, t + step));
            let third = all(&basis, order + 2, t).iter().fold(0.0f64, |most, value| most.max(value.abs()));
            let scale = before.iter().fold(1.0f64, |most, value| most.max(value.abs()));
            for index in 0..slope.len() {
                let difference = (after[index] - before[index]) / (2.0 * step);
                prop_assert!((slope[index] - difference).abs() <= third * step * step + scale * 1e-9);
            }
        }
        prop_assert!(all(&basis, basis.degree() + 1, t).iter().all(|&value| value == 0.0));
    }

    /// Marsden: with the Greville abscissae as control points a curve of degree ≥ 1 is the identity.
    #[test]
    fn greville_abscissae_reproduce_time(basis in basis(), share in 0.0f64..=1.0) {
        let degree = basis.degree();
        let control: Vec<f64> = (0..basis.control_points())
            .map(|point| basis.knots()[point + 1..=point + degree].iter().sum::<f64>() / degree as f64)
            .collect();
        let (start, end) = basis.domain();
        let t = start + share * (end - start);
        let curve = Curve::new(basis, 1, control).unwrap();
        let (mut scratch, mut point) = (vec![0.0; degree + 1], [0.0]);
        curve.evaluate(0, t, &mut scratch, &mut point);
        prop_assert!((point[0] - t).abs() < 1e-11);
        curve.evaluate(1, t, &mut scratch, &mut point);
        prop_assert!((point[0] - 1.0).abs() < 1e-9);
    }

    #[test]
    fn the_derivative_is_a_curve(basis in basis(), share in 0.0f64..1.0, seed in 0u64..1000) {
        let degree = basis.degree();
        let control: Vec<f64> =
            (0..2 * basis.control_points()).map(|i| ((i as u64 * 7919 + seed) % 97) as f64 / 97.0).collect();
        let (start, end) = basis.domain();
        let t = start + share * (end - start);
        let curve = Curve::new(basis.clone(), 2, control).unwrap();
        let derivative = curve.derivative().unwrap();
        let mut scratch = vec![0.0; degree + 1];
        let (mut direct, mut other) = ([0.0; 2], [0.0; 2]);
        for order in 1..=degree {
            curve.evaluate(order, t, &mut scratch, &mut direct);
            derivative.evaluate(order - 1, t, &mut scratch, &mut other);
            // Of what is summed: between close knots large terms may cancel.
            let terms: f64 = all(&basis, order, t).iter().map(|value| value.abs()).sum();
            for i in 0..2 {
                prop_assert!((direct[i] - other[i]).abs() <= 1e-9 * terms.max(1.0));
            }
        }
    }

    #[test]
    fn no_time_is_too_strange(basis in basis(), t in proptest::num::f64::ANY, order in 0usize..9) {
        all(&basis, order, t);
    }
}

#[test]
fn a_uniform_cubic_has_the_well_known_weights() {
    let basis = Basis::uniform(3, 8, 0.0, 5.0).unwrap();
    for (order, expected) in
        [(0, [1.0 / 6.0, 2.0 / 3.0, 1.0 / 6.0, 0.0]), (1, [-0.5, 0.0, 0.5, 0.0]), (2, [1.0, -2.0, 1.0, 0.0])]
    {
        let mut values = [0.0; 4];
        assert_eq!(basis.derivative(order, 2.0, &mut values), 2);
        for (value, expected) in values.iter().zip(expected) {
            assert!((value - expected).abs() < 1e-12, "order {order}: {values:?}");
        }
    }
}

#[test]
fn a_clamped_curve_starts_and_ends_at_its_control_points() {
    let basis = Basis::clamped(3, 7, 1.0, 2.0).unwrap();
    assert_eq!(all(&basis, 0, 1.0), [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    assert_eq!(all(&basis, 0, 2.0), [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]);
}

#[test]
fn what_is_no_basis_is_refused() {
    let too_few = BasisError::TooFewControlPoints { control_points: 3, degree: 3 };
    assert_eq!(Basis::uniform(3, 3, 0.0, 1.0), Err(too_few.clone()));
    assert_eq!(Basis::from_knots(3, vec![0.0; 7]), Err(too_few));
    assert!(matches!(Basis::clamped(3, 9, 1.0, 1.0), Err(BasisError::Domain { .. })));
    assert!(matches!(Basis::clamped(3, 9, 0.0, f64::NAN), Err(BasisError::Domain { .. })));
    let knot = |knots: &[f64]| Basis::from_knots(1, knots.to_vec());
    assert!(matches!(knot(&[0.0, 1.0, 0.5, 2.0]), Err(BasisError::Knot { index: 2, .. })));
    assert!(matches!(knot(&[0.0, 1.0, 1.0, 2.0]), Err(BasisError::Knot { index: 1, .. })));
    let curve = Curve::new(Basis::clamped(3, 9, 0.0, 1.0).unwrap(), 2, vec![0.0; 17]).unwrap_err();
    assert_eq!((curve.found, curve.control_points, curve.dimension), (17, 9, 2));
}

#[test]
fn backward_differences_are_the_papers() {
    // (16) by hand: two coordinates, three samples, 0.5 s apart.
    let q = [1.0, 0.0, 2.0, 0.0, 4.0, -1.0];
    let (mut v, mut a) = ([9.0; 6], [9.0; 6]);
    backward_differences(&q, 2, 0.5, &mut v, &mut a).unwrap();
    assert_eq!(v, [0.0, 0.0, 2.0, 0.0, 4.0, -2.0]);
    assert_eq!(a, [0.0, 0.0, 4.0, 0.0, 4.0, -4.0]);
    assert!(backward_differences(&q, 4, 0.5, &mut v, &mut a).is_err());
}
