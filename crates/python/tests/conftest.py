"""What the tests share: robots of the workspace, and states of them."""

import pathlib

import numpy as np
import pytest

import phiw

MODELS = pathlib.Path(__file__).resolve().parents[3] / "models"


@pytest.fixture(scope="session")
def models():
    return MODELS


@pytest.fixture(params=["puma560", "humanoid30", "scara4"])
def robot(request):
    return phiw.Robot(MODELS / f"{request.param}.urdf")


@pytest.fixture(scope="session")
def puma():
    return phiw.Robot(MODELS / "puma560.urdf")


def random_states(robot, count, seed=0):
    """Positions, velocities and accelerations, each of shape (count, dof)."""
    random = np.random.default_rng(seed)
    q = random.uniform(-1.5, 1.5, (count, robot.dof))
    return q, random.normal(size=q.shape), random.normal(size=q.shape)
