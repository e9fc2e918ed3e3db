//! The support polygon: the convex hull of the contacts with the floor.

use crate::bounds::{check_reduction, toward};
use crate::{Bounds, SupportError};
use parry2d_f64::math::Vector;
use parry2d_f64::transformation::convex_hull;
use phiw_dynamics::{Foot, Placement, Vec3};

/// Smallest area of a support polygon \[m²\]: less is a line.
const SMALLEST_AREA: f64 = 1e-8;

/// A convex polygon on the floor.
#[derive(Clone, Debug, PartialEq)]
pub struct SupportPolygon {
    /// Counter-clockwise.
    corners: Vec<[f64; 2]>,
    /// Outward unit normal of the edge from each corner to the next; kept apart, so that they outlive
    /// shrinking to a point.
    normals: Vec<[f64; 2]>,
}

/// How far a point is inside a polygon, and which way it gets farther.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NearestEdge {
    /// Distance to the polygon's border \[m\], positive inside.
    pub margin: f64,
    /// Its gradient with respect to the point: the unit vector away from the nearest point of the border
    /// inside, towards it outside.
    pub gradient: [f64; 2],
}

impl Bounds {
    /// The same as a polygon.
    ///
    /// # Errors
    /// The bounds enclose nothing or are not finite.
    pub fn polygon(&self) -> Result<SupportPolygon, SupportError> {
        let ([x0, y0], [x1, y1]) = (self.lower, self.upper);
        SupportPolygon::from_points(&[[x0, y0], [x1, y0], [x1, y1], [x0, y1]])
    }
}

impl SupportPolygon {
    /// The convex hull of contacts on the floor \[m\].
    ///
    /// # Errors
    /// A contact is not finite, or the contacts are on a line.
    pub fn from_points(contacts: &[[f64; 2]]) -> Result<Self, SupportError> {
        if let Some(index) = contacts.iter().position(|contact| !contact.iter().all(|x| x.is_finite())) {
            return Err(SupportError::NotFinite(index));
        }
        let mut points: Vec<Vector> = contacts.iter().map(|&[x, y]| Vector::new(x, y)).collect();
        points.dedup();
        // The hull of a single point is undefined in parry.
        let distinct = points.iter().any(|point| *point != points[0]);
        let hull = if distinct { convex_hull(&points) } else { Vec::new() };
        let corners: Vec<[f64; 2]> = hull.iter().map(|point| [point.x, point.y]).collect();
        let area = area_and_centroid(&corners).0;
        let carries = area > SMALLEST_AREA;
        if !carries {
            return Err(SupportError::NoArea { contacts: contacts.len(), area });
        }
        let next = corners.iter().cycle().skip(1);
        let normals = corners.iter().zip(next).map(|(from, to)| {
            let (x, y) = (to[0] - from[0], to[1] - from[1]);
            let length = x.hypot(y);
            [y / length, -x / length]
        });
        Ok(SupportPolygon { normals: normals.collect(), corners })
    }

    /// The hull of the soles' corners that touch the floor `z = floor_height` \[m\]: those not higher above
    /// it than `contact_height` \[m\].
    ///
    /// `placements` are those of all bodies in the world ([`phiw_dynamics::Tree::forward_kinematics`]). A
    /// robot on a fixed base has its soles on the base link, which is no body: give their corners to
    /// [`SupportPolygon::from_points`].
    ///
    /// # Errors
    /// A foot is on a body that is not there, or too few corners touch the floor.
    pub fn from_feet(
        feet: &[Foot],
        placements: &[Placement<f64>],
        floor_height: f64,
        contact_height: f64,
    ) -> Result<Self, SupportError> {
        let mut contacts = Vec::new();
        for foot in feet {
            let Some(placement) = placements.get(foot.body) else {
                return Err(SupportError::NoSuchBody { body: foot.body, bodies: placements.len() });
            };
            let corners = foot.sole.iter().map(|&corner| placement.point(Vec3(corner)).0);
            contacts
                .extend(corners.filter(|z| z[2] <= floor_height + contact_height).map(|[x, y, _]| [x, y]));
        }
        SupportPolygon::from_points(&contacts)
    }

