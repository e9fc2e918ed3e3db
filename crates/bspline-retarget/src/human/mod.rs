//! The parametric human upper body, θ^h and ξ^h of equation (15), and the markers on it.

mod body;
mod kinematics;
mod marker_map;
mod skeleton;

pub use body::{HumanBody, Placed};
pub(crate) use kinematics::{HumanScratch, Twist};
pub use marker_map::{JointMode, MapError, MarkerMap, SegmentMarkers};
pub use skeleton::{SEGMENT_PARAMETERS, Segment, SegmentParameter, Side};
