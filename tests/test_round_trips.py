"""Every setting of every registered problem survives JSON, whatever Python type it was given in.

Arguments are drawn at random, one generator for each argument of each problem and each parameter of a limit, and in the
types that users have at hand: lists, tuples, arrays, numbers of numpy, paths. The problem that its settings make after
they went through JSON must be the same to the bit, and a front of it must be read back.
"""

import inspect
import json

import numpy as np
import pytest

from tests.helpers import mostly_long, suited
from trajevo import (
    Drive,
    Front,
    Grip,
    Load,
    Passing,
    Payload,
    Pose,
    Stand,
    ToolSegment,
    ViaPoints,
    load_problem,
    load_robot,
)
from trajevo.dynamics.contacts.bending import known_stiffness
from trajevo.errors import TrajevoError
from trajevo.formulation.constraints.kinds import KINDS, parameters_of
from trajevo.formulation.constraints.scene import SHAPES, Scene
from trajevo.formulation.objectives import OBJECTIVES
from trajevo.formulation.registry import list_problems, problem_class
from trajevo.front.records import Blocking, History, ProblemRecord, Run, installed_versions
from trajevo.path.boxes import CartesianBox, JointBox
from trajevo.path.curve import GeometricPath
from trajevo.problems.hybrid_kinematics import via_positions
from trajevo.problems.puma_kinematics import TABLE_1_JOINTS
from trajevo.robot.loading.supply import Supply
from trajevo.robot.payload import LOAD_MODELS
from trajevo.trajectory.interpolants import THROUGH_POINTS

MIDDLE = np.array([0.4, -1.4, 1.5, -1.6, -1.5, 0.1])
#: A scene of MoveIt.
CELL = "cell\n* a pole\n1\ncylinder\n0.05 0.3\n1.4 0.1 1.2\n0 0 0 1\n0 0 0 0\n.\n"
WEDGE = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n"
URDF = """<robot name="two">
<link name="base"/>
<link name="l1"><inertial><origin xyz="0.2 0 0"/><mass value="2"/>
  <inertia ixx="0.01" ixy="0" ixz="0" iyy="0.03" iyz="0" izz="0.03"/></inertial></link>
<link name="l2"/><link name="tcp"/><link name="side"/>
<joint name="a" type="revolute"><parent link="base"/><child link="l1"/><origin xyz="0 0 0.3"/><axis xyz="0 1 0"/>
  <limit lower="-3" upper="3" velocity="2" effort="60"/></joint>
<joint name="b" type="revolute"><parent link="l1"/><child link="l2"/><origin xyz="0.4 0 0"/><axis xyz="0 1 0"/>
  <limit lower="-3" upper="3" velocity="2" effort="30"/></joint>
<joint name="t" type="fixed"><parent link="l2"/><child link="tcp"/><origin xyz="0.3 0 0"/></joint>
<joint name="s" type="fixed"><parent link="l2"/><child link="side"/><origin xyz="0.1 0.1 0"/></joint>
</robot>"""

XACRO = URDF.replace(
    '<robot name="two">', '<robot name="two" xmlns:xacro="http://x"><xacro:arg name="far" default="0.1"/>'
)
XACRO = XACRO.replace('xyz="0.4 0 0"', 'xyz="$(arg far) 0 0"')

#: What the temperature of a winding follows from.
HEATING = {
    "gear_ratio": 101.0,
    "torque_constant": "0.13 N*m/A",
    "winding_resistance": "0.5 ohm",
    "thermal_resistance": 1.5,
    "thermal_time_constant": "600 s",
}


