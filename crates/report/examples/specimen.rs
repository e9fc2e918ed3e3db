//! Writes a report of made-up numbers, to look at the page without a robot:
//! `cargo run -p phiw-report --example specimen -- report.html [JOINTS] [identify]`.

use phiw_report::IdentificationPage;
use phiw_report::json::Verdict;
use phiw_report::page::*;
use phiw_report::plot::*;

fn main() -> std::io::Result<()> {
    let mut arguments = std::env::args().skip(1);
    let path = arguments.next().unwrap_or_else(|| "report.html".into());
    let joints = arguments.next().and_then(|count| count.parse().ok()).unwrap_or(6);
    let explain = arguments.next().is_none_or(|mode| mode != "identify");
    std::fs::write(path, specimen(joints, explain).render())
}

/// A page with `joints` joints; with all that `explain` adds or without it.
fn specimen(joints: usize, explain: bool) -> IdentificationPage {
    let names: Vec<String> = (1..=joints).map(|joint| format!("joint_{joint}")).collect();
    let sections = names.iter().enumerate().map(|(index, name)| joint(index, name)).collect();
    let mut page = IdentificationPage {
        robot: "specimen".into(),
        inputs: [
            ("URDF", "specimen.urdf", "6 moving joints, 1 held"),
            ("train", "train-1.csv", "60.1 s, 12 020 samples, 2 segments"),
            ("validate", "validate-1.csv", "20.0 s, 4 001 samples"),
        ]
        .map(|(role, name, content)| InputFile {
            role: role.into(),
            name: name.into(),
            content: content.into(),
        })
        .into(),
        date: "2 March 2026, 14:05".into(),
        headline: vec![
            "Held-out torque error 24.1 % of RMS torque (rigid body + viscous + Coulomb friction).".into(),
            "36 base parameters and 12 friction parameters from 12 020 samples of 6 joints; cond 71.".into(),
        ],
        warnings: vec![
            "train-1.csv: the clock jumps by 2.13 s at line 4 312: the log is split there.".into(),
            "joint_4: its speed never exceeds 0.05 rad/s; its friction is poorly determined.".into(),
        ],
        errors: errors(&names, explain),
        joints: sections,
        conditioning: conditioning(),
        parameters: parameters(&names),
        base_parameters: base_parameters(&names),
        told: ToldSection {
            note: "Told is what the logs make at least 10 times narrower than it was believed before.".into(),
            told: vec!["mass of link_6: 2.310 ± 0.040 kg".into()],
            sums: vec!["Izz of link_1 + 0.250 · mass of link_2: 0.5120 ± 0.0030 kg·m²".into()],
            not_told: vec!["link_1: mass, Ixx, Iyy".into()],
            motions: vec![
                "reach.csv: 3.2 nats of what is not told; 2 more directions, with them mass of link_2".into(),
            ],
        },
        not_identified: vec![
            "link_1: m, m·cx, m·cy, m·cz, Ixx, Ixy, Iyy, Ixz, Iyz: no motion of the robot shows them.".into(),
            "link_6: m·cz: regrouped into link_5.".into(),
        ],
        urdf_findings: vec![
            "link_3: mass 0 with non-zero inertia.".into(),
            "link_5: the inertia violates the triangle inequality (Ixx + Iyy < Izz by 0.002 kg·m²).".into(),
        ],
        version: "phiw 0.1.0".into(),
        command_line: "phiw explain --urdf specimen.urdf --train train-1.csv --validate validate-1.csv \
             --declare viscous_friction,coulomb_friction --out out"
            .into(),
        ..IdentificationPage::default()
    };
    if explain {
        page.verdict = Some(Verdict::PartlyExplained);
        page.headline = vec![
            "joint_5 and joint_6 share a motor: 0.61 N·m·s/rad of coupled friction. Held-out error 24.1 % → 13.4 %.".into(),
            "What is left on joint_1 to joint_3 follows the sign of the velocity below 0.05 rad/s.".into(),
        ];
        page.effects = effects();
        page.remaining = Some(Remaining {
            structured: true,
            joints: vec!["joint_1".into(), "joint_3".into()],
            depends_on: vec!["qd".into(), "q of joint_2".into()],
            description: vec![
                "Below 0.05 rad/s the friction of joint_1 falls by 0.8 N·m within 0.01 rad after a reversal."
                    .into(),
            ],
            candidates: candidates(4),
            pictures: vec![scatter("joint_1", 0.4, None)],
            unidentifiable: Vec::new(),
        });
    }
    page
}

/// Smooth, repeatable stand-in for chance, about ±1.
fn noise(seed: f64) -> f64 {
    let fold = |x: f64| (x.sin() * 43_758.545).fract();
    (fold(seed * 12.9898) + fold(seed * 78.233 + 1.0) + fold(seed * 39.425 + 2.0)) / 1.2
}

