//! A number that writes down what is done with it.

use phiw_dynamics::scalar::Scalar;
use std::cell::RefCell;
use std::collections::HashMap;
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

/// A number of a program: known, or the result of an operation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Symbol {
    Known(f64),
    Computed(u32),
}

/// A signal that a program is given.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Signal {
    Position,
    Velocity,
    Acceleration,
}

/// What is done in one step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Operation {
    Input(Signal, usize),
    Negate(Symbol),
    Sum(Symbol, Symbol),
    Difference(Symbol, Symbol),
    Product(Symbol, Symbol),
    Quotient(Symbol, Symbol),
    Sine(Symbol),
    Cosine(Symbol),
    Exponential(Symbol),
    Magnitude(Symbol),
    PositivePart(Symbol),
    Power(Symbol, f64),
    HyperbolicTangent(Symbol),
    Sign(Symbol),
}

impl Operation {
    /// The numbers that it works on.
    pub(crate) fn operands(self) -> [Option<Symbol>; 2] {
        match self {
            Operation::Input(..) => [None, None],
            Operation::Sum(left, right)
            | Operation::Difference(left, right)
            | Operation::Product(left, right)
            | Operation::Quotient(left, right) => [Some(left), Some(right)],
            Operation::Negate(of)
            | Operation::Sine(of)
            | Operation::Cosine(of)
            | Operation::Exponential(of)
            | Operation::Magnitude(of)
            | Operation::PositivePart(of)
            | Operation::Power(of, _)
            | Operation::HyperbolicTangent(of)
            | Operation::Sign(of) => [Some(of), None],
        }
    }

    /// What tells it from others: kind, operands, and its own number.
    fn key(self) -> Key {
        let of = |symbol: Option<Symbol>| match symbol {
            None => (0, 0),
            Some(Symbol::Known(value)) => (1, value.to_bits()),
            Some(Symbol::Computed(place)) => (2, u64::from(place)),
        };
        let own = match self {
            Operation::Input(signal, joint) => (signal as u8, joint as u64),
            Operation::Power(_, exponent) => (3, exponent.to_bits()),
            _ => (0, 0),
        };
        let [left, right] = self.operands();
        (std::mem::discriminant(&self), [of(left), of(right), own])
    }
}

/// What tells operations apart.
type Key = (std::mem::Discriminant<Operation>, [(u8, u64); 3]);

/// Steps in their order; what is computed twice is written once.
#[derive(Default)]
struct Tape {
    operations: Vec<Operation>,
    places: HashMap<Key, u32>,
}

thread_local! {
    static TAPE: RefCell<Tape> = RefCell::new(Tape::default());
}

/// What `work` does with symbols, and what it returns.
pub(crate) fn record<R>(work: impl FnOnce() -> R) -> (R, Vec<Operation>) {
    TAPE.with_borrow_mut(|tape| *tape = Tape::default());
    let result = work();
    let tape = TAPE.with_borrow_mut(std::mem::take);
    (result, tape.operations)
}

impl Symbol {
    /// The result of an operation.
    pub(crate) fn of(operation: Operation) -> Self {
        TAPE.with_borrow_mut(|tape| {
            let next = tape.operations.len() as u32;
            let place = *tape.places.entry(operation.key()).or_insert(next);
            if place == next {
                tape.operations.push(operation);
            }
            Symbol::Computed(place)
        })
    }

    /// A function of a number: at once where it is known.
    pub(crate) fn function(self, known: impl Fn(f64) -> f64, operation: fn(Symbol) -> Operation) -> Self {
        match self {
            Symbol::Known(value) => Symbol::Known(known(value)),
            computed => Self::of(operation(computed)),
        }
    }
}

impl Add for Symbol {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        match (self, other) {
            (Symbol::Known(left), Symbol::Known(right)) => Symbol::Known(left + right),
            (Symbol::Known(0.0), other) | (other, Symbol::Known(0.0)) => other,
            (left, right) => Self::of(Operation::Sum(left, right)),
        }
    }
}
impl Sub for Symbol {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        match (self, other) {
            (Symbol::Known(left), Symbol::Known(right)) => Symbol::Known(left - right),
            (left, Symbol::Known(0.0)) => left,
            (Symbol::Known(0.0), right) => -right,
            (left, right) => Self::of(Operation::Difference(left, right)),
        }
    }
}
impl Mul for Symbol {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        match (self, other) {
            (Symbol::Known(left), Symbol::Known(right)) => Symbol::Known(left * right),
            (Symbol::Known(0.0), _) | (_, Symbol::Known(0.0)) => Symbol::Known(0.0),
            (Symbol::Known(1.0), other) | (other, Symbol::Known(1.0)) => other,
            (Symbol::Known(-1.0), other) | (other, Symbol::Known(-1.0)) => -other,
            (left, right) => Self::of(Operation::Product(left, right)),
        }
    }
}
impl Div for Symbol {
    type Output = Self;
    fn div(self, other: Self) -> Self {
        match (self, other) {
            (Symbol::Known(left), Symbol::Known(right)) => Symbol::Known(left / right),
            (left, Symbol::Known(1.0)) => left,
            (left, right) => Self::of(Operation::Quotient(left, right)),
        }
    }
}
impl Neg for Symbol {
    type Output = Self;
    fn neg(self) -> Self {
        self.function(|value| -value, Operation::Negate)
    }
}
impl AddAssign for Symbol {
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}
impl SubAssign for Symbol {
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}

impl Scalar for Symbol {
    fn constant(value: f64) -> Self {
        Symbol::Known(value)
    }
    fn sin_cos(self) -> (Self, Self) {
        (self.function(f64::sin, Operation::Sine), self.function(f64::cos, Operation::Cosine))
    }
}
