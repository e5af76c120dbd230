"""Figures 3 to 9, 11 and 12 of Sun 2020: the B-spline, the hybrid curve and the motions at the times of Table 4."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from trajevo import plots
from trajevo.base.arrays import Array
from trajevo.dynamics.rollout import Rollout
from trajevo.plots.motion import draw_limits, equal_axes
from trajevo.plots.paper import colour, curve, key, label, panels
from trajevo.reproduction.paper import NumberTable, PrintedNumber, Shown
from trajevo.trajectory.batch import DERIVATIVES, TrajectoryBatch
from trajevo.trajectory.interpolants import ImprovedQuarticBSpline
from trajevo.trajectory.interpolants.improved_quartic import PIECES, QUARTIC_BASIS

from ..pointing_mechanism import DURATION_BOUNDS, PointingMechanism, paper_solution

#: Instants of a curve in a table, and in a picture.
_ROWS, _DRAWN = 201, 2001

#: Order of a derivative -> its unit in the paper.
UNITS = ("deg", "deg/s", "deg/s^2", "deg/s^3")

_PLANE = ("θ1 [deg]", "θ2 [deg]")


def quartic_curve(P: Array, count: int = _ROWS) -> Array:
    """Equation (17): the curve of five control points, (5, n) -> (count, n), u from 0 to 1."""
    u = np.linspace(0.0, 1.0, count)[:, None]
    return np.asarray(u ** np.arange(5) @ QUARTIC_BASIS @ P)


def pure_spline(form: str = "printed") -> TrajectoryBatch:
    """The improved quartic uniform B-spline alone at the times of Table 4, between all its points."""
    points = PointingMechanism().interpolant.points  # type: ignore[attr-defined]
    return ImprovedQuarticBSpline(points, form=form, duration_bounds=DURATION_BOUNDS)(paper_solution())


def control_points(spline: TrajectoryBatch) -> Array:
    """Control points of the improved spline, four for each path point, (n, 4, n_joints) [rad], from its pieces."""
    pieces: Array = spline.coefficients[0]  # type: ignore[attr-defined]
    unit = pieces * spline.segment_durations[0][:, None, None] ** np.arange(5)
    of_pieces = np.linalg.solve(QUARTIC_BASIS, np.swapaxes(unit, 1, 2))
    first, others = of_pieces[0, :4], of_pieces[PIECES - 1 :: PIECES, 1:]
    return np.concatenate([first[None], others])


def figure_3() -> Shown:
    """A quartic uniform B-spline of five control points: here those of the path, as the paper prints none."""
    P = np.degrees(PointingMechanism().interpolant.points.positions)  # type: ignore[attr-defined]
    drawn = quartic_curve(P)
    P12, P03, P23, P14 = (0.5 * (P[i] + P[k]) for i, k in ((1, 2), (0, 3), (2, 3), (1, 4)))
    numbers = [
        PrintedNumber(
            of=f"{line} over {line[:3]}{end}, from one-twelfth in eq. (18)",
            unit="1",
            printed="12",
            ours=float(np.linalg.norm(other - middle) / np.linalg.norm(at - middle)),
        )
        for line, end, middle, other, at in (
            ("P12P03", "Pa", P12, P03, drawn[0]),
            ("P23P14", "Pb", P23, P14, drawn[-1]),
        )
    ]
    with panels(None, 1, width="column", height=60.0) as (ax,):
        ax.plot(*P.T, "o:", color="0.5", markersize=3, label="control points P0 to P4")
        for ends, name in (((P12, P03), "P12P03 and P23P14"), ((P23, P14), None)):
            ax.plot(*np.array(ends).T, ".--", color=colour(1), linewidth=0.8, markersize=4, label=name)
        ax.plot(*drawn.T, label="quartic uniform B-spline", **curve(0))
        ax.plot(*drawn[[0, -1]].T, "s", color=colour(0), markersize=3)
        _name(ax, {f"P{i}": point for i, point in enumerate(P)} | {"Pa": drawn[0], "Pb": drawn[-1]})
        _plane(ax)
    rows = [(u, *point) for u, point in zip(np.linspace(0.0, 1.0, _ROWS).tolist(), drawn.tolist(), strict=True)]
    return Shown(
        numbers=numbers,
        table=NumberTable(("u [1]", *_PLANE), rows),
        figure=ax.figure,
        said=["The paper's control points are not printed: these are the five path points of Table 4."],
    )


def figure_4() -> Shown:
    """Four collinear control points in place of each path point."""
    spline = pure_spline()
    P, extra = np.degrees(spline.evaluate(_via_times())[0]), np.degrees(control_points(spline))
    chord = np.linalg.norm(np.diff(P, axis=0)[1:], axis=1)
    near, far = (np.linalg.norm(extra[1:-1, k] - P[1:-1], axis=1) for k in (1, 0))
    middle = 1  # P2 of the path
    numbers = [
        PrintedNumber(of="P2P3 over P2P2,1, eq. (20)", unit="1", printed="24", ours=float((chord / near)[middle])),
        PrintedNumber(of="P2P3 over P2P2,3, eq. (20)", unit="1", printed="12", ours=float((chord / far)[middle])),
        PrintedNumber(of="control points for each path point", unit="1", printed="4", ours=extra[..., 0].size / len(P)),
    ]
    inner = _sampled(spline, np.linspace(_via_times()[1], _via_times()[3], _ROWS))[0]
    with panels(None, 1, width="column", height=60.0) as (ax,):
        ax.plot(*P.T, "o:", color="0.5", markersize=3, label="path points")
        for name, four in zip(("extra control points", None, None), extra[1:-1], strict=True):
            ax.plot(*four.T, "x-", color=colour(1), linewidth=0.8, markersize=4, label=name)
        ax.plot(*inner.T, label="curve from P1 to P3", **curve(0))
        _name(ax, {f"P{i}": point for i, point in enumerate(P)})
        _plane(ax)
    names = [f"P{i},{k}" for i in range(len(P)) for k in (3, 1, 2, 4)]
    rows = [(name, *point) for name, point in zip(names, extra.reshape(-1, 2).tolist(), strict=True)]
    return Shown(numbers=numbers, table=NumberTable(("control point", *_PLANE), rows), figure=ax.figure)


def figure_5() -> Shown:
    """The improved curve passes all path points."""
    spline, times = pure_spline(), _via_times()
    (q,) = _sampled(spline, np.linspace(0.0, times[-1], _ROWS))
    P, extra = np.degrees(_path()), np.degrees(control_points(spline))
    missed = float(np.degrees(np.abs(spline.evaluate(times)[0] - _path()).max()))
    with panels(None, 1, width="column", height=60.0) as (ax,):
        ax.plot(*extra.reshape(-1, 2).T, "x:", color=colour(1), markersize=4, linewidth=0.8, label="control points")
        ax.plot(*q.T, label="improved quartic uniform B-spline", **curve(0))
        ax.plot(*P.T, "o", color=colour(0), markersize=3, label="path points")
        _name(ax, {f"P{i}": point for i, point in enumerate(P)})
        _plane(ax)
    rows = [(t, *point) for t, point in zip(np.linspace(0.0, times[-1], _ROWS).tolist(), q.tolist(), strict=True)]
    said = f"All path points are passed: the greatest distance is {missed:.1e} deg."
    return Shown(table=NumberTable(("t [s]", *_PLANE), rows), figure=ax.figure, said=[said])


def derivative_of_spline(order: int) -> Shown:
    """Figures 6 and 7: acceleration or jerk of the improved spline alone, which the paper says to change abruptly."""
    spline, smooth, hybrid = pure_spline(), pure_spline("smooth"), hybrid_motion().trajectory
    name, unit = DERIVATIVES[order], UNITS[order]
    ends = np.array([0.0, _via_times()[-1]])
    steps = np.degrees(np.abs(spline.evaluate(ends, order)).max())
    peaks = [float(np.degrees(one.peak(order).max())) for one in (spline, hybrid, smooth)]
    within = float(np.degrees(np.abs(spline.jump(order)).max()))
    said = [
        f"The paper claims an abrupt change of the {name} at the first and the last point. By its own rule (2) four "
        f"control points coincide there, so that the {name} begins and ends at 0 (here at {steps:.1e} {unit}) without "
        f"a step; what is true is that its peaks are higher: {peaks[0]:.4f} {unit} against {peaks[1]:.4f} {unit} "
        "of the hybrid curve.",
    ]
    if within > 1e-6:
        said.append(
            f"At inner points it does jump, by up to {within:.4f} {unit}, where the segments before and after take "
            f"different times: u runs from 0 to 1 on each quarter of a segment. Moved to the Greville abscissae "
            f"(form 'smooth') the control points give no jump, and a peak of {peaks[2]:.4f} {unit}."
        )
    return _over_time({"": spline}, order, said)


def derivative_of_hybrid(order: int) -> Shown:
    """Figures 8 and 9: acceleration or jerk of septic, improved spline and septic at the times of Table 4."""
    motion = hybrid_motion().trajectory
    name, unit = DERIVATIVES[order], UNITS[order]
    peak, jump = (float(np.degrees(np.abs(value).max())) for value in (motion.peak(order), motion.jump(order)))
    said = [f"The greatest {name} is {peak:.4f} {unit}; it is 0 at both ends."]
    if jump > 1e-6:
        velocity = float(np.degrees(np.abs(motion.jump(1)).max()))
        said.append(
            f"Against the paper's claim the {name} is not continuous at P2, where the two inner segments take "
            f"different times: it jumps by {jump:.4f} {unit}, and the velocity by {velocity:.4f} deg/s."
        )
    return _over_time({"": motion}, order, said)


def figure_11(found: Rollout, times: Array, story: str) -> Shown:
    """Both joints over time: the paper's solution, and a faster one of ours."""
    motions = {"Table 4": hybrid_motion().trajectory, "here": found.trajectory}
    instants = {"Table 4": _via_times(), "here": times}
    with panels(None, 2, width="page", columns=2, height=48.0) as axes:
        for joint, (ax, letter) in enumerate(zip(axes, "ab", strict=True)):
            for k, (name, motion) in enumerate(motions.items()):
                t = np.linspace(0.0, float(motion.duration[0]), _DRAWN)
                ax.plot(t, _sampled(motion, t)[0][:, joint], label=name, **curve(k))
                ax.plot(instants[name], np.degrees(_path()[:, joint]), "o", color=colour(k), markersize=3)
            ax.set(xlabel="time [s]", ylabel=f"θ{joint + 1} [deg]")
            ax.set_title(f"({letter})", loc="left")
        key(axes[0])
    return Shown(table=_motion_table(motions, 0), figure=axes[0].figure, said=[story])


