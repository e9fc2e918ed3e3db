"""What the command does, on paths, arrays and data frames."""

from __future__ import annotations

import json
import os
import pathlib
import tempfile
from typing import Any, Callable, Dict, Iterable, List, Mapping, Optional, Sequence, Tuple, Union

import numpy as np

from . import _phiw
from ._phiw import InputError, Robot
from .logs import Log, taken_logs
from .outcomes import Check, NextMotion, Retargeted
from .results import Prediction, Result, model_text

#: Is called now and then with what is being done, how much of it is done, and how much there is.
Progress = Callable[[str, int, int], Any]
PathLike = Union[str, "os.PathLike[str]"]
Logs = Union[Log, Iterable[Log]]
Names = Union[str, Iterable[str]]
Model = Union[Result, Mapping[str, Any], PathLike]


def identify(
    robot: Union[Robot, PathLike],
    train: Logs,
    validate: Logs = (),
    declare: Names = (),
    *,
    map: Optional[PathLike] = None,
    mass: Optional[Mapping[str, float]] = None,
    total_mass: Optional[float] = None,
    inside: Optional[Mapping[str, Sequence[float]]] = None,
    inside_geometry: bool = False,
    mirrored: Optional[Mapping[str, str]] = None,
    motions: Optional[PathLike] = None,
    cutoff_hz: Optional[float] = None,
    parallel_cutoff_hz: Optional[float] = None,
    progress: Optional[Progress] = None,
) -> Result:
    """Fits the declared model: the rigid body, and the effects that are named.

    Parameters
    ----------
    robot : Robot or path
        The robot; a path is read without held joints.
    train : log or list of logs
        What the model is fitted to. A log is

        - a path of whatever ``phiw identify`` reads (CSV, MCAP, ROS bags, LeRobot folders, npz, HDF5, …);
        - a dict of arrays: ``t`` (s), shape (N,), strictly increasing; ``q`` (rad, m) and ``tau`` (N·m, N),
          shape (N, dof), and where they were measured ``qd`` (rad/s, m/s), ``qdd`` (rad/s², m/s²), ``temp``
          (°C); or columns ``q.<joint>``, ``tau.<joint>``, …, each of shape (N,); with a map any others, those
          of an array of shape (N, k) by the names ``array[0]`` to ``array[k-1]``;
        - a data frame of pandas or polars with such columns.

        NaN is a gap.
    validate : log or list of logs
        What its error is measured on; without any, the last 30 % of each training log are held out.
    declare : str or list of str
        Effects: ``"viscous_friction"`` wherever it can act, ``"coulomb_friction:joint_1+joint_2"``.
    map : path, optional
        What the columns of the logs mean: topics, units, gears, currents (docs/log-maps.md).
    mass : dict, optional
        Masses of links that are known (kg).
    total_mass : float, optional
        Mass of all links that move (kg).
    inside : dict, optional
        Ellipsoids that hold all of a link's mass: centre and half axes (m) in the frame of its joint, six
        numbers for each link.
    inside_geometry : bool
        The same of every other link that has geometry in the URDF.
    mirrored : dict, optional
        Links that are mirror images of each other, with the robot at zero.
    motions : path, optional
        Folder of motions: which of them would tell most of what the logs do not tell.
    cutoff_hz, parallel_cutoff_hz : float, optional
        Cut-offs of the low-pass over positions, and over columns and torque alike (Hz).
    progress : callable, optional
        ``progress(what, done, total)``. What it raises ends the work, as Ctrl-C does.

    Returns
    -------
    Result
    """
    robot = _robot(robot)
    known = _known(mass, total_mass, inside, inside_geometry, mirrored)
    shared = {"motions": motions, "cutoff_hz": cutoff_hz, "parallel_cutoff_hz": parallel_cutoff_hz}
    options = _session_options(robot, train, validate, declare, map, {**known, **shared})
    return Result(*_phiw.identify(robot, options, progress))


def explain(
    robot: Union[Robot, PathLike],
    train: Logs,
    validate: Logs = (),
    declare: Names = (),
    *,
    map: Optional[PathLike] = None,
    model: Optional[Model] = None,
    exclude: Names = (),
    false_name_rate: Optional[float] = None,
    draws: int = 0,
    mass: Optional[Mapping[str, float]] = None,
    total_mass: Optional[float] = None,
    inside: Optional[Mapping[str, Sequence[float]]] = None,
    inside_geometry: bool = False,
    mirrored: Optional[Mapping[str, str]] = None,
    motions: Optional[PathLike] = None,
    cutoff_hz: Optional[float] = None,
    parallel_cutoff_hz: Optional[float] = None,
    progress: Optional[Progress] = None,
) -> Result:
    """Fits the declared model, finds what it lacks, and fits again.

    Takes what :func:`identify` takes, and

    Parameters
    ----------
    model : Result, path or dict, optional
        An identified model: its parameters are held, and what has changed since is sought.
    exclude : str or list of str
        Effects that are not sought.
    false_name_rate : float, optional
        Probability of naming anything where nothing is missing; 0.01 by default.
    draws : int
        Bootstrap draws of the training motion on which is traced again.

    Returns
    -------
    Result
    """
    robot = _robot(robot)
    known = _known(mass, total_mass, inside, inside_geometry, mirrored)
    shared = {"motions": motions, "cutoff_hz": cutoff_hz, "parallel_cutoff_hz": parallel_cutoff_hz}
    options = _session_options(robot, train, validate, declare, map, {**known, **shared})
    own = {
        "model": None if model is None else model_text(model),
        "exclude": _names(exclude),
        "false_name_rate": false_name_rate,
        "draws": draws,
    }
    return Result(*_phiw.explain(robot, options, own, progress))


