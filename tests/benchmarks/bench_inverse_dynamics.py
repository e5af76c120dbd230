"""Inverse dynamics of a batch, one thread: compiled by numba, Pinocchio's batch call, and a loop of `pin.rnea`."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np
import pinocchio as pin

from trajevo import load_robot
from trajevo.rnea_kernel import Inertias, kernel_of

STATES, REPEATS = 7200, 15
ROBOTS = {
    "puma560": {},
    "hybrid_manipulator": {},
    "ur5": {"tool": "tool0", "limits": {"acceleration": 10.0, "jerk": 100.0}},
}


def spent(call: Callable[[], object]) -> float:
    """CPU time of a call [s], the median of several."""
    times = []
    for _ in range(REPEATS):
        began = time.process_time()
        call()
        times.append(time.process_time() - began)
    return float(np.median(times))


def compared(name: str, model: Any) -> str:
    """The three ways on the same random states."""
    kernel, pool, data = kernel_of(model), pin.ModelPool(model, 1), model.createData()
    if kernel is None:
        raise SystemExit("numba is not installed: pip install 'trajevo[fast]'")
    states = np.random.default_rng(0).uniform(-2.0, 2.0, (3, STATES, model.nv))
    batch, compiled, inertias = np.empty_like(states[0]), np.empty_like(states[0]), Inertias.of(model)
    loop = spent(lambda: [pin.rnea(model, data, *state) for state in zip(*states, strict=True)])
    by_pool = spent(lambda: pin.rneaInParallel(1, pool, *(x.T for x in states), batch.T))
    by_kernel = spent(lambda: kernel(*states, compiled, *inertias))
    off = np.abs(compiled - batch).max() / np.abs(batch).max()
    each = [1e6 * seconds / STATES for seconds in (loop, by_pool, by_kernel)]
    return (
        f"{name}: loop {each[0]:.2f} µs, batch {each[1]:.2f} µs, compiled {each[2]:.3f} µs per state; compiled over batch "
        f"{by_pool / by_kernel:.1f} x, over the loop {loop / by_kernel:.1f} x; torques differ by {off:.0e} of the greatest"
    )


def main() -> None:
    """Print the ratios."""
    for name, arguments in ROBOTS.items():
        print(compared(name, load_robot(name, **arguments).model))


if __name__ == "__main__":
    main()
