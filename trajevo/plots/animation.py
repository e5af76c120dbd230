"""An arm along a motion: stick figures in one picture, and an animation in real time as one HTML file.

The animation is drawn by meshcat's viewer with primitive shapes, since the robots have no visual meshes.
"""

from __future__ import annotations

import base64
import html
from collections.abc import Iterator
from pathlib import Path
from typing import Any, final

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

from trajevo.base.arrays import Array
from trajevo.base.files import why_not, write_whole
from trajevo.dynamics.rollout import Rollout, rollout_of
from trajevo.errors import InvalidInputError
from trajevo.front.front import Solution
from trajevo.plots.loads import add_loads, poses_of
from trajevo.plots.motion import equal_axes
from trajevo.plots.scenery import Surface, mesh_of, pose_matrix, scenery
from trajevo.robot.robot import Robot

#: The content security policy makes the browser refuse any network access.
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
    """Replaces meshcat's window: keeps the commands that the window would send to its server.

    Attributes:
        title: title of the page.
        commands: commands for the viewer, in order: meshcat's messages in base64.
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
        """Keep a command in the viewer's format, in single precision, as the viewer computes, to halve its size."""
        import umsgpack

        packed = umsgpack.packb(command.lower(), force_float_precision="single")
        self.commands.append(base64.b64encode(packed).decode("ascii"))

    def get_scene(self) -> str:
        """The HTML with the viewer, its licence notes and all commands in order."""
        import meshcat

        folder = Path(meshcat.__file__).with_name("viewer") / "dist"
        return _PAGE.format(
            title=html.escape(self.title),
            licence=(folder / "main.min.js.LICENSE.txt").read_text(encoding="utf-8"),
            viewer=(folder / "main.min.js").read_text(encoding="utf-8"),
            commands=",\n".join(f'"{command}"' for command in self.commands),
        )


#: Greatest number of frames; each takes about 0.25 kB for every joint and for the tool.
MOST_FRAMES = 10_000

#: Size of the whole motion in the viewer, whose camera and lights are meant for arms of about a metre.
_SHOWN = 2.5

#: Position of the camera, with y up and the motion around the origin.
_CAMERA = (1.0, 0.7, 1.8)

#: Sizes as shares of the extent of the whole motion.
_LINK, _JOINT, _TRIAD = 0.012, 0.03, 0.08


_GREY, _BLUE, _ORANGE, _DARK, _SOLID, _GROUND = 0x9AA3AD, 0x1F77B4, 0xFF7F0E, 0x333333, 0xB0A090, 0xD9DDE1

#: Width of what is drawn of a plane, in extents of the whole motion.
_WIDE = 1.6


def stick_figure(motion: Solution | Rollout, *, count: int = 6, ax: Any = None) -> Any:
    """The chain from the base over the joints' origins to the tool at some instants, and the tool's path, in 3D [m].

    Obstacles of a solution are drawn too, and what is attached to links where it is at the end.

    Args:
        motion: a solution of a front, or the first trajectory of a rollout.
        count: number of instants drawn, evenly spaced from first to last; the colour is the time.
        ax: 3D axes.

    Returns:
        The axes.

    Raises:
        InvalidInputError: not a motion, a count that is not a positive whole number, or 2D axes.
    """
    rollout = rollout_of(motion)
    rollout.robot.check_body("a picture of the arm")
    if not isinstance(count, int | np.integer) or isinstance(count, bool) or count < 1:
        raise InvalidInputError(f"count: expected a positive whole number, got {count!r}")
    if ax is not None and not hasattr(ax, "get_zlim"):
        raise InvalidInputError("ax: expected axes in space, made with projection='3d'")
    ax = ax or plt.figure(figsize=(7.6, 6.0), layout="constrained").add_subplot(projection="3d")
    trajectory, robot = rollout.trajectory[0], rollout.robot
    path, _ = robot.tool_poses(trajectory.sample(400).q[0])
    times = np.linspace(0.0, float(trajectory.duration[0]), count)
    chains = _chains(robot, trajectory.evaluate(times)[0])
    colours = ScalarMappable(Normalize(0.0, float(trajectory.duration[0])), "viridis")
    for chain, time in zip(chains, times, strict=True):
        ax.plot(*chain.T, "o-", color=colours.to_rgba(time), linewidth=2.5, markersize=4.5)
    ax.plot(*path.T, color="black", linewidth=0.8)
    shown = np.concatenate([path, chains.reshape(-1, 3), *_surroundings(ax, motion, rollout, chains)])
    equal_axes(ax, shown)
    _stand_upright(ax, robot)
    ax.figure.colorbar(colours, ax=ax, label="time [s]", shrink=0.7, pad=0.1)
    return ax


