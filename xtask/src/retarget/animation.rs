//! A short film: person and robot as sticks, from the front and from the side.

use super::page::Page;
use super::{Example, Scene};
use phiw_bspline_retarget::RetargetOptions;
use phiw_dynamics::Placement;
use phiw_report::plot::{BoxGroup, BoxPlot, box_plot};
use std::fmt::Write;

/// Pictures in a second.
const PICTURES_PER_S: f64 = 12.5;
/// Pixels for a metre.
const SCALE: f64 = 210.0;

/// Retargets an example with the torso following the reach, and draws it.
///
/// # Errors
/// The motion cannot be read or retargeted.
pub fn draw(scene: &Scene, seed: u64, page: &mut Page) -> anyhow::Result<()> {
    let options = RetargetOptions { torso_from_reach: true, ..RetargetOptions::default() };
    let Example { retargeter, recording, calibration, name } = scene.example(seed, options)?;
    let motion = retargeter.retarget(&recording, calibration.as_ref())?;
    page.heading(&format!("{name}: markers and robot"));
    let pictures = (motion.frames as f64 / motion.rate_hz * PICTURES_PER_S) as usize;
    let tree = retargeter.robot().tree();
    let mut placements = vec![Placement::identity(); tree.bodies().len()];
    let (mut q, mut scratch) = (vec![0.0; tree.joint_count()], vec![0.0; motion.robot.basis().degree() + 1]);
    let center = recording_center(&recording);
    let heading = heading(&recording);
    let mut frames: Vec<String> = Vec::new();
    for picture in 0..pictures {
        let t = picture as f64 / PICTURES_PER_S;
        motion.robot.evaluate(0, t, &mut scratch, &mut q);
        tree.forward_kinematics(&q, &mut placements)?;
        let mut svg = String::new();
        for (view, left) in [(View::Front, 0.0), (View::Side, 400.0)] {
            // The person's markers stand beside the robot, at the same height.
            let frame = ((t * motion.rate_hz) as usize).min(recording.frames() - 1);
            for marker in 0..recording.labels.len() {
                let position = recording.position_m(frame, marker);
                if position[0].is_finite() {
                    let [x, y] = view.project(turned(position, center, heading));
                    let _ =
                        write!(svg, "<circle cx='{:.0}' cy='{:.0}' r='2.5'/>", left + 100.0 + x, 150.0 - y);
                }
            }
            let mut path = String::new();
            let origin = |body: usize| placements[body].translation.0;
            let segments = tree.bodies().iter().enumerate().map(|(index, body)| match body.parent {
                Some(parent) => (origin(parent), origin(index)),
                None => ([0.0; 3], origin(index)),
            });
            let hands = retargeter.robot().arms().iter().filter_map(|arm| {
                let body = arm.hand.body?;
                Some((origin(body), placements[body].point(arm.hand.local).0))
            });
            for (from, to) in segments.chain(hands) {
                let [a, b] = [from, to].map(|[x, y, z]| view.project([x, y, z - 1.2]));
                let (x, y) = (left + 280.0, 150.0);
                let _ = write!(path, "M{:.0} {:.0}L{:.0} {:.0}", x + a[0], y - a[1], x + b[0], y - b[1]);
            }
            let _ = write!(
                svg,
                "<path d='{path}' stroke='#2a6' stroke-width='5' stroke-linecap='round' fill='none'/>"
            );
        }
        frames.push(svg);
    }
    page.picture(
        &film(&frames),
        "markers of the person (dots) and the robot (lines): from the front, from the left",
    );
    strip(&frames, page);
    // Joint positions over time say whether it is smooth, too.
    let peaks: Vec<Vec<f64>> = (0..tree.joint_count())
        .map(|joint| {
            (0..motion.frames)
                .step_by(5)
                .map(|frame| {
                    motion.robot.evaluate(0, frame as f64 / motion.rate_hz, &mut scratch, &mut q);
                    q[joint]
                })
                .collect()
        })
        .collect();
    let places: Vec<String> = (1..=peaks.len()).map(|joint| joint.to_string()).collect();
    let groups = [BoxGroup { name: "positions", samples: &peaks }];
    let plot = BoxPlot {
        groups: &groups,
        places: &places,
        x_label: "joint",
        y_label: "position [rad]",
        logarithmic: false,
    };
    page.picture(box_plot(&plot).as_str(), "where each joint of the robot is over the motion");
    Ok(())
}

