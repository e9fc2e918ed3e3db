"""identify, explain and what follows, held against the command and against the truth of made-up logs."""

import json
import pathlib
import pickle
import signal
import subprocess
import sys

import numpy as np
import pytest

import phiw
from conftest import MODELS

VISCOUS = np.array([4.0, 2.5])
COULOMB = np.array([3.0, 2.0])


def friction(motion):
    return VISCOUS * motion["qd"] + COULOMB * np.tanh(motion["qd"] / 0.02)


@pytest.fixture(scope="module")
def robot():
    return phiw.examples.robot("planar2")


@pytest.fixture(scope="module")
def logs(robot):
    return [phiw.examples.log(robot, effects=friction, seed=seed) for seed in (1, 2)]


def flat(log, robot):
    """The same log with a column for each joint."""
    columns = {"t": log["t"]}
    for signal_ in ("q", "tau"):
        columns.update({f"{signal_}.{joint}": log[signal_][:, i] for i, joint in enumerate(robot.joints)})
    return columns


def write_csv(log, robot, path):
    columns = flat(log, robot)
    rows = zip(*columns.values())
    path.write_text("\n".join([",".join(columns), *(",".join(map(repr, map(float, row))) for row in rows)]) + "\n")
    return path


@pytest.fixture(scope="module")
def explained(robot, logs):
    return phiw.explain(robot, logs[0], logs[1], "viscous_friction")


def numbers(result):
    """All that a report says but of where the logs were."""
    told = json.loads(json.dumps(result.numbers))
    told["phiw"].pop("conditioning", None)
    return told


def fitted(result):
    return {key: result.model[key] for key in ("base_parameters", "effects", "residual_std", "factor")}


def test_the_truth_is_found(explained):
    assert explained.verdict == "explained"
    assert [effect.kind for effect in explained.effects] == ["coulomb_friction"]
    table = explained.parameters
    for kind, truth in [("viscous_friction", VISCOUS), ("coulomb_friction", COULOMB)]:
        for joint, value in zip(explained.joints, truth):
            own = table[(table["kind"] == kind) & (table["joints"] == joint)]
            assert own["value"].item() == pytest.approx(value, rel=0.02)
    assert explained.after.validate.relative < 0.02 < explained.before.validate.relative
    assert set(explained.noise_floor) == set(explained.joints)
    assert "coulomb friction" in str(explained) and "explained" in repr(explained)


def test_every_form_of_a_log_gives_the_same_numbers(robot, logs, tmp_path):
    pandas = pytest.importorskip("pandas")
    columns = [flat(log, robot) for log in logs]
    paths = [write_csv(log, robot, tmp_path / f"{k}.csv") for k, log in enumerate(logs)]
    frames = [pandas.DataFrame(column) for column in columns]
    forms = [
        logs,
        columns,
        frames,
        [frame.set_index("t") for frame in frames],
        [frame.astype(object) for frame in frames],
        paths,
        list(map(str, paths)),
    ]
    try:
        import polars

        forms.append([polars.DataFrame(column) for column in columns])
    except ImportError:
        pass
    of_arrays = phiw.identify(robot, logs[0], logs[1], "viscous_friction")
    for train, validate in forms:
        result = phiw.identify(robot, train, validate, ["viscous_friction"])
        assert fitted(result) == fitted(of_arrays)
        assert numbers(result) == numbers(of_arrays)


