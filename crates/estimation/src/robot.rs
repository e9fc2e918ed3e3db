//! The robot as it is declared, and what is believed of it.

use crate::{EstimationError, NewtonSettings};
use phiw_dynamics::Tree;
use phiw_dynamics::check::check_size;
use phiw_dynamics::inertia::{InertialParameters, PARAMETERS_PER_BODY};
use phiw_identification::effect::ReferenceModel;
use phiw_identification::{Design, EffectCatalogue, EffectSpec};
use phiw_regressor::BaseParameters;
use rand::{Rng, RngExt};
use serde::{Deserialize, Serialize};

/// A robot on a fixed base: its kinematics, and the effects that are declared beside the rigid body.
pub struct Robot {
    tree: Tree,
    base: BaseParameters,
    base_link: InertialParameters,
    catalogue: Box<dyn EffectCatalogue + Send>,
    declared: Vec<EffectSpec>,
}

/// A belief about the robot: standard parameters of all bodies, and effects with theirs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RobotModel {
    /// Standard parameters of all moving bodies, ten each.
    pub standard: Vec<f64>,
    /// The effects beside the rigid body: those declared, then those found.
    pub effects: Vec<KnownEffect>,
}

/// An effect and the values of its parameters.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct KnownEffect {
    /// What builds it.
    pub spec: EffectSpec,
    /// Its parameters, in the effect's order.
    pub parameters: Vec<f64>,
}

impl Robot {
    /// A robot with viscous friction in every joint: D = base parameters + joints.
    ///
    /// `base_link` are the ten parameters of the link that stands on the floor, in the world's frame: no
    /// joint torque feels it, so it is never estimated and must be declared (weighing it and measuring it is
    /// enough); the ZMP feels it.
    ///
    /// # Errors
    /// The tree has numbers that are not finite, its base floats, or `catalogue` has no `viscous_friction`.
    pub fn with_viscous_friction(
        tree: Tree,
        base_link: InertialParameters,
        catalogue: impl EffectCatalogue + Send + 'static,
    ) -> Result<Self, EstimationError> {
        let joints: Vec<String> = tree.joint_names().map(str::to_owned).collect();
        let viscous = |joint: &String| EffectSpec::new("viscous_friction", &[joint]);
        Self::new(tree, base_link, joints.iter().map(viscous).collect(), catalogue)
    }

    /// A robot with the `declared` effects, which `catalogue` knows.
    ///
    /// # Errors
    /// As above, or an effect is unknown.
    pub fn new(
        tree: Tree,
        base_link: InertialParameters,
        declared: Vec<EffectSpec>,
        catalogue: impl EffectCatalogue + Send + 'static,
    ) -> Result<Self, EstimationError> {
        let base = BaseParameters::of_tree(&tree, Default::default())?;
        Self::with_base(tree, base, base_link, declared, catalogue)
    }

    /// A robot of which not all motions are possible, with the base parameters that are identifiable from
    /// those that are.
    ///
    /// # Errors
    /// The base floats, or an effect is unknown.
    pub fn with_base(
        tree: Tree,
        base: BaseParameters,
        base_link: InertialParameters,
        declared: Vec<EffectSpec>,
        catalogue: impl EffectCatalogue + Send + 'static,
    ) -> Result<Self, EstimationError> {
        check_size("coordinates of a robot on a fixed base", tree.configuration_size(), tree.joint_count())?;
        let robot = Robot { tree, base, base_link, catalogue: Box::new(catalogue), declared };
        robot.design(&robot.declared)?;
        Ok(robot)
    }

