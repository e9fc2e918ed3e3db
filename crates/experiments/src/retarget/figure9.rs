//! Figure 9: time and final cost of retargeting one motion of T = 740 from several starts, without and with
//! splines by quasi-Newton, and by the solver that knows the structure.

use super::page::Page;
use super::{Example, Scene};
use phiw_bspline_retarget::bspline::Basis;
use phiw_bspline_retarget::solver::{Iterations, QuasiNewton, Solution, quasi_newton, solve};
use phiw_bspline_retarget::{Calibration, MarkerRecording, Problem, RetargetOptions, Retargeter};
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
    let subject = Subject {
        retargeter: &retargeter,
        recording: &recording,
        calibration: calibration.as_ref(),
        iterations: Iterations { hard_limits: false, ..options.iterations },
    };
    let mut measured = Measured::default();
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    for start in 0..starts {
        let shift: Vec<f64> = (0..splines.coordinates())
            .map(|_| {
                let draw: f64 = StandardNormal.sample(&mut rng);
                SPREAD * draw
            })
            .collect();
        subject.run_all(start, [&samples, &splines], &shift, &mut measured)?;
    }
    measured.say(page);
    let better = measured.better();
    let (time, cost) = (median(&measured.seconds[better]), median(&measured.costs[better]));
    subject.say_when_as_low(time, cost, page)?;
    measured.draw(starts, page);
    Ok(())
}

/// What is retargeted, and how far the structured solver goes.
struct Subject<'a> {
    retargeter: &'a Retargeter,
    recording: &'a MarkerRecording,
    calibration: Option<&'a Calibration>,
    iterations: Iterations,
}

impl Subject<'_> {
    /// Runs all strategies from one start: rest, shifted by `shift` \[rad\].
    fn run_all(
        &self,
        start: usize,
        [samples, splines]: [&Problem<'_>; 2],
        shift: &[f64],
        measured: &mut Measured,
    ) -> anyhow::Result<()> {
        let shifted = |problem: &Problem<'_>| {
            let mut variables = self.retargeter.placed_at_rest(problem, self.calibration);
            let control = problem.basis().control_points() * shift.len();
            for (variable, shift) in variables[..control].iter_mut().zip(shift.iter().cycle()) {
                *variable += shift;
            }
            variables
        };
        let quasi = QuasiNewton::default();
        for (strategy, problem) in [samples, splines].into_iter().enumerate() {
            let way: RefCell<Vec<(f64, f64)>> = RefCell::default();
            measured.run(start, strategy, &|| {
                let begin = Instant::now();
                let seen = |cost| way.borrow_mut().push((begin.elapsed().as_secs_f64(), cost));
                Ok(quasi_newton(problem, shifted(problem), &quasi, &seen))
            })?;
            measured.as_good[strategy].push(as_good_as_done(&way.borrow()));
        }
        measured.run(start, 2, &|| Ok(solve(splines, shifted(splines), &self.iterations)))?;
        measured
            .run(start, 3, &|| self.own_start(&|problem, first| solve(problem, first, &self.iterations)))?;
        measured.run(start, 4, &|| {
            self.own_start(&|problem, first| quasi_newton(problem, first, &quasi, &|_| {}))
        })
    }

    /// From the recording on: the search for the start is in the time.
    fn own_start(&self, solver: &dyn Fn(&Problem<'_>, Vec<f64>) -> Solution) -> anyhow::Result<Solution> {
        let person = self.retargeter.person(self.recording, self.calibration)?;
        let problem = self.retargeter.problem(&person, self.recording);
        let first = self.retargeter.start(&problem, &person);
        Ok(solver(&problem, first))
    }

    /// The first number of steps of the structured solver that gives a cost as low, from the recording on,
    /// against the `time` \[s\] of another.
    fn say_when_as_low(&self, time: f64, cost: f64, page: &mut Page) -> anyhow::Result<()> {
        for most in 0..self.iterations.most {
            let begin = Instant::now();
            let iterations = Iterations { most, ..self.iterations };
            let solution = self.own_start(&|problem, first| solve(problem, first, &iterations))?;
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
        Ok(())
    }
}

/// What came of all starts.
#[derive(Default)]
struct Measured {
    /// Time of each strategy's runs \[s\].
    seconds: [Vec<f64>; STRATEGIES.len()],
    /// Final costs of each strategy's runs.
    costs: [Vec<f64>; STRATEGIES.len()],
    /// When the quasi-Newton methods could have stopped, had they known where they would end \[s\].
    as_good: [Vec<f64>; 2],
}

impl Measured {
    fn run(
        &mut self,
        start: usize,
        strategy: usize,
        solver: &dyn Fn() -> anyhow::Result<Solution>,
    ) -> anyhow::Result<()> {
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
        self.seconds[strategy].push(duration);
        self.costs[strategy].push(solution.cost.total());
        Ok(())
    }

    /// The quasi-Newton method with the lower cost.
    fn better(&self) -> usize {
        if median(&self.costs[0]) < median(&self.costs[1]) { 0 } else { 1 }
    }

    fn say(&self, page: &mut Page) {
        for (strategy, name) in STRATEGIES.iter().enumerate() {
            page.say(&format!(
                "{name}: median {:.3} s, cost {:.4}",
                median(&self.seconds[strategy]),
                median(&self.costs[strategy])
            ));
        }
        let better = self.better();
        page.say(&format!(
            "To its end the structured solver with its own start is {:.0} times as fast as the better of the two ({}), at {:.3} of its cost",
            median(&self.seconds[better]) / median(&self.seconds[3]),
            STRATEGIES[better],
            median(&self.costs[3]) / median(&self.costs[better])
        ));
        page.say(&format!(
            "Had the quasi-Newton method stopped as soon as it was within {:.1} % of its own final cost, which it cannot know, it would have \
             taken {:.3} s over samples and {:.3} s over B-splines: {:.0} times as long as the structured solver to its end",
            100.0 * AS_GOOD_AS_DONE,
            median(&self.as_good[0]),
            median(&self.as_good[1]),
            median(&self.as_good[better]) / median(&self.seconds[3])
        ));
    }

    fn draw(&self, starts: usize, page: &mut Page) {
        let places = STRATEGIES.map(str::to_owned);
        for (samples, label) in [(&self.seconds, "time [s]"), (&self.costs, "final cost")] {
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
    }
}

/// The first time at which a way of (time, cost) is nearly as low as it ever gets.
fn as_good_as_done(way: &[(f64, f64)]) -> f64 {
    let lowest = way.iter().fold(f64::INFINITY, |lowest, &(_, cost)| lowest.min(cost));
    let found = way.iter().find(|&&(_, cost)| cost <= (1.0 + AS_GOOD_AS_DONE) * lowest);
    found.map_or(f64::NAN, |&(time, _)| time)
}
