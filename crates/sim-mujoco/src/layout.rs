//! Where the fields are that this crate reads and writes, in the structures of MuJoCo 3.17.0.
//!
//! Offsets in bytes, by `offsetof` over that release's headers (`layout.c` beside this file prints them).
//! They are the same on every 64-bit platform: the structures hold `int`, `int64_t`, `double`, `size_t`,
//! `bool` and pointers only. A library of another version is refused before anything is read; that the fields
//! are where they should be is checked on each model (`Simulation::new`).

#[cfg(not(target_pointer_width = "64"))]
compile_error!("MuJoCo's libraries, and the offsets of their fields, are for 64-bit platforms");

/// Fields of `mjModel`.
pub(crate) mod model {
    pub const NQ: usize = 0;
    pub const NV: usize = 8;
    pub const NBODY: usize = 48;
    pub const NBUFFER: usize = 776;
    pub const TIMESTEP: usize = 792;
    pub const INTEGRATOR: usize = 1040;
    pub const BUFFER: usize = 1784;
    pub const BODY_IPOS: usize = 1928;
    pub const BODY_IQUAT: usize = 1936;
    pub const BODY_MASS: usize = 1944;
    pub const BODY_INERTIA: usize = 1960;
}

/// Fields of `mjData`.
pub(crate) mod data {
    pub const NBUFFER: usize = 8;
    /// How often the mass matrix was not positive definite: `warning[mjWARN_INERTIA].number`.
    pub const SINGULAR_COUNT: usize = 160_268;
    pub const NCON: usize = 160_560;
    pub const BUFFER: usize = 160_672;
    pub const QPOS: usize = 160_688;
    pub const QVEL: usize = 160_696;
    pub const QACC_WARMSTART: usize = 160_720;
    pub const QFRC_APPLIED: usize = 160_744;
    pub const QACC: usize = 160_784;
    pub const XPOS: usize = 160_840;
    pub const XMAT: usize = 160_856;
    pub const SUBTREE_COM: usize = 160_960;
    pub const QFRC_INVERSE: usize = 161_440;
    pub const CFRC_INT: usize = 161_456;
    pub const CONTACT: usize = 161_472;
}

/// Fields of `mjContact`.
pub(crate) mod contact {
    pub const POS: usize = 8;
    pub const FRAME: usize = 32;
    /// Two numbers of shapes.
    pub const GEOM: usize = 540;
    /// Of the whole structure.
    pub const SIZE: usize = 584;
}
