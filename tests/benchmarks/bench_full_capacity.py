"""What capacity under all limits costs, over that of effort alone (`dlcc`), in one run and interleaved.

`python tests/benchmarks/bench_full_capacity.py`: CPU time of a UR5-like arm on two segments, without and with losses of
gears, and of that of the drives alone.
"""

import time

import numpy as np

from trajevo import (
    Dynamics,
    Grip,
    Payload,
    QuinticSpline,
    Rollout,
    Stand,
    ViaPoints,
    dlcc,
    drive_capacity,
    full_capacity,
    load_robot,
)

POINTS = [[0.0, -1.2, 1.4, -1.7, -1.57, 0.0], [1.0, -0.9, 1.2, -1.9, -1.2, 0.8], [2.0, -1.3, 1.6, -1.8, -1.57, 0.0]]
UNLIMITED = {"acceleration": np.inf, "jerk": np.inf}
CORNERS = [[x, y, -0.8] for x, y in ((0.3, 0.3), (-0.3, 0.3), (-0.3, -0.3), (0.3, -0.3))]
ROUNDS = 15


def motion(gears):
    """The arm on its motion."""
    bare = load_robot("ur5", limits=UNLIMITED, tool="tool0")
    drives = {
        name: {
            "peak_torque": peak,
            "torque_speed": [["0 rad/s", peak], ["2 rad/s", peak], ["4 rad/s", 0.0]],
            "continuous_torque": 0.5 * peak,
            "gear_ratio": 101.0,
            "torque_constant": 0.12,
            "winding_resistance": "0.5 ohm",
            "thermal_resistance": "1.5 K/W",
            "thermal_time_constant": "900 s",
            "greatest_rise": "80 K",
            "stiffness": 2e4,
        }
        | ({"efficiency_driving": 0.75} if gears else {})
        for name, peak in zip(bare.joint_names, bare.limits.effort, strict=True)
    }
    grip, stand = Grip(force_per_finger=150.0, friction=0.4), Stand(mass=90.0, com=(0, 0, -0.4), footprint=CORNERS)
    robot = load_robot("ur5", limits=UNLIMITED, tool="tool0", drives=drives, grip=grip, stand=stand)
    spline = QuinticSpline(ViaPoints(np.array(POINTS)), duration_bounds=(0.3, 5.0))
    x = np.zeros(len(spline.variables))
    x[:2] = 0.9
    return Rollout(Dynamics(robot, Payload(5.0)), spline(x[None]))


def main():
    """Print medians of CPU times and their ratios."""
    for gears in (False, True):
        given = motion(gears)
        calls = {
            "dlcc": lambda given=given: dlcc(given),
            "drive_capacity": lambda given=given: drive_capacity(given, dwell=1.0),
            "full_capacity": lambda given=given: full_capacity(given, deviation=3.5e-3, dwell=1.0),
        }
        times = {name: [] for name in calls}
        for _ in range(ROUNDS):
            for name, call in calls.items():
                begin = time.process_time()
                call()
                times[name].append(time.process_time() - begin)
        medians = {name: float(np.median(found[1:])) for name, found in times.items()}
        told = ", ".join(f"{name} {1e3 * x:.1f} ms ({x / medians['dlcc']:.2f})" for name, x in medians.items())
        print(f"{'with' if gears else 'without'} losses of gears: {told}")


if __name__ == "__main__":
    main()
