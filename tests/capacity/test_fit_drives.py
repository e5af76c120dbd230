"""Drives fitted to logs: error bars that hold, what a log does not tell, and logs that are refused."""

import numpy as np
import pytest

from tests.helpers import mostly_long, refused
from trajevo import Dynamics, Payload, fit_drives, load_robot

ARM = "tests/data/two_link_drives"
GAIN, VISCOUS, COULOMB = np.array([15.0, 10.0]), np.array([2.0, 1.0]), np.array([4.0, 1.5])
GEARS = {"shoulder": {"efficiency_driving": 0.75}, "elbow": {"efficiency_driving": 0.7}}
FRICTION = {
    "viscous": {"shoulder": VISCOUS[0], "elbow": VISCOUS[1]},
    "coulomb": {"shoulder": COULOMB[0], "elbow": COULOMB[1]},
}
NAMES, OHM, STANDBY = ("shoulder", "elbow"), np.array([0.5, 0.8]), 90.0


def motion(rng, count=1500, step=0.01):
    """Instants of a log and periodic motions: sums of sines, with exact derivatives."""
    t = step * np.arange(count)
    waves = 2.0 * np.pi / t[-1] * np.arange(1, 8)
    sizes, phases = 0.5 * rng.normal(size=(2, 7)) / np.sqrt(np.arange(1, 8)), rng.uniform(0.0, 2.0 * np.pi, (2, 7))
    angles = waves * t[:, None, None] + phases
    q, v = (sizes * np.sin(angles)).sum(axis=2), (sizes * waves * np.cos(angles)).sum(axis=2)
    return t, q, v, (-sizes * waves**2 * np.sin(angles)).sum(axis=2)


def efforts(robot, q, v, a):
    return Dynamics(robot, Payload(0.0)).effort(q[None], v[None], a[None])[0]


def write(file, columns):
    """A log, as a spreadsheet writes it."""
    file.write_text(
        "\n".join(
            [",".join(columns), *(",".join(map(repr, row)) for row in np.column_stack([*columns.values()]).tolist())]
        )
    )
    return file


def positions(rng, t, q):
    noisy = q + rng.normal(scale=1e-5, size=q.shape)
    return {"time [s]": t} | {f"{name} position [deg]": np.rad2deg(noisy[:, k]) for k, name in enumerate(NAMES)}


def currents(file, seed, *, gears=None):
    robot, rng = load_robot(ARM, drives=gears or {}), np.random.default_rng(seed)
    t, q, v, a = motion(rng)
    load = efforts(load_robot(ARM), q, v, a) + VISCOUS * v + COULOMB * np.sign(v)
    eta = np.array([0.75, 0.7]) if gears else np.ones(2)
    torque = np.where(load * v > 0.0, load / eta, load * eta)
    noisy = torque / GAIN + rng.normal(scale=0.1, size=q.shape)
    columns = positions(rng, t, q) | {f"{name} current [A]": noisy[:, k] for k, name in enumerate(NAMES)}
    return fit_drives(write(file, columns), robot)


def powers(file, seed, recuperation="shared"):
    robot = load_robot(ARM, drives=GEARS, friction=FRICTION, supply={"recuperation": recuperation})
    rng = np.random.default_rng(seed)
    t, q, v, a = motion(rng)
    load, eta = efforts(robot, q, v, a), np.array([0.75, 0.7])
    torque = np.where(load * v > 0.0, load / eta, load * eta)
    power = (torque * v + OHM * (torque / GAIN) ** 2).sum(axis=1)
    power = power if recuperation == "full" else np.maximum(power, 0.0)
    columns = positions(rng, t, q) | {"power [W]": STANDBY + power + rng.normal(scale=3.0, size=len(t))}
    return fit_drives(write(file, columns), robot)


