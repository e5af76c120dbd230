"""The payload diagram: every cell against the masses at its centres of mass, and the worst direction against many."""

import numpy as np
import pytest

from tests.capacity.test_payload_effort import ROBOTS, every_com_model, random_effort
from tests.helpers import refused
from trajevo.capacity.payload_diagram import payload_diagram

XY, Z = np.linspace(0.0, 0.4, 5), np.linspace(-0.1, 0.4, 4)
TURNS = np.linspace(0.0, 2.0 * np.pi, 721)


def at(xy, z, turn):
    return np.column_stack(np.broadcast_arrays(xy * np.cos(turn), xy * np.sin(turn), z))


@pytest.mark.thinned(5)
@pytest.mark.parametrize("name", ROBOTS)
@every_com_model
@pytest.mark.parametrize("speed", [0.3, 2.0])
def test_worst_direction_is_the_worst_of_many_and_is_reached(name, model, speed):
    effort = random_effort(name, np.random.default_rng(1), speed=speed, model=model)[1]
    diagram = payload_diagram(effort, XY, Z)
    assert diagram.worst
    for i, z in enumerate(Z):
        for k, xy in enumerate(XY):
            sampled = effort.mass_range(at(xy, z, TURNS))
            if np.isnan(sampled.upper).any():
                assert np.isnan(diagram.mass[i, k])
                continue
            if np.isnan(diagram.mass[i, k]):
                assert sampled.upper.min() - sampled.lower.max() < 1e-3 * sampled.upper.min()
                continue
            assert diagram.mass[i, k] <= sampled.upper.min() * (1.0 + 1e-12)
            assert diagram.mass[i, k] == pytest.approx(sampled.upper.min(), rel=1e-4)
            assert diagram.least[i, k] == pytest.approx(sampled.lower.max(), rel=1e-4)
            reached = effort.mass_range(at(xy, z, diagram.direction[i, k]))
            assert diagram.mass[i, k] == pytest.approx(reached.upper[0], rel=1e-9)
            assert (diagram.joint[i, k], diagram.time[i, k]) == (reached.joint[0], reached.time[0])


def test_a_given_direction_is_the_masses_there():
    effort = random_effort("ur5", np.random.default_rng(2), speed=0.3)[1]
    diagram = payload_diagram(effort, XY, Z, direction=0.7)
    assert not diagram.worst
    for i, z in enumerate(Z):
        found = effort.mass_range(at(XY, z, 0.7))
        np.testing.assert_array_equal(diagram.mass[i], found.upper)
        np.testing.assert_array_equal(diagram.joint[i], found.joint)
    assert (diagram.direction == 0.7).all()
    assert (payload_diagram(effort, XY, Z).mass <= diagram.mass * (1.0 + 1e-12)).all()


def test_on_the_axis_no_direction_is_worse():
    effort = random_effort("ur5", np.random.default_rng(3), speed=0.3)[1]
    worst, given = (payload_diagram(effort, [0.0], Z, direction=turn) for turn in (None, 1.0))
    np.testing.assert_allclose(worst.mass, given.mass, rtol=1e-12)


def test_turning_the_given_direction_over_all_gives_the_worst():
    effort = random_effort("panda", np.random.default_rng(4), speed=0.3)[1]
    each = [payload_diagram(effort, XY, Z, direction=turn).mass for turn in TURNS]
    np.testing.assert_allclose(payload_diagram(effort, XY, Z).mass, np.min(each, axis=0), rtol=1e-4)


def test_diagram_is_read_only():
    diagram = payload_diagram(random_effort("ur5", np.random.default_rng(5))[1], XY, Z)
    for name in ("offset_xy", "offset_z", "mass", "least", "joint", "time", "direction"):
        assert not getattr(diagram, name).flags.writeable, name
    assert XY.flags.writeable


def test_bad_input_is_refused():
    effort = random_effort("ur5", np.random.default_rng(6))[1]
    refused(lambda: payload_diagram(effort, [-0.1, 0.0], Z), "^offset_xy: expected distances from 0 on")
    refused(lambda: payload_diagram(effort, [0.1, 0.0], Z), "^offset_xy: expected rising offsets")
    refused(lambda: payload_diagram(effort, XY, []), "^offset_z: expected rising offsets")
    refused(lambda: payload_diagram(effort, XY, [[0.0]]), "^offset_z: expected shape")
    refused(lambda: payload_diagram(effort, XY, Z, direction=np.inf), "^direction: expected finite")
