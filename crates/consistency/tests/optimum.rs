//! The optimum against independent answers.

use crate::random;

use faer::Mat;
use faer::prelude::SolveLstsq;
use phiw_consistency::{Ellipsoid, MatrixTerm, Problem, PseudoInertia, Settings};
use random::{Random, data, problem, robot};

fn assert_near(what: &str, found: &[f64], expected: &[f64], tolerance: f64) {
    let largest = expected.iter().fold(1e-12_f64, |largest, value| largest.max(value.abs()));
    for (index, (found, expected)) in found.iter().zip(expected).enumerate() {
        assert!(
            (found - expected).abs() <= tolerance * largest,
            "{what}: number {index} is {found}, not {expected}"
        );
    }
}

#[test]
fn where_least_squares_is_possible_a_light_prior_gives_it() {
    for seed in 0..12 {
        let mut random = Random::new(seed);
        let (bodies, extras) = (1 + seed as usize % 6, seed as usize % 4);
        let (priors, truth) = robot(&mut random, bodies, extras);
        let rows = 3 * truth.len();
        // So much data that the least-squares bodies are near the true ones.
        let data = data(&mut random, &truth, rows, 300.0);
        let matrix = Mat::from_fn(rows, truth.len(), |row, column| data.0[row * truth.len() + column]);
        let target = Mat::from_fn(rows, 1, |row, _| data.1[row]);
        let least_squares = matrix.qr().solve_lstsq(target);
        let least_squares: Vec<f64> = (0..truth.len()).map(|row| least_squares[(row, 0)]).collect();

        let solution = problem(&priors, extras, &data).solve(1e-9, &Settings::default()).unwrap();
        assert!(solution.certified, "{solution:?}");
        let found = [solution.standard, solution.extras].concat();
        assert_near(&format!("seed {seed}"), &found, &least_squares, 1e-5);
    }
}

#[test]
fn a_heavy_prior_gives_itself() {
    let mut random = Random::new(3);
    let (priors, truth) = robot(&mut random, 4, 2);
    let data = data(&mut random, &truth, 100, 1.0);
    let solution = problem(&priors, 2, &data).solve(1e12, &Settings::default()).unwrap();
    assert!(solution.certified, "{solution:?}");
    assert_near("prior", &solution.standard, priors.as_flattened(), 1e-6);
}

/// For one body of which only the scale is told, the optimum is a root of a quadratic: with P = s·P⁰,
/// ½(a·s − b)² + λ·4(s − 1 − log s).
#[test]
fn one_body_of_known_shape_has_a_closed_form() {
    let prior = [2.0, 0.0, 0.0, 0.0, 0.1, 0.0, 0.1, 0.0, 0.0, 0.1];
    for (factor, target, weight) in
        [(3.0, 10.0, 0.5), (1.0, -20.0, 2.0), (100.0, 1.0, 1e-3), (1.0, 1e4, 1e-2)]
    {
        // A multiple of the gradient of log det P at the prior, so that its multiples stay optimal.
        let inverse = [1.0 / 2.0, 0.0, 0.0, 0.0, 10.0, 0.0, 10.0, 0.0, 0.0, 10.0];
        let row: Vec<f64> = inverse.iter().map(|value| factor / 4.0 * value).collect();
        let problem = Problem::new(&[prior], 0).unwrap().with_data(&row, &[target]).unwrap();
        let solution = problem.solve(weight, &Settings::default()).unwrap();
        // factor²s² + (4λ − factor·target)s − 4λ = 0
        let half = 4.0 * weight - factor * target;
        let root = (half * half + 16.0 * weight * factor * factor).sqrt();
        let scale =
            if half > 0.0 { 8.0 * weight / (half + root) } else { (root - half) / (2.0 * factor * factor) };
        let expected: Vec<f64> = prior.iter().map(|value| scale * value).collect();
        assert!(solution.certified, "{solution:?}");
        assert_near(&format!("{factor} {target} {weight}"), &solution.standard, &expected, 1e-6);
    }
}

