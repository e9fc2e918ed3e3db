//! Which link hangs on which: names, root, and that it is a tree.

use super::UrdfError;
use super::error::nearest;
use super::robot::{Joint, Robot};
use std::collections::HashMap;

/// Links and joints by index in the file.
pub(super) struct Topology {
    /// The link without a parent.
    pub(super) root: usize,
    /// For each link, the joints that start at it, in the order of the file.
    pub(super) joints_of: Vec<Vec<usize>>,
    /// For each joint, the link that it carries.
    pub(super) child_of: Vec<usize>,
}

impl Topology {
    pub(super) fn new(robot: &Robot) -> Result<Self, UrdfError> {
        let links = index("link", robot.links.iter().map(|link| (link.name.as_str(), link.line)))?;
        index("joint", robot.joints.iter().map(|joint| (joint.name.as_str(), joint.line)))?;
        let find = |joint: &Joint, link: &str| {
            links.get(link).copied().ok_or_else(|| UrdfError::UnknownLink {
                line: joint.line,
                joint: joint.name.clone(),
                link: link.to_owned(),
                nearest: nearest(link, links.keys().copied()),
            })
        };
        let mut joints_of = vec![Vec::new(); robot.links.len()];
        let mut child_of = Vec::with_capacity(robot.joints.len());
        let mut joint_before: Vec<Option<usize>> = vec![None; robot.links.len()];
        for (index, joint) in robot.joints.iter().enumerate() {
            let (parent, child) = (find(joint, &joint.parent)?, find(joint, &joint.child)?);
            if let Some(other) = joint_before[child].replace(index) {
                return Err(UrdfError::TwoParents {
                    line: joint.line,
                    link: joint.child.clone(),
                    first: robot.joints[other].name.clone(),
                    second: joint.name.clone(),
                });
            }
            joints_of[parent].push(index);
            child_of.push(child);
        }
        let names = |indices: Vec<usize>| indices.into_iter().map(|i| robot.links[i].name.clone()).collect();
        let roots: Vec<_> = (0..robot.links.len()).filter(|&link| joint_before[link].is_none()).collect();
        let root = match roots[..] {
            [root] => root,
            [] if robot.links.is_empty() => return Err(UrdfError::NoLinks),
            [] => return Err(UrdfError::Cycle { links: names((0..robot.links.len()).collect()) }),
            _ => return Err(UrdfError::SeveralRoots { links: names(roots) }),
        };
        let topology = Topology { root, joints_of, child_of };
        match topology.unreachable() {
            links if links.is_empty() => Ok(topology),
            links => Err(UrdfError::Cycle { links: names(links) }),
        }
    }

    fn unreachable(&self) -> Vec<usize> {
        let mut reached = vec![false; self.joints_of.len()];
        let mut pending = vec![self.root];
        while let Some(link) = pending.pop() {
            reached[link] = true;
            pending.extend(self.joints_of[link].iter().map(|&joint| self.child_of[joint]));
        }
        (0..reached.len()).filter(|&link| !reached[link]).collect()
    }
}

fn index<'a>(
    kind: &'static str,
    names: impl Iterator<Item = (&'a str, u32)>,
) -> Result<HashMap<&'a str, usize>, UrdfError> {
    let mut indices = HashMap::new();
    for (index, (name, line)) in names.enumerate() {
        if indices.insert(name, index).is_some() {
            return Err(UrdfError::Duplicate { line, kind, name: name.to_owned() });
        }
    }
    Ok(indices)
}