def test_the_command_gives_the_same_files(robot, logs, tmp_path):
    train, validate = (write_csv(log, robot, tmp_path / f"{k}.csv") for k, log in enumerate(logs))
    urdf = MODELS / "planar2.urdf"
    line = ["explain", "--urdf", urdf, "--train", train, "--validate", validate]
    line += ["--declare", "viscous_friction", "--out", tmp_path / "command"]
    done = subprocess.run([sys.executable, "-m", "phiw", *map(str, line)], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    command = phiw.load(tmp_path / "command")
    result = phiw.explain(phiw.Robot(urdf), train, validate, "viscous_friction")
    for name in ("model.json", "report.json", "identified.urdf", "identified.xml"):
        assert result.files[name] == command.files[name], name
    assert done.stdout.startswith(str(result))
    page = result.report(tmp_path / "package")
    assert page.read_bytes() == result.files["report.html"]
    assert phiw.load(tmp_path / "package").files == result.files


def test_the_command_is_installed_and_tells_its_exit_status(tmp_path):
    script = pathlib.Path(sys.executable).parent / "phiw"
    for program in ([sys.executable, "-m", "phiw"], [str(script)]):
        helped = subprocess.run([*program, "--help"], capture_output=True, text=True)
        assert helped.returncode == 0 and "identify" in helped.stdout
        wrong = subprocess.run([*program, "identify"], capture_output=True, text=True)
        assert wrong.returncode == 2 and "--urdf" in wrong.stderr
        absent = [*program, "check", "--urdf", str(tmp_path / "absent.urdf"), "log.csv"]
        refused = subprocess.run(absent, capture_output=True, text=True)
        assert refused.returncode == 2 and refused.stderr.count("\n") == 1 and "absent.urdf" in refused.stderr


def test_results_pickle_and_show_themselves(explained):
    again = pickle.loads(pickle.dumps(explained))
    assert again == explained
    assert again.after == explained.after
    page = explained._repr_html_()
    assert "coulomb_friction" in page and "<script" not in page
    assert explained.html.startswith("<!DOCTYPE html>")
    assert explained.urdf.lstrip().startswith("<") and "<mujoco" in explained.mjcf


def test_predictions_have_bands_residuals_and_shares(robot, logs, explained, tmp_path):
    predicted = explained.predict(logs[1])
    assert predicted.tau.shape == predicted.residual.shape == (len(predicted), 2)
    assert set(predicted.effects) >= {"viscous_friction", "coulomb_friction"}
    within = (predicted.low <= predicted.tau + predicted.residual) & (predicted.tau + predicted.residual <= predicted.high)
    assert 0.85 < within.mean() <= 1
    assert predicted.relative == pytest.approx(explained.after.validate.relative, rel=0.3)
    # The same from a dict, a folder and a file, and of motion without torques.
    explained.report(tmp_path)
    for model in (explained.model, tmp_path, tmp_path / "model.json"):
        again = phiw.predict(model, logs[1])
        np.testing.assert_array_equal(again.tau, predicted.tau)
    silent = explained.predict({"t": logs[1]["t"], "q": logs[1]["q"]})
    np.testing.assert_array_equal(silent.tau, predicted.tau)
    assert np.isnan(silent.residual).all() and np.isnan(silent.relative)
    both = phiw.predict(explained, logs)
    assert set(both.log) == {0, 1} and len(both) > len(predicted)


def test_predictions_are_those_of_the_command(robot, logs, explained, tmp_path):
    log = write_csv(logs[1], robot, tmp_path / "log.csv")
    explained.report(tmp_path / "model")
    line = ["predict", "--model", tmp_path / "model" / "model.json", log, "--out", tmp_path / "out.csv"]
    subprocess.run([sys.executable, "-m", "phiw", *map(str, line)], check=True, capture_output=True)
    table = np.genfromtxt(tmp_path / "out.csv", delimiter=",", names=True, deletechars="")
    predicted = explained.predict(log)
    assert list(table.dtype.names) == list(predicted.columns)
    for name, column in predicted.columns.items():
        np.testing.assert_array_equal(table[name], column)


def test_what_changed_since_a_model_is_found(robot, logs, explained):
    def heavier(motion):
        payload = phiw.examples.robot("planar2")
        parameters = payload.inertial_parameters
        # 2 kg at 0.4 m from the second joint.
        parameters[1] += 2.0 * np.array([1, 0.4, 0, 0, 0, 0, 0.16, 0, 0, 0.16])
        state = (motion["q"], motion["qd"], motion["qdd"])
        more = payload.with_inertial_parameters(parameters).inverse_dynamics(*state)
        return friction(motion) + more - robot.inverse_dynamics(*state)

    changed = [phiw.examples.log(robot, effects=heavier, seed=seed) for seed in (3, 4)]
    result = phiw.explain(robot, changed[0], changed[1], model=explained)
    assert "payload" in [effect.kind for effect in result.effects]


def test_check_says_what_is_in_logs(robot, logs):
    clean = phiw.check(robot, logs)
    assert clean and not clean.findings and len(clean.logs) == 2
    late = dict(flat(logs[0], robot))
    late["tau.shoulder" if "tau.shoulder" in late else f"tau.{robot.joints[0]}"] = np.zeros(len(late["t"]))
    found = phiw.check(robot, late)
    assert not found and found.refused + found.findings
    assert "nothing found" in str(clean) and "<pre>" in clean._repr_html_()


def test_gaps_are_gaps(robot, logs):
    holes = {key: np.array(values) for key, values in logs[0].items()}
    holes["q"][2500:2510, 1] = np.nan
    result = phiw.check(robot, holes)
    assert result.logs[0]["used_rows"] == result.logs[0]["rows"] - 10


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (lambda log: {**log, "q": log["q"][:, :1]}, "train[0], `q`: it has 1 columns, but the robot has 2 joints"),
        (lambda log: {**log, "t": log["t"][:-1]}, "column `q."),
        (lambda log: {key: values for key, values in log.items() if key != "tau"}, "no column `tau."),
        (lambda log: {key: values for key, values in log.items() if key != "t"}, "no column `t`"),
        (lambda log: {**log, "t": log["t"][::-1]}, "time runs backwards"),
        (lambda log: {**log, "t": 0 * log["t"]}, "in all"),
        (lambda log: {key: values[:0] for key, values in log.items()}, "the log is empty"),
        (lambda log: {**log, "q": np.zeros((5000, 2, 2))}, "it has the shape (5000, 2, 2)"),
        (lambda log: {"t": log["t"], "pos": log["q"]}, "no column `q."),
        (lambda log: 5, "give a log as a path, a dict of arrays, or a data frame"),
        (lambda log: "absent.csv", "absent.csv: no such file"),
    ],
)
def test_a_wrong_log_is_one_clear_message(robot, logs, spoil, words):
    with pytest.raises(phiw.InputError) as caught:
        phiw.identify(robot, [spoil(logs[0])])
    message = str(caught.value)
    assert words in message and "\n" not in message, message


