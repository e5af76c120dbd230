"""Layout of figures by the sizes of their texts, which are known without drawing anything.

Matplotlib's constrained layout makes all ticks and texts twice before a figure is drawn, which takes two fifths of the
time of a picture. Here text is only measured.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from functools import lru_cache
from typing import Any, final

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties, findfont, get_font
from matplotlib.layout_engine import LayoutEngine
from matplotlib.legend import Legend
from matplotlib.transforms import ScaledTranslation

#: Points of an inch, height of a line in font sizes, and distances at edges, between panels, and below a legend [pt].
_POINTS, _LINE, _EDGE, _BETWEEN, _BELOW_KEY = 72.0, 1.2, 2.0, 8.0, 5.0

#: Height of an entry of a legend in font sizes.
_ENTRY = 1.05

#: Height of axes in space in those of their panel.
_IN_SPACE = 1.14

#: Size of texts [pt].
_SIZE = 8.0

#: Gap before a scale of colours, and its width [pt].
_GAP, _BAR = 5.0, 7.0

#: Least and greatest height of a panel of one scale, in widths, and least share of a figure that panels keep.
_FLATTEST, _TALLEST, _LEAST_SHARE = 0.35, 1.25, 0.2

#: Greatest height of a panel of one scale [pt].
_HIGHEST = 90.0 / 25.4 * _POINTS

#: What matplotlib wraps around powers, and how large these are.
_MATH, _POWER = re.compile(r"\$\\mathdefault\{(.*?)(?:\^\{(.*?)\})?\}\$"), 0.7


#: Words of a label: spaces in brackets do not end them.
_WORDS = re.compile(r"(?:\[[^\]]*\]|[^\s\[])+")


def width_of(text: str, properties: FontProperties) -> float:
    """Width of the widest line of a text [pt]."""
    return _width(text, findfont(properties), float(properties.get_size_in_points()))


@lru_cache(maxsize=4096)
def _width(text: str, file: Any, size: float) -> float:
    power = _MATH.fullmatch(text)
    if power:
        return _width(power[1].replace(r"\times", "x"), file, size) + _width(power[2] or "", file, _POWER * size)
    font = get_font(file)
    font.set_size(size, _POINTS)
    widest = 0.0
    for line in text.split("\n"):
        font.set_text(line, 0.0)
        widest = max(widest, float(font.get_width_height()[0]) / 64.0)
    return widest


def _height_of(text: str, properties: FontProperties) -> float:
    return _LINE * float(properties.get_size_in_points()) * (1 + text.count("\n")) if text else 0.0


def key_columns(labels: Sequence[str], ax: Any, own: bool) -> int:
    """The greatest number of columns of a legend that are not wider together than there is room above axes.

    Args:
        labels: its texts.
        ax: the axes.
        own: whether they are of a figure of ours, whose legend is as wide as the figure.
    """
    font, look = FontProperties(size=mpl.rcParams["legend.fontsize"]), mpl.rcParams
    size = float(font.get_size_in_points())
    share = 1.0 if own else ax.get_position().width
    across = share * ax.figure.get_figwidth() * _POINTS - 2.0 * _EDGE
    before, between = size * (look["legend.handlelength"] + look["legend.handletextpad"]), look["legend.columnspacing"]
    widths = np.array([before + width_of(text, font) for text in labels])
    for columns in range(len(widths), 1, -1):
        parts = np.array_split(widths, columns)
        if sum(float(part.max()) for part in parts) + between * size * (columns - 1) <= across:
            return columns
    return 1


def place_above(legend: Legend, ax: Any) -> None:
    """Put a legend above a user's axes and their title."""
    above = _title_height(ax) + _BELOW_KEY
    moved = ax.transAxes + ScaledTranslation(0.0, above / _POINTS, ax.figure.dpi_scale_trans)
    legend.set_bbox_to_anchor((0.0, 1.0), transform=moved)


