//! Geometry of links: boxes, cylinders, spheres, and the files of meshes.
//!
//! The dynamics need none of it, so what is not understood is no error: a `<visual>` may hold anything.

use super::UrdfError;
use super::joint::{is_usable, is_usable_pose, pose};
use super::robot::Pose;
use super::source::{child, children, name, parse};
use crate::{Placement, Vec3};
use roxmltree::Node;

/// A shape of a link.
#[derive(Clone, Debug, PartialEq)]
pub struct LinkShape {
    /// Name of the link.
    pub link: String,
    /// Whether it is there to be seen; else it is what collides.
    pub visual: bool,
    /// The shape's frame in the link's.
    pub placement: Placement<f64>,
    /// The shape.
    pub shape: Shape,
}

/// A shape about the origin of its frame; lengths in m.
#[derive(Clone, Debug, PartialEq)]
pub enum Shape {
    /// A box, by half of its edges.
    Box([f64; 3]),
    /// A cylinder along z.
    Cylinder {
        /// Its radius.
        radius: f64,
        /// Half of its length.
        half_length: f64,
    },
    /// A ball, by its radius.
    Sphere(f64),
    /// One that is not understood.
    Other,
    /// A mesh.
    Mesh {
        /// Its file, as the URDF names it: a path or `package://…`.
        file: String,
        /// What its coordinates are multiplied with.
        scale: [f64; 3],
    },
}

/// A link and where it lies in the body that it is a part of.
#[derive(Clone, Debug, PartialEq)]
pub struct LinkInBody {
    /// Name of the link.
    pub link: String,
    /// Whether it has an inertia of its own.
    pub has_inertia: bool,
    /// Index of the body in the tree.
    pub body: usize,
    /// The link's frame in the body's.
    pub placement: Placement<f64>,
}

/// A box along the axes of a frame that holds points \[m\].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Extent {
    /// Its lowest corner.
    pub lower: [f64; 3],
    /// Its highest corner.
    pub upper: [f64; 3],
}

impl Extent {
    /// Of nothing.
    pub const EMPTY: Extent = Extent { lower: [f64::INFINITY; 3], upper: [f64::NEG_INFINITY; 3] };

    /// Whether it holds a point.
    pub fn is_empty(&self) -> bool {
        self.lower.iter().zip(&self.upper).any(|(lower, upper)| lower > upper)
    }

    /// The same with a point.
    pub fn with_point(mut self, point: [f64; 3]) -> Self {
        for (axis, value) in point.into_iter().enumerate() {
            self.lower[axis] = self.lower[axis].min(value);
            self.upper[axis] = self.upper[axis].max(value);
        }
        self
    }

    /// The smallest that holds both.
    pub fn with(self, other: Self) -> Self {
        if other.is_empty() { self } else { self.with_point(other.lower).with_point(other.upper) }
    }

    /// The smallest in an outer frame that holds the corners of this one.
    pub fn placed(self, placement: Placement<f64>) -> Self {
        if self.is_empty() {
            return self;
        }
        (0..8).fold(Extent::EMPTY, |extent, corner: usize| {
            let side =
                |axis: usize| if corner >> axis & 1 == 0 { self.lower[axis] } else { self.upper[axis] };
            extent.with_point(placement.point(Vec3([side(0), side(1), side(2)])).0)
        })
    }
}

impl Shape {
    /// The smallest box along the axes of an outer frame that holds the shape, which stands in it at
    /// `placement`; none of a mesh, whose file nobody has read, and of what is not understood.
    pub fn extent(&self, placement: Placement<f64>) -> Option<Extent> {
        let half = |axis: usize| {
            let row = placement.rotation.0[axis];
            match self {
                Shape::Box(half) => Some((0..3).map(|own| row[own].abs() * half[own]).sum()),
                Shape::Cylinder { radius, half_length } => {
                    // The disc at an end reaches r·sin of the angle between its axis and the outer one.
                    Some(row[2].abs() * half_length + radius * (1.0 - row[2] * row[2]).max(0.0).sqrt())
                }
                Shape::Sphere(radius) => Some(*radius),
                Shape::Mesh { .. } | Shape::Other => None,
            }
        };
        let (half, center) = ([half(0)?, half(1)?, half(2)?], placement.translation.0);
        Some(Extent {
            lower: std::array::from_fn(|axis| center[axis] - half[axis]),
            upper: std::array::from_fn(|axis| center[axis] + half[axis]),
        })
    }
}

/// The shapes of all links, those that are seen and then those that collide.
///
/// # Errors
/// The text is no URDF.
pub fn link_shapes(xml: &str) -> Result<Vec<LinkShape>, UrdfError> {
    let document = parse(xml)?;
    let of_link = |link: Node| -> Vec<LinkShape> {
        let of_tag = |tag: &'static str| {
            children(link, tag).map(move |element| {
                let read = placement(element).zip(shape(element));
                let (placement, shape) = read.unwrap_or((Placement::identity(), Shape::Other));
                LinkShape { link: name(link), visual: tag == "visual", placement, shape }
            })
        };
        ["visual", "collision"].into_iter().flat_map(of_tag).collect()
    };
    Ok(children(document.root_element(), "link").flat_map(of_link).collect())
}

