"""The folder of a run: a manifest, every evaluated individual in blocks of generations, and the latest checkpoint.

All files are data: JSON, or arrays of numbers and text. Reading a folder never executes its content, even if the folder
is from an unknown source. Every file is written completely or not at all, and a block is written before the checkpoint
that counts it. So a run can be read and resumed even if its process was killed.
"""

from __future__ import annotations

import io
import shutil
import tempfile
import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal, final

import numpy as np
import pydantic

from trajevo.base.arrays import Array
from trajevo.base.files import (
    MOST_DATA,
    SCRATCH,
    locked,
    named_folder,
    opened_lock,
    own_folder,
    read_text,
    removed,
    why_not,
    write_whole,
)
from trajevo.base.jit import Kind
from trajevo.base.plain import read_arrays
from trajevo.errors import InvalidInputError
from trajevo.front.front import Front
from trajevo.front.records import AtLeastOne, Line, ProblemRecord, Record, Settings, told

FRONT_FILE, MANIFEST_FILE, CHECKPOINT_FILE, BLOCKS_FOLDER = "front.json", "manifest.json", "checkpoint.npz", "blocks"
LOCK_FILE, EVOLVED_FILE = ".lock", "evolved.json"


class Manifest(Record):
    """How a run was begun, as data.

    Attributes:
        problem: what is solved; the problem is made again from its name and settings.
        algorithm: how the algorithm was set up; None if no adapter can store its state, so that the run cannot be
            resumed.
        not_resumable: why the run cannot be resumed, one sentence, or empty.
        algorithm_name: class of the algorithm.
        settings: settings of the run, as they are recorded with the front.
        seed: seed of all randomness.
        generations: number of generations of the whole run.
        time_limit: greatest time for the evaluation of one individual [s], or None.
        evaluations: greatest number of evaluations of the run, or None.
        cpu_time: greatest CPU time of the run [s], or None.
        polish: whether the front is refined by gradients at the end.
        polish_every: number of generations after which refined members are inserted, again and again, or None.
        versions: versions of Python and of the packages with which the run was begun.
        kernels: what computes the run from its first evaluation to its last, compiled loops or numpy; None for a run of
            an older version.
    """

    format: Literal["trajevo run"] = "trajevo run"
    version: Literal[1] = 1
    problem: ProblemRecord
    algorithm: Settings | None
    not_resumable: str
    algorithm_name: Line
    settings: Settings
    seed: Annotated[int, pydantic.Field(ge=0)]
    generations: AtLeastOne
    time_limit: Annotated[float, pydantic.Field(gt=0.0)] | None
    evaluations: AtLeastOne | None = None
    cpu_time: Annotated[float, pydantic.Field(gt=0.0)] | None = None
    polish: bool = False
    polish_every: AtLeastOne | None = None
    versions: dict[Line, Line]
    kernels: Kind | None = None


@dataclass(frozen=True, eq=False)
class Block:
    """All individuals evaluated in one or more generations.

    Attributes:
        generation: generation of every individual, from 1, shape (N,).
        X: decision vectors, shape (N, n_var).
        F: objective values, shape (N, n_obj), infinite for individuals that failed.
        G: constraint values, shape (N, n_constr), infinite for individuals that failed.
        said: error message of every individual, empty for those that did not fail, shape (N,).
    """

    generation: Array
    X: Array
    F: Array
    G: Array
    said: Array


