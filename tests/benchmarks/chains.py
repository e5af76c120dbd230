"""Robots of any number of joints: chains of links whose axes turn by a right angle from one to the next."""

from __future__ import annotations

import tempfile
from pathlib import Path

from trajevo import Robot, load_robot

REACH = 1.5  # of the stretched chain [m]
MASS = 12.0  # of all links [kg]


def chain(joints: int) -> Robot:
    """A chain of so many revolute joints, as long and as heavy as any other one."""
    length, mass = REACH / joints, MASS / joints
    inertia = mass * length**2 / 12.0 + 1e-4
    parts = ['<robot name="chain">', '<link name="link_0"/>']
    for k in range(1, joints + 1):
        axis = "0 1 0" if k % 2 else "1 0 0"
        parts.append(
            f'<link name="link_{k}"><inertial><origin xyz="0 0 {length / 2}"/><mass value="{mass}"/>'
            f'<inertia ixx="{inertia}" iyy="{inertia}" izz="1e-4" ixy="0" ixz="0" iyz="0"/></inertial></link>'
            f'<joint name="joint_{k}" type="revolute"><parent link="link_{k - 1}"/><child link="link_{k}"/>'
            f'<origin xyz="0 0 {length if k > 1 else 0.0}"/><axis xyz="{axis}"/>'
            '<limit lower="-3" upper="3" velocity="3" effort="500"/></joint>'
        )
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "chain.urdf"
        file.write_text("\n".join([*parts, "</robot>"]))
        return load_robot(file, limits={"acceleration": 15.0, "jerk": 150.0})
