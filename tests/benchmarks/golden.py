"""Hashes of what trajevo computes, prints and writes: two checkouts agree to the bit where all their hashes do.

Compute them for a checkout and the Python of an environment in which it is installed, then compare two files:

    python golden.py --checkout DIR --python DIR/.venv/bin/python --out hashes.json
    python golden.py --compare before.json after.json

Nothing but the command ``trajevo``, names of the package itself, methods of what they return, and written files are
used, so modules may move between the two. Times, versions and the paths of the machine are left out of every hash.
All of it takes some minutes, more where kernels have to be compiled first. ``--only TEXT`` takes the cases whose name
holds a text, ``--texts FOLDER`` keeps what is hashed as text, to see what differs.
"""

from __future__ import annotations

import argparse
import base64
import contextlib
import csv
import hashlib
import io
import json
import os
import re
import subprocess
import sys
import tempfile
import time
import traceback
import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from importlib.metadata import entry_points
from pathlib import Path
from typing import Any

TASKS = ("ur5_pick_and_place", "panda_six_points", "xarm7_obstacle", "hybrid_manipulator")
ROBOTS = ("feed_drive", "hybrid_manipulator", "pointing_mechanism", "puma560", "ur5", "panda", "xarm7")
FORMATS = ("csv", "json", "feed", "gcode", "ros2", "mujoco", "urscript", "moveit", "netcdf")
INTERPOLANTS = ("cubic", "hybrid", "linear_blends", "polynomial", "quintic_spline", "septic_spline")
STARTS = ("random", "sobol", "latin_hypercube", "stretched", "fastest", "spread")
KINEMATIC = ("time", "acceleration", "jerk", "square_acceleration", "square_jerk", "joint_travel", "tool_path")
DYNAMIC = ("time", "energy", "square_power", "square_effort", "square_effort_rate", "effort_ratio")
LIMITS = ("position", "velocity", "acceleration", "jerk", "effort")

#: Keys of JSON that differ from run to run or from machine to machine.
VOLATILE = frozenset({"seconds", "cpu_seconds", "versions", "folder", "kernels"})

#: Table 1 of Raji 2022, that any robot through any points was given by itself once.
PUMA = {
    "points": [
        list(row)
        for row in (
            (2.57, -0.7873, -1.2022, -3.1416, -1.9895, 0.5716),
            (2.57, -0.1026, -0.5, -3.1416, -0.6026, 0.5716),
            (-0.5716, -0.1026, -0.5, -3.1416, -0.6026, -2.57),
            (-0.5716, -0.7873, -1.2022, -3.1416, -1.9895, -2.57),
        )
    ]
}

#: A UR5 through four points, for the problem "via-points".
UR5: dict[str, Any] = {
    "robot": {"name": "ur5", "tool": "tool0", "limits": {"acceleration": "800 deg/s^2", "jerk": "8000 deg/s^3"}},
    "points": [
        [-0.72, -0.88, 1.46, 0.99, 1.57, 0.85],
        [-0.72, -1.05, 1.24, 1.38, 1.57, 0.85],
        [0.29, -1.05, 1.24, 1.38, 1.57, 1.86],
        [0.29, -0.88, 1.46, 0.99, 1.57, 1.86],
    ],
    "duration_bounds": [0.2, 3.0],
    "objectives": ["time", "energy", "jerk"],
    "constraints": list(LIMITS),
    "payload": {"mass": 3.0, "com": [0.0, 0.0, 0.05]},
}
INERTIA = [[0.02, 0.0, 0.0], [0.0, 0.03, 0.0], [0.0, 0.0, 0.04]]
POST = {"name": "post", "shape": "cylinder", "radius": 0.04, "length": 0.5, "position": [0.7, 0.0, 0.25]}

#: A path of a PUMA 560 in joint space, for the problem "reparam" [rad].
ARM_PATH = [[0.1 * k, -0.8 + 0.05 * k * k, 0.3, 0.2 * k, 0.5, -0.1 * k] for k in range(7)]

