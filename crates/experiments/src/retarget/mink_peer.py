"""mink on the same markers, frame by frame: first the human model after the markers, then the robot after the human.

Argument: a folder with `robot.urdf`, `human.xml`, `request.json` (the robot's points, the human's vectors that they answer to, rate) and `markers`
(frames x markers x 3 doubles, NaN where one is missing). Prints time, errors and jerk as JSON.
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
step = 1.0 / request["rate_hz"]
iterations = request["iterations"]


class Follower:
    """A model whose sites are to be at targets, one frame after the other."""

    def __init__(self, model, sites, rest, limits):
        self.configuration = mink.Configuration(model)
        self.tasks = [
            mink.FrameTask(site, "site", position_cost=1.0, orientation_cost=0.0, lm_damping=1e-3) for site in sites
        ]
        self.posture = mink.PostureTask(model, cost=1e-3)
        self.posture.set_target(rest)
        self.limits = limits
        self.configuration.update(rest)
        self.sites = [model.site(site).id for site in sites]

    def follow(self, targets, iterations):
        """Targets that are not numbers are left out."""
        seen = [task for task, target in zip(self.tasks, targets) if numpy.isfinite(target[0])]
        for task, target in zip(self.tasks, targets):
            if numpy.isfinite(target[0]):
                task.set_target(mink.SE3.from_translation(target))
        for _ in range(iterations):
            tasks = seen + [self.posture]
            velocity = mink.solve_ik(self.configuration, tasks, step, "daqp", damping=1e-6, limits=self.limits)
            self.configuration.integrate_inplace(velocity, step)

    def positions(self):
        return self.configuration.data.site_xpos[self.sites].copy()


# The human: lengths, places of the markers and what keeps still are given.
human_model = mujoco.MjModel.from_xml_path(str(folder / "human.xml"))
markers = numpy.fromfile(folder / "markers", dtype="<f8").reshape(-1, request["markers"], 3)
rest = numpy.zeros(human_model.nq)
for index, value in enumerate(request["rest"]):
    rest[human_model.joint(f"coordinate_{index}").qposadr[0]] = value
human = Follower(human_model, [f"marker_{index}" for index in range(request["markers"])], rest, [])
segments = [human_model.body(f"joint_{joint}").id for joint in request["segments"]]
pelvis = human_model.body(f"joint_{request['pelvis']}").id

# The robot: elbow, wrist and hand of each arm, and the shoulder that they are seen from.
spec = mujoco.MjSpec.from_file(str(folder / "robot.urdf"))
sites = []
for index, point in enumerate(request["points"]):
    sites.append(f"point_{index}")
    spec.body(point["link"]).add_site(name=sites[-1], pos=point["local"])
robot_model = spec.compile()
rest = numpy.clip(numpy.zeros(robot_model.nq), robot_model.jnt_range[:, 0], robot_model.jnt_range[:, 1])
followers = [index for index, point in enumerate(request["points"]) if point["from"] is not None]
robot = Follower(robot_model, [sites[index] for index in followers], rest, [mink.ConfigurationLimit(robot_model)])
all_sites = [robot_model.site(site).id for site in sites]
roots = [request["points"][index]["from"] for index in followers]
vectors = [numpy.array(request["points"][index]["human"]) for index in followers]


def wanted():
    """Vectors of the human at the robot's size, seen from the pelvis."""
    data = human.configuration.data
    rotations = data.xmat[segments].reshape(-1, 3, 3)
    back = data.xmat[pelvis].reshape(3, 3).T
    return numpy.array([back @ numpy.einsum("sij,sj->i", rotations, vector) for vector in vectors])


def shoulders():
    return robot.configuration.data.site_xpos[all_sites][roots]


def follow(frame, iterations):
    human.follow(markers[frame], iterations)
    robot.follow(shoulders() + wanted(), iterations)


follow(0, 300)
marker_errors, positions, errors = [], [], []
start, cpu_start = time.perf_counter(), time.process_time()
for frame in range(len(markers)):
    follow(frame, iterations)
    positions.append(robot.configuration.q.copy())
    marker_errors.append(numpy.sum((human.positions() - markers[frame]) ** 2, axis=1))
    errors.append(numpy.sum((robot.positions() - shoulders() - wanted()) ** 2, axis=1))
seconds, cpu_seconds = time.perf_counter() - start, time.process_time() - cpu_start
rms = lambda values: float(numpy.sqrt(numpy.nanmean(values)))
errors = numpy.array(errors)
kinds = numpy.array([request["points"][index]["kind"] for index in followers])
print(json.dumps({
    "seconds": seconds,
    "cpu_seconds": cpu_seconds,
    "marker_rms_m": rms(numpy.array(marker_errors)),
    "elbow_rms_m": rms(errors[:, kinds == "elbow"]),
    "hand_rms_m": rms(errors[:, kinds == "hand"]),
    "jerk_rms": rms((numpy.diff(numpy.array(positions), n=3, axis=0) / step**3) ** 2),
}))