TRUE_OF_CURRENTS = {
    (name, joint): value
    for name, values in (("torque_per_current", GAIN), ("viscous", VISCOUS), ("coulomb", COULOMB))
    for joint, value in zip(NAMES, values, strict=True)
}
TRUE_OF_POWER = {("standby_power", ""): STANDBY, ("mechanical_share", ""): 1.0} | {
    ("winding_loss", joint): value for joint, value in zip(NAMES, OHM / GAIN**2, strict=True)
}


@pytest.mark.parametrize("seeds", mostly_long([4, 100], 4))
@pytest.mark.parametrize(
    ("log", "true"), [(currents, TRUE_OF_CURRENTS), (powers, TRUE_OF_POWER)], ids=["currents", "power"]
)
def test_true_values_lie_in_the_intervals_of_19_logs_in_20(tmp_path, log, true, seeds):
    inside = dict.fromkeys(true, 0)
    for seed in range(seeds):
        found = log(tmp_path / "log.csv", seed)
        assert found.unknown == ()
        assert {(one.name, one.joint) for one in found.parameters} == set(true)
        for one in found.parameters:
            low, high = one.interval
            inside[one.name, one.joint] += low <= true[one.name, one.joint] <= high
            assert one.value == pytest.approx(true[one.name, one.joint], abs=6.0 * one.deviation)
    assert min(inside.values()) >= 0.9 * seeds - 1.0 * (seeds < 10), inside


def test_error_bars_are_as_wide_as_estimates_scatter(tmp_path):
    """Of 30 logs with the same motion they are the standard deviation of the estimates, to a third."""
    robot, rng = load_robot(ARM), np.random.default_rng(5)
    t, q, v, a = motion(rng, 700)
    current = (efforts(robot, q, v, a) + VISCOUS * v + COULOMB * np.sign(v)) / GAIN
    values, deviations = [], []
    for _ in range(30):
        noisy = current + rng.normal(scale=0.2, size=q.shape)
        columns = positions(rng, t, q) | {f"{name} current [A]": noisy[:, k] for k, name in enumerate(NAMES)}
        found = fit_drives(write(tmp_path / "log.csv", columns), robot)
        values.append([one.value for one in found.parameters])
        deviations.append([one.deviation for one in found.parameters])
    np.testing.assert_allclose(np.mean(deviations, axis=0), np.std(values, axis=0, ddof=1), rtol=0.45)


def test_gears_with_losses_are_reckoned_with(tmp_path):
    found = currents(tmp_path / "log.csv", 3, gears=GEARS)
    for (name, joint), value in TRUE_OF_CURRENTS.items():
        assert found.of(name, joint).value == pytest.approx(value, abs=5.0 * found.of(name, joint).deviation)


def test_mains_that_take_energy_back_are_used_whole(tmp_path):
    found = powers(tmp_path / "log.csv", 0, "full")
    for (name, joint), value in TRUE_OF_POWER.items():
        assert found.of(name, joint).value == pytest.approx(value, abs=5.0 * found.of(name, joint).deviation)
    assert (
        found.of("winding_loss", "elbow").deviation
        < powers(tmp_path / "log.csv", 0).of("winding_loss", "elbow").deviation
    )


def test_arrays_tell_what_a_file_with_them_does(tmp_path):
    t, q, v, a = motion(np.random.default_rng(1))
    current = (efforts(load_robot(ARM), q, v, a) + VISCOUS * v + COULOMB * np.sign(v)) / GAIN
    columns = {"time [s]": t} | {f"{name} position [rad]": q[:, k] for k, name in enumerate(NAMES)}
    columns |= {f"{name} current [A]": current[:, k] for k, name in enumerate(NAMES)}
    by_file = fit_drives(write(tmp_path / "log.csv", columns), load_robot(ARM))
    by_arrays = fit_drives({"time": t, "position": q, "current": current}, load_robot(ARM))
    assert by_arrays.parameters == by_file.parameters
    assert str(by_arrays).startswith("arrays, 1488 samples: torque_per_current of shoulder 1")


