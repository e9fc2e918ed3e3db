//! A short film: person and robot as sticks, from the front and from the side.

use super::page::Page;
use super::scene::{Example, Scene};
use super::stick_figure::{Figure, HEIGHT, View, WIDTH, label};
use phiw_bspline_retarget::human::{JointMode, Segment, Side};
use phiw_bspline_retarget::markers::MarkerRecording;
use phiw_bspline_retarget::robot::RobotModel;
use phiw_bspline_retarget::{RetargetOptions, Retargeted, Retargeter};
use phiw_dynamics::{Placement, Vec3};
use phiw_report::plot::{BoxGroup, BoxPlot, box_plot};
use std::fmt::Write;

/// Pictures in a second.
const PICTURES_PER_S: f64 = 12.5;
/// Colours of the person and of the robot.
const PERSON: &str = "#1864ab";
const ROBOT: &str = "#d9480f";
/// Moments that are shown side by side.
const MOMENTS: usize = 6;

/// Retargets an example with the torso following the reach, and draws it.
///
/// # Errors
/// The motion cannot be read or retargeted.
pub fn draw(scene: &Scene, seed: u64, page: &mut Page) -> anyhow::Result<()> {
    let options = RetargetOptions { torso_from_reach: true, ..RetargetOptions::default() };
    let Example { retargeter, recording, calibration, name } = scene.example(seed, options)?;
    let motion = retargeter.retarget(&recording, calibration.as_ref())?;
    page.heading(&format!("{name}: person and robot"));
    let mut stage = Stage::new(&retargeter, &recording, &motion)?;
    let pictures = (motion.frames as f64 / motion.rate_hz * PICTURES_PER_S) as usize;
    let mut frames: Vec<String> = Vec::new();
    for picture in 0..pictures {
        let t = picture as f64 / PICTURES_PER_S;
        let figures = stage.at(t)?;
        let mut svg = String::new();
        for (place, view) in [View::Front, View::Right].into_iter().enumerate() {
            for (index, figure) in figures.iter().enumerate() {
                figure.draw(view, (2 * place + index) as f64 * WIDTH, &mut svg);
            }
        }
        label(&format!("{t:.1} s"), 2.0 * WIDTH, HEIGHT - 10.0, "#52606d", &mut svg);
        frames.push(svg);
    }
    let head = if stage.head_measured {
        ""
    } else {
        "; the person's head is dashed, since the recording holds no marker on it"
    };
    page.picture(
        &film(&frames),
        &format!(
            "The person as the model that was fitted to the markers (dots), and the robot, at one scale, shoulders at one height. From the \
             side the far arm is paler. The robot's torso and head follow the reach of its hands{head}."
        ),
    );
    let moments =
        stage.moments()?.into_iter().map(|t| stage.moment(t)).collect::<anyhow::Result<Vec<String>>>()?;
    page.picture(
        &strip(&moments),
        "Moments of it, from the front, between which the robot's hands go equally far.",
    );
    page.picture(&positions(&motion), "Where each joint of the robot is over the motion.");
    Ok(())
}

/// What is drawn from: both seen from their shoulders at the beginning, looking ahead.
struct Stage<'a> {
    robot: &'a RobotModel,
    recording: &'a MarkerRecording,
    motion: &'a Retargeted,
    parameters: Vec<f64>,
    head_measured: bool,
    placements: Vec<Placement<f64>>,
    /// Middle of the shoulders, and cosine and sine of where the person looks.
    person_origin: [f64; 3],
    heading: [f64; 2],
    robot_origin: [f64; 3],
}

impl<'a> Stage<'a> {
    fn new(
        retargeter: &'a Retargeter,
        recording: &'a MarkerRecording,
        motion: &'a Retargeted,
    ) -> anyhow::Result<Self> {
        let robot = retargeter.robot();
        let mut stage = Stage {
            robot,
            recording,
            motion,
            parameters: motion.parameters.iter().map(|&(_, value)| value).collect(),
            head_measured: retargeter.map().mode(Segment::Head) != JointMode::Held,
            placements: vec![Placement::identity(); robot.tree().bodies().len()],
            person_origin: [0.0; 3],
            heading: [1.0, 0.0],
            robot_origin: [0.0; 3],
        };
        let [left, right] = stage.sticks(0.0, [Side::Left, Side::Right].map(Segment::UpperArm)).map(|s| s[0]);
        let across = [left[0] - right[0], left[1] - right[1]];
        let length = f64::hypot(across[0], across[1]).max(1e-9);
        // Left is y.
        stage.heading = [across[1] / length, -across[0] / length];
        stage.person_origin = middle(left, right);
        stage.place_robot(0.0)?;
        let [left, right] = robot.arms().map(|arm| robot.place(arm.shoulder, &stage.placements).0);
        stage.robot_origin = middle(left, right);
        Ok(stage)
    }