#[test]
fn known_masses_a_known_total_and_equal_limbs_are_met() {
    let mut random = Random::new(8);
    let (priors, truth) = robot(&mut random, 4, 2);
    let data = data(&mut random, &truth, 30, 10.0);
    let total: Vec<(usize, f64)> = (0..4).map(|body| (10 * body, 1.0)).collect();
    let mut problem = problem(&priors, 2, &data)
        .with_equality(&[(0, 1.0)], 3.0)
        .unwrap()
        .with_equality(&total, 40.0)
        .unwrap();
    for parameter in 0..10 {
        problem = problem.with_equality(&[(10 + parameter, 1.0), (20 + parameter, -1.0)], 0.0).unwrap();
    }
    let solution = problem.solve(1.0, &Settings::default()).unwrap();
    assert!(solution.certified, "{solution:?}");
    let standard = &solution.standard;
    assert_near("mass", &standard[..1], &[3.0], 1e-12);
    assert_near("total", &[standard.iter().step_by(10).sum::<f64>()], &[40.0], 1e-12);
    assert_near("limbs", &standard[10..20], &standard[20..30], 1e-12);
}

#[test]
fn all_mass_stays_inside_the_ellipsoid() {
    let mut random = Random::new(9);
    let (priors, truth) = robot(&mut random, 2, 0);
    let data = data(&mut random, &truth, 60, 10.0);
    let ellipsoid = Ellipsoid { center: [0.02, 0.0, -0.01], half_axes: [0.05, 0.03, 0.04] };
    let free = problem(&priors, 0, &data);
    let problem = free.clone().with_ellipsoid(1, &ellipsoid).unwrap();
    let solution = problem.solve(1.0, &Settings::default()).unwrap();
    assert!(solution.certified, "{solution:?}");
    let inside = |standard: &[f64]| {
        let body: [f64; 10] = standard[10..20].try_into().unwrap();
        let moments = PseudoInertia::of_parameters(&body);
        let axis = |axis: usize| {
            let (center, half) = (ellipsoid.center[axis], ellipsoid.half_axes[axis]);
            let about = moments.entry(axis, axis) - 2.0 * center * moments.entry(axis, 3)
                + center * center * moments.entry(3, 3);
            about / (half * half)
        };
        (axis(0) + axis(1) + axis(2)) / moments.entry(3, 3)
    };
    assert!(inside(&solution.standard) <= 1.0, "{}", inside(&solution.standard));
    let unbounded = free.solve(1.0, &Settings::default()).unwrap();
    assert!(inside(&unbounded.standard) > 1.0 && unbounded.objective < solution.objective);
}

/// Along each axis the mean square distance from the middle is at most that of the box's half edge.
#[test]
fn all_mass_stays_inside_the_box() {
    let mut random = Random::new(9);
    let (priors, truth) = robot(&mut random, 2, 0);
    let data = data(&mut random, &truth, 60, 10.0);
    let (lower, upper) = ([-0.03, -0.03, -0.05], [0.07, 0.03, 0.03]);
    let free = problem(&priors, 0, &data);
    let solved = free.clone().with_box(1, lower, upper).unwrap().solve(1.0, &Settings::default()).unwrap();
    assert!(solved.certified, "{solved:?}");
    let outside = |standard: &[f64]| -> Vec<f64> {
        let body: [f64; 10] = standard[10..20].try_into().unwrap();
        let moments = PseudoInertia::of_parameters(&body);
        let axis = |axis: usize| {
            let (center, half) = (0.5 * (lower[axis] + upper[axis]), 0.5 * (upper[axis] - lower[axis]));
            let about = moments.entry(axis, axis) - 2.0 * center * moments.entry(axis, 3)
                + center * center * moments.entry(3, 3);
            about / (half * half * moments.entry(3, 3))
        };
        (0..3).map(axis).collect()
    };
    assert!(outside(&solved.standard).iter().all(|share| *share <= 1.0), "{:?}", outside(&solved.standard));
    let unbounded = free.solve(1.0, &Settings::default()).unwrap();
    assert!(outside(&unbounded.standard).iter().any(|share| *share > 1.0));
    assert!(unbounded.objective < solved.objective);
    assert!(free.clone().with_box(1, upper, lower).is_err() && free.with_box(7, lower, upper).is_err());
}

