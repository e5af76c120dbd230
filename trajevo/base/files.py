"""Folders of data, files that are read and written with care, and locks on files.

Files may come from strangers. What is read is a regular file of bounded size. What is written never goes through a
symbolic link, and is written completely or not at all.
"""

from __future__ import annotations

import errno
import os
import secrets
import stat
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from pathlib import Path
from typing import BinaryIO

from trajevo.errors import InvalidInputError

if sys.platform != "win32":
    import fcntl

#: Where folders of data are: inside the package, or beside it in a checkout.
_PLACES = (Path(__file__).resolve().parents[1], Path(__file__).resolve().parents[2])

#: End of the name of a file that is still being written.
SCRATCH = ".part"

#: Greatest size of a file that people write, such as a task or a URDF, and of a file of a run or a mesh [bytes].
MOST_TEXT, MOST_DATA = 2**24, 2**28

#: Folders whose entries stand for open files and devices: they are written to, never replaced.
_OPEN_FILES = (Path("/dev"), Path("/dev/fd"), Path("/proc/self/fd"))

#: Greatest time to wait for the reader of a pipe [s].
_PATIENCE = 5.0

#: Flags that not every system has.
_NO_LINK, _NO_WAIT, _BINARY = (getattr(os, name, 0) for name in ("O_NOFOLLOW", "O_NONBLOCK", "O_BINARY"))

#: Endings of URDFs, of MJCF, and of the meshes that they name.
_OF_ROBOTS = (".urdf", ".xml", ".mjcf", ".stl", ".obj", ".dae")

#: The data whose files are closed, see :func:`opening_robots_only`; empty if any file may be opened.
_named_by: ContextVar[str] = ContextVar("_named_by", default="")


def data_folder(name: str) -> Path:
    """A folder of data that comes with trajevo, such as ``"robots"``."""
    return next(place / name for place in _PLACES if (place / name).is_dir())


@contextmanager
def opening_robots_only(source: str) -> Iterator[None]:
    """A context in which the names of files in some data open nothing but URDFs, meshes and ``robot.toml``.

    A run, which may be from a stranger, names its robot; a file of points that it names could be any file.

    Args:
        source: what the data is, for messages.
    """
    before = _named_by.set(source)
    try:
        yield
    finally:
        _named_by.reset(before)


def source_of_names() -> str:
    """The data of a run whose names are read now, see :func:`opening_robots_only`; empty if there is none."""
    return _named_by.get()


def read_bytes(file: Path, *, most: int = MOST_TEXT) -> bytes:
    """The content of a regular file.

    Args:
        file: the file, or a link to it.
        most: its greatest size [bytes].

    Raises:
        OSError: it cannot be opened or read.
        InvalidInputError: it is a device, a pipe or a folder, is larger, or is named by the data of a run.
    """
    source = _named_by.get()
    if source and file.suffix.lower() not in _OF_ROBOTS and file.name != "robot.toml":
        raise InvalidInputError(f"{source} names a file to read, {str(file)!r}; the data of a run opens no other files")
    try:
        # A pipe that nobody writes to must not be waited for.
        handle = os.open(file, os.O_RDONLY | _NO_WAIT | _BINARY)
    except ValueError as error:  # a null character
        raise InvalidInputError(f"{str(file)!r}: expected the path of a file: {error}") from error
    found = os.fstat(handle)
    if not stat.S_ISREG(found.st_mode):
        os.close(handle)
        raise InvalidInputError(f"{file}: expected a regular file, got {_kind(found.st_mode)}")
    with open(handle, "rb") as stream:
        # One byte more tells whether the file has grown meanwhile; no memory is taken for bytes that it does not have.
        content = stream.read(found.st_size + 1) if found.st_size <= most else b""
    if max(len(content), found.st_size) > most:
        size = max(len(content), found.st_size) / 2**20
        raise InvalidInputError(f"{file}: expected a file of at most {most / 2**20:g} MiB, got {size:.1f} MiB")
    return content


def read_text(file: Path, *, most: int = MOST_TEXT) -> str:
    """The content of a regular file as UTF-8 text, with the line ends of this language.

    Raises:
        OSError, InvalidInputError: as for :func:`read_bytes`.
        UnicodeDecodeError: it is no UTF-8.
    """
    return read_bytes(file, most=most).decode("utf-8").replace("\r\n", "\n").replace("\r", "\n")


def named_file(given: str | os.PathLike[str], *, name: str = "file") -> Path:
    """The path of a file that an argument names.

    Raises:
        InvalidInputError: it is no path, or one that names no file.
    """
    if not isinstance(given, str | os.PathLike) or not Path(given).name or "\0" in str(given):
        raise InvalidInputError(f"{name}: expected the path of a file, got {given!r:.60}")
    return Path(given)


def named_folder(given: str | os.PathLike[str], *, name: str = "folder") -> Path:
    """The path of a folder that an argument names.

    Raises:
        InvalidInputError: it is no path.
    """
    if not isinstance(given, str | os.PathLike) or "\0" in str(given):
        raise InvalidInputError(f"{name}: expected the path of a folder, got {given!r:.60}")
    return Path(given)


