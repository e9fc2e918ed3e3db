//! Markers' cost, gradient and normal equations by one sweep from the leaves to the root.
//!
//! J'J of all markers is the mass matrix of unit points at the markers, and J'r what residuals as forces at
//! the markers do to the joints: composite sums give both without ever forming J.

use super::kinematics::{HumanScratch, Kinematics, Source};
use super::masses::Masses;
use phiw_dynamics::scalar::Scalar;
use phiw_dynamics::{Spatial, Vec3};

impl Kinematics {
    /// Σ weight · |p − measured|²; after [`Self::place`].
    #[inline(always)]
    pub fn cost<S: Scalar>(&self, measured: &[Vec3<S>], weights: &[S], scratch: &HumanScratch<S>) -> S {
        let mut cost = S::zero();
        for (point, (measured, &weight)) in measured.iter().zip(weights).enumerate() {
            let residual = self.position(point, scratch) - *measured;
            cost += weight * residual.dot(residual);
        }
        cost
    }

    /// The same, and the residuals as wrenches on the nodes; other wrenches may be added before
    /// [`Self::gradient`].
    #[inline(always)]
    pub fn pull<S: Scalar>(&self, measured: &[Vec3<S>], weights: &[S], scratch: &mut HumanScratch<S>) -> S {
        scratch.wrenches.fill(Spatial::zero());
        let mut cost = S::zero();
        for (point, (measured, &weight)) in measured.iter().zip(weights).enumerate() {
            let position = self.position(point, scratch);
            let residual = position - *measured;
            let force = residual.scale(weight);
            cost += force.dot(residual);
            let wrench = &mut scratch.wrenches[self.points()[point].node];
            wrench.linear += force;
            wrench.angular += position.cross(force);
        }
        cost
    }

    /// J'r of all wrenches, added to `gradient`; after [`Self::twist`]. It uses the wrenches up.
    #[inline(always)]
    pub fn gradient<S: Scalar>(&self, scratch: &mut HumanScratch<S>, gradient: &mut [S]) {
        for (index, node) in self.nodes().iter().enumerate().rev().filter(|(_, node)| node.carries) {
            // Parents come before their children.
            let (above, own) = scratch.wrenches.split_at_mut(index);
            let Some(wrench) = own.first() else { continue };
            if let Some(parent) = node.parent {
                above[parent].linear += wrench.linear;
                above[parent].angular += wrench.angular;
            }
            if let Source::Column(column) = node.source {
                gradient[column] += power(&scratch.twists[index], wrench);
            }
        }
    }

    /// Loads the nodes with their markers, each with its weight.
    #[inline(always)]
    pub fn load<S: Scalar>(&self, weights: &[S], scratch: &mut HumanScratch<S>) {
        scratch.masses.fill(Masses::zero());
        for (point, &weight) in weights.iter().enumerate() {
            let position = self.position(point, scratch);
            scratch.masses[self.points()[point].node].add_point(position, weight);
        }
    }

    /// J'J of all loads, added to the upper triangle of `normal` (row by row, `size` columns); after
    /// [`Self::twist`]. It uses the loads up.
    #[inline(always)]
    pub fn normal_equations<S: Scalar>(&self, scratch: &mut HumanScratch<S>, normal: &mut [S], size: usize) {
        for (index, node) in self.nodes().iter().enumerate().rev().filter(|(_, node)| node.carries) {
            let (above, own) = scratch.masses.split_at_mut(index);
            let Some(masses) = own.first() else { continue };
            if let Some(parent) = node.parent {
                above[parent].add(masses);
            }
            let Source::Column(column) = node.source else { continue };
            let twist = &scratch.twists[index];
            let momentum = masses.times(twist);
            normal[column * size + column] += power(twist, &momentum);
            for &(ancestor, other) in &node.above {
                let value = power(&scratch.twists[ancestor], &momentum);
                let (high, low) = (column.max(other), column.min(other));
                // A length that occurs twice in one chain adds to its diagonal element twice.
                normal[low * size + high] += if high == low { value + value } else { value };
            }
        }
    }
}

/// Power of a wrench along a twist. By reference: registers are too long to hand around.
#[inline(always)]
fn power<S: Scalar>(twist: &Spatial<S>, wrench: &Spatial<S>) -> S {
    let (Vec3(v), Vec3(w)) = (&twist.linear, &twist.angular);
    let (Vec3(f), Vec3(m)) = (&wrench.linear, &wrench.angular);
    v[0] * f[0] + v[1] * f[1] + v[2] * f[2] + w[0] * m[0] + w[1] * m[1] + w[2] * m[2]
}
