"""Small robots of which motions are known in closed form, and their motions."""

import numpy as np

from trajevo import Dynamics, Payload, QuinticSpline, Rollout, ViaPoints, load_robot

FREE = {"velocity": np.inf, "acceleration": np.inf, "jerk": np.inf, "effort": np.inf, "position": [[-10.0, 10.0]]}

#: A mass of 2 kg on a slide, level; a rod of 1.5 kg, whose centre is 0.4 m from its horizontal axis.
SLIDE = """<robot name="slide"><link name="base"/><link name="table"><inertial><mass value="2.0"/>
<inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial></link>
<joint name="x" type="prismatic"><parent link="base"/><child link="table"/><axis xyz="1 0 0"/>
<limit lower="-10" upper="10" velocity="10" effort="1000"/></joint></robot>"""
ROD = """<robot name="rod"><link name="base"/><link name="arm"><inertial><origin xyz="0.4 0 0"/><mass value="1.5"/>
<inertia ixx="0.001" ixy="0" ixz="0" iyy="0.08" iyz="0" izz="0.08"/></inertial></link>
<joint name="turn" type="revolute"><parent link="base"/><child link="arm"/><axis xyz="0 1 0"/>
<limit lower="-10" upper="10" velocity="10" effort="1000"/></joint></robot>"""


def one_joint(text, *, friction=None, **limits):
    return load_robot("one", urdf=text, limits=FREE | limits, friction=friction or "none", gravity=(0.0, 0.0, -9.81))


def puma(**given):
    return load_robot("puma560", **given)


def motion(robot, points, durations, payload=None):
    """A quintic spline through points, at rest at its ends, of segments with these durations [s]."""
    spline = QuinticSpline(ViaPoints(np.array(points, dtype=float)), duration_bounds=(0.05, 20.0))
    x = np.zeros((1, len(spline.variables)))
    x[0, : len(durations)] = durations
    return Rollout(Dynamics(robot, payload or Payload(0.0)), spline(x))


def puma_motion(payload=None, duration=0.6, **given):
    points = np.array([[0.0, 0.8, 0.0, 0.0, 0.8, 0.0], [0.5, 0.6, -0.3, 0.4, 0.5, 0.6], [0.9, 1.0, 0.1, 0.0, 0.7, 0.2]])
    return motion(puma(**given), points, [duration, duration], payload)
