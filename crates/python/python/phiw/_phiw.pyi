"""Types of what is written in Rust."""

import os
from typing import Any, Callable, Dict, List, Mapping, Optional, Sequence, Tuple, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
Hold = Union[str, Sequence[Union[str, Tuple[str, float]]], Mapping[str, float], None]
_Log = Union[str, Tuple[str, List[Tuple[str, NDArray[Any]]]]]
_Path = Union[str, "os.PathLike[str]", None]
_Told = Tuple[Dict[str, bytes], str, List[str]]
_Progress = Optional[Callable[[str, int, int], Any]]

class InputError(ValueError):
    """An input is wrong; the message says where, and how to mend it."""

class PhiwError(RuntimeError):
    """Something else than an input went wrong."""

class Robot:
    """A robot, read from a URDF."""

    #: Names of a link's ten inertial parameters, in their order.
    PARAMETER_NAMES: List[str]

    def __init__(
        self, urdf: Union[str, "os.PathLike[str]"], hold: Hold = None, *, floating_base: bool = False
    ) -> None: ...
    @property
    def name(self) -> str: ...
    @property
    def joints(self) -> List[str]:
        """Names of the joints that move by themselves, in the order of all arrays."""
    @property
    def dof(self) -> int:
        """Number of velocity coordinates."""
    @property
    def configuration_size(self) -> int:
        """Length of a configuration."""
    @property
    def links(self) -> List[str]:
        """Names of the links that joints carry, in the order of the parameters."""
    @property
    def joint_types(self) -> List[str]:
        """``"revolute"``, ``"continuous"`` or ``"prismatic"``."""
    @property
    def limits(self) -> Dict[str, Array]:
        """``lower``, ``upper`` (rad, m), ``velocity`` (rad/s, m/s), ``effort`` (N·m, N), each of shape (joints,)."""
    @property
    def held(self) -> Dict[str, float]:
        """Joints that are held, and where (rad, m)."""
    @property
    def findings(self) -> List[str]:
        """What in the URDF should not be trusted."""
    @property
    def urdf(self) -> str:
        """The URDF's text."""
    @property
    def inertial_parameters(self) -> Array:
        """Shape (links, 10), in the order of ``PARAMETER_NAMES`` (kg, kg·m, kg·m²)."""
    def with_inertial_parameters(self, parameters: ArrayLike) -> "Robot":
        """The same robot with other inertial parameters, for kernels only."""
    def inverse_dynamics(
        self, q: ArrayLike, qd: ArrayLike, qdd: ArrayLike, *, out: Optional[Array] = None
    ) -> Array:
        """Torques (N·m, N) of shape (N, dof), RNEA."""
    def forward_dynamics(
        self, q: ArrayLike, qd: ArrayLike, tau: ArrayLike, *, out: Optional[Array] = None
    ) -> Array:
        """Accelerations (rad/s², m/s²) of shape (N, dof), ABA."""
    def mass_matrix(
        self, q: ArrayLike, *, out: Optional[Array] = None
    ) -> Array:
        """M(q) of shape (N, dof, dof), CRBA."""
    def joint_torque_regressor(
        self, q: ArrayLike, qd: ArrayLike, qdd: ArrayLike, *, out: Optional[Array] = None
    ) -> Array:
        """φ(q, q̇, q̈) of shape (N, dof, 10 · links)."""
    def base_parameters(self) -> Tuple[List[int], Array]:
        """Columns of φ that stand for the base parameters, and the map to these."""

class Factor:
    """The triangular factor R of rows of [Φ f]; factors merge with ``+``."""

    def __init__(self, phi: ArrayLike, f: ArrayLike) -> None: ...
    @property
    def parameters(self) -> int:
        """Number of columns of Φ."""
    @property
    def rows(self) -> int:
        """Number of rows that the factor stands for."""
    @property
    def r(self) -> Array:
        """R, upper triangular, shape (k + 1, k + 1)."""
    @property
    def undetermined_columns(self) -> List[int]:
        """Columns that depend on those before them."""
    @property
    def condition_number(self) -> float:
        """cond(Φ)."""
    @property
    def singular_values(self) -> Array:
        """Of Φ, largest first."""
    def select(self, columns: Sequence[int]) -> "Factor":
        """The factor of some of the columns, in this order."""
    def scaled(self, weight: float) -> "Factor":
        """All rows times a number."""
    def solve(self) -> Tuple[Array, Array, float]:
        """Parameters, their standard deviations, and the RMS of Φ·w − f."""
    def __add__(self, other: "Factor") -> "Factor": ...
    def __radd__(self, other: int) -> "Factor": ...

def identify(robot: Robot, options: Dict[str, Any], progress: _Progress) -> _Told: ...
def explain(robot: Robot, options: Dict[str, Any], own: Dict[str, Any], progress: _Progress) -> _Told: ...
def check(robot: Robot, logs: List[_Log], map: _Path, progress: _Progress) -> Tuple[str, str]: ...
def predict(
    model: str, options: Dict[str, Any], progress: _Progress
) -> Tuple[List[str], List[Array], List[int], float, List[str]]: ...
def next_motion(robot: Robot, options: Dict[str, Any], progress: _Progress) -> _Told: ...
def retarget(
    robot: Robot, options: Dict[str, Any], progress: _Progress
) -> Tuple[str, List[str], List[Tuple[str, str]]]: ...
def write_results(out: str, files: List[Tuple[str, bytes]]) -> None: ...
def command(command_line: List[str]) -> int: ...
def example_urdfs() -> List[Tuple[str, str]]: ...
