//! Passes over all samples, four at a time: cost and gradient from every sample, J'J from every window.

use super::samples::{LANES, Lane, Span};
use super::{Collect, Problem};
use crate::human::HumanScratch;
use crate::solver::{Arrow, Pattern};
use crate::weights::Cost;
use phiw_dynamics::scalar::{Lanes, Scalar};
use phiw_dynamics::{Placement, Spatial, Vec3};

/// Room for a pass.
pub(crate) struct Scratch {
    batch: Batch,
    /// Coordinates, or gradient, of one sample.
    row: Vec<f64>,
    /// Normal equations of each window of a batch.
    normal: Vec<f64>,
}

/// A batch of samples. Columns: coordinates of human and robot, then parameters.
pub(super) struct Batch {
    pub columns: Vec<Lane>,
    pub human: HumanScratch<Lane>,
    pub placements: Vec<Placement<Lane>>,
    /// What pulls at the robot's bodies: force, and moment about the world's origin.
    pub wrenches: Vec<Spatial<Lane>>,
    /// Columns of a correspondence that are not zero, and their derivatives.
    pub derivative: Vec<(usize, Vec3<Lane>)>,
    pub gradient: Vec<Lane>,
    /// Upper triangle, row by row.
    pub normal: Vec<Lane>,
}

impl Problem<'_> {
    pub(crate) fn scratch(&self) -> Scratch {
        let size = self.coordinates() + self.body.parameters.len();
        let bodies = self.robot.map_or(0, |robot| robot.tree.bodies().len());
        Scratch {
            batch: Batch {
                columns: vec![Lane::zero(); size],
                human: self.body.kinematics.scratch(),
                placements: vec![Placement::identity(); bodies],
                wrenches: vec![Spatial::zero(); bodies],
                derivative: Vec::with_capacity(size),
                gradient: vec![Lane::zero(); size],
                normal: vec![Lane::zero(); size * size],
            },
            row: vec![0.0; self.coordinates()],
            normal: vec![0.0; LANES * self.coordinates() * size],
        }
    }

    /// Cost of all samples and, if it is collected, J'r.
    pub(super) fn over_samples(
        &self,
        variables: &[f64],
        scratch: &mut Scratch,
        collect: &mut Collect<'_>,
    ) -> Cost {
        let mut nothing = [];
        let (gradient, wanted) = match collect {
            Collect::Gradient(gradient) => (&mut **gradient, true),
            _ => (&mut nothing[..], false),
        };
        pulp::Arch::new().dispatch(OverSamples { problem: self, variables, scratch, gradient, wanted })
    }

    /// J'J of all windows.
    pub(super) fn over_windows(&self, variables: &[f64], scratch: &mut Scratch, arrow: &mut Arrow) {
        pulp::Arch::new().dispatch(OverWindows { problem: self, variables, scratch, arrow });
    }

    /// Coordinates of a batch of samples, and the robot and the human in them.
    #[inline(always)]
    fn place(&self, variables: &[f64], samples: [usize; LANES], batch: &mut Batch, row: &mut [f64]) {
        let n = row.len();
        for (lane, sample) in samples.into_iter().enumerate() {
            self.coordinates_at(variables, sample, row);
            for (column, &value) in batch.columns.iter_mut().zip(&*row) {
                column.0[lane] = value;
            }
        }
        self.body.kinematics.place(&batch.columns, &mut batch.human);
        if let Some(robot) = self.robot {
            let q = &batch.columns[self.body.trajectories.len()..n];
            // The sizes are those of this robot.
            let _ = robot.tree.forward_kinematics(q, &mut batch.placements);
        }
    }

    /// Coordinates in a sample.
    #[inline(always)]
    pub(super) fn coordinates_at(&self, variables: &[f64], sample: usize, coordinates: &mut [f64]) {
        let (n, order) = (coordinates.len(), self.samples.order);
        let weights = &self.samples.values[sample * order..][..order];
        let points = &variables[self.samples.firsts[sample] * n..][..n * order];
        coordinates.fill(0.0);
        for (&weight, point) in weights.iter().zip(points.chunks_exact(n.max(1))) {
            for (sum, value) in coordinates.iter_mut().zip(point) {
                *sum += weight * value;
            }
        }
    }

    fn set_parameters(&self, variables: &[f64], batch: &mut Batch) {
        let n = self.coordinates();
        let parameters = &variables[n * self.basis.control_points()..];
        for (column, &value) in batch.columns[n..].iter_mut().zip(parameters) {
            *column = Lane::constant(value);
        }
    }
}

/// Arguments of [`Problem::over_samples`], inlined where the registers are known.
struct OverSamples<'a, 'b> {
    problem: &'a Problem<'b>,
    variables: &'a [f64],
    scratch: &'a mut Scratch,
    gradient: &'a mut [f64],
    wanted: bool,
}

