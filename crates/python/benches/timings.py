"""Kernels and a fit against Pinocchio's Python and FIGAROH: the same work, agreement and times.

    cargo xtask python --timings

or, where `phiw`, `pin` and (optionally) `figaroh` are installed, `python benches/timings.py [--states N]`. Robots are a Stäubli TX40 and
a Unitree G1 where `../shared/data` lies beside the workspace, else a PUMA 560 and a humanoid of the workspace.
"""

import argparse
import os
import pathlib
import sys
import time

import numpy as np
import pinocchio as pin

import phiw

WORKSPACE = pathlib.Path(__file__).resolve().parents[3]
SHARED = WORKSPACE / "../shared/data"
#: The first that is there of each.
ROBOTS = [
    [SHARED / "logs/tx40/tx40.urdf", WORKSPACE / "models/puma560.urdf"],
    [SHARED / "robots/g1/g1_29dof_rev_1_0.urdf", WORKSPACE / "models/humanoid30.urdf"],
]
#: Relative difference up to which two programs agree.
TOLERANCE = 1e-10
#: States that one thread of phiw takes at a time.
ONE_THREAD = 512


class Case:
    """A robot in both programs, and random states of it, in the order of each."""

    def __init__(self, path, states):
        self.robot, self.model = phiw.Robot(path), pin.buildModelFromUrdf(str(path))
        self.data = self.model.createData()
        if sorted(self.robot.joints) != sorted(self.model.names[1:]):
            sys.exit(f"{path}: the programs do not see the same joints")
        # Pinocchio sorts children by name.
        self.order = [self.robot.joints.index(joint) for joint in self.model.names[1:]]
        self.columns = (10 * np.array(self.order)[:, None] + np.arange(10)).ravel()
        still = np.zeros(self.robot.dof)
        if not np.isfinite(self.robot.forward_dynamics(still, still, still)).all():
            self.give_bodies()
        random = np.random.default_rng(0)
        self.q = random.uniform(-1.5, 1.5, (states, self.robot.dof))
        self.qd, self.other = random.normal(size=(2, *self.q.shape))
        self.theirs = [np.ascontiguousarray(x[:, self.order]) for x in (self.q, self.qd, self.other)]

    def give_bodies(self):
        """Where a URDF's bodies cannot be moved, since they have no mass or no inertia: the same random bodies in both."""
        random = np.random.default_rng(1)
        bodies = [pin.Inertia.Random() for _ in self.robot.links]
        for body in bodies:
            body.mass = random.uniform(1, 10)
        parameters = np.array([body.toDynamicParameters() for body in bodies])
        self.robot = self.robot.with_inertial_parameters(parameters)
        for k, joint in enumerate(self.order):
            self.model.inertias[k + 1] = pin.Inertia.FromDynamicParameters(parameters[joint])
        self.data = self.model.createData()

    def kernels(self):
        """Name, ours on the first `count` states, theirs on these, and theirs in our order."""
        robot, model, data, order = self.robot, self.model, self.data, self.order
        q, qd, other = self.q, self.qd, self.other

        def loop(compute, shape, inputs):
            def run(count, out):
                out = np.empty((count, *shape)) if out is None else out
                for k in range(count):
                    out[k] = compute(model, data, *(x[k] for x in inputs))
                return out

            return run

        n, back = robot.dof, np.argsort(order)
        whole = np.argsort(self.columns)

        def symmetric(matrices):
            upper = np.triu(matrices)
            return (upper + np.triu(upper, 1).transpose(0, 2, 1))[:, back][:, :, back]

        yield (
            "regressor",
            lambda count, out: robot.joint_torque_regressor(q[:count], qd[:count], other[:count], out=out),
            loop(pin.computeJointTorqueRegressor, (n, 10 * n), self.theirs),
            lambda phi: phi[:, back][:, :, whole],
        )
        yield (
            "inverse dynamics (RNEA)",
            lambda count, out: robot.inverse_dynamics(q[:count], qd[:count], other[:count], out=out),
            loop(pin.rnea, (n,), self.theirs),
            lambda tau: tau[:, back],
        )
        yield (
            "mass matrix (CRBA)",
            lambda count, out: robot.mass_matrix(q[:count], out=out),
            loop(pin.crba, (n, n), self.theirs[:1]),
            symmetric,
        )
        yield (
            "forward dynamics (ABA)",
            lambda count, out: robot.forward_dynamics(q[:count], qd[:count], other[:count], out=out),
            loop(pin.aba, (n,), self.theirs),
            lambda acceleration: acceleration[:, back],
        )


