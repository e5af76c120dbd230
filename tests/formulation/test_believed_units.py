"""Numbers that must be in another unit are refused with that unit; those that can be meant are taken, or say so."""

import json

import numpy as np
import pytest

from tests.helpers import refused
from trajevo import Payload, ViaPointProblem, load_robot
from trajevo.base.units import believed, with_unit

LIMITS = {"acceleration": 10.0, "jerk": 100.0}
ARM = {"name": "ur5", "tool": "tool0", "limits": LIMITS}
POINTS = [[0.0, -1.5, 1.5, -1.5, -1.5, 0.0], [0.5, -1.2, 1.4, -1.7, -1.5, 0.2], [0.9, -1.4, 1.5, -1.6, -1.5, 0.0]]


def problem(**given):
    return ViaPointProblem(**({"robot": ARM, "points": POINTS} | given))


def scene(clearance=0.0, **given):
    post = {"shape": "cylinder", "radius": 0.05, "length": 0.8, "position": [0.9, 0.9, 0.4], "name": "post"}
    return {"obstacles": [post | given], "clearance": clearance}


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"payload": 3000}, 'payload.mass: 3000 kg looks like g: write "3000 g", or "3000 kg" if it is meant'),
        ({"payload": {"mass": 3000.0}}, 'payload.mass: 3000 kg looks like g: write "3000 g"'),
        ({"payload": {"mass": 3.0, "com": [0, 0, 50]}}, 'payload.com: 50 m looks like mm: write "50 mm", or "50 m" if'),
        (
            {"payload": {"mass": 3.0, "com": [0, 0, "50 kg"]}},
            "payload.com: expected a number and a unit that converts to m",
        ),
        (
            {"payload": {"mass": 3.0, "inertia": np.diag([1e3] * 3)}},
            "payload.inertia: .*radius of gyration.*looks like kg·mm²",
        ),
        (
            {"moving": [{"point": 1, "joints": [10.0] * 6}]},
            "moving: joints: a half width of 10 rad at point 1 covers the",
        ),
        (
            {"moving": [{"point": 1, "tool": [50.0, 0, 0]}]},
            "moving: tool: a half width of 50 m .*looks like mm.*0.05 if",
        ),
        ({"tool_speed": 250.0}, "tool_speed: 250 m/s looks like mm/s: expected at most 50 m/s, 0.25 if it is mm/s"),
        ({"tool_height": 250.0}, "tool_height: 250 m looks like mm: expected at most 100 m, 0.25 if it is mm"),
        (
            {"effort_margin": 20, "constraints": ["effort"]},
            "effort_margin: expected a share from 0 to below 1, got 20, which looks like percent: 0.2",
        ),
        ({"scene": scene(position=[900, 900, 400])}, "scene: obstacle 'post': .*within 100 m .* looks like mm"),
        (
            {"scene": scene(rpy=[0, 0, 90])},
            "obstacle 'post': rpy: .*looks like degrees: angles of obstacles are in rad",
        ),
        (
            {"scene": scene(clearance=20)},
            "scene: clearance: 20 m looks like mm: expected at most 5 m, 0.02 if it is mm",
        ),
        (
            {"points": np.degrees(POINTS).tolist()},
            "at -85.9437 rad, outside .*looks like degrees: say so by angle = .deg.",
        ),
        (
            {"points": [POINTS[0], {"position": [450, -250, 300]}]},
            "point 1: .*; in mm it is reached: positions are in m",
        ),
        (
            {"points": [POINTS[0], {"position": [0.4, 0, 0.3], "rpy": [180, 0, 0]}]},
            "point 1: rpy: .*within ±2π rad.*degrees",
        ),
        ({"robot": ARM | {"limits": LIMITS | {"velocity": 180}}}, 'write "180 deg/s", or "180 rad/s" if it is meant'),
        ({"robot": ARM | {"limits": LIMITS | {"position": [-180, 180]}}}, "-180 rad looks like deg: write"),
        ({"robot": ARM | {"gravity": [0, 0, -9810]}}, "gravity: 9810 m/s² looks like mm/s²"),
        (
            {"robot": ARM | {"lock": {"wrist_3_joint": 90}}},
            "lock: 'wrist_3_joint': 90 rad is outside .*in rad, here 1.5708",
        ),
    ],
)
def test_numbers_in_other_units_are_refused(given, says):
    refused(lambda: problem(**given), says)


@pytest.mark.parametrize(
    ("payload", "mass", "com"),
    [
        ("3000 kg", 3000.0, (0.0, 0.0, 0.0)),
        ("500 g", 0.5, (0.0, 0.0, 0.0)),
        ({"mass": "2500 kg", "com": [0, 0, "2.5 m"]}, 2500.0, (0.0, 0.0, 2.5)),
        ({"mass": 3, "com": ["30 mm", -0.01, "1 cm"]}, 3.0, (0.03, -0.01, 0.01)),
    ],
)
def test_numbers_with_their_unit_are_taken_and_read_back(payload, mass, com):
    made = problem(payload=payload)
    assert made.dynamics.payload.mass == mass
    np.testing.assert_allclose(made.dynamics.payload.com, com, rtol=1e-15)
    again = ViaPointProblem(**json.loads(json.dumps(made.settings)))
    assert again.dynamics.payload == made.dynamics.payload
    assert again.settings == made.settings


def test_a_payload_that_is_far_away_keeps_so_when_its_mass_changes():
    payload = Payload(3.0, (0.0, 0.0, "2.5 m"))
    assert payload.with_mass(1.0).com == (0.0, 0.0, 2.5)
    refused(lambda: Payload(3.0, (0.0, 0.0, 2.5)), "payload.com: 2.5 m looks like mm")


def test_speeds_and_ranges_with_their_unit_are_taken_and_read_back():
    limits = LIMITS | {"velocity": "180 rad/s", "position": ["-100 rad", "100 rad"]}
    made = problem(robot=ARM | {"limits": limits})
    again = ViaPointProblem(**json.loads(json.dumps(made.settings)))
    assert again.robot.limits.velocity[0] == made.robot.limits.velocity[0] == 180.0
    assert made.robot.limits.upper[0] == 100.0
    assert load_robot(**(ARM | {"limits": LIMITS | {"velocity": "30 rpm"}})).limits.velocity[0] == pytest.approx(np.pi)


def test_many_turns_and_large_machines_are_taken():
    turning = ARM | {"limits": LIMITS | {"position": {"wrist_3_joint": ["-500 rad", "500 rad"]}}}
    points = [[*row[:5], last] for row, last in zip(POINTS, (0.0, 90.0, 400.0), strict=True)]
    assert problem(robot=turning, points=points).robot.limits.upper[5] == 500.0
    floor = scene(position=[0, 0, -500.2]) | {
        "obstacles": [{"shape": "box", "size": [1000] * 3, "position": [0, 0, -500.2]}]
    }
    assert problem(scene=floor)
    assert problem(moving=[{"point": 1, "joints": [6.0] * 6}])
    assert problem(robot=ARM | {"lock": {"wrist_3_joint": -6.2}}, points=[row[:5] for row in POINTS])


def test_what_is_believed_needs_no_unit():
    for value, unit in (
        (25.0, "rad"),
        (29.0, "rad/s"),
        (19.0, "m/s"),
        (999.0, "kg"),
        (np.inf, "rad/s"),
        (1e6, "rad/s^3"),
    ):
        assert believed(value, unit, name="x") == with_unit(value, unit) == value
    assert with_unit(31.0, "rad/s") == "31.0 rad/s"
