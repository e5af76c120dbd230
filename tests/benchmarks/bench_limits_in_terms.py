"""SLSQP with every limit in its terms against SLSQP with greatest values alone: the payload-time curve of Guo 2016.

Run: python tests/benchmarks/bench_limits_in_terms.py. Both search from the same starts with the same gradients.
"""

import time

import numpy as np

from trajevo.problems import HybridManipulator
from trajevo.solvers.gradient.sqp import WeightedSum, random_starts

PAYLOADS = (10.86, 12.0, 12.32)
TIME_ALONE = np.array([1.0, 0.0, 0.0, 0.0])


def least_times(in_terms):
    """CPU seconds, steps, and the least time for each payload."""
    began, steps, found = time.process_time(), 0, []
    for payload in PAYLOADS:
        problem = HybridManipulator(payload=payload, payload_model="weight_only", payload_bounds=(0.0, 13.0))
        search = WeightedSum(problem.in_terms() if in_terms else problem, TIME_ALONE)
        x = search.run(random_starts(problem, 1, 1)[0], 1e-9)
        F, G = problem.evaluate(x[None], return_values_of=["F", "G"])
        found.append(float(F[0, 0]) if G.max() <= 0.0 else float("inf"))
        steps += search.evaluations
    return time.process_time() - began, steps, found


if __name__ == "__main__":
    terms, greatest = least_times(True), least_times(False)
    for name, (seconds, steps, found) in (("in terms", terms), ("greatest", greatest)):
        times = ", ".join(f"{one:.5f}" for one in found)
        print(f"{name}: {seconds:.2f} s (CPU), {steps} values and gradients, least times {times} s")
    print(f"RATIO greatest values alone / limits in terms: {greatest[0] / terms[0]:.0f}")
