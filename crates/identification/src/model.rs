//! An identified model: rigid body, effects, and the data of the fit; written to `model.json` and read back.

use crate::checks::check_size_of_robot;
pub use crate::consistent_model::ConsistentModel;
use crate::covariance::Covariance;
use crate::effect::{EffectError, EffectSelector};
use crate::factor_rows::FactorRows;
use crate::fit::Fit;
pub use crate::model_sources::{BaseMap, DataFingerprint, DataRole};
use crate::reference::ReferenceModel;
use crate::{Design, Effect, EffectCatalogue, EffectSpec, IdentificationError};
use phiw_dynamics::Tree;
use phiw_dynamics::inertia::{PARAMETER_NAMES, PARAMETERS_PER_BODY};
use phiw_limits::Limits;
use phiw_regressor::BaseParameters;
use serde::{Deserialize, Serialize};

/// Version of the file's form. Version 1 had neither the robot nor the covariance.
const SCHEMA: u32 = 2;
/// Versions that are read.
const READ: std::ops::RangeInclusive<u32> = 1..=SCHEMA;
/// Beyond this magnitude a number of a model is none: its square times another's has no double.
const LARGEST: f64 = 1e100;

/// A fitted model, ready to be written, read, and used again.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Model {
    /// Version of this form.
    pub schema: u32,
    /// The robot's name.
    pub robot: String,
    /// Its joints, in the order of the torques.
    pub joints: Vec<String>,
    /// Joints of the URDF that were held, and where \[rad, m\].
    pub held: Vec<(String, f64)>,
    /// What was declared, `rigid_body` first: `KIND`, or `KIND:JOINT[+JOINT…]` (see [`EffectSelector`]).
    pub declared: Vec<String>,
    /// The base parameters.
    pub base_parameters: Vec<NamedParameter>,
    /// Standard parameters of each body: those nearest to the URDF's that have the base parameters (a small
    /// sphere's where the URDF has no mass).
    pub bodies: Vec<BodyParameters>,
    /// The effects beside the rigid body.
    pub effects: Vec<EffectParameters>,
    /// Standard deviation of each torque's residual on the training logs \[N·m, N\].
    pub residual_std: Vec<f64>,
    /// The same on training motion that is left out of the fit \[N·m, N\] ([`Fit::left_out_std`]); absent
    /// from a model that an earlier phiw wrote.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub left_out_std: Option<Vec<f64>>,
    /// RMS of each torque's error on the logs that were held out \[N·m, N\]; absent from a model that an
    /// earlier phiw wrote.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub held_out_rmse: Option<Vec<f64>>,
    /// What the fit knew, error included: the weighted factor R of \[Φ f\] over the parameters that were
    /// determined.
    pub factor: FactorRows,
    /// Cut-offs of the low-pass over positions and of the parallel filter \[Hz\].
    pub cutoff_hz: (f64, f64),
    /// For each torque, the speed below which its joint stands still and its rows do not count
    /// \[rad/s, m/s\]. Empty in a model of schema 1, or where all rows count.
    #[serde(default)]
    pub rest_speeds: Vec<f64>,
    /// Covariance of the parameters, base parameters first, then those of the effects; absent from a model of
    /// schema 1.
    #[serde(default)]
    pub covariance: Option<Covariance>,
    /// The map from standard to base parameters; absent from a model of schema 1.
    #[serde(default)]
    pub base_map: Option<BaseMap>,
    /// The logs that the model comes from.
    #[serde(default)]
    pub data: Vec<DataFingerprint>,
    /// Text of the robot's URDF; absent from a model of schema 1.
    #[serde(default)]
    pub urdf: Option<String>,
    /// The same fit over bodies that can exist: what a simulator or a controller should be given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub consistent: Option<ConsistentModel>,
}

/// A parameter with its standard deviation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct NamedParameter {
    /// Its name.
    pub name: String,
    /// Its value.
    pub value: f64,
    /// Its standard deviation; `null` where the logs were too short to tell.
    pub std: Option<f64>,
    /// Its 95 % interval ([`Fit::intervals_95`]); `null` where the logs were too short to tell, or an earlier
    /// phiw wrote the file.
    #[serde(default)]
    pub interval_95: Option<[f64; 2]>,
    /// Its unit.
    pub unit: String,
}

/// The standard parameters of a body, in the order of [`PARAMETER_NAMES`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BodyParameters {
    /// The joint that moves the body.
    pub joint: String,
    /// Mass, first moment, inertia about the joint frame's origin.
    pub inertial: [f64; PARAMETERS_PER_BODY],
}

