"""What MuJoCo and Pinocchio make of the files of an identified robot.

Called by `cargo xtask oracle export` with a folder. In it lie `case.json` and, as raw little-endian doubles with one
state after another, `q`, `v`, `a` and, for many more poses, `poses`. Prints one JSON object: for each reader of a file
the torques at the states, and the least eigenvalue of M(q) over its largest, over all poses; or why the file is refused.

Torques are inverse dynamics with all that the file says: damping, armature and springs as the program has them, friction
as its magnitude with the sign of the velocity (programs smooth the sign, each its own way), and a motor's gain and bias.
"""

import importlib.metadata
import importlib.util
import json
import sys
from pathlib import Path

import numpy as np


# Time between two rows of a motion [s], steps in it, and half of a stroke [rad, m].
PERIOD, STEPS, STROKE = 1e-3, 4, 0.05


def least_eigenvalue(matrices):
    """The least eigenvalue over the largest, of all matrices."""
    values = np.linalg.eigvalsh(np.array(matrices))
    return float(np.min(values[:, 0] / values[:, -1]))


class InMujoco:
    """A robot in MuJoCo."""

    def __init__(self, file, joints):
        import mujoco

        self.mujoco = mujoco
        self.model = mujoco.MjModel.from_xml_path(str(file))
        # Friction that turns in an instant is added by hand; what the joints may not pass is none of the dynamics.
        self.model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
        self.data = mujoco.MjData(self.model)
        self.order = [self.model.joint(name).dofadr[0] for name in joints]
        self.gain, self.bias = np.ones(self.model.nv), np.zeros(self.model.nv)
        for actuator in range(self.model.nu):
            place = self.model.jnt_dofadr[self.model.actuator_trnid[actuator, 0]]
            self.gain[place] = self.model.actuator_gainprm[actuator, 0]
            self.bias[place] = self.model.actuator_biasprm[actuator, 0]

    def set(self, target, values):
        target[self.order] = values

    def torque(self, q, v, a):
        data = self.data
        for target, values in [(data.qpos, q), (data.qvel, v), (data.qacc, a)]:
            self.set(target, values)
        self.mujoco.mj_inverse(self.model, data)
        delivered = data.qfrc_inverse + self.model.dof_frictionloss * np.sign(data.qvel)
        return ((delivered - self.bias) / self.gain)[self.order]

    def mass_matrix(self, q):
        data, size = self.data, self.model.nv
        self.set(data.qpos, q)
        self.mujoco.mj_fwdPosition(self.model, data)
        matrix = np.zeros((size, size))
        for column in range(size):
            self.mujoco.mj_mulM(self.model, data, matrix[column], np.eye(size)[column])
        return 0.5 * (matrix + matrix.T)


    def motion(self, start, with_friction):
        """Half a stroke of every joint under the torques that it needs, without a controller: positions, velocities
        and torques, a row each PERIOD. Without friction it is what the bodies and dampers do by themselves."""
        mujoco, model = self.mujoco, self.model
        if not with_friction:
            model.dof_frictionloss[:] = 0
        flags = mujoco.mjtDisableBit
        free = int(flags.mjDSBL_LIMIT) | int(flags.mjDSBL_CONTACT)
        model.opt.integrator, model.opt.timestep = mujoco.mjtIntegrator.mjINT_RK4, PERIOD / STEPS
        model.actuator_forcelimited[:] = 0
        rate = 2 * np.pi
        planner = InMujoco.__new__(InMujoco)
        planner.__dict__.update(self.__dict__, data=mujoco.MjData(model))

        def torque(t):
            stroke = STROKE * np.array([1 - np.cos(rate * t), rate * np.sin(rate * t), rate**2 * np.cos(rate * t)])
            ones = np.ones(len(start))
            model.opt.disableflags = free | int(flags.mjDSBL_CONSTRAINT)
            needed = planner.torque(start + stroke[0] * ones, stroke[1] * ones, stroke[2] * ones)
            model.opt.disableflags = free
            return needed

        data = self.data = mujoco.MjData(model)
        self.set(data.qpos, start)
        rows = {"q": [], "v": [], "torque": []}
        motors = [model.actuator(model.joint(joint).name).id for joint in (model.dof_jntid[at] for at in self.order)]
        for row in range(int(0.5 / PERIOD) + 1):
            t = row * PERIOD
            for name, values in [("q", data.qpos[self.order]), ("v", data.qvel[self.order]), ("torque", torque(t))]:
                rows[name] += values.tolist()
            for step in range(STEPS):
                data.ctrl[motors] = torque(t + (step + 0.5) * PERIOD / STEPS)
                mujoco.mj_step(model, data)
        return rows


class InPinocchio:
    """A robot in Pinocchio."""

    def __init__(self, file, joints):
        import pinocchio

        self.pinocchio = pinocchio
        self.model = pinocchio.buildModelFromUrdf(str(file))
        self.data = self.model.createData()
        self.joints = [self.model.joints[self.model.getJointId(name)] for name in joints]
        self.order = [joint.idx_v for joint in self.joints]

    def configuration(self, q):
        result = self.pinocchio.neutral(self.model)
        for joint, value in zip(self.joints, q):
            place = slice(joint.idx_q, joint.idx_q + joint.nq)
            result[place] = [value] if joint.nq == 1 else [np.cos(value), np.sin(value)]
        return result

    def torque(self, q, v, a):
        velocity, acceleration = np.zeros(self.model.nv), np.zeros(self.model.nv)
        velocity[self.order], acceleration[self.order] = v, a
        bodies = self.pinocchio.rnea(self.model, self.data, self.configuration(q), velocity, acceleration)
        friction = self.model.damping * velocity + self.model.friction * np.sign(velocity)
        return (bodies + friction)[self.order]

    def mass_matrix(self, q):
        upper = np.triu(self.pinocchio.crba(self.model, self.data, self.configuration(q)))
        return upper + np.triu(upper, 1).T


def answer(reader, file, joints, states, poses):
    try:
        robot = reader(file, joints)
    except Exception as refusal:
        return {"refused": " ".join(str(refusal).split())}
    torques = [robot.torque(*state).tolist() for state in zip(*states)]
    found = {"torque": sum(torques, []), "least": least_eigenvalue([robot.mass_matrix(q) for q in poses])}
    if file.suffix == ".xml":
        found["motion"] = robot.motion(states[0][0], True)
        found["without_friction"] = robot.motion(states[0][0], False)
    return found


def main(folder):
    case = json.loads((folder / "case.json").read_text())
    joints = case["joints"]
    read = lambda name: np.fromfile(folder / name, "<f8").reshape(-1, len(joints))
    states, poses = [read(name) for name in ("q", "v", "a")], read("poses")
    mujoco = "MuJoCo " + importlib.metadata.version("mujoco")
    readers = [(f"{mujoco}, URDF", InMujoco, "bodies.urdf"), (f"{mujoco}, MJCF", InMujoco, "identified.xml")]
    if importlib.util.find_spec("pinocchio"):
        version = importlib.metadata.version("pin")
        readers.append((f"Pinocchio {version}, URDF", InPinocchio, "identified.urdf"))
    answers = [{"reader": name, **answer(reader, folder / file, joints, states, poses)} for name, reader, file in readers]
    print(json.dumps(answers))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
