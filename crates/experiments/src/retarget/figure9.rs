//! Figure 9: time and final cost of retargeting one motion of T = 740 from several starts, without and with splines by quasi-Newton, and
//! by the solver that knows the structure.

use super::page::Page;
use super::{Example, Scene};
use phiw_bspline_retarget::bspline::Basis;
use phiw_bspline_retarget::solver::{Iterations, QuasiNewton, Solution, quasi_newton, solve};
use phiw_bspline_retarget::{Problem, RetargetOptions};
use phiw_report::plot::{BoxGroup, BoxPlot, box_plot};
use phiw_report::statistics::median;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use std::cell::RefCell;
use std::time::Instant;

/// Samples of the motion.
const SAMPLES: usize = 740;
/// Spread of the starts about rest \[rad\].
const SPREAD: f64 = 0.1;

/// A run is as good as done when it is so near to its own final cost.
const AS_GOOD_AS_DONE: f64 = 1e-3;

/// Names of the strategies, in the order of the picture.
const STRATEGIES: [&str; 5] = [
    "quasi-Newton, samples",
    "quasi-Newton, B-splines",
    "structured, same starts",
    "structured, own start",
    "quasi-Newton, B-splines, that start",
];

/// Runs all strategies from the same starts and draws time and cost.
///
/// # Errors
/// The motion cannot be read.
pub fn measure(scene: &Scene, starts: usize, seed: u64, page: &mut Page) -> anyhow::Result<()> {
    let mut options = RetargetOptions::default();
    // Samples without a spline have no second derivative: the same objective for all leaves it out.
    options.weights.acceleration = 0.0;
    // The paper's limits are a penalty.
    options.iterations.hard_limits = false;
    let Example { retargeter, mut recording, calibration, name } = scene.example(seed, options.clone())?;
    recording.positions_m.truncate(SAMPLES * recording.labels.len());
    page.heading(&format!("Figure 9: T = {} samples of {name}, {starts} starts", recording.frames()));

    let person = retargeter.person(&recording, calibration.as_ref())?;
    let splines = retargeter.problem(&person, &recording);
    let basis = Basis::clamped(1, recording.frames(), 0.0, recording.duration_s())?;
    let robot = Some(retargeter.robot());
    let samples = Problem::new(&person.body, robot, &recording, basis, options.weights);
    page.say(&format!(
        "{} variables over the control points, {} over the samples; the places of the markers on the skin are given",
        splines.variables(),
        samples.variables()
    ));
    let iterations = Iterations { hard_limits: false, ..options.iterations };
    let mut seconds = vec![Vec::new(); STRATEGIES.len()];
    let mut costs = vec![Vec::new(); STRATEGIES.len()];
    // When the quasi-Newton methods could have stopped, had they known where they would end.
    let mut as_good = [Vec::new(), Vec::new()];
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    for start in 0..starts {
        let shift: Vec<f64> = (0..splines.coordinates())
            .map(|_| {
                let draw: f64 = StandardNormal.sample(&mut random);
                SPREAD * draw
            })
            .collect();
        let shifted = |problem: &Problem<'_>| {
            let mut variables = retargeter.placed_at_rest(problem, calibration.as_ref());
            let control = problem.basis().control_points() * shift.len();
            for (variable, shift) in variables[..control].iter_mut().zip(shift.iter().cycle()) {
                *variable += shift;
            }
            variables
        };
        let mut run =
            |strategy: usize, solver: &dyn Fn() -> anyhow::Result<Solution>| -> anyhow::Result<()> {
                let begin = Instant::now();
                let solution = solver()?;
                let duration = begin.elapsed().as_secs_f64();
                println!(
                    "start {start}, {}: {duration:.3} s, cost {:.4}, {} steps, {:?}",
                    STRATEGIES[strategy],
                    solution.cost.total(),
                    solution.iterations,
                    solution.stop
                );
                seconds[strategy].push(duration);
                costs[strategy].push(solution.cost.total());
                Ok(())
            };
        let quasi = QuasiNewton::default();
        for (strategy, problem) in [&samples, &splines].into_iter().enumerate() {
            let way: RefCell<Vec<(f64, f64)>> = RefCell::default();
            run(strategy, &|| {
                let begin = Instant::now();
                let seen = |cost| way.borrow_mut().push((begin.elapsed().as_secs_f64(), cost));
                Ok(quasi_newton(problem, shifted(problem), &quasi, &seen))
            })?;
            as_good[strategy].push(as_good_as_done(&way.borrow()));
        }
        run(2, &|| Ok(solve(&splines, shifted(&splines), &iterations)))?;
        // From the recording on: the search for the start is in the time.
        let from_own_start =
            |solver: &dyn Fn(&Problem<'_>, Vec<f64>) -> Solution| -> anyhow::Result<Solution> {
                let person = retargeter.person(&recording, calibration.as_ref())?;
                let problem = retargeter.problem(&person, &recording);
                let first = retargeter.start(&problem, &person);
                Ok(solver(&problem, first))
            };
        run(3, &|| from_own_start(&|problem, first| solve(problem, first, &iterations)))?;
        run(4, &|| from_own_start(&|problem, first| quasi_newton(problem, first, &quasi, &|_| {})))?;
    }
    for (strategy, name) in STRATEGIES.iter().enumerate() {
        page.say(&format!(
            "{name}: median {:.3} s, cost {:.4}",
            median(&seconds[strategy]),
            median(&costs[strategy])
        ));
    }
    let better = if median(&costs[0]) < median(&costs[1]) { 0 } else { 1 };
    let (time, cost) = (median(&seconds[better]), median(&costs[better]));
    page.say(&format!(
        "To its end the structured solver with its own start is {:.0} times as fast as the better of the two ({}), at {:.3} of its cost",
        time / median(&seconds[3]),
        STRATEGIES[better],
        median(&costs[3]) / cost
    ));
    page.say(&format!(
        "Had the quasi-Newton method stopped as soon as it was within {:.1} % of its own final cost, which it cannot know, it would have \
         taken {:.3} s over samples and {:.3} s over B-splines: {:.0} times as long as the structured solver to its end",
        100.0 * AS_GOOD_AS_DONE,
        median(&as_good[0]),
        median(&as_good[1]),
        median(&as_good[better]) / median(&seconds[3])
    ));
    // The first number of steps that gives a cost as low, from the recording on.
    for most in 0..iterations.most {
        let begin = Instant::now();
        let person = retargeter.person(&recording, calibration.as_ref())?;
        let problem = retargeter.problem(&person, &recording);
        let first = retargeter.start(&problem, &person);
        let solution = solve(&problem, first, &Iterations { most, ..iterations });
        let duration = begin.elapsed().as_secs_f64();
        if solution.cost.total() <= cost {
            page.say(&format!(
                "To the same cost ({:.4} against {cost:.4}) it takes {duration:.3} s: {:.0} times as fast",
                solution.cost.total(),
                time / duration
            ));
            break;
        }
    }
    let places = STRATEGIES.map(str::to_owned);
    for (samples, label) in [(&seconds, "time [s]"), (&costs, "final cost")] {
        let groups = [BoxGroup { name: "starts", samples }];
        let plot = BoxPlot {
            groups: &groups,
            places: &places,
            x_label: "strategy",
            y_label: label,
            logarithmic: true,
        };
        page.picture(box_plot(&plot).as_str(), &format!("{label} over {starts} starts"));
    }
    Ok(())
}

/// The first time at which a way of (time, cost) is nearly as low as it ever gets.
fn as_good_as_done(way: &[(f64, f64)]) -> f64 {
    let lowest = way.iter().fold(f64::INFINITY, |lowest, &(_, cost)| lowest.min(cost));
    let found = way.iter().find(|&&(_, cost)| cost <= (1.0 + AS_GOOD_AS_DONE) * lowest);
    found.map_or(f64::NAN, |&(time, _)| time)
}
