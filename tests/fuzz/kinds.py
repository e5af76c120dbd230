"""Kinds of files that strangers may send, and what trajevo does with each."""

from __future__ import annotations

import io
import json
import os
import re
import shutil
import struct
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from random import Random

import numpy as np

from tests.formulation.test_scene_files import NEW, OLD, WORLD
from trajevo import Front, ViaPoints, load_problem, load_robot, load_task, optimise
from trajevo.base.files import SCRATCH
from trajevo.cli.console import Terminal
from trajevo.cli.proof.command import print_proof
from trajevo.cli.results import clear_stale
from trajevo.cli.screen.printed import print_examination, print_run
from trajevo.dynamics.inverse_dynamics import Dynamics
from trajevo.dynamics.rollout import Rollout
from trajevo.exporters.export import export, is_exported
from trajevo.formulation.constraints.collision import Collision
from trajevo.formulation.constraints.scene import Scene, Sphere
from trajevo.formulation.constraints.solids import solid_of
from trajevo.formulation.feasibility.check import check
from trajevo.path.tables import read_table
from trajevo.path.via_points import joint_points
from trajevo.plots.analyses import analyse
from trajevo.plots.pictures import Picture, save_pictures
from trajevo.robot.examine import examine
from trajevo.solvers.run.folder import RunFolder
from trajevo.solvers.run.runs import read_run, resume, standing
from trajevo.study import Study, collect, load_study, study_standing
from trajevo.study.folder import StudyFolder
from trajevo.trajectory.interpolants import QuinticSpline
from trajevo.verification.certify import certify
from trajevo.verification.check_proof import check as check_proof
from trajevo.verification.proof_file import digest

LIMITS = {"acceleration": 10.0, "jerk": 100.0}


@dataclass(frozen=True)
class Kind:
    """A kind of file.

    Attributes:
        name: its name.
        target: the file that is mutated, in the folder of an input.
        seeds: whole files of this kind.
        beside: other files of the folder, by name; may have folders.
        read: what trajevo does with the folder.
        written: whether it writes there too, so that links are planted.
    """

    name: str
    target: str
    seeds: tuple[bytes, ...]
    beside: dict[str, bytes]
    read: Callable[[Path], object]
    written: bool = False

    def lay(self, folder: Path, content: bytes) -> None:
        """Make the folder hold this input and nothing else."""
        for entry in folder.iterdir():
            if entry.is_dir() and not entry.is_symlink():
                shutil.rmtree(entry)
            else:
                entry.unlink()
        for name, data in {**self.beside, self.target: content}.items():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_bytes(data)


#: Names that a run writes, at which a stranger may have put a link.
PLANTED = (
    "front.json", f"front.json{SCRATCH}", "manifest.json", f"manifest.json{SCRATCH}", "checkpoint.npz", "evolved.json",
    "blocks", "plots", "plots/front.png", ".lock", ".writable", "knee.csv", f"knee.csv{SCRATCH}", "knee.html",
    "report.html", "front.analyses.npz", "cells", "study.json",
)  # fmt: skip


def plant(folder: Path, outside: Path, random: Random) -> None:
    """Put a link to something outside, a pipe or a folder where a file may be written."""
    place = folder / random.choice(PLANTED)
    place.parent.mkdir(exist_ok=True)
    if place.is_dir() and not place.is_symlink():
        shutil.rmtree(place)
    place.unlink(missing_ok=True)
    match random.randrange(6):
        case 0 | 1:
            place.symlink_to(outside / "file")
        case 2:
            place.symlink_to(outside)
        case 3:
            place.symlink_to(random.choice(("/dev/zero", "/dev/stdin", "missing", str(place))))
        case 4:
            os.mkfifo(place)
        case _:
            place.mkdir()


@cache
def _run(folder: Path) -> dict[str, bytes]:
    """The files of a short run, by their names."""
    problem = load_problem("pointing")
    optimise(problem, population=12, generations=4, seed=1, polish=False, out=folder / "run", progress=False)
    files = sorted(file for file in (folder / "run").rglob("*") if file.is_file() and file.name != ".lock")
    return {str(file.relative_to(folder / "run")): file.read_bytes() for file in files}


def _say(front: Front) -> None:
    print_run(_silent(), front)


def _silent() -> Terminal:
    terminal = Terminal()
    terminal.file = io.StringIO()
    return terminal