#[test]
fn coupled_friction_takes_energy_in_every_motion() {
    let mut random = Random::new(10);
    let (priors, _) = robot(&mut random, 1, 0);
    // Friction of two joints and what crosses over: the data say 1, 1 and 4.
    let mut matrix = vec![0.0; 3 * 13];
    (0..3).for_each(|row| matrix[row * 13 + 10 + row] = 10.0);
    let terms = [(0, 0, 0), (1, 1, 1), (2, 0, 1)].map(|(extra, row, column)| MatrixTerm {
        extra,
        row,
        column,
        factor: 1.0,
    });
    let problem = Problem::new(&priors, 3).unwrap().with_data(&matrix, &[10.0, 10.0, 40.0]).unwrap();
    let solution = problem.with_dissipative(2, &terms).unwrap().solve(1.0, &Settings::default()).unwrap();
    assert!(solution.certified, "{solution:?}");
    let [first, second, cross] = solution.extras[..] else { panic!("{solution:?}") };
    // By symmetry first = second = cross at the optimum: least of 2(f − 1)² + (f − 4)².
    assert_near("friction", &[first, second, cross], &[2.0, 2.0, 2.0], 1e-4);
    assert!(first * second >= cross * cross);
}

/// What `crates/experiments/src/oracle/cvxpy_oracle.py` (CVXPY 1.9.3, Clarabel 0.11.1) finds on the same
/// problems: seed, bodies, extras, rows, scale of the data, weight of the prior, sign of the truth; the
/// optimum and the first body's mass there.
const FOUND_BY_CVXPY: [([f64; 7], f64, f64); 6] = [
    ([1.0, 1.0, 0.0, 6.0, 10.0, 1.0, 1.0], 5.522586569766255, 9.749800324287815),
    ([2.0, 2.0, 2.0, 40.0, 10.0, 1.0, 1.0], 18.059053063933952, 17.303265257558323),
    ([3.0, 3.0, 1.0, 10.0, 1.0, 0.1, 1.0], 0.6913093276863043, 13.765314640953818),
    ([4.0, 2.0, 3.0, 60.0, 3.0, 10.0, -1.0], 27293.09849726616, 0.0040510380650955885),
    ([5.0, 4.0, 4.0, 30.0, 30.0, 100.0, 1.0], 2611.920891341872, 3.795018383100314),
    ([6.0, 1.0, 1.0, 0.0, 1.0, 5.0, 1.0], 0.0, 8.814621639363358),
];

#[test]
fn another_solver_finds_the_same_optimum() {
    for ([seed, bodies, extras, rows, scale, weight, sign], optimum, mass) in FOUND_BY_CVXPY {
        let mut random = Random::new(seed as u64);
        let extras = extras as usize;
        let (priors, mut truth) = robot(&mut random, bodies as usize, extras);
        truth.iter_mut().for_each(|value| *value *= sign);
        let data = data(&mut random, &truth, rows as usize, scale);
        let solution = problem(&priors, extras, &data).solve(weight, &Settings::default()).unwrap();
        assert!(solution.certified, "{seed}: {solution:?}");
        let apart = (solution.objective - optimum).abs();
        assert!(apart < 1e-8 * (1.0 + optimum), "{seed}: {} or {optimum}", solution.objective);
        assert_near(&format!("mass of problem {seed}"), &solution.standard[..1], &[mass], 1e-5);
    }
}
