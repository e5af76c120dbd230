"""The page of the benchmark suite's problems, from their reference files."""

from __future__ import annotations

from trajevo.study.bench.suite import BenchmarkProblem, benchmark, benchmarks

INTRODUCTION = """# Problems of the benchmark suite

Every problem is a folder in `problems/bench/`: `task.toml`, or the name of a registered problem, and `reference.json`
with the best that is known of it, as decision vectors. Whenever they are read, the problem evaluates them again; a
member that breaks a limit, or has other values than the file says, is refused. To add a problem, add such a folder.
Where the greatest payloads of given motions are asked for, none may be less than what is proven to be possible.

Each problem also has a plain statement, one decision vector at a time in SciPy and Pinocchio, on which any other solver
can be set; where it has none, its section says so.

In Python, `benchmark("lin1983")` of `trajevo.study.bench.suite` is a problem of the suite: its `reference` has decision
vectors and values, `problem()` is the problem itself, and `statement().evaluate(x)` gives objectives and constraints of
one decision vector, which keeps all limits if no constraint is above 0.

Most problems prove their limits at every instant, so that reading a set proves it again; `reference.proven` tells.
Those that check efforts or the height of a tool at samples alone do not: `reference.certificates()` shows how far their
best known sets exceed a limit in between. That is 0.0005 % for `guo2016_payload`, and nothing for the others; no
certificate covers the drives of `cops_robot_arm`, which exceed their limits by 0.05 % at 50,000 instants. The random
motions whose payloads are asked for are drawn under limits of effort alone: some joints are more than twice as fast as
they may be.

A value from elsewhere is *printed* if it was read in its source or in a text that quotes it. One that was *not looked
up* stands here with what speaks for it. One that is *computed* is printed nowhere: SciPy, Ipopt, toppra, Drake or a
closed form found it, on the same curve where no note says otherwise.
"""

#: Problems that were thought of, and why they are not in the suite.
OUT = {
    "Motors that heat, with a hold after each motion": "no plain statement",
}
LEFT_OUT = "\n".join(
    [
        "## Left out, and why",
        "",
        "| problem | why |",
        "|---|---|",
        *(f"| {name} | {why} |" for name, why in OUT.items()),
    ]
)


def page() -> str:
    """The page in Markdown."""
    problems = [benchmark(name) for name in benchmarks()]
    table = ["| problem | objectives | best known | from elsewhere |", "|---|---|---|---|", *map(_row, problems)]
    parts = [INTRODUCTION, "\n".join(table), *map(_section, problems), LEFT_OUT]
    return "\n\n".join(part.strip() for part in parts) + "\n"


def _row(of: BenchmarkProblem) -> str:
    objectives = ", ".join(of.told.objectives)
    published = "; ".join(
        f"{_with(one.value, one.unit, 7)}{' ?' if one.basis == 'not looked up' else ''}" for one in of.published
    )
    return f"| [`{of.name}`](#{of.name.replace('_', '-')}) | {objectives} | {_best(of)} | {published} |"


def _best(of: BenchmarkProblem) -> str:
    """The least of each objective, or what given motions can carry."""
    if of.told.kind == "capacity":
        return f"{_motions(of)}: {_payloads(of)}"
    columns = zip(of.told.objectives, of.told.units, zip(*of.told.values, strict=True), strict=True)
    return ", ".join(_with(min(values), unit, 6) for _, unit, values in columns)


def _motions(of: BenchmarkProblem) -> str:
    count = len(of.told.values)
    return "a given motion" if count == 1 else f"{count} given motions"


def _payloads(of: BenchmarkProblem) -> str:
    """Least and greatest payload of the given motions, the last variable of each."""
    least, greatest = (choose(row[-1] for row in of.told.variables) for choose in (min, max))
    return f"{least:.7g} kg" if least == greatest else f"{least:.6g} to {greatest:.6g} kg"


def _with(value: float, unit: str, digits: int) -> str:
    return f"{value:.{digits}g} {unit.replace('*', '·')}".removesuffix(" 1")


def _section(of: BenchmarkProblem) -> str:
    told = of.told
    what = (
        f"registered problem `{told.registered.name}`" if told.registered else f"`problems/bench/{of.name}/task.toml`"
    )
    counts = {
        "least": "the least value",
        "front": f"a front of {len(told.values)} members",
        "capacity": f"what {_motions(of)} can carry, {_payloads(of)}",
    }
    count = counts[told.kind]
    lines = [f"## {of.name}", "", f"{told.title}. {what[0].upper()}{what[1:]}.", "", f"Source: {told.source}.", ""]
    lines += [f"Best known: {count}, found by {told.found_by}.", ""]
    lines += ["| objective | unit | least known | box |", "|---|---|---|---|"]
    columns = zip(told.objectives, told.units, zip(*told.values, strict=True), strict=True)
    for k, (name, unit, values) in enumerate(columns):
        lines.append(f"| {name} | {unit} | {min(values):.9g} | {told.ideal[k]:g} to {told.reference_point[k]:g} |")
    if of.published:
        lines += ["", "| from elsewhere | value | basis | source and note |", "|---|---|---|---|"]
    for one in of.published:
        value = _with(one.value, one.unit, 9)
        lines.append(f"| {one.objective} | {value} | {one.basis} | {one.source}. {one.note} |")
    return "\n".join([*lines, *_unstated(of)])


def _unstated(of: BenchmarkProblem) -> list[str]:
    return ["", f"It has no plain statement: {told}."] if (told := UNSTATED.get(of.name)) else []


#: Problems without a plain statement, and why.
UNSTATED = {
    "pick_and_place_cell": "lines of the tool, dwells and a part that is picked up are beyond it",
    "puma_path": "it is for solvers of least times along paths, which are given the path and the limits",
    "puma_path_jerk_free": "it is for solvers of least times along paths, which are given the path and the limits",
}