#: Arguments of problems whose evaluation is hashed by itself: name -> problem and arguments.
EVALUATED: dict[str, tuple[str, dict[str, Any]]] = {
    **{f"pointing/{name}": ("pointing", {"interpolant": name}) for name in ("smooth", "quintic", "septic_spline")},
    **{
        f"hybrid/{name}": ("hybrid", {"convention": name, "limits": limits})
        for name, limits in (("continuous", "sampled"), ("printed", "certified"), ("as_run", "sampled"))
    },
    "hybrid/unused_payload": ("hybrid", {"objectives": ["time", "energy", "unused_payload"]}),
    "hybrid/cost": ("hybrid", {"objectives": "cost"}),
    "pick-place/septic": ("pick-place", {}),
    "pick-place/quintic_spline": ("pick-place", {"interpolant": "quintic_spline", "overshoot": 0.5, "samples": 9}),
    "pick-place/certified": ("pick-place", {"interpolant": "cubic", "limits": "certified", "payload": 1.0}),
    "reparam/tight": ("reparam", {}),
    "reparam/hull": ("reparam", {"limits": "hull", "path": "s"}),
    "reparam/shape": ("reparam", {"encoding": "shape"}),
    "reparam/linear": ("reparam", {"interpolant": "linear", "quadrature": "trapezoid"}),
    "reparam/arm": (
        "reparam",
        {"path": ARM_PATH, "robot": "puma560", "acceleration": 20.0, "jerk": 200.0, "longest_time": 20.0}
        | {"limits": "certified", "effort": True, "payload": 1.0},
    ),
    "via-points/puma560": ("via-points", PUMA),
    **{f"via-points/{name}": ("via-points", UR5 | {"interpolant": name}) for name in INTERPOLANTS},
    "via-points/kinematic": ("via-points", UR5 | {"objectives": list(KINEMATIC)}),
    "via-points/dynamic": ("via-points", UR5 | {"objectives": list(DYNAMIC), "samples": 9}),
    "via-points/sampled": ("via-points", UR5 | {"limits": "sampled", "constraints": [*LIMITS, "mean_velocity"]}),
    "via-points/limited": (
        "via-points",
        UR5 | {"overshoot": 0.3, "effort_margin": 0.1, "tool_speed": 1.5, "tool_height": 0.05, "longest_time": 6.0},
    ),
    "via-points/moving": (
        "via-points",
        UR5 | {"moving": [{"point": 1, "joints": [0.2] * 6}, {"point": 2, "tool": [0.0, 0.05, 0.05]}]},
    ),
    "via-points/obstacle": ("via-points", UR5 | {"scene": {"clearance": 0.02, "obstacles": [POST]}}),
    "via-points/inertia": ("via-points", UR5 | {"payload": {"mass": 2.0, "inertia": INERTIA}}),
    "via-points/weight_only": ("via-points", UR5 | {"payload": {"mass": 2.0, "model": "weight_only"}}),
    "via-points/tool_axis": ("via-points", UR5 | {"payload": {"mass": 2.0, "model": "tool_axis"}}),
    "via-points/unused_payload": ("via-points", UR5 | {"objectives": ["time", "unused_payload"]}),
    "via-points/threads": ("via-points", UR5 | {"threads": 2}),
}


@dataclass
class Golden:
    """Hashes of one checkout, as they are collected.

    Attributes:
        checkout: the checkout.
        scratch: folder to write into.
        texts: folder in which what is hashed as text is kept, or None.
        hashes: key -> hash.
        prefix: what all keys begin with.
    """

    checkout: Path
    scratch: Path
    texts: Path | None
    hashes: dict[str, str] = field(default_factory=dict)
    prefix: str = ""

    def put(self, key: str, content: bytes) -> None:
        """Hash bytes."""
        key = self.prefix + key
        if key in self.hashes:
            raise ValueError(f"the key {key!r} is there already")
        self.hashes[key] = hashlib.sha256(content).hexdigest()

    def text(self, key: str, text: str) -> None:
        """Hash a text without what differs from run to run."""
        plain = self._plain(text)
        self.put(key, plain.encode())
        if self.texts is not None:
            file = self.texts / re.sub(r"[^A-Za-z0-9._+=-]", "_", self.prefix + key)
            file.with_name(file.name + ".txt").write_text(plain, encoding="utf-8")

    def data(self, key: str, value: Any) -> None:
        """Hash what was read from JSON without what differs from run to run; floats count to the bit."""
        self.text(key, json.dumps(_lasting(value), indent=1, sort_keys=True))

    def array(self, key: str, values: Any) -> None:
        """Hash an array: kind of number, shape and every bit."""
        import numpy as np

        array = np.ascontiguousarray(values)
        self.put(key, f"{array.dtype.str} {array.shape} ".encode() + array.tobytes())

    def front(self, key: str, file: Path) -> None:
        """Hash every part of a front's file."""
        for name, value in json.loads(file.read_text(encoding="utf-8")).items():
            self.data(f"{key}.{name}", value)

    def run(self, key: str, folder: Path) -> None:
        """Hash everything in the folder of a run."""
        for name in ("front", "evolved"):
            if (folder / f"{name}.json").exists():
                self.front(f"{key}/{name}", folder / f"{name}.json")
        if (folder / "manifest.json").exists():
            self.data(f"{key}/manifest", json.loads((folder / "manifest.json").read_text(encoding="utf-8")))
            self._blocks(f"{key}/blocks", folder / "blocks")
            self._checkpoint(f"{key}/checkpoint", folder / "checkpoint.npz")
        if (folder / "report.html").exists():
            self.text(f"{key}/report.html", (folder / "report.html").read_text(encoding="utf-8"))
        self.pictures(key, folder / "plots")

    def pictures(self, key: str, folder: Path) -> None:
        """Hash the pictures in a folder."""
        for file in sorted(folder.glob("*.png")):
            self.put(f"{key}/{file.name}", file.read_bytes())

    def command(self, key: str, *arguments: Any) -> None:
        """Hash what a command prints, on either stream, and its exit code."""
        code, printed, told = _called(self.scratch, *map(str, arguments))
        self.text(f"{key}.printed", f"exit {code}\n{printed}")
        if told:
            self.text(f"{key}.told", told)

    def problem(self, name: str) -> Path:
        """A file that comes with the checkout, by the end of its path: ``tasks/xarm7_obstacle.toml``."""
        names = (
            name,
            name.replace("_pick_and_place.toml", "_algorithms.toml"),
            name.replace(".toml", "_algorithms.toml"),
        )
        places = (f for own in names for depth in ("*", "*/*") for f in self.checkout.glob(f"{depth}/{own}"))
        return next(place for place in places if not place.relative_to(self.checkout).parts[0].startswith("."))

    def _blocks(self, key: str, folder: Path) -> None:
        """How generations are spread over blocks depends on time, what all blocks hold together does not."""
        import numpy as np

        parts: dict[str, list[Any]] = {}
        for file in sorted(folder.glob("*.npz")):
            with np.load(file, allow_pickle=False) as arrays:
                for name, array in arrays.items():
                    parts.setdefault(name, []).append(array)
        for name, arrays in parts.items():
            self.array(f"{key}.{name}", np.concatenate(arrays))

    def _checkpoint(self, key: str, file: Path) -> None:
        import numpy as np

        with np.load(file, allow_pickle=False) as arrays:
            for name, array in arrays.items():
                if name not in ("story", "books.cpu_seconds"):  # times
                    self.array(f"{key}.{name}", array)

    def _plain(self, text: str) -> str:
        for path, name in ((self.scratch, "SCRATCH"), (Path(sys.prefix), "VENV"), (self.checkout, "CHECKOUT")):
            text = text.replace(str(path), name)
        for pattern, name in _PATTERNS:
            text = pattern.sub(name, text)
        return text