/// An effect and its parameters.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct EffectParameters {
    /// What builds it again.
    #[serde(flatten)]
    pub spec: EffectSpec,
    /// Its parameters, in the effect's order.
    pub parameters: Vec<NamedParameter>,
    /// Whether the user declared it; else it was found.
    pub declared: bool,
}

/// Standard deviations that the logs could not tell are `null`.
fn finite(value: f64) -> Option<f64> {
    value.is_finite().then_some(value)
}

impl Model {
    /// The model of a fit. `declared` is what the user declared, in the form of [`EffectSelector`]; `held`
    /// are the joints that were held.
    ///
    /// # Errors
    /// The fit is not of this design.
    pub fn of_fit(
        design: &Design,
        fit: &Fit,
        declared: &[String],
        held: &[(String, f64)],
        cutoff_hz: (f64, f64),
    ) -> Result<Self, IdentificationError> {
        let base = design.base();
        let standard = base.to_standard(&fit.parameters[..base.count()], &with_masses(design.tree()))?;
        let body = |(body, values): (&phiw_dynamics::Body, &[f64])| BodyParameters {
            joint: body.joint.clone(),
            inertial: std::array::from_fn(|parameter| values[parameter]),
        };
        let named = |parameter: usize, name: String, unit: String| NamedParameter {
            name,
            value: fit.parameters[parameter],
            std: finite(fit.standard_deviations[parameter]),
            interval_95: Some(fit.intervals_95[parameter])
                .filter(|ends| ends.iter().all(|end| end.is_finite())),
            unit,
        };
        let base_parameter = |index: usize| {
            let leading = base.independent()[index];
            let unit = standard_unit(leading % PARAMETERS_PER_BODY);
            named(index, parameter_name(design.tree(), leading), unit.to_owned())
        };
        let selectors: Vec<EffectSelector> = declared.iter().map(|text| EffectSelector::read(text)).collect();
        let effect = |index: usize| {
            let effect = &design.effects()[index];
            let spec = effect.spec();
            let parameters = design.effect_parameters(index).zip(effect.parameters());
            let parameters =
                parameters.map(|(parameter, info)| named(parameter, info.name, info.unit)).collect();
            EffectParameters {
                declared: selectors.iter().any(|declared| declared.holds(&spec)),
                spec,
                parameters,
            }
        };
        Ok(Model {
            schema: SCHEMA,
            robot: design.tree().name().to_owned(),
            joints: design.tree().joint_names().map(str::to_owned).collect(),
            held: held.to_vec(),
            declared: std::iter::once("rigid_body".to_owned()).chain(declared.iter().cloned()).collect(),
            base_parameters: (0..base.count()).map(base_parameter).collect(),
            bodies: design
                .tree()
                .bodies()
                .iter()
                .zip(standard.chunks_exact(PARAMETERS_PER_BODY))
                .map(body)
                .collect(),
            effects: (0..design.effects().len()).map(effect).collect(),
            residual_std: fit.residual_std.clone(),
            left_out_std: Some(fit.left_out_std.clone()),
            held_out_rmse: None,
            factor: FactorRows::of(&fit.factor, fit.determined()),
            cutoff_hz,
            rest_speeds: design.rest_speeds().to_vec(),
            covariance: Some(fit.covariance.clone()),
            base_map: Some(BaseMap::of(base)),
            data: Vec::new(),
            urdf: None,
            consistent: None,
        })
    }

    /// The same with the robot that it is of and the logs that it comes from, so that it can be used by
    /// itself.
    pub fn with_sources(self, urdf: &str, data: Vec<DataFingerprint>) -> Self {
        Model { urdf: Some(urdf.to_owned()), data, ..self }
    }

    /// The same with its error on the logs that were held out.
    pub fn with_held_out_rmse(self, rmse: &[f64]) -> Self {
        Model { held_out_rmse: Some(rmse.to_vec()), ..self }
    }

