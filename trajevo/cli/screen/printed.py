"""Printed output of the command line: problems and robots, a run with its choices, errors of a robot."""

from __future__ import annotations

import inspect
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from rich.console import Console
from rich.table import Table
from rich.text import Text

from trajevo.base.arrays import Array
from trajevo.base.units import pretty
from trajevo.cli.screen.tables import Listing
from trajevo.errors import InvalidInputError, NotImportedError, NotRegisteredError
from trajevo.exporters.export import NAMED_EXPORTERS
from trajevo.formulation.constraints.constraint import LimitParameter
from trajevo.formulation.constraints.kinds import NAMED_KINDS
from trajevo.formulation.constraints.motion_limits import via_errors
from trajevo.formulation.objectives import NAMED_OBJECTIVES
from trajevo.formulation.registry import list_problems, problem_class
from trajevo.front.front import Front, Solution
from trajevo.front.notebook import told_base
from trajevo.page.facts import known_values, objective_headers, run_facts, visit_rows
from trajevo.robot.joints import position_unit
from trajevo.robot.locate import list_example_robots, list_robots
from trajevo.robot.robot import Robot, load_robot
from trajevo.solvers.evolutionary.algorithms import NAMED_ALGORITHMS
from trajevo.trajectory.interpolants import NAMED_INTERPOLANTS
from trajevo.verification.shares import shares_of_rows

if TYPE_CHECKING:
    from trajevo.robot.examine import JointRow, RobotExamination
    from trajevo.solvers.rivals import Rival
    from trajevo.verification.verify import Utilisation, Verification


def print_list(out: Console) -> None:
    """Print problems, their building blocks, formats and robots."""
    problems = Listing("problem", "title", "registered as", title="Problems")
    for name, point in list_problems().items():
        try:
            title = problem_class(name).title
        except InvalidInputError as error:
            title = f"cannot be used: {error}"
        problems.add(name, title, point.value)
    robots = Listing("robot", "dof", "limits", "not limited", title="Robots")
    for name in list_robots():
        robot = load_robot(name)
        limits = {
            "position": np.concatenate([robot.limits.lower, robot.limits.upper]),
            **{kind: robot.limits.sides(kind).greater for kind in ("velocity", "acceleration", "jerk", "effort")},
        }
        given = [kind for kind, values in limits.items() if np.isfinite(values).all()]
        missing = [kind for kind in limits if kind not in given]
        robots.add(name, str(robot.dof), ", ".join(given), ", ".join(missing))
    out.print(problems)
    _print_parts(out)
    out.print(robots)
    out.print(f"and of example-robot-data, or any URDF (trajevo check-robot): {', '.join(list_example_robots())}")


def _print_parts(out: Console) -> None:
    """Print the building blocks of problems and tasks by name, and the export formats."""
    rows: list[tuple[str, ...]] = [(o.name, _objective_unit(o.unit), o.help) for o in NAMED_OBJECTIVES.all().values()]
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


def _objective_unit(unit: str) -> str:
    """Unit of an objective, in words where the robot's joints decide it."""
    return pretty(unit.replace("{joint}", "(rad or m)").replace("{effort}", "(N*m or N)"))


def _table(title: str, headers: Sequence[str], rows: Iterable[Sequence[str]]) -> Listing:
    table = Listing(*headers, title=title)
    for row in rows:
        table.add(*row)
    return table


#: Shares of a limit that are told alike, to the shown digit [1].
_ALIKE = 5e-4


def print_run(out: Console, front: Front, *, angle: str | None = None, verbose: bool = False) -> None:
    """Print the solutions to choose from, then the facts of a run.

    Args:
        out: where they are printed.
        front: the front of the run.
        angle: unit of angles, that of the problem if None.
        verbose: all settings too, with points and tables.
    """
    # Before anything is printed, since they may be refused.
    choices, headers = front.choices() if len(front) else (), objective_headers(front, angle=angle)
    out.print(f"{front.record.title}: {len(front)} solutions")
    if choices and known_problem(front):
        _print_choices(out, front, choices, headers)
    elif choices:
        _print_recorded(out, choices, front.F, headers)
    else:
        out.print(f"The front is empty: {front.blocking}.")
    facts = Table.grid(padding=(0, 2))
    for label, text in run_facts(front, brief=not verbose):
        facts.add_row(Text(label), Text(text))
    out.print(facts)