def _lasting(value: Any) -> Any:
    """Data without its volatile keys."""
    if isinstance(value, dict):
        return {key: _lasting(entry) for key, entry in value.items() if key not in VOLATILE}
    return [_lasting(entry) for entry in value] if isinstance(value, list) else value


_QUOTE = r"(?:\\?['\"]|&#x27;|&quot;)"
#: Times, versions and places of robots in text, and the room in tables that depends on their digits.
_PATTERNS = tuple(
    (re.compile(pattern), name)
    for pattern, name in (
        (rf"((?:cpu_)?seconds{_QUOTE}: )(?:\[[^\]]*\]|[-+.\de]+)", r"\1TIME"),
        (rf"(versions{_QUOTE}: )\{{[^}}]*\}}", r"\1VERSIONS"),
        (r"CHECKOUT/(?:[\w.-]+/)*(?=robots/)", ""),
        (r"python \d\S*, trajevo [^\n<]*", "VERSIONS"),
        (r"\btrajevo \d+\.\d\S*", "trajevo VERSION"),
        (r"(evaluations(?:</td><td>| +)\d+ in )[\d.]+ s", r"\1TIME"),
        (r"[\d.]+ s of CPU time", "TIME of CPU time"),
        (r"(\d\.\d{5}, \d\.\d{5} +)[\d.]+ s\b", r"\1TIME"),  # of a study's runs
        (r"[─━═]{2,}", "-"),
        (r" {2,}", "  "),
        (r" +\n", "\n"),
    )
)


def _called(folder: Path, *arguments: str) -> tuple[int, str, str]:
    """Run the command in this process, which spares the seconds that a new one takes to start."""
    printed, told, code = io.StringIO(), io.StringIO(), 0
    command = next(iter(entry_points(group="console_scripts", name="trajevo"))).load()
    with (
        contextlib.chdir(folder),
        contextlib.redirect_stdout(printed),
        contextlib.redirect_stderr(told),
        warnings.catch_warnings(),
    ):
        kept, sys.argv = sys.argv, ["trajevo", *arguments]
        warnings.resetwarnings()
        warnings.simplefilter("ignore", DeprecationWarning)
        try:
            command()
        except SystemExit as ended:
            code = ended.code if isinstance(ended.code, int) else int(ended.code is not None)
        finally:
            sys.argv = kept
    return code, printed.getvalue(), told.getvalue()


