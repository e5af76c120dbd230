"""Inverse dynamics of a batch, one thread: compiled by numba, Pinocchio's batch call, and a loop of `pin.rnea`."""

from __future__ import annotations

from typing import Any

import numpy as np
import pinocchio as pin
from compare import cpu

from trajevo import load_robot
from trajevo.rnea_kernel import Inertias, kernel_of

STATES, REPEATS = 7200, 15
ROBOTS = {
    "puma560": {},
    "hybrid_manipulator": {},
    "ur5": {"tool": "tool0", "limits": {"acceleration": 10.0, "jerk": 100.0}},
}


def compared(name: str, model: Any) -> str:
    """The three ways on the same random states."""
    kernel, pool, data = kernel_of(model), pin.ModelPool(model, 1), model.createData()
    if kernel is None:
        raise SystemExit("numba is not installed: pip install 'trajevo[fast]'")
    states = np.random.default_rng(0).uniform(-2.0, 2.0, (3, STATES, model.nv))
    batch, compiled, inertias = np.empty_like(states[0]), np.empty_like(states[0]), Inertias.of(model)
    ways = (
        lambda: [pin.rnea(model, data, *state) for state in zip(*states, strict=True)],
        lambda: pin.rneaInParallel(1, pool, *(x.T for x in states), batch.T),
        lambda: kernel(*states, compiled, *inertias),
    )
    # Taken in turn, so that what else the machine does meets all three.
    seconds = np.array([[cpu(way) for way in ways] for _ in range(REPEATS)])
    loop, by_pool, by_kernel = 1e6 * np.median(seconds, axis=0) / STATES
    off = np.abs(compiled - batch).max() / np.abs(batch).max()
    return (
        f"{name}: loop {loop:.2f} µs, batch {by_pool:.2f} µs, compiled {by_kernel:.3f} µs per state; over the batch "
        f"{by_pool / by_kernel:.1f} x, over the loop {loop / by_kernel:.1f} x; torques differ by {off:.0e} of the most"
    )


def main() -> None:
    """Print the ratios."""
    for name, arguments in ROBOTS.items():
        print(compared(name, load_robot(name, **arguments).model))


if __name__ == "__main__":
    main()
