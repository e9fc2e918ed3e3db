//! A `model.json` that is given, and the robot that it is said to be of.

use crate::Error;
use crate::in_memory::text_of;
use phiw_dynamics::Tree;
use phiw_identification::{Design, EffectCatalogue, IdentificationError, Model};
use phiw_limits::Limits;
use phiw_regressor::factor::Factor;
use std::path::{Path, PathBuf};

/// A model and where it comes from.
pub struct ModelFile {
    path: PathBuf,
    /// What is in it.
    pub model: Model,
}

impl ModelFile {
    /// Reads a file and checks its numbers.
    ///
    /// # Errors
    /// It is no model, or its numbers cannot be a model's.
    pub fn read(path: &Path) -> Result<Self, Error> {
        Self::given(None, path)
    }

    /// The same, of the text that is given for the file, if one is.
    ///
    /// # Errors
    /// As [`Self::read`].
    pub fn given(text: Option<&String>, path: &Path) -> Result<Self, Error> {
        let text = text_of(text, path, Limits::default().model_bytes)?;
        let path = path.to_owned();
        match serde_json::from_str::<Model>(&text) {
            Ok(model) => {
                let file = ModelFile { path, model };
                file.model.check().map_err(|source| file.wrong(source))?;
                Ok(file)
            }
            Err(source) => Err(Error::NotAModel { path, source }),
        }
    }

    /// The model's columns and parameters on a robot.
    ///
    /// # Errors
    /// The model is of another robot than `tree`, which is that of the file `urdf`.
    pub fn design(
        &self,
        urdf: &Path,
        tree: &Tree,
        catalogue: &dyn EffectCatalogue,
    ) -> Result<(Design, Vec<f64>), Error> {
        self.model.design(tree, catalogue).map_err(|source| match source {
            // That is about the robot alone.
            IdentificationError::Input(_) => source.into(),
            source => Error::ModelOfAnother {
                path: self.path.clone(),
                urdf: urdf.to_owned(),
                source: Box::new(source),
            },
        })
    }

    /// The model's columns and parameters on its own robot.
    ///
    /// # Errors
    /// The file does not fit the robot in it.
    pub fn own_design(
        &self,
        tree: &Tree,
        catalogue: &dyn EffectCatalogue,
    ) -> Result<(Design, Vec<f64>), Error> {
        self.model.design(tree, catalogue).map_err(|source| self.wrong(source))
    }

    /// What was known when the model was fitted.
    ///
    /// # Errors
    /// The file's factor is no triangle.
    pub fn factor(&self) -> Result<Factor, Error> {
        self.model.factor.factor().map_err(|source| self.wrong(source))
    }

    /// What the model knows of its parameters, no more surely than its covariance says.
    ///
    /// # Errors
    /// The file's factor or covariance has not its own size.
    pub fn knowledge(&self) -> Result<Factor, Error> {
        self.model.knowledge().map_err(|source| self.wrong(source))
    }

    fn wrong(&self, source: IdentificationError) -> Error {
        Error::Model { path: self.path.clone(), source: Box::new(source) }
    }
}
