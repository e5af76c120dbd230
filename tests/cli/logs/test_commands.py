"""The commands that read logs: what they print and write, and mistakes in one sentence."""

import numpy as np
import pytest

from tests.capacity.identification.test_identify import ROBOT, TRUE, log
from tests.capacity.test_fit_drives import ARM, COULOMB, GAIN, NAMES, VISCOUS, efforts, motion, write
from tests.helpers import trajevo
from trajevo import load_robot
from trajevo.base.plain import from_toml
from trajevo.base.toml import toml_text


def table_of(given, robot=ROBOT):
    columns = {"time [s]": given["time"]}
    for word, unit in (("position", "rad"), ("effort", "N*m")):
        columns |= {f"{name} {word} [{unit}]": given[word][:, k] for k, name in enumerate(robot.joint_names)}
    return columns


def test_a_payload_is_found_told_and_written_for_a_task(tmp_path):
    file, found = tmp_path / "log.csv", tmp_path / "payload.toml"
    write(file, table_of(log(TRUE, np.random.default_rng(1))))
    told = trajevo("identify-payload", file, "ur5", "--tool", "tool0", "--out", found)
    assert told.returncode == 0, told.stderr
    assert "2.30" in told.stdout
    assert "Ixx" in told.stdout
    assert "robust_problem" in told.stdout
    payload = from_toml(found.read_text())["payload"]
    assert payload["mass"] == pytest.approx(TRUE.mass, abs=0.02)
    assert payload["com"] == pytest.approx(TRUE.com, abs=3e-3)
    assert np.shape(payload["inertia"]) == (3, 3)
    known = trajevo("identify-payload", file, "ur5", "--tool", "tool0", "--mass", "2.3", "--friction")
    assert known.returncode == 0, known.stderr
    assert "2.3 kg, as given" in known.stdout


def test_drives_are_fitted_told_and_written_for_a_task(tmp_path):
    t, q, v, a = motion(np.random.default_rng(0))
    current = (efforts(load_robot(ARM), q, v, a) + VISCOUS * v + COULOMB * np.sign(v)) / GAIN
    columns = {"time [s]": t} | {f"{name} position [rad]": q[:, k] for k, name in enumerate(NAMES)}
    columns |= {"elbow current [A]": current[:, 1]}
    file, found = write(tmp_path / "log.csv", columns), tmp_path / "drives.toml"
    told = trajevo("fit-drives", file, ARM, "--out", found)
    assert told.returncode == 0, told.stderr
    assert "torque_per_current" in told.stdout
    assert "N·m/A" in told.stdout
    robot = from_toml(found.read_text())["robot"]
    assert robot["drives"]["elbow"]["torque_constant"] == pytest.approx(0.1, rel=1e-3)
    again = load_robot(ARM, **robot)
    assert again.friction.coulomb[1] == pytest.approx(COULOMB[1], rel=1e-3)


@pytest.mark.parametrize("command", ["identify-payload", "fit-drives"])
def test_mistakes_are_told_in_a_sentence_and_nothing_is_written(tmp_path, command):
    file, out = tmp_path / "log.csv", tmp_path / "found.toml"
    write(file, table_of(log(TRUE)) | {"speed [m/s]": np.zeros(500)})
    for options, says in (
        ((tmp_path / "lag.csv", "ur5", "--tool", "tool0"), "no such file; did you mean"),
        ((file, "ur5", "--tool", "tool0"), "unknown column 'speed [m/s]'"),
        ((file, "ur"), "unknown robot"),
        ((file, "ur5", "--tool", "tool9"), "tool9"),
    ):
        wrong = trajevo(command, *options, "--out", out)
        assert wrong.returncode == 2
        assert says in wrong.stderr
    assert not out.exists()


def test_tables_are_written_as_they_are_read():
    content = {"robot": {"drives": {"joint one": {"torque_constant": 0.125, "source": 'a "log"'}}, "name": "two"}}
    assert from_toml(toml_text(content)) == content
