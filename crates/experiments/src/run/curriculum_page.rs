//! The page of a curriculum with the loop closed.

use super::curriculum::Outcome;
use crate::paper::{RunFile, Score, balance, choices};
use phiw_dynamics::Tree;
use phiw_effects::sentence;
use phiw_estimation::RobotModel;
use phiw_identification::fitting::TorqueError;
use phiw_plant::{Friction, PlantEffect};
use phiw_report::number::{percent, significant};
use phiw_report::page::{ExperimentPage, Picture, Section, Table};
use phiw_report::plot::{BarGroup, IterationLine, Iterations, JointBars, iterations, joint_bars};

/// The page.
///
/// # Errors
/// A belief is not of the robot.
pub fn page(outcome: &Outcome) -> anyhow::Result<ExperimentPage> {
    let settings = &outcome.setup.settings;
    let found = found(outcome, &outcome.runs[1].run.model)?;
    let durations: f64 = outcome.setup.dataset.motions().iter().map(|motion| motion.duration_s()).sum();
    Ok(ExperimentPage {
        title: "A curriculum that finds what nobody declared".to_owned(),
        date: String::new(),
        headline: headline(outcome, &found),
        inputs: [
            ("robot", format!("models/upper_body18.urdf: 18 joints, {} base parameters", settings.parameters.len())),
            (
                "motions",
                format!(
                    "{} to choose from ({durations:.0} s), {} held out: {}, not measured on people, retargeted from markers",
                    settings.dataset.len(),
                    settings.held_out.len(),
                    settings.motions
                ),
            ),
            (
                "plant",
                format!(
                    "{}, torque noise of {} % of the limits that moves the robot and is not in the log, small gains",
                    settings.backend,
                    percent(settings.noise)
                ),
            ),
            ("declared", "rigid body, viscous friction".to_owned()),
            ("in the plant beside that", truth(&outcome.secret, outcome.setup.robot.tree())),
            ("initial model", "each parameter anything between nothing and twice its true value".to_owned()),
        ]
        .map(|(name, value)| [name.to_owned(), value])
        .into(),
        sections: vec![
            iterations_section(outcome),
            chosen(outcome),
            effect(outcome, &found),
        ],
        version: format!("phiw {}", env!("CARGO_PKG_VERSION")),
        command_line: "cargo xtask run".to_owned(),
    })
}

/// What a belief has beside the declared effects, in sentences.
fn found(outcome: &Outcome, model: &RobotModel) -> anyhow::Result<Vec<String>> {
    let robot = &outcome.setup.robot;
    let design = robot.design(&model.specs())?;
    let declared = robot.declared().len();
    let effects = design.effects().iter().zip(&model.effects).skip(declared);
    Ok(effects
        .map(|(effect, known)| sentence(&known.spec, &effect.parameters(), &known.parameters))
        .collect())
}

/// The answer.
fn headline(outcome: &Outcome, found: &[String]) -> Vec<String> {
    let [initial, open, closed] = [0, 1, 2].map(|which| pooled(outcome, which));
    let last = |run: usize| outcome.runs[run].scores.last().map_or(f64::NAN, |score| score.rmse_w);
    let [first, ..] = outcome.runs[1].scores.as_slice() else { return Vec::new() };
    let answer = match found {
        [] => "Nothing was found that the declared model lacks, though there is something.".to_owned(),
        found => format!("{} Nobody had declared it: the curriculum's own logs told.", found.join(" ")),
    };
    vec![
        answer,
        format!(
            "Torque error on {} held-out motions {} N·m → {} N·m in {} iterations; with the declared model alone {} N·m.",
            outcome.setup.settings.held_out.len(),
            significant(initial, 3),
            significant(closed, 3),
            outcome.runs[1].run.history.len(),
            significant(open, 3),
        ),
        format!(
            "RMSE of the parameters {} → {}; with the declared model alone {}.",
            significant(first.rmse_w, 3),
            significant(last(1), 3),
            significant(last(0), 3),
        ),
    ]
}

/// Equation (19): over all joints together \[N·m\].
fn pooled(outcome: &Outcome, which: usize) -> f64 {
    outcome.errors[which].rmse.iter().map(|rmse| rmse * rmse).sum::<f64>().sqrt()
}

fn iterations_section(outcome: &Outcome) -> Section {
    let [open, closed] = &outcome.runs;
    let head = [
        "",
        "motion chosen",
        "allowed",
        "α",
        "cond(Φ)",
        "RMSE_w",
        "torque error [N·m]",
        "without tracing",
        "model beside what is declared",
    ];
    let mut rows = Vec::new();
    for (iteration, score) in closed.scores.iter().enumerate() {
        let record = iteration.checked_sub(1).and_then(|index| closed.run.history.get(index));
        let cell = |text: Option<String>| text.unwrap_or_default();
        let model = match record {
            Some(record) => names(outcome, &record.model),
            None => String::new(),
        };
        rows.push(vec![
            if iteration == 0 { "initial model".to_owned() } else { iteration.to_string() },
            cell(record.map(|record| record.motion.clone())),
            cell(record.map(|record| record.allowed.to_string())),
            cell(record.map(|record| significant(record.alpha, 2))),
            cell(record.and_then(|record| record.condition_number).map(|cond| significant(cond, 3))),
            significant(score.rmse_w, 3),
            significant(score.rmse_torque, 3),
            cell(open.scores.get(iteration).map(|score| significant(score.rmse_torque, 3))),
            model,
        ]);
    }
    let picture = |label: &str, value: fn(&Score) -> f64| {
        let [closed, open] = [closed, open].map(|run| run.scores.iter().map(value).collect::<Vec<f64>>());
        curves(label, &closed, &open, 0)
    };
    let cond = |run: &RunFile| -> Vec<f64> {
        run.run.history.iter().map(|record| record.condition_number.unwrap_or(f64::NAN)).collect()
    };
    Section {
        title: "Iteration by iteration".to_owned(),
        sentences: vec![
            "Each iteration chooses the motion that leaves the smallest cond(Φ) among those whose ZMP the present model sees inside the reduced \
             support, lets the robot follow it under the present model, estimates all parameters anew, traces the residual, and relaxes the \
             constraint."
                .to_owned(),
        ],
        table: Table { head: head.map(str::to_owned).into(), rows },
        pictures: vec![
            picture("RMSE_τ on held-out motions [N·m]", |score| score.rmse_torque),
            picture("RMSE_w", |score| score.rmse_w),
            curves("cond(Φ) of all that was measured", &cond(closed), &cond(open), 1),
        ],
        notes: vec![
            "cond(Φ) is that of the declared columns, also once the model has grown.".to_owned(),
            "Iteration 0 is the initial model.".to_owned(),
        ],
        ..Section::default()
    }
}

