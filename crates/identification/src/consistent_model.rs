//! What a model's file has of bodies that can exist.

use crate::consistent::Consistent;
use crate::model::{BodyParameters, Model};
use crate::{Design, IdentificationError};
use phiw_dynamics::Tree;
use phiw_dynamics::check::check_size;
use phiw_dynamics::inertia::PARAMETERS_PER_BODY;
use serde::{Deserialize, Serialize};

/// Parameters of bodies that can exist, and of effects within their bounds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ConsistentModel {
    /// Weight of the URDF's bodies, in nats of independent samples.
    pub prior_weight: f64,
    /// How far the objective can be above its optimum, in the same unit.
    pub gap: f64,
    /// Standard parameters of each body, all possible.
    pub bodies: Vec<BodyParameters>,
    /// Parameters of each effect of [`Model::effects`], in its order.
    pub effects: Vec<Vec<f64>>,
}

impl Model {
    /// The same with the fit over possible bodies beside it. Where that is the model's own
    /// ([`Identified::with_possible`](crate::Identified::with_possible)), its bodies are these, too.
    ///
    /// # Errors
    /// It is not of this design.
    pub fn with_consistent(
        mut self,
        design: &Design,
        consistent: &Consistent,
    ) -> Result<Self, IdentificationError> {
        check_size(
            "standard parameters",
            consistent.standard.len(),
            PARAMETERS_PER_BODY * self.bodies.len(),
        )?;
        check_size("parameters", consistent.parameters.len(), design.parameter_count())?;
        let bodies = self.bodies.iter().zip(consistent.standard.as_chunks().0);
        let effects = 0..design.effects().len();
        let bodies: Vec<BodyParameters> = bodies
            .map(|(body, inertial)| BodyParameters { joint: body.joint.clone(), inertial: *inertial })
            .collect();
        if consistent.foretells_better {
            self.bodies.clone_from(&bodies);
        }
        self.consistent = Some(ConsistentModel {
            prior_weight: consistent.weight,
            gap: consistent.gap,
            bodies,
            effects: effects
                .map(|effect| consistent.parameters[design.effect_parameters(effect)].to_vec())
                .collect(),
        });
        Ok(self)
    }

    /// The tree with bodies that can exist; with the least-squares ones where the model has no others.
    ///
    /// # Errors
    /// The tree has other bodies.
    pub fn consistent_tree(&self, tree: &Tree) -> Result<Tree, IdentificationError> {
        let Some(consistent) = &self.consistent else { return self.identified_tree(tree) };
        let parameters: Vec<f64> = consistent.bodies.iter().flat_map(|body| body.inertial).collect();
        let mut possible = tree.clone();
        possible.set_inertial_parameters(&parameters)?;
        Ok(possible)
    }

    /// Value of the k-th parameter of an effect that belongs to the possible bodies; the least-squares one
    /// where the model has no others.
    pub fn consistent_effect(&self, effect: usize, parameter: usize) -> Option<f64> {
        match &self.consistent {
            Some(consistent) => consistent.effects.get(effect)?.get(parameter).copied(),
            None => Some(self.effects.get(effect)?.parameters.get(parameter)?.value),
        }
    }
}
