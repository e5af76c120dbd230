"""Printed output of the command line: problems and robots, a run with its choices, errors of a robot."""

from __future__ import annotations

import inspect
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from rich.box import SIMPLE
from rich.console import Console
from rich.markup import escape
from rich.table import Column, Table

from trajevo.errors import InvalidInputError
from trajevo.exporters.export import NAMED_EXPORTERS
from trajevo.formulation.constraints.constraint import LimitParameter
from trajevo.formulation.constraints.kinds import NAMED_KINDS
from trajevo.formulation.constraints.motion_limits import via_errors
from trajevo.formulation.objectives import NAMED_OBJECTIVES
from trajevo.formulation.registry import list_problems, problem_class
from trajevo.front.front import Front
from trajevo.plots.report import known_values, objective_headers, run_facts
from trajevo.robot.examine import RobotExamination
from trajevo.robot.locate import list_example_robots, list_robots
from trajevo.robot.robot import Robot, load_robot, position_unit
from trajevo.solvers.evolutionary.algorithms import NAMED_ALGORITHMS
from trajevo.solvers.rivals import RIVALS_NOTE, Rival, rivals_table
from trajevo.trajectory.interpolants import NAMED_INTERPOLANTS
from trajevo.verification.shares import shares_of_rows
from trajevo.verification.verify import Utilisation, Verification


def print_list(out: Console) -> None:
    """Print problems, their building blocks, formats and robots."""
    problems = Table(
        "problem", "title", Column("registered as", overflow="fold"), title="Problems", title_justify="left"
    )
    for name, point in list_problems().items():
        try:
            title = problem_class(name).title
        except InvalidInputError as error:
            title = escape(f"cannot be used: {error}")
        problems.add_row(name, title, point.value)
    robots = Table("robot", "dof", "limits", "not limited", title="Robots", title_justify="left")
    for name in list_robots():
        robot = load_robot(name)
        limits = {
            "position": np.concatenate([robot.limits.lower, robot.limits.upper]),
            **{kind: getattr(robot.limits, kind) for kind in ("velocity", "acceleration", "jerk", "effort")},
        }
        given = [kind for kind, values in limits.items() if np.isfinite(values).all()]
        missing = [kind for kind in limits if kind not in given]
        robots.add_row(name, str(robot.dof), ", ".join(given), ", ".join(missing))
    out.print(problems)
    _print_parts(out)
    out.print(robots)
    out.print(f"and of example-robot-data, or any URDF (trajevo check-robot): {', '.join(list_example_robots())}")


def _print_parts(out: Console) -> None:
    """Print the building blocks of problems and tasks by name, and the export formats."""
    rows: list[tuple[str, ...]] = [(o.name, o.unit, o.help) for o in NAMED_OBJECTIVES.all().values()]
    out.print(_table("Objectives", ("name", "unit", "what is minimised"), rows))
    rows = [(kind.name, "\n".join(map(_parameter, kind.parameters)), kind.help) for kind in NAMED_KINDS.all().values()]
    out.print(_table("Limits", ("name", "parameters", "what is limited"), rows))
    classes = NAMED_INTERPOLANTS.all().items()
    rows = [(name, (inspect.getdoc(found) or "").split("\n")[0]) for name, found in classes]
    out.print(_table("Interpolants", ("name", "what it is"), rows))
    rows = [(algorithm.name, algorithm.help) for algorithm in NAMED_ALGORITHMS.all().values()]
    out.print(_table("Algorithms", ("name", "what it is"), rows))
    formats = NAMED_EXPORTERS.all().values()
    rows = [(e.name, f".{e.ending}", e.help + (f"; for {e.needs}" if e.needs else "")) for e in formats]
    out.print(_table("Export formats", ("name", "file", "what it holds"), rows))


def _parameter(parameter: LimitParameter) -> str:
    return f"{parameter.name} [{parameter.unit}]" if parameter.unit else parameter.name


def table_with_units(*headers: str, **options: Any) -> Table:
    """A table whose headers show their units, which rich would take for markup and leave out."""
    return Table(*map(escape, headers), **options)


def _table(title: str, headers: Sequence[str], rows: Iterable[Sequence[str]]) -> Table:
    table = table_with_units(*headers, title=title, title_justify="left")
    for row in rows:
        table.add_row(*map(escape, row))
    return table


def print_run(out: Console, front: Front, angle: str | None) -> None:
    """Print the facts of a run and the solutions to choose from."""
    choices = front.choices() if len(front) else ()  # before anything is printed: they may be refused
    facts = Table.grid(padding=(0, 2))
    for label, text in run_facts(front):
        facts.add_row(label, escape(text))
    out.print(facts)
    if not len(front):
        out.print(f"The front is empty: {front.blocking}.")
        return
    headers = objective_headers(front, angle=angle)
    table = Table(Column("solution", no_wrap=True), box=SIMPLE, pad_edge=False, padding=(0, 1, 0, 0))
    for header, _ in headers:
        table.add_column(escape(header), min_width=max(map(len, header.split())))
    rows = [one.index for one in choices]
    missed = via_errors(front.problem.interpolant, front.problem.decode(front.X[rows])).max(axis=2)
    if missed.shape[1]:
        unit = position_unit(front.problem.robot)
        table.add_column(escape(f"via error [{unit}]"), min_width=len(unit) + 2)
    table.add_column("closest limit", no_wrap=True)
    values = known_values(front, rows, [factor for _, factor in headers])
    for k, (solution, shares) in enumerate(zip(choices, shares_of_rows(front, rows), strict=True)):
        closest = max(shares, key=lambda name: shares[name], default="")
        share = f"{100.0 * shares[closest]:.1f} % {closest}" if closest else "none"
        passed = [f"{missed[k].max():.3g}"] if missed.shape[1] else []
        table.add_row(solution.rule, *values[k], *passed, share)
    out.print(table)