def test_wrong_options_are_one_clear_message(robot, logs):
    def refused(words, call):
        with pytest.raises(phiw.InputError) as caught:
            call()
        assert words in str(caught.value) and "\n" not in str(caught.value), str(caught.value)

    refused("viscous", lambda: phiw.identify(robot, logs[0], declare="viscos_friction"))
    refused("train holds no log", lambda: phiw.identify(robot, []))
    refused("elbow_2", lambda: phiw.identify(robot, logs[0], mass={"elbow_2": 1.0}))
    refused("floating_base", lambda: phiw.identify(phiw.Robot(robot.urdf, floating_base=True), logs[0]))
    refused("not a model.json", lambda: phiw.predict({"joints": []}, logs[0]))
    refused("no folder of results", lambda: phiw.load("absent"))
    refused("absent", lambda: phiw.predict("absent", logs[0]))


def test_progress_is_told(robot, logs):
    told = []
    phiw.identify(robot, logs[0], progress=lambda *args: told.append(args))
    assert told
    for what, done, total in told:
        assert "train[0]" in what and 0 <= done <= total


def test_ctrl_c_and_errors_of_the_callback_end_the_work(robot, logs):
    with pytest.raises(KeyboardInterrupt):
        phiw.explain(robot, logs[0], progress=lambda *_: signal.raise_signal(signal.SIGINT))

    def fails(*_):
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        phiw.explain(robot, logs[0], progress=fails)
    # What is called off leaves nothing behind that stops the next.
    assert phiw.identify(robot, logs[0]).after.train.relative < 1


def test_held_joints_need_no_column(logs):
    robot = phiw.examples.robot("planar2", hold=[phiw.examples.robot("planar2").joints[1]])
    assert robot.dof == 1
    log = phiw.examples.log(robot, effects=lambda motion: 4.0 * motion["qd"])
    result = phiw.identify(robot, log, declare="viscous_friction")
    assert result.joints == robot.joints and result.after.validate.relative < 0.05
    assert result.predict(log).tau.shape[1] == 1
    # One joint: q may be flat.
    assert fitted(phiw.identify(robot, {"t": log["t"], "q": log["q"][:, 0], "tau": log["tau"][:, 0]})) == fitted(
        phiw.identify(robot, log)
    )


