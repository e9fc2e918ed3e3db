"""Identify a robot from its URDF and logs: a model that predicts its torques, and what it lacks.

All units are SI: rad, m, s, kg, N, N·m. A log is a path, a dict of arrays or a data frame, see :func:`identify`.
"""

from . import examples
from ._phiw import Factor, InputError, PhiwError, Robot
from .outcomes import Check, NextMotion, Retargeted
from .results import Effect, Errors, Prediction, Result, TorqueErrors, load
from .sessions import check, explain, identify, next_motion, predict, retarget

__all__ = [
    "Check",
    "Effect",
    "Errors",
    "Factor",
    "InputError",
    "NextMotion",
    "PhiwError",
    "Prediction",
    "Result",
    "Retargeted",
    "Robot",
    "TorqueErrors",
    "check",
    "examples",
    "explain",
    "identify",
    "load",
    "next_motion",
    "predict",
    "retarget",
]
