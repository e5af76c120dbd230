"""Least times along paths against what no time law is below: `python -m tests.benchmarks.bench_path_bounds`."""

from tests.verification.path_bounds.test_path_bound import controllable, ur5_path
from trajevo import path_bound
from trajevo.problems import TimeJerkReparameterisation

#: Dense stations at which controllable sets of a UR5 under torque limits are found.
DENSE = 1601

#: Stations, and control points of the u(t) whose least time is compared.
STATIONS, CONTROL_POINTS = (50, 100, 200), 200


def main() -> None:
    """Print a table: path, stations, bound with and without limits of jerk, the best found, CPU time."""
    print("path, stations: bound [s], without jerk limits [s], least time found [s], gap [%], CPU [s]")
    for name in ("gemini", "s"):
        best = TimeJerkReparameterisation(path=name, control_points=CONTROL_POINTS).least_time().cost
        problem, free = TimeJerkReparameterisation(path=name), TimeJerkReparameterisation(path=name, jerk="inf")
        for stations in STATIONS:
            bound = path_bound(problem, stations=stations)
            without = path_bound(free, stations=stations)
            print(
                f"{name}, {bound.stations}: {bound.least:.4f}, {without.least:.4f}, {best:.4f}, "
                f"{100.0 * bound.gap(best):.2f}, {bound.cpu_seconds:.1f}",
                flush=True,
            )
    problem = ur5_path()
    best = controllable(problem, DENSE)
    print(f"UR5 under torque limits, stations: bound [s], least time by reachability at {DENSE} stations [s], gap, CPU")
    for stations in STATIONS[:2]:
        bound = path_bound(problem, stations=stations)
        gap = 100.0 * bound.gap(best)
        print(f"{bound.stations}: {bound.least:.4f}, {best:.4f}, {gap:.2f} %, {bound.cpu_seconds:.1f} s", flush=True)


if __name__ == "__main__":
    main()