def test_what_is_fitted_loads_a_robot(tmp_path):
    found = currents(tmp_path / "log.csv", 0)
    robot = load_robot(ARM, **found.settings)
    assert robot.drives["elbow"].torque_constant == pytest.approx(0.1, rel=0.02)
    assert robot.friction.coulomb == pytest.approx(COULOMB, rel=0.2)
    by_power = powers(tmp_path / "log.csv", 0)
    robot = load_robot(ARM, **by_power.settings)
    assert robot.supply.standby == pytest.approx(90.0, rel=0.02)
    assert robot.drives["shoulder"].winding_resistance == pytest.approx(0.5, rel=0.2)
    assert robot.drives["shoulder"].torque_constant == 0.15


def test_the_text_has_units_and_two_digits_of_the_error(tmp_path):
    found = currents(tmp_path / "log.csv", 0)
    first = "log.csv, 1488 samples: torque_per_current of shoulder 15.023 ± 0.037 N·m/A; viscous of shoulder"
    assert str(found).startswith(first)
    assert "<td" in found._repr_html_()
    assert "15.023 ± 0.037 N·m/A" in found._repr_html_()


# --- what a log does not tell


def test_uneven_instants_are_taken_as_they_are(tmp_path):
    rng = np.random.default_rng(2)
    t, q, v, a = motion(rng, 3000, 0.005)
    kept = np.sort(rng.choice(3000, 1600, replace=False))
    t, q, v, a = t[kept], q[kept], v[kept], a[kept]
    current = (efforts(load_robot(ARM), q, v, a) + VISCOUS * v + COULOMB * np.sign(v)) / GAIN
    columns = positions(rng, t, q) | {"elbow current [A]": current[:, 1] + rng.normal(scale=0.05, size=len(t))}
    found = fit_drives(write(tmp_path / "log.csv", columns), load_robot(ARM))
    assert {one.joint for one in found.parameters} == {"elbow"}
    assert found.of("torque_per_current", "elbow").value == pytest.approx(10.0, rel=0.02)


def test_a_joint_that_does_not_move_is_told(tmp_path):
    rng = np.random.default_rng(2)
    t, q, v, a = motion(rng)
    for one in (q, v, a):
        one[:, 1] = 0.0
    current = (efforts(load_robot(ARM), q, v, a) + VISCOUS * v + COULOMB * np.sign(v)) / GAIN
    columns = positions(np.random.default_rng(0), t, q) | {
        f"{name} current [A]": current[:, k] for k, name in enumerate(NAMES)
    }
    columns["elbow position [deg]"] = np.zeros_like(t)
    found = fit_drives(write(tmp_path / "log.csv", columns), load_robot(ARM))
    assert {one.joint for one in found.parameters} == {"shoulder"}
    assert found.unknown == ("nothing is told of elbow, which does not move",)
    assert "nothing is told of elbow" in str(found)


def test_what_cannot_be_told_apart_is_told(tmp_path):
    """A joint that turns one way at one speed: viscous and dry friction are one number."""
    t = 0.01 * np.arange(1200)
    q, v = (
        np.stack([0.5 * t - 3.0, np.zeros_like(t)], axis=1),
        np.stack([np.full_like(t, 0.5), np.zeros_like(t)], axis=1),
    )
    current = (efforts(load_robot(ARM), q, v, np.zeros_like(v)) + VISCOUS * v + COULOMB * np.sign(v)) / GAIN
    current[:, 0] += np.random.default_rng(0).normal(scale=0.05, size=len(t))
    columns = {
        "time [s]": t,
        "shoulder position [rad]": q[:, 0],
        "elbow position [rad]": q[:, 1],
        "shoulder current [A]": current[:, 0],
    }
    found = fit_drives(write(tmp_path / "log.csv", columns), load_robot(ARM))
    assert found.unknown == ("shoulder: viscous friction and dry friction cannot be told apart in this log",)
    assert [one.name for one in found.parameters] == ["torque_per_current"]
    assert found.of("torque_per_current", "shoulder").value == pytest.approx(15.0, rel=0.02)
    refused(lambda: found.of("viscous", "shoulder"), "name: expected one of torque_per_current shoulder, got 'viscous ")


