//! From a recording to a motion of the robot: calibration, start, solution, quality.

use crate::artefacts::Artefact;
use crate::bspline::{Basis, Curve};
use crate::human::{HumanBody, MarkerMap, Placed};
use crate::human_start::human_start;
use crate::marker_settings::MarkerSettings;
use crate::quality::{Quality, quality};
use crate::reading::read_recording;
use crate::recording::{MarkerRecording, RecordingError};
use crate::retarget_error::{RetargetError, check_near};
use crate::robot::{RobotError, RobotModel};
use crate::robot_start::robot_start;
use crate::solver::{Iterations, Solution, Stop, solve};
use crate::start::{align, start};
use crate::weights::{Cost, Weights};
use crate::{Calibration, Problem};
use phiw_dynamics::{Tree, Vec3};
use phiw_limits::Limits;
use std::collections::BTreeMap;
use std::path::Path;

/// How recordings are retargeted.
#[derive(Clone, Debug, PartialEq)]
pub struct RetargetOptions {
    /// Time between control points \[s\]. The paper's 0.2.
    pub interval_s: f64,
    /// Degree of the splines.
    pub degree: usize,
    /// Weights of the objective.
    pub weights: Weights,
    /// When the solver stops.
    pub iterations: Iterations,
    /// Whether torso and head of the robot follow the reach and gaze of the hands instead of the person's:
    /// for recordings that hold none of them.
    pub torso_from_reach: bool,
    /// The largest RMS distance \[m\] of the markers from the person that is still a fit. The worst of 302
    /// recordings has 0.0098 (`cargo xtask retarget databases`).
    pub largest_marker_rms_m: f64,
    /// Which samples of markers are taken for no measurements.
    pub markers: MarkerSettings,
}

impl Default for RetargetOptions {
    fn default() -> Self {
        RetargetOptions {
            interval_s: 0.2,
            degree: 3,
            weights: Weights::default(),
            iterations: Iterations::default(),
            torso_from_reach: false,
            largest_marker_rms_m: 0.1,
            markers: MarkerSettings::default(),
        }
    }
}

/// How much sooner the person alone is found than all of it: it is a start.
const ROUGH: f64 = 10.0;

/// A robot and a marker map: turns recordings into motions of the robot.
#[derive(Clone, Debug)]
pub struct Retargeter {
    map: MarkerMap,
    robot: RobotModel,
    options: RetargetOptions,
}

/// A person in one recording, as the markers alone tell.
#[derive(Clone, Debug)]
pub struct Person {
    /// The human model, markers in place.
    pub body: HumanBody,
    basis: Basis,
    /// Control points of the human's coordinates.
    control: Vec<f64>,
    parameters: Vec<f64>,
    steps: usize,
}

impl Person {
    /// Variables of the problem with the robot at rest.
    fn variables(&self, problem: &Problem<'_>) -> Vec<f64> {
        let (n, humans) = (problem.coordinates(), self.body.trajectories());
        let mut variables = problem.rest();
        let tail = variables.len() - self.parameters.len();
        for (point, human) in
            variables[..tail].chunks_exact_mut(n).zip(self.control.chunks_exact(humans.max(1)))
        {
            point[..humans].copy_from_slice(human);
        }
        variables[tail..].copy_from_slice(&self.parameters);
        variables
    }
}

/// A motion of the robot, and of the person it comes from.
#[derive(Clone, Debug)]
pub struct Retargeted {
    /// The robot's joints over time \[rad, m\], from the recording's first frame on.
    pub robot: Curve,
    /// The human's coordinates over time, in the order of `human_names`.
    pub human: Curve,
    /// Names of the human's coordinates.
    pub human_names: Vec<String>,
    /// The human model, markers in place.
    pub body: HumanBody,
    /// Parameters ξ^h by name \[m, rad\].
    pub parameters: Vec<(String, f64)>,
    /// The objective's value.
    pub cost: Cost,
    /// Steps of the solver.
    pub iterations: usize,
    /// Why it stopped.
    pub stop: Stop,
    /// How good the motion is.
    pub quality: Quality,
    /// Frames of the recording.
    pub frames: usize,
    /// Frames per second \[Hz\].
    pub rate_hz: f64,
}