impl pulp::NullaryFnOnce for OverSamples<'_, '_> {
    type Output = Cost;
    #[inline(always)]
    fn call(self) -> Cost {
        let OverSamples { problem, variables, scratch, gradient, wanted } = self;
        let Scratch { batch, row, .. } = scratch;
        let (n, points) = (problem.coordinates(), problem.samples.points);
        problem.set_parameters(variables, batch);
        gradient.fill(0.0);
        batch.gradient.fill(Lane::zero());
        let mut sums = [Lane::zero(); 3];
        for index in 0..problem.samples.count().div_ceil(LANES) {
            let (samples, present) = problem.samples.batch(index);
            problem.place(variables, samples, batch, row);
            let measured = &problem.samples.measured[index * points..][..points];
            let seen = &problem.samples.seen[index * points..][..points];
            if wanted {
                batch.gradient[..n].fill(Lane::zero());
                batch.wrenches.fill(Spatial::zero());
                problem.body.kinematics.twist(&mut batch.human);
                sums[0] += problem.body.kinematics.pull(measured, seen, &mut batch.human);
            } else {
                sums[0] += problem.body.kinematics.cost(measured, seen, &batch.human);
            }
            if let Some(robot) = problem.robot {
                sums[1] += problem.correspondence(robot, samples, present, batch, wanted);
            }
            for ((&(mean, weight), &value), slope) in
                problem.posture.iter().zip(&batch.columns).zip(&mut batch.gradient)
            {
                let away = value - Lane::constant(mean);
                let pull = present * Lane::constant(weight) * away;
                sums[2] += pull * away;
                *slope += pull;
            }
            if !wanted {
                continue;
            }
            problem.body.kinematics.gradient(&mut batch.human, &mut batch.gradient);
            if let Some(robot) = problem.robot {
                problem.robot_gradient(robot, batch);
            }
            for (lane, sample) in samples.into_iter().enumerate() {
                for (value, slope) in row.iter_mut().zip(&batch.gradient) {
                    *value = slope.0[lane];
                }
                problem.add_to_points(sample, row, gradient);
            }
        }
        if wanted {
            let parameters = &mut gradient[n * problem.basis.control_points()..];
            for (sum, slope) in parameters.iter_mut().zip(&batch.gradient[n..]) {
                *sum += total(*slope);
            }
        }
        let [markers, correspondence, prior] = sums.map(total);
        Cost { markers, correspondence, limits: 0.0, prior }
    }
}

impl Problem<'_> {
    /// The gradient of a sample's coordinates, added to that of its control points.
    #[inline(always)]
    fn add_to_points(&self, sample: usize, row: &[f64], gradient: &mut [f64]) {
        let (n, order) = (row.len(), self.samples.order);
        let weights = &self.samples.values[sample * order..][..order];
        let points = &mut gradient[self.samples.firsts[sample] * n..][..n * order];
        for (&weight, point) in weights.iter().zip(points.chunks_exact_mut(n.max(1))) {
            for (sum, value) in point.iter_mut().zip(row) {
                *sum += weight * value;
            }
        }
    }
}

/// Arguments of [`Problem::over_windows`].
struct OverWindows<'a, 'b> {
    problem: &'a Problem<'b>,
    variables: &'a [f64],
    scratch: &'a mut Scratch,
    arrow: &'a mut Arrow,
}

impl pulp::NullaryFnOnce for OverWindows<'_, '_> {
    type Output = ();
    #[inline(always)]
    fn call(self) {
        let OverWindows { problem, variables, scratch, arrow } = self;
        let Scratch { batch, row, normal } = scratch;
        let (n, size) = (row.len(), batch.columns.len());
        let (order, points) = (problem.samples.order, problem.samples.points);
        let windows = &problem.windows;
        problem.set_parameters(variables, batch);
        batch.normal.fill(Lane::zero());
        for (index, span) in windows.spans.iter().enumerate() {
            let Span { first, samples, count } = *span;
            problem.place(variables, samples, batch, row);
            // The block of parameters with parameters is summed over all windows; the other blocks belong to
            // one.
            for range in problem.pattern.ranges() {
                batch.normal[range].fill(Lane::zero());
            }
            problem.body.kinematics.twist(&mut batch.human);
            problem.body.kinematics.load(&windows.seen[index * points..][..points], &mut batch.human);
            problem.body.kinematics.normal_equations(&mut batch.human, &mut batch.normal, size);
            if let Some(robot) = problem.robot {
                problem.correspondence_normal(robot, count, batch);
            }
            for (column, &(_, weight)) in problem.posture.iter().enumerate() {
                batch.normal[column * size + column] += count * Lane::constant(weight);
            }
            lane_by_lane(&batch.normal[..n * size], &problem.pattern, normal);
            let products = &windows.products[index * order * order..][..order * order];
            let sums = &windows.sums[index * order..][..order];
            let [a, b, c, d] = std::array::from_fn(|lane| &normal[lane * n * size..][..n * size]);
            arrow.add_windows(first, &problem.pattern, products, sums, [a, b, c, d]);
        }
        arrow.mirror();
        for row in n..size {
            for column in row..size {
                arrow.add_corner(row - n, column - n, total(batch.normal[row * size + column]));
            }
        }
    }
}

/// Each lane by itself, one after the other, as far as the pattern goes.
#[inline(always)]
fn lane_by_lane(lanes: &[Lane], pattern: &Pattern, normal: &mut [f64]) {
    let (a, rest) = normal.split_at_mut(lanes.len());
    let (b, rest) = rest.split_at_mut(lanes.len());
    let (c, d) = rest.split_at_mut(lanes.len());
    for range in pattern.ranges() {
        let (a, b) = (a[range.clone()].iter_mut(), b[range.clone()].iter_mut());
        let (c, d) = (c[range.clone()].iter_mut(), d[range.clone()].iter_mut());
        for ((((value, a), b), c), d) in lanes[range].iter().zip(a).zip(b).zip(c).zip(d) {
            [*a, *b, *c, *d] = value.0;
        }
    }
}

/// The sum of all lanes.
#[inline(always)]
fn total(Lanes(lanes): Lane) -> f64 {
    lanes.iter().sum()
}