    /// Whether the numbers of a file can be a model's: finite, of a size that squares can be taken of,
    /// deviations positive, lengths that fit each other.
    ///
    /// # Errors
    /// [`IdentificationError::Model`] with the first that cannot.
    pub fn check(&self) -> Result<(), IdentificationError> {
        let wrong = |what: String| {
            Err(IdentificationError::Model(format!("the model's {what}; write it again with phiw")))
        };
        let usable = |value: &f64| value.abs() < LARGEST;
        if !READ.contains(&self.schema) {
            return wrong(format!(
                "schema {} is not one of {} to {SCHEMA}, which this phiw reads",
                self.schema,
                READ.start()
            ));
        }
        let values =
            self.base_parameters.iter().chain(self.effects.iter().flat_map(|effect| &effect.parameters));
        if let Some(parameter) = values.into_iter().find(|parameter| !usable(&parameter.value)) {
            return wrong(format!(
                "parameter {} is {:e}, which is no parameter",
                parameter.name, parameter.value
            ));
        }
        if let Some(body) = self.bodies.iter().find(|body| !body.inertial.iter().all(usable)) {
            return wrong(format!("body of {} has a number that is no inertial parameter", body.joint));
        }
        if let Some(consistent) = &self.consistent {
            let counts = self.effects.iter().map(|effect| effect.parameters.len());
            if !consistent.effects.iter().map(Vec::len).eq(counts) {
                return wrong("consistent parameters are of other effects".to_owned());
            }
            let bodies = consistent.bodies.iter().flat_map(|body| &body.inertial);
            if !bodies.chain(consistent.effects.iter().flatten()).all(usable) {
                return wrong("consistent parameters hold a number that is no parameter".to_owned());
            }
        }
        if self.residual_std.len() != self.joints.len() {
            let (deviations, joints) = (self.residual_std.len(), self.joints.len());
            return wrong(format!("residual_std has {deviations} numbers for {joints} joints"));
        }
        if let Some(std) = self.residual_std.iter().find(|std| !(**std > LARGEST.recip() && usable(std))) {
            return wrong(format!("residual_std holds {std:e}, which is no standard deviation"));
        }
        let usable_std = |std: &f64| *std >= 0.0 && usable(std);
        if let Some(stds) = &self.left_out_std
            && (stds.len() != self.joints.len() || !stds.iter().all(usable_std))
        {
            return wrong(format!("left_out_std is not a list of {} deviations", self.joints.len()));
        }
        if let Some(rmse) = &self.held_out_rmse
            && (rmse.len() != self.joints.len() || !rmse.iter().all(usable_std))
        {
            return wrong(format!("held_out_rmse is not a list of {} errors", self.joints.len()));
        }
        let parameters = self.base_parameters.len()
            + self.effects.iter().map(|effect| effect.parameters.len()).sum::<usize>();
        if !self.factor.parameters.is_sorted_by(|a, b| a < b)
            || self.factor.parameters.last().is_some_and(|&last| last >= parameters)
        {
            return wrong(format!("factor names parameters that are not among its {parameters}"));
        }
        let size = self.factor.parameters.len() + 1;
        if self.factor.entries.len() != size * (size + 1) / 2 || !self.factor.entries.iter().all(usable) {
            return wrong(format!("factor is no triangle of {size} finite columns"));
        }
        if !self.rest_speeds.is_empty()
            && (self.rest_speeds.len() != self.joints.len() || !self.rest_speeds.iter().all(usable))
        {
            return wrong(format!("rest_speeds is not a list of {} speeds", self.joints.len()));
        }
        if let Some(covariance) = &self.covariance {
            let size = covariance.parameters.len();
            if !covariance.parameters.is_sorted_by(|a, b| a < b)
                || covariance.parameters.last().is_some_and(|&last| last >= parameters)
            {
                return wrong(format!("covariance names parameters that are not among its {parameters}"));
            }
            if covariance.entries.len() != size * (size + 1) / 2 || !covariance.entries.iter().all(usable) {
                return wrong(format!("covariance is no triangle of {size} finite columns"));
            }
        }
        Ok(())
    }

    /// The design and its parameters, on a tree that must be the same robot with the same joints held.
    ///
    /// # Errors
    /// The tree has other joints, or an effect is unknown to the catalogue.
    pub fn design(
        &self,
        tree: &Tree,
        catalogue: &dyn EffectCatalogue,
    ) -> Result<(Design, Vec<f64>), IdentificationError> {
        let joints: Vec<&str> = tree.joint_names().collect();
        let own: Vec<&str> = self.joints.iter().map(String::as_str).collect();
        if let Some(difference) = first_difference("joint", &own, &joints) {
            let message = format!(
                "{difference}, its held joints left out: use the URDF and --hold that the model was made with"
            );
            return Err(IdentificationError::Model(message));
        }
        if self.bodies.len() != tree.bodies().len() {
            let (model, urdf) = (self.bodies.len(), tree.bodies().len());
            let message = format!(
                "the model has {model} bodies, but the URDF {urdf}: use the URDF that it was made with"
            );
            return Err(IdentificationError::Model(message));
        }
        let effects = self.effects.iter().map(|effect| catalogue.build(&effect.spec, tree));
        let effects: Vec<Box<dyn Effect>> = effects.collect::<Result<_, _>>()?;
        let of_effects = effects.iter().map(|effect| effect.as_ref());
        check_size_of_robot(tree, of_effects, 1, &Limits::default())?;
        let base = BaseParameters::of_tree(tree, Default::default())?;
        let own: Vec<&str> = self.base_parameters.iter().map(|parameter| parameter.name.as_str()).collect();
        let names: Vec<String> =
            base.independent().iter().map(|&column| parameter_name(tree, column)).collect();
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        if let Some(difference) = first_difference("base parameter", &own, &names) {
            let message =
                format!("the kinematics differ, {difference}: use the URDF that the model was made with");
            return Err(IdentificationError::Model(message));
        }
        let reference = self.reference(tree, catalogue)?;
        let design = Design::new(tree.clone(), base, effects).with_reference(reference);
        let values =
            self.base_parameters.iter().chain(self.effects.iter().flat_map(|effect| &effect.parameters));
        let parameters: Vec<f64> = values.map(|parameter| parameter.value).collect();
        if parameters.len() != design.parameter_count() {
            let message =
                "an effect of the model has not the parameters that its kind has; write it again with phiw"
                    .to_owned();
            return Err(IdentificationError::Model(message));
        }
        self.check()?;
        Ok((design, parameters))
    }

