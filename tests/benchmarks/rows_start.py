"""Rows of the table: how long Python takes to start with a package."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator

from cases import PLAIN, Case, Line
from compare import Action

ROUNDS = 5
OPTIMISE = "from trajevo import optimise"

#: What `from trajevo import optimise`, with all that it imports, and `trajevo --help` may take [s].
MOST_IMPORT, MOST_HELP = 0.6, 0.2


def lines() -> Iterator[Line]:
    """Imports, then the command line."""
    ways = {
        f"import {name}": started(f"import {name}") for name in ("numpy", "pinocchio", "pymoo.algorithms.moo.nsga2")
    }
    ways |= {
        OPTIMISE: started(OPTIMISE),
        PLAIN: started("import trajevo"),
    }
    yield from Case(
        title="start of Python and an import", ways=ways, rounds=ROUNDS, most={OPTIMISE: MOST_IMPORT}
    ).lines()
    helped = {PLAIN: started("from trajevo.cli.main import main; main()", "--help")}
    yield from Case(title="trajevo --help", ways=helped, rounds=ROUNDS, most={PLAIN: MOST_HELP}).lines()


def started(program: str, *arguments: str) -> Action:
    """A process of this Python that runs a program and ends."""
    command = [sys.executable, "-c", program, *arguments]
    return lambda: subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
