"""Payload over speed, load and duty: every cell is a capacity of its own, whoever computes it."""

import numpy as np
import pytest

from tests.capacity.test_drive_capacity import ARM
from trajevo import (
    DaskCluster,
    Dynamics,
    InProcess,
    Payload,
    Processes,
    QuinticSpline,
    Rollout,
    ViaPoints,
    capacity_study,
    full_capacity,
    load_robot,
    plots,
)
from trajevo.errors import InvalidInputError, UnknownNameError

SPEEDS, DUTIES = [0.5, 1.0, 1.3], [1.0, 0.4]
LOADS = {"at the tool": Payload(1.0), "further out": Payload(1.0, com=(0.2, 0.0, 0.0))}


@pytest.fixture(scope="module")
def motion():
    drives = {
        name: {"torque_speed": [[0.0, torque], [10.0, 0.0]], "continuous_torque": 0.55 * torque}
        for name, torque in (("shoulder", 120.0), ("elbow", 40.0))
    }
    robot = load_robot(ARM, drives=drives)
    spline = QuinticSpline(ViaPoints(np.array([[-np.pi / 2, 0.0], [0.0, np.pi / 2]])), duration_bounds=(0.3, 5.0))
    x = np.array([[1.5] + [0.0] * (len(spline.variables) - 1)])
    return Rollout(Dynamics(robot, Payload(0.5)), spline(x))


@pytest.fixture(scope="module")
def study(motion):
    return capacity_study(motion, speeds=SPEEDS, loads=LOADS, duties=DUTIES)


def test_every_cell_is_the_capacity_of_its_motion_load_and_rest(motion, study):
    assert study.shape == (3, 2, 2)
    assert study.duties.tolist() == sorted(DUTIES)
    for s, speed in enumerate(study.speeds.tolist()):
        for load, payload in enumerate(LOADS.values()):
            for d, duty in enumerate(study.duties.tolist()):
                duration = 1.5 / speed
                slower = Rollout(Dynamics(motion.robot, payload), motion.trajectory.slowed(1.0 / speed))
                alone = full_capacity(slower, dwell=duration / duty - duration)
                found = study.at(s, load, d)
                assert found.mass == pytest.approx(alone.mass, rel=1e-12)
                assert (found.cause, found.place) == (alone.cause, alone.place)
                assert study.mass[s, load, d] == found.mass
                assert study.by("rms_torque")[s, load, d] == pytest.approx(alone.by("rms_torque"), rel=1e-12)
                assert study.cycle_times[s, d] == pytest.approx(duration / duty)


def test_faster_further_out_and_with_less_rest_it_carries_less(study):
    assert (np.diff(study.mass, axis=0) < 0.0).all()
    assert (study.mass[:, 1] < study.mass[:, 0]).all()
    assert (np.diff(study.mass, axis=2) <= 0.0).all()
    assert study.per_hour[1, 0, 0] == pytest.approx(study.mass[1, 0, 0] * 3600.0 / (1.5 / 0.4))


def test_the_load_of_the_motion_is_taken_if_none_is_given(motion, study):
    own = capacity_study(motion, speeds=[1.0])
    assert own.loads == ("as it is",)
    assert own.mass[0, 0, 0] == study.mass[1, 0, 1]


@pytest.mark.parametrize(
    "engine",
    [
        InProcess,
        lambda: Processes(1),
        pytest.param(lambda: Processes(2), marks=pytest.mark.long),
        pytest.param(lambda: DaskCluster(2), marks=pytest.mark.long),
    ],
    ids=["one after the other", "a process", "processes", "a cluster"],
)
def test_other_engines_find_the_same_to_the_bit(motion, engine):
    own = capacity_study(motion, speeds=[1.0, 1.3], duties=[0.5])
    other = capacity_study(motion, speeds=[1.0, 1.3], duties=[0.5], engine=engine())
    assert np.array_equal(own.mass, other.mass)
    assert own.cause.tolist() == other.cause.tolist()


def test_the_text_counts_what_binds(study):
    bound = {cause: int((study.cause == cause).sum()) for cause in set(study.cause.ravel())}
    assert str(study).startswith("3 speeds x 2 loads x 2 duties: ")
    assert f"torque at speed in {bound['torque_at_speed']}" in str(study)
    assert "further out" in study._repr_html_()


def test_a_picture_has_a_line_for_each_duty_and_a_marker_for_each_cell(study):
    ax = plots.payload_by_duty(study, load="further out")
    assert ax.get_ylabel() == "largest payload [kg]"
    drawn = [line for line in ax.lines if line.get_label().endswith("% of the time in motion")]
    assert [line.get_ydata().tolist() for line in drawn] == study.mass[:, 1].T.tolist()
    assert sum(len(line.get_xdata()) for line in ax.lines if line not in drawn) == study.mass[:, 1].size
    with pytest.raises(UnknownNameError, match="load"):
        plots.payload_by_duty(study, load="near")


BAD = {
    "no engine": ({"engine": "dask"}, "engine: expected an engine such as Processes(2) or DaskCluster(2), got 'dask'"),
    "no speed": ({"speeds": []}, "speeds: expected positive numbers, at least one, got []"),
    "a speed of 0": ({"speeds": [0.0, 1.0]}, "speeds: expected positive numbers"),
    "a duty above 1": ({"duties": [1.2]}, "duties: expected shares above 0 up to 1, at least one, got [1.2]"),
    "no load": ({"loads": {}}, "loads: expected a mapping from names to payloads"),
    "a mass": ({"loads": {"box": 3.0}}, "loads: 'box': expected a trajevo.Payload, got float"),
    "far too many": ({"speeds": np.linspace(0.1, 1.0, 400), "duties": np.linspace(0.1, 1.0, 400)}, "at most 100000"),
}


@pytest.mark.parametrize(("given", "says"), BAD.values(), ids=BAD)
def test_bad_input_is_one_sentence(motion, given, says):
    with pytest.raises(InvalidInputError) as told:
        capacity_study(motion, **({"speeds": [1.0]} | given))
    assert says in str(told.value)
