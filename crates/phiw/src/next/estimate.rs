//! What is believed of the robot at present: the URDF, corrected by what has been measured.

use super::controlled::{ControlledLogs, Learnt};
use super::motions::Motions;
use crate::Error;
use crate::arguments::{NextArguments, NextEstimator};
use crate::model_file::ModelFile;
use crate::session::Session;
use phiw_curriculum::CurriculumError;
use phiw_curriculum::constraint::Certainty;
use phiw_curriculum::selection::{MotionCandidates, Triangle};
use phiw_dynamics::Tree;
use phiw_dynamics::inertia::InertialParameters;
use phiw_effects::Catalogue;
use phiw_estimation::{
    BayesianLeastSquares, Estimate, Estimator, Evidence, LogNoise, LoggedSettings, ParameterPrior, Robot,
    RobotModel, RowsAt, TorqueMisfit,
};
use phiw_identification::checks::check_size_of_robot;
use phiw_identification::fitting::{fit, merge};
use phiw_identification::model::with_masses;
use phiw_identification::{
    Design, EffectCatalogue, EffectSpec, IdentificationError, Identified, Progress, identify,
};
use phiw_limits::Limits;
use phiw_regressor::{BaseParameters, RegressorError};
use phiw_telemetry::Survey;
use serde::Serialize;

/// Where the estimate comes from, beside the URDF.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Source {
    /// Nothing has been measured: the URDF is believed.
    Urdf,
    /// A model.json.
    Model,
    /// The measured logs, of which nobody knows what the controller did: equation (4).
    Logs,
    /// Measured logs that tell what the controller did: the likelihood that is told no noise.
    ControlledLogs,
}

/// What is believed and what has been measured.
pub struct Present {
    /// Where the estimate comes from.
    pub source: Source,
    /// The robot with the effects of the model.
    pub robot: Robot,
    /// The columns of the model.
    pub design: Design,
    /// The URDF, and how far off it may be.
    pub prior: ParameterPrior,
    /// w in the design's order, and how sure it is.
    pub estimate: Estimate,
    /// The present belief.
    pub model: RobotModel,
    /// How sure that is.
    pub certainty: Option<Certainty>,
    /// What each motion would tell.
    pub candidates: MotionCandidates,
    /// R of all that has been measured, in the columns of the candidates; none if no log is given.
    pub triangle: Option<Triangle>,
    /// cond(Φ) of all that had been measured after each log.
    pub condition_numbers: Vec<Option<f64>>,
    /// How many logs there are, and how long they are together \[s\].
    pub measured: Option<(usize, f64)>,
    /// Whether the noise's story holds, torque by torque; empty where the estimate has none.
    pub misfit: Vec<TorqueMisfit>,
}

/// The measured logs, reduced.
pub struct MeasuredLogs {
    /// What had been measured after each log.
    pub after_each: Vec<Evidence>,
    /// How long they are together \[s\].
    pub seconds: f64,
}

/// A model's columns and what is known of their parameters.
struct Known {
    source: Source,
    design: Design,
    evidence: Evidence,
    noise: LogNoise,
    measured: Option<MeasuredLogs>,
    /// The logs at the controller's rate, where they tell what it did and are what is estimated from.
    controlled: Option<ControlledLogs>,
}

impl Present {
    /// Reads the model file and the logs that are given.
    pub fn new(
        arguments: &NextArguments,
        tree: &Tree,
        base_link: InertialParameters,
        motions: &Motions,
        progress: Progress<'_>,
    ) -> Result<Self, Error> {
        let Known { source, design, evidence, noise, measured, controlled } =
            Known::read(arguments, tree, motions, progress)?;
        let catalogue = Catalogue::default();
        let robot =
            Robot::with_base(tree.clone(), design.base().clone(), base_link, specs(&design), catalogue)?;
        let nothing = vec![0.0; design.parameter_count() - design.base().count()];
        let initial = RobotModel { standard: with_masses(tree), ..robot.truth(&nothing)? };
        let prior = ParameterPrior { model: initial, share: arguments.urdf_error };
        let (estimate, model, measured, misfit) = match controlled {
            Some(logs) => {
                let Learnt { measured, estimate, model, misfit } = logs.learn(&robot, &prior.model)?;
                (estimate, model, Some(measured), misfit)
            }
            None => {
                let estimator = BayesianLeastSquares { noise, prior: prior.clone() };
                let present = prior.model.parameters(&robot)?;
                let estimate = estimator.estimate(&design, &evidence, &prior.model, &present)?;
                let model = prior.model.with_parameters(&robot, &specs(&design), &estimate.parameters)?;
                (estimate, model, measured, Vec::new())
            }
        };
        let weights = vec![1.0; tree.joint_count()];
        let candidates = MotionCandidates::foreseeable(&robot, &design, &motions.dataset, &weights)?;
        let after_each = measured.iter().flat_map(|measured| &measured.after_each);
        let triangles: Vec<Triangle> = after_each
            .map(|logs| candidates.measured(logs))
            .collect::<Result<_, _>>()
            .map_err(CurriculumError::from)?;
        let condition_numbers = triangles.iter().map(|all| Some(all.condition_number())).collect();
        let measured = measured.map(|measured| (measured.after_each.len(), measured.seconds));
        Ok(Present {
            source,
            certainty: Certainty::of(&robot, &estimate),
            robot,
            design,
            prior,
            estimate,
            model,
            candidates,
            triangle: triangles.into_iter().last(),
            condition_numbers,
            measured,
            misfit,
        })
    }
}

