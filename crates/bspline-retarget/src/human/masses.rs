//! Sums over unit point masses at the markers.

use phiw_dynamics::scalar::Scalar;
use phiw_dynamics::{Spatial, Vec3};

/// Points in sum: their weight, first moment, and second moment about the world's origin (xx, xy, yy, xz, yz,
/// zz).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Masses<S> {
    pub weight: S,
    pub first: Vec3<S>,
    pub second: [S; 6],
}

impl<S: Scalar> Masses<S> {
    pub fn zero() -> Self {
        Masses { weight: S::zero(), first: Vec3::zero(), second: [S::zero(); 6] }
    }

    #[inline(always)]
    pub fn add_point(&mut self, p: Vec3<S>, weight: S) {
        let weighted = p.scale(weight);
        let ([x, y, z], [wx, wy, wz]) = (p.0, weighted.0);
        self.weight += weight;
        self.first += weighted;
        let second = [y * wy + z * wz, -(x * wy), x * wx + z * wz, -(x * wz), -(y * wz), x * wx + y * wy];
        for (sum, value) in self.second.iter_mut().zip(second) {
            *sum += value;
        }
    }

    #[inline(always)]
    pub fn add(&mut self, other: &Masses<S>) {
        self.weight += other.weight;
        self.first += other.first;
        for (sum, value) in self.second.iter_mut().zip(other.second) {
            *sum += value;
        }
    }

    /// Σ X' X · twist, the momentum.
    #[inline(always)]
    pub fn times(&self, twist: &Spatial<S>) -> Spatial<S> {
        let [xx, xy, yy, xz, yz, zz] = self.second;
        let [a, b, c] = twist.angular.0;
        let turned = Vec3([xx * a + xy * b + xz * c, xy * a + yy * b + yz * c, xz * a + yz * b + zz * c]);
        Spatial {
            linear: twist.linear.scale(self.weight) + twist.angular.cross(self.first),
            angular: self.first.cross(twist.linear) + turned,
        }
    }
}
