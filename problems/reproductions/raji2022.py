"""Raji 2022, septic pick and place with the PUMA 560, made again: Tables 1 and 2 and Figures 3 to 6.

Symbols are the paper's: q joint angles [rad]; rows a to h of Table 2 are the coefficients of t⁰ to t⁷.
"""

from __future__ import annotations

import numpy as np

from trajevo import plots
from trajevo.base.arrays import Array
from trajevo.dynamics.rollout import Rollout
from trajevo.plots.motion import equal_axes
from trajevo.plots.paper import colour, curve, key, panels
from trajevo.reproduction.paper import Desk, Item, LeftOut, NumberTable, Paper, PrintedNumber, Shown
from trajevo.solvers.rivals import RIVALS, RIVALS_NOTE, STOPPING, Rival, compare_rivals, rivals_table
from trajevo.trajectory.batch import DERIVATIVES, TrajectoryBatch
from trajevo.trajectory.interpolants import LinearBlends

from ..pick_and_place import DURATION_BOUNDS, PAPER_TIMES, PickAndPlace, paper_solution
from ..puma_kinematics import TABLE_1_POSITIONS, forward_kinematics, inverse_kinematics

#: Table 1 as printed: joint angles to take, lift, unload and place [rad].
TABLE_1 = {
    "take": ("2.57", "-0.7873", "-1.2022", "-3.1416", "-1.9895", "0.5716"),
    "lift": ("2.57", "-0.1026", "-0.5", "-3.1416", "-0.6026", "0.5716"),
    "unload": ("-0.5716", "-0.1026", "-0.5", "-3.1416", "-0.6026", "-2.57"),
    "place": ("-0.5716", "-0.7873", "-1.2022", "-3.1416", "-1.9895", "-2.57"),
}

#: Table 2 as printed: coefficients of joints 1 to 6 [rad/s^k].
TABLE_2 = {
    "a": ("2.5700", "-0.7873", "-1.2022", "-3.1416", "-1.9895", "0.5716"),
    "b": ("0", "0", "0", "0", "0", "0"),
    "c": ("0", "0", "0", "0", "0", "0"),
    "d": ("0.0938", "0.2301", "0.2359", "0.0000", "0.4660", "0.0938"),
    "e": ("-0.0750", "-0.1008", "-0.1033", "-0.0000", "-0.2041", "-0.0750"),
    "f": ("0.0169", "0.0165", "0.0170", "-0.0000", "0.0335", "0.0169"),
    "g": ("-0.0015", "-0.0012", "-0.0012", "0.0000", "-0.0024", "-0.0015"),
    "h": ("0.0001", "0.0000", "0.0000", "0.0000", "0.0001", "0.0001"),
}

#: Points as the text prints them, section 4.1 [m].
POINTS = {
    "take": ("-0.5", "0.5", "-0.5"),
    "lift": ("-0.5", "0.5", "0.3"),
    "unload": ("0.5", "-0.5", "-0.3"),
    "place": ("0.5", "-0.5", "-0.5"),
}

#: Share of the shorter line that a blend takes in Figure 5; the paper prints none.
_BLEND = 0.25

#: Instants of a curve in a table and in a picture.
_ROWS, _DRAWN = 201, 1001


def _septic() -> Rollout:
    """The paper's motion with 2.5 kg held 0.1 m in front of the flange."""
    return PickAndPlace().rollout(paper_solution())


def _with_blends() -> TrajectoryBatch:
    """Lines with quintic blends in the paper's times, stretched so that they take as long as the septic."""
    points = PickAndPlace().interpolant.points  # type: ignore[attr-defined]
    motion = LinearBlends(points, duration_bounds=DURATION_BOUNDS)(np.array([[*PAPER_TIMES, _BLEND]]))
    return motion.slowed(sum(PAPER_TIMES) / float(motion.duration[0]))


def table_1(desk: Desk) -> Shown:
    """Joint angles of the four points, by inverse kinematics in closed form with an upright tool."""
    angles = inverse_kinematics(np.array(TABLE_1_POSITIONS), np.eye(3))
    numbers = [
        PrintedNumber(of=f"{name}, joint {k + 1}", unit="rad", printed=text, ours=float(angles[row, k]))
        for row, (name, texts) in enumerate(TABLE_1.items())
        for k, text in enumerate(texts)
    ]
    rows = [(name, *angles[row].tolist()) for row, name in enumerate(TABLE_1)]
    return Shown(
        numbers=numbers,
        table=NumberTable(("point", *(f"joint {k} [rad]" for k in range(1, 7))), rows),
        said=["The tool points up, its rotation is the identity; the unload point lies at z = +0.3 m."],
    )


