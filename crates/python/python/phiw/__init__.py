"""Identify a robot from its URDF and logs: a model that predicts its torques, and what it lacks.

All units are SI: rad, m, s, kg, N, N·m.
"""

from ._phiw import Factor, Robot

__all__ = ["Factor", "Robot"]
