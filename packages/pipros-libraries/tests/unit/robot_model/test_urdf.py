"""Descriptions of robots: joints and links, shapes and materials."""

from math import pi, sqrt

import pytest

from pipros_libraries.robot_model.urdf import Joint, Mimic, UrdfError, read_robot
from pipros_libraries.robot_model.visuals import named_files, read_shapes

LINKS = '<link name="base"/><link name="hand"/>'


def robot(inside: str) -> str:
    return f'<?xml version="1.0"?><robot name="r">{inside}</robot>'


def test_a_joint_is_read_with_all_its_attributes() -> None:
    read = read_robot(
        robot(
            f"""{LINKS}<joint name="j" type="revolute"><origin xyz="1 2 3" rpy="0 0 {pi}"/>
            <parent link="base"/><child link="hand"/><axis xyz="0 3 4"/><limit lower="-1" upper="2.5"/>
            <safety_controller soft_upper_limit="2"/><mimic joint="k" multiplier="-2" offset="0.5"/></joint>
            <transmission name="j"/><gazebo/>"""
        )
    )

    assert (read.name, read.links, read.root) == ("r", ("base", "hand"), "base")
    (joint,) = read.joints
    assert joint.origin == pytest.approx((1, 2, 3, 0, 0, 1, 0))
    assert joint.axis == pytest.approx((0, 0.6, 0.8))
    assert (joint.limits, joint.soft_limits) == ((-1.0, 2.5), (None, 2.0))
    assert joint.mimic == Mimic("k", -2.0, 0.5)


def test_missing_attributes_of_a_joint_have_defaults() -> None:
    text = '<joint name="j" type="fixed"><parent link="base"/><child link="hand"/></joint>'
    assert read_robot(robot(LINKS + text)).joints == (Joint("j", "fixed", "base", "hand"),)


def test_an_axis_is_made_one_long() -> None:
    text = """<joint name="j" type="continuous"><parent link="base"/><child link="hand"/>
              <axis xyz="{0} {0} {0}"/></joint>"""
    for size in (1, 1e-200, 1e200):
        found = read_robot(robot(LINKS + text.format(size))).joints[0].axis
        assert found == pytest.approx((1 / sqrt(3),) * 3)


def joint(parent: str = "base", child: str = "hand", name: str = "j", more: str = "") -> str:
    return f"""<joint name="{name}" type="continuous"><parent link="{parent}"/><child link="{child}"/>{more}
               </joint>"""


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("nothing", "not XML"),
        ("<!DOCTYPE a [<!ENTITY b ''>]><robot/>", "not XML"),
        ("<sdf/>", "must have the root element <robot>, got <sdf>"),
        (robot(""), "exactly one link, the root, must have no parent, got none"),
        (robot(LINKS), "got base and hand"),
        (robot("".join(f"<link name='{n}'/>" for n in range(1000))), r"got 0 and 1 and .*\.\.\.$"),
        (
            robot(LINKS + '<joint name="j" type="hinge"/>'),
            "type of joint j must be one of revolute, .*, got 'hinge'",
        ),
        (robot(LINKS + '<joint name="j" type="fixed"/>'), "joint j must have a <parent link=…> element"),
        (robot(LINKS + '<joint type="fixed"/>'), "line 1: <joint> must have a non-empty attribute 'name'"),
        (robot(LINKS + joint(child="foot")), "joint j has the child foot, which does not"),
        (
            robot(LINKS + joint() + joint(name="k")),
            "link hand must have one parent, but joint k adds a second parent",
        ),
        (robot(LINKS + joint() + joint()), "joint j is defined more than once"),
        (robot(LINKS + '<link name="base"/>'), "link base is defined more than once"),
        (
            robot(
                '<link name="a"/><link name="b"/><link name="c"/>'
                + joint("b", "c", "j")
                + joint("c", "b", "k")
            ),
            "links are in or below a cycle: b, c",
        ),
        (robot(LINKS + joint(more='<axis xyz="0 0 0"/>')), "axis of joint j must not be zero"),
        (robot(LINKS + joint(more='<axis xyz="0 1"/>')), "xyz of <axis> must be 3 finite numbers, got '0 1'"),
        (robot(LINKS + joint(more='<origin rpy="0 nan 0"/>')), "rpy of <origin> must be 3 finite numbers"),
        (robot(LINKS + joint(more='<limit lower="low"/>')), "lower of <limit> must be 1 finite number,"),
    ],
)
def test_links_that_are_not_a_tree_are_refused(text: str, complaint: str) -> None:
    with pytest.raises(UrdfError, match=complaint):
        read_robot(text)


# Shapes and materials of a URDF.


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
            "rgba of <color> must be 4 finite numbers",
        ),
    ],
)
def test_invalid_descriptions_are_explained(text: str, reason: str) -> None:
    with pytest.raises(UrdfError, match=reason):
        read_shapes(text)
