"""What an input may do while it is read: no more time, memory, files and connections than the promise allows."""

from __future__ import annotations

import os
import resource
import signal
import sys
import traceback
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from types import FrameType
from typing import Any

from trajevo.errors import TrajevoError

#: Longest time for an input [s], and most memory that it may take beyond that of the process [bytes].
MOST_SECONDS, MOST_MEMORY = 10, 2**30

#: Events of Python that change files, with the places of the paths among their arguments.
_CHANGES = {
    "os.remove": (0,), "os.rename": (0, 1), "os.mkdir": (0,), "os.rmdir": (0,), "os.symlink": (1,), "os.link": (1,),
    "os.truncate": (0,), "os.chmod": (0,), "os.chown": (0,), "os.utime": (0,), "shutil.rmtree": (0,),
}  # fmt: skip
_STARTS = ("subprocess.Popen", "os.system", "os.exec", "os.posix_spawn", "os.spawn", "os.fork", "pty.spawn")
_WRITES = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_APPEND


#: State of a socket that listens, in Linux's tables.
_LISTEN = "0A"


class TooLongError(BaseException):
    """An input takes too long."""


@dataclass(frozen=True)
class Finding:
    """What an input did that none may do.

    Attributes:
        kind: traceback, hang, memory, write, start, socket, or crash.
        said: what exactly.
    """

    kind: str
    said: str


def listening() -> list[Finding]:
    """Sockets of this process that listen on addresses which other machines reach, by whatever they were opened."""
    own = {os.readlink(entry.path) for entry in os.scandir("/proc/self/fd") if os.path.lexists(entry.path)}
    if not any(name.startswith("socket:") for name in own):
        return []
    found = []
    for table in ("tcp", "tcp6"):
        for row in Path(f"/proc/self/net/{table}").read_text().splitlines()[1:]:
            _, local, _, state, *rest = row.split()
            loopback = local.startswith(("0100007F:", "00000000000000000000000001000000:"))
            if state == _LISTEN and f"socket:[{rest[5]}]" in own and not loopback:
                found.append(Finding("socket", f"listens on {local}"))
    return found


class Sandbox:
    """Watches what is read in this process, from now on to its end.

    Args:
        folder: the only folder in which files may change.
    """

    def __init__(self, folder: Path) -> None:
        self._inside = os.path.realpath(folder) + os.sep
        self._found: list[Finding] = []
        self._on = False
        signal.signal(signal.SIGALRM, self._too_long)
        sys.addaudithook(self._heard)

    def bound_memory(self) -> None:
        """Allow only so much more memory than the process has now, for all inputs to come."""
        pages = int(Path("/proc/self/statm").read_text().split()[0])
        most = pages * os.sysconf("SC_PAGE_SIZE") + MOST_MEMORY
        resource.setrlimit(resource.RLIMIT_AS, (most, most))

    def watch(self, read: Callable[[], None]) -> list[Finding]:
        """What reading an input did that none may do; errors that trajevo raises on purpose are what should happen."""
        self._found, self._on = [], True
        signal.setitimer(signal.ITIMER_REAL, MOST_SECONDS)
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                read()
        except TrajevoError as error:
            if not str(error) or len(str(error)) > 20_000:
                self._found.append(Finding("traceback", f"a message of {len(str(error))} characters"))
        except TooLongError:
            self._found.append(Finding("hang", traceback.format_exc(limit=-8)))
        except MemoryError:
            self._found.append(Finding("memory", traceback.format_exc(limit=-8)))
        except BaseException:  # noqa: BLE001 - whatever it is, a user would see it
            self._found.append(Finding("traceback", traceback.format_exc(limit=-8)))
        finally:
            signal.setitimer(signal.ITIMER_REAL, 0)
            self._on = False
        return self._found

    def _too_long(self, number: int, frame: FrameType | None) -> None:
        raise TooLongError

    def _heard(self, event: str, arguments: tuple[Any, ...]) -> None:
        if not self._on:
            return
        if event == "open":
            path, mode, flags = arguments
            if isinstance(path, str | bytes | os.PathLike) and (
                any(mark in (mode or "") for mark in "wax+") or (isinstance(flags, int) and flags & _WRITES)
            ):
                self._check(event, path, through=not (isinstance(flags, int) and flags & os.O_NOFOLLOW))
        elif event in _CHANGES:
            for place in _CHANGES[event]:
                if isinstance(arguments[place], str | bytes | os.PathLike):
                    self._check(event, arguments[place], through=False)
        elif event in _STARTS:
            self._found.append(Finding("start", f"{event} {arguments[:1]!r}"))
        elif event in ("socket.bind", "socket.connect"):
            host = arguments[1][0] if isinstance(arguments[1], tuple) else arguments[1]
            if event == "socket.connect" or host not in ("127.0.0.1", "::1", "localhost"):
                self._found.append(Finding("socket", f"{event} {host!r}"))

    def _check(self, event: str, path: Any, *, through: bool) -> None:
        """Find a change outside the folder; by way of a link, unless the change is of the link itself."""
        text = os.fsdecode(path)
        folder, name = os.path.split(os.path.abspath(text))
        real = os.path.realpath(text) if through else os.path.join(os.path.realpath(folder), name)
        if not (real + os.sep).startswith(self._inside) and real != "/dev/null" and "__pycache__" not in real:
            self._found.append(Finding("write", f"{event} {text!r}, which is {real!r}"))