def check_writable(file: Path) -> None:
    """Find out before a long work whether its result can be written: a file is made beside it, and removed again.

    Raises:
        OSError: it cannot, as :func:`write_whole` would say afterwards.
    """
    if file.is_dir():
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(file))
    if _is_written_to(file):
        return
    scratch = file.with_name(f"{file.name}.{secrets.token_hex(4)}{SCRATCH}")
    os.close(os.open(scratch, os.O_WRONLY | os.O_CREAT | os.O_EXCL | _NO_LINK | _BINARY, 0o666))
    scratch.unlink()


def write_whole(file: Path, content: bytes | memoryview) -> None:
    """Write a file so that it holds either the old or the new content, whatever kills the process.

    A new file beside it is written, forced to the disk and renamed, so that a link of that name is replaced, not
    followed. What the caller names among the open files and devices in ``/dev``, and a pipe, are written to directly.

    Raises:
        OSError: the file cannot be written; the old file is unchanged.
    """
    if _is_written_to(file):
        with _written_to(file) as stream:
            stream.write(content)
        return
    scratch = file.with_name(f"{file.name}.{secrets.token_hex(4)}{SCRATCH}")
    try:
        with open(os.open(scratch, os.O_WRONLY | os.O_CREAT | os.O_EXCL | _NO_LINK | _BINARY, 0o666), "wb") as stream:
            stream.write(content)
            stream.flush()
            os.fsync(stream.fileno())
        os.replace(scratch, file)
    except OSError:
        with suppress(OSError):
            scratch.unlink(missing_ok=True)
        raise
    _keep_name(file.parent)


def own_folder(folder: Path) -> Path:
    """Make a folder that is written into, with those above it, unless it is there.

    Raises:
        OSError: it cannot be made.
        InvalidInputError: there is a link of that name, through which nothing is written.
    """
    no_link(folder).mkdir(parents=True, exist_ok=True)
    return folder


def no_link(folder: Path) -> Path:
    """A folder in which files are written or removed, which may be missing.

    Raises:
        InvalidInputError: there is a link of that name, through which nothing is changed.
    """
    if folder.is_symlink():
        raise InvalidInputError(f"{folder}: expected a folder, got a link to {os.readlink(folder)}; remove the link")
    return folder


def removed(file: Path) -> None:
    """Remove a file, or a link, unless it is missing.

    Raises:
        InvalidInputError: it cannot be removed.
    """
    try:
        file.unlink(missing_ok=True)
    except OSError as error:
        raise InvalidInputError(f"{file}: cannot be removed: {why_not(error)}") from error


def cache_folder(name: str) -> Path:
    """A folder in the user's cache, which need not exist yet.

    Raises:
        RuntimeError: the user has no home, nor is there a place for caches.
    """
    base = os.environ.get("XDG_CACHE_HOME", "")
    return (Path(base) if base else Path.home() / ".cache") / "trajevo" / name


def opened_lock(file: Path) -> BinaryIO:
    """A file to be locked, made if it is missing.

    Raises:
        OSError: it cannot be opened for writing, or is a link.
    """
    return open(os.open(file, os.O_RDWR | os.O_CREAT | os.O_APPEND | _NO_LINK | _NO_WAIT | _BINARY, 0o666), "ab")


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


def why_not(error: Exception) -> str:
    """Why a file cannot be used, in a few words on one line: the system's, or those of the error."""
    return " ".join(str(getattr(error, "strerror", None) or error or type(error).__name__).split())


def _kind(mode: int) -> str:
    kinds = {"a folder": stat.S_ISDIR, "a pipe": stat.S_ISFIFO, "a socket": stat.S_ISSOCK}
    return next((kind for kind, fits in kinds.items() if fits(mode)), "a device")


def _is_written_to(file: Path) -> bool:
    """Whether a file is written to directly, as a device or a pipe; other files, and links, are replaced."""
    if file.absolute().parent in _OPEN_FILES:
        return True
    try:
        mode = file.lstat().st_mode
    except OSError:
        return False
    return not (stat.S_ISREG(mode) or stat.S_ISLNK(mode))


def _written_to(file: Path) -> BinaryIO:
    """A device or a pipe, opened for writing; a pipe that nobody begins to read is not waited for without end."""
    until = time.monotonic() + _PATIENCE
    while True:
        try:
            handle = os.open(file, os.O_WRONLY | _NO_WAIT | _BINARY)
            break
        except OSError as error:
            if error.errno != errno.ENXIO or time.monotonic() > until:
                raise
            time.sleep(_PATIENCE / 100.0)
    os.set_blocking(handle, True)
    return open(handle, "wb")


def _keep_name(folder: Path) -> None:
    """Force a folder's list of names to the disk, if the system allows folders to be opened."""
    with suppress(OSError):
        handle = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)
