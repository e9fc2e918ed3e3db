//! A robot on its feet: its base is six more joints that nothing drives, and what the floor gives to its feet
//! is measured.

mod feet;
mod legs;
mod virtual_base;

pub use feet::{Feet, StandingFoot};
pub use legs::{Legs, StandingStates};
pub use virtual_base::{VIRTUAL_JOINTS, base_coordinates, with_virtual_base};
