"""The Python API of roslaunch behaves like the genuine one: a program prints the same with both."""

from __future__ import annotations

import difflib
import json
from pathlib import Path

import pytest

from tests.support.programs import make_programs
from tests.support.ros import RosSystem, Side

PROGRAMS = Path(__file__).parent / "programs"

FILES = {
    "x.launch": """<launch>
  <arg name="n" default="a" doc="a name"/><arg name="r"/>
  <node pkg="programs" type="sleeper" name="$(arg n)" args="1 $(arg r)">
    <remap from="a" to="b"/><env name="E" value="v"/>
  </node>
  <include file="$(dirname)/y.launch"/><param name="q" value="1"/>
</launch>""",
    "y.launch": '<launch><node pkg="programs" type="fails" name="f" output="screen"/></launch>',
    "bad.launch": '<launch><arg name="w" default=""/><node pkg="a"/></launch>',
    "full.launch": """<launch>
  <arg name="x"/><arg name="d" default="dd"/><arg name="v" value="vv"/>
  <param name="p" value="7"/><param name="text" value="longer than twenty characters"/>
  <rosparam>{a: {b: [1, 2.5, yes]}}</rosparam>
  <group ns="g" clear_params="true">
    <node pkg="a" type="b" name="c" output="screen" respawn="true" respawn_delay="2"/>
  </group>
  <machine name="m" address="127.0.0.1" env-loader="/env.sh"/>
  <node pkg="a" type="b" name="d" cwd="ros_home" machine="m" args="&lt;$(arg x)&gt;" launch-prefix="nice">
    <remap from="x" to="y"/><env name="A" value="1"/><param name="z" value="1"/>
  </node>
  <node pkg="a" type="b" name="e" cwd="node" output="log" required="true" nonsense="1"/>
  <test pkg="a" type="t" test-name="tt" time-limit="3" retry="2"/>
  <test pkg="a" type="t" test-name="uu" name="named" ns="q"/>
  <rosparam command="dump" file="/o" ns="x"/>
</launch>""",
}

MANIFEST = (
    '<package format="2"><name>programs</name><version>0.0.1</version><description>d</description>'
    '<maintainer email="a@example.org">A</maintainer><license>Apache-2.0</license></package>'
)

DIFFERENT = {
    "no xml": "errors have the words of pipros, with file, line and column",
    "bad element": "likewise",
    "bad": "likewise",
    "errors": "the unknown attribute is named with its place",
    "unset ignored": "genuine reads nothing after the first argument that is not set",
}
"""Where pipros differs on purpose, by label; why."""


TEST_PROGRAM = """#!/usr/bin/env python3
import unittest, rosunit
class Cases(unittest.TestCase):
    def test_one(self): pass
    def test_two(self): self.assertEqual(1, 2)
rosunit.unitrun("programs", "case", Cases)
"""

TEST_FILE = """<launch>
  <node pkg="programs" type="sleeper" name="s"/>
  <test pkg="programs" type="prog.py" test-name="aa"/>
  <test pkg="programs" type="nope" test-name="bb"/>
  <test pkg="programs" type="ends" test-name="cc"/>
</launch>"""


@pytest.fixture
def package(ros: RosSystem) -> Path:
    """A package with programs and launch files, which both sides find."""
    programs = {
        "sleeper": "#!/bin/sh\nexec sleep 1000\n",
        "fails": "#!/bin/sh\nexit 3\n",
        "ends": "#!/bin/sh\nexit 0\n",
        "prog": "#!/bin/sh\n",
        "prog.py": TEST_PROGRAM,
    }
    folder = make_programs(ros.home / "src" / "programs", programs)
    (folder / "package.xml").write_text(MANIFEST)
    for name, text in {**FILES, "t.test": TEST_FILE}.items():
        (folder / name).write_text(text)
    for side in (ros.genuine, ros.pipros):
        side.environment["ROS_PACKAGE_PATH"] = f"{folder.parent}:{side.environment['ROS_PACKAGE_PATH']}"
    return folder


def outcomes(side: Side, program: str, folder: Path) -> list[str]:
    """Return the `label | outcome` lines of the program's output."""
    ended = side.run("python3", "-W", "ignore", PROGRAMS / program, folder, timeout_s=240, ROS_IP="127.0.0.1")
    assert ended.returncode == 0, ended.output
    found = []
    for line in ended.stdout:
        # The output of a thread may be in the same line, before it and after it.
        _, mark, record = line.partition("@@")
        if mark:
            label, outcome = json.JSONDecoder().raw_decode(record)[0]
            if label not in DIFFERENT:
                found.append(f"{label} | {json.dumps(outcome)}")
    return found


@pytest.mark.timeout(600)  # the program starts a dozen launches, twice
def test_the_library_does_what_genuine_roslaunch_does(ros: RosSystem, package: Path) -> None:
    ros.pipros.start_master()
    genuine, ours = (outcomes(side, "examine_launch.py", package) for side in (ros.genuine, ros.pipros))
    assert len(genuine) > 150
    assert "\n".join(difflib.unified_diff(genuine, ours, "genuine", "pipros", lineterm="", n=0)) == ""


@pytest.mark.timeout(600)
def test_the_libraries_of_tests_do_what_genuine_ones_do(ros: RosSystem, package: Path) -> None:
    genuine, ours = (outcomes(side, "examine_rostest.py", package) for side in (ros.genuine, ros.pipros))
    assert len(genuine) > 44
    assert "\n".join(difflib.unified_diff(genuine, ours, "genuine", "pipros", lineterm="", n=0)) == ""