    /// The kinematic tree. Its inertial parameters are the URDF's: nothing here takes them for true.
    pub fn tree(&self) -> &Tree {
        &self.tree
    }
    /// The base parameters.
    pub fn base(&self) -> &BaseParameters {
        &self.base
    }
    /// The ten parameters of the link that stands on the floor.
    pub fn base_link(&self) -> &InertialParameters {
        &self.base_link
    }
    /// The effects that can be built.
    pub fn catalogue(&self) -> &dyn EffectCatalogue {
        self.catalogue.as_ref()
    }
    /// The declared effects.
    pub fn declared(&self) -> &[EffectSpec] {
        &self.declared
    }

    /// The columns of the rigid body and of `effects`.
    ///
    /// # Errors
    /// An effect is unknown.
    pub fn design(&self, effects: &[EffectSpec]) -> Result<Design, EstimationError> {
        let effects: Result<Vec<_>, _> =
            effects.iter().map(|spec| self.catalogue.build(spec, &self.tree)).collect();
        Ok(Design::new(self.tree.clone(), self.base.clone(), effects?))
    }

    /// The columns of the rigid body and of a belief's effects, with the belief as the reference of effects
    /// whose columns need torques.
    ///
    /// # Errors
    /// An effect is unknown, or the belief is of another robot.
    pub fn design_of(&self, model: &RobotModel) -> Result<Design, EstimationError> {
        self.design_beside(model, &[])
    }

    /// The same with more effects after those of the belief.
    ///
    /// # Errors
    /// As [`Self::design_of`].
    pub(crate) fn design_beside(
        &self,
        model: &RobotModel,
        more: &[EffectSpec],
    ) -> Result<Design, EstimationError> {
        let known = |effect: &KnownEffect| {
            Ok((self.catalogue.build(&effect.spec, &self.tree)?, effect.parameters.clone()))
        };
        let effects: Result<Vec<_>, EstimationError> = model.effects.iter().map(known).collect();
        let reference = ReferenceModel::new(model.tree(self)?).with_effects(effects?);
        Ok(self.design(&[&model.specs(), more].concat())?.with_reference(reference))
    }

    /// The truth of a simulated robot: the tree's own standard parameters, and one number for each declared
    /// effect's parameters.
    ///
    /// # Errors
    /// There are not as many numbers as parameters.
    pub fn truth(&self, effect_parameters: &[f64]) -> Result<RobotModel, EstimationError> {
        let effects = self.known_effects(&self.declared, effect_parameters)?;
        Ok(RobotModel { standard: self.tree.inertial_parameters(), effects })
    }

    /// The effects `specs` with their parameters, one after the other.
    fn known_effects(
        &self,
        specs: &[EffectSpec],
        parameters: &[f64],
    ) -> Result<Vec<KnownEffect>, EstimationError> {
        let mut effects = Vec::with_capacity(specs.len());
        let mut next = 0;
        for spec in specs {
            let end = next + self.catalogue.build(spec, &self.tree)?.parameters().len();
            let values = parameters.get(next..end).unwrap_or_default().to_vec();
            effects.push(KnownEffect { spec: spec.clone(), parameters: values });
            next = end;
        }
        check_size("parameters of the effects", parameters.len(), next)?;
        Ok(effects)
    }
}

impl RobotModel {
    /// The effects' specs.
    pub fn specs(&self) -> Vec<EffectSpec> {
        self.effects.iter().map(|effect| effect.spec.clone()).collect()
    }

    /// The parameter vector w: base parameters, then those of the effects.
    ///
    /// # Errors
    /// The model is not of this robot.
    pub fn parameters(&self, robot: &Robot) -> Result<Vec<f64>, EstimationError> {
        let mut parameters = robot.base.from_standard(&self.standard)?;
        parameters.extend(self.effects.iter().flat_map(|effect| &effect.parameters));
        Ok(parameters)
    }

