//! Person and robot as sticks, side by side and at the same scale.

use std::fmt::Write;

/// Pixels for a metre.
const SCALE: f64 = 180.0;
/// Where the shoulders of both are \[pixels from the top\].
const SHOULDERS: f64 = 125.0;
/// Width of a figure \[pixels\].
pub const WIDTH: f64 = 240.0;
/// Height of all of them.
pub const HEIGHT: f64 = 330.0;

/// What is seen from where.
#[derive(Clone, Copy, PartialEq)]
pub enum View {
    /// Facing it: its left is to the right.
    Front,
    /// From its right: it looks to the right.
    Right,
}

/// A figure in metres, x forward, y to its left, z up from the shoulders' height.
pub struct Figure {
    /// Colour of its sticks.
    pub colour: &'static str,
    /// Trunk: points that one line goes through, from the bottom.
    pub trunk: Vec<[f64; 3]>,
    /// Left and right: from the shoulder to the hand.
    pub arms: [Vec<[f64; 3]>; 2],
    /// Middle of the head, and which way it looks; whether that is measured.
    pub head: Option<([f64; 3], [f64; 3], bool)>,
    /// Markers.
    pub dots: Vec<[f64; 3]>,
}

impl Figure {
    /// Draws it into a field that begins at `left` pixels.
    pub fn draw(&self, view: View, left: f64, svg: &mut String) {
        let at = |[x, y, z]: [f64; 3]| {
            let across = if view == View::Front { y } else { x };
            // From the side the arms need room ahead.
            let middle = if view == View::Front { WIDTH / 2.0 } else { 0.34 * WIDTH };
            [left + middle + SCALE * across, SHOULDERS - SCALE * z]
        };
        let line = |svg: &mut String, points: &[[f64; 3]], width: f64, opacity: f64| {
            let mut path = String::new();
            for (index, &point) in points.iter().enumerate() {
                let [x, y] = at(point);
                let _ = write!(path, "{}{x:.0} {y:.0}", if index == 0 { 'M' } else { 'L' });
            }
            let _ = write!(
                svg,
                "<path d='{path}' stroke='{}' stroke-width='{width}' stroke-opacity='{opacity}' \
                 stroke-linecap='round' stroke-linejoin='round' fill='none'/>",
                self.colour
            );
        };
        let [left_arm, right_arm] = &self.arms;
        // The far arm is behind the trunk, and paler.
        let far = if view == View::Right { 0.4 } else { 1.0 };
        line(svg, left_arm, 6.0, far);
        line(svg, &self.trunk, 3.0, 1.0);
        let shoulders: Vec<[f64; 3]> = self.arms.iter().filter_map(|arm| arm.first().copied()).collect();
        line(svg, &shoulders, 3.0, 1.0);
        if let Some((center, gaze, measured)) = self.head {
            let ([x, y], [u, v]) = (at(center), at(gaze));
            let dashes = if measured { "" } else { " stroke-dasharray='3 4'" };
            let _ = write!(
                svg,
                "<circle cx='{x:.0}' cy='{y:.0}' r='{:.0}' stroke='{c}' stroke-width='2' fill='none'{dashes}/>\
                 <path d='M{x:.0} {y:.0}L{u:.0} {v:.0}' stroke='{c}' stroke-width='2' fill='none'{dashes}/>",
                0.1 * SCALE,
                c = self.colour
            );
        }
        line(svg, right_arm, 6.0, 1.0);
        for (arm, opacity) in [(left_arm, far), (right_arm, 1.0)] {
            for &joint in arm {
                let [x, y] = at(joint);
                let _ = write!(
                    svg,
                    "<circle cx='{x:.0}' cy='{y:.0}' r='4' fill='white' stroke='{}' stroke-width='2' \
                     stroke-opacity='{opacity}'/>",
                    self.colour
                );
            }
        }
        for &dot in &self.dots {
            let [x, y] = at(dot);
            let _ = write!(svg, "<circle cx='{x:.0}' cy='{y:.0}' r='1.6' fill='#1f2933'/>");
        }
    }
}

/// A word in the middle of a field.
pub fn label(text: &str, middle: f64, y: f64, colour: &str, svg: &mut String) {
    let _ = write!(
        svg,
        "<text x='{middle:.0}' y='{y:.0}' text-anchor='middle' font-family='system-ui,sans-serif' font-size='14' \
         fill='{colour}'>{text}</text>"
    );
}
