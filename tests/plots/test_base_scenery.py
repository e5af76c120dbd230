"""A robot whose base moved, and obstacles around it, as pictures and pages draw them: where they are in the cell."""

import base64
import gzip
from types import SimpleNamespace

import numpy as np
import pytest

from trajevo import load_problem, load_robot
from trajevo.page.members import motions_of
from trajevo.page.packing import Packed
from trajevo.plots.scenery import BaseInCell, scenery, triangles_of

DOWN = [np.pi, 0.0, 0.0]
POINTS = [{"position": [0.3, -0.2, 0.2], "rpy": DOWN}, {"position": [0.3, 0.3, 0.2], "rpy": DOWN}]


@pytest.fixture(scope="module")
def problem():
    return load_problem(
        "via-points",
        robot=load_robot("ur5", tool="tool0", limits={"acceleration": 14.0, "jerk": 140.0}),
        points=POINTS,
        base={"moving": {"x": [-0.2, 0.1], "yaw": [-0.5, 0.5]}},
        scene={
            "obstacles": [
                {
                    "shape": "box",
                    "name": "post",
                    "size": [0.1, 0.2, 0.3],
                    "position": [0.5, 0.0, 0.1],
                    "rpy": [0, 0, 0.4],
                }
            ]
        },
        interpolant="quintic_spline",
    )


MOVED = np.array([1.0, -0.15, 0.3])


def test_obstacles_are_drawn_where_they_are_and_the_robot_where_it_stands(problem):
    rollout = problem.rollout(MOVED)
    motion = SimpleNamespace(front=SimpleNamespace(problem=problem), rollout=rollout)
    (surface,) = scenery(motion, np.zeros(3), 1.0)
    (post,) = (constraint.function.collision.scene.obstacles[0] for constraint in problem.constraints[-2:-1])
    np.testing.assert_allclose(surface.triangles, triangles_of(post) @ post.rotation.T + post.position, atol=1e-12)
    ends = rollout.robot.tool_poses(rollout.trajectory.sample(2).q[0])[0]
    np.testing.assert_allclose(BaseInCell.of(rollout)(ends), [point["position"] for point in POINTS], atol=2e-6)


def test_the_page_moves_the_base_of_every_motion(problem):
    rollout = problem.rollout(np.stack([MOVED, [1.0, 0.05, -0.2]]))
    members = motions_of(rollout, pack := Packed())
    place = members["bases"]
    numbers = np.frombuffer(gzip.decompress(base64.b64decode(pack.text())), "<f4", 32, place["at"])
    matrices = numbers.reshape(2, 4, 4).swapaxes(1, 2).astype(float)
    tool = rollout.robot.tool_poses(rollout.trajectory.sample(2).q.reshape(4, -1))[0].reshape(2, 2, 3)
    placed = np.einsum("bij,bkj->bki", matrices[:, :3, :3], tool) + matrices[:, None, :3, 3]
    np.testing.assert_allclose(placed, np.tile([point["position"] for point in POINTS], (2, 1, 1)), atol=2e-6)
