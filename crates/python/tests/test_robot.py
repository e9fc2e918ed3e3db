"""Robots and their kernels, held against each other, against numpy and (where it is installed) Pinocchio."""

import pickle

import numpy as np
import pytest

import phiw
from conftest import MODELS, random_states

PENDULUM = """<robot name="pendulum"><link name="base"/>
  <link name="arm"><inertial><origin xyz="0.5 0 0"/><mass value="2"/>
    <inertia ixx="0" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial></link>
  <joint name="pivot" type="revolute"><parent link="base"/><child link="arm"/><axis xyz="0 -1 0"/>
    <limit lower="-3" upper="3" effort="20" velocity="5"/></joint></robot>"""


def test_a_robot_says_what_its_urdf_says():
    robot = phiw.Robot(PENDULUM)
    assert (robot.name, robot.joints, robot.dof, robot.links) == ("pendulum", ["pivot"], 1, ["arm"])
    assert robot.joint_types == ["revolute"]
    limits = {name: list(values) for name, values in robot.limits.items()}
    assert limits == {"lower": [-3], "upper": [3], "velocity": [5], "effort": [20]}
    # About the joint: 0.1 and m·c².
    expected = [2, 1, 0, 0, 0, 0, 0.6, 0, 0, 0.6]
    np.testing.assert_allclose(robot.inertial_parameters, [expected], atol=1e-15)
    assert robot.PARAMETER_NAMES[0] == "m"


def test_path_text_and_pathlike_give_the_same_robot():
    path = MODELS / "puma560.urdf"
    robots = [phiw.Robot(path), phiw.Robot(str(path)), phiw.Robot(path.read_text())]
    assert len({robot.urdf for robot in robots}) == 1


@pytest.mark.parametrize(
    "hold",
    [["joint_5", "joint_6=0.25"], "joint_5,joint_6=0.25", {"joint_5": 0, "joint_6": 0.25}, [("joint_5", 0.0), ("joint_6", 0.25)]],
)
def test_joints_are_held_however_they_are_named(hold):
    robot = phiw.Robot(MODELS / "puma560.urdf", hold=hold)
    assert robot.joints == ["joint_1", "joint_2", "joint_3", "joint_4"]
    assert robot.held == {"joint_5": 0.0, "joint_6": 0.25}


def test_what_is_wrong_is_said_in_one_line(tmp_path):
    def refused(error, text, call):
        with pytest.raises(error) as caught:
            call()
        message = str(caught.value)
        assert text in message and "\n" not in message, message

    refused(OSError, "absent.urdf", lambda: phiw.Robot(tmp_path / "absent.urdf"))
    refused(ValueError, "not XML", lambda: phiw.Robot("<robot"))
    refused(ValueError, "joint_9", lambda: phiw.Robot(MODELS / "puma560.urdf", hold=["joint_9"]))
    robot = phiw.Robot(PENDULUM)
    refused(ValueError, "qd has the shape [1, 2]", lambda: robot.inverse_dynamics([0], [[1, 2]], [0]))
    refused(ValueError, "3 states", lambda: robot.inverse_dynamics([[0]] * 3, [[1]] * 2, [[0]] * 3))
    refused(ValueError, "q is no array of numbers", lambda: robot.mass_matrix(["half"]))
    refused(ValueError, "10", lambda: robot.with_inertial_parameters(np.zeros(9)))


def test_the_torque_of_a_pendulum_held_level():
    robot = phiw.Robot(PENDULUM)
    assert robot.inverse_dynamics([0.0], [0.0], [0.0]) == pytest.approx(2 * 9.81 * 0.5, abs=1e-12)