fn joint(index: usize, name: &str) -> JointSection {
    let size = 40.0 / (index + 1) as f64;
    let trace = |log: &str, seconds: f64, phase: f64| {
        let mut lines = [(); 3].map(|()| Decimator::new(1500));
        for sample in 0..(200.0 * seconds) as usize {
            let t = sample as f64 / 200.0;
            if (7.0..8.2).contains(&t) {
                lines.iter_mut().for_each(Decimator::gap);
                continue;
            }
            let speed = (0.9 * t + phase).cos() * (0.31 * t).sin();
            let model = size * ((0.9 * t + phase).sin() * 0.8 + 0.3 * (2.3 * t).sin() + 0.2 * speed.signum());
            let error = size * (0.03 * noise(t + phase) + 0.05 * (3.1 * t + phase).sin() * speed);
            lines[0].push(t, model + error);
            lines[1].push(t, model);
            lines[2].push(t, error);
        }
        let [measured, predicted, residual] = lines.map(|line| line.finish());
        TorqueTrace { log: log.into(), measured, predicted, residual }
    };
    JointSection {
        joint: name.into(),
        unit: if index == 2 { "N" } else { "N·m" }.into(),
        summary: format!("RMSE {:.2}, noise floor {:.2}", 0.04 * size, 0.03 * size),
        noise_floor: Some(0.03 * size),
        held_out: vec![trace("validate-1.csv", 20.0, index as f64)],
        train: vec![trace("train-1.csv", 60.0, index as f64 + 2.0)],
    }
}

fn errors(names: &[String], explain: bool) -> ErrorTable {
    let row = |(index, joint): (usize, &String)| {
        let size = 40.0 / (index + 1) as f64;
        let share = 0.1 + 0.25 * noise(index as f64).abs();
        ErrorRow {
            joint: joint.clone(),
            unit: if index == 2 { "N" } else { "N·m" }.into(),
            rms_torque: size,
            train: Some(0.9 * share * size),
            held_out: Some(share * size),
            before: explain.then_some(1.7 * share * size),
            noise_floor: Some(0.06 * size),
        }
    };
    ErrorTable {
        rows: names.iter().enumerate().map(row).collect(),
        pooled: PooledError { train: Some(0.121), held_out: Some(0.134), before: explain.then_some(0.241) },
        note: "Held out: validate-1.csv, of which nothing was used in the fit.".into(),
    }
}

fn scatter(joint: &str, level: f64, after: Option<f64>) -> Picture {
    let speed: Vec<f64> = (0..6000).map(|i| 1.6 * noise(i as f64 * 0.37 + 5.0)).collect();
    let residual = |level: f64| -> Vec<f64> {
        speed
            .iter()
            .enumerate()
            .map(|(i, v)| level * (v * 20.0).tanh() * (1.0 + (-v.abs() * 6.0).exp()) + 0.4 * noise(i as f64))
            .collect()
    };
    let (before, after) = (residual(level), after.map(residual).unwrap_or_default());
    let svg = residual_against_signal(&ResidualAgainstSignal {
        signal: "q̇ [rad/s]",
        residual: &format!("residual of {joint} [N·m]"),
        before: Line { x: &speed, y: &before },
        after: Line { x: &speed, y: &after },
    });
    Picture { caption: format!("Residual of {joint} against its speed, held-out motion."), svg }
}

fn candidates(count: usize) -> Vec<CandidateRow> {
    let all = [
        ("transmission_coupling", 0.163, 2, ""),
        ("viscous_friction", 0.198, 2, ""),
        ("load_dependent_friction", 0.205, 2, ""),
        ("asymmetric_friction", 0.211, 4, ""),
        ("rotor_inertia", 0.229, 2, ""),
        ("joint_spring", 0.238, 4, ""),
        ("torque_ripple", 0.240, 4, ""),
        (
            "gravity_tilt",
            f64::NAN,
            2,
            "nothing is left of it beside the model: not identifiable from these logs",
        ),
    ];
    all.iter()
        .take(count)
        .map(|&(kind, held_out, parameters, note)| CandidateRow {
            kind: kind.into(),
            joints: vec!["joint_5".into(), "joint_6".into()],
            held_out,
            parameters,
            note: note.into(),
        })
        .collect()
}

