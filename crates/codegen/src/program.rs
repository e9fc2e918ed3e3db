//! Inverse dynamics of one robot as a list of steps.

use crate::expression::{Expression, Function, JointTorque};
use crate::symbol::{Operation, Signal, Symbol, record};
use phiw_dynamics::scalar::Scalar;
use phiw_dynamics::{DimensionError, Tree, Workspace};

/// Why no program can be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CodegenError {
    /// A formula names a joint that does not move by itself.
    #[error("a formula names the joint `{0}`, which the robot does not have")]
    UnknownJoint(String),
    /// The base floats.
    #[error("code is generated for robots on a fixed base only")]
    FloatingBase,
    /// A number that is none.
    #[error("a number of the model is not finite")]
    NotFinite,
    /// Numbers that do not fit each other.
    #[error(transparent)]
    Dimension(#[from] DimensionError),
}

/// Inverse dynamics of one robot, its formulas included, as steps without a branch.
pub(crate) struct Program {
    /// The steps; each works on those before it.
    pub(crate) operations: Vec<Operation>,
    /// The torque of each joint.
    pub(crate) torques: Vec<Symbol>,
}

impl Program {
    /// The steps of `tree`'s inverse dynamics, and of the torques that are added.
    pub(crate) fn of(tree: &Tree, added: &[JointTorque]) -> Result<Self, CodegenError> {
        if tree.is_floating() {
            return Err(CodegenError::FloatingBase);
        }
        let (torques, operations) = record(|| torques(tree, added));
        let program = Program { operations, torques: torques? };
        if program.has_number_that_is_none() {
            return Err(CodegenError::NotFinite);
        }
        Ok(program.without_unused())
    }

    fn has_number_that_is_none(&self) -> bool {
        let none = |symbol: &Symbol| matches!(symbol, Symbol::Known(value) if !value.is_finite());
        let operands = self.operations.iter().flat_map(|operation| operation.operands()).flatten();
        operands.chain(self.torques.iter().copied()).any(|symbol| none(&symbol))
    }

    /// How often each step's result is used.
    pub(crate) fn uses(&self) -> Vec<usize> {
        let mut uses = vec![0; self.operations.len()];
        let operands = self.operations.iter().flat_map(|operation| operation.operands()).flatten();
        for symbol in operands.chain(self.torques.iter().copied()) {
            if let Symbol::Computed(place) = symbol {
                uses[place as usize] += 1;
            }
        }
        uses
    }

    /// The same without steps that lead nowhere.
    fn without_unused(self) -> Self {
        let mut needed = vec![false; self.operations.len()];
        let mark = |symbol: Symbol, needed: &mut Vec<bool>| {
            if let Symbol::Computed(place) = symbol {
                needed[place as usize] = true;
            }
        };
        self.torques.iter().for_each(|&torque| mark(torque, &mut needed));
        for place in (0..self.operations.len()).rev() {
            if needed[place] {
                let operands = self.operations[place].operands();
                operands.into_iter().flatten().for_each(|operand| mark(operand, &mut needed));
            }
        }
        let mut places = Vec::with_capacity(needed.len());
        let mut next = 0;
        for &is_needed in &needed {
            places.push(next);
            next += u32::from(is_needed);
        }
        let moved = |symbol: Symbol| match symbol {
            Symbol::Computed(place) => Symbol::Computed(places[place as usize]),
            known => known,
        };
        let kept = self.operations.iter().zip(&needed).filter(|(_, needed)| **needed);
        Program {
            operations: kept.map(|(operation, _)| with_operands(*operation, moved)).collect(),
            torques: self.torques.into_iter().map(moved).collect(),
        }
    }
}