impl Retargeted {
    /// Time between two samples \[s\]: the recording's.
    pub fn period_s(&self) -> f64 {
        1.0 / self.rate_hz
    }

    /// Positions \[rad, m\], velocities and accelerations of the robot at the recording's frames, row-major
    /// `[frame × joint]`: what a log of the motion, or a motion to choose from, is made of.
    pub fn signals(&self) -> [Vec<f64>; 3] {
        let joints = self.robot.dimension();
        let mut scratch = vec![0.0; self.robot.basis().degree() + 1];
        let mut signals = [0; 3].map(|_| vec![0.0; self.frames * joints]);
        for (order, signal) in signals.iter_mut().enumerate() {
            for (frame, values) in signal.chunks_exact_mut(joints.max(1)).enumerate() {
                self.robot.evaluate(order, frame as f64 / self.rate_hz, &mut scratch, values);
            }
        }
        signals
    }
}

impl Retargeter {
    /// Takes a robot and a map together.
    ///
    /// # Errors
    /// [`RobotError`]: the robot's base floats, or it has no two arms.
    pub fn new(tree: Tree, map: MarkerMap, options: RetargetOptions) -> Result<Self, RobotError> {
        Ok(Retargeter { robot: RobotModel::new(tree, &map.robot)?, map, options })
    }

    /// The robot.
    pub fn robot(&self) -> &RobotModel {
        &self.robot
    }
    /// The map.
    pub fn map(&self) -> &MarkerMap {
        &self.map
    }
    /// The options.
    pub fn options(&self) -> &RetargetOptions {
        &self.options
    }

    /// Reads a recording, a motion or a static trial, in the map's unit; what is no measurement is taken out,
    /// and comes back as a list.
    ///
    /// # Errors
    /// [`RecordingError`]: the file cannot be read, or the map's markers are no person's by
    /// [`MarkerSettings::person_m`].
    pub fn read(&self, path: &Path) -> Result<(MarkerRecording, Vec<Artefact>), RecordingError> {
        let mut recording = read_recording(path, self.map.units.as_deref())?;
        let (markers, settings) = (self.map.markers(&recording), &self.options.markers);
        let artefacts = recording.remove_artefacts(&markers, settings);
        match recording.extent_m(&markers) {
            Some(extent_m) if !settings.person_m.contains(&extent_m) => {
                let person_m = settings.person_m.clone();
                Err(RecordingError::Extent { path: path.to_owned(), extent_m, person_m })
            }
            _ => Ok((recording, artefacts)),
        }
    }

    /// Where most of the map's markers are frozen there is no motion, whatever the others do.
    fn check_moves(&self, recording: &MarkerRecording) -> Result<(), RetargetError> {
        let (markers, settings) = (self.map.markers(recording), &self.options.markers);
        if !recording.is_still(&markers, settings) {
            return Ok(());
        }
        let seen = markers.iter().filter(|&&marker| recording.is_ever_seen(marker)).count();
        Err(RetargetError::Frozen { frozen: recording.frozen(&markers, settings).len(), seen })
    }

    /// Calibrates on a static trial: the lengths and the pose that fit the markers whose place the map gives,
    /// and from them the places of all.
    ///
    /// # Errors
    /// The map does not fit the recording.
    pub fn calibrate(&self, recording: &MarkerRecording) -> Result<Calibration, RetargetError> {
        let mean = mean_frame(recording);
        let map = self.firm_map();
        let body = HumanBody::new(&map, &mean, &BTreeMap::new(), None, true, 0)?;
        // A pose is a spline of degree 0 with one control point.
        let basis = Basis::clamped(0, 1, 0.0, 1.0)?;
        let problem = Problem::new(&body, None, &mean, basis, self.options.weights);
        let mut first = problem.rest();
        align(&problem, &mut first);
        let solution = solve(&problem, first, &self.options.iterations);
        let mut scratch = body.kinematics.scratch::<f64>();
        body.kinematics.place(&solution.variables, &mut scratch);
        let mut markers = BTreeMap::new();
        for (name, segments) in map.segments.iter() {
            let Some(segment) = crate::human::Segment::from_name(name) else { continue };
            let node = body.segment_nodes[segment.index()];
            let names = segments.cluster.iter().chain(segments.at.keys()).chain(segments.at_end.keys());
            for name in names {
                let seen = Vec3(mean.position_m(0, map.find(name, &mean)?));
                let (rotation, origin) =
                    (body.kinematics.rotation(node, &scratch), body.kinematics.origin(node, &scratch));
                let local = rotation.transpose_mul(seen - origin);
                markers.insert(name.clone(), Placed { segment, from_end: false, local_m: local.0 });
            }
        }
        let lengths = crate::human::SEGMENT_PARAMETERS.len();
        let coordinates = body.parameters.iter().zip(&solution.variables).skip(lengths);
        Ok(Calibration {
            markers,
            lengths_m: solution.variables[..lengths].to_vec(),
            pose: coordinates.map(|(coordinate, &value)| (coordinate.name.clone(), value)).collect(),
            marker_rms_m: (solution.cost.markers / body.markers.len() as f64).sqrt(),
        })
    }