def _key_height(legend: Legend | None) -> float:
    if legend is None or not legend.get_visible():
        return 0.0
    texts, title = legend.get_texts(), legend.get_title()
    size = texts[0].get_fontproperties().get_size_in_points()
    rows = -(-len(texts) // _columns_of(legend))
    if title.get_visible() and title.get_text() not in ("", "None"):
        rows += 1
    return float((rows * (_ENTRY + legend.labelspacing) - legend.labelspacing) * size + _BELOW_KEY)


def _columns_of(legend: Any) -> int:
    """Columns of a legend, which matplotlib tells nobody."""
    return int(legend._ncols)


def _title_height(ax: Any) -> float:
    parts = (ax.title, ax._left_title, ax._right_title)
    height = max(_height_of(one.get_text(), one.get_fontproperties()) for one in parts)
    return height + 3.0 if height else 0.0


@final
class Rows(LayoutEngine):
    """Panels of one size in rows and columns; legend and title above them all, scales of colours beside their panels.

    Attributes:
        bars: axes -> axes of the scale of colours beside them.
        extra: axes -> room that they need beyond that of ticks and labels: left, right, below, above [pt].
    """

    _adjust_compatible = False
    _colorbar_gridspec = False

    def __init__(self, columns: int, height: float) -> None:
        super().__init__()
        self.bars: dict[Any, Axes] = {}
        self.extra: dict[Any, tuple[float, float, float, float]] = {}
        self._columns, self._height = columns, height

    def fit(self, figure: Figure) -> None:
        """Make a figure as tall as its panels and all that stands around them need."""
        wide, high = self._room(figure)
        height, margins = self._height, self._margins(figure)
        for ax in margins.axes:
            if ax.name != "3d":
                _wrap(ax, margins.width(wide), height, wide / margins.columns)
            for beside in (*ax.child_axes, *([self.bars[ax]] if ax in self.bars else [])):
                text = beside.yaxis.label
                text.set_text(wrapped(text.get_text(), text.get_fontproperties(), height))
        margins = self._margins(figure)
        for ax in margins.axes:
            if ax.name != "3d" and ax.get_aspect() == 1.0 and ax.get_adjustable() == "box":
                ratio = abs(np.diff(ax.get_ylim())[0] / np.diff(ax.get_xlim())[0])
                height = min(margins.width(wide) * float(np.clip(ratio, _FLATTEST, _TALLEST)), _HIGHEST)
        figure.set_figheight((high + margins.around + height * margins.rows) / _POINTS)

    def entitle(self, figure: Figure, title: str) -> None:
        """Put a title above everything, in as many lines as it needs."""
        font = FontProperties(size=_SIZE)
        room = figure.get_figwidth() * _POINTS - 4.0 * _EDGE
        figure.suptitle(wrapped(title, font, room), fontproperties=font)
        self.fit(figure)

    def execute(self, fig: Any) -> None:
        """Place everything; called by matplotlib before it draws a figure."""
        wide, above = self._room(fig)
        margins = self._margins(fig)
        total = fig.get_figheight() * _POINTS
        across = fig.get_figwidth() * _POINTS
        width = margins.width(wide)
        height = (total - above - margins.around) / margins.rows
        height = max(height, _LEAST_SHARE * total / margins.rows)
        for ax, (row, column) in margins.axes.items():
            left = _EDGE + margins.before(column) + column * width
            top = above + margins.over(row) + row * height
            taller = _IN_SPACE if ax.name == "3d" else 1.0  # above the box is nothing, below are its labels
            _set(ax, left / across, 1.0 - (top + height) / total, width / across, taller * height / total)
            _clear_of_power(ax, height)
            if ax in self.bars and ax.name == "3d":  # whose box is wider and taller than what is seen of it
                beside = (left + width + _GAP) / across
                _set(self.bars[ax], beside, 1.0 - (top + 0.9 * height) / total, _BAR / across, 0.8 * height / total)
            elif ax in self.bars:
                ax.apply_aspect()
                box = ax.get_position()
                _set(self.bars[ax], box.x1 + _GAP / across, box.y0, _BAR / across, box.height)
        self._place_above(fig, across, total)

    def _room(self, figure: Figure) -> tuple[float, float]:
        """Width for all columns, and height of title, legend and edges [pt]."""
        above = sum(_height_of(one.get_text(), one.get_fontproperties()) + 2.0 for one in _titles(figure))
        above += max((_key_height(ax.get_legend()) for ax in figure.axes), default=0.0)
        return figure.get_figwidth() * _POINTS - 2.0 * _EDGE, above + _EDGE

    def _place_above(self, figure: Figure, across: float, total: float) -> None:
        down = _EDGE
        for title in _titles(figure):
            title.set(position=(0.5, 1.0 - down / total), verticalalignment="top", horizontalalignment="center")
            down += _height_of(title.get_text(), title.get_fontproperties()) + 2.0
        for legend in filter(None, (ax.get_legend() for ax in figure.axes)):
            legend.set_loc("upper left")
            legend.set_bbox_to_anchor((_EDGE / across, 1.0 - down / total), transform=figure.transFigure)

    def _margins(self, figure: Figure) -> _Margins:
        found = {}
        for ax in figure.axes:
            spec = ax.get_subplotspec()
            if spec is not None:
                found[ax] = (spec.rowspan.start, spec.colspan.start)
        columns = 1 + max(column for _, column in found.values())
        guess = figure.get_figwidth() * _POINTS / columns - 30.0
        around = {ax: self._around(ax, guess) for ax in found}
        return _Margins(found, around)

    def _around(self, ax: Any, width: float) -> tuple[float, float, float, float]:
        """What axes need on the left, right, below and above [pt]."""
        more = self.extra.get(ax, (0.0, 0.0, 0.0, 0.0))
        scale = _GAP + _BAR + _beside(self.bars[ax].yaxis, "labelright")[0] if ax in self.bars else 0.0
        if ax.name == "3d":
            return (more[0], more[1] + scale, more[2], more[3] + _title_height(ax))
        first, last, below = _across(ax, width)
        left, offset = _beside(ax.yaxis, "labelleft") if ax.axison else (0.0, 0.0)
        right = max([last, *(_beside(child.yaxis, "labelright")[0] for child in ax.child_axes)])
        right += scale
        above = max(_title_height(ax) + (offset if ax.get_title(loc="left") else 0.0), offset, 0.5 * _LINE * _SIZE)
        return max(left, first) + more[0], right + more[1], below + more[2], above + more[3]


@final
class _Margins:
    """Room around the panels of rows and columns [pt]."""

    def __init__(self, axes: dict[Any, tuple[int, int]], around: dict[Any, tuple[float, float, float, float]]) -> None:
        self.axes = axes
        self.rows, self.columns = (1 + max(place[k] for place in axes.values()) for k in (0, 1))
        sides = np.zeros((4, max(self.rows, self.columns)))
        for ax, (row, column) in axes.items():
            for side, place in enumerate((column, column, row, row)):
                sides[side, place] = max(sides[side, place], around[ax][side])
        self._left, self._right, self._below, self._above = sides

    def width(self, wide: float) -> float:
        """Width of each panel."""
        taken = float(self._left.sum() + self._right.sum()) + _BETWEEN * (self.columns - 1)
        return max((wide - taken) / self.columns, _LEAST_SHARE * wide / self.columns)

    @property
    def around(self) -> float:
        """Height of all that is not panels."""
        return float(self._below.sum() + self._above.sum()) + _BETWEEN * (self.rows - 1) + _EDGE

    def before(self, column: int) -> float:
        """Room before the panels of a column, without the panels before."""
        return float(self._left[: column + 1].sum() + self._right[:column].sum()) + _BETWEEN * column

    def over(self, row: int) -> float:
        """Room above the panels of a row, without the panels above."""
        return float(self._above[: row + 1].sum() + self._below[:row].sum()) + _BETWEEN * row


def _set(ax: Any, left: float, bottom: float, width: float, height: float) -> None:
    ax.set_position((left, bottom, width, height))
    ax.set_in_layout(True)  # which setting a position ends


def _wrap(ax: Any, width: float, height: float, across: float) -> None:
    """Wrap labels that are longer than their side of a panel, and titles that are wider than their column [pt]."""
    beyond = 0.5 * (across - width)
    for text, room in (
        (ax.xaxis.label, width + 0.5 * beyond),
        (ax.yaxis.label, height + 6.0),
        *((one, width + 0.5 * beyond) for one in (ax.title, ax._left_title, ax._right_title)),
    ):
        text.set_text(wrapped(text.get_text(), text.get_fontproperties(), room))


def wrapped(text: str, properties: FontProperties, room: float) -> str:
    """A text in lines that are at most as wide as there is room [pt]; what is in brackets stays together."""
    if not text or width_of(text, properties) <= room:
        return text
    lines = [""]
    for word in _WORDS.findall(text.replace("\n", " ")):
        longer = f"{lines[-1]} {word}".strip()
        if lines[-1] and width_of(longer, properties) > room:
            lines.append(word)
        else:
            lines[-1] = longer
    return "\n".join(lines)


def _clear_of_power(ax: Any, height: float) -> None:
    """Lift a title on the left above the power of ten of a vertical axis, which stands there."""
    if ax.name != "3d" and ax.get_title(loc="left"):
        offset = _beside(ax.yaxis, "labelleft")[1]
        ax._left_title.set_position((0.0, 1.0 + offset / height))


def _titles(figure: Any) -> list[Any]:
    """The title of the figure, if it has one."""
    text = figure.get_suptitle()
    return [one for one in figure.texts if one.get_text() == text][:1] if text else []


def _ticks(axis: Any, side: str) -> tuple[list[tuple[float, str]], FontProperties, float]:
    """Places and texts of the labels of an axis that are seen, their font, and length and distance of ticks [pt]."""
    looks = axis.get_tick_params(which="major")
    properties = FontProperties(size=looks.get("labelsize") or _SIZE)
    beyond = float(looks.get("length") or 2.5) + float(looks.get("pad") or 2.0)
    places = np.asarray(axis.get_majorticklocs(), dtype=float)
    if not len(places):
        return [], properties, 0.0
    texts = axis.get_major_formatter().format_ticks(places) if looks.get(side, side == "labelleft") else []
    low, high = sorted(axis.get_view_interval())
    slack = 1e-6 * (high - low)
    seen = [(x, text) for x, text in zip(places, texts, strict=False) if low - slack <= x <= high + slack]
    return seen, properties, beyond


def _beside(axis: Any, side: str) -> tuple[float, float]:
    """Width of ticks and label of a vertical axis, and height of a power of ten above it [pt]."""
    seen, properties, beyond = _ticks(axis, side)
    wide = max((width_of(text, properties) for _, text in seen if text), default=0.0)
    text, font = axis.get_label().get_text(), axis.get_label().get_fontproperties()
    label = _height_of(text, font) + axis.labelpad if text else 0.0
    offset = axis.get_major_formatter().get_offset() if seen else ""
    return beyond + wide + label, _height_of(offset, properties)


def _across(ax: Any, width: float) -> tuple[float, float, float]:
    """How far the labels of a horizontal axis reach beyond its ends, and how far down [pt]."""
    axis = ax.xaxis
    seen, properties, beyond = _ticks(axis, "labelbottom")
    turned = math.radians(float(axis.get_tick_params(which="major").get("labelrotation") or 0.0))
    first = last = high = 0.0
    low, top = axis.get_transform().transform(np.array(axis.get_view_interval()))
    for place, text in seen:
        share = float((axis.get_transform().transform(place) - low) / (top - low)) if top != low else 0.5
        wide, lines = width_of(text, properties), _height_of(text, properties)
        half = 0.5 * (wide * math.cos(turned) + lines * math.sin(turned))
        first, last = max(first, half - share * width), max(last, half - (1.0 - share) * width)
        high = max(high, wide * math.sin(turned) + lines * math.cos(turned))
    text, font = axis.get_label().get_text(), axis.get_label().get_fontproperties()
    label = _height_of(text, font) + axis.labelpad if text else 0.0
    return first, last, (beyond + high if seen else 0.0) + label
