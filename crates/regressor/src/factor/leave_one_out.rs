//! What the rows say without one block of them.

use super::Factor;
use crate::RegressorError;
use rayon::prelude::*;

/// For each block, the factor of all the others: 3·K merges for K blocks, whatever their number of rows.
///
/// # Errors
/// The blocks have different numbers of columns.
pub fn leave_one_out(blocks: &[Factor]) -> Result<Vec<Factor>, RegressorError> {
    let Some(first) = blocks.first() else { return Ok(Vec::new()) };
    let sums = |blocks: &mut dyn Iterator<Item = &Factor>| {
        let mut sums = vec![Factor::empty(first.columns())];
        for block in blocks {
            sums.push(sums[sums.len() - 1].merge(block)?);
        }
        Ok::<_, RegressorError>(sums)
    };
    let last = blocks.len() - 1;
    let (before, after) =
        rayon::join(|| sums(&mut blocks[..last].iter()), || sums(&mut blocks[1..].iter().rev()));
    let (before, mut after) = (before?, after?);
    after.reverse();
    before.par_iter().zip(&after).map(|(before, after)| before.merge(after)).collect()
}