def evaluation(golden: Golden, name: str) -> None:
    """A problem by itself: its record, and motions, efforts, objectives, limits and gradients of random individuals."""
    import numpy as np

    from trajevo import load_problem

    registered, arguments = EVALUATED[name]
    problem = load_problem(registered, **arguments)
    golden.data(f"evaluation/{name}/settings", json.loads(json.dumps(problem.settings)))
    golden.data(f"evaluation/{name}/constraints", list(problem.constraint_names))
    X = problem.xl + np.random.default_rng(1).random((12, problem.n_var)) * (problem.xu - problem.xl)
    F, G = problem.evaluate(X, return_values_of=["F", "G"])
    rollout = problem.rollout(X)
    motion = rollout.trajectory.sample(25)
    found = {"F": F, "G": G, "t": motion.t, "q": motion.q, "v": motion.v, "a": motion.a, "j": motion.j}
    if rollout.robot.mass > 0.0:
        found["effort"] = rollout.effort
    for key, values in found.items():
        golden.array(f"evaluation/{name}/{key}", values)
    if problem.smooth is None and problem.expansion is None:
        parts = problem.evaluate_with_gradients(X[:3])
        golden.array(f"evaluation/{name}/gradients", np.concatenate([np.ravel(part) for part in parts]))


def solve(golden: Golden, name: str, *options: Any, sizes: tuple[int, int] | None = (6, 12), seed: int = 1) -> Path:
    """A problem or a task solved by the command, with pictures and report; generations and population where wanted."""
    folder = golden.scratch / f"solve {name}"
    what = golden.problem(f"tasks/{name}.toml") if name in TASKS else name.split(" ")[0]
    size = () if sizes is None else ("--generations", sizes[0], "--population", sizes[1])
    golden.command(f"solve/{name}", "solve", what, *size, "--seed", seed, "--out", folder, "--quiet", *options)
    golden.run(f"solve/{name}", folder)
    return folder


def looked_at(golden: Golden, name: str, folder: Path, *, formats: Sequence[str] = FORMATS) -> None:
    """A run looked at by the commands for runs, and exported."""
    golden.command(f"show/{name}", "show", folder, "--angle", "deg")
    for command in ("verify", "certify"):
        golden.command(f"{command}/{name}/knee", command, folder)
        golden.command(f"{command}/{name}/all", command, folder, "--all")
    for format in formats:
        export(golden, f"export/{name}/{format}", folder, "--format", format, "--solution", "knee")
    export(golden, f"export/{name}/csv, deg", folder, "--format", "csv", "--angle", "deg", "--solution", "least_time")
    export(golden, f"export/{name}/netcdf, all", folder, "--format", "netcdf")


def export(golden: Golden, key: str, folder: Path, *options: str) -> None:
    """One exported file; where the format refuses the run, what is said."""
    file = golden.scratch / "exported"
    file.unlink(missing_ok=True)
    golden.command(key, "export", folder, *options, "--out", file)
    if file.exists() and file.read_bytes().startswith(b"\x89HDF"):
        golden.text(key, _netcdf_as_text(file))
    elif file.exists():
        golden.text(key, file.read_text(encoding="utf-8"))


def _netcdf_as_text(file: Path) -> str:
    """Attributes, dimensions and values of a netCDF file; how its bytes lie is the library's affair."""
    import netCDF4
    import numpy as np

    lines = []
    with netCDF4.Dataset(file) as content:
        content.set_auto_mask(False)
        lines += [f"{name} = {len(dimension)}" for name, dimension in content.dimensions.items()]
        holders: dict[str, Any] = {"": content, **content.variables}
        for name, holder in holders.items():
            lines += [f"{name}:{key} = {holder.getncattr(key)!r}" for key in holder.ncattrs()]
        for name, variable in content.variables.items():
            digest = hashlib.sha256(np.ascontiguousarray(variable[...]).tobytes()).hexdigest()
            lines.append(f"{name}{variable.dimensions} {variable.dtype} {digest}")
    return "\n".join(lines)


def pointing(golden: Golden) -> None:
    """The pointing mechanism, with polish and without."""
    solve(golden, "pointing polished", sizes=(10, 20))
    folder = solve(golden, "pointing", "--no-polish", "--offsprings", 7, seed=2)
    looked_at(golden, "pointing", folder)
    golden.command("polish/pointing", "polish", folder, "--members", 4, "--rounds", 1)
    golden.run("polish/pointing", folder)
    animation(golden, "pointing", folder)


def ur5(golden: Golden) -> None:
    """The UR5's task, and everything about payloads."""
    folder = solve(golden, "ur5_pick_and_place", "--no-polish")
    looked_at(golden, "ur5", folder)
    payloads(golden, "ur5", folder)
    animation(golden, "ur5", folder)


def payloads(golden: Golden, name: str, folder: Path) -> None:
    """What the commands tell and draw of a motion's payload."""
    golden.command(f"capacity/{name}", "capacity", folder)
    golden.command(f"capacity/{name}/iterative", "capacity", folder, "--iterative", "--solution", "least_time")
    several = ("--solution", "knee", "--solution", "least_time", "--grid", 5)
    drawn = {
        "slowdown": ("slowdown", folder, "--payload", 3.5),
        "slowdown, own": ("slowdown", folder, "--solution", "least_time"),
        "diagram": ("payload-diagram", folder, "--grid", 9, "--tolerance", 0.02),
        "diagrams": ("payload-diagram", folder, "--direction", 30, *several),
        "time": ("payload-time", folder, "--payload", 1, "--payload", 3, "--starts", 1, "--tolerance", 0.02),
    }
    for key, command in drawn.items():
        out = golden.scratch / f"{key}.png"
        golden.command(f"payload/{name}/{key}", *command, "--out", out)
        for file in sorted(golden.scratch.glob(f"{key}*.png")):
            golden.put(f"payload/{name}/{file.name}", file.read_bytes())
            file.unlink()


