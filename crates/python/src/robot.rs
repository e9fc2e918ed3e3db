//! `phiw.Robot`: a robot from its URDF, and its dynamics over batches of states.

use crate::arrays::{Array, Doubles, Pickled, States, array, same_count};
use crate::batch::{LANES, Lane, put};
use crate::hold::hold;
use crate::kernel::{over_arrays, wrong_size};
use phiw::robot_file::{RobotText, as_urdf};
use phiw_dynamics::inertia::PARAMETER_NAMES;
use phiw_dynamics::inertia::PARAMETERS_PER_BODY;
use phiw_dynamics::scalar::Lanes;
use phiw_dynamics::urdf::{UrdfOptions, UrdfReading, read_urdf};
use phiw_dynamics::{JointLimits, JointType, Tree, Workspace};
use phiw_limits::Limits;
use phiw_regressor::{BaseParameters, BaseParametersOptions, JointTorqueRegressor};
use pulp::Arch;
use pyo3::exceptions::{PyOSError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};
use std::path::PathBuf;

/// A robot, read from a URDF.
///
/// Joints are in depth-first order, as in a URDF's file. Links behind fixed and held joints are part of the
/// link before them. All units are SI: rad, m, s, kg, N, N·m.
///
/// Parameters
/// ----------
/// urdf : str or os.PathLike
///     Path of a URDF, or its text (which begins with ``<``).
/// hold : list or dict, optional
///     Joints that do not move: names, ``"joint=0.5"`` or ``{"joint": 0.5}`` (rad, m), at 0 without a value.
///     In a name, ``*`` stands for any letters and ``?`` for one.
/// floating_base : bool
///     The root link floats: configurations begin with ``x, y, z, qx, qy, qz, qw``, velocities with the
///     base's linear and angular velocity in its own frame. Such a robot has kernels, but is not identified.
#[pyclass(frozen, module = "phiw", name = "Robot")]
pub struct Robot {
    /// The robot as its URDF has it.
    pub tree: Tree,
    /// The URDF's text.
    pub xml: String,
    /// Where it was read.
    pub path: Option<PathBuf>,
    /// What was asked to be held.
    pub hold: Vec<(String, f64)>,
    held: Vec<(String, f64)>,
    findings: Vec<String>,
    floating_base: bool,
    regressor: JointTorqueRegressor,
}

#[pymethods]
impl Robot {
    #[new]
    #[pyo3(signature = (urdf, hold=None, *, floating_base=false))]
    fn new(urdf: &Bound<'_, PyAny>, hold: Option<&Bound<'_, PyAny>>, floating_base: bool) -> PyResult<Self> {
        let hold = self::hold(hold)?;
        match urdf.extract::<String>() {
            Ok(text) if text.trim_start().starts_with('<') => Self::of_text(text, None, hold, floating_base),
            _ => {
                let path: PathBuf = urdf.extract()?;
                let most = Limits::default().urdf_bytes;
                let text = phiw::input::read_text(&path, most)
                    .map_err(|error| PyOSError::new_err(error.to_string()))?;
                Self::of_text(text, Some(path), hold, floating_base)
            }
        }
    }

    /// The robot's name in its URDF.
    #[getter]
    fn name(&self) -> &str {
        self.tree.name()
    }

    /// Names of the joints that move by themselves, in the order of all arrays.
    #[getter]
    fn joints(&self) -> Vec<&str> {
        self.tree.joint_names().collect()
    }

    /// Number of velocity coordinates: of joints, and six more for a floating base.
    #[getter]
    fn dof(&self) -> usize {
        self.tree.velocity_size()
    }

    /// Length of a configuration: `dof`, and one more for a floating base, whose orientation is a quaternion.
    #[getter]
    fn configuration_size(&self) -> usize {
        self.tree.configuration_size()
    }

    /// Names of the links that joints carry, in the order of the parameters.
    #[getter]
    fn links(&self) -> Vec<&str> {
        self.tree.bodies().iter().map(|body| body.link.as_str()).collect()
    }

