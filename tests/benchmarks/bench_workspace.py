"""Speed of the capacity over the workspace, as a ratio measured in one run: `make bench-more`.

Postures of a UR5's tool, pointing down, at 31 x 31 positions, from the same starts for every cell: in one batch of
arrays, and one by one by SciPy's bounded least squares with the exact Jacobian, of some cells and scaled up to all of
them. Both must reach the same cells. Then the whole search, with neighbours and masses.
"""

from __future__ import annotations

import numpy as np
from compare import cpu
from scipy.optimize import least_squares

from trajevo import load_robot
from trajevo.base.arrays import Array
from trajevo.capacity.workspace import ToolPlane, workspace_capacity
from trajevo.path.inverse_kinematics import Pose
from trajevo.path.levenberg_marquardt import TOLERANCE, JointRanges, PostureSolver
from trajevo.robot.kinematics import ToolKinematics

CELLS, STARTS, MEASURED, ROUNDS = 31, 18, 24, 5
DOWN = np.diag([1.0, -1.0, -1.0])
FREE = {"acceleration": np.inf, "jerk": np.inf}
FINGERS = {"panda_finger_joint1": 0.0, "panda_finger_joint2": 0.0}


def meets(kinematics: ToolKinematics, ranges: JointRanges, position: Array, start: Array) -> bool:
    """Whether SciPy's least squares lead from a start to a position of the tool."""

    def error(q: Array) -> Array:
        there, turned = kinematics.pose(q)
        return np.concatenate([there - position, (turned - DOWN).T.ravel() / np.sqrt(2.0)])

    def slopes(q: Array) -> Array:
        _, turned, jacobian = kinematics.pose_and_jacobian(q)
        turning = np.cross(jacobian[3:].T[:, None], turned.T).reshape(len(q), 9)
        return np.concatenate([jacobian[:3], turning.T / np.sqrt(2.0)])

    tight = {"xtol": 1e-14, "ftol": 1e-14, "gtol": 1e-14, "max_nfev": 100}
    found = least_squares(error, start, slopes, bounds=(ranges.lower, ranges.upper), **tight)
    return float(np.linalg.norm(found.fun[:3])) <= TOLERANCE and float(np.linalg.norm(found.fun[3:])) <= TOLERANCE


def main() -> None:
    robot = load_robot("ur5", tool="tool0", limits=FREE)
    plane = ToolPlane.around(Pose([0.0, 0.11, 0.3], DOWN), "xz", reach=0.9, cells=CELLS)
    positions = plane.positions.reshape(-1, 3)
    kinematics = ToolKinematics.of(robot)
    ranges = JointRanges.of(robot, kinematics)
    solver, repeated = PostureSolver(kinematics, ranges, DOWN), np.repeat(positions, STARTS, axis=0)
    starts = ranges.random(np.random.default_rng(0), len(repeated))
    found: list[Array] = []

    def batch() -> None:
        found[:] = [(solver(repeated, starts)[1] <= TOLERANCE).reshape(len(positions), -1).any(axis=1)]

    cells = np.random.default_rng(1).choice(len(positions), MEASURED, replace=False).tolist()
    reached = np.zeros(len(positions), dtype=bool)

    def one_by_one() -> None:
        for k in cells:
            tries = [meets(kinematics, ranges, positions[k], q) for q in starts[k * STARTS : (k + 1) * STARTS]]
            reached[k] = any(tries)

    batch()
    ours = float(np.median([cpu(batch) for _ in range(ROUNDS)]))
    theirs = cpu(one_by_one) * len(positions) / MEASURED
    print(f"UR5, {CELLS} x {CELLS} cells, {STARTS} starts each: {ours:.2f} s at once (median of {ROUNDS}, CPU)")
    print(f"SciPy's least squares, {MEASURED} cells measured and scaled up to {len(positions)}: {theirs:.0f} s")
    print(f"of these {MEASURED} cells the batch reaches {found[0][cells].sum()}, the loop {reached.sum()}")
    print(f"RATIO one by one / batch: {theirs / ours:.0f} (at least 100 is promised)")
    panda = load_robot("panda", tool="panda_hand_tcp", lock=FINGERS, limits=FREE)
    square = ToolPlane.around(Pose([0.0, 0.0, 0.5], DOWN), "xz", reach=0.9, cells=CELLS)
    for arm, where in ((robot, plane), (panda, square)):
        whole = cpu(lambda arm=arm, where=where: workspace_capacity(arm, where))
        print(f"{arm.name}, capacity of {CELLS} x {CELLS} cells, whole search: {whole:.1f} s (CPU)")


if __name__ == "__main__":
    main()