    /// The spline basis for a recording: control points every `interval_s`.
    ///
    /// # Errors
    /// The recording is too short, or so long that its control points exceed [`Limits`].
    pub fn basis(&self, recording: &MarkerRecording) -> Result<Basis, RetargetError> {
        if recording.frames() < 2 {
            return Err(RetargetError::TooShort(recording.frames()));
        }
        let duration = recording.duration_s();
        let spans = (duration / self.options.interval_s).round().max(1.0);
        let most = Limits::default().control_points;
        if spans > most.saturating_sub(self.options.degree) as f64 {
            let (duration_s, interval_s) = (duration, self.options.interval_s);
            return Err(RetargetError::TooManyControlPoints { duration_s, interval_s, most });
        }
        let spans = spans as usize;
        Ok(Basis::uniform(self.options.degree, spans + self.options.degree, 0.0, duration)?)
    }

    /// The person of a recording, by the markers alone: places of markers that shift are estimated here, and
    /// held from then on.
    ///
    /// # Errors
    /// The map does not fit the recording, or this is too short.
    pub fn person(
        &self,
        recording: &MarkerRecording,
        calibration: Option<&Calibration>,
    ) -> Result<Person, RetargetError> {
        let none = BTreeMap::new();
        let markers = calibration.map_or(&none, |calibration| &calibration.markers);
        let lengths = calibration.map(|calibration| &calibration.lengths_m[..]);
        let alone = HumanBody::new(&self.map, recording, markers, lengths, false, 0)?;
        let basis = self.basis(recording)?;
        let problem = Problem::new(&alone, None, recording, basis.clone(), self.options.weights);
        let first = self.followed(recording, calibration, &problem)?;
        let rough =
            Iterations { tolerance: ROUGH * self.options.iterations.tolerance, ..self.options.iterations };
        let solution = solve(&problem, first, &rough);
        let (control, parameters) =
            solution.variables.split_at(alone.trajectories() * basis.control_points());
        // Markers of the static trial alone keep their places, by name.
        let mut markers = markers.clone();
        markers.extend(alone.markers_placed(parameters));
        let map = self.firm_map();
        let joints = self.robot.tree().joint_count();
        let body = HumanBody::new(&map, recording, &markers, lengths, false, joints)?;
        // Places come last.
        let kept = body.parameters();
        Ok(Person {
            basis,
            control: control.to_vec(),
            parameters: parameters[..kept].to_vec(),
            steps: solution.iterations,
            body,
        })
    }

    /// Variables of a person's problem with the markers followed pose by pose, as if they sat where they are
    /// known to.
    fn followed(
        &self,
        recording: &MarkerRecording,
        calibration: Option<&Calibration>,
        problem: &Problem<'_>,
    ) -> Result<Vec<f64>, RetargetError> {
        let none = BTreeMap::new();
        let markers = calibration.map_or(&none, |calibration| &calibration.markers);
        let lengths = calibration.map(|calibration| &calibration.lengths_m[..]);
        let firm = HumanBody::new(&self.firm_map(), recording, markers, lengths, false, 0)?;
        let basis = problem.basis().clone();
        let firm = Problem::new(&firm, None, recording, basis, self.options.weights);
        let mut variables = human_start(&firm, start(&firm, calibration));
        // Places come last.
        let places = &problem.body.parameters[firm.body.parameters()..];
        variables.extend(places.iter().map(|place| place.mean));
        Ok(variables)
    }

