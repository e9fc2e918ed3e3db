//! The tree from links and joints: depth first, what is fixed merged into what moves.

use super::movement::Movement;
use super::robot::{Inertial, Joint, JointKind, Link, Robot};
use super::topology::Topology;
use super::{Finding, LinkInBody, UrdfError};
use super::{inertial, joint};
use crate::inertia::{Inertia, PARAMETERS_PER_BODY};
use crate::{Body, JointLimits, JointType, Placement, Tree, Vec3};

/// Gravity of a robot whose URDF's z axis points up \[m/s²\].
const GRAVITY: [f64; 3] = [0.0, 0.0, -9.81];

const UNLIMITED: JointLimits = JointLimits {
    lower: f64::NEG_INFINITY,
    upper: f64::INFINITY,
    velocity: f64::INFINITY,
    effort: f64::INFINITY,
};

/// A joint that waits for its turn.
struct Pending {
    joint: usize,
    /// The body that its parent link is part of; `None` if that is fixed to the world.
    body: Option<usize>,
    /// The parent link's frame in the body's.
    placement: Placement<f64>,
}

/// A mimic's body, and the joint of the file that it follows.
struct Follower {
    body: usize,
    leader: usize,
}

struct Assembly<'a> {
    robot: &'a Robot,
    topology: &'a Topology,
    bodies: Vec<Body>,
    inertias: Vec<Inertia<f64>>,
    velocity_size: usize,
    joint_bodies: Vec<usize>,
    /// For each joint of the file that moves by itself, its first velocity coordinate.
    velocity_index_of: Vec<usize>,
    followers: Vec<Follower>,
    pending: Vec<Pending>,
    findings: Vec<Finding>,
    links: Vec<LinkInBody>,
}

pub(super) fn assemble(
    robot: &Robot,
    topology: &Topology,
    movements: &[Movement],
    floating_base: bool,
) -> Result<(Tree, Vec<Finding>, Vec<LinkInBody>), UrdfError> {
    robot.links.iter().try_for_each(inertial::check_finite)?;
    robot.joints.iter().try_for_each(joint::check_finite)?;
    let mut assembly = Assembly {
        robot,
        topology,
        findings: incomplete_inertials(robot),
        bodies: Vec::new(),
        inertias: Vec::new(),
        velocity_size: 0,
        joint_bodies: Vec::new(),
        velocity_index_of: vec![0; robot.joints.len()],
        followers: Vec::new(),
        pending: Vec::new(),
        links: Vec::new(),
    };
    match floating_joint(robot, topology, movements)? {
        Some(joint) => assembly.float(topology.child_of[joint]),
        None if floating_base => assembly.float(topology.root),
        None => assembly.push_children(topology.root, None, Placement::identity()),
    }
    while let Some(next) = assembly.pending.pop() {
        assembly.attach(next, movements)?;
    }
    assembly.finish()
}

fn incomplete_inertials(robot: &Robot) -> Vec<Finding> {
    let incomplete = |link: &Link| match &link.inertial {
        Some(inertial) if !inertial.missing.is_empty() => {
            Some(Finding::IncompleteInertial { link: link.name.clone(), missing: inertial.missing.clone() })
        }
        _ => None,
    };
    robot.links.iter().filter_map(incomplete).collect()
}

/// The floating joint, which must be alone behind the root link.
fn floating_joint(
    robot: &Robot,
    topology: &Topology,
    movements: &[Movement],
) -> Result<Option<usize>, UrdfError> {
    let is_floating = |&joint: &usize| {
        robot.joints[joint].kind == JointKind::Floating && movements[joint] == Movement::Free
    };
    match (0..robot.joints.len()).find(is_floating) {
        Some(joint) if topology.joints_of[topology.root] != [joint] => Err(UrdfError::FloatingNotAtRoot {
            line: robot.joints[joint].line,
            joint: robot.joints[joint].name.clone(),
        }),
        found => Ok(found),
    }
}

