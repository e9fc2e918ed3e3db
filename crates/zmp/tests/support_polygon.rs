//! Support polygons: hull, margins, reduction.

use phiw_dynamics::{Foot, Mat3, Placement, Vec3};
use phiw_zmp::{Bounds, Stance, SupportPolygon};
use proptest::prelude::*;

/// The sole of the 18-joint model.
const SOLE: [[f64; 2]; 4] = [[0.19, 0.18], [-0.15, 0.18], [-0.15, -0.18], [0.19, -0.18]];

fn point() -> impl Strategy<Value = [f64; 2]> {
    prop::array::uniform2(-1.0..1.0)
}

/// Anywhere, or on a grid, where many are in a line and some coincide.
fn contacts() -> impl Strategy<Value = Vec<[f64; 2]>> {
    let crossing = prop::array::uniform2(-4..=4).prop_map(|ij: [i32; 2]| ij.map(|i| 0.1 * f64::from(i)));
    prop_oneof![prop::collection::vec(point(), 3..30), prop::collection::vec(crossing, 3..30)]
}

/// Distance to the polygon's border, by a thousand points on each edge.
fn distance_to_border(polygon: &SupportPolygon, point: [f64; 2]) -> f64 {
    let corners = polygon.corners();
    let mut nearest = f64::INFINITY;
    for (from, to) in corners.iter().zip(corners.iter().cycle().skip(1)) {
        for part in 0..=1000 {
            let share = f64::from(part) / 1000.0;
            let [x, y] = [0, 1].map(|axis| from[axis] + share * (to[axis] - from[axis]) - point[axis]);
            nearest = f64::min(nearest, x.hypot(y));
        }
    }
    nearest
}

/// Whether the point is left of every edge, counted by hand.
fn is_inside(polygon: &SupportPolygon, [x, y]: [f64; 2]) -> bool {
    let corners = polygon.corners();
    corners
        .iter()
        .zip(corners.iter().cycle().skip(1))
        .all(|(from, to)| (to[0] - from[0]) * (y - from[1]) - (to[1] - from[1]) * (x - from[0]) >= 0.0)
}

