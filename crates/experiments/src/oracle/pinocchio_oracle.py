"""Pinocchio's answers for one robot and many states.

Called by `cargo xtask oracle` with a folder. In it lie `case.json` and, as raw little-endian doubles with one state
after another, `q`, `v`, `a` and `force`, in the coordinates of phiw. The answers go there in the same form.

Joints are matched by name. Pinocchio is given every joint as a free one, a `<mimic>` joint too: `follow`, the matrix
that maps phiw's velocity to Pinocchio's, orders the joints and lets followers follow. Torques go through its transpose.
"""

import json
import sys
import xml.etree.ElementTree
from pathlib import Path

import numpy as np
import pinocchio


def build(case):
    """Pinocchio's model, with the held joints locked."""
    if case["floating_base"]:
        model = pinocchio.buildModelFromUrdf(case["urdf"], pinocchio.JointModelFreeFlyer())
    else:
        model = pinocchio.buildModelFromUrdf(case["urdf"])
    if not case["held"]:
        return model
    reference = pinocchio.neutral(model)
    for name, position in case["held"]:
        put_position(reference, model.joints[model.getJointId(name)], position)
    return pinocchio.buildReducedModel(model, [model.getJointId(name) for name, _ in case["held"]], reference)


def put_position(q, joint, position):
    """Writes a joint's position; Pinocchio keeps a joint without limits as its cosine and sine."""
    q[joint.idx_q : joint.idx_q + joint.nq] = [position] if joint.nq == 1 else [np.cos(position), np.sin(position)]


def leader_of(name, mimics):
    """The joint that `name` follows in the end, with ratio and offset; itself if it leads."""
    ratio, offset = 1.0, 0.0
    while name in mimics:
        name, multiplier, shift = mimics[name]
        offset += ratio * shift
        ratio *= multiplier
    return name, ratio, offset


class Coordinates:
    """From phiw's coordinates to Pinocchio's."""

    def __init__(self, model, case):
        mimics = {
            joint.get("name"): (
                joint.find("mimic").get("joint"),
                float(joint.find("mimic").get("multiplier", 1.0)),
                float(joint.find("mimic").get("offset", 0.0)),
            )
            for joint in xml.etree.ElementTree.parse(case["urdf"]).getroot().findall("joint")
            if joint.find("mimic") is not None
        }
        base = 6 if case["floating_base"] else 0
        self.model = model
        self.base_positions = 7 if base else 0
        self.follow = np.zeros((model.nv, base + len(case["joints"])))
        self.follow[:base, :base] = np.eye(base)
        # (joint of Pinocchio, index of phiw's position, ratio, offset)
        self.links = []
        for index in range(2 if base else 1, model.njoints):
            name, ratio, offset = leader_of(model.names[index], mimics)
            joint, leader = model.joints[index], case["joints"].index(name)
            self.follow[joint.idx_v, base + leader] = ratio
            self.links.append((joint, self.base_positions + leader, ratio, offset))
        ids = [1 if name == "floating_base" else model.getJointId(name) for name in case["bodies"]]
        if sorted(ids) != list(range(1, model.njoints)):
            sys.exit(f"phiw has the joints {sorted(case['bodies'])}, Pinocchio {sorted(model.names[1:])}")
        self.body_ids = ids
        self.columns = np.concatenate([np.arange(10 * (id - 1), 10 * id) for id in ids])

    def configuration(self, q):
        result = pinocchio.neutral(self.model)
        result[: self.base_positions] = q[: self.base_positions]
        for joint, index, ratio, offset in self.links:
            put_position(result, joint, ratio * q[index] + offset)
        return result

    def is_plain(self):
        """Whether no joint follows another."""
        return self.follow.shape[0] == self.follow.shape[1]


def forward_dynamics(coordinates, data, q, v, force, mass_matrix):
    """ABA; where joints follow others, which Pinocchio's ABA does not know, through the mass matrix."""
    model, follow = coordinates.model, coordinates.follow
    if coordinates.is_plain():
        return follow.T @ pinocchio.aba(model, data, q, v, follow @ force)
    bias = follow.T @ pinocchio.nonLinearEffects(model, data, q, v)
    return np.linalg.solve(mass_matrix, force - bias)


def is_singular(mass_matrix):
    """Whether accelerations are undetermined: a massless base before its only joint, a point mass on its own axis."""
    eigenvalues = np.linalg.eigvalsh(mass_matrix)
    return eigenvalues[0] <= 1e-13 * eigenvalues[-1]


def main(folder):
    case = json.loads((folder / "case.json").read_text())
    model = build(case)
    data = model.createData()
    coordinates = Coordinates(model, case)
    follow = coordinates.follow

    states = [np.fromfile(folder / name, "<f8").reshape(case["states"], -1) for name in ("q", "v", "a", "force")]
    regressor, rnea, crba, aba, com = [], [], [], [], []
    for q, v, a, force in zip(*states):
        q, velocity, acceleration = coordinates.configuration(q), follow @ v, follow @ a
        # Pinocchio's matrices come as vectors for a robot of one coordinate.
        phi = pinocchio.computeJointTorqueRegressor(model, data, q, velocity, acceleration)
        phi = np.reshape(phi, (model.nv, len(coordinates.columns)))
        regressor.append(follow.T @ phi[:, coordinates.columns])
        rnea.append(follow.T @ pinocchio.rnea(model, data, q, velocity, acceleration))
        upper = np.triu(np.reshape(pinocchio.crba(model, data, q), (model.nv, model.nv)))
        crba.append(follow.T @ (upper + np.triu(upper, 1).T) @ follow)
        aba.append(forward_dynamics(coordinates, data, q, velocity, force, crba[-1]))
        com.append(pinocchio.centerOfMass(model, data, q).copy())

    inertias = [model.inertias[id] for id in coordinates.body_ids]
    answers = {
        "mass": [sum(inertia.mass for inertia in inertias)],
        "parameters": [inertia.toDynamicParameters() for inertia in inertias],
        "regressor": regressor,
        "rnea": rnea,
        "crba": crba,
        "aba": [] if any(map(is_singular, crba)) else aba,
        "com": com,
    }
    for name, values in answers.items():
        np.asarray(values, "<f8").tofile(folder / f"{name}.pinocchio")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
