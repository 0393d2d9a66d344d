"""Launch files for the test nodes of the package rostest, and the outcome of each.

The only other node uses rospy alone, so pipros and genuine ROS can run the same files.
"""

from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any
from xml.etree import ElementTree
from xmlrpc.client import ServerProxy

import yaml

from tests.support.processes import Process
from tests.support.ros import RosSystem, Side

NODES = '<node pkg="around" type="level.py" name="level"/><param name="/ready" value="25"/>'
LEVEL = """#!/usr/bin/env python3
import rospy
from std_msgs.msg import String
from std_srvs.srv import Empty

rospy.init_node("level")
level = rospy.Publisher("level", String, queue_size=1)
rospy.Service("reset", Empty, lambda request: [])
rospy.Subscriber("orders", String, print)
rate = rospy.Rate(20)
while not rospy.is_shutdown():
    level.publish("%25")
    rate.sleep()
"""
MANIFEST = """<package format="2"><name>around</name><version>0.0.0</version><description>d</description>
<maintainer email="a@example.com">a</maintainer><license>none</license></package>"""


@dataclass(frozen=True, slots=True)
class Scene:
    """A test node with its parameters, which runs together with `NODES`.

    Attributes:
        cases: the expected contents of its result file: the class and name of each case, and whether it
            passes.
        expected: the text of the failure that pipros reports; empty if there is none.
    """

    node: str
    params: str
    cases: tuple[tuple[str, str, bool], ...]
    expected: str = ""

    @property
    def passes(self) -> bool:
        return all(passed for _, _, passed in self.cases)

    def write(self, folder: Path) -> None:
        """Create the package `around` in `folder`, with a launch file `scene.test` for this scene."""
        package = folder / "around"
        package.mkdir(parents=True)
        (package / "package.xml").write_text(MANIFEST)
        (package / "level.py").write_text(LEVEL)
        (package / "level.py").chmod(0o755)
        (package / "scene.test").write_text(
            f'<launch>{NODES}<test test-name="scene" pkg="rostest" type="{self.node}" time-limit="60">'
            f"<rosparam>{self.params}</rosparam></test></launch>"
        )


Cases = tuple[tuple[str, str, bool], ...]


def cases_in(results: Path) -> Cases:
    """Return the class and name of each case in a result file, and whether it passed."""
    root = ElementTree.parse(results).getroot()  # noqa: S314
    return tuple(
        (case.attrib["classname"], case.attrib["name"], len(case) == 0) for case in root.iter("testcase")
    )


class LevelSystem:
    """A master and the node `level`, with which the test nodes of one side are run without rostest."""

    def __init__(self, ros: RosSystem, side: Side, python: str, nodes: Path) -> None:
        """Start the master and the node. `nodes` is the folder of the test nodes, which `python` runs."""
        self._side, self._python, self._nodes = side, python, nodes
        side.start_bare_master()
        self._master: Any = ServerProxy(ros.master_uri)
        self._master.setParam("/a_test", "/ready", 25)
        program = ros.home / "level.py"
        program.write_text(LEVEL)
        side.start(python, program)
        ros.wait_for_publisher("/level")
        ros.wait_for_subscriber("/orders")

    def run(self, scene: Scene, name: str) -> tuple[Process, Cases]:
        """Run the test node of a scene under the name `name`. Return its process and its results."""
        for key, value in yaml.safe_load(scene.params).items():
            assert self._master.setParam("/a_test", f"/{name}/{key}", value)[0] == 1
        results = self._side.home / f"{name}.xml"
        ended = self._side.run(
            self._python, self._nodes / scene.node, f"--gtest_output=xml:{results}", f"__name:={name}",
            timeout_s=100,
        )  # fmt: skip
        return ended, cases_in(results)

    def close(self) -> None:
        self._master("close")()


def _one(kind: str, passed: bool) -> Cases:
    return ((f"__main__.{kind}Test", f"test_{kind.lower()}", passed),)


_hz, _param, _publish, _subscribe = (partial(_one, kind) for kind in ("Hz", "Param", "Publish", "Subscribe"))