fn shape(element: Node) -> Option<Shape> {
    let geometry = child(element, "geometry")?;
    let shape = geometry.children().find(Node::is_element)?;
    let number = |attribute: &str| -> Option<f64> {
        let value: f64 = shape.attribute(attribute)?.trim().parse().ok()?;
        (is_usable(value) && value >= 0.0).then_some(value)
    };
    Some(match shape.tag_name().name() {
        "box" => Shape::Box(vector(shape.attribute("size")?)?.map(|edge| 0.5 * edge.abs())),
        "cylinder" => Shape::Cylinder { radius: number("radius")?, half_length: 0.5 * number("length")? },
        // Not of the format's, but some write it: a cylinder between two halves of a ball.
        "capsule" => {
            let radius = number("radius")?;
            Shape::Cylinder { radius, half_length: 0.5 * number("length")? + radius }
        }
        "sphere" => Shape::Sphere(number("radius")?),
        "mesh" => Shape::Mesh {
            file: shape.attribute("filename")?.trim().to_owned(),
            scale: shape.attribute("scale").map_or(Some([1.0; 3]), vector)?,
        },
        _ => return None,
    })
}

fn placement(element: Node) -> Option<Placement<f64>> {
    let Some(origin) = child(element, "origin") else { return Some(Placement::identity()) };
    let read = |attribute| origin.attribute(attribute).map_or(Some([0.0; 3]), vector);
    let own = Pose { xyz: read("xyz")?, rpy: read("rpy")? };
    is_usable_pose(&own).then(|| pose(&own))
}

fn vector(text: &str) -> Option<[f64; 3]> {
    let numbers: Vec<f64> = text.split_whitespace().map(str::parse).collect::<Result<_, _>>().ok()?;
    let numbers = <[f64; 3]>::try_from(numbers).ok()?;
    numbers.iter().all(|&number| is_usable(number)).then_some(numbers)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::urdf::{UrdfOptions, read_urdf};

    const ROBOT: &str = r#"<robot name="r">
      <link name="base"><visual><geometry><box size="9 9 9"/></geometry></visual></link>
      <link name="arm">
        <visual><origin xyz="0.5 0 0" rpy="0 1.5707963267948966 0"/><geometry><cylinder radius="0.1" length="1"/></geometry></visual>
        <collision><geometry><mesh filename="package://r/arm.stl" scale="0.001 0.001 0.001"/></geometry></collision>
        <visual><geometry><cone size="3"/></geometry></visual>
        <visual><geometry><sphere radius="thick"/></geometry></visual>
      </link>
      <link name="tool"><collision><origin xyz="0 0 0.1"/><geometry><sphere radius="0.2"/></geometry></collision></link>
      <joint name="j" type="continuous"><parent link="base"/><child link="arm"/></joint>
      <joint name="f" type="fixed"><parent link="arm"/><child link="tool"/><origin xyz="1 0 0" rpy="0 0 1.5707963267948966"/></joint>
    </robot>"#;

    fn near(found: [f64; 3], expected: [f64; 3]) -> bool {
        found.iter().zip(expected).all(|(found, expected)| (found - expected).abs() < 1e-12)
    }

    #[test]
    fn shapes_and_their_places_are_read_and_nonsense_is_no_error() {
        let shapes = link_shapes(ROBOT).unwrap();
        let links: Vec<&str> = shapes.iter().map(|shape| shape.link.as_str()).collect();
        assert_eq!(links, ["base", "arm", "arm", "arm", "arm", "tool"]);
        assert!(
            [2, 3].iter().all(|&other: &usize| shapes[other].shape == Shape::Other && shapes[other].visual)
        );
        let extent = shapes[1].shape.extent(shapes[1].placement).unwrap();
        assert!(near(extent.lower, [0.0, -0.1, -0.1]) && near(extent.upper, [1.0, 0.1, 0.1]), "{extent:?}");
        assert!(matches!(shapes[4].shape, Shape::Mesh { .. }) && !shapes[4].visual);
        assert_eq!(shapes[4].shape.extent(shapes[4].placement), None);
        let links = read_urdf(ROBOT, &UrdfOptions::default()).unwrap().links;
        // What is fixed to the world is a part of no body.
        let parts: Vec<(&str, usize)> = links.iter().map(|part| (part.link.as_str(), part.body)).collect();
        assert_eq!(parts, [("arm", 0), ("tool", 0)]);
        let of_tool = links[1].placement.compose(shapes[5].placement);
        let extent = shapes[5].shape.extent(of_tool).unwrap();
        assert!(near(extent.lower, [0.8, -0.2, -0.1]) && near(extent.upper, [1.2, 0.2, 0.3]), "{extent:?}");
    }

    /// Points of the surface, many of them, are the oracle.
    #[test]
    fn a_turned_shape_fills_its_extent() {
        let turned = pose(&Pose { xyz: [0.3, -0.2, 0.1], rpy: [0.7, -0.4, 2.0] });
        let shapes = [Shape::Box([0.1, 0.3, 0.2]), Shape::Cylinder { radius: 0.2, half_length: 0.4 }];
        for shape in shapes {
            let mut expected = Extent::EMPTY;
            for step in 0..40_000 {
                let (sine, cosine) = (std::f64::consts::TAU * f64::from(step / 2) / 20_000.0).sin_cos();
                let side = if step % 2 == 0 { 1.0 } else { -1.0 };
                let point = match &shape {
                    Shape::Cylinder { radius, half_length } => {
                        [radius * cosine, radius * sine, side * half_length]
                    }
                    Shape::Box([a, b, c]) => [cosine.signum() * a, sine.signum() * b, side * c],
                    _ => [0.0; 3],
                };
                expected = expected.with_point(turned.point(Vec3(point)).0);
            }
            let found = shape.extent(turned).unwrap();
            for axis in 0..3 {
                assert!((found.lower[axis] - expected.lower[axis]).abs() < 1e-6, "{shape:?}");
                assert!((found.upper[axis] - expected.upper[axis]).abs() < 1e-6, "{shape:?}");
            }
        }
    }
}