fn with_operands(operation: Operation, change: impl Fn(Symbol) -> Symbol) -> Operation {
    match operation {
        Operation::Input(..) => operation,
        Operation::Negate(of) => Operation::Negate(change(of)),
        Operation::Sum(left, right) => Operation::Sum(change(left), change(right)),
        Operation::Difference(left, right) => Operation::Difference(change(left), change(right)),
        Operation::Product(left, right) => Operation::Product(change(left), change(right)),
        Operation::Quotient(left, right) => Operation::Quotient(change(left), change(right)),
        Operation::Sine(of) => Operation::Sine(change(of)),
        Operation::Cosine(of) => Operation::Cosine(change(of)),
        Operation::Exponential(of) => Operation::Exponential(change(of)),
        Operation::Magnitude(of) => Operation::Magnitude(change(of)),
        Operation::PositivePart(of) => Operation::PositivePart(change(of)),
        Operation::Power(of, exponent) => Operation::Power(change(of), exponent),
        Operation::HyperbolicTangent(of) => Operation::HyperbolicTangent(change(of)),
        Operation::Sign(of) => Operation::Sign(change(of)),
    }
}

fn torques(tree: &Tree, added: &[JointTorque]) -> Result<Vec<Symbol>, CodegenError> {
    let joints = tree.joint_count();
    let inputs = |signal: Signal| -> Vec<Symbol> {
        (0..joints).map(|joint| Symbol::of(Operation::Input(signal, joint))).collect()
    };
    let (q, v, a) = (inputs(Signal::Position), inputs(Signal::Velocity), inputs(Signal::Acceleration));
    let mut bodies = vec![Symbol::zero(); joints];
    tree.inverse_dynamics(&q, &v, &a, &mut Workspace::new(tree), &mut bodies)?;
    let mut values = Values { tree, q, v, a, motion: bodies.clone(), bodies };
    let (of_torque, of_motion): (Vec<_>, Vec<_>) =
        added.iter().partition(|added| added.torque.needs_torque());
    let mut torques = values.motion.clone();
    for part in of_motion {
        torques[values.joint(&part.joint)?] += values.of(&part.torque)?;
    }
    values.motion.clone_from(&torques);
    for part in of_torque {
        torques[values.joint(&part.joint)?] += values.of(&part.torque)?;
    }
    Ok(torques)
}

/// What the variables of a formula are.
struct Values<'a> {
    tree: &'a Tree,
    q: Vec<Symbol>,
    v: Vec<Symbol>,
    a: Vec<Symbol>,
    bodies: Vec<Symbol>,
    motion: Vec<Symbol>,
}

impl Values<'_> {
    fn joint(&self, name: &str) -> Result<usize, CodegenError> {
        self.tree.joint_index(name).ok_or_else(|| CodegenError::UnknownJoint(name.to_owned()))
    }

    fn of(&self, expression: &Expression) -> Result<Symbol, CodegenError> {
        Ok(match expression {
            Expression::Constant(value) => Symbol::Known(*value),
            Expression::Position(joint) => self.q[self.joint(joint)?],
            Expression::Velocity(joint) => self.v[self.joint(joint)?],
            Expression::Acceleration(joint) => self.a[self.joint(joint)?],
            Expression::BodyTorque(joint) => self.bodies[self.joint(joint)?],
            Expression::MotionTorque(joint) => self.motion[self.joint(joint)?],
            Expression::Sum(left, right) => self.of(left)? + self.of(right)?,
            Expression::Product(left, right) => self.of(left)? * self.of(right)?,
            Expression::Function(function, of) => apply(*function, self.of(of)?),
        })
    }
}

fn apply(function: Function, of: Symbol) -> Symbol {
    match function {
        Function::Sine => of.sin_cos().0,
        Function::Cosine => of.sin_cos().1,
        Function::Exponential => of.function(f64::exp, Operation::Exponential),
        Function::Magnitude => of.function(f64::abs, Operation::Magnitude),
        Function::PositivePart => of.function(|value| value.max(0.0), Operation::PositivePart),
        Function::Sign(width) if width > 0.0 => {
            (of / Symbol::Known(width)).function(f64::tanh, Operation::HyperbolicTangent)
        }
        Function::Sign(_) => of.function(sign, Operation::Sign),
        Function::Power(1.0) => of.function(f64::abs, Operation::Magnitude),
        Function::Power(2.0) => of * of,
        Function::Power(exponent) => match of {
            Symbol::Known(value) => Symbol::Known(value.abs().powf(exponent)),
            computed => Symbol::of(Operation::Power(computed, exponent)),
        },
    }
}

fn sign(value: f64) -> f64 {
    if value == 0.0 { 0.0 } else { value.signum() }
}
