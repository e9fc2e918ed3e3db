//! Figures 3 to 8 of the paper, redrawn. Figure 9 is that of `cargo xtask retarget`.

use super::arm::Arm;
use super::page::Page;
use super::report::Results;
use super::score::Detail;
use super::setup::Settings;
use phiw_report::plot::{
    BoxGroup, BoxPlot, IterationLine, Iterations, Line, MapRow, MotionMap, SupportMap, Svg, box_plot,
    iterations, motion_map, support_map,
};
use phiw_report::statistics::median;

/// Draws everything that there are runs of.
pub fn draw(results: &Results, page: &mut Page) {
    page.heading("Figure 3: the dataset");
    let motions = &results.settings.dataset;
    let own: Vec<f64> = motions.iter().map(|motion| motion.condition_number).collect();
    let row = [MapRow { name: "", values: &own, allowed: &[], chosen: None }];
    let groups = groups(&results.settings);
    let map =
        MotionMap { rows: &row, groups: &groups, y_label: "", value_label: "cond(Φ) of the motion alone" };
    let shortest = motions.iter().map(|motion| motion.duration_s).fold(f64::INFINITY, f64::min);
    let longest = motions.iter().map(|motion| motion.duration_s).fold(0.0, f64::max);
    page.picture(
        motion_map(&map).as_str(),
        &format!("{} motions of {shortest:.1} to {longest:.1} s, sorted by name.", motions.len()),
    );
    if let Some(run) = results.representative() {
        page.heading("Figure 4: a curriculum");
        page.picture(
            choices(&run.details, &results.settings).as_str(),
            "Framed: allowed by the constraint. The darker, the smaller cond of all measured rows and the motion's, relative to its row.",
        );
        page.heading("Figure 5: the ZMP and the reduced support");
        let pictures: Vec<String> =
            balance(&run.details, &results.settings).iter().map(Svg::to_string).collect();
        page.pictures(&pictures, "ZMP of each chosen reference by (8), under the belief of the time.");
    }
    page.heading("Figure 6: error of the parameters");
    parameters(results, page);
    page.heading("Figure 7: cond(Φ), curriculum and random choice");
    conditions(results, page);
    page.heading("Figure 8: torque error on held-out motions");
    torques(results, page);
    page.heading("What a second of the robot's time is worth");
    super::seconds::draw(results, page);
    page.heading("Relaxation");
    relaxation(results, page);
}

/// The tasks, each with its first motion: motions are sorted by name.
fn groups(settings: &Settings) -> Vec<(String, usize)> {
    let mut groups: Vec<(String, usize)> = Vec::new();
    for (index, motion) in settings.dataset.iter().enumerate() {
        if groups.last().is_none_or(|(task, _)| *task != motion.task) {
            groups.push((motion.task.clone(), index));
        }
    }
    groups
}

fn iteration_names(count: usize) -> Vec<String> {
    (1..=count).map(|iteration| iteration.to_string()).collect()
}

/// What each iteration of a run chose from.
pub fn choices(details: &[Detail], settings: &Settings) -> Svg {
    let groups = groups(settings);
    let names = iteration_names(details.len());
    let rows: Vec<MapRow<'_>> = details
        .iter()
        .zip(&names)
        .map(|(detail, name)| MapRow {
            name,
            values: &detail.condition_numbers,
            allowed: &detail.allowed,
            chosen: Some(detail.chosen),
        })
        .collect();
    let map =
        MotionMap {
            rows: &rows, groups: &groups, y_label: "iteration", value_label: "cond(Φ) of the stack"
        };
    motion_map(&map)
}

/// ZMP of what each iteration of a run chose, in the support and the reduced support.
pub fn balance(details: &[Detail], settings: &Settings) -> Vec<Svg> {
    let picture = |(index, detail): (usize, &Detail)| {
        let [x, y] = [0, 1].map(|axis| detail.zmp.iter().map(|zmp| zmp[axis]).collect::<Vec<f64>>());
        let about = settings.about;
        let shrunk = |corner: &[f64; 2]| {
            [0, 1].map(|axis| about[axis] + (1.0 - detail.alpha) * (corner[axis] - about[axis]))
        };
        let reduced: Vec<[f64; 2]> = settings.support.iter().map(shrunk).collect();
        let title = format!("{}: α = {:.2}   y [m]", index + 1, detail.alpha);
        let map = SupportMap {
            points: Line { x: &x, y: &y },
            support: &settings.support,
            allowed: &reduced,
            title: &title,
        };
        support_map(&map)
    };
    details.iter().enumerate().map(picture).collect()
}

