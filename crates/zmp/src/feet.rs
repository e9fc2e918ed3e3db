//! Support files: which links have soles, and where their corners are.

use phiw_dynamics::{Foot, Tree};
use serde::Deserialize;

/// What a support file holds.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SupportFile {
    foot: Vec<FootEntry>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct FootEntry {
    /// The URDF's link.
    link: String,
    /// Corners in the link's joint frame \[m\].
    sole: Vec<[f64; 3]>,
}

/// Why a support file does not fit a robot.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FeetError {
    /// It is not TOML, or not of this form.
    #[error("not a support file ([[foot]] with `link` and `sole`): {0}")]
    Syntax(String),
    /// The robot has no such link that moves.
    #[error(
        "the foot's link {link:?} is none of the robot's moving links ({known}): name one, or read the robot with a floating base if it is the root"
    )]
    NoSuchLink {
        /// The name.
        link: String,
        /// Those that there are.
        known: String,
    },
    /// A sole is not a flat polygon.
    #[error("the sole under {link:?} {problem}")]
    Sole {
        /// The link.
        link: String,
        /// What is wrong with it.
        problem: &'static str,
    },
}

/// The feet that a support file names, for a tree that was read with a floating base:
///
/// ```toml
/// [[foot]]
/// link = "left_foot"  # a link that moves, or the root of a floating base
/// # m, in the link's frame
/// sole = [[0.15, 0.05, -0.08], [0.15, -0.05, -0.08], [-0.07, -0.05, -0.08], [-0.07, 0.05, -0.08]]
/// ```
///
/// # Errors
/// The text is not of this form, a link is not there, or a sole has fewer than three corners, is not flat or
/// has no area.
pub fn feet_from_toml(text: &str, tree: &Tree) -> Result<Vec<Foot>, FeetError> {
    let syntax = |error: toml::de::Error| {
        let before = error.span().map_or("", |span| text.get(..span.start).unwrap_or_default());
        let line = 1 + before.matches('\n').count();
        FeetError::Syntax(format!("line {line}: {}", error.message()))
    };
    let file: SupportFile = toml::from_str(text).map_err(syntax)?;
    file.foot
        .into_iter()
        .map(|FootEntry { link, sole }| {
            let Some(body) = tree.bodies().iter().position(|body| body.link == link) else {
                let known: Vec<&str> = tree.bodies().iter().map(|body| body.link.as_str()).collect();
                return Err(FeetError::NoSuchLink { link, known: known.join(", ") });
            };
            match flaw(&sole) {
                Some(problem) => Err(FeetError::Sole { link, problem }),
                None => Ok(Foot { body, sole }),
            }
        })
        .collect()
}

/// What is wrong with a sole.
fn flaw(sole: &[[f64; 3]]) -> Option<&'static str> {
    /// How far a corner may lie off the plane of the others \[m\].
    const FLAT: f64 = 1e-6;
    /// Smallest area \[m²\].
    const AREA: f64 = 1e-8;
    if sole.len() < 3 {
        return Some("has fewer than three corners");
    }
    if sole.iter().flatten().any(|x| !x.is_finite()) {
        return Some("has a corner that is not a finite number");
    }
    let minus = |a: [f64; 3], b: [f64; 3]| [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
    let cross = |[a, b, c]: [f64; 3], [x, y, z]: [f64; 3]| [b * z - c * y, c * x - a * z, a * y - b * x];
    // Newell's normal: twice the area of a polygon.
    let mut normal = [0.0; 3];
    for pair in sole.windows(2).skip(1) {
        let part = cross(minus(pair[0], sole[0]), minus(pair[1], sole[0]));
        normal.iter_mut().zip(part).for_each(|(sum, part)| *sum += part);
    }
    let length = normal.iter().map(|x| x * x).sum::<f64>().sqrt();
    if length < 2.0 * AREA {
        return Some("has no area");
    }
    let off = |&corner: &[f64; 3]| {
        let lever = minus(corner, sole[0]);
        (0..3).map(|axis| lever[axis] * normal[axis]).sum::<f64>().abs() / length
    };
    sole.iter().any(|corner| off(corner) > FLAT).then_some("is not flat")
}
