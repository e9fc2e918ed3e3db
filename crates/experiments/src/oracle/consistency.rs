//! Possible bodies that fit best: our optimum against CVXPY's.

use super::case::{self, Case};
use super::python::Python;
use anyhow::Context;
use phiw_consistency::{
    PARAMETERS_PER_BODY, PriorSettings, Problem, PseudoInertia, Settings, possible_priors,
};
use phiw_dynamics::random_tree::{RandomNumbers, random_state};
use phiw_regressor::JointTorqueRegressor;
use phiw_regressor::factor::FactorBuilder;
use serde::{Deserialize, Serialize};
use std::path::Path;
use std::time::{Duration, Instant};

/// CVXPY's side of the comparison.
const SCRIPT: &str = include_str!("cvxpy_oracle.py");
/// The largest relative difference of two optima that is the solvers' accuracy.
const TOLERANCE: f64 = 1e-6;
/// Robots of the shared data; with one that is made up where these are absent.
const ROBOTS: [&str; 5] = ["tx40", "kr300", "go2", "torobo20", "g1_29dof_rev_1_0"];

/// A problem as the script reads it.
#[derive(Serialize)]
struct Request {
    priors: Vec<f64>,
    extras: usize,
    weight: f64,
    matrix: Vec<f64>,
    target: Vec<f64>,
}

/// What the script finds.
#[derive(Deserialize)]
struct Answer {
    status: String,
    objective: f64,
    parameters: Vec<f64>,
}

/// Prints the table of differences to CVXPY; whether all are small.
///
/// # Errors
/// A robot cannot be read, or CVXPY fails.
pub fn compare(python: &Python, workspace: &Path, problems: usize, seed: u64) -> anyhow::Result<bool> {
    let folder = tempfile::tempdir()?;
    let mut robots: Vec<Case> = case::from_files(workspace)?;
    robots.retain(|case| {
        ROBOTS.contains(&case.robot.as_str()) && !case.options.floating_base && case.options.held.is_empty()
    });
    let missing = ROBOTS.len().saturating_sub(robots.len()) as u64;
    let mut made = case::random(folder.path(), seed, missing)?;
    made.retain(|case| !case.options.floating_base);
    robots.extend(made);
    let each = problems.div_ceil(robots.len().max(1));
    println!(
        "Optimum over possible bodies against CVXPY {} with Clarabel {}, {each} random problems for each robot, seed {seed}",
        python.version("cvxpy")?,
        python.version("clarabel")?
    );
    println!(
        "possible: our solutions whose bodies can all exist; agree: optima that differ by less than 1e-6, of the\nproblems that Clarabel solves, too"
    );
    println!(
        "difference: of the optima, relative; below: theirs less ours at the least; gap: our certificate, relative\n"
    );
    println!(
        "{:<18} {:>6} {:>9} {:>9} {:>11} {:>9} {:>9} {:>10} {:>8} {:>11}",
        "robot",
        "bodies",
        "possible",
        "agree",
        "difference",
        "below",
        "gap",
        "parameters",
        "steps",
        "ms, median"
    );
    let mut agrees = true;
    for robot in &robots {
        agrees &= row(python, folder.path(), robot, each, seed)?;
    }
    println!(
        "\nall possible, certified, never above Clarabel's optimum by {TOLERANCE:.0e}, and at least 95 % agree: {agrees}"
    );
    Ok(agrees)
}

fn row(python: &Python, folder: &Path, robot: &Case, count: usize, seed: u64) -> anyhow::Result<bool> {
    let mut random = RandomNumbers::new(seed);
    let requests: Vec<Request> =
        (0..count).map(|_| request(robot, &mut random)).collect::<anyhow::Result<_>>()?;
    std::fs::write(folder.join("problems.json"), serde_json::to_string(&requests)?)?;
    python.run(SCRIPT, [folder]).with_context(|| format!("CVXPY fails on {}", robot.robot))?;
    let answers: Vec<Answer> = serde_json::from_str(&std::fs::read_to_string(folder.join("optima.json"))?)?;

    let (mut difference, mut below, mut gap, mut apart) = (0.0_f64, f64::INFINITY, 0.0_f64, 0.0_f64);
    let (mut possible, mut certified, mut steps, mut answered, mut within) = (0, true, 0, 0, 0);
    let mut times: Vec<Duration> = Vec::new();
    for (request, answer) in requests.iter().zip(&answers) {
        let begin = Instant::now();
        let ours = problem(request)?.solve(request.weight, &Settings::default())?;
        times.push(begin.elapsed());
        let unit = 1.0 + ours.objective.abs();
        gap = gap.max(ours.gap / unit);
        certified &= ours.certified;
        steps = steps.max(ours.iterations);
        let bodies = ours.standard.as_chunks::<PARAMETERS_PER_BODY>().0;
        let all = bodies.iter().all(|body| PseudoInertia::of_parameters(body).is_possible());
        possible += usize::from(all && ours.extras.iter().all(|value| *value >= 0.0));
        if answer.status != "optimal" {
            continue;
        }
        answered += 1;
        within += usize::from((ours.objective - answer.objective).abs() < TOLERANCE * unit);
        difference = difference.max((ours.objective - answer.objective).abs() / unit);
        below = below.min((answer.objective - ours.objective) / unit);
        apart = apart.max(largest_difference(&[ours.standard, ours.extras].concat(), &answer.parameters));
    }
    times.sort();
    let median = times.get(times.len() / 2).map_or(0.0, |time| 1e3 * time.as_secs_f64());
    println!(
        "{:<18} {:>6} {:>9} {:>9} {:>11.1e} {:>9.1e} {:>9.1e} {:>10.1e} {:>8} {:>11.2}",
        robot.robot,
        requests.first().map_or(0, |request| request.priors.len() / PARAMETERS_PER_BODY),
        format!("{possible}/{count}"),
        format!("{within}/{answered}"),
        difference,
        below,
        gap,
        apart,
        steps,
        median
    );
    // Where Clarabel stops short its optimum is the higher one.
    Ok(below > -TOLERANCE
        && certified
        && possible == count
        && 20 * within >= 19 * answered
        && 2 * answered > count)
}

