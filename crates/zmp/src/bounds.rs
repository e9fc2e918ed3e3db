//! Bounds of the ZMP parallel to the axes, as the paper has them.

use crate::SupportError;

/// The paper's p⁻ and p⁺ \[m\], equation (9).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// p⁻.
    pub lower: [f64; 2],
    /// p⁺.
    pub upper: [f64; 2],
}

impl Bounds {
    /// h_ZMP, the left hand side of the constraint (7): `p⁻ − p` and `p − p⁺`, x before y \[m\]. None is
    /// positive for a ZMP that is allowed.
    pub fn constraint(&self, zmp: [f64; 2]) -> [f64; 4] {
        let ([low_x, low_y], [high_x, high_y], [x, y]) = (self.lower, self.upper, zmp);
        [low_x - x, low_y - y, x - high_x, y - high_y]
    }

    /// Whether `p⁻ ≤ p ≤ p⁺`, equation (9).
    pub fn contains(&self, zmp: [f64; 2]) -> bool {
        self.constraint(zmp).iter().all(|h| *h <= 0.0)
    }

    /// The bounds with the part `alpha` taken away, equation (10): `(1 − α) p⁻ ≤ p ≤ (1 − α) p⁺`.
    ///
    /// `about` is the point that they shrink to; equation (10) as it is printed has the origin, `[0, 0]`.
    ///
    /// # Errors
    /// `alpha` is not in \[0, 1\], or `about` is outside: the smaller bounds would not lie inside the larger.
    pub fn reduced(&self, alpha: f64, about: [f64; 2]) -> Result<Bounds, SupportError> {
        check_reduction(alpha, about, self.contains(about))?;
        let shrink = |point: [f64; 2]| [0, 1].map(|axis| toward(about[axis], point[axis], alpha));
        Ok(Bounds { lower: shrink(self.lower), upper: shrink(self.upper) })
    }
}

/// `value`, moved the part `alpha` of the way towards `about`.
pub(crate) fn toward(about: f64, value: f64, alpha: f64) -> f64 {
    about + (1.0 - alpha) * (value - about)
}

pub(crate) fn check_reduction(alpha: f64, about: [f64; 2], inside: bool) -> Result<(), SupportError> {
    if !(0.0..=1.0).contains(&alpha) {
        return Err(SupportError::Alpha(alpha));
    }
    if !inside {
        return Err(SupportError::ShrinksToOutside(about));
    }
    Ok(())
}
