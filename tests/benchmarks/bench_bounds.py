"""What bounds of fronts cost by the number of segment times: `python tests/benchmarks/bench_bounds.py [2 3 4 5]`."""

import sys

import numpy as np

from trajevo import ViaPointProblem, optimise
from trajevo.problems import PointingMechanism
from trajevo.problems.pointing_mechanism import TABLE_4_POINTS_DEG

#: The paper's five directions of the pointing mechanism and a sixth one along the same arc: azimuth and pitch [deg].
DIRECTIONS_DEG = (*TABLE_4_POINTS_DEG, (255.0, 45.0))

#: Interpolants, numbers of segment times, gap that is asked for [1] and CPU time [s].
INTERPOLANTS, TIMES, GAP, CPU_TIME = ("hybrid", "quintic_spline"), (2, 3, 4, 5), 0.01, 600.0


def problem_of(times: int, interpolant: str) -> ViaPointProblem:
    """Time, acceleration and jerk of the pointing mechanism's robot through the first directions."""
    points = PointingMechanism(points=np.radians(DIRECTIONS_DEG)).interpolant.points.positions
    return ViaPointProblem(
        robot="pointing_mechanism",
        points=points[: times + 1],
        duration_bounds=(1.0, 10.0),
        interpolant=interpolant,
        objectives=("time", "acceleration", "jerk"),
    )


def main() -> None:
    """Print a table: times, cells, what the front misses at most and at least, how it ended, CPU time."""
    wanted = [int(word) for word in sys.argv[1:]] or TIMES
    for interpolant in INTERPOLANTS:
        print(f"{interpolant}, times: cells, misses at most [%], at least [%], beaten by at most [%], ended, CPU [s]")
        for times in wanted:
            front = optimise(problem_of(times, interpolant), seed=1, progress=False)
            bound = front.gap(gap=GAP, cpu_time=CPU_TIME)
            beaten = 100.0 * np.nanmax(bound.better)
            print(
                f"{times}: {bound.cells}, {100.0 * bound.gap:.3g}, {100.0 * bound.missing:.2g}, {beaten:.3g}, "
                f"{bound.ended}, {bound.cpu_time:.1f}",
                flush=True,
            )


if __name__ == "__main__":
    main()
