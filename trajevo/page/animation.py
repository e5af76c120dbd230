"""One motion in space: a page that plays it in real time, or a film of it."""

from __future__ import annotations

from html import escape
from pathlib import Path
from string import Template

from trajevo.base.files import named_file, why_not, write_whole
from trajevo.dynamics.rollout import Rollout, rollout_of
from trajevo.errors import InvalidInputError
from trajevo.front.front import Solution
from trajevo.page.arm import arm
from trajevo.page.members import motions_of, via_times
from trajevo.page.packing import Packed
from trajevo.page.parts import NO_VIEWER, THEME, packed_viewer, scripts_of, static, transport, viewer_licence

#: Endings of films.
FILMS = (".gif", ".mp4")

_SCRIPTS = ("data.js", "canvas.js", "motions.js", "clock.js", "arm.js", "animation.js")


def animate(motion: Solution | Rollout, file: str | Path, *, rate: float | None = None) -> Path:
    """Write the arm's motion in real time: one HTML file that needs no network, or a film.

    Links are drawn by their meshes, simplified, and without any by cylinders: blue where a joint turns, orange where
    it slides. The path of the tool is a line, and via points of a solution are dots. Obstacles are where they stand or
    move, of planes a part, and what is attached moves with its link; loads with a shape are where they are picked up,
    at the tool, and where they are put down. Up is opposite to gravity. A page plays, pauses and shows any instant.

    Args:
        motion: a solution of a front, or the first trajectory of a rollout.
        file: path of the file: a film where it ends in ``.gif`` (by Pillow) or ``.mp4`` (by ffmpeg), else HTML.
        rate: frames per second of a film [1/s], 25 if None; a page shows every instant and takes none.

    Returns:
        Path of the file.

    Raises:
        InvalidInputError: not a motion, a robot without a body, a rate that is not positive, gives too many frames or
            is given for a page, a file that cannot be written, or meshcat or ffmpeg is not installed.
    """
    rollout = rollout_of(motion)
    target = named_file(file)
    rollout.robot.check_body("an animation")
    if target.suffix.lower() in FILMS:
        from trajevo.page.film import write_film  # which draws by matplotlib, and takes long to import

        return write_film(motion, target, rate=25.0 if rate is None else rate)
    if rate is not None:
        raise InvalidInputError(
            f"rate: expected a film, which ends in {' or '.join(FILMS)}, as a page shows every instant, got {file}"
        )
    try:
        write_whole(target, _page(motion, rollout).encode())
    except OSError as error:
        raise InvalidInputError(f"{file}: cannot be written: {why_not(error)}") from error
    return target


def _page(motion: Solution | Rollout, rollout: Rollout) -> str:
    viewer, pack = packed_viewer(), Packed()
    if not viewer:
        raise InvalidInputError(f"animate: {NO_VIEWER} brings it")
    via = via_times(motion.front, motion.x[None], pack) if isinstance(motion, Solution) else None
    data = {
        "robot": rollout.robot.name,
        "members": motions_of(rollout, pack) | {"via": via},
        "arm": arm(motion, rollout, pack),
    }
    duration = f"{float(rollout.trajectory.duration[0]):.3f} s"
    told = f"{motion.front.record.title}, {motion.rule}" if isinstance(motion, Solution) else rollout.robot.name
    return Template(static("page.html")).substitute(
        title=escape(told),
        subtitle=escape(f"{rollout.robot.name}, {duration}"),
        style=static("page.css"),
        theme=THEME,
        connect="",
        explorer=f'<section class="panel alone">{transport()}</section>',
        body='<p class="fallback">This page needs scripts to show the motion.</p>',
        licence=escape(viewer_licence()),
        scripts=scripts_of(_SCRIPTS, data, pack, viewer),
    )