class Draw:
    """Random arguments, in random Python types."""

    def __init__(self, seed, folder):
        self.random, self.folder = np.random.default_rng(seed), folder

    def number(self, low, high):
        return self.typed(float(self.random.uniform(low, high)))

    def typed(self, value):
        kinds = [
            float,
            np.float64,
            lambda x: float(np.float32(x)),
            np.float32,
            lambda x: np.array(x)[()],
            lambda x: x * 0.1 * 3,
        ]
        return kinds[self.random.integers(len(kinds))](value)

    def whole(self, low, high):
        return self.choice([int, np.int64, np.int32])(self.random.integers(low, high + 1))

    def choice(self, values):
        return values[self.random.integers(len(values))]

    def chance(self, share=0.5):
        return bool(self.random.random() < share)

    def vector(self, low, high, size=None):
        return self.listed(self.random.uniform(low, high, size))

    def listed(self, values):
        """An array as it is, or as lists or tuples of Python's or numpy's numbers."""
        values = np.asarray(values)
        if self.chance(0.3):
            return values
        container = self.choice([list, tuple])
        if values.ndim > 1:
            return container(self.listed(row) for row in values)
        return container(values.tolist()) if self.chance() else container(values)

    def subset(self, names, least=0):
        names = list(names)
        taken = [names[k] for k in self.random.permutation(len(names))[: self.random.integers(least, len(names) + 1)]]
        return self.choice([list, tuple])(taken)

    # --- payloads

    def inertia(self, mass):
        points = self.random.uniform(-0.2, 0.2, (5, 3))
        points -= points.mean(axis=0)
        spread = mass / 5.0 * points.T @ points
        return self.listed(np.trace(spread) * np.eye(3) - spread)

    def payload(self, most=2.0, model=None):
        mass = self.number(0.1, most)
        if self.chance(0.2):
            return mass
        model = model or self.choice([*LOAD_MODELS])
        data = {"mass": mass}
        if self.chance(0.8):
            data["model"] = model
        if data.get("model", "rigid") != "tool_axis" and self.chance(0.7):
            data["com"] = self.vector(-0.1, 0.1, 3)
        if data.get("model", "rigid") == "rigid" and self.chance(0.7):
            data["inertia"] = self.inertia(float(mass))
        return data if self.chance() else Payload(**data)

    # --- robots

    def limit(self, low, high, names, unit):
        values = self.random.uniform(low, high, len(names))
        forms = [
            lambda: self.number(low, high),
            lambda: self.listed(values),
            lambda: dict(zip(names, self.listed(values), strict=True)),
            lambda: f"{values[0]:.17g} {unit}",
            lambda: [f"{value:.17g} {unit}" for value in values],
            lambda: float("inf"),
            lambda: self.choice([list, tuple])(self.choice([value, np.inf]) for value in values),
        ]
        return self.choice(forms)()

    def directed_limit(self, low, high, names, unit):
        """A limit that may differ by direction, for all joints or for each."""

        def pair():
            return {"backward": self.number(low, high), "forward": f"{self.random.uniform(low, high):.17g} {unit}"}

        forms = [pair, lambda: [pair() for _ in names], lambda: {names[0]: pair()} | dict.fromkeys(names[1:], high)]
        return self.choice(forms)() if self.chance(0.4) else self.limit(low, high, names, unit)

    def limits(self, names):
        found = {
            "acceleration": self.directed_limit(8.0, 20.0, names, "rad/s^2"),
            "jerk": self.limit(80.0, 300.0, names, "rad/s^3"),
        }
        if self.chance():
            found["velocity"] = self.directed_limit(1.0, 4.0, names, "rad/s")
        if self.chance(0.3):
            found["effort"] = self.directed_limit(100.0, 200.0, names, "N*m")
        if self.chance(0.3):
            pairs = np.stack(
                [self.random.uniform(-3.1, -2.9, len(names)), self.random.uniform(2.9, 3.1, len(names))], 1
            )
            found["position"] = self.choice([self.listed(pairs), dict(zip(names, self.listed(pairs), strict=True))])
        return found

    def robot_arguments(self):
        """A value for every argument of load_robot, by name, and the number of joints left."""
        if self.chance(0.25):
            file, by_xacro = self.folder / "two.urdf", self.folder / "two.urdf.xacro"
            file.write_text(URDF, encoding="utf-8")
            by_xacro.write_text(XACRO, encoding="utf-8")
            source = self.choice(
                [
                    {"name": file, "xacro": None, "urdf": None},
                    {"name": str(file), "xacro": None, "urdf": None},
                    {"name": "two", "xacro": None, "urdf": URDF},
                    {"name": by_xacro, "xacro": {"far": self.choice(["0.4", 0.4])}, "urdf": None},
                ]
            )
            return source | {
                "lock": None,
                "base": self.base(),
                "tools": None,
                "tool": self.choice(["tcp", "side"]),
                "limits": self.limits(["a", "b"]),
                "gravity": self.choice([None, self.vector(-9.9, 9.9, 3)]),
                "allow_massless": True,
                "packages": self.choice([None, self.folder, str(self.folder), [self.folder]]),
                "friction": self.friction("a"),
                "drives": self.drives("a"),
                "grip": self.grip(),
                "stand": self.stand(),
                "supply": self.supply(),
            }, 2
        names = list(load_robot("ur5", tool="tool0", limits={"acceleration": 1.0, "jerk": 1.0}).joint_names)
        locked = {names[5]: self.number(-1.0, 1.0)} if self.chance(0.3) else None
        tool = self.choice([None, "tool0", "ee_link", "gripper"]) if locked is None else "tool0"
        return {
            "name": "ur5",
            "lock": locked,
            "tool": tool,
            "tools": [self.gripper()] if tool == "gripper" else None,
            "base": self.base(),
            "xacro": None,
            "urdf": None,
            "limits": self.limits(names[: 6 - len(locked or ())]),
            "gravity": self.choice([None, self.vector(-9.9, 9.9, 3)]),
            "allow_massless": self.choice([None, False, True]),
            "packages": self.choice([None, self.folder]),
            "friction": self.friction(names[0]),
            "drives": self.drives(names[0]),
            "grip": self.grip(),
            "stand": self.stand(),
            "supply": self.supply(),
        }, 6 - len(locked or ())

    def base(self):
        position = self.choice([self.vector(-0.02, 0.02, 3), ["10 mm", 0.0, -0.01]])
        return self.choice([None, {"position": position}, {"position": position, "rpy": [0.0, 0.0, "2 deg"]}])

    def gripper(self):
        given = {"name": "gripper", "parent": "tool0", "mass": self.number(0.5, 1.0)}
        given |= {"com": self.vector(-0.05, 0.05, 3)} if self.chance() else {}
        return given | ({"position": [0.0, 0.0, "20 mm"], "rpy": self.vector(-0.1, 0.1, 3)} if self.chance() else {})

    def friction(self, joint):
        viscous = self.choice([self.number(0.0, 0.5), {joint: self.number(0.0, 0.5)}])
        return self.choice(
            [
                None,
                "none",
                "file",
                "urdf",
                {"armature": {joint: 0.1}},
                {"viscous": viscous},
                {"coulomb": {joint: np.float64(0.25)}},
            ]
        )

    def drives(self, joint):
        line = [["0 rad/s", "90 N*m"], [self.number(3.0, 9.0), 0.0]]
        return self.choice(
            [
                None,
                {},
                {joint: {"peak_torque": self.number(500.0, 900.0), "brake": True, "source": "a sheet"}},
                {joint: {"torque_speed": line, "continuous_torque": "40 N*m", "greatest_rise": 80.0} | HEATING},
                {joint: {"stiffness": self.choice([self.number(1e3, 1e5), "20000 N*m/rad"])}},
                {
                    joint: Drive(
                        continuous_torque=self.number(50.0, 90.0), efficiency_driving=0.8, efficiency_driven=0.0
                    )
                },
            ]
        )

    def grip(self):
        told = {"total_force": "200 N", "friction": self.number(0.1, 0.5), "point": [0.0, 0.0, "20 mm"], "fingers": 3}
        return self.choice([None, told, Grip(force_per_finger=self.number(50.0, 90.0), friction=0.3, torsion=0.01)])

    def stand(self):
        corners = [[0.3, 0.0, 0.0], ["0.1 m", 0.4, 0.0], [-0.4, -0.3, 0.0]]
        told = {"mass": "60 kg", "com": self.vector(-0.1, 0.1, 3), "footprint": corners, "source": "a drawing"}
        plain = ((0.3, 0.0, 0.0), (0.1, 0.4, 0.0), (-0.4, -0.3, 0.0))
        return self.choice([None, told, Stand(mass=self.number(10.0, 90.0), com=(0.0, 0.0, 0.1), footprint=plain)])

    def supply(self):
        link = {"link_capacitance": "470 uF", "link_voltage": self.number(320.0, 600.0), "chopper_voltage": "720 V"}
        return self.choice(
            [
                None,
                {},
                {"standby_power": "90 W", "recuperation": self.choice(["none", "full"]), "source": "a sheet"},
                link,
                Supply(standby_power=self.number(0.0, 200.0)),
            ]
        )

    def robot(self):
        given, dof = self.robot_arguments()
        assert set(given) == set(inspect.signature(load_robot).parameters), "an argument of load_robot has no generator"
        given = {key: value for key, value in given.items() if value is not None or self.chance()}
        if given["name"] == "ur5" and given.get("tool") is None:
            given["tool"] = "tool0"
        return (given if self.chance(0.7) else load_robot(**given)), dof

    # --- points

    def rows(self, dof, count=None):
        count = count or int(self.random.integers(4, 6))
        centre = MIDDLE[:dof] if dof > 2 else np.array([0.2, 0.4])
        return centre + self.random.uniform(-0.25, 0.25, (count, dof))

    def points(self, robot, dof):
        rows = self.rows(dof)
        loaded = load_robot(**robot) if isinstance(robot, dict) else robot
        forms = [lambda: self.listed(rows), lambda: ViaPoints(rows)]
        if dof == 6:
            positions, rotations = loaded.tool_poses(rows)
            poses = [
                Pose(p, R) if self.chance() else {"position": self.listed(p)}
                for p, R in zip(positions, rotations, strict=True)
            ]
            forms.append(lambda: [rows[0], *poses[1:]])
        file = self.folder / "points.csv"
        header = ", ".join(
            f"{name} [{unit}]" for name, unit in zip(loaded.joint_names, loaded.joint_units, strict=True)
        )
        file.write_text("\n".join([header, *(", ".join(f"{x:.17g}" for x in row) for row in rows)]), encoding="utf-8")
        forms.append(lambda: self.choice([file, str(file)]))
        return self.choice(forms)(), len(rows)

    def moving(self, dof, count):
        boxes = []
        for point in range(1, count - 1):
            kind = self.random.integers(5)
            joints, tool = self.vector(0.0, 0.1, dof), self.vector(0.0, 0.02, 3)
            point = self.choice([int, np.int64])(point)
            if kind == 0:
                boxes.append({"point": int(point), "joints": joints})
            if kind == 1:
                boxes.append(JointBox(point, joints))
            if kind == 2 and dof == 6:
                boxes.append({"point": point, "tool": tool} | self.choice([{}, {"keep_orientation": False}]))
            if kind == 3 and dof == 6:
                boxes.append(CartesianBox(point, tool, keep_orientation=self.chance()))
        return self.choice([list, tuple])(boxes)

    # --- limits

    def scene(self, robot):
        loaded = load_robot(**robot) if isinstance(robot, dict) else robot
        obstacles = []
        for shape in self.subset(SHAPES, least=1):
            entry = {"shape": shape, "position": self.vector(1.5, 2.0, 3)}
            round_ones = dict.fromkeys(("cylinder", "capsule"), ("radius", "length")) | {"sphere": ("radius",)}
            sizes = ({"box": ("size",), "mesh": ("scale",), "hull": (), "plane": ()} | round_ones)[shape]
            for size in sizes:
                entry[size] = self.vector(0.05, 0.3, 3) if size == "size" else self.number(0.05, 0.3)
            if shape == "mesh":
                file = self.folder / "wedge.obj"
                file.write_text(WEDGE, encoding="utf-8")
                entry["file"] = self.choice([file, str(file)])
            if shape == "hull":
                entry["points"] = self.listed(self.random.uniform(-0.2, 0.2, (6, 3)))
            if shape == "plane" and self.chance():
                entry["normal"] = self.vector(-1.0, 1.0, 3)
            if self.chance():
                entry["name"] = f"a {shape}"
            if self.chance() and "normal" not in entry:
                angles = self.random.uniform(-3.0, 3.0, 3)
                plain = SHAPES[shape](**{k: v for k, v in entry.items() if k != "shape"} | {"rpy": tuple(angles)})
                entry |= self.choice([{"rpy": self.listed(angles)}, {"rotation": self.listed(plain.rotation)}])
            if shape != "plane" and self.chance():
                poses = [{"t": t, "position": self.vector(1.5, 2.0, 3)} for t in (self.number(-1.0, 0.0), 0.5, 1.5)]
                turned = [one | {"rpy": self.listed(self.random.uniform(-1.0, 1.0, 3))} for one in poses]
                entry["motion"] = self.choice([list, tuple])(self.choice([poses, turned]))
                entry["position"] = self.vector(-0.1, 0.1, 3)
            obstacles.append(entry)
        data = {"obstacles": self.choice([list, tuple])(obstacles), "clearance": self.number(0.0, 0.02)}
        if self.chance():
            data["attached"] = [{"shape": "sphere", "radius": 0.01, "on": loaded.tool, "touches": [loaded.tool]}]
            obstacles[0]["touches"] = self.choice([list, tuple])(["attached 1"])
            data["obstacles"] = obstacles
        if self.chance():
            data["file"] = self.folder / "cell.scene"
            data["file"].write_text(CELL, encoding="utf-8")
        return data if self.chance() else Scene.of(data)

    def parameters(self, constraints, robot, with_scene):
        """Parameters of limits by name; every parameter of trajevo's own has a generator here."""
        made = {
            "effort_margin": lambda: self.number(0.0, 0.3) if "effort" in constraints else 0,
            "overshoot": lambda: self.number(0.1, 0.5),
            "tool_speed": lambda: self.number(0.5, 3.0),
            "tool_height": lambda: self.number(-0.5, 0.1),
            "effort_rate": lambda: self.number(500.0, 5000.0),
            "manipulability": lambda: self.number(0.001, 0.01),
            "least_singular_value": lambda: self.number(0.001, 0.01),
            "via_error": lambda: self.number(0.05, 0.5),
            "longest_time": lambda: self.choice([self.number(5.0, 20.0), self.whole(5, 20)]),
            "dwell": lambda: self.number(0.0, 3.0) if {"rms_torque", "winding_temperature"} & {*constraints} else 0.0,
            "cycles": lambda: self.whole(1, 30) if "winding_temperature" in constraints else 0,
            "peak_power": lambda: self.number(500.0, 9000.0),
            "deviation": lambda: self.number(0.02, 0.2),
            "deviation_of": lambda: self.choice(["all", "payload"]),
            "scene": lambda: self.scene(robot),
        }
        known = parameters_of(KINDS)
        assert set(made) == set(known), "a parameter of a limit has no generator"
        given = {name: make() for name, make in made.items() if self.chance(0.4)}
        if not with_scene:
            given.pop("scene", None)
        loaded = load_robot(**robot) if isinstance(robot, dict) else robot
        if "deviation" not in given or not known_stiffness(loaded):
            given.pop("deviation", None)
            given.pop("deviation_of", None)
        return given | {
            name: None for name in known if name not in given and known[name].default is None and self.chance(0.2)
        }


