//! Mass and inertia of a body.

use super::MjcfReadError;
use super::element::Element;
use super::orientation::Angles;
use super::robot::Robot;
use phiw_dynamics::{Mat3, Vec3};

/// Mass, centre of mass, and inertia about it, in the axes of the body's frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct BodyInertia {
    /// \[kg\].
    pub mass: f64,
    /// \[m\].
    pub center: Vec3<f64>,
    /// \[kg·m²\].
    pub tensor: Mat3<f64>,
}

/// What `<compiler>` does to the inertias of all bodies.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct InertiaRules {
    /// Whether geometry decides: always, never, or where there is no inertial (none of both).
    pub from_geometry: Option<bool>,
    /// Groups of geoms that have inertia.
    pub groups: Option<[i64; 2]>,
    /// The least mass \[kg\] and moment of inertia \[kg·m²\].
    pub least: [f64; 2],
    /// Mass of all bodies \[kg\], where it is set.
    pub total_mass: Option<f64>,
}

impl InertiaRules {
    pub fn read(compiler: Option<&Element<'_, '_>>) -> Result<Self, MjcfReadError> {
        let Some(compiler) = compiler else { return Ok(InertiaRules::default()) };
        let from_geometry = match compiler.text("inertiafromgeom") {
            None | Some("auto") => None,
            Some("true") => Some(true),
            Some("false") => Some(false),
            Some(other) => return Err(compiler.wrong("inertiafromgeom", other, "true, false or auto")),
        };
        let groups =
            compiler.numbers::<2>("inertiagrouprange")?.map(|groups| groups.map(|group| group as i64));
        let number = |name| Ok::<f64, MjcfReadError>(compiler.number(name)?.unwrap_or_default());
        Ok(InertiaRules {
            from_geometry,
            groups,
            least: [number("boundmass")?, number("boundinertia")?],
            total_mass: compiler.number("settotalmass")?.filter(|mass| *mass > 0.0),
        })
    }

    /// Scales all bodies to the mass that they are to have together.
    pub fn set_total_mass(&self, robot: &mut Robot) {
        let mass: f64 = robot.links.iter().map(|link| link.inertia.mass).sum();
        if let Some(total) = self.total_mass.filter(|_| mass > 0.0) {
            for link in &mut robot.links {
                link.inertia.mass *= total / mass;
                link.inertia.tensor = link.inertia.tensor.scale(total / mass);
            }
        }
    }
}

impl BodyInertia {
    pub const NONE: BodyInertia =
        BodyInertia { mass: 0.0, center: Vec3([0.0; 3]), tensor: Mat3([[0.0; 3]; 3]) };

    /// Of `<inertial>`.
    pub fn of_element(inertial: &Element<'_, '_>, angles: &Angles) -> Result<Self, MjcfReadError> {
        let missing = |attribute| MjcfReadError::Missing {
            line: super::element::line(inertial.node),
            element: "inertial".to_owned(),
            attribute,
        };
        let mass = inertial.number("mass")?.ok_or_else(|| missing("mass"))?;
        let placement = angles.placement(inertial)?;
        let own = if let Some([xx, yy, zz, xy, xz, yz]) = inertial.numbers::<6>("fullinertia")? {
            Mat3([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        } else {
            let [x, y, z] =
                inertial.numbers::<3>("diaginertia")?.ok_or_else(|| missing("diaginertia or fullinertia"))?;
            Mat3([[x, 0.0, 0.0], [0.0, y, 0.0], [0.0, 0.0, z]])
        };
        let tensor = placement.rotation * own * placement.rotation.transpose();
        Ok(BodyInertia { mass, center: placement.translation, tensor })
    }

    /// All of them as one body.
    pub fn sum(parts: &[BodyInertia]) -> Self {
        let mass: f64 = parts.iter().map(|part| part.mass).sum();
        if mass <= 0.0 {
            return BodyInertia::NONE;
        }
        let moment = parts.iter().fold(Vec3::zero(), |sum, part| sum + part.center.scale(part.mass));
        let center = moment.scale(1.0 / mass);
        let about = |sum: Mat3<f64>, part: &BodyInertia| {
            // Steiner: m·(d²·1 − d·dᵀ) = −m·[d]×².
            let skew = Mat3::skew(part.center - center);
            sum + part.tensor - (skew * skew).scale(part.mass)
        };
        BodyInertia { mass, center, tensor: parts.iter().fold(Mat3([[0.0; 3]; 3]), about) }
    }
}