def known_problem(front: Front) -> bool:
    """Whether the problem of a front can be had: functions of the user's own are not imported for data."""
    try:
        front.problem  # noqa: B018 - made when it is asked for
    except (NotImportedError, NotRegisteredError):
        return False
    return True


def _print_recorded(out: Console, choices: Sequence[Solution], F: Array, headers: Sequence[tuple[str, float]]) -> None:
    """Print objectives (N, n_obj) of solutions as they are recorded, where nothing can be computed again."""
    table = Listing("solution", *(header for header, _ in headers))
    for one in choices:
        values = zip(F[one.index], headers, strict=True)
        table.add(one.rule, *(f"{value * factor:.6g}" for value, (_, factor) in values))
    out.print(table)


def _print_choices(
    out: Console, front: Front, choices: Sequence[Solution], headers: Sequence[tuple[str, float]]
) -> None:
    """Print objectives, bases, orders, via errors and closest limits of solutions, each where it tells them apart."""
    rows = [one.index for one in choices]
    missed = via_errors(front.problem.interpolant, front.problem.decode(front.X[rows])).max(axis=2)
    passed = [f"via error [{position_unit(front.problem.robot)}]"] if missed.any() else []
    shares = shares_of_rows(front, rows)
    alike = _alike(shares)
    header, closest = _closest([{name: one[name] for name in one if name not in alike} for one in shares])
    told = [header.format("closest other limit" if alike else "closest limit")] if header else []
    bases = [told_base(one) for one in choices]
    based = ["base"] if any(bases) else []
    ordered = ["order"] if any(one.order is not None for one in choices) else []
    table = Listing("solution", *(header for header, _ in headers), *based, *ordered, *passed, *told)
    values = known_values(front, rows, [factor for _, factor in headers])
    for k, solution in enumerate(choices):
        errors = [f"{missed[k].max():.3g}"] if passed else []
        order = [] if not ordered or solution.visits is None else [solution.visits.told_order]
        base = [bases[k]] if based else []
        table.add(solution.rule, *values[k], *base, *order, *errors, *([closest[k]] if told else []))
    out.print(table)
    titles, rows_of_visits = visit_rows(choices[0])
    if rows_of_visits:
        out.print(_table(f"Points as {choices[0].rule} visits them", titles, rows_of_visits))
    if alike:
        said = ", ".join(f"{name} at {100.0 * share:.1f} %" for name, share in alike.items())
        out.print(f"the same for all of them: {said} of the limit")


def _closest(shares: Sequence[Mapping[str, float]]) -> tuple[str, list[str]]:
    """Header and cells of a column with the limit that each motion uses most of; empty texts without limits."""
    names = [max(one, key=one.__getitem__, default="") for one in shares]
    if not all(names):
        return "", [""] * len(shares)
    used = [f"{100.0 * one[name]:.1f}" for one, name in zip(shares, names, strict=True)]
    if len(set(names)) == 1:
        return f"{{}}, {names[0]} [%]", used
    return "{}", [f"{share} % {name}" for share, name in zip(used, names, strict=True)]


def _alike(shares: Sequence[Mapping[str, float]]) -> dict[str, float]:
    """Limits that would be the closest of a motion but of which all motions use as much, as points on a limit do."""
    if len(shares) < 2:
        return {}
    same = {name for name, share in shares[0].items() if all(abs(one[name] - share) < _ALIKE for one in shares[1:])}
    vary = [max((share for name, share in one.items() if name not in same), default=-np.inf) for one in shares]
    return {name: share for name, share in shares[0].items() if name in same and share > min(vary) and share > _ALIKE}


def print_mass_notes(out: Console, robot: Robot) -> None:
    """Print what the efforts of a robot do not cover, if there is something."""
    for note in robot.mass_notes:
        out.print(f"note: {note}")


def print_rivals(out: Console, rivals: Sequence[Rival]) -> None:
    """Print interpolants at their least times, fastest first."""
    from trajevo.solvers.rivals import RIVALS_NOTE, rivals_table

    names, rows = rivals_table(rivals)
    out.print(_table("Least times under the same limits", names, rows))
    out.print(RIVALS_NOTE)