def passing(draw, dof, count, interpolant):
    """How some points are passed, by what the interpolant can do."""
    found = []
    for point in range(1, count - 1):
        if draw.chance(0.4) and interpolant not in ("linear_blends", "hybrid", "quartic_cubic_quartic"):
            found.append(
                draw.choice([{"point": draw.whole(point, point), "dwell": draw.number(0.1, 0.5)}, Passing(point, True)])
            )
    if draw.chance(0.3) and interpolant in ("bspline", "quintic_spline", "septic_spline", "cubic", "hermite"):
        more = {} if interpolant == "hermite" else {"acceleration": draw.vector(-0.1, 0.1, dof)}
        found.append({"point": 0, "velocity": draw.vector(-0.02, 0.02, dof)} | more)
    if draw.chance(0.3) and interpolant != "linear_blends":
        found.append({"point": count - 1, "window": draw.listed([draw.number(0.0, 1.0), 50.0])})
    return draw.choice([list, tuple])(found)


def loads(draw, count, cyclic):
    """What is carried, in any form: a payload, or loads of which one may be picked up and put down on the way."""
    if draw.chance(0.6):
        return draw.payload()
    first = draw.whole(1, count - 2)
    switched = {"from": first} if not cyclic else {"from": first, "to": draw.whole(0, 0)}
    forms = [
        lambda: Load(draw.payload(model="rigid"), int(first), 0 if cyclic else None),
        lambda: {"mass": draw.number(0.1, 2.0), "com": draw.vector(-0.1, 0.1, 3)} | switched,
        lambda: {"mass": "1500 g", "vary": True} | switched,
    ]
    return draw.choice([list, tuple])([draw.choice([draw.number(0.1, 1.0), {"mass": 0.5}]), draw.choice(forms)()])