def figure_12(found: Rollout, story: str) -> Shown:
    """The path of the tool in space, with link lengths of ours."""
    rollouts = {"Table 4": hybrid_motion(), "here": found}
    paths = {}
    for name, one in rollouts.items():
        t = np.linspace(0.0, float(one.trajectory.duration[0]), _ROWS)
        paths[name] = t, one.robot.tool_poses(one.trajectory.evaluate(t)[0])[0]
    via, _ = found.robot.tool_poses(_path())
    space = plots.tool_path(rollouts["Table 4"], width=110.0)
    with plots.style():
        space.lines[0].set_label("Table 4")
        space.plot(*paths["here"][1].T, label="here", **curve(1))
        space.plot(*via[1:-1].T, "D", color=colour(3), markersize=3.5)
        key(space)
        equal_axes(space, np.concatenate([xyz for _, xyz in paths.values()]))
    rows = [(name, t, *p) for name, (at, xyz) in paths.items() for t, p in zip(at[::2], xyz[::2], strict=True)]
    said = [
        "The link lengths l1 and l2 are not printed: here they are 0.3 m and 0.2 m.",
        story,
    ]
    return Shown(
        table=NumberTable(("motion", "t [s]", "x [m]", "y [m]", "z [m]"), rows), figure=space.figure, said=said
    )


