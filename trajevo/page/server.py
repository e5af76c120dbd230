"""The page of a run, served on this machine alone: it follows a run, and its buttons go on with one that ended."""

from __future__ import annotations

import hmac
import json
import secrets
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any, final
from urllib.parse import parse_qsl, urlsplit

from trajevo.errors import InvalidInputError, TrajevoError
from trajevo.front.front import Front
from trajevo.page.asked import Asked
from trajevo.page.report import report
from trajevo.plots.analyses import ANALYSES_SUFFIX
from trajevo.plots.analyses_file import read_analyses
from trajevo.solvers.run.folder import FRONT_FILE, RunFolder
from trajevo.solvers.run.runs import read_run, standing

#: The only address that is served.
LOOPBACK = "127.0.0.1"

#: Time without a checkpoint after which a run that has not ended counts as stopped [s].
_STILL = 120.0

#: Generations that a button adds, and characters of what a job said that are kept.
MORE, _SAID = 50, 600


@dataclass(frozen=True)
class Begun:
    """What a button began.

    Attributes:
        name: what it does.
        running: whether it still works.
        failed: whether it ended with an error.
        said: the end of what it printed.
    """

    name: str
    running: bool
    failed: bool
    said: str


@final
class RunPage:
    """A run whose page is made again whenever there is something new.

    Args:
        run: the run's folder.
        read: reads the front of the folder; :func:`~trajevo.solvers.run.runs.read_run` if None.
        problem: what commands need as ``--problem`` for a run whose problem is not registered.
    """

    def __init__(self, run: Path, read: Callable[[], Front] | None = None, problem: str | None = None) -> None:
        self.run = run
        self._problem = problem
        self._read = read or (lambda: read_run(run))
        self._lock = threading.Lock()
        self._made: tuple[str, bytes, Asked] | None = None
        self._job: tuple[str, subprocess.Popen[bytes], Any] | None = None

    @property
    def stamp(self) -> str:
        """What changes when the run has something new: times and sizes of its files."""
        files = sorted(file for file in self.run.glob("*") if file.suffix in (".json", ".npz"))
        found = []
        for file in files:
            try:
                stat = file.stat()
            except OSError:  # replaced at this moment
                continue
            found.append(f"{file.name} {stat.st_mtime_ns} {stat.st_size}")
        return f"{hash(tuple(found)):x}"

    def html(self, token: str) -> bytes:
        """The page as it is now, made once for every stamp.

        Raises:
            TrajevoError: the run cannot be read, or has no generation yet.
        """
        with self._lock:
            stamp = self.stamp
            if self._made is None or self._made[0] != stamp:
                front = self._read()
                kept = (self.run / FRONT_FILE).with_suffix(ANALYSES_SUFFIX)
                found = read_analyses(kept, front) if len(front) else {}
                with tempfile.TemporaryDirectory() as folder:
                    live = {"stamp": stamp, "token": token, "more": MORE, "formats": Asked.formats()}
                    file = report(
                        front,
                        Path(folder) / "page.html",
                        analyses=found,
                        pictures=[],
                        files="choices",
                        run=str(self.run),
                        problem=self._problem,
                        live=live,
                    )
                    self._made = stamp, file.read_bytes(), Asked(front)
            return self._made[1]

    def answer(self, what: str, given: Mapping[str, str]) -> bytes:
        """What the page asks about a solution: its certificate, its largest payload, or its file in a format.

        Args:
            what: ``"certificate"``, ``"payload"`` or ``"file"``.
            given: ``row`` of the front of the page whose ``stamp`` this is, and of a file its ``format``.

        Raises:
            TrajevoError: something else is asked, the page is not the newest, or it cannot be computed.
        """
        with self._lock:
            if self._made is None or given.get("stamp") != self._made[0]:
                raise InvalidInputError("the run has something new; load the page again")
            row = given.get("row", "")
            if not row.isdecimal():
                raise InvalidInputError(f"row: expected a whole number, got {row!r}")
            if what == "file":
                return self._made[2].file(int(row), given.get("format", ""))
            return self._made[2].told(what, int(row)).encode()

    @property
    def _quiet(self) -> float:
        """Time since a file of the run changed last [s]."""
        changed = [file.stat().st_mtime for file in self.run.glob("*") if file.is_file()]
        return time.time() - max(changed, default=0.0)

    @property
    def job(self) -> Begun | None:
        """What the last button began; None if none was pressed."""
        if self._job is None:
            return None
        name, process, said = self._job
        code = process.poll()
        said.seek(0)
        text = said.read().decode(errors="replace").strip()[-_SAID:]
        return Begun(name, code is None, bool(code), text)

    def told(self) -> dict[str, Any]:
        """How the run stands, as plain data."""
        try:
            now = standing(self.run) if RunFolder(self.run).begun else None
        except TrajevoError:  # its files change at this moment
            now = None
        job = self.job
        return {
            "stamp": self.stamp,
            "generation": None if now is None else now.generation,
            "generations": None if now is None else now.generations,
            "going": now is not None and not now.finished and self._quiet < _STILL,
            "job": None if job is None else vars(job),
        }

    def begin(self, name: str, weights: list[float] | None = None) -> None:
        """Begin a job in a process of its own; its results land in the run's folder.

        Args:
            name: ``"polish"``, ``"more"`` generations, or ``"weigh"``.
            weights: one for each objective, for ``"weigh"``.

        Raises:
            InvalidInputError: no such job, one that is still running, or a run that cannot go on.
        """
        job = self.job
        if job is not None and job.running:
            raise InvalidInputError(f"{job.name} is still running")
        arguments = self._arguments(name, weights)
        named = [] if self._problem is None else ["--problem", self._problem]
        said = tempfile.TemporaryFile()  # noqa: SIM115 - read as long as the page is served
        process = subprocess.Popen(
            [sys.executable, "-m", "trajevo", *arguments, *named],
            stdin=subprocess.DEVNULL,
            stdout=said,
            stderr=said,
        )
        self._job = name, process, said

    def _arguments(self, name: str, weights: list[float] | None) -> list[str]:
        quiet = ["--report", "none", "--no-pictures"]
        match name:
            case "polish":
                return ["polish", str(self.run), *quiet]
            case "more":
                now = standing(self.run)
                return ["resume", str(self.run), "--generations", str(now.generations + MORE), *quiet]
            case "weigh" if weights:
                return ["weigh", str(self.run), *map(repr, weights)]
        raise InvalidInputError(f"expected polish, more or weigh with weights, got {name!r}")

    def close(self) -> None:
        """Ask a job that is still running to end, as an interrupt from the keyboard would: it keeps what it has."""
        if self._job is not None and self._job[1].poll() is None:
            self._job[1].terminate()
            self._job[1].wait()