def animate(motion: Solution | Rollout, file: str | Path, *, rate: float = 25.0) -> Path:
    """Write the arm's motion in real time as one HTML file that needs no network.

    Revolute joints are cylinders along their axis, prismatic joints are boxes, the tool is a triad, and its path is a
    line. Obstacles are where they stand or move, of planes a part, and what is attached moves with its link; loads with
    a shape are where they are picked up, at the tool, and where they are put down. The up direction is opposite to
    gravity. The motion repeats; the panel plays, pauses and shows any instant.

    Args:
        motion: a solution of a front, or the first trajectory of a rollout.
        file: path of the file.
        rate: frames per second of the motion [1/s], with one more at its end; the viewer interpolates between frames.

    Returns:
        Path of the file.

    Raises:
        InvalidInputError: not a motion, a rate that is not positive or gives over ``MOST_FRAMES``, a file that cannot
            be written, or meshcat is not installed.
    """
    rollout = rollout_of(motion)
    if not isinstance(file, str | Path):
        raise InvalidInputError(f"file: expected a path, got {file!r}")
    rollout.robot.check_body("an animation")
    times = _instants(float(rollout.trajectory.duration[0]), rate)
    page = Page(f"{rollout.robot.name}, {times[-1]:.3f} s")
    view = page.visualizer()
    _draw(view, motion, rollout, times, rate)
    try:
        write_whole(Path(file), page.get_scene().encode())
    except OSError as error:
        raise InvalidInputError(f"{file}: cannot be written: {why_not(error)}") from error
    return Path(file)


def _instants(duration: float, rate: Any) -> Array:
    """Instants of the frames, the end of the motion as the last, shape (T,) [s]."""
    if not isinstance(rate, int | float) or isinstance(rate, bool) or not (np.isfinite(rate) and rate > 0.0):
        raise InvalidInputError(f"rate: expected a positive number of frames per second, got {rate!r}")
    if duration * rate > MOST_FRAMES:
        raise InvalidInputError(
            f"rate: {rate:g} per second give over {MOST_FRAMES} frames of a motion of {duration:.4g} s"
        )
    inner = np.arange(np.ceil(duration * rate * (1.0 - 1e-9))) / rate
    return np.append(inner, duration)


def _chains(robot: Robot, q: Array) -> Array:
    """Base, origins of the joints and tool at each configuration, shape (T, n_joints + 2, 3) [m]."""
    origins, _ = robot.joint_poses(q)
    return np.concatenate([np.zeros_like(origins[:, :1]), origins], axis=1)


def _stand_upright(ax: Any, robot: Robot) -> None:
    """Show the arm upright: the axis nearest to gravity is vertical, the view turned over if the axis points down."""
    gravity = np.asarray(robot.model.gravity.linear)
    vertical = int(np.abs(gravity).argmax()) if gravity.any() else 2
    if gravity[vertical] > 0.0:  # turn the view, since an inverted axis would show a mirrored arm
        ax.view_init(elev=-20, azim=-60, roll=180, vertical_axis="xyz"[vertical])
    else:
        ax.view_init(elev=20, azim=-60, vertical_axis="xyz"[vertical])


def _draw(view: Any, motion: Any, rollout: Rollout, times: Array, rate: float) -> None:
    """Set up the scene and its animation: shapes once, then their poses at every instant."""
    from meshcat.animation import Animation

    robot, trajectory = rollout.robot, rollout.trajectory[0]
    q = trajectory.evaluate(times)[0]
    positions, rotations = robot.joint_poses(q)
    chains = _chains(robot, q)
    extent = max(float(np.linalg.norm(np.ptp(chains.reshape(-1, 3), axis=0))), 1e-9)
    _set_stage(view, robot, chains, extent)
    path, _ = robot.tool_poses(trajectory.sample(400).q[0])
    _add_shapes(view, robot, path, extent)
    moved = [*_add_surroundings(view["arm"], motion, rollout, times)]
    loads = add_loads(view["arm"], rollout, f"frame_{positions.shape[1] - 1}")
    moved += [(name, poses_of(rollout, load, times)) for name, load in loads]
    played = Animation(default_framerate=rate)
    spans = np.diff(chains, axis=1)
    # A link of length zero has no orientation that the viewer could compute.
    lengths = np.maximum(np.linalg.norm(spans, axis=2), 1e-6 * extent)
    turned, middles = _from_y_axis(spans), chains[:, :-1] + 0.5 * spans
    for i, time in enumerate(times):
        frame = played.at_frame(view["arm"], float(time * rate))
        for k in range(positions.shape[1]):
            frame[f"frame_{k}"].set_transform(pose_matrix(rotations[i, k], positions[i, k]))
            link = frame[f"link_{k}"]
            link.set_transform(pose_matrix(turned[i, k], middles[i, k]))
            link.set_property("scale", "vector3", [1.0, float(lengths[i, k]), 1.0])
        for name, poses in moved:
            frame[name].set_transform(poses[i])
    view.set_animation(played, repetitions=float("inf"))


def _set_stage(view: Any, robot: Robot, chains: Array, extent: float) -> None:
    """A white background with the motion in the middle, at the viewer's scale and with gravity pointing down."""
    for name in ("/Background", "/Grid", "/Axes"):
        view[name].set_property("visible", False)
    view["/Cameras/default/rotated/<object>"].set_property("position", list(_CAMERA))
    gravity = np.asarray(robot.model.gravity.linear)
    upright = np.eye(3)
    if gravity.any():
        to_y = _from_y_axis(-gravity).T
        upright = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]) @ to_y
    scaled = _SHOWN / extent * upright
    corners = chains.reshape(-1, 3)
    middle = 0.5 * (corners.min(axis=0) + corners.max(axis=0))
    view["arm"].set_transform(pose_matrix(scaled, -scaled @ middle))