def workspace(golden: Golden) -> None:
    """Capacity over a plane of tool positions."""
    turned = ("--rpy", 3.14, 0.0, 0.0, "--acceleration", 0.0, 0.0, 1.0)
    asked: dict[str, tuple[Any, ...]] = {
        "ur5": ("--tool", "tool0", "--position", 0.3, 0.0, 0.4, *turned),
        "puma560": ("--position", 0.5, 0.0, 0.3, "--show", "joint"),
    }
    for robot, options in asked.items():
        out = golden.scratch / f"{robot}.png"
        given = (robot, *options, "--reach", 0.4, "--cells", 5, "--out", out)
        golden.command(f"workspace/{robot}", "workspace-capacity", *given)
        golden.put(f"workspace/{robot}.png", out.read_bytes())


def animation(golden: Golden, name: str, folder: Path) -> None:
    """An animated motion; meshcat gives what it draws random names."""
    file = golden.scratch / "animation.html"
    golden.command(f"animate/{name}", "animate", folder, "--rate", 5, "--out", file)
    commands = re.findall(rb'^"([A-Za-z0-9+/=]+)",?$', file.read_bytes(), re.MULTILINE)
    names = re.compile(rb"[0-9a-f]{8}(?:-[0-9a-f]{4}){3}-[0-9a-f]{12}")
    golden.put(f"animate/{name}", b"\n".join(names.sub(b"NAME", base64.b64decode(command)) for command in commands))


def hybrid(golden: Golden) -> None:
    """The hybrid manipulator: a transmission, forces and four objectives."""
    folder = solve(golden, "hybrid", "--convention", "printed", "--evaluations", 2000)
    golden.command("capacity/hybrid", "capacity", folder, "--solution", "weighted")
    golden.command("diagram/hybrid", "payload-diagram", folder, "--grid", 5, "--out", golden.scratch / "hybrid.png")
    golden.command("verify/hybrid", "verify", folder, "--solution", "weighted", "--density", 5)
    for format in ("csv", "ros2", "mujoco", "moveit"):
        export(golden, f"export/hybrid/{format}", folder, "--format", format, "--step", "0.02")


def pick_place(golden: Golden) -> None:
    """The PUMA 560, whose report compares interpolants."""
    folder = solve(golden, "pick-place", "--payload", 2.0, "--limits", "certified")
    golden.command("certify/pick-place", "certify", folder, "--solution", "utopia", "--power", 500)
    golden.command("slowdown/pick-place", "slowdown", folder, "--out", golden.scratch / "slowdown.png")


def reparam(golden: Golden) -> None:
    """A fixed path: evolution, expansion, normal constraints and seeds by them."""
    folder = solve(golden, "reparam", "--set", "control_points=8", "--polish-every", 3)
    looked_at(golden, "reparam", folder, formats=("csv", "json", "feed", "gcode"))
    solve(golden, "reparam shape", "--encoding", "shape", "--path", "s", "--limits", "hull")
    few = ("--set", "control_points=8")
    solve(golden, "reparam nnc", "--method", "nnc", "--tolerance", 0.3, *few, sizes=None, seed=3)
    solve(golden, "reparam sqp_seeds", "--sqp-seeds", 3, "--no-polish", *few)
    solve(golden, "reparam certified", "--limits", "certified", "--set", "velocity=120 mm/s", *few, "--no-polish")


def panda(golden: Golden) -> None:
    """The Panda's task, by the package."""
    _task(golden, "panda_six_points", generations=4, population=10)


def ur5_polished(golden: Golden) -> None:
    """The UR5's task, polished to the end."""
    _task(golden, "ur5_pick_and_place", generations=4, population=10)


def xarm7(golden: Golden) -> None:
    """Around an obstacle."""
    _task(golden, "xarm7_obstacle", generations=3, population=8, polish=False)


def hybrid_task(golden: Golden) -> None:
    """The hybrid manipulator as a task."""
    _task(golden, "hybrid_manipulator", generations=5, population=12)


def _task(golden: Golden, name: str, **sizes: Any) -> None:
    from trajevo import load_task

    folder = golden.scratch / f"task {name}"
    load_task(golden.problem(f"tasks/{name}.toml")).solve(**sizes, out=folder, progress=False)
    golden.run(f"task/{name}", folder)
    golden.command(f"verify/{name}", "verify", folder)
    golden.command(f"certify/{name}", "certify", folder)


