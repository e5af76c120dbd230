"""What notebooks show of fronts and solutions, and their numbers as tables of pandas."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from trajevo.base.arrays import Array
from trajevo.base.shown import html
from trajevo.base.shown.html import Piece
from trajevo.base.units import display, pretty
from trajevo.errors import TrajevoError
from trajevo.formulation.cell.visited import Visited
from trajevo.front.motion_table import check_length, checked_step, motion_columns
from trajevo.front.quantities import with_unit

if TYPE_CHECKING:
    import pandas as pd

    from trajevo.front.front import Front, Solution

#: Limits of a solution that are shown, those that are used most.
_CLOSEST = 5

#: Decimal places of speeds: inverse kinematics leaves a joint that stands with one of 1e-12 rad/s.
_PLACES = 9

#: Instants of a line of joint positions.
_INSTANTS = 61


def front_html(front: Front) -> str:
    """A front as a notebook shows it: where it comes from, the choices with their objectives, and a picture."""
    run = front.run
    how = f"{run.algorithm}, seed {run.seed}, {run.generations} generations, {run.evaluations} evaluations"
    stopped = ", interrupted" if run.interrupted else ""
    told = html.sentence(f"{how}, {run.seconds:.3g} s{stopped}")
    if not len(front):
        return html.shown(f"Front of {front.record.title}: empty", html.sentence(str(front.blocking or "")), told)
    units, factors = _display(front)
    headers = [_header(name, pretty(unit)) for name, unit in zip(front.objective_names, units, strict=True)]
    rows = [
        (", ".join(rules), str(row), *(f"{value:.5g}" for value in front.F[row] * factors))
        for row, rules in _chosen(front).items()
    ]
    title = f"Front of {front.record.title}: {len(front)} solutions"
    return html.shown(title, told, html.table(["choice", "row", *headers], rows), _cloud(front, headers, factors))


def solution_html(solution: Solution) -> str:
    """A solution as a notebook shows it: why it was chosen, objectives, the closest limits, and its joints."""
    front = solution.front
    units, factors = _display(front)
    values = front.F[solution.index] * factors
    objectives = [
        (name, with_unit(f"{value:.6g}", unit))
        for name, value, unit in zip(front.objective_names, values, units, strict=True)
    ]
    closest = sorted(solution.G.items(), key=lambda pair: -pair[1])[:_CLOSEST]
    return html.shown(
        f"Solution: {solution.rule}, row {solution.index} of {len(front)}",
        html.sentence(f"{front.record.title}; {solution.reason}"),
        *([html.sentence(f"base at {placed}")] if (placed := told_base(solution)) else []),
        *map(html.sentence, told_visits(solution)),
        html.table(("objective", "value"), objectives),
        html.table(("closest limit", "used"), [(name, f"{100.0 * (1.0 + value):.4g} %") for name, value in closest]),
        _joints(solution),
    )


def told_base(solution: Solution) -> str:
    """Where the base of a solution's robot stands; empty if it does not move."""
    record = solution.front.record
    return str(solution.base) if record.settings.get("base") is not None else ""


def told_visits(solution: Solution) -> tuple[str, ...]:
    """In which order and postures the points are visited, a sentence each; none if they are given."""
    settings = solution.front.record.settings
    if (settings.get("order") is None and settings.get("postures") is None) or solution.visits is None:
        return ()
    told = [f"points in the order {solution.visits.told_order}"] if solution.order is not None else []
    return (*told, *([solution.visits.told_postures] if solution.visits.told_postures else []))


def small_pictures(front: Front) -> str:
    """The first two objectives of a front with its knee, and the joints of the knee, as HTML without scripts."""
    units, factors = _display(front)
    headers = [_header(name, pretty(unit)) for name, unit in zip(front.objective_names, units, strict=True)]
    return f"{_cloud(front, headers, factors)}{_joints(front.knee())}"


