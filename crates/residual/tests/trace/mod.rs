//! Tracing on recordings of a small robot whose secrets are known: named right, with its joints, and nothing
//! else.

mod bent_friction;
mod constants;
mod declared;
mod held_model;
mod leading_friction;
mod limits;
mod memory;
mod missing_effects;
mod moving_alike;
mod robot;
mod sticking;
mod structure;
mod torque_factors;
