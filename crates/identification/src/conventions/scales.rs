//! In which unit torques are: one, each in its own, or all.

use super::reading::Reading;
use super::rough_fit::{FITS, LEAST_LEFT, Left, Products, free_products, solved};
use super::{Candidate, Convention, ConventionKind, ConventionSettings, Log};
use crate::IdentificationError;
use faer::Mat;
use rayon::prelude::*;

/// Steps to find a scale.
const SCALE_STEPS: usize = 4;
/// Share of the largest torque that the URDF foretells (RMS) below which a torque is as good as none.
const NEGLIGIBLE: f64 = 1e-3;
/// What the URDF's sizes of the torques weigh beside what the torques tell of each other: enough to choose
/// where these tell nothing.
const WEIGHT_OF_URDF: f64 = 0.03;

/// Each torque in another unit while the others are as they are.
pub(super) fn of_one(log: &Log<'_>, reading: &Reading) -> Result<Vec<Candidate>, IdentificationError> {
    let present = log.fitted_if(reading)?;
    let scales = (0..log.joints()).into_par_iter().filter_map(|joint| {
        let scale = present.scale(joint)?.recip();
        (scale > 0.0 && scale.ln().abs() > log.settings.least_scale.ln()).then_some((joint, scale))
    });
    let scales: Vec<(usize, f64)> = scales.collect();
    scales.into_par_iter().map(|(joint, scale)| in_steps(log, reading, joint, scale)).collect()
}

/// The scale of a torque, found in a few steps from a first one: as long as it is wrong it disturbs what the
/// others tell of it.
fn in_steps(
    log: &Log<'_>,
    reading: &Reading,
    joint: usize,
    first: f64,
) -> Result<Candidate, IdentificationError> {
    let kind = |scale: f64| ConventionKind::TorqueScale(scale);
    let with = |scale: f64| log.fitted_if(&reading.with(&kind(scale), &[joint]));
    let mut best = (first, with(first)?);
    let mut scale = first;
    for _ in 1..SCALE_STEPS {
        let Some(factor) = best.1.scale(joint).filter(|factor| *factor > 0.0) else { break };
        scale /= factor;
        let next = with(scale)?;
        if next.left.total() >= best.1.left.total() {
            break;
        }
        best = (scale, next);
    }
    let (scale, fitted) = best;
    Ok(Candidate { kind: kind(scale), joints: vec![joint], left: fitted.left })
}

/// Every torque in a unit of its own: the base parameters w and the torques' factors r at which Φw − τ·r is
/// smallest together. That leaves a factor common to all free, for which the size of the URDF's torques is
/// taken. A torque that the URDF does not foretell at all keeps its unit.
pub(super) fn of_each(log: &Log<'_>, reading: &Reading) -> Result<Option<Candidate>, IdentificationError> {
    let all: Vec<usize> = (0..log.joints()).collect();
    let products = free_products(log.tree, &log.base, &log.samples, reading)?;
    let of_urdf = log.base.from_standard(&log.tree.inertial_parameters())?;
    let measured: Vec<f64> = products.iter().map(Products::torque_squares).map(f64::sqrt).collect();
    let mut expected: Vec<f64> =
        products.iter().map(|own| own.squares_of_model(&of_urdf)).map(f64::sqrt).collect();
    let largest = expected.iter().copied().fold(0.0, f64::max);
    if largest <= 0.0 || measured.contains(&0.0) {
        return Ok(None);
    }
    expected.iter_mut().for_each(|size| *size = size.max(NEGLIGIBLE * largest));
    let mut weights: Vec<f64> = expected.iter().map(|size| 1.0 / (size * size)).collect();
    let mut best: Option<(Vec<f64>, Left)> = None;
    for _ in 0..FITS {
        let factors = factors(&products, &weights, &expected, &measured, log.base.count());
        let left = log.left_if(&reading.with(&scales_of(&factors), &all))?;
        for joint in 0..log.joints() {
            let relative = left.relative[joint].max(LEAST_LEFT);
            weights[joint] = 1.0 / (relative * expected[joint]).powi(2);
        }
        if best.as_ref().is_none_or(|(_, best)| left.total() < best.total()) {
            best = Some((factors, left));
        }
    }
    let Some((factors, left)) = best else { return Ok(None) };
    let sizes = sizes_over(log, &products, &of_urdf, &left.parameters);
    let Some(common) = median(&sizes) else { return Ok(None) };
    let joints: Vec<usize> = all.into_iter().filter(|&joint| sizes[joint].is_some()).collect();
    let telling: Vec<f64> = joints.iter().map(|&joint| factors[joint] / common).collect();
    let (least, most) =
        telling.iter().fold((f64::INFINITY, 0.0_f64), |(least, most), f| (least.min(*f), most.max(*f)));
    if most < log.settings.least_scale * least {
        return Ok(None);
    }
    let kind = scales_of(&telling);
    let left = log.left_if(&reading.with(&kind, &joints))?;
    Ok(Some(Candidate { kind, joints, left }))
}

