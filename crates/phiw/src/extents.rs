//! Where a body's mass must lie, as far as its geometry says: the box around the shapes of its links.

use crate::input::read_bytes;
use crate::mesh_extent::mesh_extent;
use crate::session::Session;
use phiw_dynamics::urdf::{Extent, LinkInBody, LinkShape, Shape, link_shapes};
use phiw_limits::Limits;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// A box thinner than that is made as thick \[m\]: nothing lies strictly within a sheet.
const LEAST_EDGE: f64 = 2e-3;
/// Reasons that a warning names.
const NAMED: usize = 4;

/// For each body of the session's robot the box that holds its geometry, where that is known of all of its
/// links, and a warning of what is not.
///
/// A link is what is seen of it and what collides, as far as each of the two can be read as a whole: where
/// one is of meshes that are not at hand, the other alone is taken.
pub fn of_bodies(session: &Session) -> (BTreeMap<usize, Extent>, Option<String>) {
    let shapes = link_shapes(&session.xml).unwrap_or_default();
    let mut meshes = Meshes { urdf: &session.arguments.urdf, read: BTreeMap::new() };
    let mut extents: BTreeMap<usize, Extent> = BTreeMap::new();
    let mut unknown: Vec<(usize, String)> = Vec::new();
    for part in &session.links {
        match of_link(part, &shapes, &mut meshes) {
            Ok(extent) => {
                let own = extents.entry(part.body).or_insert(Extent::EMPTY);
                *own = own.with(extent);
            }
            Err(why) => unknown.push((part.body, why)),
        }
    }
    extents.retain(|body, extent| !extent.is_empty() && unknown.iter().all(|(other, _)| other != body));
    extents.values_mut().for_each(thicken);
    (extents, warning(&unknown))
}

/// The extent of a link's geometry in its body's frame, which may be empty of a link without inertia; why
/// not, where it is not known.
fn of_link(part: &LinkInBody, shapes: &[LinkShape], meshes: &mut Meshes<'_>) -> Result<Extent, String> {
    let mut whole = Extent::EMPTY;
    let mut why = None;
    for visual in [true, false] {
        let own = shapes.iter().filter(|shape| shape.link == part.link && shape.visual == visual);
        let mut extent = Ok(Extent::EMPTY);
        for LinkShape { placement, shape, .. } in own {
            let placed = part.placement.compose(*placement);
            let of_shape = match shape {
                Shape::Mesh { file, scale } => {
                    meshes.extent(file).map(|extent| scaled(extent, *scale).placed(placed))
                }
                Shape::Other => Err("a shape that is not understood".to_owned()),
                shape => shape.extent(placed).ok_or_else(|| "a shape without an extent".to_owned()),
            };
            extent = extent.and_then(|extent| of_shape.map(|own| extent.with(own)));
        }
        match extent {
            Ok(extent) => whole = whole.with(extent),
            Err(reason) => why = why.or(Some(reason)),
        }
    }
    match (whole.is_empty(), why) {
        (false, _) => Ok(whole),
        (true, Some(why)) => Err(format!("{} ({why})", part.link)),
        (true, None) if part.has_inertia => Err(format!("{} (it has no geometry)", part.link)),
        (true, None) => Ok(Extent::EMPTY),
    }
}

fn scaled(extent: Extent, scale: [f64; 3]) -> Extent {
    let times = |corner: [f64; 3]| std::array::from_fn(|axis| scale[axis] * corner[axis]);
    // A negative scale mirrors.
    Extent::EMPTY.with_point(times(extent.lower)).with_point(times(extent.upper))
}

fn thicken(extent: &mut Extent) {
    for axis in 0..3 {
        let missing = (LEAST_EDGE - (extent.upper[axis] - extent.lower[axis])).max(0.0);
        extent.lower[axis] -= 0.5 * missing;
        extent.upper[axis] += 0.5 * missing;
    }
}

