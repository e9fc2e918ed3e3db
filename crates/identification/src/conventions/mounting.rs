//! Which way gravity points: robots hang on walls and under ceilings, and their URDF stands on the floor.

use super::reading::Reading;
use super::{Candidate, ConventionKind, Log};
use crate::IdentificationError;
use phiw_dynamics::Tree;
use rayon::prelude::*;

/// The first step along the sphere of directions, and the last \[rad\].
const STEPS: (f64, f64) = (0.3, 0.005);

/// The robot with a gravity along no axis of its own, so that whatever may weigh has a parameter.
pub(super) fn askew(tree: &Tree) -> Tree {
    let mut askew = tree.clone();
    askew.gravity = [2.7, -4.1, -8.5];
    askew
}

/// The mounting that leaves least; none where gravity points as in the reading, or nearly so.
pub(super) fn mounted(log: &Log<'_>, reading: &Reading) -> Result<Option<Candidate>, IdentificationError> {
    let tried = |directions: Vec<[f64; 3]>| {
        let all = directions.into_par_iter().map(|downward| {
            let kind = ConventionKind::Mounting(downward);
            let left = log.left_if(&reading.with(&kind, &[]))?;
            Ok((downward, Candidate { kind, joints: Vec::new(), left }))
        });
        let all = all.collect::<Result<Vec<_>, IdentificationError>>()?;
        Ok::<_, IdentificationError>(
            all.into_iter().min_by(|(_, a), (_, b)| a.left.total().total_cmp(&b.left.total())),
        )
    };
    let Some(present) = unit(reading.gravity) else { return Ok(None) };
    let first =
        directions().into_iter().filter(|downward| angle(*downward, present) > log.settings.least_angle_rad);
    let Some((mut downward, mut best)) = tried(first.collect())? else { return Ok(None) };
    let mut step = STEPS.0;
    while step > STEPS.1 {
        let [right, ahead] = beside(downward);
        let steps = [(right, step), (right, -step), (ahead, step), (ahead, -step)];
        let around = steps.map(|(along, step)| {
            let sum: [f64; 3] = std::array::from_fn(|axis| downward[axis] + step * along[axis]);
            unit(sum).unwrap_or(downward)
        });
        match tried(around.to_vec())? {
            Some((next, candidate)) if candidate.left.total() < best.left.total() => {
                (downward, best) = (next, candidate);
            }
            _ => step /= 2.0,
        }
    }
    Ok(Some(best).filter(|_| angle(downward, present) > log.settings.least_angle_rad))
}

/// The directions of a cube's faces, edges and corners.
fn directions() -> Vec<[f64; 3]> {
    let values = [-1.0, 0.0, 1.0];
    let all = values.iter().flat_map(|x| values.iter().flat_map(move |y| values.map(|z| [*x, *y, z])));
    all.filter_map(unit).collect()
}

/// Two directions that are perpendicular to one and to each other.
fn beside(downward: [f64; 3]) -> [[f64; 3]; 2] {
    let least = (0..3).min_by(|&a, &b| downward[a].abs().total_cmp(&downward[b].abs())).unwrap_or(0);
    let axis = std::array::from_fn(|at| f64::from(u8::from(at == least)));
    let right = unit(cross(downward, axis)).unwrap_or(axis);
    [right, cross(downward, right)]
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|at| {
        let (next, last) = ((at + 1) % 3, (at + 2) % 3);
        a[next] * b[last] - a[last] * b[next]
    })
}

fn angle(a: [f64; 3], b: [f64; 3]) -> f64 {
    let cosine: f64 = a.iter().zip(&b).map(|(a, b)| a * b).sum();
    cosine.clamp(-1.0, 1.0).acos()
}

fn unit(vector: [f64; 3]) -> Option<[f64; 3]> {
    let length = vector.iter().map(|along| along * along).sum::<f64>().sqrt();
    (length > 0.0).then(|| vector.map(|along| along / length))
}
