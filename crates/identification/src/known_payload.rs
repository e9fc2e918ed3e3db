//! A body that the robot held while a log was recorded, and of which mass and centre of mass are known: its
//! torques are taken off those that were measured.

use phiw_dynamics::inertia::Inertia;
use phiw_dynamics::{DimensionError, Mat3, Tree, Vec3, Workspace};
use phiw_telemetry::{Block, LogError, LogSource, Payload};

/// A robot without weight that holds the body.
#[derive(Clone)]
pub(crate) struct KnownPayload {
    tree: Tree,
}

impl KnownPayload {
    /// What the map of a log says that the robot held; `None` where it says nothing.
    ///
    /// # Errors
    /// The map names a link that no joint carries, or says that nothing is known of the body.
    pub fn of(tree: &Tree, source: &LogSource) -> Result<Option<Self>, LogError> {
        let Some(map) = &source.map else { return Ok(None) };
        let (link, mass_kg, com_m) = match source.facts().payload {
            None => return Ok(None),
            Some(Payload::Known { link, mass_kg, com_m }) => (link, mass_kg, com_m),
            Some(Payload::UnknownButTheSame) => {
                let what = format!(
                    "nothing is known of what the robot held in {}, and no fit can tell it from the links; weigh it, or leave the log out",
                    source.path.display()
                );
                return Err(map.payload_error(what).into());
            }
        };
        let Some(holder) = tree.bodies().iter().position(|body| body.link == link) else {
            let links: Vec<&str> = tree.bodies().iter().map(|body| body.link.as_str()).collect();
            let what =
                format!("no joint that moves carries the link `{link}`; those are {}", links.join(", "));
            return Err(map.payload_error(what).into());
        };
        let point = Inertia::from_center_of_mass(mass_kg, Vec3(com_m), Mat3([[0.0; 3]; 3])).parameters();
        let mut parameters = vec![0.0; point.len() * tree.bodies().len()];
        parameters[point.len() * holder..][..point.len()].copy_from_slice(&point);
        let mut tree = tree.clone();
        // There are ten for each body.
        tree.set_inertial_parameters(&parameters)
            .map_err(|error| LogError::from(map.payload_error(error.to_string())))?;
        Ok(Some(KnownPayload { tree }))
    }

    /// The block with the torques of the robot alone.
    ///
    /// # Errors
    /// The block is of other joints.
    pub fn taken_off(
        &self,
        mut block: Block,
        workspace: &mut Workspace<f64>,
    ) -> Result<Block, DimensionError> {
        let mut torque = vec![0.0; self.tree.velocity_size()];
        for sample in 0..block.len() {
            let row = block.row(sample);
            if row.end > block.tau.len() {
                break;
            }
            let [q, qd, qdd] = [&block.q, &block.qd, &block.qdd].map(|signal| &signal[row.clone()]);
            self.tree.inverse_dynamics(q, qd, qdd, workspace, &mut torque)?;
            block.tau[row].iter_mut().zip(&torque).for_each(|(measured, own)| *measured -= own);
        }
        Ok(block)
    }

    /// Memory for [`KnownPayload::taken_off`].
    pub fn workspace(&self) -> Workspace<f64> {
        Workspace::new(&self.tree)
    }
}