def _read_front(folder: Path) -> None:
    front = Front.load(folder / "front.json")
    _say(front)
    clear_stale(folder)
    front.save(folder / "front.json")
    save_pictures((Picture("front", "front", b"picture"),), folder / "plots")
    if len(front):
        knee = front.knee()
        for format_ in ("csv", "ros2"):
            export(knee, folder / f"knee.{format_}", format=format_)


def _read_run(folder: Path) -> None:
    standing(folder)
    _say(read_run(folder))


def _go_on(folder: Path) -> None:
    """Read a run, and resume it for one more generation."""
    front = read_run(folder)
    _say(front)
    _say(resume(folder, generations=5, progress=False))
    RunFolder(folder).keep(front)


def _read_analyses(folder: Path) -> None:
    analyse(Front.load(folder / "front.json"), "none", file=folder / "front.analyses.npz")


def _read_task(folder: Path) -> None:
    check(load_task(folder / "task.toml").problem)


def _read_study(folder: Path) -> None:
    study_standing(folder)
    try:
        collect(folder)
    except ValueError as error:
        if "no cell" not in str(error):
            raise
    Study.of(StudyFolder(folder).record())


def _read_robot(name: Path) -> None:
    print_examination(_silent(), examine(name))
    more = {"velocity": 2.0, "effort": 90.0} if name.suffix == ".xml" else {}
    bare = {} if name.is_dir() else {"limits": LIMITS | more}
    robot = load_robot(name, **bare)
    robot.tool_poses(np.zeros((2, robot.dof)))


def _read_points(folder: Path) -> None:
    robot = load_robot(folder / "two.urdf", limits=LIMITS)
    try:
        read_table(folder / "points.csv")
    finally:
        joint_points(folder / "points.csv", robot)


def _read_netcdf(folder: Path) -> None:
    is_exported(folder / "front.nc")
    clear_stale(folder)


def _read_mesh(folder: Path) -> None:
    robot = load_robot(folder / "two.urdf", limits=LIMITS)
    Collision(robot, Scene((Sphere(position=(1.0, 1.0, 1.0), radius=0.1),))).distances(np.zeros((2, robot.dof)))


def _read_proof(folder: Path) -> None:
    """Check a proof file, and once more with the digest that belongs to its content."""
    file = folder / "motion.proof.json"
    try:
        print_proof(_silent(), file)
    finally:
        with suppress(ValueError, RecursionError):  # no JSON, or refused
            data = json.loads(file.read_bytes())
            if isinstance(data, dict):
                data.pop("digest", None)
                check_proof(json.dumps(data | {"digest": digest(data)}).encode())


def _read_scene(folder: Path) -> None:
    for obstacle in Scene.read(folder / "cell.scene").obstacles:
        solid_of(obstacle)


URDF = """<?xml version="1.0"?>
<robot name="two">
  <link name="base"/>
  <link name="l1"><inertial><origin xyz="0.2 0 0" rpy="0 0 0"/><mass value="2.0"/>
    <inertia ixx="0.01" ixy="0" ixz="0" iyy="0.03" iyz="0" izz="0.03"/></inertial>%s</link>
  <link name="l2"><inertial><origin xyz="0.2 0 0"/><mass value="1.0"/>
    <inertia ixx="0.01" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.02"/></inertial></link>
  <joint name="a" type="revolute"><parent link="base"/><child link="l1"/><origin xyz="0 0 0.1"/><axis xyz="0 1 0"/>
    <limit lower="-2" upper="2" velocity="2" effort="60"/></joint>
  <joint name="b" type="prismatic"><parent link="l1"/><child link="l2"/><origin xyz="0.4 0 0" rpy="0 0 0.1"/>
    <axis xyz="1 0 0"/><limit lower="-0.5" upper="0.5" velocity="1" effort="40"/></joint>
</robot>
"""
MJCF = """<mujoco model="two">
  <compiler angle="degree" meshdir="meshes"/>
  <option gravity="0 0 -9.81"/>
  <default>
    <joint damping="0.5" armature="0.1"/>
    <default class="b"><joint axis="0 1 0" range="-90 90"/></default>
  </default>
  <asset><mesh name="m" file="m.stl"/></asset>
  <worldbody>
    <geom type="plane" size="1 1 1"/>
    <body name="base" pos="0 0 0.1" euler="0 0 30">
      <body name="l1" childclass="b">
        <joint name="a" ref="10" pos="0.01 0 0"/>
        <inertial mass="2" pos="0.2 0 0" quat="1 0.1 0 0" diaginertia="0.01 0.03 0.03"/>
        <geom type="capsule" fromto="0 0 0 0.4 0 0" size="0.05"/>
        <frame axisangle="1 0 0 20"><body name="l2" xyaxes="0 1 0 -1 0 0" pos="0.4 0 0">
          <joint name="b" type="slide" axis="1 0 0" range="-0.5 0.5" frictionloss="1"/>
          <joint name="c"/>
          <geom type="box" size="0.1 0.1 0.1" mass="1"/>
          <site name="tip" pos="0.2 0 0"/>
        </body></frame>
      </body>
    </body>
  </worldbody>
  <equality><joint joint1="c" joint2="a" polycoef="0.1 0.5"/></equality>
  <actuator>
    <motor name="drive" joint="a" gear="50" ctrlrange="-2 2"/>
    <position joint="b" forcerange="-40 40"/>
  </actuator>
</mujoco>
"""
_COLLISION = '<collision><origin xyz="0.1 0 0"/><geometry>%s</geometry></collision>'
PLAIN = (URDF % (_COLLISION % '<box size="0.2 0.1 0.1"/>')).encode()