/// Two curves over the iterations; `first` is the number of the first, 0 for the initial model.
fn curves(label: &str, closed: &[f64], open: &[f64], first: usize) -> Picture {
    let lines = [
        IterationLine { name: "loop closed", values: closed },
        IterationLine { name: "declared model alone", values: open },
    ];
    Picture {
        caption: String::new(),
        svg: iterations(&Iterations {
            lines: &lines,
            x_label: "iteration",
            y_label: label,
            first,
            logarithmic: true,
        }),
    }
}

/// Kinds and joints of the effects beside those declared.
fn names(outcome: &Outcome, model: &RobotModel) -> String {
    let effects = model.effects.iter().skip(outcome.setup.robot.declared().len());
    let name = |effect: &phiw_estimation::KnownEffect| {
        format!("{} of {}", effect.spec.kind.replace('_', " "), effect.spec.joints.join(" and "))
    };
    effects.map(name).collect::<Vec<_>>().join("; ")
}

fn chosen(outcome: &Outcome) -> Section {
    let run = &outcome.runs[1];
    let settings = &outcome.setup.settings;
    let separated = run.run.history.iter().enumerate().filter_map(|(index, record)| {
        let [one, other] = record.separates.as_ref()?;
        Some(format!("Iteration {}: chosen as the motion on which {one} and {other} differ most, which the logs could not tell apart.", index + 1))
    });
    Section {
        title: "What was chosen, and why it was safe".to_owned(),
        pictures: vec![Picture {
            caption: "Motions by task, iteration by iteration. Framed: allowed by the constraint. The darker, the smaller cond of all measured rows and \
                      the motion's."
                .to_owned(),
            svg: choices(&run.details, settings),
        }],
        small: balance(&run.details, settings)
            .into_iter()
            .map(|svg| Picture { caption: String::new(), svg })
            .collect(),
        notes: separated
            .chain(["The ZMP of each chosen reference under the belief of the time. The reduced support grows as α falls.".to_owned()])
            .collect(),
        ..Section::default()
    }
}

fn effect(outcome: &Outcome, found: &[String]) -> Section {
    let [_, open, closed] = &outcome.errors;
    let tree = outcome.setup.robot.tree();
    let rows: Vec<Vec<String>> = tree
        .joint_names()
        .enumerate()
        .map(|(joint, name)| {
            let error = |error: &TorqueError| {
                format!(
                    "{} ({} %)",
                    significant(error.rmse[joint], 2),
                    percent(error.rmse[joint] / error.rms_torque[joint])
                )
            };
            vec![
                name.to_owned(),
                significant(open.rms_torque[joint], 3),
                error(&outcome.errors[0]),
                error(open),
                error(closed),
            ]
        })
        .collect();
    let groups: Vec<BarGroup> = tree
        .joint_names()
        .enumerate()
        .map(|(joint, name)| BarGroup {
            joint: name.to_owned(),
            before: Some(100.0 * open.rmse[joint] / open.rms_torque[joint]),
            after: Some(100.0 * closed.rmse[joint] / closed.rms_torque[joint]),
            noise_floor: None,
        })
        .collect();
    let truth = truth(&outcome.secret, tree);
    Section {
        title: "What the model lacked".to_owned(),
        sentences: match found {
            [] => vec![format!("Nothing was found. In the plant is {truth}.")],
            found => vec![found.join(" "), format!("In the plant is {truth}.")],
        },
        table: Table {
            head: ["joint", "RMS torque [N·m]", "initial model", "declared model alone", "loop closed"].map(str::to_owned).into(),
            rows,
        },
        pictures: vec![Picture {
            caption: "Error on the held-out motions after the last iteration: the declared model alone, and with the loop closed.".to_owned(),
            svg: joint_bars(&JointBars { groups: &groups, label: "error [% of RMS torque]" }),
        }],
        ..Section::default()
    }
}

/// What the plant has, in words.
fn truth(secret: &[PlantEffect], tree: &Tree) -> String {
    let effects: Vec<String> = secret.iter().map(|effect| of_effect(effect, tree)).collect();
    effects.join(", ")
}

fn of_effect(secret: &PlantEffect, tree: &Tree) -> String {
    let names: Vec<&str> = tree.joint_names().collect();
    let joints: Vec<&str> = secret.joints(tree).into_iter().map(|joint| names[joint]).collect();
    let size = match secret {
        PlantEffect::Friction { law: Friction::Coulomb { torque, .. }, .. } => {
            format!(" of {} N·m", significant(*torque, 3))
        }
        _ => String::new(),
    };
    format!("{}{size} on {}", secret.kind().replace('_', " "), joints.join(" and "))
}