    /// What each joint is: ``"revolute"``, ``"continuous"`` or ``"prismatic"``.
    #[getter]
    fn joint_types(&self) -> Vec<&'static str> {
        let name = |joint| match self.tree.joint(joint).joint_type {
            JointType::Floating => "floating",
            JointType::Revolute => "revolute",
            JointType::Continuous => "continuous",
            JointType::Prismatic => "prismatic",
        };
        (0..self.tree.joint_count()).map(name).collect()
    }

    /// Limits of the joints: a dict of arrays of one number a joint, ``lower`` and ``upper`` (rad, m),
    /// ``velocity`` (rad/s, m/s) and ``effort`` (N·m, N); infinite where the URDF has none.
    #[getter]
    fn limits<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let limits = PyDict::new(py);
        let joints = self.tree.joint_count();
        let put = |name: &str, of: fn(&JointLimits) -> f64| {
            let numbers = (0..joints).map(|joint| of(&self.tree.joint(joint).limits)).collect();
            limits.set_item(name, array(py, numbers, &[joints])?)
        };
        put("lower", |limits| limits.lower)?;
        put("upper", |limits| limits.upper)?;
        put("velocity", |limits| limits.velocity)?;
        put("effort", |limits| limits.effort)?;
        Ok(limits)
    }

    /// Joints that are held, and where (rad, m).
    #[getter]
    fn held(&self, py: Python<'_>) -> PyResult<Py<PyDict>> {
        let held = PyDict::new(py);
        self.held.iter().try_for_each(|(joint, value)| held.set_item(joint, value))?;
        Ok(held.unbind())
    }

    /// What in the URDF should not be trusted, as sentences.
    #[getter]
    fn findings(&self) -> Vec<String> {
        self.findings.clone()
    }

    /// The URDF's text.
    #[getter]
    fn urdf(&self) -> &str {
        &self.xml
    }

    /// The URDF's inertial parameters, shape (links, 10), each row in the order of ``PARAMETER_NAMES``: mass
    /// (kg), first moments (kg·m), inertia about the joint frame's origin (kg·m²), along its axes.
    #[getter]
    fn inertial_parameters<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        let bodies = self.tree.bodies().len();
        array(py, self.tree.inertial_parameters(), &[bodies, PARAMETERS_PER_BODY])
    }

    /// Names of a link's ten inertial parameters, in their order.
    #[classattr]
    const PARAMETER_NAMES: [&'static str; PARAMETERS_PER_BODY] = PARAMETER_NAMES;

    /// Torques that a motion needs (RNEA), without friction.
    ///
    /// Parameters
    /// ----------
    /// q, qd, qdd : array, shape (N, dof) or (dof,)
    ///     Positions (rad, m), velocities (rad/s, m/s) and accelerations (rad/s², m/s²).
    /// out : array, optional
    ///     Contiguous, of the result's shape: is written to and given back, which saves the system the work
    ///     of finding new memory.
    ///
    /// Returns
    /// -------
    /// array, shape (N, dof) or (dof,)
    ///     Torques (N·m) or forces (N).
    #[pyo3(signature = (q, qd, qdd, *, out=None))]
    fn inverse_dynamics<'py>(
        &self,
        py: Python<'py>,
        q: &Bound<'py, PyAny>,
        qd: &Bound<'py, PyAny>,
        qdd: &Bound<'py, PyAny>,
        out: Option<Array<'py>>,
    ) -> PyResult<Array<'py>> {
        let dof = self.tree.velocity_size();
        let motion = self.motion(q, ("qd", qd), ("qdd", qdd))?;
        over_arrays(
            py,
            motion,
            (&[dof], out),
            || self.scratch(dof),
            |(workspace, torque), [q, v, a], outputs| {
                Arch::new().dispatch(
                    #[inline(always)]
                    || self.tree.inverse_dynamics(q, v, a, workspace, torque),
                )?;
                put(torque, outputs);
                Ok(())
            },
        )
    }

    /// Accelerations under torques (ABA; by way of the mass matrix where joints follow others).
    ///
    /// Parameters
    /// ----------
    /// q, qd, tau : array, shape (N, dof) or (dof,)
    ///     Positions (rad, m), velocities (rad/s, m/s) and torques (N·m, N).
    /// out : array, optional
    ///     Contiguous, of the result's shape: is written to and given back, which saves the system the work
    ///     of finding new memory.
    ///
    /// Returns
    /// -------
    /// array, shape (N, dof) or (dof,)
    ///     Accelerations (rad/s², m/s²); not finite where the robot is singular (massless links).
    #[pyo3(signature = (q, qd, tau, *, out=None))]
    fn forward_dynamics<'py>(
        &self,
        py: Python<'py>,
        q: &Bound<'py, PyAny>,
        qd: &Bound<'py, PyAny>,
        tau: &Bound<'py, PyAny>,
        out: Option<Array<'py>>,
    ) -> PyResult<Array<'py>> {
        let dof = self.tree.velocity_size();
        let motion = self.motion(q, ("qd", qd), ("tau", tau))?;
        over_arrays(
            py,
            motion,
            (&[dof], out),
            || self.scratch(dof),
            |(workspace, acceleration), [q, v, f], outputs| {
                Arch::new().dispatch(
                    #[inline(always)]
                    || self.tree.forward_dynamics(q, v, f, workspace, acceleration),
                )?;
                put(acceleration, outputs);
                Ok(())
            },
        )
    }

    /// The mass matrix (CRBA), symmetric.
    ///
    /// Parameters
    /// ----------
    /// q : array, shape (N, dof) or (dof,)
    ///     Positions (rad, m).
    /// out : array, optional
    ///     Contiguous, of the result's shape: is written to and given back, which saves the system the work
    ///     of finding new memory.
    ///
    /// Returns
    /// -------
    /// array, shape (N, dof, dof) or (dof, dof)
    ///     kg·m² between joints that turn, kg·m and kg where they slide.
    #[pyo3(signature = (q, *, out=None))]
    fn mass_matrix<'py>(
        &self,
        py: Python<'py>,
        q: &Bound<'py, PyAny>,
        out: Option<Array<'py>>,
    ) -> PyResult<Array<'py>> {
        let dof = self.tree.velocity_size();
        let q = [States::of(q, "q", self.tree.configuration_size())?];
        over_arrays(
            py,
            q,
            (&[dof, dof], out),
            || self.scratch(dof * dof),
            |(workspace, matrix), [q], outputs| {
                Arch::new().dispatch(
                    #[inline(always)]
                    || self.tree.mass_matrix(q, workspace, matrix),
                )?;
                put(matrix, outputs);
                Ok(())
            },
        )
    }

    /// The joint torque regressor: what stands before the inertial parameters in the torque, which is
    /// ``regressor @ robot.inertial_parameters.ravel()``.
    ///
    /// Parameters
    /// ----------
    /// q, qd, qdd : array, shape (N, dof) or (dof,)
    ///     Positions (rad, m), velocities (rad/s, m/s) and accelerations (rad/s², m/s²).
    /// out : array, optional
    ///     Contiguous, of the result's shape: is written to and given back, which saves the system the work
    ///     of finding new memory.
    ///
    /// Returns
    /// -------
    /// array, shape (N, dof, 10 · links) or (dof, 10 · links)
    ///     Torque (N·m, N) per unit of each parameter, link by link in the order of ``PARAMETER_NAMES``.
    #[pyo3(signature = (q, qd, qdd, *, out=None))]
    fn joint_torque_regressor<'py>(
        &self,
        py: Python<'py>,
        q: &Bound<'py, PyAny>,
        qd: &Bound<'py, PyAny>,
        qdd: &Bound<'py, PyAny>,
        out: Option<Array<'py>>,
    ) -> PyResult<Array<'py>> {
        let (rows, columns) = (self.regressor.rows(), self.regressor.columns());
        let motion = self.motion(q, ("qd", qd), ("qdd", qdd))?;
        let scratch = || (self.regressor.scratch(), vec![Lanes([0.0; LANES]); self.regressor.buffer_size()]);
        over_arrays(py, motion, (&[rows, columns], out), scratch, |(scratch, pairs), [q, v, a], outputs| {
            self.regressor.compute_lanes(&self.tree, q, v, a, scratch, pairs)?;
            for (lane, phi) in outputs.chunks_exact_mut(rows * columns).enumerate() {
                self.scatter(pairs, lane, phi);
            }
            Ok(())
        })
    }

    /// Which combinations of inertial parameters motion can tell apart.
    ///
    /// Returns
    /// -------
    /// columns : list of int
    ///     Columns of ``joint_torque_regressor`` that stand for the base parameters, ascending.
    /// map : array, shape (len(columns), 10 · links)
    ///     Base parameters are ``map @ robot.inertial_parameters.ravel()``, and the torque is
    ///     ``regressor[..., columns] @ base``.
    fn base_parameters<'py>(&self, py: Python<'py>) -> PyResult<(Vec<usize>, Array<'py>)> {
        let base = py
            .detach(|| BaseParameters::of_tree(&self.tree, BaseParametersOptions::default()))
            .map_err(|error| PyValueError::new_err(error.to_string()))?;
        let (map, columns) = (base.map(), self.regressor.columns());
        let entries = (0..base.count()).flat_map(|row| (0..columns).map(move |column| map[(row, column)]));
        let entries = array(py, entries.collect(), &[base.count(), columns])?;
        Ok((base.independent().to_vec(), entries))
    }

    /// The same robot with other inertial parameters, as an array of shape (links, 10) or (10 · links,) in
    /// the units of ``inertial_parameters``: for kernels only, its URDF stays as it is.
    fn with_inertial_parameters(&self, parameters: &Bound<'_, PyAny>) -> PyResult<Robot> {
        let parameters = Doubles::of(parameters, "parameters")?;
        let mut tree = self.tree.clone();
        tree.set_inertial_parameters(parameters.as_slice()?).map_err(wrong_size)?;
        Ok(Robot { tree, ..self.copied() })
    }

    fn __repr__(&self) -> String {
        format!("Robot('{}', {} joints)", self.tree.name(), self.tree.joint_count())
    }

    /// Pickles: the URDF's text and what is held, and the parameters, which may be other ones.
    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Pickled<'py, Bound<'py, PyTuple>>> {
        let (py, robot) = (slf.py(), slf.get());
        let hold = PyDict::new(py);
        robot.hold.iter().try_for_each(|(joint, value)| hold.set_item(joint, value))?;
        let parameters = robot.tree.inertial_parameters();
        let what = (robot.xml.as_str(), hold, robot.floating_base, parameters).into_pyobject(py)?;
        Ok((slf.get_type().getattr("_restored")?, what))
    }

    #[staticmethod]
    fn _restored(
        urdf: String,
        hold: &Bound<'_, PyAny>,
        floating_base: bool,
        parameters: Vec<f64>,
    ) -> PyResult<Robot> {
        let mut robot = Self::of_text(urdf, None, self::hold(Some(hold))?, floating_base)?;
        robot.tree.set_inertial_parameters(&parameters).map_err(wrong_size)?;
        Ok(robot)
    }
}