def _advertise(topics: bool, services: bool) -> Cases:
    of = "__main__.AdvertiseTest"
    return ((of, "test_advertise_services", services), (of, "test_advertise_topics", topics))


SCENES = (
    Scene("hztest", "{topic: level, hz: 20, hzerror: 19, test_duration: 3.0}", _hz(True)),
    Scene("hztest", "{topic: level, hz: 1000, hzerror: 8, test_duration: 0.5}", _hz(False),
        "is not between 992.000Hz and 1008.000Hz"),
    Scene("hztest", "{topic: silent, hz: 20, hzerror: 8, test_duration: 0.5, wait_time: 0.5}", _hz(False),
        "no messages before timeout"),
    Scene("hztest", "{topic: level, hz: 20, test_duration: 0.5}", _hz(False), "hzerror] is not set"),
    Scene("hztest", "{hz: 20, hzerror: 8, test_duration: 0.5}", _hz(False), "topic] is not set"),
    Scene("hztest", "{topic: level, hz: -1, hzerror: 8, test_duration: 1}", _hz(False), "bad parameters"),
    Scene("paramtest", "{param_name_target: /ready, param_value_expected: 25}", _param(True)),
    Scene("paramtest", "{param_name_target: ready}", _param(True)),
    Scene("paramtest", "{param_name_target: /ready, param_value_expected: 26, test_duration: 0.2}",
        _param(False), "parameter [/ready] is 25, not 26"),
    Scene("paramtest", "{param_name_target: /unready, wait_time: 0.3}", _param(False),
        "parameter [/unready] was not set in time"),
    Scene("publishtest", "{topics: [{name: level}, {name: /orders, timeout: 1, negative: true}]}",
        _publish(True)),
    Scene("publishtest", "{topics: [{name: /orders, timeout: 0.5}]}", _publish(False),
        "a message on [/orders] did not appear within 0.5 s"),
    Scene("publishtest", "{topics: [{name: level, timeout: 60, negative: true}]}", _publish(False),
        "a message on [/level] exists, but must not"),
    Scene("advertisetest",
        "{topics: [{name: /level, type: std_msgs/String}, {name: /gone, timeout: 0.5, negative: true}],"
        " services: [{name: /reset, type: std_srvs/Empty}, {name: /gone, timeout: 0.5, negative: true}]}",
        _advertise(True, True)),
    Scene("advertisetest",
        "{topics: [{name: /level, type: std_msgs/Int8}], services: [{name: /gone, timeout: 0.5}]}",
        _advertise(False, False), "service [/gone] did not appear within 0.5 s"),
    Scene("advertisetest", "{topics: [{name: /level}], services: [{name: /reset, type: std_srvs/Trigger}]}",
        _advertise(True, False),
        "service [/reset] must have the type [std_srvs/Trigger], got [std_srvs/Empty]"),
)  # fmt: skip

ONLY_OURS = (
    Scene("subscribetest",
        "{topics: [{name: /orders, type: std_msgs/String}, {name: /level, timeout: 0.5, negative: true}]}",
        _subscribe(True)),
    Scene("subscribetest", "{topics: [{name: /level, timeout: 0.5}]}", _subscribe(False),
        "a subscriber of [/level] did not appear within 0.5 s"),
    # If no messages are expected, genuine hztest calls a method that Python 3.11 no longer has.
    Scene("hztest", "{topic: silent, hz: 0, test_duration: 0.3, wait_time: 0.3}", _hz(True)),
    Scene("hztest", "{topic: level, hz: 0, test_duration: 5, wait_time: 60}", _hz(False),
        "expected no messages, received"),
    # If they have nothing to check, genuine test nodes end with a traceback and write no results.
    Scene("publishtest", "{unused: 0}", _publish(False), "No topic is specified in rosparam."),
    Scene("subscribetest", "{unused: 0}", _subscribe(False), "No topic is specified in rosparam."),
    Scene("advertisetest", "{unused: 0}", _advertise(False, True),
        "No topic or service is specified in rosparam."),
)  # fmt: skip
"""Scenes for which genuine ROS has no test node, or in which its test node fails."""