# --- logs that are refused


def rows(**changed):
    t, q, _, _ = motion(np.random.default_rng(0), 200)
    columns = {
        "time [s]": t,
        "shoulder position [rad]": q[:, 0],
        "elbow position [rad]": q[:, 1],
        "elbow current [A]": np.ones(200),
    } | changed
    return {name: values for name, values in columns.items() if values is not None}


@pytest.mark.parametrize(
    ("columns", "says"),
    [
        (rows(**{"elbow position [rad]": None}), r"log.csv: line 1: expected a column 'elbow position \[rad\]' too"),
        (rows(**{"time [s]": None}), r"log.csv: line 1: expected a column 'time \[s\]' too"),
        (
            rows(**{"elbow position [rad]": None, "elbow position [A]": np.ones(200)}),
            r"header with a unit such as 'elbow position \[rad\]'",
        ),
        (rows(**{"wrist current [A]": np.ones(200)}), r"line 1: unknown column 'wrist current \[A\]'; .*elbow current"),
        (rows(**{"time [s]": None, "t [s]": np.arange(200.0)}), r"unknown column 't \[s\]'; known: elbow acceleration"),
        (rows(**{"elbow current [A]": None}), r"expected either 'shoulder current \[A\]' .*, got neither"),
        (rows(**{"power [W]": np.ones(200)}), r"expected either .* or 'power \[W\]' of all motors, got both"),
        (rows(**{"time [s]": np.zeros(200)}), "expected instants that ascend, got 0 s after 0 s"),
        (
            {name: values[:20] for name, values in rows().items()},
            "expected at least 22 instants for a smoothing of 0.1 s, got",
        ),
        ({name: values[:1] for name, values in rows().items()}, "expected at least 8 instants, got 1"),
        (
            rows(**{"elbow current [A]": np.full(200, np.nan)}),
            "column 'elbow current': expected a finite number, got 'nan'",
        ),
    ],
    ids=["joint", "time", "unit", "unknown", "named", "neither", "both", "still", "short", "one", "nan"],
)
def test_other_logs_are_refused_with_a_sentence(tmp_path, columns, says):
    refused(lambda: fit_drives(write(tmp_path / "log.csv", columns), load_robot(ARM)), says)


def test_other_arguments_are_refused(tmp_path):
    log = write(tmp_path / "log.csv", rows())
    refused(
        lambda: fit_drives(tmp_path / "lag.csv", load_robot(ARM)), "lag.csv: no such file; did you mean '.*log.csv'"
    )
    for wrong in (5, None, b"log.csv", {"time": [0.0]}):
        refused(lambda wrong=wrong: fit_drives(wrong, load_robot(ARM)), "log: expected a file, or a mapping with time")
    for wrong in (1.0, "2 kg", [1, 2]):
        refused(lambda wrong=wrong: fit_drives(log, load_robot(ARM), payload=wrong), "payload: expected a trajevo.Pay")
    refused(lambda: fit_drives(log, 5), "robot: expected a name or the path of a folder, got 5")
    for wrong in (0.0, -1.0, np.nan, np.inf, "0.1 s", True):
        refused(
            lambda wrong=wrong: fit_drives(log, load_robot(ARM), smoothing=wrong), r"smoothing: expected a positive"
        )
    t, q, v, a = motion(np.random.default_rng(0))
    against = -efforts(load_robot(ARM), q, v, a)[:, 0] / 15.0
    columns = positions(np.random.default_rng(0), t, q) | {"shoulder current [A]": against}
    refused(
        lambda: fit_drives(write(tmp_path / "log.csv", columns), load_robot(ARM)),
        "log.csv: current of shoulder: expected a current in the direction of the torque, got the opposite one",
    )
