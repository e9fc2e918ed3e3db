//! What the robot stands on.

use crate::Error;
use crate::arguments::NextArguments;
use phiw_curriculum::constraint::{StanceError, StanceSettings};
use phiw_dynamics::Tree;
use phiw_dynamics::inertia::InertialParameters;
use phiw_dynamics::urdf::{UrdfOptions, read_urdf};
use phiw_zmp::{Stance, feet_from_toml};
use std::path::Path;

/// The link that no joint moves, and the floor under it.
pub struct Standing {
    /// Standard parameters of the base link, in its frame.
    pub base_link: InertialParameters,
    /// The floor and the region that carries; none for a robot that is bolted down.
    pub stance: Option<Stance>,
}

impl Standing {
    /// Reads the URDF once more, as a robot that could fall; `held` are the joints that are held, by name.
    pub fn read(arguments: &NextArguments, xml: &str, held: &[(String, f64)]) -> Result<Self, Error> {
        let read = |held: &[(String, f64)]| {
            let options = UrdfOptions { floating_base: true, held: held.to_vec(), snap: true };
            let wrong = |source| Error::Urdf { path: arguments.urdf.clone(), source: Box::new(source) };
            Ok::<Tree, Error>(read_urdf(xml, &options).map_err(wrong)?.tree)
        };
        let base_link = read(held)?.bodies()[0].inertial;
        let stance = match &arguments.support {
            Some(path) => Some(stance(path, &read(&[])?, held)?),
            None => None,
        };
        Ok(Standing { base_link, stance })
    }
}

/// The support polygon of the soles, seen from the base; `whole` is the robot with no joint held.
fn stance(path: &Path, whole: &Tree, held: &[(String, f64)]) -> Result<Stance, Error> {
    let text = crate::input::read_text(path, phiw_limits::Limits::default().toml_bytes)?;
    let feet =
        feet_from_toml(&text, whole).map_err(|source| Error::Support { path: path.to_owned(), source })?;
    StanceSettings::default().stance(whole, &feet, held).map_err(|source| match source {
        StanceError::Curriculum(source) => source.into(),
        source => Error::Stance { path: path.to_owned(), source: Box::new(source) },
    })
}