def figure_3(desk: Desk) -> Shown:
    """The points in space, and the path of the tool between them."""
    motion, t = _septic(), np.linspace(0.0, sum(PAPER_TIMES), _ROWS)
    reached = forward_kinematics(np.array([[float(text) for text in texts] for texts in TABLE_1.values()]))[:, :3, 3]
    numbers = []
    for row, (name, texts) in enumerate(POINTS.items()):
        for axis, text in enumerate(texts):
            misprint = (name, axis) == ("unload", 2)
            why = "a misprint: the joint angles of Table 1 put the tool at +0.3 m" if misprint else ""
            ours = float(reached[row, axis])
            of = f"{name}, {'xyz'[axis]}"
            numbers.append(PrintedNumber(of=of, unit="m", printed=text, ours=ours, differs=misprint, why=why))
    path, _ = motion.robot.tool_poses(motion.trajectory.evaluate(t)[0])
    space = plots.tool_path(motion, width=110.0)
    with plots.style():
        space.plot(*reached[1:-1].T, "D", color=colour(3), markersize=4, label="via points")
        key(space)
        equal_axes(space, path)
    top = int(path[:, 2].argmax())
    said = (
        f"Between the via points, both at a height of 0.3 m, the tool rises to {path[top, 2]:.4f} m "
        f"(at {t[top]:.2f} s): the septic swings beyond its points."
    )
    rows = [(at, *xyz) for at, xyz in zip(t.tolist(), path.tolist(), strict=True)]
    return Shown(
        numbers=numbers, table=NumberTable(("t [s]", "x [m]", "y [m]", "z [m]"), rows), figure=space.figure, said=[said]
    )


def table_2(desk: Desk) -> Shown:
    """Coefficients of the septic polynomial."""
    piece: Array = _septic().trajectory.coefficients[0, 0].T  # type: ignore[attr-defined]
    numbers = [
        PrintedNumber(of=f"{name}, joint {k + 1}", unit="1", printed=text, ours=float(piece[power, k]))
        for power, (name, texts) in enumerate(TABLE_2.items())
        for k, text in enumerate(texts)
    ]
    rows = [(f"{name}, t^{power} [rad/s^{power}]", *piece[power].tolist()) for power, name in enumerate(TABLE_2)]
    return Shown(
        numbers=numbers,
        table=NumberTable(("coefficient", *(f"joint {k}" for k in range(1, 7))), rows),
        said=["The rows a to h are the powers 0 to 7 of time; eqs. (11) and (14) name them the other way round."],
    )


def figure_4(desk: Desk) -> Shown:
    """Position, velocity and acceleration of the septic, and its jerk."""
    motion = _septic()
    axes = plots.profiles(motion, via_times=np.cumsum([0.0, *PAPER_TIMES]))
    highest, ends = motion.trajectory.extremes(0)[1][0, 0], motion.trajectory.evaluate(np.array([0.0, 9.0]), 3)[0]
    number = PrintedNumber(
        of="displacement of joint 1",
        unit="rad",
        printed="1.6",
        ours=float(highest),
        why="joint 1 begins at 2.57 rad, Table 1, and swings beyond",
        differs=True,
    )
    steps = ", ".join(f"{value:.2f}" for value in np.abs(ends).max(axis=0))
    said = (
        "Velocity and acceleration are 0 at both ends; the jerk is not continuous there, against the paper: that of "
        f"joints 1 to 6 steps by up to {steps} rad/s³."
    )
    t = np.linspace(0.0, sum(PAPER_TIMES), _ROWS)
    values = [motion.trajectory.evaluate(t, order)[0] for order in range(3)]
    units = ("rad", "rad/s", "rad/s^2")
    headers = [f"{name} {k} [{unit}]" for name, unit in zip(DERIVATIVES, units, strict=False) for k in range(1, 7)]
    rows = np.column_stack([t, *values]).tolist()
    return Shown(numbers=[number], table=NumberTable(("t [s]", *headers), rows), figure=axes[0].figure, said=[said])


