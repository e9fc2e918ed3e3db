//! Bodies and joints of a file.

use super::MjcfReadError;
use super::defaults::Defaults;
use super::element::{Element, line};
use super::geometry::{Added, added, shapes};
use super::inertial::{BodyInertia, InertiaRules};
use super::meshes::Meshes;
use super::orientation::{Angles, about, direction};
use super::relations;
use super::robot::{Joint, Link, Motion, Robot};
use phiw_dynamics::{Placement, Vec3};
use roxmltree::Node;
use std::collections::BTreeSet;

/// Elements that make bodies by rules.
const RULES: [&str; 4] = ["replicate", "attach", "composite", "flexcomp"];

/// A pass over a file.
pub(super) struct Reader<'a, 'input> {
    root: Node<'a, 'input>,
    angles: Angles,
    rules: InertiaRules,
    meshes: Meshes,
    auto_limits: bool,
    defaults: Defaults<'a>,
    robot: Robot,
    /// Names of links and of joints that are taken.
    names: [BTreeSet<String>; 2],
}

/// Of which two things have different names.
#[derive(Clone, Copy)]
enum Named {
    Link,
    Joint,
}

/// Where an element stands.
#[derive(Clone, Copy)]
struct Place<'a> {
    link: usize,
    /// The frame that the element's position is given in, in the link's.
    frame: Placement<f64>,
    class: Option<&'a str>,
}

impl<'a, 'input> Reader<'a, 'input> {
    pub fn new(root: Node<'a, 'input>) -> Result<Self, MjcfReadError> {
        if !root.has_tag_name("mujoco") {
            return Err(MjcfReadError::NoMjcf { found: root.tag_name().name().to_owned() });
        }
        if let Some(include) = root.descendants().find(|node| node.has_tag_name("include")) {
            let file = include.attribute("file").unwrap_or_default();
            return Err(not_read(include, format!("it includes `{file}`, which is not at hand")));
        }
        // The last of several sections decides, as attributes of one.
        let compiler = root.children().rfind(|node| node.has_tag_name("compiler"));
        let compiler = compiler.map(|node| Element::new(node, None));
        let auto_limits = compiler.as_ref().map_or(Ok(true), |compiler| compiler.flag("autolimits", true))?;
        Ok(Reader {
            root,
            angles: Angles::read(compiler.as_ref())?,
            rules: InertiaRules::read(compiler.as_ref())?,
            meshes: Meshes::read(root, compiler.as_ref())?,
            auto_limits,
            defaults: Defaults::read(root)?,
            robot: Robot {
                name: root.attribute("model").unwrap_or("MuJoCo Model").to_owned(),
                ..Robot::default()
            },
            names: [given_names(root, &["body"])?, given_names(root, &["joint", "freejoint"])?],
        })
    }

    pub fn read(mut self) -> Result<Robot, MjcfReadError> {
        let world = self.name(Named::Link, None, "world");
        self.robot.links.push(Link { name: world, inertia: BodyInertia::NONE, shapes: Vec::new() });
        for world in self.root.children().filter(|node| node.has_tag_name("worldbody")) {
            let class = world.attribute("childclass");
            self.children(world, Place { link: 0, frame: Placement::identity(), class })?;
        }
        if self.robot.joints.iter().all(|joint| joint.motion == Motion::Fixed) {
            return Err(MjcfReadError::NothingMoves);
        }
        let Reader { root, rules, mut robot, .. } = self;
        rules.set_total_mass(&mut robot);
        relations::efforts(root, &mut robot)?;
        relations::equalities(root, &mut robot)?;
        relations::gravity(root, &mut robot)?;
        Ok(robot)
    }

    /// The name that is given, or one that nothing else has.
    fn name(&mut self, kind: Named, given: Option<&str>, otherwise: &str) -> String {
        if let Some(given) = given.filter(|given| !given.is_empty()) {
            return given.to_owned();
        }
        let names = &mut self.names[kind as usize];
        let numbered =
            |count: usize| if count == 1 { otherwise.to_owned() } else { format!("{otherwise}_{count}") };
        let mut count = 1;
        while !names.insert(numbered(count)) {
            count += 1;
        }
        numbered(count)
    }

    /// Bodies of a body or frame; frames have no inertia, so they only move what stands in them.
    fn children(&mut self, node: Node<'a, 'input>, place: Place<'a>) -> Result<(), MjcfReadError> {
        for child in node.children().filter(Node::is_element) {
            let tag = child.tag_name().name();
            if RULES.contains(&tag) {
                return Err(not_read(
                    child,
                    format!("<{tag}> makes bodies by a rule: write them out (MuJoCo's mj_saveLastXML does)"),
                ));
            }
            let class = child.attribute("childclass").or(place.class);
            match tag {
                "frame" => {
                    let own = self.angles.placement(&Element::new(child, None))?;
                    self.children(child, Place { frame: place.frame.compose(own), class, ..place })?;
                }
                // It moves by no dynamics.
                "body" if child.attribute("mocap") == Some("true") => {}
                "body" => self.body(child, Place { class, ..place })?,
                _ => {}
            }
        }
        Ok(())
    }

