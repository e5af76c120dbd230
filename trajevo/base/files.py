"""Folders of data, files that are written completely or not at all, and locks on files."""

from __future__ import annotations

import os
import sys
from contextlib import suppress
from pathlib import Path

if sys.platform != "win32":
    import fcntl

#: Where folders of data are: inside the package, or beside it in a checkout.
_PLACES = (Path(__file__).resolve().parents[1], Path(__file__).resolve().parents[2])

#: End of the name of a file that is still being written.
SCRATCH = ".part"


def data_folder(name: str) -> Path:
    """A folder of data that comes with trajevo, such as ``"robots"``."""
    return next(place / name for place in _PLACES if (place / name).is_dir())


def write_whole(file: Path, content: bytes | memoryview) -> None:
    """Write a file so that it holds either the old or the new content, whatever kills the process.

    A temporary file beside it is written, forced to the disk and renamed. Anything but a regular file, such as
    ``/dev/stdout``, must not be replaced and is written to directly.

    Raises:
        OSError: the file cannot be written; the old file is unchanged.
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
    """Lock an open file for this process: whether that succeeded; True where the system has no such locks.

    Args:
        handle: descriptor of the file, open for writing; closing any other descriptor of this file releases the lock.
    """
    if sys.platform == "win32":
        return True
    try:
        # The process owns the lock, not the open file: a child that outlives its parent does not keep the run locked.
        fcntl.lockf(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except (BlockingIOError, PermissionError):
        return False
    except OSError:
        pass
    return True


def _keep_name(folder: Path) -> None:
    """Force a folder's list of names to the disk, if the system allows folders to be opened."""
    with suppress(OSError):
        handle = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)
