//! What is believed of the robot at present: the URDF, corrected by what has been measured.

use super::motions::Motions;
use crate::Error;
use crate::arguments::NextArguments;
use crate::model_file::ModelFile;
use crate::session::{Session, declared};
use phiw_curriculum::{CurriculumError, KnownEffect, RobotModel};
use phiw_dynamics::Tree;
use phiw_effects::Catalogue;
use phiw_identification::{
    Design, EffectCatalogue, EffectSpec, Fit, IdentificationError, Identified, Progress, check_size_of_robot,
    fit, identify, merge, with_masses,
};
use phiw_limits::Limits;
use phiw_regressor::factor::{Factor, FactorBuilder};
use phiw_regressor::least_squares::GroupedFactor;
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
    /// The measured logs.
    Logs,
}

/// The present estimate.
pub struct Estimate {
    /// Where it comes from.
    pub source: Source,
    /// Standard parameters and effects.
    pub model: RobotModel,
    /// The belief before anything was measured.
    pub initial: RobotModel,
    /// The columns of the model.
    pub design: Design,
    /// w, in the design's order.
    pub parameters: Vec<f64>,
    /// R of all that is known of w, in rows of unit variance: what has been measured, and the URDF.
    pub known: Factor,
    /// The parameters that its columns stand for; the others (effects that no log has excited) are zero.
    pub determined: Vec<usize>,
    /// What has been measured; none if no log is given.
    pub measured: Option<MeasuredLogs>,
}

/// The measured logs, reduced.
pub struct MeasuredLogs {
    /// The factors of their rows.
    pub factor: GroupedFactor,
    /// Those of the first log's.
    pub first: GroupedFactor,
    /// Rows a second that each torque has in them \[Hz\].
    pub rate_hz: f64,
    /// How long they are \[s\].
    pub seconds: f64,
    /// How many there are.
    pub logs: usize,
}

/// Weighted rows of \[Φ f\].
struct Evidence {
    factor: Factor,
    /// The parameters that its columns stand for; the others are zero in it.
    columns: Vec<usize>,
    /// How many times wider standard deviations are than those of independent rows: samples of a log are correlated.
    correlation: f64,
}

impl Estimate {
    /// Reads the model file and the logs that are given.
    pub fn new(
        arguments: &NextArguments,
        tree: &Tree,
        motions: &Motions,
        progress: Progress<'_>,
    ) -> Result<Self, Error> {
        let model = arguments.model.as_ref().map(|path| ModelFile::read(path)).transpose()?;
        let logs = match arguments.measured.is_empty() {
            true => None,
            false => Some(Logs::new(arguments, tree, model.as_ref(), progress)?),
        };
        let share = arguments.urdf_error;
        match (model, logs) {
            (Some(model), logs) => {
                let (design, _) = model.design(&arguments.urdf, tree, &Catalogue::default())?;
                let measured = logs.map(|logs| logs.measured);
                Self::of_evidence(design, Some((Source::Model, Evidence::of_model(&model)?)), measured, share)
            }
            (None, Some(Logs { design, evidence, measured })) => {
                Self::of_evidence(design, Some((Source::Logs, evidence)), Some(measured), share)
            }
            (None, None) => {
                Self::of_evidence(unmeasured_design(arguments, tree, motions)?, None, None, share)
            }
        }
    }

    /// The likeliest parameters, and how sure they are.
    fn of_evidence(
        design: Design,
        evidence: Option<(Source, Evidence)>,
        measured: Option<MeasuredLogs>,
        urdf_error: f64,
    ) -> Result<Self, Error> {
        let reference = with_masses(design.tree());
        let (known, determined) =
            posterior(&design, &reference, urdf_error, evidence.as_ref().map(|(_, evidence)| evidence))
                .map_err(CurriculumError::from)?;
        let mut parameters = vec![0.0; design.parameter_count()];
        let found = known.solve().map_err(CurriculumError::from)?.parameters;
        determined.iter().zip(found).for_each(|(&parameter, value)| parameters[parameter] = value);
        let base = design.base();
        let standard =
            base.to_standard(&parameters[..base.count()], &reference).map_err(CurriculumError::from)?;
        Ok(Estimate {
            source: evidence.map_or(Source::Urdf, |(source, _)| source),
            model: RobotModel { standard, effects: effects(&design, &parameters) },
            initial: RobotModel {
                standard: reference,
                effects: effects(&design, &vec![0.0; parameters.len()]),
            },
            design,
            parameters,
            known,
            determined,
            measured,
        })
    }
}