    /// Its corners, counter-clockwise \[m\].
    pub fn corners(&self) -> &[[f64; 2]] {
        &self.corners
    }

    /// The edges: a corner, the next, and the outward unit normal between.
    fn edges(&self) -> impl Iterator<Item = ([f64; 2], [f64; 2], [f64; 2])> {
        let next = self.corners.iter().cycle().skip(1);
        self.corners.iter().zip(next).zip(&self.normals).map(|((from, to), normal)| (*from, *to, *normal))
    }

    /// Whether the point is inside or on the border.
    pub fn contains(&self, point: [f64; 2]) -> bool {
        self.edges().all(|(corner, _, normal)| beyond(corner, normal, point) <= 0.0)
    }

    /// Euclidean distance from the point to the border \[m\], positive inside.
    pub fn signed_margin(&self, point: [f64; 2]) -> f64 {
        self.nearest_edge(point).margin
    }

    /// [`SupportPolygon::signed_margin`] with its gradient.
    pub fn nearest_edge(&self, point: [f64; 2]) -> NearestEdge {
        let mut inside = NearestEdge { margin: f64::INFINITY, gradient: [0.0; 2] };
        for (corner, _, normal) in self.edges() {
            let margin = -beyond(corner, normal, point);
            if margin < inside.margin {
                inside = NearestEdge { margin, gradient: normal.map(|x| -x) };
            }
        }
        if inside.margin >= 0.0 {
            return inside;
        }
        let mut outside = NearestEdge { margin: f64::NEG_INFINITY, ..inside };
        for (from, to, _) in self.edges() {
            let nearest = nearest_of_segment(from, to, point);
            let lever = [nearest[0] - point[0], nearest[1] - point[1]];
            let distance = lever[0].hypot(lever[1]);
            if distance == 0.0 {
                // On the border: rounding alone called it outside.
                return inside;
            }
            if -distance > outside.margin {
                outside = NearestEdge { margin: -distance, gradient: lever.map(|x| x / distance) };
            }
        }
        outside
    }

    /// The largest x and y and the smallest, p⁺ and p⁻ of equation (9).
    pub fn bounds(&self) -> Bounds {
        let extreme = |start: f64, choose: fn(f64, f64) -> f64| {
            [0, 1].map(|axis| self.corners.iter().fold(start, |found, corner| choose(found, corner[axis])))
        };
        Bounds { lower: extreme(f64::INFINITY, f64::min), upper: extreme(f64::NEG_INFINITY, f64::max) }
    }

    /// The centre of its area \[m\].
    pub fn centroid(&self) -> [f64; 2] {
        match area_and_centroid(&self.corners) {
            (area, centroid) if area > 0.0 => centroid,
            _ => self.corners[0],
        }
    }

    /// The polygon with the part `alpha` taken away: each corner moves that part of its way to `about`. What
    /// equation (10) does to the bounds, done to the polygon itself.
    ///
    /// # Errors
    /// `alpha` is not in \[0, 1\], or `about` is outside.
    pub fn reduced(&self, alpha: f64, about: [f64; 2]) -> Result<SupportPolygon, SupportError> {
        check_reduction(alpha, about, self.contains(about))?;
        let shrink = |corner: &[f64; 2]| [0, 1].map(|axis| toward(about[axis], corner[axis], alpha));
        Ok(SupportPolygon {
            corners: self.corners.iter().map(shrink).collect(),
            normals: self.normals.clone(),
        })
    }

