//! Inputs are never overwritten.

use crate::ResultError;
use std::path::{Path, PathBuf};

/// Finds out early whether a result would overwrite an input, through links or not.
///
/// # Errors
/// [`ResultError::IsInput`].
pub fn check_inputs(inputs: &[PathBuf], outputs: &[PathBuf]) -> Result<(), ResultError> {
    for output in outputs {
        for input in inputs {
            if same_file(input, output) {
                return Err(ResultError::IsInput { output: output.clone(), input: input.clone() });
            }
        }
    }
    Ok(())
}

fn same_file(one: &Path, other: &Path) -> bool {
    let real = |path: &Path| path.canonicalize().ok();
    let by_name = matches!((real(one), real(other)), (Some(one), Some(other)) if one == other);
    by_name || same_node(one, other)
}

#[cfg(unix)]
fn same_node(one: &Path, other: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    match (one.metadata(), other.metadata()) {
        (Ok(one), Ok(other)) => (one.dev(), one.ino()) == (other.dev(), other.ino()),
        _ => false,
    }
}

#[cfg(not(unix))]
fn same_node(_: &Path, _: &Path) -> bool {
    false
}