def print_mass_notes(out: Console, robot: Robot) -> None:
    """Print what the efforts of a robot do not cover, if there is something."""
    for note in robot.mass_notes:
        out.print(f"note: {note}", markup=False)


def print_rivals(out: Console, rivals: Sequence[Rival]) -> None:
    """Print interpolants at their least times, fastest first."""
    names, rows = rivals_table(rivals)
    table = Table(box=SIMPLE, pad_edge=False, padding=(0, 1, 0, 0), title="Least times under the same limits")
    for name in names:
        table.add_column(escape(name), no_wrap=name == names[0], min_width=max(map(len, name.split())))
    for row in rows:
        table.add_row(*row)
    out.print(table)
    out.print(RIVALS_NOTE)


def print_verifications(out: Console, found: Sequence[Verification]) -> None:
    """Print the worst row of every limit over all motions, other exceeded limits, and the verdict."""
    several = len(found) > 1
    table = Table("limit", "joint", "used", "at", *(["solution"] if several else []), box=SIMPLE)
    for verification, row in _shown(found):
        style = None if row in verification.exceeded else "green"
        own = "" if row.full_share is None else f" (robot's: {100.0 * row.full_share:.2f} %)"
        cells = [row.limit, row.joint or "", f"{100.0 * row.share:.2f} %{own}"]
        cells += ["" if row.instant is None else f"{row.instant:.4f} s", *([verification.solution] if several else [])]
        table.add_row(*map(escape, cells), style=style or "bold red")
    out.print(table)
    if not several:
        out.print(f"objectives are known: {', '.join(escape(str(one)) for one in found[0].objectives)}")
    missed = max(one.via_error for one in found)
    if missed:
        out.print(f"via error: a joint passes an inner point at up to {missed:.4g} {found[0].via_unit}")
    difference = max(one.effort_difference for one in found)
    out.print(f"effort here and by Pinocchio: at most {difference:.3g} (N·m or N) apart")
    failed = [one for one in found if not one.passed]
    for one in failed:
        out.print(escape(one.verdict))
    if several:
        out.print(f"{len(found) - len(failed)} of {len(found)} solutions keep every limit.")
    elif not failed:
        out.print(escape(found[0].verdict))


def _shown(found: Sequence[Verification]) -> Iterable[tuple[Verification, Utilisation]]:
    """The worst row of every limit over all motions; for a single motion also every row that exceeds its limit."""
    if len(found) == 1:
        return [(found[0], row) for row in found[0].rows if row in (*found[0].by_limit, *found[0].exceeded)]
    worst: dict[str, tuple[Verification, Utilisation]] = {}
    for one in found:
        for row in one.by_limit:
            if row.limit not in worst or not row.share <= worst[row.limit][1].share:
                worst[row.limit] = one, row
    return worst.values()


def print_examination(out: Console, examination: RobotExamination) -> None:
    """Print joints and links of a robot, then every error and every warning on its own line."""
    out.print(
        f"{examination.name}: robot {examination.robot_name!r} of {examination.file}, {examination.dof} joints, "
        f"{examination.mass:.6g} kg",
        markup=False,
    )
    joints = Table("joint", "type", "unit", "lower", "upper", "velocity", "acceleration", "jerk", "effort", box=SIMPLE)
    for joint in examination.joints:
        limits = (joint.lower, joint.upper, joint.velocity, joint.acceleration, joint.jerk, joint.effort)
        shown = ["-" if np.isnan(value) else f"{value:.6g}" for value in limits]
        if np.isneginf(joint.lower) and np.isposinf(joint.upper):
            shown[:2] = "no range", ""
        joints.add_row(escape(joint.name), joint.type, joint.unit, *shown)
    links = table_with_units("link", "mass [kg]", "principal moments of inertia [kg·m²]", box=SIMPLE)
    for link in examination.links:
        links.add_row(escape(link.name), f"{link.mass:.6g}", ", ".join(f"{moment:.4g}" for moment in link.moments))
    out.print(joints)
    out.print(links)
    for kind, sentences in (("error", examination.errors), ("warning", examination.warnings)):
        for sentence in sentences:
            out.print(f"{kind}: {sentence}", markup=False)
    for clause in examination.notes:
        out.print(f"note: {clause}", markup=False)
    out.print(f"{len(examination.errors)} errors, {len(examination.warnings)} warnings")
