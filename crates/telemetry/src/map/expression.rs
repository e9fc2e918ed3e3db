//! How a signal is computed from the columns of a row.

/// A signal as a function of a row's columns.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Expression {
    /// A column as it is.
    Column(usize),
    /// scale · column + offset.
    Scaled { column: usize, scale: f64, offset: f64 },
    /// Σ factor · signal: coupled motors.
    Sum(Vec<(f64, Expression)>),
    /// kp·(q_ref − q) + kd·(q̇_ref − q̇) + feed-forward: the law of a controller.
    ProportionalDerivative {
        kp: f64,
        kd: f64,
        q_ref: Box<Expression>,
        q: Box<Expression>,
        qd: Option<Box<Expression>>,
        qd_ref: Option<Box<Expression>>,
        feedforward: Option<Box<Expression>>,
    },
    /// |load| · sign(of another signal): drives that report a load without its direction.
    LoadWithSign { load: Box<Expression>, sign: Box<Expression> },
}

impl Expression {
    /// Its value in a row.
    pub fn value(&self, row: &[f64]) -> f64 {
        let or_zero = |part: &Option<Box<Expression>>| part.as_ref().map_or(0.0, |part| part.value(row));
        match self {
            Expression::Column(column) => row[*column],
            Expression::Scaled { column, scale, offset } => scale * row[*column] + offset,
            Expression::Sum(terms) => terms.iter().map(|(factor, term)| factor * term.value(row)).sum(),
            Expression::ProportionalDerivative { kp, kd, q_ref, q, qd, qd_ref, feedforward } => {
                let position = kp * (q_ref.value(row) - q.value(row));
                position + kd * (or_zero(qd_ref) - or_zero(qd)) + or_zero(feedforward)
            }
            Expression::LoadWithSign { load, sign } => {
                let sign = sign.value(row);
                let direction = if sign == 0.0 { 0.0 } else { sign.signum() };
                load.value(row).abs() * direction
            }
        }
    }

    /// Calls `visit` for each column that it reads.
    pub fn visit_columns(&mut self, visit: &mut dyn FnMut(&mut usize)) {
        match self {
            Expression::Column(column) | Expression::Scaled { column, .. } => visit(column),
            Expression::Sum(terms) => terms.iter_mut().for_each(|(_, term)| term.visit_columns(visit)),
            Expression::ProportionalDerivative { q_ref, q, qd, qd_ref, feedforward, .. } => {
                let optional = [qd, qd_ref, feedforward].into_iter().flatten();
                [q_ref, q].into_iter().chain(optional).for_each(|part| part.visit_columns(visit));
            }
            Expression::LoadWithSign { load, sign } => {
                load.visit_columns(visit);
                sign.visit_columns(visit);
            }
        }
    }
}
