"""Speed of the payload diagram, as a ratio measured in one run: `make bench-more`.

A UR5 on a motion of 200 samples, 60 x 60 cells. The other side is a bisection to 1e-8 kg with one loop of `pin.rnea`
over the samples per payload tried; a few cells of it are measured and scaled up to all of them. Its masses must agree.
"""

from __future__ import annotations

import numpy as np
import pinocchio as pin
from compare import cpu

from trajevo import Payload, ViaPoints, load_robot
from trajevo.capacity.payload_diagram import payload_diagram
from trajevo.capacity.payload_effort import payload_effort
from trajevo.dynamics.inverse_dynamics import Dynamics
from trajevo.dynamics.rollout import Rollout
from trajevo.trajectory.interpolants import QuinticSpline

GRID, SAMPLES, CELLS, ROUNDS = 60, 200, 4, 5
HIGHEST, PRECISION = 100.0, 1e-8
DIRECTION = 0.3
POINTS = [[0.0, -1.2, 1.4, -1.7, -1.57, 0.0], [1.0, -0.9, 1.2, -1.9, -1.2, 0.8], [2.0, -1.3, 1.6, -1.8, -1.57, 0.0]]


def motion() -> Rollout:
    robot = load_robot("ur5", limits={"acceleration": np.inf, "jerk": np.inf}, tool="tool0")
    spline = QuinticSpline(ViaPoints(np.array(POINTS)), duration_bounds=(0.3, 5.0))
    x = np.zeros(len(spline.variables))
    x[:2] = 0.6
    return Rollout(Dynamics(robot, Payload(1.0)), spline(x[None]))


def bisection(rollout: Rollout, com: np.ndarray) -> float:
    """Greatest mass at a centre of mass, the payload attached to the model again for every mass tried."""
    robot = rollout.robot
    frame = robot.model.frames[robot.model.getFrameId(robot.tool)]
    states = list(zip(rollout.q[0], rollout.v[0], rollout.a[0], strict=True))

    def feasible(mass: float) -> bool:
        model = robot.model.copy()
        model.appendBodyToJoint(frame.parentJoint, pin.Inertia(mass, com, np.zeros((3, 3))), frame.placement)
        data = model.createData()
        return all((np.abs(pin.rnea(model, data, *state)) <= robot.limits.effort).all() for state in states)

    low, high = 0.0, HIGHEST
    while high - low > PRECISION:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if feasible(middle) else (low, middle)
    return low


def main() -> None:
    rollout = motion()
    segments = rollout.trajectory.breaks.shape[1] - 1
    samples = SAMPLES // segments
    own = Rollout(rollout.dynamics.sampled(samples), rollout.trajectory)
    count = own.q.shape[1]
    offsets = np.linspace(0.0, 0.4, GRID)
    found = {}

    def diagram(direction: float | None) -> None:
        effort = payload_effort(rollout, samples=samples)
        found[direction] = payload_diagram(effort, offsets, offsets, direction=direction)

    for direction in (DIRECTION, None):
        diagram(direction)
    given, worst = (float(np.median([cpu(lambda d=d: diagram(d)) for _ in range(ROUNDS)])) for d in (DIRECTION, None))
    cells = np.random.default_rng(1).integers(0, GRID, (CELLS, 2))
    each, apart = [], 0.0
    for row, column in cells:
        at = offsets[column] * np.array([np.cos(DIRECTION), np.sin(DIRECTION), 0.0]) + [0.0, 0.0, offsets[row]]
        masses = []
        each.append(cpu(lambda at=at, masses=masses: masses.append(bisection(own, at))))
        apart = max(apart, abs(masses[0] - found[DIRECTION].mass[row, column]))
    theirs = float(np.mean(each)) * GRID**2
    print(f"UR5, {count} samples, {GRID} x {GRID} cells: one direction {given:.3f} s, worst {worst:.3f} s (CPU)")
    print(f"bisection, {CELLS} cells measured and scaled up to {GRID**2}: {theirs:.1f} s; {apart:.1e} kg apart at most")
    print(f"RATIO bisection / diagram in one direction: {theirs / given:.0f} (at least 100 is promised)")
    print(f"RATIO bisection in one direction / diagram in the worst direction: {theirs / worst:.0f}")


if __name__ == "__main__":
    main()