def print_verifications(out: Console, found: Sequence[Verification]) -> None:
    """Print the worst row of every limit over all motions, other exceeded limits, and the verdict."""
    several, shown = len(found) > 1, list(_shown(found))
    own = ["of the robot's own [%]"] if any(row.full_share is not None for _, row in shown) else []
    table = Listing("limit", "joint", "used [%]", *own, "at [s]", *(["solution"] if several else []))
    for verification, row in shown:
        full = ["" if row.full_share is None else f"{100.0 * row.full_share:.2f}"] if own else []
        cells = [row.limit, row.joint or "", f"{100.0 * row.share:.2f}", *full]
        cells += ["" if row.instant is None else f"{row.instant:.4f}", *([verification.solution] if several else [])]
        table.add(*cells, style="bold red" if row in verification.exceeded else "green")
    out.print(table)
    if not several:
        out.print(f"objectives are known: {', '.join(map(str, found[0].objectives))}")
    missed = max(one.via_error for one in found)
    if missed:
        out.print(f"via error: a joint passes an inner point at up to {missed:.4g} {found[0].via_unit}")
    difference = max(one.effort_difference for one in found)
    if not np.isnan(difference):
        out.print(f"effort here and by Pinocchio: at most {difference:.3g} (N·m or N) apart")
    failed = [one for one in found if not one.passed]
    for one in failed:
        out.print(one.verdict)
    if several:
        out.print(f"{len(found) - len(failed)} of {len(found)} solutions keep every limit.")
    elif not failed:
        out.print(found[0].verdict)


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
    kinds = {joint.type for joint in examination.joints}
    joints = f"{examination.dof} {kinds.pop() if len(kinds) == 1 else ''} joints".replace("  ", " ")
    out.print(
        f"{examination.name}: robot {examination.robot_name!r} of {examination.file}, {joints}, "
        f"{examination.mass:.6g} kg",
    )
    for unit in dict.fromkeys(joint.unit for joint in examination.joints):
        out.print(_joints([joint for joint in examination.joints if joint.unit == unit], unit))
    links = Listing("link", "mass [kg]", "principal moments of inertia [kg·m²]")
    for link in examination.links:
        links.add(link.name, f"{link.mass:.6g}", ", ".join(f"{moment:.4g}" for moment in link.moments))
    out.print(links)
    for kind, sentences in (("error", examination.errors), ("warning", examination.warnings)):
        for sentence in sentences:
            out.print(f"{kind}: {sentence}")
    for clause in examination.notes:
        out.print(f"note: {clause}")
    counts = (len(examination.errors), "error"), (len(examination.warnings), "warning")
    out.print(", ".join(f"{count} {what}{'' if count == 1 else 's'}" for count, what in counts))


def _limit_shown(limit: float, backward: float | None) -> str:
    """A limit, with that of the negative direction before it if there is one."""
    if backward is not None and backward != limit:
        return f"-{backward:.6g} to {limit:.6g}"
    return "-" if np.isnan(limit) else f"{limit:.6g}"


def _joints(rows: Sequence[JointRow], unit: str) -> Listing:
    """Joints with limits in the same units; their types only if they are of several."""
    several = len({row.type for row in rows}) > 1
    table = Listing(
        *("joint", *(["type"] if several else []), f"lower [{unit}]", f"upper [{unit}]", f"velocity [{unit}/s]"),
        *(f"acceleration [{unit}/s²]", f"jerk [{unit}/s³]", f"effort [{'N' if unit == 'm' else 'N·m'}]"),
    )
    for row in rows:
        limits = (row.lower, row.upper, row.velocity, row.acceleration, row.jerk, row.effort)
        backward = (None, None, row.velocity_backward, row.acceleration_backward, None, row.effort_backward)
        shown = [_limit_shown(value, other) for value, other in zip(limits, backward, strict=True)]
        if np.isneginf(row.lower) and np.isposinf(row.upper):
            shown[:2] = "no range", "no range"
        table.add(row.name, *([row.type] if several else []), *shown)
    return table