    /// The model as the reference of effects whose columns need torques.
    fn reference(
        &self,
        tree: &Tree,
        catalogue: &dyn EffectCatalogue,
    ) -> Result<ReferenceModel, IdentificationError> {
        let effects: Result<Vec<_>, EffectError> = self
            .effects
            .iter()
            .map(|effect| {
                let values = effect.parameters.iter().map(|parameter| parameter.value).collect();
                Ok((catalogue.build(&effect.spec, tree)?, values))
            })
            .collect();
        Ok(ReferenceModel::new(self.identified_tree(tree)?).with_effects(effects?))
    }

    /// Standard deviation of what a prediction lacks at a torque, the parameters' uncertainty left out
    /// \[N·m, N\].
    pub fn noise_std(&self, torque: usize) -> f64 {
        self.left_out_std.as_ref().unwrap_or(&self.residual_std)[torque]
    }

    /// The tree with the model's standard parameters.
    ///
    /// # Errors
    /// The tree has other bodies.
    pub fn identified_tree(&self, tree: &Tree) -> Result<Tree, IdentificationError> {
        let parameters: Vec<f64> = self.bodies.iter().flat_map(|body| body.inertial).collect();
        let mut identified = tree.clone();
        identified.set_inertial_parameters(&parameters)?;
        Ok(identified)
    }
}

/// Where two lists of names part, in words: how many there are of what, and the first that differ.
fn first_difference(what: &str, model: &[&str], urdf: &[&str]) -> Option<String> {
    let place = (0..model.len().max(urdf.len())).find(|&place| model.get(place) != urdf.get(place))?;
    let name = |names: &[&str]| names.get(place).map_or("absent".to_owned(), |name| format!("`{name}`"));
    let count = if model.len() == urdf.len() {
        String::new()
    } else {
        format!("the model has {} {what}s, the URDF {}, and ", model.len(), urdf.len())
    };
    Some(format!(
        "{count}{what} {} is {} in the model but {} in the URDF",
        place + 1,
        name(model),
        name(urdf)
    ))
}

/// Radius of the sphere that stands for a body of which the URDF says nothing \[m\].
const UNKNOWN_RADIUS: f64 = 0.1;

/// The tree's standard parameters, a body without mass replaced by a sphere of the others' mean mass (of 1 kg
/// if none has any).
///
/// Standard parameters near a mass of zero belong to no real body, and URDF cannot express a first moment
/// without mass.
pub fn with_masses(tree: &Tree) -> Vec<f64> {
    let mut parameters = tree.inertial_parameters();
    let masses = parameters.iter().step_by(PARAMETERS_PER_BODY).filter(|mass| **mass > 0.0);
    let (count, sum) = masses.fold((0.0, 0.0), |(count, sum), mass| (count + 1.0, sum + mass));
    let mass = if count > 0.0 { sum / count } else { 1.0 };
    let moment = 0.4 * mass * UNKNOWN_RADIUS * UNKNOWN_RADIUS;
    let sphere = [mass, 0.0, 0.0, 0.0, moment, 0.0, moment, 0.0, 0.0, moment];
    for body in parameters.chunks_exact_mut(PARAMETERS_PER_BODY).filter(|body| body[0] == 0.0) {
        body.iter_mut().zip(sphere).for_each(|(value, sphere)| *value += sphere);
    }
    parameters
}

/// Name of a standard parameter: joint, then parameter.
pub fn parameter_name(tree: &Tree, standard: usize) -> String {
    let body = &tree.bodies()[standard / PARAMETERS_PER_BODY];
    format!("{}.{}", body.joint, PARAMETER_NAMES[standard % PARAMETERS_PER_BODY])
}

/// Unit of the k-th standard parameter of a body.
pub fn standard_unit(parameter: usize) -> &'static str {
    match parameter {
        0 => "kg",
        1..4 => "kg·m",
        _ => "kg·m²",
    }
}
