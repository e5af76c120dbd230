"""Load data in the conventions of controllers: published numbers of a KUKA load, and every convention back."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from trajevo import Payload
from trajevo.page.sheet.load_data import LoadData, abc_of, rotation_of

#: A published load at a KUKA flange.
MASS, CENTRE = 61.9051704, np.array([71.3568192, 28.8014107, 300.520]) / 1e3
ANGLES = np.radians([48.6009941, 88.1209564, -131.597839])
MOMENTS = np.array([4.42782593, 5.86921501, 8.46680546])


def kuka():
    turn = rotation_of(ANGLES)
    tensor = turn @ np.diag(MOMENTS) @ turn.T
    return LoadData.of(Payload(MASS, tuple(CENTRE), tuple(map(tuple, 0.5 * (tensor + tensor.T)))))


def test_the_tensor_of_a_published_kuka_load():
    load = kuka()
    expected = [[8.46487013, 0.00754801, 0.08777106], [0.00754801, 5.86836965, 0.03561477]]
    np.testing.assert_allclose(load.inertia[:2], expected, atol=5e-8)
    assert load.inertia[2, 2] == pytest.approx(4.43060662, abs=5e-8)
    flange = [[14.10701828, -0.11967807, -1.23973278], [-0.11967807, 11.77437461, -0.50019924]]
    np.testing.assert_allclose(load.about_frame[:2], flange, atol=5e-8)
    assert load.about_frame[2, 2] == pytest.approx(4.79716675, abs=5e-8)


def test_principal_moments_and_angles_give_the_tensor_back():
    rng = np.random.default_rng(1)
    for _ in range(50):
        turn = Rotation.random(random_state=int(rng.integers(1 << 30))).as_matrix()
        tensor = turn @ np.diag(rng.uniform(1.0, 1.9, 3)) @ turn.T
        load = LoadData.of(Payload(3.0, (0.0, 0.1, 0.0), tuple(map(tuple, 0.5 * (tensor + tensor.T)))))
        for axes in (rotation_of(load.angles), Rotation.from_quat(np.roll(load.quaternion, -1)).as_matrix()):
            np.testing.assert_allclose(axes @ np.diag(load.principal) @ axes.T, tensor, atol=1e-12)
        np.testing.assert_allclose(
            rotation_of(load.angles), Rotation.from_euler("ZYX", load.angles).as_matrix(), atol=1e-12
        )
        assert np.trace(load.axes) > 1.0  # a turn of less than 90°, the nearest of all orders


def test_angles_at_the_end_of_their_range():
    for angles in ([0.3, 0.5 * np.pi, 0.0], [-0.4, -0.5 * np.pi, 0.0], [3.0, 0.2, -3.0]):
        np.testing.assert_allclose(rotation_of(abc_of(rotation_of(np.array(angles)))), rotation_of(np.array(angles)))


def test_a_point_mass_has_no_turned_axes():
    load = LoadData.of(Payload(2.0, (0.0, 0.0, 0.1)))
    assert not load.angles.any()
    assert not load.principal.any()
    told = {name: text for name, text, _ in load.for_controllers()}
    assert "cog [0, 0, 100] mm; aom [1, 0, 0, 0]" in told["ABB"]
    assert "CoG [0, 0, 0.1] m" in told["Universal Robots"]
    assert "M 2 kg; X 0, Y 0, Z 100 mm; A 0, B 0, C 0°" in told["KUKA"]