class _Handler(BaseHTTPRequestHandler):
    """Answers the page's own requests and nobody else's: every address begins with the token."""

    page: RunPage
    token: str

    def do_GET(self) -> None:
        match self._asked():
            case "":
                try:
                    self._answer(200, "text/html; charset=utf-8", self.page.html(self.token))
                except TrajevoError as error:
                    self._answer(503, "text/plain; charset=utf-8", f"{error}; load again later".encode())
            case "standing":
                self._answer(200, "application/json", json.dumps(self.page.told()).encode())
            case ("certificate" | "payload" | "file") as what:
                try:
                    found = self.page.answer(what, dict(parse_qsl(urlsplit(self.path).query)))
                except TrajevoError as error:
                    self._answer(409, "text/plain; charset=utf-8", str(error).encode())
                else:
                    kind = "application/octet-stream" if what == "file" else "text/plain; charset=utf-8"
                    self._answer(200, kind, found)
            case _:
                self._answer(404, "text/plain", b"no such page")

    def do_POST(self) -> None:
        name = self._asked()
        if name is None or self.headers.get("Content-Type") != "application/json":
            self._answer(404, "text/plain", b"no such page")
            return
        try:
            size = min(int(self.headers.get("Content-Length") or 0), 10_000)
            given = json.loads(self.rfile.read(size) or b"{}")
            weights = [float(weight) for weight in given.get("weights") or []]
            self.page.begin(name, weights)
        except (TrajevoError, ValueError, TypeError, AttributeError) as error:
            self._answer(409, "text/plain; charset=utf-8", str(error).encode())
            return
        self._answer(202, "application/json", json.dumps(self.page.told()).encode())

    def _asked(self) -> str | None:
        """What follows the token in the address; None for a wrong token or a name of another machine."""
        host = (self.headers.get("Host") or "").rpartition(":")[0]
        _, token, *rest = [*urlsplit(self.path).path.split("/", 2), ""]
        if host not in (LOOPBACK, "localhost") or not hmac.compare_digest(token.encode(), self.token.encode()):
            return None
        return rest[0]

    def _answer(self, code: int, kind: str, content: bytes) -> None:
        self.send_response(code)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(len(content)))
        self.send_header("Cache-Control", "no-store")
        self.send_header("Referrer-Policy", "no-referrer")
        try:
            self.end_headers()
            self.wfile.write(content)
        except ConnectionError:  # the browser has gone, as when it loads the page again
            self.close_connection = True

    def log_message(self, format: str, *args: Any) -> None:
        """Nothing is printed of what a browser asks."""


@final
class Served:
    """A page that is being served; use it as a context.

    Args:
        run: the run's folder.
        port: port of the loopback; any that is free if 0.
        read: see :class:`RunPage`.
        problem: the same.

    Attributes:
        address: where a browser finds it.

    Raises:
        InvalidInputError: the port cannot be used.
    """

    def __init__(
        self, run: Path, *, port: int = 0, read: Callable[[], Front] | None = None, problem: str | None = None
    ) -> None:
        token = secrets.token_urlsafe(16)
        self.page = RunPage(run, read, problem)
        handler = type("Handler", (_Handler,), {"page": self.page, "token": token})
        try:
            self._server = ThreadingHTTPServer((LOOPBACK, port), handler)
        except (OSError, OverflowError) as error:
            raise InvalidInputError(f"port: {port} of {LOOPBACK} cannot be used: {error}") from error
        self._server.daemon_threads = True
        self.address = f"http://{LOOPBACK}:{self._server.server_address[1]}/{token}/"
        self._thread = threading.Thread(target=self._server.serve_forever, daemon=True)

    def __enter__(self) -> Served:
        self._thread.start()
        return self

    def __exit__(self, *error: object) -> None:
        self._server.shutdown()
        self._server.server_close()
        self.page.close()