def optimised(golden: Golden) -> None:
    """Settings of :func:`trajevo.optimise` that no command has, and algorithms of pymoo as they are."""
    from pymoo.algorithms.moo.ctaea import CTAEA
    from pymoo.algorithms.moo.nsga2 import NSGA2
    from pymoo.algorithms.moo.sms import SMSEMOA
    from pymoo.operators.crossover.sbx import SBX
    from pymoo.util.ref_dirs import get_reference_directions

    from trajevo import load_problem

    puma = PUMA | {"objectives": ["time", "jerk", "joint_travel"]}
    pointing, via_points = load_problem("pointing"), load_problem("via-points", **puma)
    stock = NSGA2(pop_size=10, crossover=SBX(prob=0.7, eta=9.0))
    first = _optimise(golden, "pymoo NSGA2", pointing, algorithm=stock)
    along = get_reference_directions("das-dennis", 3, n_partitions=3)
    _optimise(golden, "pymoo CTAEA", pointing, algorithm=CTAEA(ref_dirs=along))
    _optimise(golden, "pymoo SMSEMOA", via_points, algorithm=SMSEMOA(pop_size=10))
    _optimise(golden, "initial", pointing, initial=first, population=12, mutation_probability=0.3, crossover_index=10.0)
    _optimise(golden, "time_limit", pointing, time_limit=20.0, population=8)
    _optimise(golden, "one objective", load_problem("hybrid", objectives="cost"), population=8)


def _optimise(golden: Golden, name: str, problem: Any, *, generations: int = 4, **settings: Any) -> Any:
    from trajevo import optimise

    folder = golden.scratch / f"optimise {name}"
    settings = {"polish": False, "seed": 5} | settings
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # an algorithm that cannot be resumed is told of
        front = optimise(problem, generations=generations, out=folder, progress=False, **settings)
    golden.run(f"optimise/{name}", folder)
    return front


def resumed(golden: Golden) -> None:
    """Runs that end early and are gone on with."""
    from trajevo import load_problem, optimise, read_run, resume

    for name, polish in (("pointing", True), ("via-points", False)):
        folder = golden.scratch / f"resumed {name}"
        sizes: dict[str, Any] = {"seed": 3, "population": 10, "polish": polish, "polish_every": 2, "progress": False}
        own = PUMA if name == "via-points" else {}
        optimise(load_problem(name, **own), generations=3, out=folder, **sizes)
        resume(folder, generations=6, progress=False)
        golden.run(f"resumed/{name}", folder)
        read_run(folder).save(folder / "read.json")
        golden.front(f"resumed/{name}/read", folder / "read.json")
        (folder / "plots").mkdir()  # as `trajevo solve` would have left it
        golden.command(f"resumed/{name}", "resume", folder, "--generations", 8, "--quiet")
        golden.run(f"resumed/{name}/longer", folder)


def shipped_study(golden: Golden, name: str) -> None:
    """A study that comes with the problems, its runs made small: algorithms, with and without polish, by starts."""
    file = golden.problem(f"studies/{name}.toml")
    text = file.read_text(encoding="utf-8")
    for pattern, value in (
        (r"^repeats = \d+", "repeats = 1"),
        (r"^population = \d+", "population = 12"),
        (r"^evaluations = \d+", "evaluations = 160"),
        (r'^task = "(.*\.toml)"', rf'task = "{file.parent.as_posix()}/\1"'),
    ):
        text = re.sub(pattern, value, text, flags=re.MULTILINE)
    study(golden, name, text)


def settings_study(golden: Golden) -> None:
    """First populations, the other algorithms, and settings of the search as factors; all of it collected."""
    text = 'problem = "pointing"\nseed = 4\nrepeats = 2\npopulation = 10\ngenerations = 4\n[factors]\n'
    kinds = {
        "starts": f"starts = {json.dumps(STARTS)}\n[fixed]\nevaluations = 300\n",
        "others": 'algorithm = ["u-nsga3", "spea2"]\noffsprings = [5, 10]\n[fixed]\npolish = false\n',
        "operators": "crossover_index = [5.0, 30.0]\nmutation_probability = [0.1, 0.9]\n[fixed]\npolish_every = 2\n",
    }
    for name, more in kinds.items():
        folder = study(golden, name, text + more)
        golden.command(f"study/{name}/collect", "study", "collect", folder)
        golden.text(f"study/{name}/results.csv", _without_times((folder / "results.csv").read_text(encoding="utf-8")))
        golden.put(f"study/{name}/comparisons.csv", (folder / "comparisons.csv").read_bytes())
        golden.pictures(f"study/{name}", folder / "plots")


def _without_times(table: str) -> str:
    """A table of comma-separated values without its columns of seconds."""
    rows = list(csv.reader(io.StringIO(table)))
    kept = [k for k, header in enumerate(rows[0]) if "seconds" not in header]
    return "\n".join(",".join(row[k] for k in kept) for row in rows)