@final
class RunFolder:
    """Reads and writes the folder of one run.

    Args:
        folder: the folder.
    """

    def __init__(self, folder: str | Path) -> None:
        self.folder = named_folder(folder)

    @property
    def front_file(self) -> Path:
        """File of the front, which is written when the run ends."""
        return self.folder / FRONT_FILE

    @property
    def evolved_file(self) -> Path:
        """File of the front before polishing."""
        return self.folder / EVOLVED_FILE

    @property
    def begun(self) -> bool:
        """Whether a run with checkpoints was begun here."""
        return (self.folder / MANIFEST_FILE).exists()

    @property
    def holds_run(self) -> bool:
        """Whether a run was begun or finished here."""
        return self.begun or self.front_file.exists()

    @contextmanager
    def alone(self) -> Iterator[None]:
        """Lock the run, so that no other process works on it; the lock ends with the process, even if it is killed.

        Raises:
            InvalidInputError: another process works on the run, or the folder cannot be written.
        """
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            lock = opened_lock(self.folder / LOCK_FILE)
        except OSError as error:
            raise self._unwritable(error) from error
        with lock:
            if not locked(lock.fileno()):
                raise InvalidInputError(f"{self.folder}: another process is working on this run")
            yield

    def begin(self, manifest: Manifest, *, overwrite: bool = False) -> None:
        """Begin a run.

        Args:
            manifest: settings of the run.
            overwrite: replace a run that the folder holds.

        Raises:
            InvalidInputError: the folder holds a run that is not to be replaced, or cannot be written.
        """
        if self.holds_run and not overwrite:
            raise InvalidInputError(f"{self.folder} already holds a run")
        try:
            self.clear()
            own_folder(self.folder / BLOCKS_FOLDER)
        except OSError as error:
            raise self._unwritable(error) from error
        self.replace_manifest(manifest)

    def replace_manifest(self, manifest: Manifest) -> None:
        """Replace the manifest, when a run is made longer.

        Raises:
            InvalidInputError: it cannot be written.
        """
        try:
            write_whole(self.folder / MANIFEST_FILE, manifest.model_dump_json(indent=1).encode())
        except OSError as error:
            raise self._unwritable(error) from error

    def keep(self, front: Front, *, evolved: bool = False) -> None:
        """Save the front of the run, or the front before polishing; if that fails, save it elsewhere and warn where."""
        try:
            front.save(self.evolved_file if evolved else self.front_file)
        except InvalidInputError as error:
            with tempfile.NamedTemporaryFile(prefix="trajevo-", suffix=".json", delete=False) as other:
                pass
            front.save(other.name)
            warnings.warn(f"{error}; the front is in {other.name}", stacklevel=3)

    def clear(self) -> None:
        """Remove the run from the folder; the manifest goes last, so that a half removed run still counts as a run."""
        self.front_file.unlink(missing_ok=True)
        self.evolved_file.unlink(missing_ok=True)
        self._clear_rest()
        (self.folder / MANIFEST_FILE).unlink(missing_ok=True)

    def manifest(self) -> Manifest:
        """How the run was begun.

        Raises:
            InvalidInputError: there is no manifest, or it does not fit this version of trajevo.
        """
        file = self.folder / MANIFEST_FILE
        try:
            return Manifest.model_validate_json(read_text(file, most=MOST_DATA))
        except FileNotFoundError as error:
            finished = "the finished front of a run without checkpoints" if self.holds_run else "no run"
            raise InvalidInputError(f"{self.folder} holds {finished}: it has no {MANIFEST_FILE}") from error
        except (OSError, UnicodeDecodeError) as error:
            raise InvalidInputError(f"{file}: cannot be read: {why_not(error)}") from error
        except pydantic.ValidationError as error:
            raise InvalidInputError(f"{file}: is no manifest of this version of trajevo: {told(error)}") from error

    def write(self, block: Block | None, checkpoint: Mapping[str, Array]) -> None:
        """Add the block of the generations since the last checkpoint, if any, then replace the checkpoint.

        Raises:
            OSError: one of them could not be written; the folder still holds the previous checkpoint.
        """
        if block is not None:
            name = f"{int(block.generation[0]):06d}.npz"
            write_whole(own_folder(self.folder / BLOCKS_FOLDER) / name, _packed(vars(block)))
        write_whole(self.folder / CHECKPOINT_FILE, _packed(checkpoint))

    def checkpoint(self) -> dict[str, Array] | None:
        """Arrays of the latest checkpoint, or None if the first generation was not finished.

        Raises:
            InvalidInputError: the file is damaged.
        """
        file = self.folder / CHECKPOINT_FILE
        return _unpacked(file) if file.exists() else None

    def blocks(self, generations: int) -> Iterator[Block]:
        """All individuals of the first generations, in the order of their evaluation.

        Args:
            generations: number of generations, as the checkpoint counts them.

        Raises:
            InvalidInputError: a file is damaged.
        """
        for file in sorted((self.folder / BLOCKS_FOLDER).glob("*.npz")):
            if not file.stem.isdecimal() or int(file.stem) > generations:
                continue
            arrays = _unpacked(file)
            try:
                block = Block(**arrays)
                rows = {len(array) for array in arrays.values()}
                whole = int(block.generation[0]) == int(file.stem) and len(rows) == 1 and _is_whole(block)
            except (TypeError, IndexError, ValueError) as error:
                raise InvalidInputError(f"{file}: is no block of a run") from error
            if not whole:
                raise InvalidInputError(f"{file}: is no block of a run")
            yield block

    def forget_after(self, generations: int) -> None:
        """Remove what was written after a checkpoint: blocks that it does not count, and incomplete files."""
        blocks = own_folder(self.folder / BLOCKS_FOLDER)
        late = (file for file in blocks.glob("*.npz") if file.stem.isdecimal() and int(file.stem) > generations)
        incomplete = (file for place in (self.folder, blocks) for file in place.glob(f"*{SCRATCH}"))
        for file in (*late, *incomplete):
            removed(file)

    def free(self) -> int:
        """Free bytes on the folder's disk."""
        return shutil.disk_usage(self.folder).free

    def _unwritable(self, error: OSError) -> InvalidInputError:
        return InvalidInputError(f"{self.folder}: the run cannot be written there: {why_not(error)}")

    def _clear_rest(self) -> None:
        (self.folder / CHECKPOINT_FILE).unlink(missing_ok=True)
        if (self.folder / BLOCKS_FOLDER).exists():
            shutil.rmtree(self.folder / BLOCKS_FOLDER)