def _add_shapes(view: Any, robot: Robot, path: Array, extent: float) -> None:
    """Shapes of the arm: a link to every frame, a shape at every joint, triads at base and tool, and the path."""
    from meshcat import geometry

    axes, turns = robot.joint_axes
    arm, size = view["arm"], _JOINT * extent
    for k in range(len(axes) + 1):
        # A cylinder of meshcat lies along y and is as long as its pose says.
        arm[f"link_{k}"].set_object(geometry.Cylinder(1.0, _LINK * extent), geometry.MeshLambertMaterial(color=_GREY))
    for k, (axis, turning) in enumerate(zip(axes, turns, strict=True)):
        shape = geometry.Cylinder(2.0 * size, 0.7 * size) if turning else geometry.Box([size, 2.0 * size, size])
        colour = _BLUE if turning else _ORANGE
        arm[f"frame_{k}/shape"].set_object(shape, geometry.MeshLambertMaterial(color=colour))
        arm[f"frame_{k}/shape"].set_transform(pose_matrix(_from_y_axis(axis), np.zeros(3)))
    arm[f"frame_{len(axes)}/triad"].set_object(geometry.triad(_TRIAD * extent))
    arm["base"].set_object(geometry.triad(_TRIAD * extent))
    arm["path"].set_object(geometry.Line(geometry.PointsGeometry(path.T), geometry.LineBasicMaterial(color=_DARK)))


def _add_surroundings(arm: Any, motion: Any, rollout: Rollout, times: Array) -> Iterator[tuple[str, list[Array]]]:
    """Draw obstacles, and what links carry along; names of those that move by themselves, and their poses."""
    from meshcat import geometry

    chains = _chains(rollout.robot, rollout.trajectory[0].sample(100).q[0])
    for number, surface in enumerate(_surfaces(motion, chains)):
        colour, opacity = (_GROUND, 1.0) if surface.endless else (_BLUE, 0.75) if surface.attached else (_SOLID, 0.6)
        material = geometry.MeshLambertMaterial(color=colour, opacity=opacity, transparent=opacity < 1.0)
        kind = "attached" if surface.attached else "obstacle"
        name = f"{f'frame_{surface.joint - 1}/' if surface.joint else ''}{kind}_{number}"
        arm[name].set_object(mesh_of(surface.triangles), material)
        if surface.motion is not None:
            poses = zip(*surface.motion.poses(times), strict=True)
            yield name, [pose_matrix(rotation, position) for rotation, position in poses]


def _surroundings(ax: Any, motion: Any, rollout: Rollout, chains: Array) -> list[Array]:
    """Draw the scene at the end of the motion; points that are to be seen, (K, 3) [m] each."""
    corners = chains.reshape(-1, 3)
    low, high = corners.min(axis=0), corners.max(axis=0)
    spare, end = float(np.ptp(corners, axis=0).max()), rollout.trajectory[0].evaluate(rollout.trajectory.duration)[0]
    positions, rotations = rollout.robot.joint_poses(end)
    seen = []
    for surface in _surfaces(motion, chains):
        drawn, k = surface.triangles, surface.joint - 1
        if surface.motion is not None:
            (rotation,), (position,) = surface.motion.poses(rollout.trajectory[0].duration)
            drawn = drawn @ rotation.T + position
        if surface.joint:
            drawn = drawn @ rotations[0, k].T + positions[0, k]
        colour = f"#{_GROUND if surface.endless else _BLUE if surface.attached else _SOLID:06x}"
        ax.add_collection3d(Poly3DCollection(drawn, facecolor=colour, alpha=0.15 if surface.endless else 0.35))
        if not surface.endless:
            seen.append(np.clip(drawn.reshape(-1, 3), low - spare, high + spare))
    return seen


def _surfaces(motion: Any, chains: Array) -> list[Surface]:
    corners = chains.reshape(-1, 3)
    low, high = corners.min(axis=0), corners.max(axis=0)
    return scenery(motion, 0.5 * (low + high), _WIDE * float(np.linalg.norm(high - low)))


def _from_y_axis(directions: Array) -> Array:
    """Rotations that turn the y axis into directions, shapes (..., 3) -> (..., 3, 3); the identity for zero vectors."""
    length = np.linalg.norm(directions, axis=-1, keepdims=True)
    y = np.where(length > 0.0, directions / np.where(length > 0.0, length, 1.0), [0.0, 1.0, 0.0])
    helper = np.eye(3)[np.abs(y).argmin(axis=-1)]
    z = np.cross(helper, y)
    z /= np.linalg.norm(z, axis=-1, keepdims=True)
    return np.stack([np.cross(y, z), y, z], axis=-1)
