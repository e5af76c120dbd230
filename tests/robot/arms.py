"""Small arms with the traits of published ones, written as their makers write them."""

#: As Kinova's Gen3: every other joint turns without end and has neither ``lower`` nor ``upper``.
GEN3 = """\
<robot name="gen3">
  <link name="base_link"/>
  <link name="shoulder"><inertial><origin xyz="0 -0.02 -0.1"/><mass value="1.38"/>
    <inertia ixx="0.0046" ixy="0" ixz="0.0001" iyy="0.0045" iyz="0" izz="0.0014"/></inertial></link>
  <link name="arm"><inertial><origin xyz="0 -0.1 -0.02" rpy="0.1 0 0.2"/><mass value="1.16"/>
    <inertia ixx="0.0111" ixy="0" ixz="0" iyy="0.0011" iyz="0.0007" izz="0.0109"/></inertial></link>
  <link name="forearm"><inertial><origin xyz="0 -0.01 -0.12"/><mass value="0.93"/>
    <inertia ixx="0.0081" ixy="0" ixz="0" iyy="0.0079" iyz="0" izz="0.0006"/></inertial></link>
  <link name="wrist"><inertial><origin xyz="0.01 -0.06 -0.01"/><mass value="0.68"/>
    <inertia ixx="0.0016" ixy="0" ixz="0" iyy="0.0004" iyz="0" izz="0.0016"/></inertial></link>
  <link name="tool_frame"/>
  <joint name="joint_1" type="continuous"><parent link="base_link"/><child link="shoulder"/>
    <origin xyz="0 0 0.156" rpy="3.1416 0 0"/><axis xyz="0 0 1"/><limit effort="39" velocity="1.39"/></joint>
  <joint name="joint_2" type="revolute"><parent link="shoulder"/><child link="arm"/>
    <origin xyz="0 0.005 -0.128" rpy="1.5708 0 0"/><axis xyz="0 0 1"/>
    <limit lower="-2.24" upper="2.24" effort="39" velocity="1.39"/></joint>
  <joint name="joint_3" type="continuous"><parent link="arm"/><child link="forearm"/>
    <origin xyz="0 -0.21 -0.006" rpy="-1.5708 0 0"/><axis xyz="0 0 1"/><limit effort="39" velocity="1.39"/></joint>
  <joint name="joint_4" type="revolute"><parent link="forearm"/><child link="wrist"/>
    <origin xyz="0 0.006 -0.21" rpy="1.5708 0 0"/><axis xyz="0 0 1"/>
    <limit lower="-2.57" upper="2.57" effort="39" velocity="1.39"/></joint>
  <joint name="end_effector" type="fixed"><parent link="wrist"/><child link="tool_frame"/>
    <origin xyz="0 -0.2 0" rpy="1.5708 0 0"/></joint>
</robot>
"""


def _link(name, mass, com, moments):
    ixx, iyy, izz = moments
    return (
        f'<link name="{name}"><inertial><origin xyz="{com}" rpy="0.1 0.2 0.3"/><mass value="{mass}"/>'
        f'<inertia ixx="{ixx}" ixy="0" ixz="0" iyy="{iyy}" iyz="0" izz="{izz}"/></inertial></link>'
    )


def _joint(name, kind, parent, child, origin, axis, inside):
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{origin}"/><axis xyz="{axis}"/>{inside}</joint>'
    )


#: As Kinova's Jaco with a gripper, and as palletisers: a finger that two others and a fingertip follow, one of them a
#: slide, and a bar that keeps a flange level. Followers come before their leaders, as in many generated files.
JACO = "\n".join(
    [
        '<robot name="jaco"><link name="base"/>',
        _link("upper", 2.0, "0.2 0.01 0", (0.01, 0.035, 0.03)),
        _link("fore", 1.2, "0.15 0 0.02", (0.005, 0.01, 0.012)),
        _link("flange", 0.6, "0.05 0 0.01", (0.001, 0.0012, 0.0013)),
        _link("finger_1", 0.1, "0.03 0 0", (1e-5, 4e-5, 4.5e-5)),
        _link("finger_2", 0.12, "0.03 0.01 0", (1e-5, 4e-5, 4.5e-5)),
        _link("tip", 0.04, "0.02 0 0", (1e-5, 2e-5, 2.5e-5)),
        _link("pusher", 0.3, "0.01 0 0", (1e-4, 2e-4, 2.5e-4)),
        '<link name="tool"/>',
        _joint("level", "revolute", "fore", "flange", "0.3 0 0", "0 1 0",
               '<limit lower="-2.5" upper="2" velocity="2" effort="9"/><mimic joint="elbow" multiplier="-1"/>'),
        _joint("shoulder", "continuous", "base", "upper", "0 0 0.3", "0 0.6 0.8", '<limit velocity="2" effort="90"/>'),
        _joint("elbow", "revolute", "upper", "fore", "0.4 0 0", "0 1 0",
               '<limit lower="-2" upper="2.8" velocity="2" effort="60"/><dynamics damping="0.5" friction="0.3"/>'),
        _joint("joint_tip", "revolute", "finger_1", "tip", "0.05 0 0", "0 0 1",
               '<limit lower="0" upper="2" velocity="3" effort="1"/>'
               '<mimic joint="joint_finger_1" multiplier="1.05" offset="0.7"/>'
               '<dynamics damping="0.02" friction="0.04"/>'),
        _joint("joint_finger_2", "revolute", "flange", "finger_2", "0.1 -0.05 0", "0 0 -1",
               '<limit lower="0" upper="1.5" velocity="3" effort="1"/><mimic joint="joint_finger_1"/>'),
        _joint("joint_pusher", "prismatic", "flange", "pusher", "0.1 0 0.05", "1 0 0",
               '<limit lower="-0.02" upper="0.05" velocity="0.04" effort="20"/>'
               '<mimic joint="joint_tip" multiplier="-0.02" offset="0.014"/><dynamics damping="3" friction="2"/>'),
        _joint("joint_finger_1", "revolute", "flange", "finger_1", "0.1 0.05 0", "0 0 1",
               '<limit lower="-0.5" upper="1.4" velocity="3" effort="2"/>'),
        _joint("mount", "fixed", "flange", "tool", "0.15 0 0.01", "1 0 0", ""),
        "</robot>",
    ]
)  # fmt: skip
