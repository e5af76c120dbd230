"""CPU time of checking proof files over that of certifying their motions, in one run, in turn: `make bench-more`.

Random motions of three robots through four points, each certified alone, as `trajevo certify` does. Writing the file is
told apart. The program that checks is plain Python, certify compiled loops and numpy.
"""

from __future__ import annotations

import statistics
import tempfile
from pathlib import Path

import numpy as np
from compare import in_turn

from trajevo import ViaPoints, certify, load_robot
from trajevo.dynamics.inverse_dynamics import Dynamics
from trajevo.dynamics.rollout import Rollout
from trajevo.robot.payload import Payload
from trajevo.trajectory.interpolants import CubicSpline, QuinticSpline, SepticSpline
from trajevo.verification.check_proof import check

MOTIONS, ROUNDS = 6, 5
FREE = {"acceleration": np.inf, "jerk": np.inf}
ROBOTS = {
    "ur5": {"tool": "tool0", "limits": {"acceleration": 15.0, "jerk": 150.0}},
    "panda": {"lock": {"panda_finger_joint1": 0.0, "panda_finger_joint2": 0.0}, "limits": FREE, "tool": "panda_hand"},
    "hybrid_manipulator": {},
}


def motion(robot, seed: int) -> Rollout:
    """A random motion through four points with a load."""
    rng = np.random.default_rng(seed)
    lower, upper = np.maximum(robot.limits.lower, -2.5), np.minimum(robot.limits.upper, 2.5)
    points = 0.5 * (lower + upper) + rng.uniform(-0.3, 0.3, (4, robot.dof)) * (upper - lower)
    interpolant = (CubicSpline, QuinticSpline, SepticSpline)[seed % 3](ViaPoints(points), duration_bounds=(0.1, 20.0))
    times = rng.uniform(0.7, 1.3, (1, len(interpolant.variables))) * 10.0 ** rng.uniform(-0.3, 0.7)
    return Rollout(Dynamics(robot, Payload(2.0, (0.02, 0.0, 0.05))), interpolant(np.clip(times, 0.1, 20.0)))


def main() -> None:
    """Print the ratios."""
    every: list[float] = []
    for name, settings in ROBOTS.items():
        robot = load_robot(name, **settings)
        ratios, spent = [], []
        for seed in range(MOTIONS):
            rollout = motion(robot, seed)
            certificate = certify(rollout)
            with tempfile.TemporaryDirectory() as folder:
                file = Path(folder) / "motion.proof.json"
                certificate.write_proof(file)
                content = file.read_bytes()
                ways = (
                    lambda rollout=rollout: certify(rollout),
                    lambda content=content: check(content),
                    lambda certificate=certificate, file=file: certificate.write_proof(file),
                )
                found = np.median(in_turn(ways, ROUNDS), axis=0)
            ratios.append(float(found[1] / found[0]))
            spent.append(found)
        certified, checked, wrote = 1e3 * np.median(spent, axis=0)
        print(
            f"{name}: certify {certified:.1f} ms, check-proof {checked:.0f} ms, write_proof {wrote:.1f} ms; check over "
            f"certify {statistics.median(ratios):.1f} in the median, {max(ratios):.1f} at most of {MOTIONS} motions"
        )
        every += ratios
    print(f"all: {statistics.median(every):.1f} in the median, {max(every):.1f} at most (CPU, medians of {ROUNDS})")


if __name__ == "__main__":
    main()
