//! Mass, inertia and extent of primitive shapes.
//!
//! Formulas of solids of even density; a capsule is a cylinder between two halves of a ball.

use super::MjcfReadError;
use super::element::Element;
use super::inertial::BodyInertia;
use super::meshes::{MeshFile, Meshes};
use super::orientation::{Angles, direction, from_z_to};
use crate::write::{Escaped, Numbers};
use phiw_dynamics::{Mat3, Placement, Vec3};
use std::f64::consts::PI;

/// Density of a geom that gives none, that of water \[kg/m³\].
const DENSITY: f64 = 1000.0;

/// What a geom adds to its body.
pub(super) enum Added {
    /// Mass and inertia in the body's frame.
    Inertia(BodyInertia),
    /// Nothing.
    Nothing,
    /// A mesh or a shell, whose inertia is not read.
    Unknown,
}

/// Mass and inertia that a geom adds to its body.
pub(super) fn added(geom: &Element<'_, '_>, angles: &Angles) -> Result<Added, MjcfReadError> {
    let mass = geom.number("mass")?;
    let density = geom.number("density")?.unwrap_or(DENSITY);
    if mass == Some(0.0) || (mass.is_none() && density == 0.0) {
        return Ok(Added::Nothing);
    }
    let kind = kind(geom);
    if matches!(kind, "plane" | "hfield") {
        return Ok(Added::Nothing);
    }
    if matches!(kind, "mesh" | "sdf")
        || geom.text("mesh").is_some()
        || geom.text("shellinertia") == Some("true")
    {
        return Ok(Added::Unknown);
    }
    let (solid, placement) = solid(geom, kind, angles)?;
    let (volume, moments) = match solid {
        Solid::Sphere(radius) => ball(radius),
        Solid::Capsule(radius, half) => capsule(radius, half),
        Solid::Cylinder(radius, half) => cylinder(radius, half),
        Solid::Ellipsoid(sizes) => ellipsoid(sizes),
        Solid::Box(sizes) => cuboid(sizes),
    };
    let mass = mass.unwrap_or(density * volume);
    let tensor = Mat3([[moments[0], 0.0, 0.0], [0.0, moments[1], 0.0], [0.0, 0.0, moments[2]]]).scale(mass);
    let turned = placement.rotation * tensor * placement.rotation.transpose();
    Ok(Added::Inertia(BodyInertia { mass, center: placement.translation, tensor: turned }))
}

fn kind<'a>(geom: &Element<'a, '_>) -> &'a str {
    geom.text("type").unwrap_or(if geom.text("mesh").is_some() { "mesh" } else { "sphere" })
}

/// A shape about its frame's origin, by radii and halves of lengths \[m\]; long ones lie along z.
enum Solid {
    Sphere(f64),
    Capsule(f64, f64),
    Cylinder(f64, f64),
    Ellipsoid([f64; 3]),
    Box([f64; 3]),
}

/// The shape of a geom and its frame in the body's.
fn solid(
    geom: &Element<'_, '_>,
    kind: &str,
    angles: &Angles,
) -> Result<(Solid, Placement<f64>), MjcfReadError> {
    let mut placement = angles.placement(geom)?;
    let size = geom.list("size")?.unwrap_or_default();
    let missing =
        || geom.wrong("size", geom.text("size").unwrap_or_default(), format!("positive sizes of a {kind}"));
    let at = |place: usize| size.get(place).copied().filter(|size| *size > 0.0).ok_or_else(missing);
    let half_length = match geom.numbers::<6>("fromto")? {
        Some([x0, y0, z0, x1, y1, z1]) => {
            let (from, to) = (Vec3([x0, y0, z0]), Vec3([x1, y1, z1]));
            let along = from - to;
            let text = geom.text("fromto").unwrap_or_default();
            let axis = direction(along, geom.wrong("fromto", text, "two points that differ"))?;
            placement = Placement { rotation: from_z_to(axis), translation: (from + to).scale(0.5) };
            Some(0.5 * along.dot(along).sqrt())
        }
        None => None,
    };
    let half = |place: usize| half_length.map_or_else(|| at(place), Ok);
    let solid = match kind {
        "sphere" => Solid::Sphere(at(0)?),
        "capsule" => Solid::Capsule(at(0)?, half(1)?),
        "cylinder" => Solid::Cylinder(at(0)?, half(1)?),
        "ellipsoid" | "box" => {
            // Two cross sizes, or one for both where two points give the length.
            let sizes = match half_length {
                Some(half) => [at(0)?, if size.len() > 1 { at(1)? } else { at(0)? }, half],
                None => [at(0)?, at(1)?, at(2)?],
            };
            if kind == "box" { Solid::Box(sizes) } else { Solid::Ellipsoid(sizes) }
        }
        other => {
            return Err(geom.wrong(
                "type",
                other,
                "plane, sphere, capsule, ellipsoid, cylinder, box or mesh",
            ));
        }
    };
    Ok((solid, placement))
}