def test_the_next_motion_is_chosen(robot, logs, tmp_path):
    motions = tmp_path / "motions"
    motions.mkdir()
    for seed in range(3):
        moved = phiw.examples.motion(robot, seconds=5, rate_hz=100, seed=10 + seed)
        columns = {"t": moved["t"]}
        for name in ("q", "qd", "qdd"):
            columns.update({f"{name}.{joint}": moved[name][:, i] for i, joint in enumerate(robot.joints)})
        rows = [",".join(columns), *(",".join(map(repr, map(float, row))) for row in zip(*columns.values()))]
        (motions / f"motion_{seed}.csv").write_text("\n".join(rows) + "\n")
    first = phiw.next_motion(robot, motions)
    assert first.motion["q"].shape == first.motion["tau"].shape == (len(first.motion["t"]), 2)
    then = phiw.next_motion(robot, motions, logs[0], declare="viscous_friction")
    assert str(then) and then.numbers
    with pytest.raises(phiw.InputError, match='estimator="guess" is not known'):
        phiw.next_motion(robot, motions, logs[0], estimator="guess")
    simple = phiw.next_motion(
        robot, motions, logs[0], declare="viscous_friction", estimator="least-squares", command_hz=100.0
    )
    assert simple.numbers
    path = then.write(tmp_path / "next.csv")
    assert path.exists() and json.loads(path.with_suffix(".json").read_text()) == then.numbers


def test_what_is_known_of_bodies_holds_in_python_too(robot, logs):
    """`inside`, `mirrored` and the options of `next` that came last were the command's alone."""
    links = robot.links if hasattr(robot, "links") else ["link_1", "link_2"]
    result = phiw.identify(
        robot, logs[0], declare="viscous_friction", inside={links[1]: [0.2, 0, 0, 0.3, 0.2, 0.2]}
    )
    assert result.numbers["phiw"]["consistency"]["certified"]
    with pytest.raises(phiw.InputError, match="six numbers"):
        phiw.identify(robot, logs[0], inside={links[1]: [0.2, 0, 0, 0.3, 0.2]})
    with pytest.raises(phiw.InputError, match="nowhere"):
        phiw.identify(robot, logs[0], mirrored={links[0]: "nowhere"})
    assert result.numbers["phiw"]["information"]["narrower_by"] == 10.0


def test_markers_become_motions(tmp_path):
    markers = tmp_path / "nothing.csv"
    markers.write_text("t,a.x,a.y,a.z\n0,0,0,0\n")
    with pytest.raises(phiw.InputError, match="nothing.csv"):
        phiw.retarget(phiw.examples.robot("upper_body18"), markers, tmp_path / "out", format="npz")
    with pytest.raises(phiw.InputError, match='format="bvh" is not known'):
        phiw.retarget(phiw.examples.robot("upper_body18"), markers, tmp_path / "out", format="bvh")


def test_a_map_says_what_columns_mean(robot, logs, tmp_path):
    """Degrees under other names, in arrays and in a file."""
    columns = {"stamp": logs[0]["t"]}
    for i, joint in enumerate(robot.joints):
        columns[f"pos_{i}"] = np.degrees(logs[0]["q"][:, i])
        columns[f"trq_{i}"] = logs[0]["tau"][:, i]
    map_ = tmp_path / "map.toml"
    map_.write_text(
        f'time = "stamp"\njoints = {json.dumps(robot.joints)}\n'
        '[every_joint]\nq = { column = "pos_{index}", unit = "deg" }\ntau = "trq_{index}"\n'
    )
    result = phiw.identify(robot, columns, map=map_, declare="viscous_friction")
    plain = phiw.identify(robot, logs[0], declare="viscous_friction")
    assert result.after.validate.relative == pytest.approx(plain.after.validate.relative, rel=1e-6)
    arrays = {"stamp": logs[0]["t"], "pos": np.degrees(logs[0]["q"]), "trq": logs[0]["tau"]}
    map_.write_text(map_.read_text().replace("_{index}", "[{index}]"))
    assert fitted(phiw.identify(robot, arrays, map=map_, declare="viscous_friction")) == fitted(result)
    columns = arrays
    np.savez(tmp_path / "log.npz", **columns)
    assert fitted(phiw.identify(robot, tmp_path / "log.npz", map=map_, declare="viscous_friction")) == fitted(result)
