#![doc = include_str!("../README.md")]
//!
//! ## The problem
//!
//! ```text
//! minimise  ½‖A x − b‖²  +  λ Σ_bodies D(P_i ‖ P⁰_i)          x = (standard parameters, extras)
//! such that P_i ≻ 0 for every body, and extras within their bounds and dissipative
//! ```
//!
//! P is a body's 4×4 pseudo-inertia, positive definite if and only if a distribution of positive mass has
//! these parameters (Traversaro, Brossette, Escande & Nori, "Identification of fully physical consistent
//! inertial parameters using optimization on manifolds", IROS 2016; Wensing, Kim & Slotine, "Linear matrix
//! inequalities for physically consistent inertial parameter identification", RA-L 2018). D is the log-det
//! (Bregman) divergence tr(P⁰⁻¹P) − log det(P⁰⁻¹P) − 4 from a prior, which is the same in any frame and any
//! units (Lee, Wensing & Park, "Geometric robot dynamic identification: a convex programming approach", T-RO
//! 2020). The problem is convex, so the optimum is the only one, and [`Solution::gap`] bounds how far it can
//! be.
//!
//! Standard parameters are ten for each body, about its joint frame's origin: m, m·c (x, y, z), and the
//! inertia tensor (xx, xy, yy, xz, yz, zz), which is Pinocchio's order. Extras are whatever else is in the
//! linear model: friction, rotor inertia, offsets.
//!
//! Start at [`Problem`]; [`possible_priors`] mends a robot description whose bodies are impossible.

mod block;
mod certificate;
mod constraint;
mod error;
mod interior_point;
mod newton;
mod prior;
mod problem;
mod pseudo_inertia;
mod small_matrix;
mod start;

pub use error::ConsistencyError;
pub use interior_point::{Settings, Solution};
pub use prior::{PriorSettings, possible_priors};
pub use problem::{Ellipsoid, MatrixTerm, Problem};
pub use pseudo_inertia::{PARAMETERS_PER_BODY, PseudoInertia};