def durations(draw, count, interpolant):
    """One pair of bounds, or one for each segment where the interpolant takes them."""
    if draw.chance(0.3) and interpolant in (
        "bspline",
        "hermite",
        "quintic_spline",
        "septic_spline",
        "polynomial",
        "hybrid",
    ):
        return draw.listed([[0.3, 4.0], *([[0.9, 0.9]] * (count - 2))])
    return draw.choice([(0.3, 4.0), [np.float64(0.1) * 3, 4], np.array([1, 3])])


def shape(draw):
    """How B-splines are: nothing, or some of their settings."""
    given = {
        "degree": draw.choice([5, 7]),
        "control_points": draw.whole(2, 4),
        "knots": draw.choice(["even", "free"]),
        "ends": draw.choice(["acceleration", "jerk"]),
    }
    return draw.choice([None, {}, {key: given[key] for key in draw.subset(given)} | {"control_points": 4}])


def segments(draw, robot, dof, interpolant, moving):
    """A line of the tool between inner points, and a wide cone for its axis, where the interpolant can do them."""
    found = []
    if interpolant not in ("quintic_spline", "septic_spline") or len(moving):
        return ()
    if draw.chance(0.3):
        line = {"from": draw.whole(1, 1), "tool": "line", "tolerance": draw.choice(["1 mm", np.float64(2e-3)])}
        ways = [line, line | {"rest": "both"}, ToolSegment(1, 2, tool="line", turning=0.02)]
        found.append(draw.choice(ways))
    if draw.chance(0.3):
        loaded = load_robot(**robot) if isinstance(robot, dict) else robot
        centre = MIDDLE[:dof] if dof > 2 else np.array([0.2, 0.4])
        axis = loaded.tool_poses(centre[None])[1][0][:, 2]
        found.append({"from": 0, "to": draw.whole(2, 3), "upright": draw.choice([1.5, "85.9 deg"]), "direction": axis})
    return draw.choice([list, tuple])(found)