proptest! {
    #[test]
    fn the_hull_is_convex_and_holds_all_contacts(contacts in contacts()) {
        let Ok(polygon) = SupportPolygon::from_points(&contacts) else { return Ok(()) };
        let corners = polygon.corners();
        for (index, corner) in corners.iter().enumerate() {
            prop_assert!(contacts.contains(corner), "a corner that is no contact");
            let [next, after] = [1, 2].map(|ahead| corners[(index + ahead) % corners.len()]);
            let turn = (next[0] - corner[0]) * (after[1] - next[1]) - (next[1] - corner[1]) * (after[0] - next[0]);
            prop_assert!(turn > -1e-12, "not counter-clockwise: {}", turn);
        }
        for contact in &contacts {
            prop_assert!(polygon.signed_margin(*contact) > -1e-12);
        }
    }

    #[test]
    fn the_margin_is_the_distance_to_the_border(contacts in contacts(), point in prop::array::uniform2(-2.0..2.0)) {
        let Ok(polygon) = SupportPolygon::from_points(&contacts) else { return Ok(()) };
        let margin = polygon.signed_margin(point);
        let distance = distance_to_border(&polygon, point);
        // Points on an edge are up to 3 mm apart.
        prop_assert!((margin.abs() - distance).abs() < 2e-3_f64.min(1e-5 / distance + 1e-9), "{} and {}", margin, distance);
        prop_assume!(distance > 1e-9);
        prop_assert_eq!(margin > 0.0, is_inside(&polygon, point));
        prop_assert_eq!(polygon.contains(point), is_inside(&polygon, point));
    }

    #[test]
    fn the_margins_gradient_is_its_difference(contacts in contacts(), point in prop::array::uniform2(-2.0..2.0)) {
        const STEP: f64 = 1e-7;
        let Ok(polygon) = SupportPolygon::from_points(&contacts) else { return Ok(()) };
        let nearest = polygon.nearest_edge(point);
        let slope = |sign: f64| [0, 1].map(|axis| {
            let mut moved = point;
            moved[axis] += sign * STEP;
            sign * (polygon.signed_margin(moved) - nearest.margin) / STEP
        });
        let (after, before) = (slope(1.0), slope(-1.0));
        // Where two edges are as near, the margin has a kink.
        prop_assume!((0..2).all(|axis| (after[axis] - before[axis]).abs() < 1e-5));
        for axis in 0..2 {
            prop_assert!((after[axis] - nearest.gradient[axis]).abs() < 1e-5);
        }
    }

    /// Equation (10) as it is printed, on the paper's bounds.
    #[test]
    fn bounds_reduce_as_printed(alpha in 0.0..=1.0_f64, zmp in prop::array::uniform2(-0.25..0.25)) {
        let bounds = SupportPolygon::from_points(&SOLE).unwrap().bounds();
        prop_assert_eq!(bounds, Bounds { lower: [-0.15, -0.18], upper: [0.19, 0.18] });
        let reduced = bounds.reduced(alpha, [0.0, 0.0]).unwrap();
        let share = 1.0 - alpha;
        let within = |low: f64, p: f64, high: f64| share * low <= p && p <= share * high;
        prop_assert_eq!(reduced.contains(zmp), within(-0.15, zmp[0], 0.19) && within(-0.18, zmp[1], 0.18));
        prop_assert_eq!(reduced.constraint(zmp).iter().all(|h| *h <= 0.0), reduced.contains(zmp));
        // The polygon of the bounds says the same, and so does the largest reduction.
        let polygon = bounds.polygon().unwrap();
        let largest = polygon.largest_reduction(zmp, [0.0, 0.0]);
        prop_assume!((largest - alpha).abs() > 1e-12);
        prop_assert_eq!(reduced.contains(zmp), largest >= alpha);
        prop_assert_eq!(polygon.reduced(alpha, [0.0, 0.0]).unwrap().contains(zmp), largest >= alpha);
    }

    /// Any polygon, shrunk to any point inside.
    #[test]
    fn the_largest_reduction_is_where_the_point_leaves(contacts in contacts(), zmp in point(), alpha in 0.0..=1.0_f64) {
        let Ok(polygon) = SupportPolygon::from_points(&contacts) else { return Ok(()) };
        let about = polygon.centroid();
        prop_assume!(polygon.signed_margin(about) > 1e-6);
        let largest = polygon.largest_reduction(zmp, about);
        prop_assert_eq!(largest >= 0.0, polygon.contains(zmp));
        prop_assume!((largest - alpha).abs() > 1e-9);
        prop_assert_eq!(polygon.reduced(alpha, about).unwrap().contains(zmp), largest > alpha);
        // The reduced polygon is within the whole.
        for corner in polygon.reduced(alpha, about).unwrap().corners() {
            prop_assert!(polygon.signed_margin(*corner) > -1e-12);
        }
    }

    #[test]
    fn the_centroid_is_the_mean_of_the_area(contacts in contacts(), shift in -1e3..1e3_f64) {
        let moved: Vec<[f64; 2]> = contacts.iter().map(|[x, y]| [x + shift, y - shift]).collect();
        let (Ok(polygon), Ok(far)) = (SupportPolygon::from_points(&contacts), SupportPolygon::from_points(&moved)) else {
            return Ok(());
        };
        prop_assume!(polygon.bounds().upper[0] - polygon.bounds().lower[0] > 0.1);
        let [x, y] = polygon.centroid();
        let [far_x, far_y] = far.centroid();
        prop_assert!((far_x - shift - x).abs() < 1e-8 && (far_y + shift - y).abs() < 1e-8);
        // A line through the centroid has no first moment: cut the polygon into strips.
        let bounds = polygon.bounds();
        let strips = 4000;
        let width = (bounds.upper[0] - bounds.lower[0]) / f64::from(strips);
        let corners = polygon.corners();
        let (mut area, mut moment) = (0.0, 0.0);
        for strip in 0..strips {
            let at = bounds.lower[0] + (f64::from(strip) + 0.5) * width;
            let mut crossings = (f64::INFINITY, f64::NEG_INFINITY);
            for (from, to) in corners.iter().zip(corners.iter().cycle().skip(1)) {
                if (from[0] - at) * (to[0] - at) < 0.0 {
                    let y = from[1] + (at - from[0]) / (to[0] - from[0]) * (to[1] - from[1]);
                    crossings = (crossings.0.min(y), crossings.1.max(y));
                }
            }
            let height = (crossings.1 - crossings.0).max(0.0);
            area += height * width;
            moment += height * width * at;
        }
        prop_assume!(area > 1e-3);
        prop_assert!((moment / area - x).abs() < 1e-4, "{} and {}", moment / area, x);
    }
}