ROBOT_TOML = """format = 1
name = "two"
urdf = "two.urdf"
tool = "l2"
reference = "made up"
gravity = { vector = [0.0, 0.0, -9.80665], unit = "m/s^2" }

[joints.a]
position = { lower = -90.0, upper = 90.0, unit = "deg" }
velocity = { limit = 2.0, unit = "rad/s" }
acceleration = { limit = 10.0, unit = "rad/s^2" }
jerk = { limit = inf, unit = "rad/s^3" }
effort = { limit = 60.0, unit = "N*m" }
viscous_friction = { value = 0.1, unit = "N*m*s/rad" }
coulomb_friction = { forward = 0.1, backward = 0.2, unit = "N*m" }

[joints.b]
position = { lower = -500.0, upper = 500.0, unit = "mm" }
velocity = { limit = 1.0, unit = "m/s" }
acceleration = { limit = 10.0, unit = "m/s^2" }
jerk = { limit = 100.0, unit = "m/s^3" }
effort = { limit = inf, unit = "N" }
"""

TASK = """format = 1
angle = "deg"
points = [[0.0, 0.0], [30.0, 0.2], { joints = [60.0, 0.1] }]
duration_bounds = [0.3, 4.0]
interpolant = "quintic_spline"
objectives = ["time", "energy"]
seed = 1
samples = 6

[robot]
name = "two.urdf"
tool = "l2"

[limits]
acceleration = { a = "600 deg/s^2", b = 10.0 }
jerk = { a = 100.0, b = "100 m/s^3" }
position = [[-1.5, 1.5], ["-300 mm", 0.4]]

[payload]
mass = 1.0
com = [0.0, 0.0, 0.05]
inertia = [[0.01, 0, 0], [0, 0.01, 0], [0, 0, 0.01]]

[constraints]
limits = ["position", "velocity", "acceleration", "effort"]
effort_margin = 0.1
tool_speed = 2.0
held = "sampled"

[scene]
clearance = 0.01
[[scene.obstacles]]
name = "post"
shape = "cylinder"
radius = 0.05
length = 0.8
position = [1.4, 1.3, 0.4]

[[moving]]
point = 1
joints = [5.0, 0.05]

[algorithm]
name = "nsga2"
population = 12
generations = 4
"""
LOADS = """[[payload]]
mass = 1.0
com = [0.0, 0.0, 0.05]
touches = ["post"]
shape = { shape = "sphere", radius = 0.02 }

[[payload]]
mass = "500 g"
from = 1
to = 2
vary = true

[constraints]"""
SEGMENTS = """[[segment]]
from = 0
to = 1
tool = "line"
tolerance = "2 mm"
rest = "start"

[[segment]]
from = 0
to = 2
upright = 80.0
axis = "z"

[algorithm]"""
TASK_WITH_SEGMENTS = re.sub(
    r"\[\[moving\]\].*?\[algorithm\]", SEGMENTS, TASK.replace("[30.0, 0.2]", "[3.0, 0.02]"), count=1, flags=re.DOTALL
)
TASK_WITH_LOADS = re.sub(r"\[payload\].*?\[constraints\]", LOADS, TASK, count=1, flags=re.DOTALL)
TASK_FILE_POINTS = TASK.replace("[[0.0, 0.0], [30.0, 0.2], { joints = [60.0, 0.1] }]", '"points.csv"')

