"""mink follows the robot's points frame by frame; prints time, error and jerk as JSON.

Argument: a folder with `robot.urdf`, `request.json` (links and local positions of the points, joints to hold, rate) and `targets`
(frames × points × 3 doubles).
"""

import json
import pathlib
import sys
import time

import mink
import mujoco
import numpy

folder = pathlib.Path(sys.argv[1])
request = json.loads((folder / "request.json").read_text())
targets = numpy.fromfile(folder / "targets", dtype="<f8").reshape(-1, len(request["points"]), 3)

spec = mujoco.MjSpec.from_file(str(folder / "robot.urdf"))
sites = []
for index, point in enumerate(request["points"]):
    name = f"point_{index}"
    spec.body(point["link"]).add_site(name=name, pos=point["local"])
    sites.append(name)
model = spec.compile()
configuration = mink.Configuration(model)
tasks = [
    mink.FrameTask(frame_name=name, frame_type="site", position_cost=1.0, orientation_cost=0.0, lm_damping=1e-3)
    for name in sites
]
posture = mink.PostureTask(model, cost=1e-3)
posture.set_target(numpy.clip(numpy.zeros(model.nq), model.jnt_range[:, 0], model.jnt_range[:, 1]))
limits = [mink.ConfigurationLimit(model)]
step = 1.0 / request["rate_hz"]


def follow(frame, iterations):
    for task, target in zip(tasks, targets[frame]):
        task.set_target(mink.SE3.from_translation(target))
    for _ in range(iterations):
        velocity = mink.solve_ik(configuration, tasks + [posture], step, "daqp", damping=1e-6, limits=limits)
        configuration.integrate_inplace(velocity, step)


configuration.update(posture.target_q.copy())
follow(0, 300)
positions, errors = [], []
start = time.perf_counter()
for frame in range(len(targets)):
    follow(frame, request["iterations"])
    positions.append(configuration.q.copy())
    found = numpy.array([configuration.get_transform_frame_to_world(name, "site").translation() for name in sites])
    errors.append(numpy.sum((found - targets[frame]) ** 2, axis=1))
seconds = time.perf_counter() - start
jerk = numpy.diff(numpy.array(positions), n=3, axis=0) / step**3
print(json.dumps({
    "seconds": seconds,
    "error_rms_m": float(numpy.sqrt(numpy.mean(errors))),
    "jerk_rms": float(numpy.sqrt(numpy.mean(jerk**2))),
}))
