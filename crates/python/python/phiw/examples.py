"""Robots that come with the package, and logs that are made up on the spot, for trying things out."""

from __future__ import annotations

from typing import Any, Callable, Dict, Optional

import numpy as np

from ._phiw import InputError, Robot, example_urdfs

#: URDFs by name: a PUMA 560, arms of two, four and seven joints, an upper body, a humanoid.
URDFS: Dict[str, str] = dict(example_urdfs())

#: Gives the torque beside the rigid body, shape (N, dof), of the motion: a dict of ``t``, ``q``, ``qd``, ``qdd``.
Effects = Callable[[Dict[str, np.ndarray]], np.ndarray]


def robot(name: str = "puma560", hold: Any = None) -> Robot:
    """A robot that comes with the package: one of ``URDFS``."""
    if name not in URDFS:
        raise InputError(f"there is no example {name}; choose one of {', '.join(URDFS)}")
    return Robot(URDFS[name], hold=hold)


def motion(
    robot: Robot, seconds: float = 20.0, rate_hz: float = 250.0, seed: int = 0, harmonics: int = 5
) -> Dict[str, np.ndarray]:
    """A smooth motion inside the joints' limits: sums of sines at multiples of 0.1 Hz, a little apart.

    Returns
    -------
    dict
        ``t`` (s), shape (N,); ``q`` (rad, m), ``qd`` (rad/s, m/s), ``qdd`` (rad/s², m/s²), shape (N, dof).
    """
    random = np.random.default_rng(seed)
    t = np.arange(round(seconds * rate_hz)) / rate_hz
    shape = (harmonics, robot.dof)
    rate = 2 * np.pi * (0.1 * np.arange(1, harmonics + 1)[:, None] + random.uniform(0, 0.08, shape))
    amplitude, phase = random.uniform(0.3, 1.0, shape), random.uniform(0, 2 * np.pi, shape)
    amplitude /= amplitude.sum(axis=0)
    lower = np.maximum(robot.limits["lower"], -np.pi / 2)
    upper = np.minimum(robot.limits["upper"], np.pi / 2)
    amplitude *= 0.45 * (upper - lower)
    # Slower where a joint could not follow.
    fastest = (rate * amplitude).sum(axis=0)
    rate *= np.minimum(1.0, 0.9 * robot.limits["velocity"] / fastest)
    angle = t[:, None, None] * rate + phase
    return {
        "t": t,
        "q": (lower + upper) / 2 + (amplitude * np.sin(angle)).sum(axis=1),
        "qd": (amplitude * rate * np.cos(angle)).sum(axis=1),
        "qdd": -(amplitude * rate**2 * np.sin(angle)).sum(axis=1),
    }


def log(
    robot: Robot,
    seconds: float = 20.0,
    rate_hz: float = 250.0,
    seed: int = 0,
    effects: Optional[Effects] = None,
    noise: float = 0.01,
) -> Dict[str, np.ndarray]:
    """A log of the robot following :func:`motion`, as :func:`phiw.identify` takes it.

    Parameters
    ----------
    effects : callable, optional
        What the torque has beside the rigid body: ``lambda motion: 2 * motion["qd"]``.
    noise : float
        Standard deviation of the torque sensors' white noise over the torque's RMS.

    Returns
    -------
    dict
        ``t`` (s), shape (N,); ``q`` (rad, m), ``tau`` (N·m, N), shape (N, dof).
    """
    moved = motion(robot, seconds, rate_hz, seed)
    tau = robot.inverse_dynamics(moved["q"], moved["qd"], moved["qdd"])
    if effects is not None:
        tau = tau + effects(moved)
    random = np.random.default_rng([seed, 1])
    tau = tau + noise * np.sqrt((tau**2).mean(axis=0)) * random.normal(size=tau.shape)
    return {"t": moved["t"], "q": moved["q"], "tau": tau}
