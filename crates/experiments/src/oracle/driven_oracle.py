"""MuJoCo's robot along a motion: feed-forward commands and a weak loop.

Called by `cargo xtask oracle export` with a folder that holds `identified.xml`, `driven.json` and, as raw little-endian
doubles, one row of joints a step, `wanted_q`, `wanted_v` and `wanted_command`. Prints one JSON object for the whole file
and for each of its mechanisms that is left out: the positions, and the commands that the loop has made of it all.
"""

import importlib.metadata
import json
import re
import sys
from pathlib import Path

import mujoco
import numpy as np

JOINTS = ["joint_1", "joint_2", "joint_3"]


def run(text, case, wanted):
    model = mujoco.MjModel.from_xml_string(text)
    model.opt.timestep = case["step"]
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_LIMIT | mujoco.mjtDisableBit.mjDSBL_CONTACT
    data = mujoco.MjData(model)
    order = [model.joint(name).dofadr[0] for name in JOINTS]
    motors = [model.actuator(name).id for name in JOINTS]
    stiffness, damping = np.array(case["stiffness"]), np.array(case["damping"])
    positions, commands = [], []
    for q, v, feed in zip(*wanted):
        positions.append(data.qpos[order].copy())
        command = feed + stiffness * (q - data.qpos[order]) + damping * (v - data.qvel[order])
        commands.append(command)
        data.ctrl[motors] = command
        mujoco.mj_step(model, data)
    return np.concatenate(positions).tolist(), np.concatenate(commands).tolist()


def without(text, thing):
    """The file without a mechanism: an attribute, or the tendons."""
    if thing == "tendon":
        return re.sub(r"<tendon>.*</tendon>", "", text, flags=re.DOTALL)
    return re.sub(rf' {thing}="[^"]*"', "", text) if thing else text


def main(folder):
    case = json.loads((folder / "driven.json").read_text())
    wanted = [np.fromfile(folder / name, "<f8").reshape(-1, 3) for name in ("wanted_q", "wanted_v", "wanted_command")]
    text = (folder / "identified.xml").read_text()
    answers = []
    for thing in case["without"]:
        q, command = run(without(text, thing), case, wanted)
        reader = "MuJoCo " + importlib.metadata.version("mujoco")
        answers.append({"reader": reader, "without": thing, "q": q, "command": command})
    print(json.dumps(answers))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
