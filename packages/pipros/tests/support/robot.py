"""A package with a robot description in xacro, and a launch file that loads it."""

from pathlib import Path

_FILES = {
    "package.xml": """<package format="2"><name>arm_description</name><version>1.0.0</version>
<description>d</description><maintainer email="m@example.org">m</maintainer><license>none</license>
<exec_depend>xacro</exec_depend></package>
""",
    "urdf/hinge.xacro": """<robot xmlns:xacro="http://www.ros.org/wiki/xacro">
  <xacro:macro name="hinge" params="name parent child length *axis">
    <joint name="${name}" type="revolute">
      <parent link="${parent}"/><child link="${child}"/>
      <origin xyz="0 0 ${length / 2}" rpy="0 ${pi / 4} 0"/><xacro:insert_block name="axis"/>
      <limit lower="${-pi}" upper="${pi}" effort="1" velocity="1"/>
    </joint>
  </xacro:macro>
</robot>
""",
    "urdf/arm.urdf.xacro": """<?xml version="1.0"?>
<robot name="arm" xmlns:xacro="http://www.ros.org/wiki/xacro">
  <xacro:arg name="length" default="1.0"/>
  <xacro:include filename="$(find arm_description)/urdf/hinge.xacro"/>
  <link name="base"/><link name="upper"/><link name="lower"/><link name="slider"/><link name="finger"/>
  <link name="camera"/><link name="plate"/>
  <xacro:hinge name="shoulder" parent="base" child="upper" length="$(arg length)">
    <axis xyz="0 0 1"/>
  </xacro:hinge>
  <xacro:hinge name="elbow" parent="upper" child="lower" length="2"><axis xyz="0 1 1"/></xacro:hinge>
  <joint name="slide" type="prismatic">
    <parent link="lower"/><child link="slider"/><axis xyz="1 0 0"/>
    <limit lower="0.5" upper="1.5" effort="1" velocity="1"/>
  </joint>
  <joint name="follower" type="continuous">
    <parent link="slider"/><child link="finger"/><axis xyz="0 0 1"/>
    <mimic joint="slide" multiplier="-0.5" offset="0.25"/>
  </joint>
  <joint name="mount" type="fixed">
    <parent link="base"/><child link="camera"/><origin xyz="0.1 0.2 0.3" rpy="0.1 0.2 0.3"/>
  </joint>
  <joint name="table" type="planar"><parent link="base"/><child link="plate"/><origin xyz="1 0 0"/></joint>
</robot>
""",
    "launch/arm.launch": """<launch>
  <arg name="length" default="3"/>
  <param name="robot_description"
         command="$(find xacro)/xacro --inorder
                  $(find arm_description)/urdf/arm.urdf.xacro length:=$(arg length)"/>
</launch>
""",
}


def make_robot_package(workspace: Path) -> Path:
    """Create the package `arm_description` in `workspace`, and return the package's folder."""
    package = workspace / "arm_description"
    for name, text in _FILES.items():
        (package / name).parent.mkdir(parents=True, exist_ok=True)
        (package / name).write_text(text)
    return package
