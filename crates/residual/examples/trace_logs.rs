//! Traces the residual of logs and prints what it finds:
//! `trace_logs ROBOT.urdf viscous_friction,coulomb_friction TRAIN.csv,… [VALIDATE.csv,… [SEED]]`.
//!
//! With a seed the training folds are a bootstrap draw: as many as there are, with replacement. The names
//! should not depend on it.

use phiw_dynamics::random_tree::RandomNumbers;
use phiw_dynamics::urdf::{UrdfOptions, read_urdf_file};
use phiw_effects::{Catalogue, SignalRanges};
use phiw_identification::{BlockSource, Data, LogSet, Variants, identify};
use phiw_residual::trace::{TraceInput, TraceOptions, noise_floor, trace};
use phiw_telemetry::ConditioningOptions;
use std::error::Error;
use std::path::PathBuf;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [urdf, declare, train, rest @ ..] = arguments.as_slice() else {
        return Err("usage: trace_logs URDF EFFECT,… TRAIN,… [VALIDATE,… [SEED]]".into());
    };
    let list =
        |text: &str| text.split(',').filter(|part| !part.is_empty()).map(str::to_owned).collect::<Vec<_>>();
    let paths = |text: &str| list(text).into_iter().map(PathBuf::from).collect::<Vec<_>>();
    let tree = read_urdf_file(urdf, &UrdfOptions::default())?.tree;
    let validate = rest.first().map(|text| paths(text)).unwrap_or_default();
    let logs = LogSet::open(&tree, &paths(train), &validate, &ConditioningOptions::default(), &|_, _, _| ())?;
    println!("{}", logs.conditioning());
    let ranges = SignalRanges::of_surveys(logs.training());
    let catalogue = Catalogue::default();
    let mut effects: Vec<Variants> = Vec::new();
    for kind in list(declare) {
        effects.extend(catalogue.declare(&kind, &tree, &ranges)?);
    }
    let files = logs.sources(&|_, _, _| ());
    let sources: Vec<&dyn BlockSource> = files.iter().map(|file| file as &dyn BlockSource).collect();
    let mut train = logs.training_folds();
    if let Some(seed) = rest.get(1) {
        let all = train.clone();
        let mut random = RandomNumbers::new(seed.parse()?);
        train.fill_with(|| all[(random.uniform(0.0, all.len() as f64) as usize).min(all.len() - 1)]);
    }
    let data = Data { train, held_out: logs.held_out_folds(), sources, rest_speeds: logs.rest_speeds() };
    let begin = std::time::Instant::now();
    let identified = identify(&tree, effects, &data)?;
    println!("identified in {:.2?}: held out {:.2} %", begin.elapsed(), 100.0 * identified.held_out.relative);
    let model =
        phiw_identification::Model::of_fit(&identified.design, &identified.fit, &[], &[], (0.0, 0.0))?;
    let floor = noise_floor(
        &model.identified_tree(&tree)?,
        &vec![0.0; tree.joint_count()],
        logs.surveys(),
        logs.conditioning(),
        &data.sources,
    )?;
    println!("rmse  {:.4?}\nfloor {floor:.4?}", identified.held_out.rmse);
    let plan = logs.conditioning().plan(&logs.surveys()[0])?;
    let input = TraceInput {
        tree: &tree,
        catalogue: &catalogue,
        data: &data,
        ranges,
        declared: identified.design.effects().iter().map(|effect| effect.spec()).collect(),
        parameters: identified.fit.parameters.clone(),
        residual_std: identified.fit.residual_std.clone(),
        held: None,
        noise_floor: floor,
        rows_per_independent: plan.output_rate_hz() / (2.0 * logs.conditioning().parallel_cutoff_hz),
    };
    let tracing = trace(input, &TraceOptions::default())?;
    let found = [("named", &tracing.effects), ("refinement", &tracing.refinements)];
    for (how, effect) in
        found.iter().flat_map(|(how, effects)| effects.iter().map(move |effect| (how, effect)))
    {
        println!(
            "{how} {} {:?} {:?}: {:.2} % -> {:.2} %, explains {:.2}, z {:.1}, folds {:.2}, confidence {:.3}",
            effect.spec.kind,
            effect.spec.joints,
            effect.spec.constants,
            100.0 * effect.relative_before,
            100.0 * effect.relative,
            effect.explains,
            effect.significance,
            effect.stability,
            effect.confidence
        );
        for rival in &effect.rivals {
            println!(
                "    rival {} {:?} {:?} {:.3}",
                rival.spec.kind, rival.spec.joints, rival.spec.constants, rival.confidence
            );
        }
    }
    println!(
        "{:?}: held out {:.2} -> {:.2} %",
        tracing.verdict,
        100.0 * tracing.before.1.relative,
        100.0 * tracing.model.held_out.relative
    );
    println!(
        "rmse {:.4?}\nstructured {:?} {:?}",
        tracing.model.held_out.rmse, tracing.remaining.joints, tracing.remaining.depends_on
    );
    for (index, effect) in tracing.model.design.effects().iter().enumerate() {
        let values: Vec<String> = tracing
            .model
            .design
            .effect_parameters(index)
            .zip(effect.parameters())
            .map(|(p, info)| {
                format!(
                    "{} {:.4}±{:.4}",
                    info.name, tracing.model.fit.parameters[p], tracing.model.fit.standard_deviations[p]
                )
            })
            .collect();
        println!("  {} {:?}: {}", effect.spec().kind, effect.spec().joints, values.join(", "));
    }
    println!("traced in {:.2?}", begin.elapsed());
    Ok(())
}