fn warning(unknown: &[(usize, String)]) -> Option<String> {
    if unknown.is_empty() {
        return None;
    }
    let named: Vec<&str> = unknown.iter().take(NAMED).map(|(_, why)| why.as_str()).collect();
    let more = unknown.len().saturating_sub(NAMED);
    let more = if more > 0 { format!(" and {more} more") } else { String::new() };
    Some(format!(
        "--inside-geometry says nothing of the bodies with {}{more}: --inside LINK=… does",
        named.join(", ")
    ))
}

/// Meshes by the names that a URDF has for them.
struct Meshes<'a> {
    urdf: &'a Path,
    read: BTreeMap<String, Result<Extent, String>>,
}

impl Meshes<'_> {
    fn extent(&mut self, file: &str) -> Result<Extent, String> {
        if let Some(known) = self.read.get(file) {
            return known.clone();
        }
        let found = self.read(file);
        self.read.insert(file.to_owned(), found.clone());
        found
    }

    fn read(&self, file: &str) -> Result<Extent, String> {
        let shown: String = file.chars().take(200).collect();
        let Some(path) = resolved(file, self.urdf) else { return Err(format!("{shown} is not at hand")) };
        let extension = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
        // What is not read anyway need not be opened.
        if !matches!(extension.as_str(), "stl" | "obj") {
            return Err(format!("{shown}: only STL and OBJ are read"));
        }
        let bytes = read_bytes(&path, Limits::default().mesh_bytes).map_err(|error| error.to_string())?;
        mesh_extent(&bytes, &extension).map_err(|why| format!("{shown}: {why}"))
    }
}

/// The file that a URDF's name for a mesh stands for, if it is there: a path from the URDF's folder,
/// `file://…`, or `package://NAME/…` (`model://` likewise), where NAME is a folder above the URDF's or beside
/// one of those.
fn resolved(file: &str, urdf: &Path) -> Option<PathBuf> {
    let is_there = |path: PathBuf| path.is_file().then_some(path);
    let folder = std::path::absolute(urdf).ok()?.parent()?.to_owned();
    let package = file.strip_prefix("package://").or_else(|| file.strip_prefix("model://"));
    let Some(package) = package else {
        return is_there(folder.join(file.strip_prefix("file://").unwrap_or(file)));
    };
    let (name, rest) = package.split_once('/')?;
    folder.ancestors().find_map(|above| {
        let itself = above.file_name().is_some_and(|own| own == name).then(|| above.join(rest));
        itself.and_then(is_there).or_else(|| is_there(above.join(name).join(rest)))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn packages_are_found_above_the_urdf_and_beside() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        for name in ["arm_description/urdf", "arm_description/meshes", "other/meshes"] {
            std::fs::create_dir_all(path(name)).unwrap();
        }
        let urdf = path("arm_description/urdf/arm.urdf");
        for name in ["arm_description/meshes/a.stl", "other/meshes/b.stl", "arm_description/urdf/c.stl"] {
            std::fs::write(path(name), "").unwrap();
        }
        let found = |file: &str| resolved(file, &urdf).is_some();
        assert!(found("package://arm_description/meshes/a.stl"));
        assert!(found("package://other/meshes/b.stl") && found("model://other/meshes/b.stl"));
        assert!(found("c.stl") && found("../meshes/a.stl"));
        assert!(found(&format!("file://{}", path("other/meshes/b.stl").display())));
        for absent in
            ["package://none/a.stl", "package://arm_description", "d.stl", "package://other/meshes", ""]
        {
            assert!(!found(absent), "{absent}");
        }
    }

    #[test]
    fn a_sheet_gets_a_thickness_and_a_negative_scale_mirrors() {
        let sheet = Extent { lower: [0.0, 0.0, 1.0], upper: [1.0, 2.0, 1.0] };
        let mut thick = scaled(sheet, [1.0, -2.0, 1.0]);
        assert_eq!((thick.lower[1], thick.upper[1]), (-4.0, 0.0));
        thicken(&mut thick);
        assert_eq!((thick.lower[2], thick.upper[2]), (0.999, 1.001));
        assert_eq!((thick.lower[0], thick.upper[0]), (0.0, 1.0));
    }
}
