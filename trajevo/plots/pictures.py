"""All pictures of a run, drawn once for its files and its report."""

from __future__ import annotations

import hashlib
import io
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any, final

import numpy as np

from trajevo import plots
from trajevo.base.files import MOST_DATA, own_folder, read_bytes, why_not, write_whole
from trajevo.errors import InvalidInputError, checked_name
from trajevo.front.front import Front
from trajevo.front.records import installed_versions
from trajevo.front.thinning import told_share
from trajevo.trajectory.along_path import ComposedBatch

if TYPE_CHECKING:
    from trajevo.plots.paper import Width

#: Studies of payloads by name, which is their picture's file stem: its caption, and what draws it beside its front.
_STUDIES: dict[str, tuple[str, Callable[[Any, Front, Any], Any]]] = {
    "capacities": (
        "What every solution can carry",
        lambda found, front, wide: _capacities(found, front, wide),
    ),
    "slowdown": (
        "Payload against the least time along the path of the knee",
        lambda found, _, wide: plots.slowdown_curve(found, **wide),
    ),
    "payload_time": (
        "Payload against the least time, the motion optimised again for each",
        lambda found, _, wide: plots.payload_curve(found.curve, at_rest=found.at_rest, **wide),
    ),
    "payload_diagram": (
        "What can be carried by how far off the tool the load sits",
        lambda found, _, wide: plots.payload_contours(found, **wide),
    ),
    "allowed_centres": (
        "Where the centre of mass of a payload may lie at the knee",
        lambda found, _, wide: plots.allowed_region(found, **wide),
    ),
    "robust_payload": (
        "What the knee carries by how well the centre of mass is known",
        lambda found, _, wide: plots.robust_mass(found, **wide),
    ),
    "uncertainty": (
        "Least time along the knee's path by how well the centre of mass is known",
        lambda found, _, wide: plots.uncertainty_price(found, **wide),
    ),
    "workspace": (
        "What can be held at rest around the knee's motion (line), the tool turned as midway",
        lambda found, _, wide: plots.workspace_capacity(found.found, path=found.path, **wide),
    ),
}

#: File stems of all pictures of effort and payload.
PAYLOAD_FIGURES = (
    "effort",
    "payload_front",
    "margins",
    *_STUDIES,
)

#: File stems of the views in space, which show what other pictures and tables tell too.
VIEWS = ("front_3d", "tool_path", "visits")

#: Dots per inch of a picture for the screen; of a page wide it has 1,339 of them side by side.
_RESOLUTION = 200

#: Figures wider than this scroll sideways on a small screen instead of shrinking [inch].
_WIDE = 4.5

#: Level of compression: half the time of the usual one, files a tenth larger.
_PACKED = 2

#: Metadata entry of a PNG that identifies the front it was drawn for.
_MADE_FOR = "trajevo"

#: Formats of pictures by the ending of their files, with metadata that would differ each time they are written.
FORMATS: dict[str, dict[str, None]] = {"png": {}, "pdf": {"CreationDate": None}, "svg": {"Date": None}}

#: File stems of all pictures that a run may have.
FIGURES = (
    "front",
    "front_3d",
    "parallel",
    "hypervolume",
    "front_bound",
    "profiles",
    "path",
    "parameter",
    "tool_path",
    "visits",
    "base_map",
    "rivals",
    *PAYLOAD_FIGURES,
)


@final
@dataclass(frozen=True, eq=False)
class Picture:
    """A picture of a run.

    Attributes:
        stem: stem of its file's name, one of :data:`FIGURES`.
        caption: its caption.
        png: content of the file.
    """

    stem: str
    caption: str
    png: bytes

    @property
    def wide(self) -> bool:
        """Whether it should scroll on a small screen instead of shrinking."""
        width = int.from_bytes(self.png[16:20], "big")  # in the first chunk of a PNG
        return width > _WIDE * _RESOLUTION


def draw_all(
    front: Front,
    analyses: Mapping[str, Any] | None = None,
    *,
    kept: Path | None = None,
    views: bool = True,
    begin: Callable[[str], None] | None = None,
) -> tuple[Picture, ...]:
    """All pictures of a front and its analyses; nothing is optimised here.

    Args:
        front: the front; an empty one has no pictures.
        analyses: result of :func:`~trajevo.plots.analyses.analyse`; if None, only the front and its knee are drawn.
        kept: folder with pictures drawn before; those of exactly this front are read, the others are drawn.
        views: draw the views in space too; without, only those that the folder has are among the pictures.
        begin: function that is called with the stem of every picture before it is read or drawn.
    """
    if not len(front):
        return ()
    of_this, pictures = _made_for(front), []
    for stem, caption, draw in _drawings(front, analyses or {}):
        if begin is not None:
            begin(stem)
        made_for = f"{stem} {of_this}"
        png = None if kept is None else _kept(kept / f"{stem}.png", made_for)
        if png is None and stem in VIEWS and not views:
            continue
        pictures.append(Picture(stem, caption, _png(_named(draw(), front), made_for) if png is None else png))
    return tuple(pictures)