    fn body(&mut self, node: Node<'a, 'input>, place: Place<'a>) -> Result<(), MjcfReadError> {
        let number = self.robot.links.len();
        let link = self.name(Named::Link, node.attribute("name"), &format!("body_{number}"));
        let body = Element::new(node, None);
        let in_parent = place.frame.compose(self.angles.placement(&body)?);
        if body.number("gravcomp")?.is_some_and(|share| share != 0.0) {
            self.robot.left_out.push(format!("gravcomp of {link}"));
        }
        // Joints stand in the body's frame, and each moves those after it.
        let joints: Vec<Node<'a, 'input>> = node
            .children()
            .filter(|node| node.has_tag_name("joint") || node.has_tag_name("freejoint"))
            .collect();
        let mut parent = place.link;
        // The parent link's frame as seen from the body's.
        let mut of_parent = in_parent.inverse();
        for (at, joint) in joints.iter().enumerate() {
            let is_last = at + 1 == joints.len();
            let mut joint = self.joint(*joint, &link, place)?;
            let anchor = joint.origin;
            let own = if is_last {
                link.clone()
            } else {
                self.name(Named::Link, None, &format!("{link}_{}", joint.name))
            };
            self.robot.links.push(Link { name: own, inertia: BodyInertia::NONE, shapes: Vec::new() });
            joint.links = [parent, self.robot.links.len() - 1];
            joint.origin = of_parent.inverse().compose(anchor);
            joint.origin = joint.origin.compose(back(&joint));
            self.robot.joints.push(joint);
            parent = self.robot.links.len() - 1;
            of_parent = anchor;
        }
        if joints.is_empty() {
            let name = self.name(Named::Joint, None, &format!("{link}_fixed"));
            self.robot.links.push(Link {
                name: link.clone(),
                inertia: BodyInertia::NONE,
                shapes: Vec::new(),
            });
            parent = self.robot.links.len() - 1;
            self.robot.joints.push(Joint {
                name,
                motion: Motion::Fixed,
                links: [place.link, parent],
                origin: in_parent,
                axis: Vec3([0.0, 0.0, 1.0]),
                range: None,
                effort: None,
                armature: 0.0,
                damping: 0.0,
                friction: 0.0,
                reference: 0.0,
                follows: None,
            });
            of_parent = Placement::identity();
        }
        // The link's frame is its last joint's.
        let to_link = of_parent.inverse();
        let inertia = self.inertia(node, &link, place.class)?;
        self.robot.links[parent].inertia = BodyInertia {
            mass: inertia.mass,
            center: to_link.point(inertia.center),
            tensor: to_link.rotation * inertia.tensor * to_link.rotation.transpose(),
        };
        let shapes = self.geoms(node, place.class)?.into_iter().flat_map(|(geom, frame)| {
            let frame = to_link.compose(frame);
            let own = shapes(&geom, &self.angles, &self.meshes).into_iter();
            own.map(move |(placement, shape)| (frame.compose(placement), shape))
        });
        self.robot.links[parent].shapes = shapes.collect();
        self.children(node, Place { link: parent, frame: to_link, class: place.class })
    }

    /// The geoms of a body, those in frames included, each with the frame that it stands in.
    fn geoms(
        &self,
        body: Node<'a, 'input>,
        class: Option<&'a str>,
    ) -> Result<Vec<(Element<'_, 'input>, Placement<f64>)>, MjcfReadError> {
        let mut geoms = Vec::new();
        let mut within = vec![(body, Placement::identity(), class)];
        while let Some((node, frame, class)) = within.pop() {
            for child in node.children() {
                if child.has_tag_name("frame") {
                    let own = self.angles.placement(&Element::new(child, None))?;
                    within.push((child, frame.compose(own), child.attribute("childclass").or(class)));
                }
                if child.has_tag_name("geom") {
                    geoms.push((Element::new(child, self.defaults.of(child, class)?), frame));
                }
            }
        }
        Ok(geoms)
    }

