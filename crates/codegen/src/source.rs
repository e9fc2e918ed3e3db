//! The text of generated C and Rust.

use crate::expression::JointTorque;
use crate::mathematics;
use crate::program::{CodegenError, Program};
use crate::symbol::{Operation, Signal, Symbol};
use phiw_dynamics::{JointType, Tree};
use std::fmt::Write;

/// What code is generated of.
#[derive(Clone, Debug)]
pub struct Model<'a> {
    /// The robot, on a fixed base.
    pub tree: &'a Tree,
    /// Torques beside those of its bodies.
    pub torques: Vec<JointTorque>,
    /// Lines of the comment at the head of the file.
    pub header: Vec<String>,
}

/// A longer expression gets a name \[characters\]: a line should fit on a screen.
const LONGEST: usize = 100;

/// The language of a text.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Language {
    C,
    Rust,
}

/// One C99 file with one function, `phiw_inverse_dynamics`. It needs `math.h` only, and allocates nothing.
///
/// # Errors
/// A formula names another joint, a number is not finite, or the base floats.
pub fn write_c(model: &Model<'_>) -> Result<String, CodegenError> {
    let program = Program::of(model.tree, &model.torques)?;
    let mut text = String::from("/*\n");
    head(model).iter().for_each(|line| push(&mut text, format_args!(" * {}\n", line.replace("*/", "* /"))));
    let count = model.tree.joint_count();
    push(
        &mut text,
        format_args!(
            " */\n#include <math.h>\n\n/* Joints of the robot. */\n#define PHIW_JOINTS {count}\n\n\
         /* The torque that a motion needs: position, velocity, acceleration in; torque out. */\n\
         void phiw_inverse_dynamics(const double q[PHIW_JOINTS], const double v[PHIW_JOINTS],\n    \
         const double a[PHIW_JOINTS], double torque[PHIW_JOINTS]);\n\n\
         void phiw_inverse_dynamics(const double q[PHIW_JOINTS], const double v[PHIW_JOINTS],\n    \
         const double a[PHIW_JOINTS], double torque[PHIW_JOINTS])\n{{\n"
        ),
    );
    let torques = steps(&program, Language::C, &mut text);
    for signal in ["q", "v", "a"] {
        push(&mut text, format_args!("    (void)({signal});\n"));
    }
    for (joint, torque) in torques.iter().enumerate() {
        push(&mut text, format_args!("    torque[{joint}] = {torque};\n"));
    }
    text.push_str("}\n");
    Ok(text)
}

/// One Rust file without `std`, with one function, `inverse_dynamics`: a crate of its own. It allocates
/// nothing and calls nothing that is not in it.
///
/// # Errors
/// As [`write_c`].
pub fn write_rust(model: &Model<'_>) -> Result<String, CodegenError> {
    let program = Program::of(model.tree, &model.torques)?;
    let mut text = String::new();
    head(model)
        .iter()
        .for_each(|line| push(&mut text, format_args!("{}\n", format!("//! {line}").trim_end())));
    let names: Vec<String> = model.tree.joint_names().map(|joint| format!("    {joint:?},\n")).collect();
    push(
        &mut text,
        format_args!(
            "#![no_std]\n\n/// Joints of the robot.\npub const JOINTS: usize = {};\n\n\
         /// Their names, in the order of all slices.\npub const JOINT_NAMES: [&str; JOINTS] = [\n{}];\n\n\
         /// The torque that a motion needs, of position, velocity and acceleration.\n\
         #[allow(unused_variables)]\n\
         pub fn inverse_dynamics(q: &[f64; JOINTS], v: &[f64; JOINTS], a: &[f64; JOINTS]) -> [f64; JOINTS] {{\n    \
         use mathematics::*;\n",
            names.len(),
            names.concat()
        ),
    );
    let torques = steps(&program, Language::Rust, &mut text);
    text.push_str("    [\n");
    torques.iter().for_each(|torque| push(&mut text, format_args!("        {torque},\n")));
    text.push_str("    ]\n}\n\n/// Elementary functions, as `core` has none.\n#[allow(dead_code, unused_imports)]\nmod mathematics {\n");
    for line in mathematics::text().lines() {
        // Every function is for the one above.
        let line = if line.starts_with("fn ") { format!("pub(crate) {line}") } else { line.to_owned() };
        push(&mut text, format_args!("{}\n", format!("    {line}").trim_end()));
    }
    text.push_str("}\n");
    Ok(text)
}

/// Appends; writing to a string does not fail.
fn push(text: &mut String, what: std::fmt::Arguments<'_>) {
    let _ = text.write_fmt(what);
}

