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