def figure_5(desk: Desk) -> Shown:
    """Positions of lines with quintic blends, beside those of the septic."""
    motions = {"lines with quintic blends": _with_blends(), "septic": _septic().trajectory}
    blends, names = motions["lines with quintic blends"], PickAndPlace().robot.joint_names
    with panels(None, 2, width="page", columns=2, height=52.0, share=True) as axes:
        for ax, (name, motion) in zip(axes, motions.items(), strict=True):
            t = np.linspace(0.0, float(motion.duration[0]), _DRAWN)
            for joint, title in enumerate(names):
                ax.plot(t, motion.evaluate(t)[0, :, joint], label=title, **curve(joint))
            ax.set(xlabel="time [s]", ylabel="position [rad]")
            ax.set_title(name, loc="left")
        axes[1].set_ylim(axes[0].set_ylim(min(ax.get_ylim()[0] for ax in axes), max(ax.get_ylim()[1] for ax in axes)))
        key(axes[0])
    number = PrintedNumber(
        of="displacement of joint 1", unit="rad", printed="2.6", ours=float(blends.extremes(0)[1][0, 0])
    )
    last = float(np.abs(blends.evaluate(blends.duration, 1)).max())
    said = [
        "2.6 rad is where joint 1 begins, 2.57 rad by Table 1, and no overshoot: lines with blends stay "
        "between the points.",
        f"They come to rest at the end as well, against the paper: {last:.1e} rad/s there.",
        f"The time of the blends is not printed; here each takes {_BLEND:g} of the shorter line beside it.",
    ]
    t = np.linspace(0.0, float(blends.duration[0]), _ROWS)
    table = NumberTable(
        ("t [s]", *(f"joint {k} [rad]" for k in range(1, 7))), np.column_stack([t, blends.evaluate(t)[0]]).tolist()
    )
    return Shown(numbers=[number], table=table, figure=axes[0].figure, said=said)


def _rivals(desk: Desk) -> tuple[Rival, ...]:
    problem = PickAndPlace()
    names = (*STOPPING, "quartic_cubic_quartic", "polynomial") if desk.short else RIVALS
    return desk.once(
        "least times of all curves under equal limits",
        lambda: compare_rivals(
            problem.dynamics,
            problem.interpolant.points,  # type: ignore[attr-defined]
            names=names,
            starts=1 if desk.short else 3,
        ),
    )


def figure_6(desk: Desk) -> Shown:
    """What Figures 6 and 7 mean to tell, which curve is faster: least times of all of them under equal limits."""
    rivals = _rivals(desk)
    headers, rows = rivals_table(rivals)
    axes = plots.plot_rivals(rivals)
    times = ", ".join(f"{rival.title} {rival.time:.4f} s" for rival in sorted(rivals, key=lambda rival: rival.time))
    why = "the time in which MATLAB computed it on the authors' computer, which says nothing of the motion"
    number = PrintedNumber(of="execution", unit="s", printed="0.380144", ours=None, why=why)
    said = [
        "The paper calls the septic faster because MATLAB computed it sooner. Here each curve is as fast as equal "
        f"limits of velocity, acceleration, jerk and torque allow with 2.5 kg: {times}.",
        RIVALS_NOTE,
    ]
    return Shown(numbers=[number], table=NumberTable(headers, rows), figure=axes[0].figure, said=said)


PAPER = Paper(
    name="raji2022",
    citation=(
        "A. A. Raji, O. S. Asaolu, T. T. Akano: Joint Space Robot Arm Trajectory Planning Using Septic Function, 2022"
    ),
    doi="",
    items=(
        Item("table", "1", "joint angles of the four points", table_1),
        Item("figure", "3", "the points in space", figure_3),
        Item("table", "2", "coefficients of the septic polynomial", table_2),
        Item("figure", "4", "septic polynomial", figure_4),
        Item("figure", "5", "lines with polynomial blends", figure_5),
        Item("figure", "6", "which curve is faster", figure_6, searches=True),
    ),
    left_out=(
        LeftOut("Figure 1", "kinds of trajectories", "a drawing without data"),
        LeftOut("Figure 2", "linear trajectory with polynomial blends", "a drawing without data"),
        LeftOut(
            "Figure 7",
            "execution time of the septic",
            "a screen with the coefficients of Table 2 and 0.325196 s, in which MATLAB computed them on the authors' "
            "computer; the motion takes 9 s",
        ),
    ),
)