impl Robot {
    fn of_text(
        xml: String,
        path: Option<PathBuf>,
        hold: Vec<(String, f64)>,
        floating_base: bool,
    ) -> PyResult<Self> {
        let options = UrdfOptions { held: hold.clone(), floating_base, ..UrdfOptions::default() };
        let file = path.clone().unwrap_or_else(|| PathBuf::from("the MJCF text"));
        let RobotText { urdf: xml, left_out } =
            as_urdf(xml, &file).map_err(|error| PyValueError::new_err(error.to_string()))?;
        let UrdfReading { tree, findings, held, .. } = read_urdf(&xml, &options).map_err(|error| {
            let place = path.as_ref().map_or("the URDF".to_owned(), |path| path.display().to_string());
            PyValueError::new_err(format!("{place}: {error}"))
        })?;
        let left_out = left_out.into_iter().map(|line| format!("left out of the MJCF file: {line}"));
        let findings = findings.iter().map(|finding| finding.to_string()).chain(left_out).collect();
        let regressor = JointTorqueRegressor::new(&tree);
        Ok(Robot { tree, xml, path, hold, held, findings, floating_base, regressor })
    }

    fn copied(&self) -> Robot {
        Robot {
            tree: self.tree.clone(),
            xml: self.xml.clone(),
            path: self.path.clone(),
            hold: self.hold.clone(),
            held: self.held.clone(),
            findings: self.findings.clone(),
            floating_base: self.floating_base,
            regressor: self.regressor.clone(),
        }
    }

