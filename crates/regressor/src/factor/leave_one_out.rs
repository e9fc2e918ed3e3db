//! What the rows say without one block of them.

use super::Factor;
use crate::RegressorError;

/// For each block, the factor of all the others: 3·K merges for K blocks, whatever their number of rows.
///
/// # Errors
/// The blocks have different numbers of columns.
pub fn leave_one_out(blocks: &[Factor]) -> Result<Vec<Factor>, RegressorError> {
    let Some(first) = blocks.first() else { return Ok(Vec::new()) };
    let empty = Factor::empty(first.columns());
    let mut after = vec![empty.clone()];
    for block in blocks.iter().skip(1).rev() {
        after.push(after[after.len() - 1].merge(block)?);
    }
    let mut before = empty;
    let mut left_out = Vec::with_capacity(blocks.len());
    for (block, rest) in blocks.iter().zip(after.iter().rev()) {
        left_out.push(before.merge(rest)?);
        before = before.merge(block)?;
    }
    Ok(left_out)
}
