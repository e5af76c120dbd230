import dataclasses

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import minimize_scalar

from tests.reference import SUN2020
from trajevo import JointLimits, TrajevoError, ViaPoints, load_robot
from trajevo.trajectory.interpolants import stop_and_go
from trajevo.trajectory.interpolants.sinusoidal import SINUSOIDAL

ROBOT = load_robot("pointing_mechanism")
PATH = ViaPoints(np.radians(SUN2020["joint_angles"]))

PROFILES = ["cycloidal", "double_s", "harmonic", "septic", "trapezoid", "trigonometric"]

#: Profiles whose acceleration steps, so that no jerk is limited.
STEPPING = ("harmonic", "trapezoid")


@pytest.mark.parametrize("profile", ["trapezoid", "double_s", "septic"])
def test_total_time_on_the_papers_path(profile):
    assert stop_and_go(PATH, ROBOT.limits, profile=profile).duration[0] == pytest.approx(
        SUN2020["stop_and_go"][profile], rel=1e-7
    )


@pytest.mark.parametrize("profile", PROFILES)
@pytest.mark.parametrize("scale", [1e-3, 1.0, 30.0])
def test_stops_at_every_point_under_the_limits_and_uses_one_fully(profile, scale):
    rng = np.random.default_rng(0)
    path = ViaPoints(scale * rng.normal(size=(6, 4)))
    v, a, j = (rng.uniform(0.5, 2.0, 4) for _ in range(3))
    limits = JointLimits(np.full(4, -np.inf), np.full(4, np.inf), v, a, j, np.full(4, np.inf))
    batch = stop_and_go(path, limits, profile=profile)
    checked = [(1, v), (2, a)] if profile in STEPPING else [(1, v), (2, a), (3, j)]
    ratios = np.stack([batch.peak(order)[0] / limit for order, limit in checked])
    assert ratios.max() == pytest.approx(1.0, abs=1e-9)
    stops = np.abs(batch.evaluate(batch.breaks[0], 1)[0]).max(axis=1) < 1e-7
    np.testing.assert_allclose(batch.evaluate(batch.breaks[0])[0, stops], path.positions, atol=1e-9 * scale)
    assert np.abs(batch.jump(0)).max() < 1e-9 * scale
    assert np.abs(batch.jump(1)).max() < 1e-8


def test_a_still_joint_and_a_short_hop_work():
    path = ViaPoints(np.array([[0.0, 1.0], [1e-6, 1.0]]))
    for profile in PROFILES:
        batch = stop_and_go(path, ROBOT.limits, profile=profile)
        np.testing.assert_array_equal(batch.peak(1)[0, 1], 0.0)


def test_bad_input_is_refused():
    with pytest.raises(
        TrajevoError, match="'scurve'; known: cycloidal, double_s, harmonic, septic, trapezoid, trigonometric"
    ):
        stop_and_go(PATH, ROBOT.limits, profile="scurve")
    with pytest.raises(TrajevoError, match="expected 3 joints as in the points, got 2"):
        stop_and_go(ViaPoints(np.eye(3)), ROBOT.limits, profile="septic")
    free = dataclasses.replace(ROBOT.limits, acceleration=np.full(2, np.inf))
    for profile in ("trapezoid", "double_s"):
        with pytest.raises(TrajevoError, match="finite acceleration limit"):
            stop_and_go(PATH, free, profile=profile)
    nothing = dataclasses.replace(free, velocity=np.full(2, np.inf), jerk=np.full(2, np.inf))
    with pytest.raises(TrajevoError, match="needs a finite"):
        stop_and_go(PATH, nothing, profile="septic")
    for profile in SINUSOIDAL:
        with pytest.raises(TrajevoError, match=f"profile '{profile}': needs a finite velocity"):
            stop_and_go(PATH, nothing, profile=profile)
    jerky = dataclasses.replace(free, velocity=np.full(2, np.inf))
    assert stop_and_go(PATH, jerky, profile="cycloidal").duration[0] > 0.0
    with pytest.raises(TrajevoError, match="profile 'harmonic': needs a finite velocity or acceleration limit"):
        stop_and_go(PATH, jerky, profile="harmonic")


def formula(u, profile):
    """Value of a unit profile by its textbook formula."""
    if profile == "cycloidal":
        return u - np.sin(2.0 * np.pi * u) / (2.0 * np.pi)
    return 0.5 * (1.0 - np.cos(np.pi * u)) if profile == "harmonic" else trigonometric_spline(u)


