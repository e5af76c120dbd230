"""The style of all pictures: widths of a two-column paper, text of 8 pt, colours and lines that stay apart in grey."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, nullcontext
from functools import cache
from pathlib import Path
from typing import Any, Literal, final

import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap, LogNorm
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter

from trajevo.base.units import pretty
from trajevo.errors import InvalidInputError, known_names
from trajevo.plots.layout import Rows, key_columns, place_above

#: Width of a picture: that of a column, of both, or in millimetres.
Width = Literal["column", "page"] | float

#: Widths of pictures by name [mm]: a column or a page of a paper.
WIDTHS = {"column": 85.0, "page": 170.0}

#: Least and greatest width that is drawn [mm], and millimetres of an inch.
_NARROWEST, _WIDEST, _INCH = 40.0, 500.0, 25.4

#: Width from which panels of curves stand side by side [inch].
TWO_BESIDE = 4.5

#: Distances between ticks of an axis, at least [mm]: each label takes time to draw and room beside its neighbours.
_TICK_EVERY = (13.0, 7.0)

#: Ratio of the ends of a logarithmic axis below which it has ticks between powers of ten.
_FEW_DECADES = 60.0

_FILE = Path(__file__).with_name("trajevo.mplstyle")

#: Colours of areas: those of curves, with yellow in place of black.
_AREAS = ("#0072B2", "#D55E00", "#CC79A7", "#E69F00", "#F0E442", "#009E73", "#56B4E9")

#: Colours of what is not a curve: limits, what lies beyond them, and notes.
LIMIT, BEYOND, NOTE = "0.25", "0.9", "0.35"


@cache
def _settings() -> Any:
    return mpl.rc_params_from_file(_FILE, use_default_template=False)


@contextmanager
def style() -> Iterator[None]:
    """The style of these pictures, for figures of your own: ``with plots.style(): figure, axes = plt.subplots(...)``.

    Files that are written within it keep their text as text (PDF, SVG). Nothing of it stays when the context ends.
    """
    before = {key: mpl.rcParams[key] for key in _settings()}
    mpl.rcParams.update(_settings())
    try:
        yield
    finally:  # not Matplotlib's own context: the first figure of a notebook makes it interactive, which has to stay
        mpl.rcParams.update(before)


@cache
def _curves() -> tuple[Mapping[str, Any], ...]:
    return tuple(_settings()["axes.prop_cycle"])


def curve(number: int) -> dict[str, Any]:
    """Colour and line style of a curve; those of 35 curves in a row differ."""
    return dict(_curves()[number % len(_curves())])


def colour(number: int) -> str:
    """Colour of a curve: seven in a row differ."""
    return f"#{_curves()[number % len(_curves())]['color'].lstrip('#')}"


def area(number: int) -> str:
    """Colour of an area, which may be lightened: without black, whose tints are the greys of what has no colour."""
    return _AREAS[number % len(_AREAS)]


def sequence(name: str = "viridis") -> Any:
    """A scale of colours without its lightest end, which nobody sees on paper; light to dark in grey too."""
    return ListedColormap(mpl.colormaps[name](np.linspace(0.0, 0.92, 256)))


def label(name: str, unit: str = "1") -> str:
    """Label of an axis: the quantity, and its unit if it has one."""
    return name if unit == "1" else f"{name} [{pretty(unit)}]"


def inches(width: Width) -> float:
    """A width in inches.

    Raises:
        InvalidInputError: neither a name of :data:`WIDTHS` nor a number of millimetres that can be drawn.
    """
    given = WIDTHS.get(width) if isinstance(width, str) else width
    number = isinstance(given, int | float | np.number) and not isinstance(given, bool)
    if not number or not _NARROWEST <= float(given) <= _WIDEST:  # type: ignore[arg-type]
        known = f"; {known_names(width, WIDTHS)}" if isinstance(width, str) else ""
        raise InvalidInputError(
            f"width: expected 'column' (85 mm), 'page' (170 mm) or millimetres from {_NARROWEST:g} to {_WIDEST:g}, "
            f"got {width!r}{known}"
        )
    return float(given) / _INCH  # type: ignore[arg-type]


@final
class _Paper(Figure):
    """A figure that is written in the style in which it was drawn, whatever the user's settings are.

    Matplotlib decides how text gets into a vector file when the file is written, not when the text is made.
    """

    def savefig(self, *arguments: Any, **options: Any) -> None:
        with style():
            super().savefig(*arguments, **options)


@contextmanager
def panels(
    axes: Any, count: int, *, width: Width, columns: int = 1, height: float, space: bool = False, share: bool = False
) -> Iterator[Any]:
    """Axes to draw into: the given ones as they are, or those of a new figure in our style.

    Args:
        axes: the user's axes, or None.
        count: how many are needed.
        width: width of a new figure.
        columns: panels side by side in a new figure.
        height: height of each panel of a new figure [mm]; a legend above comes on top.
        space: whether they are in space.
        share: whether all panels of a new figure share their horizontal axis.

    Raises:
        InvalidInputError: other axes than these, or an unknown width.
    """
    across = inches(width)
    if axes is not None:
        given = np.atleast_1d(np.asarray(axes, dtype=object)).ravel()
        _check_axes(given.tolist(), count, name="ax" if count == 1 else "axes", space=space)
        with style() if ours(given[0]) else nullcontext():
            yield given
        return
    with style():
        layout = Rows(columns, height / _INCH * 72.0)
        figure = plt.figure(FigureClass=_Paper, figsize=(across, height / _INCH), layout=layout)
        made = np.empty(count, dtype=object)
        rows = -(-count // columns)
        inner = (across * _INCH - 15.0 * columns) / columns
        for k in range(count):
            made[k] = figure.add_subplot(rows, columns, k + 1, projection="3d" if space else None)
            if not space:
                _few_ticks(made[k], inner, height)
            if share and k:
                made[k].sharex(made[0])
            if share and k < count - columns:
                made[k].tick_params(labelbottom=False)
        yield made
        layout.fit(figure)


@contextmanager
def panel(ax: Any, *, width: Width, height: float, space: bool = False) -> Iterator[Any]:
    """One of :func:`panels`."""
    with panels(None if ax is None else [ax], 1, width=width, height=height, space=space) as (only,):
        yield only


def ours(ax: Any) -> bool:
    """Whether axes are of a figure that was made here."""
    return isinstance(ax.figure, _Paper)


def _few_ticks(ax: Axes, width: float, height: float) -> None:
    for axis, length, every in ((ax.xaxis, width, _TICK_EVERY[0]), (ax.yaxis, height, _TICK_EVERY[1])):
        axis.set_major_locator(MaxNLocator(max(min(int(length / every), 6), 2), steps=[1, 2, 2.5, 5, 10]))
    keep_ticks(ax)


def keep_ticks(ax: Axes) -> None:
    """Fix the looks of ticks, which are made when they are drawn, in the user's settings then."""
    own = _settings()
    kept = {"labelsize": own["xtick.labelsize"], "pad": own["xtick.major.pad"]}
    ax.tick_params(length=own["xtick.major.size"], width=own["xtick.major.width"], **kept)