def via_points(draw):
    robot, dof = draw.robot()
    points, count = draw.points(robot, dof)
    unused = draw.chance(0.25)
    objectives = draw.subset(
        name for name in OBJECTIVES if name not in ("unused_payload", "effort_ratio", "electrical_energy")
    )
    objectives = [*objectives, "unused_payload"] if unused else [*objectives, "time"][: max(1, len(objectives))]
    constraints = draw.subset(name for name, kind in KINDS.items() if kind.by_name)
    if unused and "effort" not in constraints:
        constraints = (*constraints, "effort")
    interpolant = draw.choice([*THROUGH_POINTS])
    kept = suited(interpolant, {"objectives": objectives, "constraints": constraints})
    objectives, constraints = kept["objectives"], kept["constraints"]
    cyclic = interpolant in ("quintic_spline", "septic_spline") and draw.chance(0.3)
    if cyclic:
        rows = draw.rows(dof)
        points, count = draw.listed(np.vstack([rows, rows[:1]])), len(rows) + 1
    moving = draw.moving(dof, count) if draw.chance(0.4) else ()
    data = {
        "robot": robot,
        "points": points,
        "duration_bounds": durations(draw, count, interpolant),
        "interpolant": interpolant,
        "pace": draw.choice([None, 0]),
        "extra_points": draw.whole(0, 2)
        if interpolant in ("quintic_spline", "septic_spline", "cubic", "hermite")
        else 0,
        "bspline": shape(draw) if interpolant == "bspline" else None,
        "passing": () if cyclic else passing(draw, dof, count, interpolant),
        "cyclic": cyclic,
        "base": None,
        "order": None,
        "postures": draw.choice([None, "nearest"]),
        "turns": draw.choice(["as_written", "shortest"]),
        "moving": moving,
        "segments": () if cyclic else segments(draw, robot, dof, interpolant, moving),
        "objectives": objectives,
        "constraints": constraints,
        "limits": draw.choice(["sampled", "certified"]),
        "payload": loads(draw, count, cyclic),
        "payload_range": draw.choice([(0.0, 3.0), [0, np.float32(1.5)]]) if unused else None,
        "reference_point": draw.choice([None, draw.vector(1.0, 50.0, len(objectives))]),
        "samples": draw.whole(4, 8),
        "threads": draw.whole(1, 2),
        "title": draw.choice([None, "Feeding press 3"]),
    }
    if draw.chance(0.1):  # the usual one, which the settings name
        data |= {"interpolant": None, "bspline": None}
    return suited(interpolant, data | draw.parameters(constraints, robot, with_scene=dof > 2))