impl Known {
    fn read(
        arguments: &NextArguments,
        tree: &Tree,
        motions: &Motions,
        progress: Progress<'_>,
    ) -> Result<Self, Error> {
        let model = arguments
            .model
            .as_ref()
            .map(|path| ModelFile::given(arguments.in_memory.model.as_ref(), path))
            .transpose()?;
        let logs = match arguments.measured.is_empty() {
            true => None,
            false => Some(Self::of_logs(arguments, tree, model.as_ref(), progress)?),
        };
        match (model, logs) {
            (Some(model), logs) => {
                let known = Self::of_model(arguments, tree, &model)?;
                Ok(Known { measured: logs.and_then(|logs| logs.measured), ..known })
            }
            (None, Some(logs)) => Ok(logs),
            (None, None) => {
                let design = unmeasured_design(arguments, tree, motions)?;
                let evidence = Evidence::none(&design, RowsAt::Stamps)?;
                let noise = LogNoise::unit(evidence.factor().groups().len());
                Ok(Known { source: Source::Urdf, design, evidence, noise, measured: None, controlled: None })
            }
        }
    }

    fn of_model(arguments: &NextArguments, tree: &Tree, file: &ModelFile) -> Result<Self, Error> {
        let (design, _) = file.design(&arguments.urdf, tree, &Catalogue::default())?;
        let model = &file.model;
        let effects = model.effects.iter().flat_map(|effect| &effect.parameters);
        let named = model.base_parameters.iter().chain(effects);
        let deviations: Vec<f64> = named.map(|parameter| parameter.std.unwrap_or(f64::NAN)).collect();
        let (factor, parameters) = (file.factor()?, model.factor.parameters.clone());
        let noise = LogNoise::of_weighted_rows(&factor, &parameters, &deviations);
        let evidence = Evidence::of_weighted_rows(design.parameter_count(), parameters, factor)
            .map_err(CurriculumError::from)?;
        Ok(Known { source: Source::Model, design, evidence, noise, measured: None, controlled: None })
    }

    /// Fits the declared model (or the columns of `model`) to all logs.
    fn of_logs(
        arguments: &NextArguments,
        tree: &Tree,
        model: Option<&ModelFile>,
        progress: Progress<'_>,
    ) -> Result<Self, Error> {
        // A first motion may leave joints at rest: the next will not.
        let session = Session::open_unexcited(&arguments.session(), progress)?;
        let sources = session.logs.sources(progress);
        let data = session.data(&sources);
        let effects = match model {
            Some(model) => {
                let (design, _) = model.design(&arguments.urdf, tree, &session.catalogue)?;
                let build = |spec: &EffectSpec| Ok(vec![session.catalogue.build(spec, tree)?]);
                specs(&design).iter().map(build).collect::<Result<_, Error>>()?
            }
            None => session.effects(&data)?,
        };
        let Identified { design, train_folds, held_out_folds, .. } = identify(tree, effects, &data)?;
        // What was held out to choose constants has been measured, too.
        let folds = [train_folds, held_out_folds].concat();
        let rate_hz = session.logs.conditioning().plan(&session.logs.surveys()[0])?.output_rate_hz();
        let up_to = |log: usize| {
            let stretches = data.train.iter().chain(&data.held_out).zip(&folds);
            let own = stretches.filter(|(fold, _)| fold.log <= log).map(|(_, factor)| factor.clone());
            Ok(Evidence::of_factor(merge(&own.collect::<Vec<_>>())?, Some(rate_hz)))
        };
        let surveys = session.logs.training();
        let after_each: Result<Vec<Evidence>, RegressorError> = (0..surveys.len()).map(up_to).collect();
        let measured = MeasuredLogs {
            after_each: after_each.map_err(CurriculumError::from)?,
            seconds: surveys.iter().map(Survey::duration).sum(),
        };
        let noise = LogNoise::of_fit(&fit(&design, &folds)?);
        let evidence = Evidence::of_factor(merge(&folds).map_err(CurriculumError::from)?, Some(rate_hz));
        let joints: Vec<String> = tree.joint_names().map(str::to_owned).collect();
        let settings = LoggedSettings {
            command_period_s: arguments.command_hz.map(f64::recip),
            ..LoggedSettings::default()
        };
        let controlled = match arguments.estimator {
            // Parameters are a model file's where there is one.
            NextEstimator::UnknownNoise if model.is_none() => {
                ControlledLogs::read(surveys, &joints, &settings)?
            }
            _ => None,
        };
        let source = if controlled.is_some() { Source::ControlledLogs } else { Source::Logs };
        Ok(Known { source, design, evidence, noise, measured: Some(measured), controlled })
    }
}

/// The declared columns when there is no log yet. Nothing can choose among an effect's constants then: the
/// simplest stand for all.
fn unmeasured_design(arguments: &NextArguments, tree: &Tree, motions: &Motions) -> Result<Design, Error> {
    let catalogue = Catalogue::default();
    let mut effects = Vec::new();
    for declared in catalogue.united(&arguments.declare, tree)? {
        let variants = catalogue.declare(&declared, tree, &motions.ranges)?;
        effects.extend(variants.into_iter().filter_map(|variants| variants.into_iter().next()));
    }
    // The factors of a motion, and those of all that is known.
    let of_effects = effects.iter().map(|effect| effect.as_ref());
    check_size_of_robot(tree, of_effects, 2, &Limits::default()).map_err(IdentificationError::from)?;
    let base = BaseParameters::of_tree(tree, Default::default()).map_err(CurriculumError::from)?;
    Ok(Design::new(tree.clone(), base, effects))
}

fn specs(design: &Design) -> Vec<EffectSpec> {
    design.effects().iter().map(|effect| effect.spec()).collect()
}