    /// Person and robot.
    fn at(&mut self, t: f64) -> anyhow::Result<[Figure; 2]> {
        self.place_robot(t)?;
        Ok([self.person(t), self.robot()])
    }

    /// Times between which the robot's hands go equally far: where nothing moves there is nothing to see.
    fn moments(&mut self) -> anyhow::Result<Vec<f64>> {
        let frames = self.motion.frames;
        let (mut ways, mut before) = (vec![0.0], None);
        for frame in 0..frames {
            self.place_robot(frame as f64 / self.motion.rate_hz)?;
            let hands = self.robot.arms().map(|arm| self.robot.place(arm.hand, &self.placements));
            if let Some(before) = before.replace(hands) {
                let [left, right] = [0, 1].map(|hand| hands[hand] - before[hand]);
                let way = ways[frame - 1] + left.dot(left).sqrt() + right.dot(right).sqrt();
                ways.push(way);
            }
        }
        let whole = ways.last().copied().unwrap_or(0.0);
        let moment = |moment: usize| {
            let way = moment as f64 / (MOMENTS - 1) as f64 * whole;
            ways.partition_point(|&gone| gone < way).min(frames.saturating_sub(1)) as f64
                / self.motion.rate_hz
        };
        Ok((0..MOMENTS).map(moment).collect())
    }

    /// Both from the front, with the time.
    fn moment(&mut self, t: f64) -> anyhow::Result<String> {
        let mut svg = String::new();
        for (index, figure) in self.at(t)?.iter().enumerate() {
            figure.draw(View::Front, index as f64 * WIDTH, &mut svg);
        }
        label(&format!("{t:.1} s"), WIDTH, HEIGHT - 10.0, "#52606d", &mut svg);
        Ok(svg)
    }

    fn sticks<const N: usize>(&self, t: f64, segments: [Segment; N]) -> [[[f64; 3]; 2]; N] {
        let human = &self.motion.human;
        let mut coordinates = vec![0.0; human.dimension()];
        human.evaluate(0, t, &mut vec![0.0; human.basis().degree() + 1], &mut coordinates);
        let sticks = self.motion.body.sticks(&coordinates, &self.parameters);
        segments.map(|segment| sticks[segment.index()])
    }

    fn person(&self, t: f64) -> Figure {
        use Segment::{Chest, Forearm, Hand, Head, Neck, Pelvis, UpperArm};
        let see = |point| self.seen_from_person(point);
        let [pelvis, chest, neck, head] = self.sticks(t, [Pelvis, Chest, Neck, Head]);
        let arm = |side| {
            let [upper, fore, hand] = self.sticks(t, [UpperArm(side), Forearm(side), Hand(side)]);
            [upper[0], fore[0], hand[0], hand[1]].map(see).to_vec()
        };
        let frame = ((t * self.motion.rate_hz) as usize).min(self.recording.frames() - 1);
        let markers = self.motion.body.markers().into_iter();
        let seen = markers.map(|marker| self.recording.position_m(frame, marker.recorded));
        let ahead = std::array::from_fn(|axis| 2.0 * head[1][axis] - head[0][axis]);
        Figure {
            colour: PERSON,
            trunk: [pelvis[0], chest[0], chest[1], neck[1]].map(see).to_vec(),
            arms: [arm(Side::Left), arm(Side::Right)],
            head: Some((see(middle(head[0], head[1])), see(ahead), self.head_measured)),
            dots: seen.filter(|position| position[0].is_finite()).map(see).collect(),
        }
    }