def front_frame(front: Front) -> pd.DataFrame:
    """The front as a table, see :meth:`trajevo.Front.to_dataframe`."""
    import pandas as pd  # imported where it is asked for, since that takes long

    record, columns = front.record, dict[str, Any]()
    for k, objective in enumerate(record.objectives):
        unit, factor = display(objective.unit, angle=record.angle, length=record.length)
        columns[_header(objective.name, unit)] = front.F[:, k] * factor
    for k, variable in enumerate(record.variables):
        unit, factor = display(variable.unit, angle=record.angle, length=record.length)
        header = _header(variable.name, unit)
        if header in columns:  # the payload may be both a variable and an objective
            header = _header(f"{variable.name} (variable)", unit)
        columns[header] = front.X[:, k] * factor
    for k, name in enumerate(record.constraints):
        columns[f"{name} [% of limit]"] = 100.0 * (1.0 + front.G[:, k])
    if len(front) and (record.settings.get("order") is not None or record.settings.get("postures") is not None):
        found = Visited.each(front.problem.rollout(front.X).arranged, front.problem.interpolant)
        columns["order"] = [each.told_order for each in found]
        columns["postures"] = [each.told_postures for each in found]
    chosen = _chosen(front) if len(front) else {}
    columns["choice"] = [", ".join(chosen.get(row, ())) for row in range(len(front))]
    return pd.DataFrame(columns, index=pd.RangeIndex(len(front), name="row"))


def motion_frame(solution: Solution, step: float) -> pd.DataFrame:
    """The motion of a solution as a table, see :meth:`trajevo.Solution.to_dataframe`."""
    seconds = checked_step(step)
    check_length(solution, seconds)
    import pandas as pd  # imported where it is asked for, since that takes long

    headers, table = motion_columns(solution, seconds, solution.front.record.angle)
    return pd.DataFrame(table, columns=headers)


def _chosen(front: Front) -> dict[int, list[str]]:
    """Rows worth comparing -> the rules that choose them."""
    found: dict[int, list[str]] = {}
    for choice in front.best:
        found.setdefault(choice.index, []).append(choice.rule)
    return found


def _display(front: Front) -> tuple[list[str], Array]:
    """Units in which objectives are shown, and factors from SI to them, shape (n_obj,)."""
    record = front.record
    shown = [display(one.unit, angle=record.angle, length=record.length) for one in record.objectives]
    return [unit for unit, _ in shown], np.array([factor for _, factor in shown])


def _header(name: str, unit: str) -> str:
    return name if unit == "1" else f"{name} [{unit}]"


def _cloud(front: Front, headers: list[str], factors: Array) -> Piece:
    """The front over its first two objectives, none if there is only one."""
    if len(headers) < 2:
        return Piece("")
    points = front.F[front.thinned(html.DOTS)][:, :2] * factors[:2]
    if not np.isfinite(points).all():
        return Piece("")
    knee = front.best[0]
    return html.cloud(points, (headers[0], headers[1]), {knee.rule: front.F[knee.index, :2] * factors[:2]})


def _joints(solution: Solution) -> Piece:
    """Where each joint begins and ends, how far it goes, and its position over time; why not, if it is not known."""
    try:
        trajectory = solution.trajectory
        problem = solution.front.problem
    except TrajevoError as error:
        return html.sentence(f"no motion: {error}")
    motion, angle = trajectory.sample(_INSTANTS), solution.front.record.angle
    speed = trajectory.peak(1)[0]
    rows = []
    for k, (name, si) in enumerate(zip(problem.robot.joint_names, problem.robot.joint_units, strict=True)):
        unit, factor = display(si, angle=angle, length=solution.front.record.length)
        q = motion.q[0, :, k] * factor
        label = f"position of {name} from {q.min():.4g} to {q.max():.4g} {unit}"
        rows.append(
            (
                name,
                f"{q[0]:.4g} {unit}",
                f"{q[-1]:.4g} {unit}",
                f"{round(speed[k] * factor, _PLACES):.4g} {unit}/s",
                html.line(q, label),
            )
        )
    seconds = float(trajectory.duration[0])
    return html.table(("joint", "from", "to", "greatest speed", f"position over {seconds:.4g} s"), rows)
