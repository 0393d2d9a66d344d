from __future__ import annotations

from math import pi, sqrt

import pytest

from pipros_libraries.robot_model.urdf import Joint, Mimic, UrdfError, read_robot

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
              <axis xyz="1 1 1"/></joint>"""
    assert read_robot(robot(LINKS + text)).joints[0].axis == pytest.approx((1 / sqrt(3),) * 3)


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