def pointing(draw):
    rows = np.radians([[30.0, 30.0], [75.0, 15.0], [120.0, 2.0], [165.0, 15.0], [210.0, 30.0]])
    return {
        "interpolant": draw.choice(["smooth", "printed", "quintic", "septic_spline"]),
        "points": draw.choice([None, draw.listed(rows + draw.random.uniform(-0.02, 0.02, rows.shape))]),
        "duration_bounds": draw.listed([draw.random.uniform(0.5, 1.0), 9.0]),
        "limits": draw.choice(["sampled", "certified"]),
    }


def hybrid(draw):
    model = draw.choice([*LOAD_MODELS])
    objectives = draw.choice(["all", "cost", draw.subset(["time", "energy", "jerk", "acceleration"], least=1)])
    if draw.chance(0.3):
        objectives = ("time", "unused_payload")
    return {
        "payload": draw.payload(9.0, model=model),
        "convention": draw.choice(["continuous", "printed", "as_run"]),
        "payload_model": None,
        "payload_bounds": draw.choice([(0.0, 10.0), [0, np.float32(9.5)]]),
        "objectives": objectives,
        "positions": draw.choice([None, draw.listed(via_positions())]),
        "duration_bounds": draw.listed([draw.random.uniform(0.005, 0.1), 1.5]),
        "limits": draw.choice(["sampled", "certified"]),
        "samples": draw.whole(4, 8),
        "threads": draw.whole(1, 2),
    }


