//! Fewer points for the same picture: the smallest and the largest sample of each stretch of time.

/// Points that a line of a picture has at most, two for each pixel of its width or nearly so.
pub const LINE_POINTS: usize = 1500;

/// A line of its own samples.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Polyline {
    /// Abscissae (time in seconds for the panels of a report).
    pub x: Vec<f64>,
    /// Ordinates; NaN where the line breaks.
    pub y: Vec<f64>,
}

/// Thins a stream of samples of unknown length to a bounded number of points, in bounded memory.
///
/// Samples are taken in bins of equal count, and each bin keeps its smallest and its largest, so that the
/// extremes of the whole stream survive. When the bins are full, neighbours merge and the count doubles.
/// A NaN is a gap and stays one, unless there are about as many gaps as bins: then the line bridges them all.
#[derive(Debug, Clone)]
pub struct Decimator {
    bins: Vec<Bin>,
    capacity: usize,
    samples_per_bin: usize,
    /// Whether the next sample comes after a gap.
    gap: bool,
    /// Whether the log is in shreds: gaps do not count any more.
    bridges_gaps: bool,
}

#[derive(Debug, Clone, Copy)]
struct Bin {
    first: (f64, f64),
    second: (f64, f64),
    samples: usize,
    after_gap: bool,
}

impl Bin {
    /// Takes in the samples of `other`, which come later; keeps the two extremes in order of time.
    fn absorb(&mut self, other: &Bin) {
        let points = [self.first, self.second, other.first, other.second];
        let mut lowest = 0;
        let mut highest = 0;
        for (index, point) in points.iter().enumerate() {
            if point.1 < points[lowest].1 {
                lowest = index;
            }
            if point.1 > points[highest].1 {
                highest = index;
            }
        }
        self.first = points[lowest.min(highest)];
        self.second = points[lowest.max(highest)];
        self.samples += other.samples;
    }
}

impl Decimator {
    /// A decimator that gives at most `points` points, gaps not counted (at least 4).
    pub fn new(points: usize) -> Self {
        let capacity = (points / 2).max(2);
        Self {
            bins: Vec::with_capacity(capacity),
            capacity,
            samples_per_bin: 1,
            gap: false,
            bridges_gaps: false,
        }
    }

    /// Takes the next sample; one that is not finite is a gap.
    pub fn push(&mut self, x: f64, y: f64) {
        if !(super::drawable(x) && super::drawable(y)) {
            self.gap = true;
            return;
        }
        let after_gap = std::mem::take(&mut self.gap) && !self.bins.is_empty() && !self.bridges_gaps;
        let bin = Bin { first: (x, y), second: (x, y), samples: 1, after_gap };
        match self.bins.last_mut() {
            Some(last) if !after_gap && last.samples < self.samples_per_bin => last.absorb(&bin),
            _ => {
                if self.bins.len() == self.capacity {
                    self.merge_neighbours();
                }
                self.bins.push(bin);
            }
        }
    }

    /// Breaks the line before the next sample.
    pub fn gap(&mut self) {
        self.gap = true;
    }

    /// The points so far: a line with NaN where it breaks.
    pub fn finish(&self) -> Polyline {
        let mut line = Polyline::default();
        let mut push = |(x, y): (f64, f64)| {
            line.x.push(x);
            line.y.push(y);
        };
        for bin in &self.bins {
            if bin.after_gap {
                push((bin.first.0, f64::NAN));
            }
            push(bin.first);
            if bin.samples > 1 {
                push(bin.second);
            }
        }
        line
    }

    fn merge_neighbours(&mut self) {
        self.samples_per_bin *= 2;
        self.merge();
        if self.bins.len() > self.capacity * 3 / 4 {
            self.bridges_gaps = true;
            self.bins.iter_mut().for_each(|bin| bin.after_gap = false);
            self.merge();
        }
    }

    /// Joins neighbours two by two, but not across a gap.
    fn merge(&mut self) {
        let mut merged: Vec<Bin> = Vec::with_capacity(self.capacity);
        let mut paired = true;
        for bin in &self.bins {
            match merged.last_mut() {
                Some(last) if !paired && !bin.after_gap => {
                    last.absorb(bin);
                    paired = true;
                }
                _ => {
                    merged.push(*bin);
                    paired = false;
                }
            }
        }
        self.bins = merged;
    }
}

/// Thins a line to at most `points` points (see [`Decimator`]); a shorter one comes back as it is.
pub fn decimate(x: &[f64], y: &[f64], points: usize) -> Polyline {
    let length = x.len().min(y.len());
    if length <= points {
        return Polyline { x: x[..length].to_vec(), y: y[..length].to_vec() };
    }
    let mut decimator = Decimator::new(points);
    for (&x, &y) in x.iter().zip(y) {
        decimator.push(x, y);
    }
    decimator.finish()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn extremes(values: impl IntoIterator<Item = f64>) -> (f64, f64) {
        values
            .into_iter()
            .filter(|v| v.is_finite())
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)))
    }

    proptest! {
        #[test]
        fn extremes_order_and_size_are_kept(
            y in proptest::collection::vec(prop_oneof![12 => -1e3..1e3f64, 1 => Just(f64::NAN)], 0..3000),
            points in 4usize..200,
        ) {
            let x: Vec<f64> = (0..y.len()).map(|i| i as f64).collect();
            let mut decimator = Decimator::new(points);
            x.iter().zip(&y).for_each(|(&x, &y)| decimator.push(x, y));
            let line = decimator.finish();
            prop_assert_eq!(extremes(line.y.iter().copied()), extremes(y.iter().copied()));
            prop_assert!(line.y.iter().filter(|y| y.is_finite()).count() <= points);
            prop_assert!(line.x.is_sorted());
            for (&x, &kept) in line.x.iter().zip(&line.y).filter(|(_, y)| y.is_finite()) {
                prop_assert_eq!(kept, y[x as usize], "a point that is no sample");
            }
        }

        /// A few long segments: each gap is still one afterwards, and none has been invented.
        #[test]
        fn gaps_of_long_segments_survive(lengths in proptest::collection::vec(200usize..900, 1..6)) {
            let mut decimator = Decimator::new(300);
            for &length in &lengths {
                for i in 0..length {
                    decimator.push(i as f64, (i as f64).sin());
                }
                decimator.gap();
            }
            let gaps = decimator.finish().y.iter().filter(|y| y.is_nan()).count();
            prop_assert_eq!(gaps, lengths.len() - 1);
        }
    }

    #[test]
    fn a_short_line_is_left_alone() {
        let (x, y) = ([0.0, 1.0, 2.0], [5.0, 4.0, 6.0]);
        assert_eq!(decimate(&x, &y, 10), Polyline { x: x.to_vec(), y: y.to_vec() });
    }
}
