//! Quantiles of a stream in constant memory.

/// Octaves below and above 1 that have bins of their own; what lies beyond counts as the outermost.
const OCTAVES: i64 = 64;
/// Bins per octave as a power of two.
const BITS: u32 = 4;
const BINS: usize = (2 * OCTAVES as usize) << BITS;

/// A histogram of magnitudes with bins of constant ratio: 16 an octave, so that a quantile is right to about
/// 1 %.
#[derive(Debug, Clone)]
pub(crate) struct Histogram {
    zeros: u64,
    total: u64,
    bins: Vec<u64>,
}

impl Histogram {
    pub fn new() -> Self {
        Histogram { zeros: 0, total: 0, bins: vec![0; BINS] }
    }

    /// Counts |`x`|; NaN is left out.
    pub fn push(&mut self, x: f64) {
        if x.is_nan() {
            return;
        }
        self.total += 1;
        if x == 0.0 {
            self.zeros += 1;
            return;
        }
        // The leading bits of a float are its exponent, then the linear place inside the octave.
        let leading = (x.abs().to_bits() >> (52 - BITS)) as i64;
        let first = (1023 - OCTAVES) << BITS;
        self.bins[(leading - first).clamp(0, BINS as i64 - 1) as usize] += 1;
    }

    pub fn total(&self) -> u64 {
        self.total
    }

    /// The magnitude below which the share `p` lies; 0 where there is nothing.
    pub fn quantile(&self, p: f64) -> f64 {
        let wanted = p * self.total as f64;
        let mut below = self.zeros as f64;
        if wanted <= below {
            return 0.0;
        }
        for (bin, &count) in self.bins.iter().enumerate() {
            let count = count as f64;
            if count > 0.0 && below + count >= wanted {
                return edge(bin) + (edge(bin + 1) - edge(bin)) * (wanted - below) / count;
            }
            below += count;
        }
        edge(BINS)
    }

    /// Values from the bin of `x` on.
    pub fn from(&self, x: f64) -> u64 {
        let leading = (x.abs().to_bits() >> (52 - BITS)) as i64;
        let first = (1023 - OCTAVES) << BITS;
        self.bins[(leading - first).clamp(0, BINS as i64 - 1) as usize..].iter().sum()
    }

    pub fn median(&self) -> f64 {
        self.quantile(0.5)
    }
}

/// Lower edge of a bin.
fn edge(bin: usize) -> f64 {
    f64::from_bits((bin as u64 + ((1023 - OCTAVES as u64) << BITS)) << (52 - BITS))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn quantiles_are_near_the_sorted_ones(
            mut values in prop::collection::vec(-1e6f64..1e6, 50..400),
            p in 0.1f64..0.9,
        ) {
            let mut histogram = Histogram::new();
            values.iter().for_each(|&x| histogram.push(x));
            values.iter_mut().for_each(|x| *x = x.abs());
            values.sort_by(f64::total_cmp);
            let rank = p * values.len() as f64;
            let (low, high) = (values[rank.floor() as usize - 1], values[rank.ceil() as usize]);
            let quantile = histogram.quantile(p);
            prop_assert!(quantile > low / 1.07 && quantile < high * 1.07, "{low} {quantile} {high}");
        }
    }

    #[test]
    fn extremes() {
        let mut histogram = Histogram::new();
        assert_eq!(histogram.median(), 0.0);
        for x in [0.0, 0.0, 0.0, 1e-300, f64::INFINITY, f64::NAN] {
            histogram.push(x);
        }
        assert_eq!(histogram.total(), 5);
        assert_eq!(histogram.median(), 0.0);
        assert!(histogram.quantile(1.0) > 1e18);
    }
}