/// The evidence, its rows counted as so many independent ones, and the URDF as more rows: each standard parameter within `urdf_error` of its
/// body's magnitude. Without the URDF, one short log would leave a resting arm's parameters to the noise.
fn posterior(
    design: &Design,
    reference: &[f64],
    urdf_error: f64,
    evidence: Option<&Evidence>,
) -> Result<(Factor, Vec<usize>), RegressorError> {
    let (base, count) = (design.base(), design.parameter_count());
    let mut builder = FactorBuilder::new(count + 1);
    let mut columns: Vec<usize> = (0..count).collect();
    if let Some(evidence) = evidence {
        columns = evidence.columns.clone();
        let with_torque: Vec<usize> = columns.iter().copied().chain([count]).collect();
        builder.push_factor(&evidence.factor, &with_torque, 1.0 / evidence.correlation)?;
    }
    let mut row = vec![0.0; count + 1];
    for prior in base.prior_rows(reference, urdf_error)?.chunks_exact(base.count() + 1) {
        row[..base.count()].copy_from_slice(&prior[..base.count()]);
        row[count] = prior[base.count()];
        builder.push_row(&row)?;
    }
    let known = builder.factor();
    let undetermined = known.undetermined_columns();
    let determined: Vec<usize> =
        columns.into_iter().filter(|parameter| !undetermined.contains(parameter)).collect();
    let kept: Vec<usize> = determined.iter().copied().chain([count]).collect();
    Ok((known.select(&kept)?, determined))
}

impl Evidence {
    fn of_model(file: &ModelFile) -> Result<Self, Error> {
        let model = &file.model;
        let effects = model.effects.iter().flat_map(|effect| &effect.parameters);
        let named = model.base_parameters.iter().chain(effects);
        let deviations: Vec<f64> = named.map(|parameter| parameter.std.unwrap_or(f64::NAN)).collect();
        let (factor, columns) = (file.factor()?, model.factor.parameters.clone());
        Ok(Evidence { correlation: correlation(&factor, &columns, &deviations), factor, columns })
    }

    /// All columns of the logs, those that they do not determine included: the URDF will.
    fn of_fit(fit: &Fit, measured: &GroupedFactor) -> Result<Self, RegressorError> {
        let weights: Vec<f64> = fit.residual_std.iter().map(|std| 1.0 / std).collect();
        Ok(Evidence {
            correlation: correlation(&fit.factor, &fit.determined(), &fit.standard_deviations),
            factor: measured.combine(&weights)?,
            columns: (0..measured.parameter_count()).collect(),
        })
    }
}

/// The median over the parameters of their standard deviation over that of independent rows; 1 where nothing tells.
fn correlation(factor: &Factor, columns: &[usize], deviations: &[f64]) -> f64 {
    let Ok(independent) = factor.standard_deviations(1.0) else { return 1.0 };
    let ratios =
        columns.iter().zip(independent).map(|(&parameter, independent)| deviations[parameter] / independent);
    let mut ratios: Vec<f64> = ratios.filter(|ratio| ratio.is_finite()).collect();
    ratios.sort_by(f64::total_cmp);
    ratios.get(ratios.len() / 2).copied().unwrap_or(1.0).max(1.0)
}

/// The logs, and what they say.
struct Logs {
    design: Design,
    evidence: Evidence,
    measured: MeasuredLogs,
}

impl Logs {
    /// Fits the declared model (or the columns of `model`) to all logs.
    fn new(
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
            None => session.effects()?,
        };
        let Identified { design, train_folds, held_out_folds, .. } = identify(tree, effects, &data)?;
        // What was held out to choose constants has been measured, too.
        let folds = [train_folds, held_out_folds].concat();
        let of_first = data.train.iter().chain(&data.held_out).zip(&folds).filter(|(fold, _)| fold.log == 0);
        let first_log: Vec<GroupedFactor> = of_first.map(|(_, factor)| factor.clone()).collect();
        let first = &session.logs.surveys()[0];
        let measured = MeasuredLogs {
            factor: merge(&folds).map_err(CurriculumError::from)?,
            first: merge(&first_log).map_err(CurriculumError::from)?,
            rate_hz: session.logs.conditioning().plan(first)?.output_rate_hz(),
            seconds: session.logs.training().iter().map(Survey::duration).sum(),
            logs: session.logs.training().len(),
        };
        let fit = fit(&design, &folds)?;
        let evidence = Evidence::of_fit(&fit, &measured.factor).map_err(CurriculumError::from)?;
        Ok(Logs { design, evidence, measured })
    }
}

/// The declared columns when there is no log yet. Nothing can choose among an effect's constants then: the simplest stand for all.
fn unmeasured_design(arguments: &NextArguments, tree: &Tree, motions: &Motions) -> Result<Design, Error> {
    let catalogue = Catalogue::default();
    let mut effects = Vec::new();
    for kind in declared(&arguments.declare, &catalogue)? {
        let variants = catalogue.declare(&kind, tree, &motions.ranges)?;
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

fn effects(design: &Design, parameters: &[f64]) -> Vec<KnownEffect> {
    let known = |index: usize| KnownEffect {
        spec: design.effects()[index].spec(),
        parameters: parameters[design.effect_parameters(index)].to_vec(),
    };
    (0..design.effects().len()).map(known).collect()
}