def hybrid_motion() -> Rollout:
    """The paper's motion: the printed hybrid curve at the times of Table 4."""
    return PointingMechanism(interpolant="printed").rollout(paper_solution())


def _over_time(motions: Mapping[str, TrajectoryBatch], order: int, said: Sequence[str]) -> Shown:
    robot = PointingMechanism().robot
    low, high = (np.degrees(end) for end in robot.limits.bounds(DERIVATIVES[order]))
    with panels(None, 1, width="page", height=48.0) as (ax,):
        (motion,) = motions.values()
        t = np.linspace(0.0, float(motion.duration[0]), _DRAWN)
        (drawn,) = _sampled(motion, t, order)
        for joint in range(robot.dof):
            ax.plot(t, drawn[:, joint], label=f"joint {joint + 1}", **curve(joint))
        draw_limits(ax, drawn, low, high, UNITS[order].replace("^2", "²").replace("^3", "³"))
        ax.set(xlabel="time [s]", ylabel=label(DERIVATIVES[order], UNITS[order]))
        key(ax)
    return Shown(table=_motion_table(motions, order), figure=ax.figure, said=said)


def _motion_table(motions: Mapping[str, TrajectoryBatch], order: int) -> NumberTable:
    rows: list[tuple[Any, ...]] = []
    for name, motion in motions.items():
        t = np.linspace(0.0, float(motion.duration[0]), _ROWS // len(motions))
        own = (name,) if name else ()
        rows += [
            (*own, at, *values) for at, values in zip(t.tolist(), _sampled(motion, t, order)[0].tolist(), strict=True)
        ]
    headers = [f"{DERIVATIVES[order]} {k} [{UNITS[order]}]" for k in (1, 2)]
    return NumberTable((*(("motion",) if len(motions) > 1 else ()), "t [s]", *headers), rows)


def _sampled(motion: TrajectoryBatch, t: Array, *orders: int) -> list[Array]:
    return [np.degrees(motion.evaluate(t, order)[0]) for order in orders or (0,)]


def _path() -> Array:
    points: Array = PointingMechanism().interpolant.points.positions  # type: ignore[attr-defined]
    return points


def _via_times() -> Array:
    return np.concatenate([[0.0], np.cumsum(paper_solution()[0])])


def _name(ax: Any, points: Mapping[str, Array]) -> None:
    for name, (x, y) in points.items():
        ax.annotate(name, (x, y), xytext=(4, 3), textcoords="offset points")


def _plane(ax: Any) -> None:
    ax.set(xlabel=_PLANE[0], ylabel=_PLANE[1])
    ax.margins(0.12)
    key(ax)