impl Assembly<'_> {
    /// Notes that a link is a part of a body.
    fn join(&mut self, link: usize, body: usize, placement: Placement<f64>) {
        let Link { name, inertial, .. } = &self.robot.links[link];
        let (link, has_inertia) = (name.clone(), inertial.is_some());
        self.links.push(LinkInBody { link, has_inertia, body, placement });
    }

    fn inertia(&mut self, link: usize) -> Inertia<f64> {
        let link = &self.robot.links[link];
        match &link.inertial {
            Some(declared) => {
                self.findings.extend(inertial::inspect(&link.name, declared));
                inertial::inertia(declared)
            }
            None => inertial::inertia(&Inertial::default()),
        }
    }

    fn push_children(&mut self, link: usize, body: Option<usize>, placement: Placement<f64>) {
        let joints = self.topology.joints_of[link].iter().rev();
        self.pending.extend(joints.map(|&joint| Pending { joint, body, placement }));
    }

    /// Makes the link body 0, free in the world.
    fn float(&mut self, link: usize) {
        let inertia = self.inertia(link);
        self.inertias.push(inertia);
        self.bodies.push(Body {
            link: self.robot.links[link].name.clone(),
            ..new_body(
                "floating_base",
                JointType::Floating,
                None,
                Placement::identity(),
                Vec3([0.0, 0.0, 1.0]),
            )
        });
        self.velocity_size = 6;
        self.join(link, 0, Placement::identity());
        self.push_children(link, Some(0), Placement::identity());
    }

    /// Adds the joint and the link that it carries, as a body or to the body before it.
    fn attach(&mut self, next: Pending, movements: &[Movement]) -> Result<(), UrdfError> {
        let joint = &self.robot.joints[next.joint];
        let child = self.topology.child_of[next.joint];
        let origin = next.placement.compose(joint::pose(&joint.origin));
        let body = match joint_type(joint) {
            Some(kind) => {
                let axis = joint::axis(joint, &mut self.findings)?;
                Some(new_body(&joint.name, kind, next.body, origin, axis))
            }
            None => None,
        };
        match (movements[next.joint], body) {
            (Movement::Still { position, led }, body) => {
                if led {
                    self.findings.push(Finding::MimicStill { joint: joint.name.clone(), position });
                }
                let placement = body.map_or(origin, |body| body.placement(position));
                if let Some(body) = next.body {
                    self.inertias[body] = self.inertias[body] + self.inertia(child).moved(placement);
                    self.join(child, body, placement);
                }
                self.push_children(child, next.body, placement);
            }
            (movement, Some(body)) => self.add_body(next.joint, child, movement, body),
            (_, None) => {
                return Err(UrdfError::FloatingNotAtRoot { line: joint.line, joint: joint.name.clone() });
            }
        }
        Ok(())
    }

    fn add_body(&mut self, joint_index: usize, child: usize, movement: Movement, mut body: Body) {
        let joint = &self.robot.joints[joint_index];
        let index = self.bodies.len();
        body.link = self.robot.links[child].name.clone();
        body.limits = joint::limits(joint, &mut self.findings);
        (body.damping, body.friction) = (joint.damping, joint.friction);
        if let Movement::Follows { leader, ratio, offset } = movement {
            (body.mimic, body.ratio, body.offset) = (true, ratio, offset);
            self.followers.push(Follower { body: index, leader });
            self.findings.push(Finding::Mimic {
                joint: joint.name.clone(),
                leader: self.robot.joints[leader].name.clone(),
                ratio,
                offset,
            });
        } else {
            body.velocity_index = self.velocity_size;
            self.velocity_index_of[joint_index] = self.velocity_size;
            self.velocity_size += 1;
            self.joint_bodies.push(index);
        }
        let inertia = self.inertia(child);
        self.inertias.push(inertia);
        self.bodies.push(body);
        self.join(child, index, Placement::identity());
        self.push_children(child, Some(index), Placement::identity());
    }

    fn finish(mut self) -> Result<(Tree, Vec<Finding>, Vec<LinkInBody>), UrdfError> {
        if self.bodies.is_empty() {
            return Err(UrdfError::NoMovingJoints);
        }
        for (body, inertia) in self.bodies.iter_mut().zip(&self.inertias) {
            body.inertial = inertia.parameters();
        }
        // Only now: a leader may come later than its follower.
        for follower in &self.followers {
            self.bodies[follower.body].velocity_index = self.velocity_index_of[follower.leader];
        }
        self.report_masses();
        let tree = Tree {
            name: self.robot.name.clone(),
            bodies: self.bodies,
            velocity_size: self.velocity_size,
            joint_bodies: self.joint_bodies,
            gravity: GRAVITY,
        };
        Ok((tree, self.findings, self.links))
    }

    fn report_masses(&mut self) {
        let massless: Vec<bool> = self.inertias.iter().map(|inertia| inertia.mass == 0.0).collect();
        if massless.iter().all(|&massless| massless) {
            self.findings.insert(0, Finding::NoInertials);
            return;
        }
        let mut branch_massless = massless.clone();
        for (index, body) in self.bodies.iter().enumerate().rev() {
            if let Some(parent) = body.parent {
                branch_massless[parent] &= branch_massless[index];
            }
        }
        for (index, body) in self.bodies.iter().enumerate().filter(|&(index, _)| massless[index]) {
            self.findings.push(Finding::MasslessBody {
                joint: body.joint.clone(),
                link: body.link.clone(),
                whole_branch: branch_massless[index],
            });
        }
    }
}

/// The type of a joint with a single position.
fn joint_type(joint: &Joint) -> Option<JointType> {
    match joint.kind {
        JointKind::Revolute => Some(JointType::Revolute),
        JointKind::Continuous => Some(JointType::Continuous),
        JointKind::Prismatic => Some(JointType::Prismatic),
        JointKind::Fixed | JointKind::Floating | JointKind::Planar | JointKind::Spherical => None,
    }
}

/// A body without mass, limits, friction or link yet, that leads.
fn new_body(
    joint: &str,
    joint_type: JointType,
    parent: Option<usize>,
    origin: Placement<f64>,
    axis: Vec3<f64>,
) -> Body {
    Body {
        joint: joint.to_owned(),
        link: String::new(),
        parent,
        joint_type,
        origin,
        axis,
        limits: UNLIMITED,
        velocity_index: 0,
        ratio: 1.0,
        offset: 0.0,
        mimic: false,
        damping: 0.0,
        friction: 0.0,
        inertial: [0.0; PARAMETERS_PER_BODY],
        rotation_terms: Body::rotation_terms(&origin, axis),
    }
}