    /// The model with the parameter vector `parameters` over the rigid body and the effects `specs`.
    ///
    /// Controller (13) and ZMP (8) need standard parameters, of which only the base parameters are
    /// identifiable. Of all standard parameters that have them, those nearest to the present belief are
    /// taken, distances weighed by each body's mass ([`BaseParameters::to_standard`]): what was measured is
    /// believed exactly, and what no joint torque feels stays as it was believed, for nothing has been learnt
    /// of it. Joint torques do not depend on the choice. The ZMP does: the directions that torques do not
    /// feel keep the error of the first belief (the mass of the first link, the sideways place of a trunk
    /// that only pitches).
    ///
    /// # Errors
    /// There are not as many parameters as the robot and the effects have.
    pub fn with_parameters(
        &self,
        robot: &Robot,
        specs: &[EffectSpec],
        parameters: &[f64],
    ) -> Result<Self, EstimationError> {
        let count = robot.base.count();
        check_size("base parameters of the model", parameters.len().min(count), count)?;
        let effects = robot.known_effects(specs, &parameters[count..])?;
        let standard = robot.base.to_standard(&parameters[..count], &self.standard)?;
        Ok(RobotModel { standard, effects })
    }

    /// The same belief with other effects: those that it has keep their parameters, new ones begin at 0.
    ///
    /// # Errors
    /// An effect is unknown.
    pub fn with_effects(&self, robot: &Robot, specs: &[EffectSpec]) -> Result<Self, EstimationError> {
        let mut effects = Vec::with_capacity(specs.len());
        for spec in specs {
            let count = robot.catalogue.build(spec, &robot.tree)?.parameters().len();
            let known = self.effects.iter().find(|effect| effect.spec == *spec);
            let parameters = known.map_or_else(|| vec![0.0; count], |effect| effect.parameters.clone());
            effects.push(KnownEffect { spec: spec.clone(), parameters });
        }
        Ok(RobotModel { standard: self.standard.clone(), effects })
    }

    /// The paper's bad initial model w¹: every standard parameter and every parameter of an effect uniform
    /// between 0 and twice its value here (section 5.2.1).
    pub fn unreliable(&self, rng: &mut impl Rng) -> Self {
        let mut draw = |value: &f64| 2.0 * value * rng.random::<f64>();
        let standard = self.standard.iter().map(&mut draw).collect();
        let effect = |effect: &KnownEffect| KnownEffect {
            spec: effect.spec.clone(),
            parameters: effect.parameters.iter().map(&mut draw).collect(),
        };
        RobotModel { standard, effects: self.effects.iter().map(effect).collect() }
    }

    /// The same belief with bodies that exist: spheres with the masses and centres of mass of its own.
    pub fn of_spheres(&self) -> Self {
        let standard = spheres(&self.standard, &NewtonSettings::default());
        RobotModel { standard, effects: self.effects.clone() }
    }

    /// The tree with this model's standard parameters.
    ///
    /// # Errors
    /// The model is not of this robot.
    pub fn tree(&self, robot: &Robot) -> Result<Tree, EstimationError> {
        check_size(
            "standard parameters",
            self.standard.len(),
            PARAMETERS_PER_BODY * robot.tree.bodies().len(),
        )?;
        let mut tree = robot.tree.clone();
        tree.set_inertial_parameters(&self.standard)?;
        Ok(tree)
    }
}

/// Bodies of the same mass and first moment that exist: spheres about their centres of mass.
pub(crate) fn spheres(standard: &[f64], settings: &NewtonSettings) -> Vec<f64> {
    let sphere = |body: &[f64]| {
        let mass = body[0].max(settings.least_mass);
        let centre = phiw_dynamics::Vec3([body[1], body[2], body[3]].map(|moment| moment / mass));
        let moment = mass * settings.sphere_radius * settings.sphere_radius;
        let tensor = phiw_dynamics::Mat3([[moment, 0.0, 0.0], [0.0, moment, 0.0], [0.0, 0.0, moment]]);
        phiw_dynamics::inertia::Inertia::from_center_of_mass(mass, centre, tensor).parameters()
    };
    standard.chunks_exact(PARAMETERS_PER_BODY).flat_map(sphere).collect()
}