/// Largest difference of a parameter, over the largest of its body or of the extras.
fn largest_difference(ours: &[f64], theirs: &[f64]) -> f64 {
    let chunk = |(ours, theirs): (&[f64], &[f64])| {
        let largest = theirs.iter().fold(1e-6_f64, |largest, value| largest.max(value.abs()));
        let apart = ours.iter().zip(theirs).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        apart / largest
    };
    ours.chunks(PARAMETERS_PER_BODY).zip(theirs.chunks(PARAMETERS_PER_BODY)).map(chunk).fold(0.0, f64::max)
}

fn problem(request: &Request) -> anyhow::Result<Problem> {
    let priors = request.priors.as_chunks::<PARAMETERS_PER_BODY>().0;
    let mut problem = Problem::new(priors, request.extras)?.with_data(&request.matrix, &request.target)?;
    for extra in 0..request.extras {
        problem = problem.with_bounds(extra, 0.0, f64::INFINITY)?;
    }
    Ok(problem)
}

/// A problem of a few to many random states of the robot: bodies up to three times heavier or lighter than
/// the URDF's, one of them wrong in its sign now and then; viscous and Coulomb friction, some of it negative.
fn request(robot: &Case, random: &mut RandomNumbers) -> anyhow::Result<Request> {
    let tree = robot.read()?;
    let described = tree.inertial_parameters();
    let priors =
        possible_priors(described.as_chunks().0, 0.3, &PriorSettings::default()).as_flattened().to_vec();
    let (joints, standard) = (tree.joint_count(), priors.len());
    let extras = 2 * joints;
    let mut truth = Vec::with_capacity(standard + extras);
    for body in priors.chunks(PARAMETERS_PER_BODY) {
        let factor =
            random.uniform(-1.1, 1.1).exp() * if random.uniform(0.0, 1.0) < 0.1 { -1.0 } else { 1.0 };
        truth.extend(body.iter().map(|value| factor * value));
    }
    truth.extend((0..extras).map(|_| random.uniform(-0.3, 1.0)));
    let regressor = JointTorqueRegressor::new(&tree);
    let (mut pairs, mut scratch) = (vec![0.0; regressor.buffer_size()], regressor.scratch());
    let mut phi = vec![0.0; regressor.rows() * regressor.columns()];
    let columns = standard + extras;
    let mut builder = FactorBuilder::new(columns + 1);
    let noise = 10.0_f64.powf(random.uniform(-2.0, 0.0));
    for _ in 0..random.uniform(2.0, 60.0) as usize {
        let state = random_state(&tree, random);
        regressor.compute(&tree, &state.q, &state.v, &state.a, &mut scratch, &mut pairs)?;
        regressor.scatter(&pairs, &mut phi)?;
        for (joint, row) in phi.chunks_exact(regressor.columns()).enumerate() {
            let mut whole = vec![0.0; columns + 1];
            whole[..standard].copy_from_slice(row);
            whole[standard + joint] = state.v[joint];
            whole[standard + joints + joint] = state.v[joint].signum();
            let torque: f64 = whole.iter().zip(&truth).map(|(column, value)| column * value).sum();
            whole[columns] = torque + noise * random.uniform(-1.7, 1.7);
            whole.iter_mut().for_each(|value| *value /= noise);
            builder.push_row(&whole)?;
        }
    }
    let factor = builder.factor();
    let mut matrix = Vec::with_capacity((columns + 1) * columns);
    for row in 0..=columns {
        matrix.extend((0..columns).map(|column| factor.entry(row, column)));
    }
    let mut request = Request {
        priors,
        extras,
        weight: 10.0_f64.powf(random.uniform(-1.0, 3.0)),
        matrix,
        target: (0..=columns).map(|row| factor.entry(row, columns)).collect(),
    };
    request.weight = request.weight.max(problem(&request)?.least_weight());
    Ok(request)
}
