"""Files that are written whole or not at all, and locks on files."""

from __future__ import annotations

import os
import sys
from contextlib import suppress
from pathlib import Path

if sys.platform != "win32":
    import fcntl

#: Where folders of data lie: in the package, or in a checkout beside it.
_PLACES = (Path(__file__).resolve().parents[1], Path(__file__).resolve().parents[2])

#: How the name of a file ends while it is being written.
SCRATCH = ".part"


def data_folder(name: str) -> Path:
    """A folder of data that comes with trajevo, such as ``"robots"``."""
    return next(place / name for place in _PLACES if (place / name).is_dir())


def write_whole(file: Path, content: bytes | memoryview) -> None:
    """Write a file so that, whatever kills the process, it holds the old content or the new one.

    A temporary file beside it is written and forced to the disk, then takes its name. What is no file, as
    ``/dev/stdout``, is written straight into, for it must stay.

    Raises:
        OSError: it cannot be written; the old file is as it was.
    """
    if file.exists() and not file.is_file():
        file.write_bytes(content)
        return
    scratch = file.with_name(file.name + SCRATCH)
    try:
        with scratch.open("wb") as stream:
            stream.write(content)
            stream.flush()
            os.fsync(stream.fileno())
        os.replace(scratch, file)
    except OSError:
        with suppress(OSError):
            scratch.unlink(missing_ok=True)
        raise
    _keep_name(file.parent)


def locked(handle: int) -> bool:
    """Whether this process could lock an open file; True where the system has no such locks.

    Args:
        handle: descriptor of the file, open for writing; closing any other of the same file lets go of the lock.
    """
    if sys.platform == "win32":
        return True
    try:
        # Of the process and not of the file: a child that outlives its parent does not hold the run.
        fcntl.lockf(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except (BlockingIOError, PermissionError):
        return False
    except OSError:
        pass
    return True


def _keep_name(folder: Path) -> None:
    """Force a folder's list of names to the disk, where the system lets a folder be opened."""
    with suppress(OSError):
        handle = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)