/// Six moments side by side, for paper.
fn strip(frames: &[String], page: &mut Page) {
    let mut svg = String::from("<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 2400 320'>");
    for moment in 0..6 {
        let frame = &frames[moment * (frames.len().max(1) - 1) / 5];
        let _ = write!(
            svg,
            "<svg x='{}' width='400' height='320' viewBox='0 0 400 320'>{frame}</svg>",
            400 * moment
        );
    }
    svg.push_str("</svg>");
    page.picture(&svg, "six moments of it, from the front");
}

/// All pictures on top of each other, each shown for its moment.
fn film(frames: &[String]) -> String {
    let duration = frames.len() as f64 / PICTURES_PER_S;
    let mut svg = String::from("<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 800 320'>");
    for (index, frame) in frames.iter().enumerate() {
        let [from, to] = [index, index + 1].map(|index| index as f64 / frames.len() as f64);
        let shown = match index {
            0 => format!("values='visible;hidden' keyTimes='0;{to:.5}'"),
            _ => format!("values='hidden;visible;hidden' keyTimes='0;{from:.5};{to:.5}'"),
        };
        let first = if index == 0 { "visible" } else { "hidden" };
        let _ = write!(
            svg,
            "<g visibility='{first}'><animate attributeName='visibility' calcMode='discrete' {shown} dur='{duration:.2}s' \
             repeatCount='indefinite'/>{frame}</g>"
        );
    }
    svg.push_str("</svg>");
    svg
}

enum View {
    Front,
    Side,
}

impl View {
    /// Right and up \[pixels\], x forward, y left, z up.
    fn project(&self, [x, y, z]: [f64; 3]) -> [f64; 2] {
        match self {
            View::Front => [SCALE * y, SCALE * z],
            View::Side => [SCALE * x, SCALE * z],
        }
    }
}

/// The middle of all markers in the first frame that shows any.
fn recording_center(recording: &phiw_bspline_retarget::MarkerRecording) -> [f64; 3] {
    let (mut sum, mut count) = ([0.0; 3], 0.0);
    for position in recording.positions_m.iter().filter(|position| position[0].is_finite()) {
        (0..3).for_each(|axis| sum[axis] += position[axis]);
        count += 1.0;
    }
    sum.map(|sum| sum / f64::max(count, 1.0))
}

/// Cosine and sine of the angle that the person is turned: markers whose names begin with L are to the left.
fn heading(recording: &phiw_bspline_retarget::MarkerRecording) -> [f64; 2] {
    let mut across = [0.0; 2];
    for frame in 0..recording.frames() {
        for (marker, label) in recording.labels.iter().enumerate() {
            let sign = match label.chars().next() {
                Some('L') => 1.0,
                Some('R') => -1.0,
                _ => continue,
            };
            let position = recording.position_m(frame, marker);
            if position[0].is_finite() {
                (0..2).for_each(|axis| across[axis] += sign * position[axis]);
            }
        }
    }
    let length = f64::hypot(across[0], across[1]).max(1e-9);
    // Left is y.
    [across[1] / length, -across[0] / length]
}

fn turned(position: [f64; 3], center: [f64; 3], [cosine, sine]: [f64; 2]) -> [f64; 3] {
    let [x, y, z] = [0, 1, 2].map(|axis| position[axis] - center[axis]);
    [cosine * x + sine * y, cosine * y - sine * x, z]
}