    fn seen_from_person(&self, point: [f64; 3]) -> [f64; 3] {
        let [cosine, sine] = self.heading;
        let [x, y, z] = [0, 1, 2].map(|axis| point[axis] - self.person_origin[axis]);
        [cosine * x + sine * y, cosine * y - sine * x, z]
    }

    fn place_robot(&mut self, t: f64) -> anyhow::Result<()> {
        let robot = &self.motion.robot;
        let mut q = vec![0.0; robot.dimension()];
        robot.evaluate(0, t, &mut vec![0.0; robot.basis().degree() + 1], &mut q);
        self.robot.tree().forward_kinematics(&q, &mut self.placements)?;
        Ok(())
    }

    fn robot(&self) -> Figure {
        let see = |point| {
            let place = self.robot.place(point, &self.placements) - Vec3(self.robot_origin);
            place.0
        };
        let arms = self.robot.arms();
        let [left, right] = arms.map(|arm| see(arm.shoulder));
        let gaze = self.robot.gaze().map(|ends| ends.map(see));
        let mut trunk: Vec<[f64; 3]> = self.robot.trunk().map(|ends| see(ends[0])).into_iter().collect();
        trunk.push(middle(left, right));
        trunk.extend(gaze.map(|[head, _]| head));
        Figure {
            colour: ROBOT,
            trunk,
            arms: arms.map(|arm| [arm.shoulder, arm.elbow, arm.wrist, arm.hand].map(see).to_vec()),
            // The point ahead is further than a face is deep.
            head: gaze.map(|[head, ahead]| {
                (head, std::array::from_fn(|a| head[a] + 0.6 * (ahead[a] - head[a])), true)
            }),
            dots: Vec::new(),
        }
    }
}

fn middle(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|axis| 0.5 * (a[axis] + b[axis]))
}

/// All pictures on top of each other, each shown for its moment.
fn film(frames: &[String]) -> String {
    let duration = frames.len() as f64 / PICTURES_PER_S;
    let mut svg =
        format!("<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 {:.0} {HEIGHT:.0}'>", 4.0 * WIDTH);
    for (place, view) in ["from the front", "from its right"].into_iter().enumerate() {
        let left = 2.0 * place as f64 * WIDTH;
        label("person", left + 0.5 * WIDTH, 20.0, PERSON, &mut svg);
        label("robot", left + 1.5 * WIDTH, 20.0, ROBOT, &mut svg);
        label(view, left + WIDTH, 38.0, "#52606d", &mut svg);
    }
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

/// Moments side by side, in rows of three, for paper.
fn strip(moments: &[String]) -> String {
    let (across, rows) = (3, moments.len().div_ceil(3));
    let [width, height] = [2.0 * WIDTH * across as f64, HEIGHT * rows as f64];
    let mut svg = format!("<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 {width:.0} {height:.0}'>");
    for (index, moment) in moments.iter().enumerate() {
        let [x, y] = [(index % across) as f64 * 2.0 * WIDTH, (index / across) as f64 * HEIGHT];
        let _ = write!(svg, "<g transform='translate({x:.0} {y:.0})'>{moment}</g>");
    }
    label("person", 0.5 * WIDTH, 20.0, PERSON, &mut svg);
    label("robot", 1.5 * WIDTH, 20.0, ROBOT, &mut svg);
    svg.push_str("</svg>");
    svg
}

/// The positions of each joint of the robot as boxes.
fn positions(motion: &Retargeted) -> String {
    let mut scratch = vec![0.0; motion.robot.basis().degree() + 1];
    let mut samples = vec![Vec::new(); motion.robot.dimension()];
    let mut q = vec![0.0; motion.robot.dimension()];
    for frame in (0..motion.frames).step_by(5) {
        motion.robot.evaluate(0, frame as f64 / motion.rate_hz, &mut scratch, &mut q);
        samples.iter_mut().zip(&q).for_each(|(samples, &value)| samples.push(value));
    }
    let places: Vec<String> = (1..=samples.len()).map(|joint| joint.to_string()).collect();
    let groups = [BoxGroup { name: "positions", samples: &samples }];
    let plot = BoxPlot {
        groups: &groups,
        places: &places,
        x_label: "joint",
        y_label: "position [rad]",
        logarithmic: false,
    };
    box_plot(&plot).as_str().to_owned()
}
