"""Speed of the capacity over the workspace, as a ratio measured in one run: `make bench-more`.

Postures of a UR5's tool, pointing down, at 31 x 31 positions, for every cell from the starts that `inverse_kinematics`
draws: in one batch of arrays, and cell by cell, of which some are measured and scaled up to all of them. Both must
reach the same cells. Then the whole search, with neighbours and masses.
"""

from __future__ import annotations

import contextlib

import numpy as np
from compare import cpu

from trajevo import load_robot
from trajevo.capacity.workspace import ToolPlane, workspace_capacity
from trajevo.errors import UnreachableError
from trajevo.path.inverse_kinematics import Pose, inverse_kinematics
from trajevo.path.postures import solve_postures

CELLS, STARTS, MEASURED, ROUNDS = 31, 16, 24, 5
DOWN = np.diag([1.0, -1.0, -1.0])
FREE = {"acceleration": np.inf, "jerk": np.inf}
FINGERS = {"panda_finger_joint1": 0.0, "panda_finger_joint2": 0.0}


def main() -> None:
    robot = load_robot("ur5", tool="tool0", limits=FREE)
    plane = ToolPlane.around(Pose([0.0, 0.11, 0.3], DOWN), "xz", reach=0.9, cells=CELLS)
    positions = plane.positions.reshape(-1, 3)
    lower, upper = robot.limits.lower, robot.limits.upper
    # As inverse_kinematics does with the number of the cell as its seed: twice the middle, then random ones.
    random = [np.random.default_rng(k).uniform(lower, upper, (STARTS, robot.dof)) for k in range(len(positions))]
    middles = np.tile(0.5 * (lower + upper), (2, 1))
    starts = np.concatenate([np.concatenate([middles, drawn]) for drawn in random])
    repeated = np.repeat(positions, STARTS + 2, axis=0)
    found: list[np.ndarray] = []

    def batch() -> None:
        found[:] = [solve_postures(robot, repeated, DOWN, starts)[1].reshape(len(positions), -1).any(axis=1)]

    cells = np.random.default_rng(1).choice(len(positions), MEASURED, replace=False).tolist()
    reached = np.zeros(len(positions), dtype=bool)

    def one_by_one() -> None:
        for k in cells:
            with contextlib.suppress(UnreachableError):
                inverse_kinematics(robot, [Pose(positions[k], DOWN)], seed=k, starts=STARTS)
                reached[k] = True

    batch()
    ours = float(np.median([cpu(batch) for _ in range(ROUNDS)]))
    theirs = cpu(one_by_one) * len(positions) / MEASURED
    print(f"UR5, {CELLS} x {CELLS} cells, {STARTS + 2} starts each: {ours:.2f} s at once (median of {ROUNDS}, CPU)")
    print(f"inverse_kinematics, {MEASURED} cells measured and scaled up to {len(positions)}: {theirs:.0f} s")
    print(f"of these {MEASURED} cells the batch reaches {found[0][cells].sum()}, the loop {reached.sum()}")
    print(f"RATIO cell by cell / batch: {theirs / ours:.0f} (at least 100 is promised)")
    panda = load_robot("panda", tool="panda_hand_tcp", lock=FINGERS, limits=FREE)
    square = ToolPlane.around(Pose([0.0, 0.0, 0.5], DOWN), "xz", reach=0.9, cells=CELLS)
    for arm, where in ((robot, plane), (panda, square)):
        whole = cpu(lambda arm=arm, where=where: workspace_capacity(arm, where))
        print(f"{arm.name}, capacity of {CELLS} x {CELLS} cells, whole search: {whole:.1f} s (CPU)")


if __name__ == "__main__":
    main()