fn boxes(page: &mut Page, groups: &[(&str, Vec<Vec<f64>>)], places: &[String], label: &str, caption: &str) {
    let groups: Vec<BoxGroup<'_>> = groups
        .iter()
        .filter(|(_, samples)| samples.iter().any(|samples| !samples.is_empty()))
        .map(|(name, samples)| BoxGroup { name, samples })
        .collect();
    let plot = BoxPlot { groups: &groups, places, x_label: "iteration", y_label: label, logarithmic: true };
    page.picture(box_plot(&plot).as_str(), caption);
}

/// `initial`, then the iterations.
fn with_initial(count: usize) -> Vec<String> {
    std::iter::once("initial".to_owned()).chain(iteration_names(count)).collect()
}

fn parameters(results: &Results, page: &mut Page) {
    let scores = |value: fn(&super::score::Score) -> Option<f64>| {
        results.scores(results.home(), Arm::Curriculum, value)
    };
    let groups = [
        ("curriculum", scores(|score| Some(score.rmse_w))),
        ("same logs, (4)", scores(|score| score.rmse_w_least_squares)),
        ("same logs, weighted", scores(|score| score.rmse_w_weighted)),
    ];
    let others = [("random choice", Arm::Random), ("torque-optimal", Arm::TorqueOptimal)];
    let others =
        others.map(|(name, arm)| (name, results.scores(results.home(), arm, |score| Some(score.rmse_w))));
    let groups: Vec<_> = groups.into_iter().chain(others).collect();
    let last = groups[0].1.last().map_or(f64::NAN, |values| median(values));
    boxes(
        page,
        &groups,
        &with_initial(results.settings.iterations),
        "RMSE_w",
        &format!("Median after the last iteration {last:.3}; the paper's is 0.243."),
    );
}

fn conditions(results: &Results, page: &mut Page) {
    let cond = |arm| results.records(results.home(), arm, |record| record.condition_number);
    let groups = [
        ("curriculum", cond(Arm::Curriculum)),
        ("random", cond(Arm::Random)),
        ("torque-optimal", cond(Arm::TorqueOptimal)),
    ];
    boxes(
        page,
        &groups,
        &iteration_names(results.settings.iterations),
        "cond(Φ)",
        "Of all that was measured so far.",
    );
}

fn torques(results: &Results, page: &mut Page) {
    let scores = |arm| results.scores(results.home(), arm, |score| Some(score.rmse_torque));
    let [a, b] = &results.settings.tasks;
    let groups = [
        (a.as_str(), scores(Arm::TaskA)),
        (b.as_str(), scores(Arm::TaskB)),
        ("curriculum", scores(Arm::Curriculum)),
        ("random", scores(Arm::Random)),
        ("torque-optimal", scores(Arm::TorqueOptimal)),
    ];
    boxes(
        page,
        &groups,
        &with_initial(results.settings.iterations),
        "RMSE_τ [N·m]",
        &format!("{} motions that no run ever saw, measured without noise.", results.settings.held_out.len()),
    );
}

fn relaxation(results: &Results, page: &mut Page) {
    let motions = results.settings.dataset.len() as f64;
    let medians =
        |series: Vec<Vec<f64>>| -> Vec<f64> { series.iter().map(|values| median(values)).collect() };
    let [alpha_curriculum, alpha_random] = [Arm::Curriculum, Arm::Random]
        .map(|arm| medians(results.records(results.home(), arm, |record| Some(record.alpha))));
    let [share_curriculum, share_random] = [Arm::Curriculum, Arm::Random].map(|arm| {
        medians(results.records(results.home(), arm, |record| Some(record.allowed as f64 / motions)))
    });
    for (label, curriculum, random) in [
        ("α", &alpha_curriculum, &alpha_random),
        ("share of motions allowed", &share_curriculum, &share_random),
    ] {
        let lines = [
            IterationLine { name: "curriculum", values: curriculum },
            IterationLine { name: "random", values: random },
        ];
        let plot =
            Iterations { lines: &lines, x_label: "iteration", y_label: label, first: 1, logarithmic: false };
        page.picture(iterations(&plot).as_str(), "Medians over the seeds.");
    }
}
