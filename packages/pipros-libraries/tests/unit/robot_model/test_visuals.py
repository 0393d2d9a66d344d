"""Shapes and materials of a URDF."""

from __future__ import annotations

import pytest

from pipros_libraries.robot_model.urdf import UrdfError
from pipros_libraries.robot_model.visuals import named_files, read_shapes

ROBOT = """
<robot name="r">
  <material name="blue"><color rgba="0 0 1 0.5"/></material>
  <link name="a">
    <visual>
      <origin xyz="1 2 3"/>
      <geometry><box size="1 2 3"/></geometry>
      <material name="blue"/>
    </visual>
    <visual><geometry><cylinder radius="0.5" length="2"/></geometry></visual>
    <collision><geometry><sphere radius="2"/></geometry></collision>
  </link>
  <link name="b">
    <visual>
      <geometry><mesh filename="package://p/m.stl" scale="1 1 2"/></geometry>
      <material name="wood"><texture filename="package://p/wood.png"/></material>
    </visual>
    <visual><geometry><sphere radius="1"/></geometry><material name="wood"/></visual>
  </link>
</robot>"""


def test_shapes_have_sizes_poses_and_materials() -> None:
    first, second = read_shapes(ROBOT)
    box, cylinder = first.visuals
    assert (box.kind, box.size, box.origin[:3], box.color) == ("box", (1, 2, 3), (1, 2, 3), (0, 0, 1, 0.5))
    assert (cylinder.kind, cylinder.size, cylinder.color) == ("cylinder", (0.5, 0.5, 2), None)
    assert first.collisions[0].size == (2, 2, 2)
    mesh, sphere = second.visuals
    assert (mesh.uri, mesh.size, mesh.texture) == ("package://p/m.stl", (1, 1, 2), "package://p/wood.png")
    assert sphere.texture == mesh.texture


def test_the_files_of_a_robot_are_those_of_meshes_and_textures() -> None:
    assert named_files(read_shapes(ROBOT)) == {"package://p/m.stl", "package://p/wood.png"}


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("<robot", "not XML"),
        ("<a/>", "root element <robot>"),
        ("<robot><link name='a'><visual/></link></robot>", "<geometry>"),
        (
            "<robot><link name='a'><visual><geometry/></visual></link></robot>",
            "<box>, <cylinder>, <sphere> or <mesh>",
        ),
        (
            "<robot><material name='m'><color rgba='1 1'/></material></robot>",
            "rgba of <color> must be 4 numbers",
        ),
    ],
)
def test_invalid_descriptions_are_explained(text: str, reason: str) -> None:
    with pytest.raises(UrdfError, match=reason):
        read_shapes(text)