    /// The map with markers that do not shift.
    fn firm_map(&self) -> MarkerMap {
        MarkerMap { marker_spread_m: 0.0, ..self.map.clone() }
    }

    /// Problem (15) of a person's recording.
    pub fn problem<'a>(&'a self, person: &'a Person, recording: &MarkerRecording) -> Problem<'a> {
        Problem::new(&person.body, Some(&self.robot), recording, person.basis.clone(), self.options.weights)
    }

    /// Where the solver starts: the person as the markers alone tell, and the robot after it, pose by pose.
    pub fn start(&self, problem: &Problem<'_>, person: &Person) -> Vec<f64> {
        robot_start(problem, &self.robot, person.variables(problem))
    }

    /// Everything at rest, or the human in the static trial's pose, where the markers are: a start that knows
    /// nothing of the motion.
    pub fn placed_at_rest(&self, problem: &Problem<'_>, calibration: Option<&Calibration>) -> Vec<f64> {
        start(problem, calibration)
    }

    /// Turns a recording into a motion of the robot.
    ///
    /// # Errors
    /// The map does not fit the recording, or nothing fits the markers.
    pub fn retarget(
        &self,
        recording: &MarkerRecording,
        calibration: Option<&Calibration>,
    ) -> Result<Retargeted, RetargetError> {
        self.check_moves(recording)?;
        let person = self.person(recording, calibration)?;
        let mut problem = self.problem(&person, recording);
        if self.options.torso_from_reach {
            let human = person.variables(&problem);
            for (correspondence, vectors) in crate::reach::targets(&problem, &self.robot, &human) {
                problem.set_target(correspondence, vectors);
            }
        }
        let first = self.start(&problem, &person);
        let mut solution = solve(&problem, first, &self.options.iterations);
        solution.iterations += person.steps;
        if !solution.cost.total().is_finite() {
            return Err(RetargetError::NoFit(solution.cost.total()));
        }
        let motion = self.retargeted(&problem, recording, solution)?;
        check_near(&motion.quality, self.options.largest_marker_rms_m)?;
        Ok(motion)
    }

    /// Puts the solver's numbers into curves and judges them.
    fn retargeted(
        &self,
        problem: &Problem<'_>,
        recording: &MarkerRecording,
        solution: Solution,
    ) -> Result<Retargeted, RetargetError> {
        let (n, humans) = (problem.coordinates(), problem.body.trajectories.len());
        let control_points = problem.basis().control_points();
        let (control, parameters) = solution.variables.split_at(n * control_points);
        let part = |range: std::ops::Range<usize>| -> Vec<f64> {
            control.chunks_exact(n).flat_map(|point| point[range.clone()].iter().copied()).collect()
        };
        let basis = problem.basis();
        let robot = Curve::new(basis.clone(), n - humans, part(humans..n))?;
        Ok(Retargeted {
            quality: quality(problem, &self.robot, &robot, &solution.variables),
            robot,
            human: Curve::new(basis.clone(), humans, part(0..humans))?,
            body: problem.body.clone(),
            human_names: problem.body.trajectory_names().map(str::to_owned).collect(),
            parameters: problem
                .body
                .parameter_names()
                .map(str::to_owned)
                .zip(parameters.iter().copied())
                .collect(),
            cost: solution.cost,
            iterations: solution.iterations,
            stop: solution.stop,
            frames: recording.frames(),
            rate_hz: recording.rate_hz,
        })
    }
}

/// The mean of each marker over the frames that show it, as a recording of one frame.
fn mean_frame(recording: &MarkerRecording) -> MarkerRecording {
    let mean = |marker: usize| {
        let (mut sum, mut count) = (Vec3([0.0; 3]), 0.0);
        for frame in 0..recording.frames() {
            let position = recording.position_m(frame, marker);
            if position[0].is_finite() {
                sum += Vec3(position);
                count += 1.0;
            }
        }
        // A marker that no frame shows gets 0/0 = NaN, which means missing.
        sum.0.map(|coordinate| coordinate / count)
    };
    MarkerRecording {
        rate_hz: recording.rate_hz,
        labels: recording.labels.clone(),
        positions_m: (0..recording.labels.len()).map(mean).collect(),
    }
}