# More states than a thread takes at a time, and than fit side by side, and none, and one that is no batch.
@pytest.mark.parametrize("count", [0, 1, 7, 8, 513, 1300])
def test_a_batch_is_its_states_one_by_one(robot, count):
    q, qd, qdd = random_states(robot, count)
    batches = [
        (robot.inverse_dynamics(q, qd, qdd), lambda k: robot.inverse_dynamics(q[k], qd[k], qdd[k])),
        (robot.forward_dynamics(q, qd, qdd), lambda k: robot.forward_dynamics(q[k], qd[k], qdd[k])),
        (robot.mass_matrix(q), lambda k: robot.mass_matrix(q[k])),
        (robot.joint_torque_regressor(q, qd, qdd), lambda k: robot.joint_torque_regressor(q[k], qd[k], qdd[k])),
    ]
    for batch, single in batches:
        assert len(batch) == count
        for k in range(0, count, max(1, count // 5)):
            np.testing.assert_array_equal(batch[k], single(k))


def test_the_kernels_agree_with_each_other(robot):
    q, qd, qdd = random_states(robot, 100)
    torque = robot.inverse_dynamics(q, qd, qdd)
    regressor = robot.joint_torque_regressor(q, qd, qdd)
    scale = np.abs(torque).max()
    np.testing.assert_allclose(regressor @ robot.inertial_parameters.ravel(), torque, atol=1e-12 * scale)
    mass = robot.mass_matrix(q)
    bias = robot.inverse_dynamics(q, qd, np.zeros_like(q))
    np.testing.assert_allclose(np.einsum("nij,nj->ni", mass, qdd) + bias, torque, atol=1e-12 * scale)
    np.testing.assert_allclose(robot.forward_dynamics(q, qd, torque), qdd, atol=1e-7)


def test_other_parameters_scale_the_torque(puma):
    q, qd, qdd = random_states(puma, 10)
    twice = puma.with_inertial_parameters(2 * puma.inertial_parameters)
    np.testing.assert_allclose(twice.inverse_dynamics(q, qd, qdd), 2 * puma.inverse_dynamics(q, qd, qdd))


def test_contiguous_doubles_are_taken_as_they_are_and_others_converted(puma):
    q, qd, qdd = random_states(puma, 50)
    expected = puma.inverse_dynamics(q, qd, qdd)
    fortran = [np.asfortranarray(x) for x in (q, qd, qdd)]
    np.testing.assert_array_equal(puma.inverse_dynamics(*fortran), expected)
    every_other = np.repeat(q, 2, axis=0)[::2]
    np.testing.assert_array_equal(puma.inverse_dynamics(every_other, qd.tolist(), qdd), expected)
    single = puma.inverse_dynamics(q.astype(np.float32), qd, qdd)
    np.testing.assert_allclose(single, expected, rtol=1e-4, atol=1e-4)
    q.setflags(write=False)
    np.testing.assert_array_equal(puma.inverse_dynamics(q, qd, qdd), expected)


def test_results_go_where_they_are_asked_for(robot):
    q, qd, qdd = random_states(robot, 600)
    for kernel, inputs in [
        (robot.inverse_dynamics, (q, qd, qdd)),
        (robot.forward_dynamics, (q, qd, qdd)),
        (robot.mass_matrix, (q,)),
        (robot.joint_torque_regressor, (q, qd, qdd)),
    ]:
        expected = kernel(*inputs)
        out = np.full_like(expected, np.nan)
        assert kernel(*inputs, out=out) is out
        np.testing.assert_array_equal(out, expected)
        with pytest.raises(ValueError, match="out has the shape"):
            kernel(*inputs, out=out[:-1])
        with pytest.raises(ValueError, match="out cannot be written to"):
            kernel(*inputs, out=np.asfortranarray(out))
    with pytest.raises(ValueError, match="out cannot be written to"):
        robot.inverse_dynamics(q, qd, qdd, out=qdd)


def test_base_parameters_carry_the_whole_torque(robot):
    q, qd, qdd = random_states(robot, 40)
    columns, to_base = robot.base_parameters()
    base = to_base @ robot.inertial_parameters.ravel()
    regressor = robot.joint_torque_regressor(q, qd, qdd)
    torque = robot.inverse_dynamics(q, qd, qdd)
    np.testing.assert_allclose(regressor[..., columns] @ base, torque, atol=1e-9 * np.abs(torque).max())


def test_a_floating_base_has_six_coordinates_more(models):
    robot = phiw.Robot(models / "humanoid30.urdf", floating_base=True)
    assert (robot.dof, robot.configuration_size) == (36, 37)
    q = np.zeros(37)
    q[6] = 1
    still = robot.inverse_dynamics(q, np.zeros(36), np.zeros(36))
    weight = 9.81 * robot.inertial_parameters[:, 0].sum()
    np.testing.assert_allclose(still[:3], [0, 0, weight], atol=1e-9)


def test_robots_and_factors_pickle(puma):
    q, qd, qdd = random_states(puma, 20)
    held = phiw.Robot(puma.urdf, hold=["joint_6=0.5"]).with_inertial_parameters(np.arange(50.0))
    again = pickle.loads(pickle.dumps(held))
    assert again.held == {"joint_6": 0.5}
    np.testing.assert_array_equal(again.inertial_parameters, held.inertial_parameters)
    factor = phiw.Factor(q, qd[:, 0])
    assert pickle.loads(pickle.dumps(factor)) == factor


def test_factors_merge_to_the_factor_of_all_rows():
    random = np.random.default_rng(1)
    phi = random.normal(size=(300, 5))
    f = phi @ np.arange(1.0, 6.0) + 0.1 * random.normal(size=300)
    whole = phiw.Factor(phi, f)
    merged = sum(phiw.Factor(phi[k : k + 100], f[k : k + 100]) for k in range(0, 300, 100))
    assert (merged.rows, merged.parameters) == (300, 5)
    np.testing.assert_allclose(merged.r, whole.r, atol=1e-12)
    parameters, std, rmse = merged.solve()
    expected, rss, *_ = np.linalg.lstsq(phi, f, rcond=None)
    np.testing.assert_allclose(parameters, expected, atol=1e-12)
    assert rmse == pytest.approx(np.sqrt(rss[0] / 300))
    covariance = rss[0] / 295 * np.linalg.inv(phi.T @ phi)
    np.testing.assert_allclose(std, np.sqrt(np.diag(covariance)), rtol=1e-9)
    np.testing.assert_allclose(merged.singular_values, np.linalg.svd(phi, compute_uv=False), rtol=1e-9)
    assert merged.condition_number == pytest.approx(np.linalg.cond(phi))
    chosen, _, _ = whole.select([4, 0]).solve()
    np.testing.assert_allclose(chosen, np.linalg.lstsq(phi[:, [4, 0]], f, rcond=None)[0], atol=1e-12)


def test_a_column_that_rows_do_not_determine_is_named():
    phi = np.ones((10, 2))
    factor = phiw.Factor(phi, np.arange(10.0))
    assert factor.undetermined_columns == [1]
    with pytest.raises(ValueError, match="column 1"):
        factor.solve()
    with pytest.raises(ValueError, match="row 3"):
        phiw.Factor(np.where(np.arange(10)[:, None] == 3, np.nan, phi), np.arange(10.0))


def test_the_kernels_agree_with_pinocchio():
    pin = pytest.importorskip("pinocchio")
    for name in ["puma560", "humanoid30", "upper_body18", "arm7"]:
        agrees_with_pinocchio(pin, name)


def agrees_with_pinocchio(pin, name):
    path = str(MODELS / f"{name}.urdf")
    robot, model = phiw.Robot(path), pin.buildModelFromUrdf(path)
    data = model.createData()
    # Pinocchio sorts children by name.
    order = [robot.joints.index(joint) for joint in model.names[1:]]
    columns = (10 * np.array(order)[:, None] + np.arange(10)).ravel()
    q, qd, qdd = random_states(robot, 20)
    torque = robot.inverse_dynamics(q, qd, qdd)
    acceleration, mass = robot.forward_dynamics(q, qd, qdd), robot.mass_matrix(q)
    regressor = robot.joint_torque_regressor(q, qd, qdd)

    def agree(ours, theirs):
        assert np.abs(ours - theirs).max() <= 1e-10 * np.abs(theirs).max()

    for k in range(len(q)):
        state = [np.ascontiguousarray(x[k][order]) for x in (q, qd, qdd)]
        agree(torque[k][order], pin.rnea(model, data, *state))
        agree(acceleration[k][order], pin.aba(model, data, *state))
        upper = np.triu(pin.crba(model, data, state[0]))
        agree(mass[k][np.ix_(order, order)], upper + np.triu(upper, 1).T)
        theirs = pin.computeJointTorqueRegressor(model, data, *state)
        agree(regressor[k][np.ix_(order, columns)], theirs)
