//! The basis functions b_j(t) of equation (14), by Cox and de Boor's recursion.

/// B-spline basis functions of one degree over one knot vector.
///
/// At any time only `degree + 1` neighbouring functions differ from zero: those of the control points `first
/// ..= first + degree`, where `first` is what [`Basis::derivative`] returns. Inside the domain they are ≥ 0
/// and sum to one, so a curve stays inside the hull of its control points.
#[derive(Clone, Debug, PartialEq)]
pub struct Basis {
    degree: usize,
    knots: Vec<f64>,
}

/// Why there is no such basis.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum BasisError {
    /// A degree needs one control point more.
    #[error("{control_points} control points are too few for degree {degree}: give at least {}", degree + 1)]
    TooFewControlPoints {
        /// Control points asked for.
        control_points: usize,
        /// Degree asked for.
        degree: usize,
    },
    /// The domain is empty or not finite.
    #[error("a B-spline from {start} s to {end} s: the end must be finite and after the start")]
    Domain {
        /// Start of the domain \[s\].
        start: f64,
        /// End of the domain \[s\].
        end: f64,
    },
    /// Knots go back, are not finite, or are all one.
    #[error(
        "knot {index} is {value}: knots must be finite and must not go back, nor coincide over the whole domain"
    )]
    Knot {
        /// Index in the knot vector.
        index: usize,
        /// Its value \[s\].
        value: f64,
    },
}

impl Basis {
    /// Equally spaced knots that run `degree` spans beyond both ends of the domain: every function is a
    /// shifted copy of the same one.
    ///
    /// # Errors
    /// Too few control points, or an empty domain.
    pub fn uniform(degree: usize, control_points: usize, start: f64, end: f64) -> Result<Self, BasisError> {
        let spacing = spacing(degree, control_points, start, end)?;
        let knots = (0..control_points + degree + 1)
            .map(|knot| start + (knot as f64 - degree as f64) * spacing)
            .collect();
        Ok(Basis { degree, knots })
    }

    /// Equally spaced knots with the outermost ones `degree + 1` fold: the curve starts at its first control
    /// point and ends at its last.
    ///
    /// # Errors
    /// Too few control points, or an empty domain.
    pub fn clamped(degree: usize, control_points: usize, start: f64, end: f64) -> Result<Self, BasisError> {
        let spacing = spacing(degree, control_points, start, end)?;
        let spans = control_points - degree;
        let knots = (0..control_points + degree + 1)
            .map(|knot| match knot.saturating_sub(degree) {
                inner if inner >= spans => end,
                inner => start + inner as f64 * spacing,
            })
            .collect();
        Ok(Basis { degree, knots })
    }

    /// Any knots: `control points + degree + 1` of them, in order.
    ///
    /// # Errors
    /// Too few knots, or knots out of order or not finite.
    pub fn from_knots(degree: usize, knots: Vec<f64>) -> Result<Self, BasisError> {
        let control_points = knots.len().saturating_sub(degree + 1);
        if control_points <= degree {
            return Err(BasisError::TooFewControlPoints { control_points, degree });
        }
        let wrong = |index: usize| BasisError::Knot { index, value: knots[index] };
        if let Some(index) = (0..knots.len())
            .find(|&index| !knots[index].is_finite() || (index > 0 && knots[index] < knots[index - 1]))
        {
            return Err(wrong(index));
        }
        if knots[degree] == knots[control_points] {
            return Err(wrong(degree));
        }
        Ok(Basis { degree, knots })
    }

    /// The degree: 3 is cubic.
    pub fn degree(&self) -> usize {
        self.degree
    }
    /// Number of basis functions, and of control points.
    pub fn control_points(&self) -> usize {
        self.knots.len() - self.degree - 1
    }
    /// The knots \[s\].
    pub fn knots(&self) -> &[f64] {
        &self.knots
    }
    /// First and last time \[s\] at which all functions are there; beyond, the outermost polynomials go on.
    pub fn domain(&self) -> (f64, f64) {
        (self.knots[self.degree], self.knots[self.control_points()])
    }

    /// The control point whose basis function is the first that is not zero at time `t` \[s\].
    pub fn first(&self, t: f64) -> usize {
        let inner = &self.knots[self.degree + 1..self.control_points()];
        let mut span = self.degree + inner.partition_point(|&knot| knot <= t);
        // The end of the domain belongs to the last span that is not empty, its start to the first.
        let empty = |span: usize| self.knots[span] == self.knots[span + 1];
        while empty(span) && span > self.degree {
            span -= 1;
        }
        while empty(span) {
            span += 1;
        }
        span - self.degree
    }

    /// Derivatives of the given order (0: the values) at time `t` \[s\] of the `degree + 1` functions that
    /// are not zero there, into `values`; returns the control point of the first. Units: s^−order.
    ///
    /// `values` must have `degree + 1` elements; more are left as they are.
    ///
    /// # Panics
    /// If `values` is shorter than `degree + 1`.
    pub fn derivative(&self, order: usize, t: f64, values: &mut [f64]) -> usize {
        let first = self.first(t);
        let span = first + self.degree;
        let values = &mut values[..=self.degree];
        values.fill(0.0);
        if order > self.degree {
            return first;
        }
        values[0] = 1.0;
        // Values up to degree − order, then one differentiation with every further degree.
        for degree in 1..=self.degree {
            let differentiate = degree > self.degree - order;
            for index in (0..=degree).rev() {
                let lower = span + index - degree;
                let mut sum = 0.0;
                if index > 0 {
                    let width = self.knots[lower + degree] - self.knots[lower];
                    let factor = if differentiate { degree as f64 } else { t - self.knots[lower] };
                    sum += factor / width * values[index - 1];
                }
                if index < degree {
                    let width = self.knots[lower + degree + 1] - self.knots[lower + 1];
                    let factor =
                        if differentiate { -(degree as f64) } else { self.knots[lower + degree + 1] - t };
                    sum += factor / width * values[index];
                }
                values[index] = sum;
            }
        }
        first
    }
}

/// Length of a span of equally spaced knots.
fn spacing(degree: usize, control_points: usize, start: f64, end: f64) -> Result<f64, BasisError> {
    if control_points <= degree {
        return Err(BasisError::TooFewControlPoints { control_points, degree });
    }
    if !(start.is_finite() && end.is_finite() && start < end) {
        return Err(BasisError::Domain { start, end });
    }
    Ok((end - start) / (control_points - degree) as f64)
}