def check(
    robot: Union[Robot, PathLike],
    logs: Logs,
    *,
    map: Optional[PathLike] = None,
    progress: Optional[Progress] = None,
) -> Check:
    """Says what is in logs before anything is fitted: late velocities, torques that are missing or clipped,
    units, clocks, and what to do about it. Logs as for :func:`identify`; they need no torques."""
    robot = _robot(robot)
    report, summary = _phiw.check(robot, taken_logs(logs, robot.joints, "logs", map is not None), map, progress)
    return Check(json.loads(report), summary)


def predict(
    model: Model,
    logs: Logs,
    *,
    map: Optional[PathLike] = None,
    hold: Any = (),
    cutoff_hz: Optional[float] = None,
    parallel_cutoff_hz: Optional[float] = None,
    progress: Optional[Progress] = None,
) -> Prediction:
    """Torques of a model along logs, with bands, residuals and each effect's share.

    Parameters
    ----------
    model : Result, path or dict
        What :func:`identify` or :func:`explain` gave, its folder, or its ``model.json``.
    logs : log or list of logs
        As for :func:`identify`; torques are compared where a log has them.
    hold : list or dict
        Joints that stand still in the logs, see :class:`Robot`; what the model holds need not be named.
    """
    text = model_text(model)
    joints = _joints(text)
    moving = [joint for joint in joints if joint not in _held(hold)]
    taken = taken_logs(logs, moving, "logs", map is not None)
    options = {
        "logs": taken,
        "map": map,
        "hold": hold,
        "cutoff_hz": cutoff_hz,
        "parallel_cutoff_hz": parallel_cutoff_hz,
    }
    names, columns, log, relative, warnings = _phiw.predict(text, options, progress)
    return Prediction(joints, dict(zip(names, columns)), np.array(log, dtype=int), relative, warnings)


def next_motion(
    robot: Union[Robot, PathLike],
    motions: PathLike,
    measured: Logs = (),
    *,
    map: Optional[PathLike] = None,
    support: Optional[PathLike] = None,
    model: Optional[Model] = None,
    declare: Names = (),
    urdf_error: float = 0.3,
    estimator: str = "unknown-noise",
    selection: str = "torque-per-second",
    command_hz: Optional[float] = None,
    alpha: Optional[float] = None,
    cutoff_hz: Optional[float] = None,
    parallel_cutoff_hz: Optional[float] = None,
    progress: Optional[Progress] = None,
) -> NextMotion:
    """Chooses the motion that a real robot should run next: one iteration of the curriculum.

    Parameters
    ----------
    robot : Robot or path
    motions : path
        Folder of motions to choose from, as :func:`retarget` writes them.
    measured : log or list of logs
        What the robot has run so far, as for :func:`identify`.
    support : path, optional
        What the robot stands on; without it the robot is taken as bolted down.
    model : Result, path or dict, optional
        A model to take the parameters from, instead of fitting the logs.
    declare : str or list of str
        Effects beside the rigid body.
    urdf_error : float
        How far off the URDF's inertial parameters may be, as a share of each body's magnitude.
    estimator : "unknown-noise" or "least-squares"
        How the logs are estimated from. The first needs logs that say what the controller commanded
        (``tau_cmd.<joint>``) or was asked for (``qref.<joint>``); where one does not, the second is taken.
    selection : "torque-per-second" or "condition"
        What makes a motion the best of those that are allowed: in each second it takes most of the
        uncertainty of the torques of all motions, or it makes cond(Φ) smallest.
    command_hz : float, optional
        Commands a second of the robot's controller (Hz); by default seen in the logs.
    alpha : float, optional
        The part that the support is reduced by, 0 to 1.
    """
    robot = _robot(robot)
    options = {
        "motions": os.fspath(motions),
        "measured": taken_logs(measured, robot.joints, "measured", map is not None),
        "map": map,
        "support": support,
        "model": None if model is None else model_text(model),
        "declare": _names(declare),
        "urdf_error": urdf_error,
        "estimator": estimator,
        "selection": selection,
        "command_hz": command_hz,
        "alpha": alpha,
        "cutoff_hz": cutoff_hz,
        "parallel_cutoff_hz": parallel_cutoff_hz,
    }
    return NextMotion(robot.joints, *_phiw.next_motion(robot, options, progress))