/// A geom as a URDF's `<geometry>`, with its frame in the body's: a capsule as a cylinder with a ball at each
/// end, an ellipsoid as the box around it. Nothing of what has no extent or is not understood: geometry that
/// only is to be seen may be anything.
pub(super) fn shapes(
    geom: &Element<'_, '_>,
    angles: &Angles,
    meshes: &Meshes,
) -> Vec<(Placement<f64>, String)> {
    let kind = kind(geom);
    if let Some(mesh) = geom.text("mesh") {
        let placement = angles.placement(geom).ok();
        let file = meshes.file(mesh).filter(|_| kind == "mesh");
        let written = |(MeshFile { path, scale }, placement): (&MeshFile, Placement<f64>)| {
            (placement, format!("<mesh filename=\"{}\" scale=\"{}\"/>", Escaped(path), Numbers(scale)))
        };
        return file.zip(placement).map(written).into_iter().collect();
    }
    if matches!(kind, "plane" | "hfield" | "sdf") {
        return Vec::new();
    }
    let Ok((solid, placement)) = solid(geom, kind, angles) else { return Vec::new() };
    let sphere = |radius: f64| format!("<sphere radius=\"{radius}\"/>");
    let cylinder =
        |radius: f64, half: f64| format!("<cylinder radius=\"{radius}\" length=\"{}\"/>", 2.0 * half);
    match solid {
        Solid::Sphere(radius) => vec![(placement, sphere(radius))],
        Solid::Cylinder(radius, half) => vec![(placement, cylinder(radius, half))],
        Solid::Capsule(radius, half) => {
            let end = |side: f64| Placement {
                translation: placement.point(Vec3([0.0, 0.0, side * half])),
                ..placement
            };
            vec![(placement, cylinder(radius, half)), (end(1.0), sphere(radius)), (end(-1.0), sphere(radius))]
        }
        Solid::Ellipsoid(half) | Solid::Box(half) => {
            vec![(placement, format!("<box size=\"{}\"/>", Numbers(&half.map(|half| 2.0 * half))))]
        }
    }
}

/// Volume, and moments of inertia about the centre for a unit of mass.
type Moments = (f64, [f64; 3]);

fn ball(radius: f64) -> Moments {
    (4.0 / 3.0 * PI * radius.powi(3), [0.4 * radius * radius; 3])
}

fn cylinder(radius: f64, half: f64) -> Moments {
    let across = radius * radius / 4.0 + half * half / 3.0;
    (PI * radius * radius * 2.0 * half, [across, across, 0.5 * radius * radius])
}

fn capsule(radius: f64, half: f64) -> Moments {
    let (middle, [middle_across, _, middle_along]) = cylinder(radius, half);
    let (caps, _) = ball(radius);
    let volume = middle + caps;
    let [of_middle, of_caps] = [middle / volume, caps / volume];
    let along = of_middle * middle_along + of_caps * 0.4 * radius * radius;
    // A half ball's own moment about the ball's centre is the ball's; its centre of mass lies 3/8 r outwards.
    let shifted = 0.4 * radius * radius + half * half + 0.75 * half * radius;
    let across = of_middle * middle_across + of_caps * shifted;
    (volume, [across, across, along])
}

fn ellipsoid([a, b, c]: [f64; 3]) -> Moments {
    let moment = |x: f64, y: f64| 0.2 * (x * x + y * y);
    (4.0 / 3.0 * PI * a * b * c, [moment(b, c), moment(a, c), moment(a, b)])
}

fn cuboid([a, b, c]: [f64; 3]) -> Moments {
    let moment = |x: f64, y: f64| (x * x + y * y) / 3.0;
    (8.0 * a * b * c, [moment(b, c), moment(a, c), moment(a, b)])
}