#[test]
fn margins_of_a_sole_are_in_metres() {
    let polygon = SupportPolygon::from_points(&SOLE).unwrap();
    for (point, margin) in [
        ([0.0, 0.0], 0.15),
        ([0.18, 0.1], 0.01),
        ([0.02, 0.17], 0.01),
        ([0.19, 0.0], 0.0),
        ([0.29, 0.0], -0.1),
        ([0.22, 0.22], -0.05),
    ] {
        assert!((polygon.signed_margin(point) - margin).abs() < 1e-15, "{point:?}");
    }
    assert_eq!(polygon.nearest_edge([0.22, 0.22]).gradient.map(|x| (10.0 * x).round()), [-6.0, -8.0]);
    let middle = polygon.centroid();
    assert!((middle[0] - 0.02).abs() < 1e-15 && middle[1].abs() < 1e-15);
    // Shrunk to a point, it is as far away as that point.
    let nothing = polygon.reduced(1.0, [0.0, 0.0]).unwrap();
    assert_eq!(nothing.signed_margin([0.3, 0.4]), -0.5);
    assert_eq!(nothing.signed_margin([0.0, 0.0]), 0.0);
    assert_eq!(nothing.centroid(), [0.0, 0.0]);
    assert_eq!(polygon.largest_reduction([0.0, 0.0], [0.0, 0.0]), 1.0);
    assert!((polygon.largest_reduction([0.095, 0.0], [0.0, 0.0]) - 0.5).abs() < 1e-15);
    // A reduction to the border leaves no way beyond it.
    assert_eq!(polygon.largest_reduction([0.2, 0.0], [0.19, 0.0]), f64::NEG_INFINITY);
}

/// A corner was skipped as "not outside its own edges, no distance to them", and the margin became that to
/// the far edge.
#[test]
fn a_corner_that_rounding_puts_outside_is_on_the_border() {
    let contacts = [[-0.9271744011236952, 0.0], [0.0, 0.0], [0.5278918185756957, 0.639166385478268]];
    let polygon = SupportPolygon::from_points(&contacts).unwrap();
    for contact in contacts {
        assert!(polygon.signed_margin(contact).abs() < 1e-15, "{contact:?}");
    }
}

fn assert_bounds(found: Bounds, [lower, upper]: [[f64; 2]; 2]) {
    let near =
        |found: [f64; 2], expected: [f64; 2]| (0..2).all(|axis| (found[axis] - expected[axis]).abs() < 1e-12);
    assert!(near(found.lower, lower) && near(found.upper, upper), "{found:?}");
}

/// Where soles are in the world, and which corners touch the floor.
#[test]
fn the_hull_is_of_the_soles_on_the_floor() {
    let sole = |body| Foot { body, sole: SOLE.map(|[x, y]| [x, y, -0.1]).to_vec() };
    let at = |y: f64, z: f64| Placement { rotation: Mat3::identity(), translation: Vec3([1.0, y, z]) };
    let feet = [sole(0), sole(1)];
    let both = SupportPolygon::from_feet(&feet, &[at(0.5, 0.1), at(-0.5, 0.1)], 0.0, 1e-3).unwrap();
    assert_eq!(both.corners().len(), 4);
    assert_bounds(both.bounds(), [[0.85, -0.68], [1.19, 0.68]]);
    // One foot in the air.
    let left = SupportPolygon::from_feet(&feet, &[at(0.5, 0.1), at(-0.5, 0.2)], 0.0, 1e-3).unwrap();
    assert_bounds(left.bounds(), [[0.85, 0.32], [1.19, 0.68]]);
    let error = SupportPolygon::from_feet(&feet, &[at(0.5, 0.2), at(-0.5, 0.2)], 0.0, 1e-3).unwrap_err();
    assert_eq!(
        error.to_string(),
        "the 0 contacts enclose 0 m²: a robot stands on at least three that are not in a line"
    );
    let error = SupportPolygon::from_feet(&feet, &[at(0.5, 0.1)], 0.0, 1e-3).unwrap_err();
    assert_eq!(error.to_string(), "a foot is fixed to body 1, but there are placements of 1 bodies");
}