def log_ticks(axis: Any) -> None:
    """Ticks of a logarithmic axis at powers of ten, or at 1, 2 and 5 times these over few decades, as plain numbers."""
    low, high = sorted(axis.get_view_interval())
    few = low > 0.0 and high < _FEW_DECADES * low
    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if few else (1.0,), numticks=6))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_formatter(NullFormatter())


def _check_axes(axes: Sequence[Any], count: int, *, name: str, space: bool) -> None:
    if len(axes) != count:
        raise InvalidInputError(f"{name}: expected {count}, got {len(axes)}")
    for ax in axes:
        if not isinstance(ax, Axes):
            raise InvalidInputError(f"{name}: expected Axes of matplotlib, got {type(ax).__name__}")
        if space is not hasattr(ax, "get_zlim"):
            in_space = "in space, made with projection='3d'" if space else "in the plane, not with projection='3d'"
            raise InvalidInputError(f"{name}: expected axes {in_space}")


def key(ax: Any, handles: Any = None, *, title: str | None = None) -> None:
    """A legend above the panels, in as many columns as there is room for; none if nothing has a label."""
    found = ax.get_legend_handles_labels()[0] if handles is None else handles
    if not found:
        return
    columns = key_columns([one.get_label() for one in found], ax, ours(ax))
    legend = ax.legend(handles=found, title=title, loc="lower left", alignment="left", ncols=columns, frameon=False)
    if not ours(ax):
        place_above(legend, ax)


def scale_beside(ax: Any, mappable: Any, name: str) -> None:
    """The scale of colours of a picture beside it."""
    if not ours(ax):
        ax.figure.colorbar(mappable, ax=ax, label=name)
        return
    beside = ax.figure.add_axes((0.9, 0.1, 0.05, 0.8))
    bar = ax.figure.colorbar(mappable, cax=beside, label=name)
    if not isinstance(mappable.norm, LogNorm):
        bar.locator = MaxNLocator(5, steps=[1, 2, 2.5, 5, 10])
    bar.outline.set_linewidth(0.6)
    keep_ticks(beside)
    ax.figure.get_layout_engine().bars[ax] = beside