def pick_place(draw):
    moved = TABLE_1_JOINTS + draw.random.uniform(-0.02, 0.0, np.shape(TABLE_1_JOINTS))
    given = {
        "interpolant": draw.choice(
            ["septic", *(name for name in THROUGH_POINTS if name not in ("bspline", "hermite"))]
        ),
        "payload": draw.payload(),
        "points": draw.choice([None, draw.listed(moved)]),
        "duration_bounds": draw.listed([draw.random.uniform(0.3, 0.6), 6.0]),
        "position_limits": draw.choice([True, np.False_]),
        "overshoot": draw.choice([None, draw.number(1.0, 9.0)]),
        "limits": draw.choice(["sampled", "certified"]),
        "samples": draw.whole(6, 12),
        "threads": draw.whole(1, 2),
    }
    return given | ({"interpolant": "bspline"} if draw.chance(0.15) else {})  # hardly ever feasible at random


def reparam(draw):
    u = np.linspace(0.0, 1.0, 9)
    rows = np.stack([0.05 * np.cos(2.0 * u), 0.03 * np.sin(3.0 * u)], axis=1) + draw.random.uniform(-1e-3, 1e-3, (9, 2))
    own = draw.chance()
    linear, shape = draw.chance(0.2), draw.chance(0.3)
    effort = not shape and draw.chance(0.3)
    robot = load_robot("feed_drive", limits={"effort": 500.0}) if effort else None
    return {
        "path": draw.choice([draw.listed(rows), GeometricPath.through(rows)]) if own else draw.choice(["gemini", "s"]),
        "path_control_points": None,
        "robot": robot
        or draw.choice([None, "feed_drive", {"name": "feed_drive", "gravity": draw.vector(-9.0, 9.0, 3)}]),
        "limits": draw.choice(["tight", "hull"] if not effort else ["tight", "certified"]),
        "velocity": draw.choice(["150 mm/s", 0.15, draw.listed([0.1, 0.2]), [0.2, "inf"]]),
        "acceleration": draw.choice([1.0, "1000 mm/s^2", np.float32(1.0)]),
        "jerk": draw.choice([30.0, np.array([30.0, 25.0]), [np.inf, 30]]),
        "longest_time": draw.choice([30.0, "25 s", np.int64(28)]),
        "encoding": "shape" if shape and not linear else "plain",
        "interpolant": "linear" if linear else "bspline",
        "quadrature": draw.choice(["gauss", "trapezoid"]),
        "control_points": int(draw.random.integers(12, 16)),
        "order": 6,
        "tolerance": draw.choice([1e-6, np.float64(1e-5)]),
        "effort": effort,
        "payload": draw.payload(),
        "samples": draw.whole(4, 6),
        "threads": 1,
    }


GENERATORS = {
    "pointing": pointing,
    "hybrid": hybrid,
    "pick-place": pick_place,
    "reparam": reparam,
    "via-points": via_points,
}


def made(name, seed, folder):
    """A random problem; draws that the problem refuses are drawn again."""
    for attempt in range(40):
        try:
            arguments = GENERATORS[name](Draw((seed, attempt), folder))
            missing = set(inspect.signature(problem_class(name)).parameters) - {*arguments, *parameters_of(KINDS)}
            assert not missing, f"no generator for {missing}"
            return load_problem(name, **arguments)
        except TrajevoError as error:
            said = error
    raise AssertionError(f"forty draws were refused, the last: {said}")


def front_of(problem, X):
    """The feasible ones of some individuals as a front, empty if there are none."""
    F, G = problem.evaluate(X, return_values_of=["F", "G"])
    good = (G <= 0.0).all(axis=1) & np.isfinite(F).all(axis=1)
    run = Run(
        algorithm="none", settings={"of": (1, np.float64(2.0))}, seed=1, generations=1, evaluations=len(X), failures=0,
        first_failure="", interrupted=False, seconds=0.0, versions=installed_versions(),
    )  # fmt: skip
    history = History(
        reference_point=None, evaluations=(len(X),), hypervolume=(0.0,), least_violation=(0.0,), front_size=(1,)
    )
    return Front(
        X[good], F[good], G[good], ProblemRecord.of(problem), run, history,
        None if good.any() else Blocking(x=(), violations={}), _problem=problem,
    )  # fmt: skip


