"""The command ``trajevo``: its help appears at once, since a command's module is imported only when it is called."""

from __future__ import annotations

import atexit
import errno
import gc
import importlib
import io
import os
import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Annotated, Any, NamedTuple, final

import typer
from typer.core import TyperCommand, TyperGroup

from trajevo import __version__
from trajevo.base.files import why_not
from trajevo.cli.console import Terminal
from trajevo.cli.screen.usage import UsageError, is_help, told
from trajevo.errors import NoSolutionError, TrajevoError


class _Home(NamedTuple):
    """Module and function of a command, and the first line of its help."""

    module: str
    name: str
    help: str


#: New objects after which garbage is looked for, a hundred times as many as usual: a command makes hardly any cycles.
_ALLOCATIONS = 70_000

#: Commands in the order in which ``trajevo --help`` lists them.
COMMANDS = {
    "list": _Home("robots", "list_everything", "List problems, their building blocks, formats and robots."),
    "check-robot": _Home(
        "robots",
        "check_robot",
        "Show everything that is wrong with a robot at once; exit code 1 if it cannot be loaded.",
    ),
    "init": _Home("init", "init", "Write a commented example of a task to change and solve."),
    "examples": _Home("init", "examples", "List the worked tasks, studies and notebooks, or copy one to a folder."),
    "check": _Home(
        "check",
        "check_problem",
        "Show what rules a motion out before a search: efforts, clearances and least times; exit code 3 if any does.",
    ),
    "solve": _Home("solve", "solve", "Solve a problem or a task and write its front and report."),
    "resume": _Home(
        "solve",
        "resume",
        "Continue a run as if it had never stopped, and write its front and report.",
    ),
    "polish": _Home(
        "solve",
        "polish_run",
        "Refine a run's front by gradients; the original front is kept beside it in evolved.json.",
    ),
    "study": _Home("study", "app", "Many runs: the product of factors, on one machine or a cluster."),
    "choose-robot": _Home(
        "choose.command",
        "choose",
        "Solve a task for several robots: one front over all, who is never the best, and what stops the others.",
    ),
    "bench": _Home(
        "bench.command", "app", "Rivals on published problems, on equal terms: times to what is best known."
    ),
    "show": _Home("show", "show", "Show a run in the terminal."),
    "explain": _Home(
        "show",
        "explain",
        "Show what holds a solution back, what a little more of each limit would buy, and draw both along the front.",
    ),
    "report": _Home(
        "show", "report", "Write a run's report of what is kept of it, one HTML file that needs no network."
    ),
    "pictures": _Home(
        "show",
        "pictures",
        "Draw all pictures of what is kept of a run for a paper: text of 8 pt at the width of a column or a page.",
    ),
    "open": _Home(
        "show",
        "open_run",
        "Serve a run's page to a browser on this machine: it follows the run, and its buttons go on with it.",
    ),
    "weigh": _Home(
        "solve",
        "weigh",
        "Solve again for one trade-off: minimise a weighted sum of the objectives, and keep the optimum in the front.",
    ),
    "verify": _Home(
        "show",
        "verify_motions",
        "Check a motion between its samples against every limit; exit code 1 if one is exceeded.",
    ),
    "bound": _Home(
        "bounds.command",
        "bound",
        "Bound a run's front from below: what no motion of its kind can be better than; it goes on where it stopped.",
    ),
    "certify": _Home(
        "show",
        "certificate",
        "Prove that a motion keeps every limit at every instant; exit code 1 if one is broken or not decided.",
    ),
    "check-proof": _Home(
        "proof.command",
        "check_proof",
        "Check a proof file without trusting what wrote it; exit code 1 if something that it claims is not proven.",
    ),
    "export": _Home(
        "show",
        "export",
        "Write the motion of one solution for a controller or a spreadsheet, or the whole front for other programs.",
    ),
    "animate": _Home(
        "show",
        "animate_motion",
        "Write an animation of one solution in real time: one HTML file that needs no network, or a film.",
    ),
    "capacity": _Home("show", "capacity", "Show the largest payload of a motion, which actuator limits it and when."),
    "slowdown": _Home(
        "payload",
        "slowdown",
        "Show how long a motion's path takes with another payload, and draw payload against time.",
    ),
    "workspace-capacity": _Home(
        "payload",
        "workspace",
        "Draw the largest payload that a robot can hold, or accelerate, at every tool position of a plane.",
    ),
    "base-map": _Home(
        "cell.base_map",
        "base_map",
        "Show and draw the least of an objective from every place of a robot's base; exit code 3 if there is none.",
    ),
    "payload-diagram": _Home(
        "payload",
        "diagram",
        "Show and draw the largest payload of a motion by the offset of its centre of mass from the tool.",
    ),
    "payload-sheet": _Home(
        "sheet.command",
        "payload_sheet_of",
        "Write the sheet of what a motion carries, to check and sign, and its JSON; exit code 1 unless within limits.",
    ),
    "identify-payload": _Home(
        "logs.commands",
        "identify",
        "Find mass, centre of mass and inertia of a payload from a log of torques or currents, with error bars.",
    ),
    "fit-drives": _Home(
        "logs.commands",
        "fit",
        "Fit torque constants, friction, winding losses and standby to a log of currents or power, with error bars.",
    ),
    "payload-time": _Home(
        "payload",
        "payload_time",
        "Optimise the motion again for each payload: show and draw the least times and the largest payload.",
    ),
    "simulate": _Home(
        "twin.simulate",
        "simulate",
        "Play a motion, or the front, in closed loop in MuJoCo: errors, efforts, settling, and what stays undominated.",
    ),
    "reproduce": _Home(
        "reproduce",
        "reproduce",
        "Make figures and tables of a paper again beside its printed numbers; exit code 1 if one is not as expected.",
    ),
}


