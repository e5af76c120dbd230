"""What bounds over pieces of motions are made of: loops and numpy give the same numbers to the bit."""

import numpy as np
import pytest

from trajevo import Dynamics, Payload, load_robot
from trajevo.base import jit
from trajevo.dynamics.complex_bounds import Bounds, EffortReach
from trajevo.dynamics.integrals.resolved import combined
from trajevo.dynamics.piece_bounds import _enclosed
from trajevo.trajectory.bernstein import gauss

ROBOTS = {
    "ur5": {"tool": "tool0", "limits": {"acceleration": 15.0, "jerk": 300.0}},
    "puma560": {},
    "hybrid_manipulator": {},
}


def of_both(compute):
    """What compiled loops find, and what numpy finds."""
    found = []
    for kind in ("compiled", "numpy"):
        with jit.one_kind(kind):
            found.append(compute())
    return found


@pytest.mark.parametrize("name", ROBOTS)
@pytest.mark.parametrize("pieces", [1, 9])
def test_bounds_of_efforts(name, pieces):
    """9 pieces x 16 ellipses are two whole blocks of rows and a part of one; the hybrid has joints that slide."""
    robot = load_robot(name, **ROBOTS[name])
    random = np.random.default_rng(pieces)
    motion = Bounds(*random.uniform(0.0, 2.0, (4, pieces, 16, robot.dof)))
    reach = EffortReach(Dynamics(robot, Payload(1.0) if name == "ur5" else Payload(0.0)))
    with np.errstate(over="ignore", invalid="ignore"):  # where screws get near their span there is no bound
        by_loops, by_numpy = of_both(lambda: reach.effort(motion))
    np.testing.assert_array_equal(by_loops, by_numpy)
    assert not (by_loops <= 0.0).any()


@pytest.mark.parametrize(("pieces", "columns"), [(1, 1), (30, 6), (7, 13)])
def test_enclosures(pieces, columns):
    random = np.random.default_rng(columns)
    values = random.normal(size=(pieces, 10, columns))
    magnitudes = np.abs(random.normal(size=(pieces, 16, columns))) * np.geomspace(1.0, 1e6, 16)[:, None]
    magnitudes[0, 3, 0], magnitudes[0, 0, -1] = np.nan, np.inf
    by_loops, by_numpy = of_both(lambda: _enclosed([values], [magnitudes]))
    for one, other in zip(by_loops, by_numpy, strict=True):
        np.testing.assert_array_equal(one, other)
    joined = of_both(lambda: _enclosed([values, values], [magnitudes, magnitudes]))
    for parts in joined:
        for whole, part in zip(parts, by_numpy, strict=True):
            np.testing.assert_array_equal(whole, np.concatenate([part, part], axis=1))


def test_enclosures_hold_what_the_magnitude_allows():
    """Of 1 / (2 + t) on [0, 1], whose magnitude on the ellipse with the sum of axes r is 1 / (2.5 - (r + 1/r) / 4)."""
    sums = np.geomspace(1.25, 256.0, 16)
    nearest = 2.5 - 0.25 * (sums + 1.0 / sums)
    with np.errstate(divide="ignore"):
        magnitude = np.where(nearest > 0.0, 1.0 / nearest, np.nan)
    values = 1.0 / (2.0 + gauss(10)[0])
    for lower, upper, slack in of_both(lambda: _enclosed([values[None, :, None]], [magnitude[None, :, None]])):
        assert lower[0, 0] <= 1.0 / 3.0 < 0.5 <= upper[0, 0]
        assert slack[0, 0] < 1e-11


@pytest.mark.parametrize("kind", [np.float64, np.complex128])
def test_sums_over_nodes(kind):
    random = np.random.default_rng(3)
    values = random.normal(size=(40, 11, 6)).astype(kind)
    if kind is np.complex128:
        values += 1e-20j * random.normal(size=values.shape)
    weights = random.normal(size=(5, 11))
    by_loops, by_numpy = of_both(lambda: combined(weights, values))
    np.testing.assert_array_equal(by_loops, by_numpy)
    np.testing.assert_allclose(by_numpy, np.einsum("um,pmf->upf", weights, values), rtol=1e-12, atol=1e-12)
    np.testing.assert_array_equal(of_both(lambda: combined(weights[2], values)), [by_numpy[2]] * 2)
