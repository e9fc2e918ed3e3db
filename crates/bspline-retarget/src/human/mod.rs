//! The parametric human upper body, θ^h and ξ^h of equation (15), and the markers on it.

mod body;
mod composite;
mod kinematics;
mod marker_map;
mod masses;
mod outside;
mod skeleton;

pub use body::{HumanBody, Placed};
pub(crate) use kinematics::{HumanScratch, rotate, rotate_back};
pub use marker_map::{JointMode, MapError, MarkerMap, SegmentMarkers};
pub use outside::{BodyMarker, HumanJoint};
pub use skeleton::{SEGMENT_PARAMETERS, Segment, SegmentParameter, Side};