def _is_whole(block: Block) -> bool:
    """Whether the columns of a block have the shapes and types of a run, and numbers where there must be numbers."""
    kinds = {"generation": (1, "i"), "X": (2, "f"), "F": (2, "f"), "G": (2, "f"), "said": (1, "U")}
    if any((array.ndim, array.dtype.kind) != kinds[name] for name, array in vars(block).items()):
        return False
    return bool(np.isfinite(block.X).all()) and all(np.greater(each, -np.inf).all() for each in (block.F, block.G))


@contextmanager
def begun(out: str | Path | None, manifest: Manifest, *, overwrite: bool) -> Iterator[RunFolder | None]:
    """The folder of a new run, with its manifest and locked for this process; None if ``out`` is None.

    Raises:
        InvalidInputError: the folder holds a run that is not to be replaced, or cannot be written.
    """
    if out is None:
        yield None
        return
    run = RunFolder(named_folder(out, name="out"))
    with run.alone():
        run.begin(manifest, overwrite=overwrite)
        if manifest.not_resumable:
            warnings.warn(f"{run.folder}: this run cannot be resumed: {manifest.not_resumable}", stacklevel=4)
        yield run


def block_of(generations: Sequence[int], parts: Sequence[tuple[Array, Array, Array, Array]]) -> Block:
    """Block of evaluated populations (X, F, G and error messages) and the generation of each."""
    columns = [np.concatenate(column) for column in zip(*parts, strict=True)]
    counts = [len(part[0]) for part in parts]
    return Block(np.repeat(np.array(generations, dtype=np.int64), counts), *columns)


def _packed(arrays: Mapping[str, Array]) -> bytes:
    stream = io.BytesIO()
    np.savez(stream, allow_pickle=False, **dict(arrays))
    return stream.getvalue()


def _unpacked(file: Path) -> dict[str, Array]:
    try:
        return read_arrays(file)
    except OSError as error:
        raise InvalidInputError(f"{file}: cannot be read: {why_not(error)}") from error
