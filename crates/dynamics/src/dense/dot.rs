//! The scalar product.

/// Numbers that are summed side by side: two registers of four, since one sum alone would have to wait for
/// itself.
const LANES: usize = 8;

/// Σ left·right, as far as both go.
#[inline(always)]
pub fn dot(left: &[f64], right: &[f64]) -> f64 {
    let length = left.len().min(right.len());
    let (left, left_rest) = left[..length].as_chunks::<LANES>();
    let (right, right_rest) = right[..length].as_chunks::<LANES>();
    let mut sums = [0.0; LANES];
    for (a, b) in left.iter().zip(right) {
        for lane in 0..LANES {
            sums[lane] += a[lane] * b[lane];
        }
    }
    left_rest.iter().zip(right_rest).map(|(a, b)| a * b).sum::<f64>() + sums.iter().sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::dot;

    #[test]
    fn every_element_counts_once_as_far_as_both_slices_go() {
        for length in 0..40_u32 {
            let left: Vec<f64> = (0..length).map(f64::from).collect();
            let right: Vec<f64> = (0..length + 3).map(|k| f64::from(k) + 1.0).collect();
            // Σ k·(k + 1) = n·(n² − 1)/3, in whole numbers and so exact.
            let n = f64::from(length);
            let expected = n * (n * n - 1.0) / 3.0;
            assert_eq!(dot(&left, &right), expected, "{length}");
            assert_eq!(dot(&right, &left), expected, "{length}");
        }
    }
}