def check_round_trip(problem, folder):
    again = load_problem(problem.registered_name, **json.loads(json.dumps(problem.settings)))
    record = ProblemRecord.of(problem)
    assert ProblemRecord.of(again) == record
    assert ProblemRecord.model_validate_json(record.model_dump_json()) == record
    assert not record.difference(again)
    X = np.random.default_rng(0).uniform(problem.xl, problem.xu, (4, problem.n_var))
    for one, other in zip(*(each.evaluate(X, return_values_of=["F", "G"]) for each in (problem, again)), strict=True):
        np.testing.assert_array_equal(one, other)
    front = front_of(problem, X)
    front.save(folder / "front.json")
    back = Front.load(folder / "front.json")
    assert back == front
    assert back.problem.settings == problem.settings
    if len(back):
        back.choices()
    return len(back)


def test_every_problem_has_a_generator():
    assert set(GENERATORS) == set(list_problems())


@pytest.mark.parametrize("seed", mostly_long(range(3), 0))
@pytest.mark.parametrize("name", GENERATORS)
def test_settings_survive_json(name, seed, tmp_path):
    check_round_trip(made(name, seed, tmp_path), tmp_path)


def test_settings_of_limits_over_cycles_survive_json(tmp_path):
    drives = {"elbow_joint": {"continuous_torque": "40 N*m", "greatest_rise": 80.0} | HEATING}
    problem = load_problem(
        "via-points",
        robot=load_robot("ur5", tool="tool0", limits={"acceleration": 9.0, "jerk": 99.0}, drives=drives),
        points=np.arange(12.0).reshape(2, 6) / 20.0,
        objectives=("time", "rms_torque_share", "winding_rise", "peak_power"),
        constraints=("rms_torque", "winding_temperature"),
        dwell=np.float64(0.7),
        cycles=np.int64(12),
    )
    assert (problem.settings["dwell"], problem.settings["cycles"]) == (0.7, 12)
    check_round_trip(problem, tmp_path)


@pytest.mark.parametrize("box", [{"x": ["-150 mm", 0.1], "yaw": ["-30 deg", 0.4]}, {"z": np.array([0.0, 0.1])}])
def test_settings_of_a_moving_base_survive_json(box, tmp_path):
    problem = load_problem(
        "via-points",
        robot=load_robot("ur5", tool="tool0", limits={"acceleration": 9.0, "jerk": 99.0}),
        points=[
            Pose([0.3, -0.2, 0.2], np.diag([1.0, -1.0, -1.0]), "take"),
            {"position": np.array([0.1, 0.35, 0.3]), "rpy": (np.pi, 0.0, 0.3), "free": "z"},
            {"position": [0.4, 0.2, 0.25]},
        ],
        base={"moving": box},
        passing=[{"point": 1, "dwell": np.float64(0.1)}],
        objectives=("time", "footprint"),
        constraints=("position", "velocity"),
    )
    check_round_trip(problem, tmp_path)


@pytest.mark.parametrize(
    ("order", "postures"),
    [
        ("free", None),
        ({"free": np.array([2, 1]), "after": {np.int64(1): np.array([2])}}, "all"),
        ({"free": ((1, 2), [3, 4]), "after": {"3": 4}}, "nearest"),
        (None, "best"),
    ],
)
def test_settings_of_visits_survive_json(order, postures, tmp_path):
    problem = load_problem(
        "via-points",
        robot=load_robot("ur5", tool="tool0", limits={"acceleration": 9.0, "jerk": 99.0}),
        points=[
            Pose([0.3, -0.2, 0.2], np.diag([1.0, -1.0, -1.0]), "take"),
            {"position": np.array([0.1, 0.35, 0.3]), "rpy": (np.pi, 0.0, 0.3)},
            np.array([0.4, -1.4, 1.5, -1.6, -1.5, 0.1]),
            (0.5, -1.2, 1.5, -1.6, -1.5, 0.1),
            {"position": (0.4, 0.2, 0.25), "rpy": (np.pi, 0.0, 0.0)},
            [0.9, -1.4, 1.5, -1.6, -1.5, 0.1],
        ],
        order=order,
        postures=postures,
        turns="shortest",
        constraints=("position", "velocity"),
    )
    check_round_trip(problem, tmp_path)


@pytest.mark.long
@pytest.mark.parametrize("name", GENERATORS)
def test_settings_of_many_problems_survive_json(name, tmp_path):
    count = 60 if name == "via-points" else 20
    feasible = sum(check_round_trip(made(name, seed, tmp_path), tmp_path) for seed in range(100, 100 + count))
    assert feasible > count // 4
