"""meshcat's viewer as one HTML page that needs no server and no network.

meshcat's own ``static_html`` asks a server process for the page, which opens two ports, prints its address and has no
way to be closed before Python ends. Here the commands go into the page directly.
"""

from __future__ import annotations

import base64
import html
from pathlib import Path
from typing import Any, final

from trajevo.errors import InvalidInputError

#: The policy makes the browser refuse any network.
_PAGE = """<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="default-src 'unsafe-inline' data: blob:">
<title>{title}</title>
<style>body {{ margin: 0; }} #pane {{ width: 100vw; height: 100vh; overflow: hidden; }}</style>
</head>
<body>
<div id="pane"></div>
<script>
{licence}
{viewer}
</script>
<script>
const commands = [
{commands}
];
const viewer = new MeshCat.Viewer(document.getElementById("pane"));
for (const command of commands) {{
  viewer.handle_command_bytearray(Uint8Array.from(atob(command), letter => letter.charCodeAt(0)));
}}
viewer.gui.__folders["Scene"].close();
viewer.gui.open();
</script>
</body>
</html>
"""


@final
class Page:
    """Stands in for meshcat's window: keeps the commands that the window would send to its server.

    Attributes:
        title: title of the page.
        commands: what the viewer is to do, in order, base64 of meshcat's messages.
    """

    def __init__(self, title: str) -> None:
        self.title = title
        self.commands: list[str] = []

    def visualizer(self) -> Any:
        """The visualizer of meshcat that draws on this page.

        Raises:
            InvalidInputError: meshcat is not installed.
        """
        try:
            from meshcat import Visualizer
        except ImportError as error:
            raise InvalidInputError(
                f"animate: needs the package meshcat, pip install 'trajevo[animation]' brings it: {error}"
            ) from error
        return Visualizer(window=self)

    def send(self, command: Any) -> None:
        """Keep a command in the viewer's format; single precision is what the viewer computes in, and half as long."""
        import umsgpack

        packed = umsgpack.packb(command.lower(), force_float_precision="single")
        self.commands.append(base64.b64encode(packed).decode("ascii"))

    def get_scene(self) -> str:
        """The HTML with the viewer, its licence notes and all commands in the order they came."""
        import meshcat

        folder = Path(meshcat.__file__).with_name("viewer") / "dist"
        return _PAGE.format(
            title=html.escape(self.title),
            licence=(folder / "main.min.js.LICENSE.txt").read_text(encoding="utf-8"),
            viewer=(folder / "main.min.js").read_text(encoding="utf-8"),
            commands=",\n".join(f'"{command}"' for command in self.commands),
        )
