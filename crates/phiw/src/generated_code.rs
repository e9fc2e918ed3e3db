//! The model's inverse dynamics as C and Rust.

use crate::Error;
use crate::exported::{Carried, LeftOut, header};
use phiw_codegen::{JointTorque, Model, write_c, write_rust};

/// Name of the C file.
pub const C_FILE: &str = "inverse_dynamics.c";
/// Name of the Rust file.
pub const RUST_FILE: &str = "inverse_dynamics.rs";

/// The C file.
///
/// # Errors
/// A number is not finite.
pub fn c(carried: Carried<'_>) -> Result<String, Error> {
    generated(carried, C_FILE, write_c)
}

/// The Rust file.
///
/// # Errors
/// A number is not finite.
pub fn rust(carried: Carried<'_>) -> Result<String, Error> {
    generated(carried, RUST_FILE, write_rust)
}

type Writer = fn(&Model<'_>) -> Result<String, phiw_codegen::CodegenError>;

fn generated(carried: Carried<'_>, file: &str, write: Writer) -> Result<String, Error> {
    let tree = carried.model.consistent_tree(carried.tree)?;
    let (torques, left_out) = torques(carried);
    write(&Model { tree: &tree, torques, header: header(carried, file, &left_out) }).map_err(Error::Generated)
}

/// What of the model generated code lacks, in words: what needs more than the present motion.
pub fn not_expressed(carried: Carried<'_>) -> Vec<String> {
    torques(carried).1
}

/// The effects' torques, and what is left out in words.
fn torques(carried: Carried<'_>) -> (Vec<JointTorque>, Vec<String>) {
    let (mut torques, mut left_out) = (Vec::new(), LeftOut::default());
    for (effect, parameters, values) in carried.effects() {
        let own = carried.catalogue.formulas(&effect.spec, &parameters, &values);
        if own.is_empty() {
            left_out.add(effect.spec.kind.clone(), &effect.spec.joints);
        }
        torques.extend(own);
    }
    (torques, left_out.in_words())
}
