"""Is a motion that stops at some of its points ever faster? Least times for every choice of stops.

For the problems of ``bench_interpolants.py`` without torque limits, with the curves that are fastest there: the least
time without stops, the best of all choices of points at which the motion stops, and the least time of
double-S profiles that stop at every point. A choice of stops is a restriction, so that it can only win where the search
without it ends short of its optimum.
"""

from __future__ import annotations

from itertools import combinations

from bench_interpolants import INTERPOLANTS, problems, solved

from trajevo import ViaPointProblem, stop_and_go

#: Problems with inner points and without limits that double-S profiles do not know.
TITLES = ("three points, jerk 200", "three points, jerk 2000", "six points of a curve", "linear axes")

SHAPES = ("quintic_spline", "cubic", "cubic + 2")


def main() -> None:
    """Print the table."""
    print(
        f"{'problem':26}{'interpolant':>16}{'no stop [s]':>13}{'best with stops':>40}{'all stop':>12}{'double-S':>10}"
    )
    for title in TITLES:
        given = problems()[title]
        free = ViaPointProblem(**given, interpolant="cubic")
        inner = range(1, len(free.interpolant.points) - 1)
        double = stop_and_go(free.interpolant.points, free.kept_limits, profile="double_s", straight=False)
        for shape in SHAPES:
            times = {}
            for count in range(len(inner) + 1):
                for stops in combinations(inner, count):
                    problem = ViaPointProblem(
                        **given, **INTERPOLANTS[shape], passing=[{"point": k, "stop": True} for k in stops]
                    )
                    times[stops] = solved(problem, 1)[0]
            best = min((stops for stops in times if stops), key=lambda stops: times[stops])
            where = ", ".join(str(k) for k in best)
            print(
                f"{title:26}{shape:>16}{times[()]:13.4f}{f'{times[best]:.4f} (stops at {where})':>40}"
                f"{times[tuple(inner)]:12.4f}{float(double.breaks[0, -1]):10.4f}",
                flush=True,
            )


if __name__ == "__main__":
    main()