#[test]
fn contacts_that_carry_nothing_are_refused() {
    let check = |contacts: &[[f64; 2]], message: &str| {
        let error = SupportPolygon::from_points(contacts).unwrap_err();
        assert!(error.to_string().starts_with(message), "{error}");
    };
    check(&[], "the 0 contacts enclose 0 m²");
    check(&[[0.1, 0.1]; 5], "the 5 contacts enclose 0 m²");
    check(&[[0.1, 0.1], [0.2, 0.2]], "the 2 contacts enclose 0 m²");
    check(&[[0.1, 0.1], [0.2, 0.2], [0.3, 0.3], [0.4, 0.4]], "the 4 contacts enclose ");
    check(&[[0.0, 0.0], [0.0, 1.0], [0.0, 2.0]], "the 3 contacts enclose 0 m²");
    check(
        &[[0.0, 0.0], [1.0, f64::NAN], [0.0, 2.0]],
        "contact 1 has a coordinate that is not a finite number",
    );
}

#[test]
fn reductions_that_mean_nothing_are_refused() {
    let polygon = SupportPolygon::from_points(&SOLE).unwrap();
    for alpha in [-0.1, 1.1, f64::NAN] {
        let message = format!(
            "the reduction coefficient alpha is {alpha}: it must be from 0 (the whole polygon) to 1 (a point)"
        );
        assert_eq!(polygon.reduced(alpha, [0.0; 2]).unwrap_err().to_string(), message);
        assert_eq!(polygon.bounds().reduced(alpha, [0.0; 2]).unwrap_err().to_string(), message);
    }
    let message = "the polygon cannot shrink to [1.0, 0.0] m, which is outside it: name a point inside, its centroid for one";
    assert_eq!(polygon.reduced(0.5, [1.0, 0.0]).unwrap_err().to_string(), message);
    assert_eq!(Stance::new(polygon, [1.0, 0.0], 0.0).unwrap_err().to_string(), message);
}

/// The same as without an uncertainty where there is none; and with one, what a circle or an ellipse of
/// points about the ZMP leaves.
#[test]
fn a_sure_margin_has_room_for_the_ellipse_of_what_is_not_known() {
    let polygon = SupportPolygon::from_points(&SOLE).unwrap();
    let about = [0.02, 0.01];
    for zmp in [[0.0, 0.0], [0.12, -0.1], [0.02, 0.17]] {
        let sure = polygon.sure_margin(zmp, [0.0; 3], 3.0, about);
        assert!((sure.margin - polygon.signed_margin(zmp)).abs() < 1e-12);
        assert!((sure.largest_reduction - polygon.largest_reduction(zmp, about)).abs() < 1e-12);
        // An ellipse with half axes of 2·0.01 m and 2·0.002 m, turned by 0.5 rad.
        let (long, short, turn) = (0.01_f64, 0.002_f64, 0.5_f64);
        let (sine, cosine) = turn.sin_cos();
        let xx = (long * cosine).powi(2) + (short * sine).powi(2);
        let yy = (long * sine).powi(2) + (short * cosine).powi(2);
        let xy = (long * long - short * short) * sine * cosine;
        let sure = polygon.sure_margin(zmp, [xx, xy, yy], 2.0, about);
        let points = (0..36_000).map(|k| {
            let (s, c) = (f64::from(k) * std::f64::consts::TAU / 36_000.0).sin_cos();
            let [along, across] = [2.0 * long * c, 2.0 * short * s];
            [zmp[0] + along * cosine - across * sine, zmp[1] + along * sine + across * cosine]
        });
        let (mut margin, mut reduction) = (f64::INFINITY, f64::INFINITY);
        for point in points {
            margin = margin.min(polygon.signed_margin(point));
            reduction = reduction.min(polygon.largest_reduction(point, about));
        }
        assert!((sure.margin - margin).abs() < 1e-7, "{} {margin}", sure.margin);
        assert!((sure.largest_reduction - reduction).abs() < 1e-6);
    }
    // Nothing known of the point leaves nothing.
    let nothing = polygon.sure_margin([0.0; 2], [f64::INFINITY, 0.0, f64::NAN], 1.0, about);
    assert_eq!([nothing.margin, nothing.largest_reduction], [f64::NEG_INFINITY; 2]);
}