    /// Configuration, velocity, and a third array of as many coordinates as the velocity.
    fn motion<'py>(
        &self,
        q: &Bound<'py, PyAny>,
        (second, qd): (&str, &Bound<'py, PyAny>),
        (third, other): (&str, &Bound<'py, PyAny>),
    ) -> PyResult<[States<'py>; 3]> {
        let dof = self.tree.velocity_size();
        let q = States::of(q, "q", self.tree.configuration_size())?;
        let (qd, other) = (States::of(qd, second, dof)?, States::of(other, third, dof)?);
        same_count(&[("q", &q), (second, &qd), (third, &other)])?;
        Ok([q, qd, other])
    }

    fn scratch(&self, outputs: usize) -> (Workspace<Lane>, Vec<Lane>) {
        (Workspace::new(&self.tree), vec![Lanes([0.0; LANES]); outputs])
    }

    /// The dense regressor of one of the states side by side.
    fn scatter(&self, pairs: &[Lane], lane: usize, phi: &mut [f64]) {
        phi.fill(0.0);
        let columns = self.regressor.columns();
        let mut blocks = pairs.chunks_exact(PARAMETERS_PER_BODY);
        for (row, phi) in phi.chunks_exact_mut(columns).enumerate() {
            for (&body, block) in self.regressor.row_bodies(row).iter().zip(&mut blocks) {
                let entries = &mut phi[body * PARAMETERS_PER_BODY..][..PARAMETERS_PER_BODY];
                entries.iter_mut().zip(block).for_each(|(entry, value)| *entry = value.0[lane]);
            }
        }
    }
}
