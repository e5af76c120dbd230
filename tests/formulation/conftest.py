"""Robots whose clearances are tested."""

import pytest

from tests.formulation.test_clearance import BALL, LIMITS
from trajevo import load_robot


@pytest.fixture(scope="session")
def xarm():
    return load_robot("xarm7", limits=LIMITS)


@pytest.fixture(scope="session")
def ball(tmp_path_factory):
    """A slide with an arm that carries a ball."""
    file = tmp_path_factory.mktemp("ball") / "ball.urdf"
    file.write_text(BALL)
    return load_robot(file, limits=LIMITS)