fn scales_of(factors: &[f64]) -> ConventionKind {
    ConventionKind::EachTorqueScale(factors.iter().map(|factor| factor.recip()).collect())
}

/// The torques' factors, but for one common to all. Where one would turn a torque's sign the others do not
/// tell it, and the URDF's size is taken.
fn factors(
    products: &[Products],
    weights: &[f64],
    expected: &[f64],
    measured: &[f64],
    base: usize,
) -> Vec<f64> {
    // Unknowns: base parameters, then for each torque its factor over expected / measured.
    let along = |joint: usize, row: usize| products[joint].share(row) * expected[joint] / measured[joint];
    let size = base + products.len();
    let matrix = Mat::from_fn(size, size, |row, column| match (row.min(column), row.max(column)) {
        (low, high) if high < base => {
            products.iter().zip(weights).map(|(own, weight)| weight * own.at(low, high)).sum()
        }
        (low, high) if low < base => -weights[high - base] * along(high - base, low),
        (low, high) if low == high => weights[low - base] * expected[low - base].powi(2) + WEIGHT_OF_URDF,
        _ => 0.0,
    });
    let solution = solved(&matrix, |row| if row < base { 0.0 } else { WEIGHT_OF_URDF });
    let over_expected = solution[base..].iter().map(|factor| if *factor > 0.0 { *factor } else { 1.0 });
    over_expected
        .zip(expected)
        .zip(measured)
        .map(|((over, expected), measured)| over * expected / measured)
        .collect()
}

/// The factor by which all torques are larger than the masses of the URDF ask for, where it is large enough.
pub(super) fn of_all(
    log: &Log<'_>,
    reading: &Reading,
    present: &Left,
) -> Result<Option<f64>, IdentificationError> {
    let products = free_products(log.tree, &log.base, &log.samples, reading)?;
    let of_urdf = log.base.from_standard(&log.tree.inertial_parameters())?;
    let sizes = sizes_over(log, &products, &of_urdf, &present.parameters);
    let telling = sizes.iter().flatten().count();
    Ok(median(&sizes)
        .filter(|size| 2 * telling > log.joints() && size.ln().abs() > log.settings.least_common_scale.ln()))
}

/// For each torque how large a fit's is beside that of the URDF; none where these two, or the fit and what
/// was measured, are not alike.
fn sizes_over(log: &Log<'_>, products: &[Products], of_urdf: &[f64], fitted: &[f64]) -> Vec<Option<f64>> {
    let least_likeness = log.settings.least_likeness;
    let largest = products.iter().map(|own| own.squares_of_model(of_urdf)).fold(0.0, f64::max);
    let size = |own: &Products| {
        let (expected, found) = (own.squares_of_model(of_urdf), own.squares_of_model(fitted));
        let product = own.product_of_models(of_urdf, fitted);
        let measured: f64 = fitted.iter().enumerate().map(|(row, value)| own.share(row) * value).sum();
        let is_alike = expected > NEGLIGIBLE.powi(2) * largest
            && product > least_likeness * (expected * found).sqrt()
            && measured.abs() > least_likeness * (own.torque_squares() * found).sqrt();
        Some(product / expected).filter(|size| is_alike && size.is_finite())
    };
    products.iter().map(size).collect()
}

