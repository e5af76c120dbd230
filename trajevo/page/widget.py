"""The page of a front in a notebook, as a widget whose choice Python can read."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any

from trajevo.errors import InvalidInputError
from trajevo.front.front import Front, Solution
from trajevo.page.report import report

if TYPE_CHECKING:
    from anywidget import AnyWidget

#: Shows the page in a frame of its own, and tells Python which row it has chosen.
_SCRIPT = """
function render({model, el}) {
  const frame = document.createElement("iframe");
  frame.style.cssText = "width: 100%; border: 0; border-radius: 8px";
  frame.style.height = `${model.get("height")}px`;
  frame.title = model.get("title");
  frame.srcdoc = model.get("page");
  const told = (event) => {
    if (event.source !== frame.contentWindow || !event.data || !Number.isInteger(event.data.trajevo)) return;
    model.set("row", event.data.trajevo);
    model.save_changes();
  };
  window.addEventListener("message", told);
  const changed = () => frame.contentWindow && frame.contentWindow.postMessage({trajevo: model.get("row")}, "*");
  model.on("change:row", changed);
  el.append(frame);
  return () => {
    window.removeEventListener("message", told);
    model.off("change:row", changed);
  };
}
export default {render};
"""


def front_widget(front: Front, *, height: int = 900) -> AnyWidget:
    """The page of a front as a widget: click a solution there, and read it here.

    Args:
        front: a front that is not empty.
        height: height of the widget [pixel].

    Returns:
        A widget with ``row``, the chosen row of the front, which may be set too, and ``solution``, the chosen solution.

    Raises:
        NoSolutionError: the front is empty.
        InvalidInputError: anywidget is not installed.
    """
    try:
        import anywidget
        import traitlets
    except ImportError as error:
        raise InvalidInputError(
            f"widget: needs the package anywidget, pip install 'trajevo[notebook]' brings it: {error}"
        ) from error

    class FrontWidget(anywidget.AnyWidget):  # type: ignore[misc]
        """The page of a front."""

        _esm = _SCRIPT
        page = traitlets.Unicode().tag(sync=True)
        title = traitlets.Unicode().tag(sync=True)
        height = traitlets.Int().tag(sync=True)
        row = traitlets.Int().tag(sync=True)

        @traitlets.validate("row")  # type: ignore[untyped-decorator]
        def _existing(self, proposal: Any) -> int:
            if not 0 <= proposal["value"] < len(front):
                raise InvalidInputError(f"row: expected one from 0 to {len(front) - 1}, got {proposal['value']}")
            return int(proposal["value"])

        @property
        def solution(self) -> Solution:
            """The chosen solution, by the name of its rule if it is a choice."""
            for choice in front.choices():
                if choice.index == self.row:
                    return choice
            return front.pick(str(self.row))

    knee = front.knee().index
    with tempfile.TemporaryDirectory() as folder:
        file = report(front, Path(folder) / "page.html", analyses={}, pictures=[], files="choices", run="RUN")
        page = file.read_text(encoding="utf-8")
    return FrontWidget(page=page, title=front.record.title, height=height, row=knee)