    /// The largest `alpha` at which [`SupportPolygon::reduced`] about this point still contains `zmp`;
    /// negative where the whole polygon does not.
    ///
    /// It settles at once for every α whether a motion is allowed. `about` must be inside.
    pub fn largest_reduction(&self, zmp: [f64; 2], about: [f64; 2]) -> f64 {
        let share = |(corner, _, normal): ([f64; 2], [f64; 2], [f64; 2])| {
            let (way, whole) = (beyond(about, normal, zmp), beyond(about, normal, corner));
            if way <= 0.0 {
                0.0
            } else if whole > 0.0 {
                way / whole
            } else {
                f64::INFINITY
            }
        };
        1.0 - self.edges().map(share).fold(0.0, f64::max)
    }

    /// [`SupportPolygon::signed_margin`] and [`SupportPolygon::largest_reduction`] of a point that is not
    /// known exactly: from the distance to each edge `deviations` of its standard deviations across that edge
    /// are taken. `covariance` is that of x and y \[m²\]: xx, xy, yy.
    ///
    /// Outside of the polygon the margin is that to the line of the edge that is furthest off, which is never
    /// more than the distance to the border. A covariance that is not a number leaves no margin.
    pub fn sure_margin(
        &self,
        zmp: [f64; 2],
        [xx, xy, yy]: [f64; 3],
        deviations: f64,
        about: [f64; 2],
    ) -> SureMargin {
        let mut sure = SureMargin { margin: f64::INFINITY, largest_reduction: 1.0 };
        for (corner, _, [x, y]) in self.edges() {
            let variance = x * x * xx + 2.0 * x * y * xy + y * y * yy;
            let reach = deviations * variance.max(0.0).sqrt();
            let reach = if variance.is_nan() { f64::INFINITY } else { reach };
            let way = (beyond(about, [x, y], zmp) + reach).max(0.0);
            let whole = beyond(about, [x, y], corner);
            let share = match way {
                0.0 => 0.0,
                way if whole > 0.0 => way / whole,
                _ => f64::INFINITY,
            };
            sure.margin = sure.margin.min(-beyond(corner, [x, y], zmp) - reach);
            sure.largest_reduction = sure.largest_reduction.min(1.0 - share);
        }
        sure
    }
}

/// How far inside a polygon a point is that is not known exactly.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SureMargin {
    /// What is left of the margin \[m\]; −∞ where nothing is known of the point.
    pub margin: f64,
    /// The largest α at which the reduced polygon still has room for it; negative where the whole has not.
    pub largest_reduction: f64,
}

/// How far the point is beyond the line through `corner` \[m\].
#[inline]
fn beyond(corner: [f64; 2], normal: [f64; 2], point: [f64; 2]) -> f64 {
    (point[0] - corner[0]) * normal[0] + (point[1] - corner[1]) * normal[1]
}

fn nearest_of_segment(from: [f64; 2], to: [f64; 2], point: [f64; 2]) -> [f64; 2] {
    let along = [to[0] - from[0], to[1] - from[1]];
    let length_squared = along[0] * along[0] + along[1] * along[1];
    let way = beyond(from, along, point);
    let share = if length_squared > 0.0 { (way / length_squared).clamp(0.0, 1.0) } else { 0.0 };
    [from[0] + share * along[0], from[1] + share * along[1]]
}

/// By triangles from the first corner, so that a polygon far from the origin keeps its digits.
fn area_and_centroid(corners: &[[f64; 2]]) -> (f64, [f64; 2]) {
    let Some(&first) = corners.first() else { return (0.0, [0.0; 2]) };
    let (mut area, mut moment) = (0.0, [0.0; 2]);
    for pair in corners.windows(2).skip(1) {
        let lever = |corner: [f64; 2]| [corner[0] - first[0], corner[1] - first[1]];
        let (a, b) = (lever(pair[0]), lever(pair[1]));
        let triangle = 0.5 * (a[0] * b[1] - a[1] * b[0]);
        area += triangle;
        moment = [0, 1].map(|axis| moment[axis] + triangle * (a[axis] + b[axis]) / 3.0);
    }
    (area, [0, 1].map(|axis| first[axis] + moment[axis] / area))
}