/// Units of torques as what they come to for each torque: that one of two torques is 50 times too large, and
/// all are a 50th of what they should be, is a 50th of the other. And units of all of which one is another is
/// the unit of that one.
pub(super) fn merged(
    found: Vec<Convention>,
    joints: usize,
    settings: &ConventionSettings,
) -> Vec<Convention> {
    let mut scales = vec![1.0; joints];
    let mut of_units: Vec<&Convention> = Vec::new();
    for found in &found {
        match &found.kind {
            ConventionKind::TorqueScale(scale) => {
                found.joints.iter().for_each(|&joint| scales[joint] *= scale);
            }
            ConventionKind::EachTorqueScale(of_joints) => {
                found.joints.iter().zip(of_joints).for_each(|(&joint, scale)| scales[joint] *= scale);
            }
            ConventionKind::AllTorqueScales(scale) => scales.iter_mut().for_each(|own| *own *= scale),
            _ => continue,
        }
        of_units.push(found);
    }
    let is_single = |found: &&&Convention| matches!(found.kind, ConventionKind::TorqueScale(_));
    let (Some(last), false) = (of_units.last(), of_units.iter().filter(is_single).count() == of_units.len())
    else {
        return found;
    };
    let is_other = |joint: &usize| scales[*joint].ln().abs() > settings.least_scale.ln();
    let others: Vec<usize> = (0..joints).filter(is_other).collect();
    let merged = match others.as_slice() {
        &[joint] => Some((ConventionKind::TorqueScale(scales[joint]), others)),
        // Said once, of all torques: nothing to merge, though none may be far off by itself.
        _ if of_units.len() == 1 => return found,
        [] => None,
        _ => Some((ConventionKind::EachTorqueScale(scales), (0..joints).collect())),
    };
    let (left_as_named, left) = (last.left_as_named, last.left);
    let merged = merged.map(|(kind, joints)| Convention { kind, joints, left_as_named, left });
    let is_of_units = |convention: &Convention| {
        matches!(
            convention.kind,
            ConventionKind::TorqueScale(_)
                | ConventionKind::EachTorqueScale(_)
                | ConventionKind::AllTorqueScales(_)
        )
    };
    found.into_iter().filter(|found| !is_of_units(found)).chain(merged).collect()
}

fn median(sizes: &[Option<f64>]) -> Option<f64> {
    let mut sizes: Vec<f64> = sizes.iter().copied().flatten().collect();
    sizes.sort_by(f64::total_cmp);
    sizes.get(sizes.len() / 2).copied()
}

#[cfg(test)]
mod tests {
    use super::super::{Convention, ConventionKind, ConventionSettings};
    use super::merged;

    fn found(kind: ConventionKind, joints: &[usize]) -> Convention {
        Convention { kind, joints: joints.to_vec(), left_as_named: 0.5, left: 0.1 }
    }

    #[test]
    fn units_that_were_found_one_after_the_other_are_said_for_each_torque() {
        let merged = |all: &[Convention]| merged(all.to_vec(), 2, &ConventionSettings::default());
        let one = found(ConventionKind::TorqueScale(50.0), &[1]);
        let all = |scale: f64| found(ConventionKind::AllTorqueScales(scale), &[]);
        let sign = found(ConventionKind::TorqueSign, &[0]);
        assert_eq!(merged(&[one.clone(), sign.clone()]), [one.clone(), sign.clone()]);
        assert_eq!(merged(&[all(10.0)]), [all(10.0)]);
        let each = |scales: [f64; 2]| found(ConventionKind::EachTorqueScale(scales.to_vec()), &[0, 1]);
        assert_eq!(merged(&[each([3.0, 0.1])]), [each([3.0, 0.1])]);
        assert_eq!(merged(&[each([1.8, 0.6])]), [each([1.8, 0.6])]);
        assert_eq!(merged(&[each([1000.0, 1.01])]), [found(ConventionKind::TorqueScale(1000.0), &[0])]);
        assert_eq!(
            merged(&[one.clone(), sign.clone(), all(0.02)]),
            [sign, found(ConventionKind::TorqueScale(0.02), &[0])]
        );
        assert_eq!(merged(&[one, all(10.0)]), [each([10.0, 500.0])]);
    }
}
