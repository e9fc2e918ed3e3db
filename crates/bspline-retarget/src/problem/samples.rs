//! The recording as the passes read it: samples side by side in SIMD lanes, and windows of samples.

use crate::bspline::Basis;
use crate::human::HumanBody;
use crate::recording::MarkerRecording;
use phiw_dynamics::Vec3;
use phiw_dynamics::scalar::Lanes;

/// Samples that are worked on at once: what a 256-bit register holds.
pub(super) const LANES: usize = 4;
/// One number of so many samples.
pub(super) type Lane = Lanes<LANES>;

/// All samples.
pub(super) struct Samples {
    count: usize,
    pub rate_hz: f64,
    /// Degree + 1.
    pub order: usize,
    /// For each sample, its first control point, and the basis' values.
    pub firsts: Vec<usize>,
    pub values: Vec<f64>,
    /// For each batch of samples, the positions of the body's points, and 1 where they are seen.
    pub points: usize,
    pub measured: Vec<Vec3<Lane>>,
    pub seen: Vec<Lane>,
}

impl Samples {
    pub fn new(body: &HumanBody, recording: &MarkerRecording, basis: &Basis) -> Self {
        let (count, order, points) = (recording.frames(), basis.degree() + 1, body.markers.len());
        let batches = count.div_ceil(LANES);
        let mut samples = Samples {
            count,
            rate_hz: recording.rate_hz,
            order,
            firsts: Vec::with_capacity(count),
            values: vec![0.0; count * order],
            points,
            measured: vec![Vec3([Lanes([0.0; LANES]); 3]); batches * points],
            seen: vec![Lanes([0.0; LANES]); batches * points],
        };
        for sample in 0..count {
            let t = sample as f64 / recording.rate_hz;
            let values = &mut samples.values[sample * order..][..order];
            samples.firsts.push(basis.derivative(0, t, values));
            let (batch, lane) = (sample / LANES, sample % LANES);
            for (point, &marker) in body.markers.iter().enumerate() {
                let position = recording.position_m(sample, marker);
                if position[0].is_finite() {
                    let at = batch * points + point;
                    samples.seen[at].0[lane] = 1.0;
                    for (coordinate, value) in samples.measured[at].0.iter_mut().zip(position) {
                        coordinate.0[lane] = value;
                    }
                }
            }
        }
        samples
    }

    pub fn count(&self) -> usize {
        self.count
    }

    pub fn measured_at(&self, sample: usize, point: usize) -> Option<Vec3<f64>> {
        let (at, lane) = (sample / LANES * self.points + point, sample % LANES);
        let seen = self.seen[at].0[lane] != 0.0;
        seen.then(|| Vec3(self.measured[at].0.map(|coordinate| coordinate.0[lane])))
    }

    /// The samples of a batch, and 1 for those that are there; what is beyond the last is the last again.
    pub fn batch(&self, batch: usize) -> ([usize; LANES], Lane) {
        let first = batch * LANES;
        (
            std::array::from_fn(|lane| (first + lane).min(self.count - 1)),
            Lanes(std::array::from_fn(|lane| if first + lane < self.count { 1.0 } else { 0.0 })),
        )
    }
}

/// Stretches of samples inside a span of the basis, each with a sample that stands for it: as many to a span
/// as there are lanes, fewer where a span has not as many samples.
pub(super) struct Windows {
    pub spans: Vec<Span>,
    /// For each span, in how many samples each point is seen.
    pub seen: Vec<Lane>,
    /// For each span, Σ b_i b_j over its samples (row by row, i and j from the first control point on) and Σ
    /// b_i, per sample.
    pub products: Vec<Lane>,
    pub sums: Vec<Lane>,
}

pub(super) struct Span {
    /// The first control point.
    pub first: usize,
    /// The samples that stand for the windows.
    pub samples: [usize; LANES],
    /// Numbers of samples in the windows; none where there is no window.
    pub count: Lane,
}

impl Windows {
    pub fn new(samples: &Samples) -> Self {
        let mut all = Windows { spans: vec![], seen: vec![], products: vec![], sums: vec![] };
        let mut begin = 0;
        for span in samples.firsts.chunk_by(|a, b| a == b) {
            all.push(samples, begin..begin + span.len());
            begin += span.len();
        }
        all
    }

    fn push(&mut self, samples: &Samples, range: std::ops::Range<usize>) {
        let (order, points) = (samples.order, samples.points);
        let first = samples.firsts[range.start];
        let mut span = Span { first, samples: [range.start; LANES], count: Lanes([0.0; LANES]) };
        let begin = self.spans.len();
        self.seen.resize((begin + 1) * points, Lanes([0.0; LANES]));
        self.products.resize((begin + 1) * order * order, Lanes([0.0; LANES]));
        self.sums.resize((begin + 1) * order, Lanes([0.0; LANES]));
        let seen = &mut self.seen[begin * points..];
        let products = &mut self.products[begin * order * order..];
        let sums = &mut self.sums[begin * order..];
        let windows = LANES.min(range.len());
        for lane in 0..windows {
            let [from, to] = [lane, lane + 1].map(|cut| range.start + cut * range.len() / windows);
            let count = (to - from) as f64;
            span.samples[lane] = from + (to - from) / 2;
            span.count.0[lane] = count;
            for sample in from..to {
                let values = &samples.values[sample * order..][..order];
                for i in 0..order {
                    sums[i].0[lane] += values[i] / count;
                    (0..order).for_each(|j| products[i * order + j].0[lane] += values[i] * values[j] / count);
                }
                let batch = sample / LANES * points;
                for (point, seen) in seen.iter_mut().enumerate() {
                    seen.0[lane] += samples.seen[batch + point].0[sample % LANES];
                }
            }
        }
        self.spans.push(span);
    }
}