def interpolants(golden: Golden) -> None:
    """Every interpolant on the UR5, polished within a budget."""
    content = f'"{golden.problem("tasks/ur5_pick_and_place.toml").as_posix()}"'
    text = f"task = {content}\nseed = 2\nrepeats = 1\npopulation = 8\ngenerations = 3\n[fixed]\nevaluations = 200\n"
    # Blends pass nearby and points of a single polynomial swing: only what all of them have.
    text += f"moving = []\nobjectives = {json.dumps(['time', 'square_jerk'])}\n[factors]\n"
    study(golden, "interpolants", text + f"interpolant = {json.dumps(INTERPOLANTS)}\n")


def study(golden: Golden, name: str, text: str) -> Path:
    """A study run cell after cell."""
    folder, file = golden.scratch / f"study {name}", golden.scratch / f"{name}.toml"
    file.write_text(text, encoding="utf-8")
    golden.command(f"study/{name}/run", "study", "run", file, "--out", folder, "--quiet")
    golden.data(f"study/{name}/study", json.loads((folder / "study.json").read_text(encoding="utf-8")))
    for cell in sorted((folder / "cells").iterdir()):
        golden.run(f"study/{name}/{cell.name}", cell)
    return folder


def robots(golden: Golden) -> None:
    """Robots by themselves, and the lists of the command line."""
    import numpy as np

    from trajevo import load_robot

    for name in ROBOTS:
        golden.command(f"robot/{name}", "check-robot", name)
        lock = {"panda_finger_joint1": 0.02, "panda_finger_joint2": 0.02} if name == "panda" else {}
        free = {"acceleration": float("inf"), "jerk": float("inf")}
        own = name in ("ur5", "panda", "xarm7")  # of example-robot-data, which limits less
        tool = {"ur5": "tool0", "panda": "panda_hand_tcp"}.get(name)
        robot = load_robot(name, lock=lock, tool=tool, limits=free if own else None)
        for key, values in vars(robot.limits).items():
            golden.array(f"robot/{name}/{key}", values)
        q = np.random.default_rng(2).uniform(-0.5, 0.5, (5, robot.dof))
        for key, values in zip(("position", "rotation"), robot.tool_poses(q), strict=True):
            golden.array(f"robot/{name}/{key}", values)
    file = golden.scratch / "example.toml"
    golden.command("init", "init", file)
    golden.put("init", file.read_bytes())
    # Where classes are is what may change.
    _, printed, _ = _called(golden.scratch, "list")
    golden.text("list", re.sub(r"\S+:(?=[A-Z])|│ +│|\s+", " ", printed))


def installed(golden: Golden) -> None:
    """The command as it is installed, in processes of its own."""
    command = Path(sys.executable).parent / "trajevo"
    run = golden.scratch / "installed"
    solved = ("solve", "pointing", "--generations", "3", "--population", "8", "--out", str(run), "--quiet")
    helps = {" ".join(words): (*words, "--help") for words in _COMMANDS}
    for key, arguments in {"version of help": ("--help",), "solve": solved, "missing": ("show", "nowhere")}.items():
        done = subprocess.run([str(command), *arguments], cwd=golden.scratch, capture_output=True, text=True)
        golden.text(f"installed/{key}", f"exit {done.returncode}\n{done.stdout}\n{done.stderr}")
    golden.run("installed/solve", run)
    for key, arguments in helps.items():
        golden.command(f"help/{key}", *arguments)


_COMMANDS = (
    *((name,) for name in ("list", "check-robot", "init", "solve", "resume", "polish", "study", "show", "report")),
    *((name,) for name in ("verify", "certify", "export", "animate", "capacity", "slowdown", "workspace-capacity")),
    *((name,) for name in ("payload-diagram", "payload-time")),
    *(("study", name) for name in ("run", "status", "collect")),
)

#: What is hashed, by name, with numba; each case is independent of the others.
CASES: dict[str, Callable[[Golden], Any]] = {
    "robots": robots,
    **{f"evaluation {name}": partial(evaluation, name=name) for name in EVALUATED},
    **{
        f"study {name}": partial(shipped_study, name=name)
        for name in ("pointing", "hybrid", "pick_place", "reparam", "ur5_pick_and_place")
    },
    "study of settings": settings_study,
    "interpolants": interpolants,
    "optimised": optimised,
    "resumed": resumed,
    "panda": panda,
    "ur5 polished": ur5_polished,
    "xarm7": xarm7,
    "hybrid task": hybrid_task,
    "pointing": pointing,
    "hybrid": hybrid,
    "pick-place": pick_place,
    "reparam": reparam,
    "ur5": ur5,
    "workspace": workspace,
    "installed": installed,
}

#: What is hashed again as where numba is not installed.
WITHOUT_NUMBA = (
    *(name for name in CASES if name.startswith("evaluation ")),
    "interpolants",
    "resumed",
    "panda",
    "ur5 polished",
    "hybrid task",
)