def draw_files(
    front: Front,
    folder: Path,
    analyses: Mapping[str, Any] | None = None,
    *,
    format: str = "pdf",
    width: Width | None = None,
    begin: Callable[[str], None] | None = None,
) -> list[Path]:
    """Draw all pictures of a front and its analyses for a paper, without the title above them, one file for each.

    Args:
        front: the front; an empty one has no pictures.
        folder: folder for the files, which is created if necessary.
        analyses: result of :func:`~trajevo.plots.analyses.analyse`; if None, only the front and its knee are drawn.
        format: ``"pdf"``, ``"svg"`` or ``"png"``.
        width: ``"column"``, ``"page"`` or millimetres; if None, that of each picture.
        begin: function that is called with the stem of every picture before it is drawn.

    Returns:
        The files that were written.

    Raises:
        UnknownNameError: no such format.
        InvalidInputError: an unknown width, or a file cannot be written.
    """
    checked_name("format", format, FORMATS)
    if width is not None:
        from trajevo.plots.paper import inches  # imported where something is drawn, since that takes long

        inches(width)
    if not len(front):
        return []
    _made(folder)
    files = []
    for stem, _, draw in _drawings(front, analyses or {}, width):
        if begin is not None:
            begin(stem)
        files.append(save_figure(draw(), folder / f"{stem}.{format}", title=front.record.title))
    return files


def _named(figure: Any, front: Front) -> Any:
    """A figure with the name of what was solved above it, since its file may lie anywhere one day."""
    figure.get_layout_engine().entitle(figure, front.record.title)
    return figure


def figures_of(front: Front, analyses: Mapping[str, Any]) -> tuple[str, ...]:
    """File stems of the pictures that a front and its analyses may have; none of an empty front."""
    return tuple(stem for stem, _, _ in _drawings(front, analyses)) if len(front) else ()


def save_pictures(pictures: Sequence[Picture], folder: Path) -> list[Path]:
    """Write pictures as PNG into a folder, which is created if necessary.

    Raises:
        InvalidInputError: a file cannot be written.
    """
    if pictures:
        _made(folder)
    files = [folder / f"{picture.stem}.png" for picture in pictures]
    for file, picture in zip(files, pictures, strict=True):
        if not _holds(file, picture.png):
            written(file, picture.png)
    return files


def _holds(file: Path, content: bytes) -> bool:
    """Whether a file, not a link to one, has this content already."""
    try:
        return not file.is_symlink() and read_bytes(file, most=MOST_DATA) == content
    except (OSError, InvalidInputError):
        return False


def _made(folder: Path) -> None:
    try:
        own_folder(folder)
    except OSError as error:
        raise InvalidInputError(f"{folder}: cannot be written: {why_not(error)}") from error


def save_figure(figure: Any, file: Path, *, title: str = "") -> Path:
    """Write one figure, in the format that the file's name ends in, and close it.

    Args:
        figure: the figure.
        file: a file whose name ends in .png, .pdf or .svg.
        title: title that a PDF or SVG has among its metadata.

    Raises:
        InvalidInputError: another ending, or the file cannot be written.
    """
    import matplotlib.pyplot as plt  # imported where something is drawn, since that takes long

    ending = file.suffix.removeprefix(".").lower()
    if ending not in FORMATS:
        raise InvalidInputError(f"{file}: expected a name that ends in .{', .'.join(FORMATS)}, got {file.name!r}")
    if ending == "png":
        return written(file, _png(figure))
    stream, about = io.BytesIO(), FORMATS[ending] | ({"Title": title} if title else {})
    with plots.style():
        figure.savefig(stream, format=ending, metadata=about)
    plt.close(figure)
    return written(file, stream.getvalue())


def written(file: Path, content: bytes) -> Path:
    """Write a file completely or not at all.

    Raises:
        InvalidInputError: the file cannot be written.
    """
    try:
        write_whole(file, content)
    except OSError as error:
        raise InvalidInputError(f"{file}: cannot be written: {why_not(error)}") from error
    return file


#: File stem, caption, and what makes the figure.
_Drawing = tuple[str, str, Callable[[], Any]]