STUDY = """problem = "pointing"
seed = 3
repeats = 2
population = 12
generations = 4
[factors]
offsprings = [8, { label = "many", value = 24 }]
algorithm = ["nsga2", "nsga3"]
[fixed]
polish = false
"""
STUDY_OF_TASK = """task = "task.toml"
seed = 3
repeats = 1
[factors]
"payload.mass" = [0.5, 1.5]
"""

JOINT_LIMITS = b"""# MoveIt
default_velocity_scaling_factor: 0.5
default_acceleration_scaling_factor: 1.0
joint_limits:
  a:
    {has_velocity_limits: true, max_velocity: 1.0,
     has_acceleration_limits: true, max_acceleration: 2.5,
     has_jerk_limits: true, max_jerk: 1.0e+2}
  b:
    has_velocity_limits: true
    max_velocity: 0.5
    has_acceleration_limits: true
    max_acceleration: 3
    has_jerk_limits: false
  # free text
    has_position_limits: true
    min_position: -0.1
    max_position: 0.2
"""

POINTS = (
    b"# points\na [rad],b [mm]\n0.0,0.0\n0.4,100\n-0.5,50.5\n",
    b"x [m],y [m],z [m]\n0.4,0,0.1\n0.4995004,0.00998334,0.1\n",
    b"x [mm],y [mm],z [mm],roll [deg],pitch [deg],yaw [deg]\n400,0,100,0,0,5.729578\n"
    b"449.7502,4.99167,100,0,0,5.729578\n",
)

_CORNERS = np.array([[0, 0, 0], [0.1, 0, 0], [0, 0.1, 0], [0, 0, 0.1]])
_FACES = ((0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3))


def _stl() -> bytes:
    facets = b"".join(struct.pack("<12fH", 0, 0, 1, *_CORNERS[list(face)].ravel(), 0) for face in _FACES)
    return b"binary".ljust(80) + struct.pack("<I", len(_FACES)) + facets


def _stl_text() -> bytes:
    lines = ["solid s"]
    for face in _FACES:
        lines += ["facet normal 0 0 1", " outer loop"]
        lines += [f"  vertex {x:g} {y:g} {z:g}" for x, y, z in _CORNERS[list(face)]]
        lines += [" endloop", "endfacet"]
    return "\n".join([*lines, "endsolid s", ""]).encode()


def _obj() -> bytes:
    lines = ["# mesh", "o s", *(f"v {x:g} {y:g} {z:g}" for x, y, z in _CORNERS), "vn 0 0 1", "vt 0 0"]
    return "\n".join([*lines, *(f"f {a + 1}/1/1 {b + 1}/1/1 {c + 1}/1/1" for a, b, c in _FACES), ""]).encode()


def _dae() -> bytes:
    numbers = " ".join(f"{x:g}" for x in _CORNERS.ravel())
    indices = " ".join(str(i) for face in _FACES for i in face)
    return f"""<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
  <asset><unit name="meter" meter="1"/><up_axis>Z_UP</up_axis></asset>
  <library_geometries><geometry id="g"><mesh>
    <source id="p"><float_array id="pa" count="12">{numbers}</float_array><technique_common>
      <accessor source="#pa" count="4" stride="3"><param name="X" type="float"/><param name="Y" type="float"/>
      <param name="Z" type="float"/></accessor></technique_common></source>
    <vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
    <triangles count="4"><input semantic="VERTEX" source="#v" offset="0"/><p>{indices}</p></triangles>
  </mesh></geometry></library_geometries>
  <library_visual_scenes><visual_scene id="s"><node><matrix>1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1</matrix>
    <instance_geometry url="#g"/></node></visual_scene></library_visual_scenes>
  <scene><instance_visual_scene url="#s"/></scene>
</COLLADA>
""".encode()