def compute(checkout: Path, names: Iterable[str], *, numba: bool, texts: Path | None) -> dict[str, str]:
    """Hashes of cases in this process.

    Raises:
        SystemExit: the installed package is not that of the checkout.
    """
    # Whatever is ready, also in processes that the commands start.
    os.environ["TRAJEVO_KERNELS"] = "compiled" if numba else "numpy"
    if not numba:
        sys.modules["numba"] = None  # type: ignore[assignment]
    import trajevo

    if not Path(str(trajevo.__file__)).resolve().is_relative_to(checkout):
        sys.exit(f"{sys.executable} has trajevo from {trajevo.__file__}, not from {checkout}")
    hashes: dict[str, str] = {}
    for name in names:
        began = time.perf_counter()
        with tempfile.TemporaryDirectory(prefix="golden-") as scratch:
            golden = Golden(checkout, Path(scratch).resolve(), texts, prefix="" if numba else "without numba/")
            try:
                CASES[name](golden)
            except Exception as error:  # noqa: BLE001 - it counts as a difference, the other cases go on
                traceback.print_exc()
                golden.hashes[f"{golden.prefix}{name}/failed"] = repr(error)
        twice = hashes.keys() & golden.hashes.keys()
        if twice:
            raise ValueError(f"keys of {name!r} are there already: {sorted(twice)}")
        hashes |= golden.hashes
        print(f"{time.perf_counter() - began:7.2f} s  {golden.prefix}{name}", file=sys.stderr, flush=True)
    return hashes


def compute_all(checkout: Path, python: Path, *, only: str, texts: Path | None) -> dict[str, str]:
    """Hashes of all cases, with numba and without, each in a process of the given Python."""
    hashes: dict[str, str] = {}
    # One thread, plain text as wide as it gets, no pictures on a screen.
    fixed = {"COLUMNS": "20000", "TERM": "dumb", "NO_COLOR": "1", "MPLBACKEND": "Agg", "TZ": "UTC"}
    fixed |= dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
    for how in ("with", "without"):
        with tempfile.TemporaryDirectory(prefix="golden-") as folder:
            out = Path(folder) / "hashes.json"
            given = ["--checkout", checkout, "--numba", how, "--out", out, "--only", only]
            given += [] if texts is None else ["--texts", texts]
            # -P: what lies beside this file is not to be imported.
            command = [str(python), "-P", str(Path(__file__).resolve()), *map(str, given)]
            subprocess.run(command, env=os.environ | fixed, check=True)
            hashes |= json.loads(out.read_text(encoding="utf-8"))
    return hashes


def compare(before: Mapping[str, str], after: Mapping[str, str]) -> int:
    """Print every key that differs, or how many are equal; the exit code."""
    differing = sorted(key for key in {*before, *after} if before.get(key) != after.get(key))
    for key in differing:
        why = "differs" if key in before and key in after else "is missing " + ("now" if key in before else "before")
        print(f"{key}: {why}")
    print(f"{len({*before, *after}) - len(differing)} equal, {len(differing)} not")
    return 1 if differing else 0


def main() -> int:
    """Entry point."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--checkout", type=Path, help="folder of the checkout")
    parser.add_argument("--python", type=Path, help="Python of the environment in which it is installed")
    parser.add_argument("--out", type=Path, help="file for the hashes")
    parser.add_argument("--only", default="", help="cases whose name holds this text")
    parser.add_argument("--texts", type=Path, help="folder that keeps what is hashed as text")
    parser.add_argument("--numba", choices=("with", "without"), help=argparse.SUPPRESS)
    parser.add_argument("--compare", nargs=2, type=Path, metavar="FILE", help="files of hashes to compare")
    given = parser.parse_args()
    if given.compare:
        before, after = (json.loads(file.read_text(encoding="utf-8")) for file in given.compare)
        return compare(before, after)
    if given.checkout is None or given.out is None or (given.python is None and given.numba is None):
        parser.error("expected --checkout, --python and --out, or --compare")
    checkout, texts = given.checkout.resolve(), given.texts
    if texts is not None:
        texts.mkdir(parents=True, exist_ok=True)
    if given.numba is None:
        hashes = compute_all(checkout, given.python.absolute(), only=given.only, texts=texts)
    else:
        numba = given.numba == "with"
        names = [name for name in (CASES if numba else WITHOUT_NUMBA) if given.only in name]
        hashes = compute(checkout, names, numba=numba, texts=texts)
    given.out.write_text(json.dumps(hashes, indent=1, sort_keys=True) + "\n", encoding="utf-8")
    failed = [key for key in hashes if key.endswith("/failed")]
    if given.numba is None:
        print(f"{len(hashes)} hashes, {len(failed)} cases failed")
    return 1 if failed and given.numba is None else 0


if __name__ == "__main__":
    sys.exit(main())
