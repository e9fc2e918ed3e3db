//! In which unit torques are: one, each in its own, or all.

use super::reading::Reading;
use super::rough_fit::{FITS, LEAST_LEFT, Left, Products, free_products, solved};
use super::{Candidate, ConventionKind, Log};
use crate::IdentificationError;
use faer::Mat;
use rayon::prelude::*;

/// Steps to find a scale.
const SCALE_STEPS: usize = 4;
/// A torque is in another unit from this factor on; below it is a gain.
const LEAST_SCALE: f64 = 2.0;
/// All torques are in another unit from this factor on; below it the URDF may have the masses wrong.
const LEAST_COMMON_SCALE: f64 = 5.0;
/// A torque that the URDF foretells with less than this share of the largest (RMS) does not tell its unit.
const LEAST_EXPECTED: f64 = 1e-3;
/// How much the URDF's torque must be like the fitted one (cosine) for it to tell all torques' unit.
const LEAST_LIKENESS: f64 = 0.7;
/// What the URDF says of the torques' sizes, against what the torques say of each other.
const TRUST_IN_URDF: f64 = 0.03;

/// Each torque in another unit while the others are as they are.
pub(super) fn of_one(
    log: &Log<'_>,
    reading: &Reading,
    present: &Left,
) -> Result<Vec<Candidate>, IdentificationError> {
    let scales = present.scales.iter().enumerate().filter_map(|(joint, scale)| {
        let scale = (*scale)?.recip();
        (scale > 0.0 && scale.ln().abs() > LEAST_SCALE.ln()).then_some((joint, scale))
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
    let with = |scale: f64| {
        let kind = ConventionKind::TorqueScale(scale);
        let left = log.left_if(&reading.with(&kind, &[joint]))?;
        Ok::<_, IdentificationError>(Candidate { kind, joints: vec![joint], left })
    };
    let mut best = with(first)?;
    let mut scale = first;
    for _ in 1..SCALE_STEPS {
        let Some(factor) = best.left.scales[joint].filter(|factor| *factor > 0.0) else { break };
        scale /= factor;
        let next = with(scale)?;
        if next.left.total() >= best.left.total() {
            break;
        }
        best = next;
    }
    Ok(best)
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
    expected.iter_mut().for_each(|size| *size = size.max(LEAST_EXPECTED * largest));
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
    let sizes = sizes_over(&products, &of_urdf, &left.parameters);
    let Some(common) = median(&sizes) else { return Ok(None) };
    let joints: Vec<usize> = all.into_iter().filter(|&joint| sizes[joint].is_some()).collect();
    let telling: Vec<f64> = joints.iter().map(|&joint| factors[joint] / common).collect();
    let (least, most) =
        telling.iter().fold((f64::INFINITY, 0.0_f64), |(least, most), f| (least.min(*f), most.max(*f)));
    if most < LEAST_SCALE * least {
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
        (low, high) if low == high => weights[low - base] * expected[low - base].powi(2) + TRUST_IN_URDF,
        _ => 0.0,
    });
    let solution = solved(&matrix, |row| if row < base { 0.0 } else { TRUST_IN_URDF });
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
    let sizes = sizes_over(&products, &of_urdf, &present.parameters);
    let telling = sizes.iter().flatten().count();
    Ok(median(&sizes).filter(|size| 2 * telling > log.joints() && size.ln().abs() > LEAST_COMMON_SCALE.ln()))
}

/// For each torque how large a fit's is beside that of the URDF; none where these two, or the fit and what
/// was measured, are not alike.
fn sizes_over(products: &[Products], of_urdf: &[f64], fitted: &[f64]) -> Vec<Option<f64>> {
    let largest = products.iter().map(|own| own.squares_of_model(of_urdf)).fold(0.0, f64::max);
    let size = |own: &Products| {
        let (expected, found) = (own.squares_of_model(of_urdf), own.squares_of_model(fitted));
        let product = own.product_of_models(of_urdf, fitted);
        let measured: f64 = fitted.iter().enumerate().map(|(row, value)| own.share(row) * value).sum();
        let is_alike = expected > LEAST_EXPECTED.powi(2) * largest
            && product > LEAST_LIKENESS * (expected * found).sqrt()
            && measured.abs() > LEAST_LIKENESS * (own.torque_squares() * found).sqrt();
        Some(product / expected).filter(|size| is_alike && size.is_finite())
    };
    products.iter().map(size).collect()
}

fn median(sizes: &[Option<f64>]) -> Option<f64> {
    let mut sizes: Vec<f64> = sizes.iter().copied().flatten().collect();
    sizes.sort_by(f64::total_cmp);
    sizes.get(sizes.len() / 2).copied()
}
