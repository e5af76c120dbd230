"""Files that are written whole or not at all."""

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path

#: How the name of a file ends while it is being written.
SCRATCH = ".part"


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


def _keep_name(folder: Path) -> None:
    """Force a folder's list of names to the disk, where the system lets a folder be opened."""
    with suppress(OSError):
        handle = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)
