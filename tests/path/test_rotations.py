"""Rotation matrices are SciPy's."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from trajevo.path.rotations import made_orthogonal, of_quaternion, of_rpy

RNG = np.random.default_rng(6)
#: Any angles, and eighths of a turn, where entries are 0 and greatest entries are equal.
ANGLES = [*RNG.uniform(-2.0 * np.pi, 2.0 * np.pi, (200, 3)), *(RNG.integers(-8, 9, (200, 3)) * np.pi / 4.0)]
#: Where a compiler may contract products and sums.
ROUNDED = {"rtol": 0.0, "atol": 1e-15}


def test_of_rpy():
    expected = Rotation.from_euler("xyz", ANGLES).as_matrix()
    np.testing.assert_allclose([of_rpy(angles) for angles in ANGLES], expected, **ROUNDED)


def test_of_quaternion():
    quaternions = [*RNG.normal(size=(200, 4)), *np.eye(4), *-np.eye(4)]
    expected = Rotation.from_quat(quaternions).as_matrix()
    np.testing.assert_allclose([of_quaternion(one) for one in quaternions], expected, **ROUNDED)


@pytest.mark.parametrize("decimals", [17, 13, 12, 9, 6, 4])
def test_made_orthogonal(decimals):
    rounded = np.round(Rotation.from_euler("xyz", ANGLES).as_matrix(), decimals)
    expected = Rotation.from_matrix(rounded).as_matrix()
    found = np.stack([made_orthogonal(one) for one in rounded])
    np.testing.assert_allclose(found, expected, **ROUNDED)
    np.testing.assert_allclose(found @ found.transpose(0, 2, 1), np.broadcast_to(np.eye(3), found.shape), atol=1e-14)
