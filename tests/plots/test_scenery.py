"""Obstacles and attached solids in pictures."""

import matplotlib.pyplot as plt
import numpy as np
import pytest

from tests.formulation.test_attached import POST, planar
from trajevo import optimise, plots
from trajevo.plots.scenery import scenery

SHAPES = {
    "box": {"size": [0.1, 0.2, 0.3]},
    "sphere": {"radius": 0.1},
    "cylinder": {"radius": 0.1, "length": 0.3},
    "capsule": {"radius": 0.1, "length": 0.3},
    "hull": {"points": [[0, 0, 0], [0.3, 0, 0], [0, 0.3, 0], [0, 0, 0.3]]},
    "plane": {},
}
VOLUMES = {"box": 0.006, "sphere": 4e-3 / 3 * np.pi, "cylinder": 3e-3 * np.pi, "hull": 0.0045}
VOLUMES["capsule"] = VOLUMES["sphere"] + VOLUMES["cylinder"]


@pytest.fixture(scope="module")
def best():
    others = [
        {"name": shape, "shape": shape, "position": [0.1 * k, -0.9, -0.5], "rpy": [0.1, 0.2, 0.3]} | sizes
        for k, (shape, sizes) in enumerate(SHAPES.items())
    ]
    others[-1] |= {"rpy": [0.0, 0.0, 0.0], "position": [0.0, 0.0, -0.4]}
    settings = {"population": 24, "generations": 12, "polish": False, "progress": False}
    front = optimise(planar(obstacles=[POST, *others]), seed=1, **settings)
    return front.pick("0")


def test_triangles_enclose_the_volume_of_their_solid(best):
    """By the divergence theorem, which also wants all of them to be counter-clockwise from outside."""
    surfaces = scenery(best, np.zeros(3), 2.0)
    assert len(surfaces) == 1 + len(SHAPES) + 2
    for name, surface in zip(SHAPES, surfaces[1:], strict=False):
        a, b, c = np.swapaxes(surface.triangles - surface.triangles.mean(axis=(0, 1)), 0, 1)
        volume = np.sum(a * np.cross(b, c)) / 6.0
        expected = VOLUMES.get(name, 2.0 * 2.0 * 0.008)
        assert 0.95 * expected < volume < 1.0001 * expected
    (floor,) = [surface for surface in surfaces if surface.endless]
    np.testing.assert_allclose(floor.triangles[..., 2].max(), -0.4)
    assert [surface.joint for surface in surfaces[-2:]] == [1, 2]
    np.testing.assert_allclose(np.ptp(surfaces[-2].triangles.reshape(-1, 3), axis=0), [0.46, 0.06, 0.06], rtol=0.01)


def test_stick_figures_show_them_too(best):
    ax = plots.stick_figure(best)
    assert len(ax.collections) == 9
    low, high = ax.get_ylim()
    assert low < -0.9 < high
    plt.close(ax.figure)
    assert not plots.stick_figure(best.rollout).collections  # a rollout knows of no scene
    plt.close("all")