def retarget(
    robot: Union[Robot, PathLike],
    files: Union[PathLike, Iterable[PathLike]],
    out: PathLike,
    *,
    map: Optional[PathLike] = None,
    torso_from_reach: bool = False,
    velocity_limits: bool = False,
    interval: float = 0.2,
    format: str = "csv",
    progress: Optional[Progress] = None,
) -> Retargeted:
    """Turns recordings of people into motions of the robot: markers (C3D, TRC, or CSV of points) or joint
    angles (BVH, npz of AMASS and SMPL-X).

    For each recording the folder ``out`` gets a log without torques, ``<name>.csv``, or ``<name>.npz``, and
    ``<name>.json`` with what it is worth. What is done in it with the same settings is not done again.

    Parameters
    ----------
    map : path, optional
        Which marker sits where; by default the built-in map that names most markers.
    torso_from_reach : bool
        Torso and head follow reach and gaze of the hands.
    velocity_limits : bool
        Keep joint velocities inside the URDF's limits, too.
    interval : float
        Time between the control points of the splines (s).
    format : "csv" or "npz"
        What a motion is written as. The npz is as programs that learn to track motions read it: ``fps`` (Hz),
        ``joint_pos`` and ``joint_vel`` (rad, m, rad/s, m/s), shape (N, dof), ``body_pos_w`` (m) and
        ``body_lin_vel_w``, ``body_ang_vel_w`` (m/s, rad/s), shape (N, bodies, 3), ``body_quat_w``
        (w, x, y, z), shape (N, bodies, 4), ``joint_names``, ``body_names``.
    """
    robot = _robot(robot)
    if isinstance(files, (str, os.PathLike)):
        files = [files]
    with tempfile.TemporaryDirectory(prefix="phiw-") as folder:
        urdf = pathlib.Path(folder) / f"{robot.name or 'robot'}.urdf"
        urdf.write_text(robot.urdf, encoding="utf-8")
        options = {
            "urdf": urdf,
            "files": [os.fspath(file) for file in files],
            "map": map,
            "torso_from_reach": torso_from_reach,
            "velocity_limits": velocity_limits,
            "interval": interval,
            "format": format,
            "out": os.fspath(out),
        }
        return Retargeted(pathlib.Path(out), *_phiw.retarget(robot, options, progress), format)


def _robot(robot: Union[Robot, PathLike]) -> Robot:
    return robot if isinstance(robot, Robot) else Robot(robot)


def _joints(model: str) -> List[str]:
    try:
        joints = json.loads(model)["joints"]
    except (ValueError, KeyError, TypeError):
        joints = None
    if not isinstance(joints, list) or not joints:
        raise InputError("this is not a model.json of phiw: it names no joints")
    return joints


def _names(names: Names) -> List[str]:
    return [name.strip() for name in names.split(",")] if isinstance(names, str) else list(names)


def _held(hold: Any) -> Sequence[str]:
    if isinstance(hold, str):
        hold = hold.split(",")
    joints = list(hold or ())
    return [(joint if isinstance(joint, str) else joint[0]).split("=")[0].strip() for joint in joints]


def _session_options(
    robot: Robot,
    train: Logs,
    validate: Logs,
    declare: Names,
    map: Optional[PathLike],
    others: Dict[str, Any],
) -> Dict[str, Any]:
    training = taken_logs(train, robot.joints, "train", map is not None)
    if not training:
        raise InputError("train holds no log: give at least one")
    return {
        "train": training,
        "validate": taken_logs(validate, robot.joints, "validate", map is not None),
        "map": map,
        "declare": _names(declare),
        **others,
    }


def _known(
    mass: Optional[Mapping[str, float]],
    total_mass: Optional[float],
    inside: Optional[Mapping[str, Sequence[float]]],
    inside_geometry: bool,
    mirrored: Optional[Mapping[str, str]],
) -> Dict[str, Any]:
    ellipsoids: List[Tuple[str, List[float]]] = []
    for link, numbers in (inside or {}).items():
        ellipsoid = [float(number) for number in numbers]
        if len(ellipsoid) != 6 or not np.all(np.isfinite(ellipsoid)) or min(ellipsoid[3:]) <= 0.0:
            raise InputError(f"inside[{link!r}] is not a centre and half axes above zero: six numbers (m)")
        ellipsoids.append((link, ellipsoid))
    return {
        "mass": [(link, float(kg)) for link, kg in (mass or {}).items()],
        "total_mass": total_mass,
        "inside": ellipsoids,
        "inside_geometry": inside_geometry,
        "mirrored": list((mirrored or {}).items()),
    }