fn effects() -> Vec<EffectSection> {
    let coupling = EffectSection {
        kind: "transmission_coupling".into(),
        joints: vec!["joint_5".into(), "joint_6".into()],
        sentence: "joint_5 and joint_6 share a motor: friction acts on the sum of their speeds.".into(),
        parameters: vec![
            EffectParameterRow {
                joint: "joint_5".into(),
                name: "fv_coupled".into(),
                value: 0.612,
                std: 0.011,
                unit: "N·m·s/rad".into(),
            },
            EffectParameterRow {
                joint: "joint_6".into(),
                name: "fc_coupled".into(),
                value: 0.3381,
                std: 0.0098,
                unit: "N·m".into(),
            },
        ],
        relative_before: 0.241,
        relative_after: 0.163,
        explains: 0.62,
        confidence: 0.98,
        stability: 1.0,
        rivals: vec![],
        candidates: candidates(8),
        pictures: vec![scatter("joint_5", 1.1, Some(0.05))],
    };
    let stribeck = EffectSection {
        kind: "stribeck_friction".into(),
        joints: vec!["joint_1".into()],
        sentence: "joint_1 sticks: its friction is 4.1 N·m higher at rest than above 0.06 rad/s.".into(),
        parameters: vec![
            EffectParameterRow {
                joint: "joint_1".into(),
                name: "fs".into(),
                value: 4.12,
                std: 0.21,
                unit: "N·m".into(),
            },
            EffectParameterRow {
                joint: "joint_1".into(),
                name: "vs".into(),
                value: 0.0613,
                std: 0.0042,
                unit: "rad/s".into(),
            },
        ],
        relative_before: 0.163,
        relative_after: 0.134,
        explains: 0.31,
        confidence: 0.71,
        stability: 1.0,
        rivals: vec![Rival {
            kind: "hysteresis".into(),
            joints: vec!["joint_1".into()],
            confidence: 0.29,
            separated_by: "slow reversals of joint_1 of less than 0.01 rad".into(),
        }],
        candidates: vec![],
        pictures: vec![scatter("joint_1", 1.4, Some(0.3))],
    };
    vec![coupling, stribeck]
}

fn conditioning() -> ConditioningSection {
    let frequency: Vec<f64> = (1..4000).map(|i| i as f64 * 0.025).collect();
    let amplitude = |floor: f64, seed: f64| -> Vec<f64> {
        frequency
            .iter()
            .map(|f| (8.0 / (1.0 + (f / 0.9).powi(4)) + floor) * (1.0 + 0.5 * noise(f * seed)).abs())
            .collect()
    };
    let spectra = [amplitude(0.004, 3.1), amplitude(0.02, 7.7)];
    let lines = [("joint_1", &spectra[0]), ("joint_5", &spectra[1])]
        .map(|(name, y)| SpectrumLine { name, line: Line { x: &frequency, y } });
    let svg = spectrum(&SpectrumPlot { lines: &lines, y_label: "torque [N·m/√Hz]", cut_off: Some(5.2) });
    ConditioningSection {
        entries: [
            ("Low-pass", "zero-phase Butterworth, 4th order, cut-off 5.2 Hz (from the torque's spectrum)"),
            ("Sampling", "200 Hz, jitter 0.3 %; decimated by 8 after filtering"),
            ("Segments", "2 train, 1 validate; 3 samples skipped (NaN)"),
            ("Derivatives", "central differences of the filtered angle"),
        ]
        .map(|(quantity, value)| (quantity.into(), value.into()))
        .into(),
        pictures: vec![Picture { caption: "Torque before the filter.".into(), svg }],
    }
}

fn parameters(names: &[String]) -> ParametersSection {
    let kinds = [
        ("Izz", "kg·m²", 1.4),
        ("m·cx", "kg·m", 0.9),
        ("m·cy", "kg·m", -0.02),
        ("fv", "N·m·s/rad", 6.0),
        ("fc", "N·m", 4.1),
        ("Ixy", "kg·m²", 0.004),
    ];
    let rows = names.iter().enumerate().flat_map(|(index, joint)| {
        kinds.iter().map(move |&(kind, unit, value)| {
            let value = value * (1.0 + 0.4 * noise((index * 7) as f64 + value));
            ParameterRow {
                name: format!("{kind}.{joint}"),
                value,
                std: 0.004 + 0.006 * noise(value + index as f64).abs(),
                unit: unit.into(),
            }
        })
    });
    ParametersSection {
        rows: rows.collect(),
        note: "Weighted least squares; standard deviations from the residual of each joint, \
             corrected for its autocorrelation. cond of the weighted regressor 71."
            .into(),
    }
}

fn base_parameters(names: &[String]) -> Vec<BaseParameter> {
    names
        .iter()
        .enumerate()
        .map(|(index, joint)| BaseParameter {
            name: format!("Izz.{joint}"),
            regroups: (index..names.len())
                .map(|link| format!("Iyy.link_{link} + 0.1764 m.link_{link} − 0.84 m·cz.link_{link}"))
                .collect::<Vec<_>>()
                .join(" + "),
        })
        .collect()
}