def best(work, times=7):
    """The shortest of several runs (s): others may be using the machine."""
    seconds = []
    for _ in range(times):
        start = time.perf_counter()
        work()
        seconds.append(time.perf_counter() - start)
    return min(seconds)


def kernels(case, states):
    """Prints a line for each kernel; the largest relative difference."""
    largest = 0.0
    for name, ours, theirs, in_our_order in case.kernels():
        few = min(ONE_THREAD, states)
        found = ours(few, None)
        expected = in_our_order(theirs(few, None))
        difference = np.abs(found - expected).max() / np.abs(expected).max()
        largest = max(largest, difference)
        # All write into memory that is there.
        out, much = np.empty_like(found), np.empty((states, *found.shape[1:]))
        other = best(lambda: theirs(few, out)) / few
        one, all_ = best(lambda: ours(few, out)) / few, best(lambda: ours(states, much)) / states
        print(
            f"| {case.robot.name} ({case.robot.dof}) | {name} | {1e6 * other:.2f} | {1e6 * one:.3f} | {other / one:.0f}× |"
            f" {1e6 * all_:.3f} | {other / all_:.0f}× | {difference:.0e} |"
        )
    return largest


def fit(case, states):
    """Prints times of a whole fit of the base parameters, from states and torques to numbers."""
    try:
        from figaroh.tools.qrdecomposition import QRDecomposer
        from figaroh.tools.regressor import build_regressor_basic, build_regressor_reduced, get_index_eliminate
    except ImportError:
        print("\nFIGAROH is not installed: no fit is compared")
        return
    robot, n = case.robot, case.robot.dof
    torque = robot.inverse_dynamics(case.q, case.qd, case.other)
    torque = torque + 0.01 * np.random.default_rng(2).normal(size=torque.shape)
    stacked = torque[:, case.order].T.ravel()
    names = {f"{name}{joint}": 0.0 for joint in range(n) for name in robot.PARAMETER_NAMES}

    class Figaroh:
        model, data = case.model, case.data

    def theirs():
        joints = {"is_joint_torques": True, "act_idxv": list(range(n))}
        phi = build_regressor_basic(Figaroh, *case.theirs, joints)
        dropped, kept = get_index_eliminate(phi, names)
        reduced = build_regressor_reduced(phi, dropped)
        result = QRDecomposer().decompose_with_pivoting(stacked, reduced, kept)
        base = result[0]
        parameters = np.linalg.lstsq(base, stacked, rcond=None)[0]
        return np.sqrt(np.mean((base @ parameters - stacked) ** 2))

    def ours():
        columns, _ = robot.base_parameters()
        phi = robot.joint_torque_regressor(case.q, case.qd, case.other)[..., columns]
        return phiw.Factor(phi.reshape(-1, len(columns)), torque.ravel()).solve()[2]

    # FIGAROH's fits take long: once.
    residuals = []
    seconds = best(lambda: residuals.append(theirs()), 1), best(ours, 3)
    print(
        f"| {robot.name} ({n}) | {states} | {seconds[0]:.2f} | {seconds[1]:.3f} | {seconds[0] / seconds[1]:.0f}× |"
        f" {residuals[0]:.6f} | {ours():.6f} |"
    )


def main():
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--states", type=int, default=20_000)
    states = arguments.parse_args().states
    cases = [Case(next(path for path in paths if path.exists()), states) for paths in ROBOTS]
    print(f"pinocchio {pin.__version__}, {os.cpu_count()} processors, load {os.getloadavg()[0]:.1f}; µs a state, best of 7\n")
    print("| robot (joints) | kernel | Pinocchio, loop | phiw, 1 thread | | phiw, all threads | | largest relative difference |")
    print("|---|---|--:|--:|--:|--:|--:|--:|")
    largest = max(kernels(case, states) for case in cases)
    few = states // 20
    print("\n| robot (joints) | states | FIGAROH (s) | phiw (s) | | RMS residual, FIGAROH | phiw |\n|---|--:|--:|--:|--:|--:|--:|")
    for paths in ROBOTS:
        fit(Case(next(path for path in paths if path.exists()), few), few)
    if largest > TOLERANCE:
        sys.exit(f"the largest relative difference, {largest:.1e}, is above {TOLERANCE:.0e}")


if __name__ == "__main__":
    main()