/// The lines at the head: those of the model, then the joints in their order.
fn head(model: &Model<'_>) -> Vec<String> {
    let clean = |line: &str| line.chars().filter(|c| !c.is_control()).collect::<String>();
    let mut lines: Vec<String> = model.header.iter().map(|line| clean(line)).collect();
    lines.push(String::new());
    lines.push("Joints in the order of all arrays; SI units.".to_owned());
    for (index, name) in model.tree.joint_names().enumerate() {
        let units = match model.tree.joint(index).joint_type {
            JointType::Prismatic => "m, m/s, m/s^2, N",
            _ => "rad, rad/s, rad/s^2, N m",
        };
        lines.push(format!("{index}: {} ({units})", clean(name)));
    }
    lines
}

/// Writes the steps that get a name, and gives the expressions of the torques. A result that is used once is
/// written where it is used, in parentheses, so that nothing is computed in another order.
fn steps(program: &Program, language: Language, text: &mut String) -> Vec<String> {
    let uses = program.uses();
    let mut expressions: Vec<String> = Vec::with_capacity(program.operations.len());
    for (place, operation) in program.operations.iter().enumerate() {
        let expression = expression(*operation, language, &expressions);
        let is_input = matches!(operation, Operation::Input(..));
        if is_input || (uses[place] < 2 && expression.len() < LONGEST) {
            expressions.push(expression);
            continue;
        }
        let (begin, name) =
            (if language == Language::C { "const double" } else { "let" }, format!("x{place}"));
        push(text, format_args!("    {begin} {name} = {};\n", bare(&expression)));
        expressions.push(name);
    }
    program.torques.iter().map(|&torque| bare(&number(torque, &expressions)).to_owned()).collect()
}

/// An expression without the parentheses around all of it.
fn bare(expression: &str) -> &str {
    let Some(inner) = expression.strip_prefix('(').and_then(|inner| inner.strip_suffix(')')) else {
        return expression;
    };
    let mut depth = 0_i32;
    for character in inner.chars() {
        depth += i32::from(character == '(') - i32::from(character == ')');
        if depth < 0 {
            return expression;
        }
    }
    inner
}

fn number(symbol: Symbol, expressions: &[String]) -> String {
    match symbol {
        // All digits; with an exponent, which both languages read as a floating point number.
        Symbol::Known(value) if value < 0.0 => format!("({value:e})"),
        Symbol::Known(value) => format!("{value:e}"),
        Symbol::Computed(place) => expressions[place as usize].clone(),
    }
}

fn expression(operation: Operation, language: Language, known: &[String]) -> String {
    let value = |symbol: Symbol| number(symbol, known);
    let between =
        |left: Symbol, sign: &str, right: Symbol| format!("({} {sign} {})", value(left), value(right));
    let call = |c: &str, rust: &str, of: Symbol| {
        let function = if language == Language::C { c } else { rust };
        format!("{function}({})", bare(&value(of)))
    };
    match operation {
        Operation::Input(Signal::Position, joint) => format!("q[{joint}]"),
        Operation::Input(Signal::Velocity, joint) => format!("v[{joint}]"),
        Operation::Input(Signal::Acceleration, joint) => format!("a[{joint}]"),
        Operation::Negate(of) => format!("(-{})", value(of)),
        Operation::Sum(left, right) => between(left, "+", right),
        Operation::Difference(left, right) => between(left, "-", right),
        Operation::Product(left, right) => between(left, "*", right),
        Operation::Quotient(left, right) => between(left, "/", right),
        Operation::Sine(of) => call("sin", "sin", of),
        Operation::Cosine(of) => call("cos", "cos", of),
        Operation::Exponential(of) => call("exp", "exp", of),
        Operation::Magnitude(of) => call("fabs", "abs", of),
        Operation::HyperbolicTangent(of) => call("tanh", "tanh", of),
        Operation::PositivePart(of) if language == Language::C => format!("fmax({}, 0.0)", value(of)),
        Operation::PositivePart(of) => format!("positive_part({})", bare(&value(of))),
        Operation::Power(of, exponent) if language == Language::C => {
            format!("pow(fabs({}), {exponent:e})", bare(&value(of)))
        }
        Operation::Power(of, exponent) => format!("power({}, {exponent:e})", bare(&value(of))),
        Operation::Sign(of) if language == Language::C => {
            let of = value(of);
            format!("(double)(({of} > 0.0) - ({of} < 0.0))")
        }
        Operation::Sign(of) => format!("sign({})", bare(&value(of))),
    }
}
