"""What the shell offers after a tab: names of problems, robots, examples and formats, files, and folders of runs.

What a function needs is imported when it is asked, so that nobody else waits for it.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator
from itertools import islice
from pathlib import Path

import typer

#: Greatest number of folders in which runs are looked for, for an answer at once.
_MOST_FOLDERS = 500

#: Greatest size of a manifest that is read [byte].
_LARGEST = 1_000_000


def problems(incomplete: str) -> list[str]:
    """Registered problems, tasks among the examples, and TOML files."""
    from trajevo.formulation.examples import list_examples
    from trajevo.formulation.registry import list_problems

    return _begun([*list_problems(), *list_examples("task"), *_files(incomplete, "*.toml")], incomplete)


def robots(incomplete: str) -> list[str]:
    """Robots by name, files of URDF, xacro and MJCF, and folders with a robot.toml."""
    from trajevo.robot.locate import list_example_robots, list_robots

    folders = (str(Path(file).parent) for file in _files(incomplete, "*/robot.toml"))
    names = [*list_robots(), *list_example_robots()]
    files = (file for ending in ("*.urdf", "*.xacro", "*.xml") for file in _files(incomplete, ending))
    return _begun([*names, *files, *folders], incomplete)


def examples(incomplete: str) -> list[str]:
    """Worked examples."""
    from trajevo.formulation.examples import list_examples

    return _begun(list_examples(), incomplete)


def papers(incomplete: str) -> list[str]:
    """Papers whose figures and tables can be made again."""
    from trajevo.reproduction.registry import paper_names

    return _begun(paper_names(), incomplete)


def studies(incomplete: str) -> list[str]:
    """Studies among the examples, TOML files, and folders of studies."""
    from trajevo.formulation.examples import list_examples

    return _begun(
        [*list_examples("study"), *_files(incomplete, "*.toml"), *_folders(incomplete, ("study.json",))], incomplete
    )


def study_folders(incomplete: str) -> list[str]:
    """Folders of studies."""
    return _begun(_folders(incomplete, ("study.json",)), incomplete)


def runs(incomplete: str) -> list[str]:
    """Folders of runs here and up to two levels further down."""
    return _begun(_folders(incomplete, ("manifest.json", "front.json")), incomplete)


def solutions(ctx: typer.Context, incomplete: str) -> list[str]:
    """Rules that choose a solution, with the objectives of the run if its manifest can be read."""
    named = (f"least_{name}" for name in _objectives(ctx))
    return _begun(["knee", "utopia", "weighted", "topsis", *named], incomplete)


def weights(ctx: typer.Context, incomplete: str) -> list[str]:
    """Words for weights, an example with the objectives of the run, and CSV files."""
    given = ",".join(f"{name}=1" for name in _objectives(ctx))
    words = ["equal", "entropy", "paper", *([given] if given else [])]
    return _begun([*words, *_files(incomplete, "*.csv")], incomplete)


def _objectives(ctx: typer.Context) -> list[str]:
    """Names of the objectives of the run, if its manifest can be read."""
    try:
        manifest = Path(ctx.params["run"]) / "manifest.json"
        whole = json.loads(manifest.read_text(encoding="utf-8")) if manifest.stat().st_size <= _LARGEST else {}
        return [str(objective["name"]) for objective in whole["problem"]["objectives"]]
    except (OSError, ValueError, KeyError, TypeError):  # another folder, or a damaged one: the rules alone are offered
        return []


def formats(incomplete: str) -> list[str]:
    """Export formats."""
    from trajevo.exporters.export import NAMED_EXPORTERS

    return _begun(NAMED_EXPORTERS.names(), incomplete)


def picture_formats(incomplete: str) -> list[str]:
    """Formats of pictures."""
    from trajevo.plots.pictures import FORMATS

    return _begun(FORMATS, incomplete)


def controllers(incomplete: str) -> list[str]:
    """Controllers of motions in closed loop."""
    from trajevo.verification.twin.settings import CONTROLLERS

    return _begun(CONTROLLERS, incomplete)


def interpolants(incomplete: str) -> list[str]:
    """Interpolants."""
    from trajevo.trajectory.interpolants import NAMED_INTERPOLANTS

    return _begun(NAMED_INTERPOLANTS.names(), incomplete)


def algorithms(incomplete: str) -> list[str]:
    """Algorithms of the search."""
    from trajevo.solvers.evolutionary.algorithms import NAMED_ALGORITHMS

    return _begun(NAMED_ALGORITHMS.names(), incomplete)


def _begun(names: Iterable[str], incomplete: str) -> list[str]:
    return sorted({name for name in names if name.startswith(incomplete)})


def _base(incomplete: str) -> Path:
    """The folder in which what was begun lies."""
    return Path(incomplete) if incomplete.endswith("/") else Path(incomplete).parent if incomplete else Path()


def _files(incomplete: str, pattern: str) -> list[str]:
    return [str(file) for file in _base(incomplete).glob(pattern)]


def _folders(incomplete: str, names: tuple[str, ...]) -> list[str]:
    """Folders with one of some files, of those near what was begun."""
    return [str(folder) for folder in _near(_base(incomplete)) if any((folder / name).is_file() for name in names)]


def _near(base: Path) -> Iterator[Path]:
    found = (folder for pattern in ("*", "*/*", "*/*/*") for folder in base.glob(pattern) if folder.is_dir())
    return islice(found, _MOST_FOLDERS)
