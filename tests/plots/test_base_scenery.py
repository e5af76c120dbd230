"""Obstacles around a robot whose base moved, as pictures draw them: where the robot sees them."""

from types import SimpleNamespace

import numpy as np

from trajevo import load_problem, load_robot
from trajevo.plots.scenery import scenery, triangles_of

DOWN = [np.pi, 0.0, 0.0]


def test_obstacles_are_drawn_where_the_robot_sees_them():
    problem = load_problem(
        "via-points",
        robot=load_robot("ur5", tool="tool0", limits={"acceleration": 14.0, "jerk": 140.0}),
        points=[{"position": [0.3, -0.2, 0.2], "rpy": DOWN}, {"position": [0.3, 0.3, 0.2], "rpy": DOWN}],
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
    rollout = problem.rollout(np.array([1.0, -0.15, 0.3]))
    motion = SimpleNamespace(front=SimpleNamespace(problem=problem), rollout=rollout)
    (surface,) = scenery(motion, np.zeros(3), 1.0)
    turn = np.array([[np.cos(0.3), -np.sin(0.3), 0.0], [np.sin(0.3), np.cos(0.3), 0.0], [0.0, 0.0, 1.0]])
    in_cell = surface.triangles @ turn.T + [-0.15, 0.0, 0.0]
    (post,) = (constraint.function.collision.scene.obstacles[0] for constraint in problem.constraints[-2:-1])
    np.testing.assert_allclose(in_cell, triangles_of(post) @ post.rotation.T + post.position, atol=1e-12)