@final
class _Commands(TyperGroup):
    """Commands that are imported when they are called, not when they are listed."""

    _listing = False

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """The command of a name; while all are listed, only its name and the first line of its help."""
        home = COMMANDS.get(cmd_name)
        if home is None or self._listing:
            return self.commands.get(cmd_name)
        found: Any = getattr(_imported(f"trajevo.cli.{home.module}"), home.name)
        around = typer.Typer(add_completion=False, rich_markup_mode=None)
        if not isinstance(found, typer.Typer):
            around.command(cmd_name)(found)
            return typer.main.get_command(around)
        around.add_typer(found, name=cmd_name)
        group: Any = typer.main.get_command(around)
        for inner in group.commands[cmd_name].commands.values():
            inner.short_help = inner.help  # which is not cut
        return group.commands[cmd_name]

    def format_help(self, ctx: Any, formatter: Any) -> None:
        """The help with the list of all commands."""
        with self._listed():
            super().format_help(ctx, formatter)

    def shell_complete(self, ctx: Any, incomplete: str) -> Any:
        """What the shell offers: names of commands, none of which is imported for that."""
        with self._listed():
            return super().shell_complete(ctx, incomplete)

    @contextmanager
    def _listed(self) -> Iterator[None]:
        self._listing = True
        try:
            yield
        finally:
            self._listing = False


def _imported(module: str) -> Any:
    """A command's module, with all that it imports.

    None of that is garbage: without looking for it, now and whenever else garbage is collected, imports take 8 % less.
    """
    if module in sys.modules:
        return sys.modules[module]
    gc.disable()
    try:
        return importlib.import_module(module)
    finally:
        gc.enable()
        gc.freeze()


def _tell_version(wanted: bool) -> None:
    if wanted:
        sys.stdout.write(f"trajevo {__version__}\n")
        raise typer.Exit


def _trajevo(
    version: Annotated[
        bool, typer.Option("--version", callback=_tell_version, is_eager=True, help="Show the version and exit.")
    ] = False,
) -> None:
    """Multi-objective trajectory optimisation and payload capacity for robots."""


def _whole_names(formatter: Any) -> Any:
    """A formatter of help pages that does not break names such as sms-emoa at their hyphens."""
    hyphen, unbroken = "-", "\N{NON-BREAKING HYPHEN}"

    class WholeNames(formatter):  # type: ignore[misc]
        def write(self, string: str) -> None:
            super().write(string.replace(unbroken, hyphen))

        def write_text(self, text: str) -> None:
            super().write_text(text.replace(hyphen, unbroken))

        def write_dl(self, rows: Any, **widths: int) -> None:
            super().write_dl([(name, said.replace(hyphen, unbroken)) for name, said in rows], **widths)

    return WholeNames


def _app() -> Any:
    """The command, with its subcommands named but not yet imported."""
    # Without rich the help takes half the time, whole option names fit, and no unit in brackets is read as markup.
    described = typer.Typer(cls=_Commands, no_args_is_help=True, rich_markup_mode=None)
    described.callback()(_trajevo)
    app: Any = typer.main.get_command(described)
    app.context_class.formatter_class = _whole_names(app.context_class.formatter_class)
    app.name = "trajevo"
    app.commands = {name: TyperCommand(name, help=home.help, short_help=home.help) for name, home in COMMANDS.items()}
    return app


app = _app()


def main() -> None:
    """Entry point: one sentence, and exit code 2 for bad input or 3 where a front holds no solution."""
    # No window is needed; matplotlib is imported later, if at all.
    os.environ["MPLBACKEND"] = "Agg"
    # Plug-ins of pydantic are for services; looking for them opens a file of every installed package.
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")
    gc.set_threshold(_ALLOCATIONS)
    atexit.register(gc.freeze)  # the end of the process frees its memory; looking for garbage first takes up to 0.7 s
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")
    console = Terminal(stderr=True)
    warnings.showwarning = lambda message, *_: console.print(f"warning: {message}")
    try:
        try:
            code = app(prog_name="trajevo", standalone_mode=False)
        finally:
            sys.stdout.flush()
        sys.exit(code if isinstance(code, int) else 0)
    except UsageError as error:
        if is_help(error):
            error.show()
        else:
            console.print(f"error: {told(error)}")
        sys.exit(2)
    except TrajevoError as error:
        console.print(f"error: {error}")
        sys.exit(3 if isinstance(error, NoSolutionError) else 2)
    except OSError as error:
        if error.filename is not None:
            raise
        # Whatever is left to print would fail again when the process ends.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        if error.errno != errno.EPIPE:  # of which nobody wants to hear: the reader has seen enough
            console.print(f"error: standard output: cannot be written: {why_not(error)}")
        sys.exit(2)
