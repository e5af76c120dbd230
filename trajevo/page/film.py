"""A motion as a film: GIF by Pillow, MP4 by ffmpeg."""

from __future__ import annotations

import tempfile
import warnings
from pathlib import Path
from typing import Any

import numpy as np

from trajevo.base.arrays import Array
from trajevo.base.files import why_not, write_whole
from trajevo.dynamics.rollout import Rollout, rollout_of
from trajevo.errors import InvalidInputError
from trajevo.front.front import Solution
from trajevo.plots.chain import chains_of, stand_upright
from trajevo.plots.motion import equal_axes
from trajevo.plots.scenery import BaseInCell, scenery
from trajevo.robot.robot import Robot
from trajevo.robot.shapes.geometry import link_shapes

#: Greatest number of frames; each takes a tenth of a second of CPU time.
MOST_FRAMES = 2_000

#: How much of a frame the motion takes.
_ZOOM = 0.97

#: Greatest number of triangles of a link, size of a frame [inch], dots per inch, width of planes in extents.
_TRIANGLES, _SIZE, _RESOLUTION, _WIDE = 260, (6.0, 5.0), 100, 1.3

_SOLID, _ATTACHED, _GROUND = "#b0a090", "#1f77b4", "#d9dde1"


def write_film(motion: Solution | Rollout, file: Path, *, rate: Any) -> Path:
    """Write a film of a motion in real time.

    Args:
        motion: a solution of a front, or the first trajectory of a rollout.
        file: its path, ending in ``.gif`` or ``.mp4``.
        rate: frames per second [1/s], with one more at the end of the motion.

    Raises:
        InvalidInputError: a rate that is not positive or gives too many frames, ffmpeg is not installed, or the file
            cannot be written.
    """
    from matplotlib import animation

    rollout = rollout_of(motion)
    times = instants_of(float(rollout.trajectory.duration[0]), rate)
    if file.suffix.lower() == ".mp4" and not animation.FFMpegWriter.isAvailable():
        raise InvalidInputError(f"{file}: a film as MP4 needs ffmpeg on the PATH; one that ends in .gif needs none")
    kind = animation.PillowWriter if file.suffix.lower() == ".gif" else animation.FFMpegWriter
    with tempfile.TemporaryDirectory() as folder:
        made = Path(folder) / f"film{file.suffix.lower()}"
        _filmed(motion, rollout, times, kind(fps=rate), made)
        content = made.read_bytes()
    try:
        write_whole(file, content)
    except OSError as error:
        raise InvalidInputError(f"{file}: cannot be written: {why_not(error)}") from error
    return file


def instants_of(duration: float, rate: Any) -> Array:
    """Instants of the frames, the end of the motion as the last, shape (T,) [s]."""
    if not isinstance(rate, int | float) or isinstance(rate, bool) or not (np.isfinite(rate) and rate > 0.0):
        raise InvalidInputError(f"rate: expected a positive number of frames per second, got {rate!r}")
    if duration * rate > MOST_FRAMES:
        raise InvalidInputError(
            f"rate: {rate:g} per second give over {MOST_FRAMES} frames of a motion of {duration:.4g} s"
        )
    inner = np.arange(np.ceil(duration * rate * (1.0 - 1e-9))) / rate
    return np.append(inner, duration)


def _filmed(motion: Any, rollout: Rollout, times: Array, writer: Any, file: Path) -> None:
    """Draw every frame and write them."""
    import matplotlib.pyplot as plt

    robot, trajectory = rollout.robot, rollout.trajectory[0]
    q = trajectory.evaluate(times)[0]
    positions, rotations = robot.joint_poses(q)
    standing = BaseInCell.of(rollout)
    path = standing(robot.tool_poses(trajectory.sample(300).q[0])[0])
    chains = standing(chains_of(robot, q))
    seen = np.concatenate([path, chains.reshape(-1, 3)])
    middle, extent = 0.5 * (seen.min(axis=0) + seen.max(axis=0)), float(np.linalg.norm(np.ptp(seen, axis=0)))
    shapes, around = _shapes(robot), scenery(motion, middle, _WIDE * extent)
    seen = np.concatenate([seen, *_near(around, middle, extent)])
    fig = plt.figure(figsize=_SIZE, layout="constrained")
    ax: Any = fig.add_subplot(projection="3d")
    try:
        with writer.saving(fig, str(file), _RESOLUTION):
            for k, time in enumerate(times):
                ax.clear()
                ax.plot(*path.T, color="black", linewidth=0.8)
                for triangles, joint, colour, opacity in [*shapes, *_placed(around, float(time))]:
                    turned = triangles if not joint else triangles @ rotations[k, joint - 1].T + positions[k, joint - 1]
                    _add(ax, turned if joint is None else standing(turned), colour, opacity)
                if not shapes:
                    ax.plot(*chains[k].T, "o-", color="#1f77b4", linewidth=3.0, markersize=5.0)
                equal_axes(ax, seen)
                ax.set_box_aspect((1, 1, 1), zoom=_ZOOM)
                stand_upright(ax, robot)
                ax.set_title(f"{time:.2f} s")
                writer.grab_frame()
    finally:
        plt.close(fig)


#: Triangles (M, 3, 3) [m] in the frame of a joint or of the cell, its number or None, colour and opacity.
_Drawn = tuple[Array, int | None, Any, float]


def _shapes(robot: Robot) -> list[_Drawn]:
    try:
        return [
            (one.vertices[one.triangles], one.joint, tuple(0.85 * value for value in one.colour), 1.0)
            for one in link_shapes(robot, most=_TRIANGLES)
        ]
    except InvalidInputError as error:
        warnings.warn(f"{error}; the arm is drawn as sticks", stacklevel=2)
        return []


def _near(around: Any, middle: Array, extent: float) -> list[Array]:
    """Corners, (N, 3) [m], of what stands no farther from the middle of a motion than twice its length."""
    still = [one for one in around if not one.joint and one.motion is None and not one.endless]
    corners = [one.triangles.reshape(-1, 3) for one in still]
    return [each for each in corners if np.linalg.norm(each - middle, axis=1).max() < 2.0 * extent]


def _placed(around: Any, time: float) -> list[_Drawn]:
    """What stands around at an instant."""
    found = []
    for one in around:
        triangles = one.triangles
        if one.motion is not None:
            (rotation,), (position,) = one.motion.poses(np.array([time]))
            triangles = triangles @ rotation.T + position
        colour = _GROUND if one.endless else _ATTACHED if one.attached else _SOLID
        found.append((triangles, one.joint, colour, 0.25 if one.endless else 0.6))
    return found


def _add(ax: Any, triangles: Array, colour: Any, opacity: float) -> None:
    """Add shaded triangles to axes in space."""
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    across = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    whole = np.linalg.norm(across, axis=1) > 0.0
    ax.add_collection3d(Poly3DCollection(triangles[whole], facecolors=[colour], alpha=opacity, shade=True))