    /// A joint with its anchor in the body's frame as its origin.
    fn joint(
        &mut self,
        node: Node<'a, 'input>,
        body: &str,
        place: Place<'a>,
    ) -> Result<Joint, MjcfReadError> {
        let is_free = node.has_tag_name("freejoint");
        let defaults = if is_free { None } else { self.defaults.of(node, place.class)? };
        let element = Element::new(node, defaults);
        let kind = if is_free { "free" } else { element.text("type").unwrap_or("hinge") };
        let motion = match kind {
            "free" => Motion::Free,
            "hinge" => Motion::Hinge,
            "slide" => Motion::Slide,
            "ball" => {
                let what = "a ball joint is not read: replace it by three hinges";
                return Err(not_read(node, what.to_owned()));
            }
            other => return Err(element.wrong("type", other, "free, hinge or slide")),
        };
        if motion == Motion::Free && place.link != 0 {
            return Err(not_read(node, "a free joint belongs to a body of the world".to_owned()));
        }
        let unit = if motion == Motion::Hinge { self.angles.unit } else { 1.0 };
        let range = element.numbers::<2>("range")?;
        let limited = element.flag("limited", self.auto_limits && range.is_some())?;
        let axis = element.numbers::<3>("axis")?.unwrap_or([0.0, 0.0, 1.0]);
        let text = element.text("axis").unwrap_or_default();
        let axis = direction(Vec3(axis), element.wrong("axis", text, "a direction that is not zero"))?;
        let number = |name| Ok::<f64, MjcfReadError>(element.number(name)?.unwrap_or_default());
        let force = element.numbers::<2>("actuatorfrcrange")?;
        let anchor =
            if motion == Motion::Free { [0.0; 3] } else { element.numbers::<3>("pos")?.unwrap_or_default() };
        let stiffness = number("stiffness")?;
        let found = Joint {
            motion,
            links: [0; 2],
            origin: Placement { translation: Vec3(anchor), ..Placement::identity() },
            axis,
            range: range
                .filter(|range| limited && range[0] < range[1])
                .map(|range| range.map(|end| unit * end)),
            effort: force.map(|[lower, upper]| lower.abs().max(upper.abs())).filter(|force| *force > 0.0),
            armature: number("armature")?,
            damping: number("damping")?,
            friction: number("frictionloss")?,
            reference: unit * number("ref")?,
            follows: None,
            name: self.name(Named::Joint, node.attribute("name"), &format!("{body}_{kind}")),
        };
        if stiffness != 0.0 {
            self.robot.left_out.push(format!("stiffness of {}", found.name));
        }
        if motion == Motion::Free && found.armature != 0.0 {
            self.robot.left_out.push(format!("armature of {}", found.name));
        }
        Ok(found)
    }

    fn inertia(
        &mut self,
        node: Node<'a, 'input>,
        link: &str,
        class: Option<&'a str>,
    ) -> Result<BodyInertia, MjcfReadError> {
        let inertial = node.children().find(|node| node.has_tag_name("inertial"));
        let from_geometry = self.rules.from_geometry.unwrap_or(inertial.is_none());
        let mut inertia = match inertial {
            Some(inertial) if !from_geometry => {
                BodyInertia::of_element(&Element::new(inertial, None), &self.angles)?
            }
            _ if from_geometry => self.of_geometry(node, link, class)?,
            _ => BodyInertia::NONE,
        };
        let [mass, moment] = self.rules.least;
        inertia.mass = inertia.mass.max(mass);
        (0..3).for_each(|axis| inertia.tensor.0[axis][axis] = inertia.tensor.0[axis][axis].max(moment));
        Ok(inertia)
    }

    fn of_geometry(
        &mut self,
        node: Node<'a, 'input>,
        link: &str,
        class: Option<&'a str>,
    ) -> Result<BodyInertia, MjcfReadError> {
        let (mut parts, mut unknown) = (Vec::new(), false);
        for (geom, frame) in self.geoms(node, class)? {
            let group = geom.number("group")?.unwrap_or_default() as i64;
            if self.rules.groups.is_some_and(|[first, last]| !(first..=last).contains(&group)) {
                continue;
            }
            match added(&geom, &self.angles)? {
                Added::Inertia(part) => parts.push(BodyInertia {
                    mass: part.mass,
                    center: frame.point(part.center),
                    tensor: frame.rotation * part.tensor * frame.rotation.transpose(),
                }),
                Added::Unknown => unknown = true,
                Added::Nothing => {}
            }
        }
        if unknown {
            self.robot.left_out.push(format!("inertia of {link}, whose meshes or shells are not read"));
        }
        Ok(BodyInertia::sum(&parts))
    }
}

/// From the joint's frame in the file's pose to that at position zero.
fn back(joint: &Joint) -> Placement<f64> {
    match joint.motion {
        Motion::Hinge => {
            Placement { rotation: about(joint.axis, -joint.reference), translation: Vec3::zero() }
        }
        Motion::Slide => {
            Placement { translation: joint.axis.scale(-joint.reference), ..Placement::identity() }
        }
        _ => Placement::identity(),
    }
}

fn not_read(node: Node<'_, '_>, what: String) -> MjcfReadError {
    MjcfReadError::NotRead { line: line(node), what }
}

/// Names that elements give themselves, in the robot itself: defaults have none.
fn given_names(root: Node<'_, '_>, kinds: &[&str]) -> Result<BTreeSet<String>, MjcfReadError> {
    let mut names = BTreeSet::new();
    let bodies = root.children().filter(|node| node.has_tag_name("worldbody"));
    for node in bodies.flat_map(|world| world.descendants()) {
        if !kinds.iter().any(|kind| node.has_tag_name(*kind)) {
            continue;
        }
        let Some(name) = node.attribute("name").filter(|name| !name.is_empty()) else { continue };
        if !names.insert(name.to_owned()) {
            let what = format!("two of <{}> are called `{name}`", kinds[0]);
            return Err(MjcfReadError::Name { line: line(node), what });
        }
    }
    Ok(names)
}