def trigonometric_spline(u):
    """Equations (7) and (8) of Raji 2022 for order 4 over half a turn: 8 conditions, which are rests at both ends."""
    gamma = 0.5 * np.pi

    def row(t, order):
        turned = 0.5 * np.pi * order
        powers = [k**order * np.cos(k * t + turned) for k in (1, 2, 3)]
        powers += [k**order * np.sin(k * t + turned) for k in (1, 2, 3)]
        return np.stack([np.full_like(t, float(order == 0)), *powers, 4**order * np.sin(4 * (t - gamma) + turned)])

    ends = np.array([0.0, np.pi])
    conditions = np.concatenate([row(ends, order).T for order in range(4)])
    coefficients = np.linalg.solve(conditions, np.array([0.0, 1.0, *np.zeros(6)]))
    return coefficients @ row(np.pi * np.asarray(u, dtype=float), 0)


@pytest.mark.parametrize("profile", SINUSOIDAL)
def test_sinusoidal_profiles_are_the_textbooks(profile):
    """The motion, its derivatives by differences of the formula, and its exact peaks, over 3 rad at 2 rad/s."""
    limits = JointLimits(*(np.full(1, value) for value in (-9.0, 9.0, 2.0, np.inf, np.inf, np.inf)))
    batch = stop_and_go(ViaPoints(np.array([[1.0], [4.0]])), limits, profile=profile)
    total, u = float(batch.duration[0]), np.linspace(0.0, 1.0, 301)
    shape = SINUSOIDAL[profile]
    assert total == pytest.approx(3.0 * shape.peaks[0] / 2.0, rel=1e-12)
    np.testing.assert_allclose(batch.evaluate(total * u)[0, :, 0], 1.0 + 3.0 * formula(u, profile), atol=1e-12)
    inner, step = np.linspace(0.05, 0.95, 91), 1e-3
    for order in (1, 2, 3):
        ahead, behind = shape.at(inner + step, order - 1), shape.at(inner - step, order - 1)
        np.testing.assert_allclose(shape.at(inner, order), (ahead - behind) / (2.0 * step), atol=3e-3 * 4.0**order)
        own = batch.evaluate(total * u, order)[0, :, 0] * total**order / 3.0
        np.testing.assert_allclose(own, shape.at(u, order), atol=1e-12 * 30.0**order)
        area = quad(lambda x, k=order: float(shape.at(np.array(x), k)), 0.0, 0.5)[0]
        at = shape.at(np.array([0.0, 0.5]), order - 1)
        assert area == pytest.approx(at[1] - at[0], rel=1e-9)


@pytest.mark.parametrize(
    ("profile", "peaks"),
    [
        ("cycloidal", (2.0, 2.0 * np.pi, 4.0 * np.pi**2)),
        ("harmonic", (np.pi / 2.0, np.pi**2 / 2.0)),
        ("trigonometric", (0.75 * np.pi, np.sqrt(0.75) * np.pi**2, 2.25 * np.pi**3)),
    ],
)
def test_peaks_of_sinusoidal_profiles_are_known_constants(profile, peaks):
    shape = SINUSOIDAL[profile]
    assert shape.peaks == pytest.approx(peaks, rel=1e-15)
    for order, peak in enumerate(shape.peaks, start=1):
        u = np.linspace(0.0, 1.0, 1001)
        near = u[np.abs(shape.at(u, order)).argmax()]
        found = minimize_scalar(
            lambda x, k=order: -abs(float(shape.at(np.array(x), k))),
            bounds=(max(near - 1e-3, 0.0), min(near + 1e-3, 1.0)),
            method="bounded",
            options={"xatol": 1e-12},
        )
        assert -found.fun == pytest.approx(peak, rel=1e-9)


@pytest.mark.parametrize("bound", ["velocity", "acceleration", "jerk"])
def test_least_times_of_sinusoidal_profiles_are_closed_forms(bound):
    order, limit, chord = {"velocity": 1, "acceleration": 2, "jerk": 3}[bound], 0.7, 0.9
    given = dict.fromkeys(("velocity", "acceleration", "jerk"), np.full(1, np.inf)) | {bound: np.full(1, limit)}
    limits = JointLimits(np.full(1, -np.inf), np.full(1, np.inf), effort=np.full(1, np.inf), **given)
    for profile, shape in SINUSOIDAL.items():
        if len(shape.peaks) >= order:
            batch = stop_and_go(ViaPoints(np.array([[0.2], [0.2 - chord]])), limits, profile=profile)
            assert batch.duration[0] == pytest.approx(
                (chord * shape.peaks[order - 1] / limit) ** (1.0 / order), rel=1e-12
            )
            assert batch.peak(order)[0, 0] == pytest.approx(limit, rel=1e-11)