def _drawings(front: Front, analyses: Mapping[str, Any], width: Width | None = None) -> Iterator[_Drawing]:
    """All pictures of a run, not yet drawn."""
    as_wide: Any = {} if width is None else {"width": width}
    knee, count = front.knee(), front.F.shape[1]
    if count > 1:
        yield "front", "The front, every pair of objectives", lambda: plots.front(front, mark=knee, **as_wide)[0].figure
    if count > 2:
        yield "front_3d", "The front, three objectives", lambda: plots.front_3d(front, mark=knee, **as_wide).figure
    caption = "Trade-offs: one line per solution"
    yield "parallel", caption, lambda: plots.parallel_coordinates(front, mark=knee, **as_wide).figure
    yield "hypervolume", "Hypervolume by generation", lambda: plots.hypervolume(front, **as_wide).figure
    if analyses.get("bound") and count > 1:
        caption, bound = "The front and what no motion of its kind can be better than", analyses["bound"]
        if count == 2 and isinstance(
            knee.trajectory, ComposedBatch
        ):  # along a path squares fall with a high power of time
            yield "front_bound", caption, lambda: plots.fronts({"front": front}, bound=bound, **as_wide).figure
        else:
            yield "front_bound", caption, lambda: plots.front(front, bound=bound, **as_wide)[0].figure
    yield (
        "profiles",
        "Joint motion of the knee inside its limits (dashed)",
        lambda: plots.profiles(knee, **as_wide)[0].figure,
    )
    along = isinstance(knee.trajectory, ComposedBatch)
    if along and knee.trajectory.n_joints == 2:
        yield (
            "path",
            "The path, its control polygon, and the speed of the knee",
            lambda: plots.path(knee, **as_wide).figure,
        )
    elif front.problem.robot.has_body:
        yield "tool_path", "Path of the tool at the knee", lambda: plots.tool_path(knee, **as_wide).figure
        if knee.visits is not None:
            caption = "Points by their numbers as the knee visits them, and its posture at each"
            yield "visits", caption, lambda: plots.visits(knee, **as_wide).figure
    if analyses.get("base_map"):
        least = analyses["base_map"]
        caption = f"Least {least.objective} from every place of the base, its other coordinates as at the knee"
        yield "base_map", caption, lambda: plots.base_map(least, **as_wide).figure
    if along:
        caption, named = "The path's parameter over time", {choice.rule: choice for choice in front.choices()}
        yield "parameter", caption, lambda: plots.parameter(named, **as_wide).figure
    if analyses.get("rivals"):
        caption = "Interpolants at their least times under the same limits"
        yield "rivals", caption, lambda: plots.plot_rivals(analyses["rivals"], **as_wide)[0].figure
    if front.problem.robot.gives_effort and front.problem.robot.limits.sides("effort").limited.any():
        yield from _payload_drawings(front, analyses, as_wide)


def _payload_drawings(front: Front, analyses: Mapping[str, Any], as_wide: Any) -> Iterator[_Drawing]:
    """All pictures of effort and payload for which an analysis was computed and has something to show."""
    if analyses.get("effort"):
        caption = "Effort at the knee as a share of its limits"
        yield "effort", caption, lambda: plots.effort_utilisation(analyses["effort"], **as_wide).figure
    if front.problem.payload_range is not None:
        yield "payload_front", "Payload against time on the front", lambda: plots.payload_front(front, **as_wide).figure
    capacity = analyses["carried"][0].capacity if analyses.get("carried") else None
    if capacity is not None and capacity.joint and capacity.feasible and capacity.mass > 0.0:
        caption = "What is left of the effort limits at the knee with its largest payload"
        yield "margins", caption, lambda: plots.capacity_margins(capacity, **as_wide).figure
    for stem, (caption, draw) in _STUDIES.items():
        found = analyses.get(stem)
        if found is not None:
            overlaid = f", {' and '.join(found)}" if isinstance(found, Mapping) else ""
            yield stem, caption + overlaid, partial(_figure_of, draw, found, front, as_wide)


def _figure_of(draw: Callable[[Any, Front, Any], Any], found: Any, front: Front, as_wide: Any) -> Any:
    return draw(found, front, as_wide).figure


def _capacities(found: Any, front: Front, wide: Any) -> Any:
    """The payloads of the solutions of a front, of a large one those that stand for it."""
    rows = front.thinned()
    ax = plots.front_capacities(found, knee=int(np.searchsorted(rows, front.knee().index)), **wide)
    ax.set_title(told_share(rows, front), loc="left")
    return ax


def _made_for(front: Front) -> str:
    """Identification of the front and of the versions for which a picture on file is valid."""
    drawn_by = f"{installed_versions()['trajevo']} {version('matplotlib')}"
    content = f"{front.digest} {front.history.model_dump_json()} {drawn_by}"
    return hashlib.sha256(content.encode()).hexdigest()


def _kept(file: Path, made_for: str) -> bytes | None:
    """A picture drawn before, if it is complete and of this front; else None."""
    from PIL import Image  # imported where pictures are read and written, since that takes long

    try:
        png = read_bytes(file, most=MOST_DATA)
        with Image.open(io.BytesIO(png)) as image:
            ours = image.info.get(_MADE_FOR) == made_for
            image.verify()
    except (OSError, SyntaxError, ValueError):  # missing or damaged
        return None
    return png if ours else None


def _png(figure: Any, made_for: str = "") -> bytes:
    """A figure as PNG; the figure is closed."""
    import matplotlib.pyplot as plt  # imported where something is drawn, since that takes long
    from PIL import Image
    from PIL.PngImagePlugin import PngInfo

    figure.set_dpi(_RESOLUTION)
    figure.canvas.draw()
    pixels, stream, about = np.asarray(figure.canvas.buffer_rgba()), io.BytesIO(), PngInfo()
    if made_for:
        about.add_text(_MADE_FOR, made_for)
    dots = (_RESOLUTION, _RESOLUTION)  # which give a program for texts the width of the picture
    image = Image.fromarray(np.ascontiguousarray(pixels[..., :3]))
    image.save(stream, "png", pnginfo=about, compress_level=_PACKED, dpi=dots)
    plt.close(figure)
    return stream.getvalue()
