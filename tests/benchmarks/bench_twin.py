"""How far trajevo and MuJoCo are apart, as docs/explanation/certificate.md tells: `make bench-more`.

The motions are those of `tests/verification/test_twin.py`, which has the bounds of what this prints.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np

from tests.twin import Twin
from tests.verification.test_twin import ROBOTS, Moved, dry_friction, random_states, rows_of
from trajevo import certify, dlcc


def exported(moved: Moved) -> tuple[float, float]:
    """Greatest difference of efforts [N·m] and tool positions [m] along the exported motion."""
    t, q, v, a, told = (moved.table[key] for key in ("time", "qpos", "qvel", "qacc", "force"))
    twin = Twin.of(moved.robot, moved.payload)
    effort = twin.effort(q, v, a) + dry_friction(moved.robot, t, q, v)
    q = np.concatenate([q, random_states(moved.robot, 1000)[0]])
    apart = moved.robot.tool_poses(q)[0] - twin.tool_poses(q)[0]
    return float(np.abs(told - effort).max()), float(np.abs(apart).max())


def used(moved: Moved, mass: float) -> float:
    """Greatest share of an effort limit with a payload of another mass [kg], by MuJoCo."""
    effort = moved.effort_with(moved.payload.with_mass(mass))
    return float((np.abs(effort) / moved.robot.limits.effort).max())


def main() -> None:
    """Print a row for every robot."""
    print(
        "robot     efforts N*m   tool m    peak/bound    mass kg    upper kg   used at mass   at 1.0002 upper   energy"
    )
    for name in ROBOTS:
        with tempfile.TemporaryDirectory() as folder:
            moved = Moved.of(name, Path(folder))
        effort, tool = exported(moved)
        bound = rows_of(certify(moved.solution), "effort")
        peak = (np.abs(moved.effort).max(axis=0) / bound).max()
        found = dlcc(moved.solution)
        shares = used(moved, found.mass), used(moved, 1.0002 * found.upper)
        energy = moved.solution.F["energy"] / moved.energy - 1.0
        print(
            f"{name:<9} {effort:>11.1e} {tool:>8.1e}   {peak:.9f}   {found.mass:.6f}   {found.upper:.6f}   "
            f"{shares[0]:.9f}    {shares[1]:.9f}       {energy:+.1e}"
        )


if __name__ == "__main__":
    main()
