"""Optima of phiw-consistency's problems by CVXPY and Clarabel.

Reads problems from FOLDER/problems.json and writes for each the objective and the parameters that it finds to
FOLDER/optima.json.

The unknowns are each body's pseudo-inertia over its prior, Q with P = L Q L^T and P0 = L L^T, and the extras;
phiw's are the standard parameters.
"""

import json
import pathlib
import sys

import cvxpy as cp
import numpy as np


def pseudo_inertia(p):
    m, hx, hy, hz, xx, xy, yy, xz, yz, zz = p
    half = 0.5 * (xx + yy + zz)
    return np.array(
        [
            [half - xx, -xy, -xz, hx],
            [-xy, half - yy, -yz, hy],
            [-xz, -yz, half - zz, hz],
            [hx, hy, hz, m],
        ]
    )


def parameters(s):
    return [
        s[3, 3],
        s[0, 3],
        s[1, 3],
        s[2, 3],
        s[1, 1] + s[2, 2],
        -s[0, 1],
        s[0, 0] + s[2, 2],
        -s[0, 2],
        -s[1, 2],
        s[0, 0] + s[1, 1],
    ]


def columns(lower):
    """The standard parameters as a linear map of the 16 entries of Q."""
    result = np.zeros((10, 16))
    for place in range(16):
        unit = np.zeros(16)
        unit[place] = 1.0
        result[:, place] = parameters(lower @ unit.reshape(4, 4) @ lower.T)
    return result


def solve(problem):
    priors = np.array(problem["priors"]).reshape(-1, 10)
    bodies, extras, weight = len(priors), problem["extras"], problem["weight"]
    unknowns = 10 * bodies + extras
    matrix = np.array(problem["matrix"]).reshape(-1, unknowns)
    target = np.array(problem["target"])
    ratios, terms, divergence, constraints = [], [], 0, []
    maps = []
    for body in range(bodies):
        lower = np.linalg.cholesky(pseudo_inertia(priors[body]))
        ratio = cp.Variable((4, 4), PSD=True)
        maps.append(columns(lower))
        terms.append(matrix[:, 10 * body : 10 * body + 10] @ maps[-1] @ cp.vec(ratio, order="C"))
        divergence += cp.trace(ratio) - cp.log_det(ratio) - 4
        ratios.append(ratio)
    friction = cp.Variable(extras) if extras else None
    if extras:
        terms.append(matrix[:, 10 * bodies :] @ friction)
        constraints.append(friction >= 0)
    misfit = 0.5 * cp.sum_squares(sum(terms) - target)
    best = dict(status="failed", objective=float("inf"), parameters=[0.0] * unknowns)
    # Clarabel's accuracy depends on the scale of the objective: the best of several counts.
    whole = weight + 0.5 * np.sum(target**2)
    for scale in [1.0 / max(1.0, weight), whole**-0.5, 1.0 / whole, 1e-2 / weight, 1e-4 / weight]:
        program = cp.Problem(cp.Minimize(scale * (misfit + weight * divergence)), constraints)
        for tolerance in [1e-11, 1e-9, 1e-8]:
            options = dict(tol_gap_abs=1e-18, tol_gap_rel=tolerance, tol_feas=tolerance, max_iter=500)
            try:
                program.solve(solver=cp.CLARABEL, **options)
            except cp.error.SolverError:
                continue
            if program.status != "optimal":
                continue
            if min(np.linalg.eigvalsh(ratio.value)[0] for ratio in ratios) <= 0.0:
                continue
            standard = [maps[body] @ ratios[body].value.reshape(-1) for body in range(bodies)]
            rest = np.maximum(friction.value, 0.0) if extras else np.zeros(0)
            x = np.concatenate(standard + [rest])
            value = 0.5 * np.sum((matrix @ x - target) ** 2)
            for ratio in ratios:
                value += weight * (np.trace(ratio.value) - np.linalg.slogdet(ratio.value)[1] - 4)
            if value < best["objective"]:
                best = dict(status="optimal", objective=float(value), parameters=x.tolist())
            break
        if best["status"] == "optimal" and tolerance == 1e-11:
            break
    if best["status"] == "failed":
        best["objective"] = 0.0
    return best


def main():
    folder = pathlib.Path(sys.argv[1])
    problems = json.loads((folder / "problems.json").read_text())
    (folder / "optima.json").write_text(json.dumps([solve(problem) for problem in problems]))


main()
