//! A torque as a formula of the motion.

use std::ops::{Add, Mul, Neg};

/// A formula of the robot's present motion, joints by name. SI units.
#[derive(Clone, Debug, PartialEq)]
pub enum Expression {
    /// A number.
    Constant(f64),
    /// Position of a joint \[rad, m\].
    Position(String),
    /// Velocity of a joint \[rad/s, m/s\].
    Velocity(String),
    /// Acceleration of a joint \[rad/s², m/s²\].
    Acceleration(String),
    /// The torque that the bodies alone need at a joint \[N·m, N\].
    BodyTorque(String),
    /// The bodies' torque and that of all formulas that are of the motion alone \[N·m, N\].
    MotionTorque(String),
    /// The sum of two.
    Sum(Box<Expression>, Box<Expression>),
    /// The product of two.
    Product(Box<Expression>, Box<Expression>),
    /// A function of one.
    Function(Function, Box<Expression>),
}

/// A function of one number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Function {
    /// Sine of an angle \[rad\].
    Sine,
    /// Cosine of an angle \[rad\].
    Cosine,
    /// Exponential.
    Exponential,
    /// Magnitude.
    Magnitude,
    /// The number where it is positive, else zero.
    PositivePart,
    /// The magnitude to a power.
    Power(f64),
    /// The sign, smoothed over this width as tanh(x / width); zero at zero. The plain sign where the width is
    /// zero.
    Sign(f64),
}

impl Expression {
    /// Position of a joint \[rad, m\].
    pub fn position(joint: &str) -> Self {
        Expression::Position(joint.to_owned())
    }
    /// Velocity of a joint \[rad/s, m/s\].
    pub fn velocity(joint: &str) -> Self {
        Expression::Velocity(joint.to_owned())
    }
    /// Acceleration of a joint \[rad/s², m/s²\].
    pub fn acceleration(joint: &str) -> Self {
        Expression::Acceleration(joint.to_owned())
    }
    /// A function of this.
    pub fn of(self, function: Function) -> Self {
        Expression::Function(function, Box::new(self))
    }
    /// Its magnitude.
    pub fn magnitude(self) -> Self {
        self.of(Function::Magnitude)
    }
    /// Its sign, smoothed over `width`.
    pub fn sign(self, width: f64) -> Self {
        self.of(Function::Sign(width))
    }

    /// Whether it needs the torque of other parts.
    pub fn needs_torque(&self) -> bool {
        match self {
            Expression::BodyTorque(_) | Expression::MotionTorque(_) => true,
            Expression::Sum(left, right) | Expression::Product(left, right) => {
                left.needs_torque() || right.needs_torque()
            }
            Expression::Function(_, of) => of.needs_torque(),
            _ => false,
        }
    }
}

impl Add for Expression {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Expression::Sum(Box::new(self), Box::new(other))
    }
}
impl Mul for Expression {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        Expression::Product(Box::new(self), Box::new(other))
    }
}
impl Mul<Expression> for f64 {
    type Output = Expression;
    fn mul(self, other: Expression) -> Expression {
        Expression::Constant(self) * other
    }
}
impl Neg for Expression {
    type Output = Self;
    fn neg(self) -> Self {
        -1.0 * self
    }
}

/// A torque that a formula adds at a joint.
#[derive(Clone, Debug, PartialEq)]
pub struct JointTorque {
    /// The joint.
    pub joint: String,
    /// The torque \[N·m, N\].
    pub torque: Expression,
}

impl JointTorque {
    /// `torque` at `joint`.
    pub fn new(joint: &str, torque: Expression) -> Self {
        JointTorque { joint: joint.to_owned(), torque }
    }
}