def _mesh_kind(ending: str, *seeds: bytes) -> Kind:
    urdf = (URDF % (_COLLISION % f'<mesh filename="package://x/m.{ending}" scale="1 1 2"/>')).encode()
    name = f"m.{ending}"

    def read(folder: Path) -> None:
        (folder / "two.urdf").write_bytes(urdf.replace(b"package://x", os.fsencode(folder)))
        _read_mesh(folder)

    return Kind(f"mesh as {ending}", name, seeds, {"two.urdf": urdf}, read)


def _proven(folder: Path) -> Rollout:
    """A motion of the robot with two joints."""
    points = ViaPoints([[0.0, 0.0], [0.5, 0.2], [1.0, 0.1]])
    robot = load_robot(folder / "two.urdf", limits=LIMITS)
    return Rollout(Dynamics(robot), QuinticSpline(points, duration_bounds=(0.5, 2.0))([[1.0, 1.2]]))


@cache
def kinds(folder: Path) -> dict[str, Kind]:
    """All kinds by name, with seeds that are made in a folder."""
    run = _run(folder)
    begun = {name: data for name, data in run.items() if name != "front.json"}
    front = Front.load(folder / "run" / "front.json")
    export(front.knee(), folder / "knee.nc", format="netcdf")
    analyse(front, "short", file=folder / "front.analyses.npz")
    (folder / "study.toml").write_text(STUDY)
    StudyFolder(folder / "study").keep(load_study(folder / "study.toml").record)
    kept = (folder / "study" / "study.json").read_bytes()
    (folder / "two.urdf").write_bytes(PLAIN)
    proof = certify(_proven(folder)).write_proof(folder / "motion.proof.json").read_bytes()
    two, robot = {"two.urdf": PLAIN}, Path("robot")
    made = (
        Kind("front", "front.json", (run["front.json"],), {}, _read_front, written=True),
        Kind("manifest", "manifest.json", (run["manifest.json"],), begun, _read_run, written=True),
        Kind("checkpoint", "checkpoint.npz", (run["checkpoint.npz"],), begun, _go_on, written=True),
        Kind("blocks", "blocks/000001.npz", (run["blocks/000001.npz"],), begun, _go_on, written=True),
        Kind("study.json", "study.json", (kept,), {}, _read_study, written=True),
        Kind(
            "task",
            "task.toml",
            (TASK.encode(), TASK_FILE_POINTS.encode(), TASK_WITH_LOADS.encode(), TASK_WITH_SEGMENTS.encode()),
            two | {"points.csv": POINTS[0]},
            _read_task,
        ),
        Kind(
            "study.toml",
            "study.toml",
            (STUDY.encode(), STUDY_OF_TASK.encode()),
            two | {"task.toml": TASK.encode()},
            lambda place: load_study(place / "study.toml"),
        ),
        Kind("URDF", "two.urdf", (PLAIN,), {}, lambda place: _read_robot(place / "two.urdf")),
        Kind("MJCF", "two.xml", (MJCF.encode(),), {}, lambda place: _read_robot(place / "two.xml")),
        Kind(
            "robot.toml",
            str(robot / "robot.toml"),
            (ROBOT_TOML.encode(),),
            {str(robot / "two.urdf"): PLAIN},
            lambda place: _read_robot(place / robot),
        ),
        Kind(
            "joint limits",
            "joint_limits.yaml",
            (JOINT_LIMITS,),
            two,
            lambda place: load_robot(place / "two.urdf", limits=place / "joint_limits.yaml"),
        ),
        Kind("points", "points.csv", POINTS, two, _read_points),
        Kind("proof file", "motion.proof.json", (proof,), {}, _read_proof),
        Kind("netCDF", "front.nc", ((folder / "knee.nc").read_bytes(),), {}, _read_netcdf, written=True),
        Kind(
            "scene",
            "cell.scene",
            (NEW.encode(), OLD.encode(), WORLD.encode()),
            {"parts/corner.obj": _obj()},
            _read_scene,
        ),
        _mesh_kind("stl", _stl(), _stl_text()),
        _mesh_kind("obj", _obj()),
        _mesh_kind("dae", _dae()),
        Kind(
            "analyses",
            "front.analyses.npz",
            ((folder / "front.analyses.npz").read_bytes(),),
            {"front.json": run["front.json"]},
            _read_analyses,
        ),
    )
    return {kind.name: kind for kind in made}
