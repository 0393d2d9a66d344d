"""`roswtf` compared with that of genuine ROS, in the same environments and on the same faulty system."""

from __future__ import annotations

import re
from collections import Counter
from functools import partial
from pathlib import Path
from typing import Any
from xmlrpc.client import ServerProxy

import pytest

from pipros.graph.observer import SystemObserver
from pipros.net.master_client import MasterClient
from tests.support.answers import ask
from tests.support.ros import RosSystem, Side
from tests.support.waiting import wait_until

NODE = (
    "import rospy, std_msgs.msg as s, std_srvs.srv as v\n"
    "rospy.init_node('talker'); p = rospy.Publisher('/chatter', s.String, queue_size=1)\n"
    "rospy.Service('/ok', v.Empty, lambda _: v.EmptyResponse())\n"
    "rospy.Subscriber('/nothing', s.String); rospy.Subscriber('/nothing_else', s.String)\n"
    "print('up', flush=True); rospy.spin()\n"
)

TRANSFORMS = """
import math, sys, rospy
from geometry_msgs.msg import TransformStamped
from tf2_msgs.msg import TFMessage

rospy.init_node(sys.argv[1])
publisher = rospy.Publisher("/tf", TFMessage, queue_size=10)
message = TFMessage()
for parent, child, length in (("map", "odom", 1), ("world", "odom", 1), ("a", "b", 2), ("b", "a", 1)):
    one = TransformStamped(child_frame_id=child)
    one.header.frame_id = parent
    one.transform.rotation.w = length
    message.transforms.append(one)
while not rospy.is_shutdown():
    now = rospy.Time.now()
    for transform in message.transforms:
        transform.header.stamp = now
    message.transforms[0].header.stamp = now - rospy.Duration(50)
    publisher.publish(message)
    rospy.sleep(0.02)
"""

_LEFT_OUT = re.compile(
    r"Loaded plugin tf.tfwtf|rosdep|ROS Dep|pycrypto|paramiko|Debian packages|pip installed|core ROS Python"
)
"""Rules about rosdep, pip and ssh libraries, which pipros does without; the plugin that Debian's tf lacks."""


@pytest.fixture
def environment(ros: RosSystem) -> dict[str, str]:
    """The environment of both sides: an empty package path, and writable folders."""
    root = ros.home / "share" / "ros"
    packages = ros.home / "src"
    for folder in (root, packages, ros.home / ".ros" / "log"):
        folder.mkdir(parents=True, exist_ok=True)
    return {
        "ROS_ROOT": str(root),
        "ROS_PACKAGE_PATH": str(packages),
        "PYTHONPATH": "",
        "PYTHONWARNINGS": "ignore",
    }


def findings(side: Side, environment: dict[str, str], *arguments: str) -> list[str]:
    """Return the output of roswtf without colours, the lines of omitted rules, and their count."""
    run = ask if "--offline" in arguments else Side.run
    done = run(side, "roswtf", *arguments, timeout_s=60.0, **environment)
    assert done.returncode == 0, done.output
    lines = [re.sub(r"\x1b\[\d+m", "", line) for line in done.stdout]
    kept = [line for line in lines if not _LEFT_OUT.search(line) and line.strip()]
    return [
        line
        for line in kept
        if not re.match(r"Found \d+ warning|Warnings are things|No errors or warnings", line)
    ]


def both(ros: RosSystem, environment: dict[str, str], *arguments: str) -> tuple[list[str], list[str]]:
    return findings(ros.genuine, environment, *arguments), findings(ros.pipros, environment, *arguments)


def links_of_rosout(ros: RosSystem) -> int:
    """Return the number of publishers of /rosout to which the node /rosout is connected."""
    with ServerProxy(ros.master_uri) as api, ServerProxy(str(api.lookupNode("/test", "/rosout")[2])) as node:
        links: Any = node.getBusInfo("/test")
    return [link[4] for link in links[2]].count("/rosout")


ENVIRONMENTS: dict[str, dict[str, str]] = {
    "nothing wrong": {},
    "paths": {"ROS_PACKAGE_PATH": "/nope:/etc/passwd", "PYTHONPATH": "/not/there"},
    "folders": {"ROS_LOG_DIR": "/etc/passwd", "ROS_TEST_RESULTS_DIR": "/etc/hosts"},
    "master": {"ROS_MASTER_URI": "foo:1"},
    "no port": {"ROS_MASTER_URI": "http://localhost"},
    "empty": {"ROS_PACKAGE_PATH": "", "ROS_MASTER_URI": ""},
    "unknown master": {"ROS_MASTER_URI": "http://no.such.host.invalid:11311"},
    "unknown name": {"ROS_HOSTNAME": "no.such.host.invalid"},
    "root": {"ROS_ROOT": "/not/there/ros"},
    "log configuration": {"ROSCONSOLE_CONFIG_FILE": "/not/there"},
}


@pytest.mark.timeout(400)  # forty processes
def test_both_find_the_same_in_an_environment(ros: RosSystem, environment: dict[str, str]) -> None:
    different = {}
    for name, changes in ENVIRONMENTS.items():
        genuine, pipros = both(ros, {**environment, **changes}, "--offline")
        if sorted(genuine) != sorted(pipros):
            different[name] = genuine, pipros
    assert different == {}


def test_both_warn_about_a_foreign_ip(ros: RosSystem, environment: dict[str, str]) -> None:
    for lines in both(ros, {**environment, "ROS_IP": "192.0.2.77"}, "--offline"):
        text = "WARNING ROS_IP may be incorrect: ROS_IP [192.0.2.77] does not appear to be an IP address"
        assert any(line.startswith(text) for line in lines)


def test_both_print_the_same_usage(ros: RosSystem) -> None:
    for arguments in (["-h"], ["--nonsense"]):
        genuine, pipros = (ask(side, "roswtf", *arguments) for side in (ros.genuine, ros.pipros))
        assert (genuine.returncode, genuine.stdout) == (pipros.returncode, pipros.stdout)
        assert genuine.stderr == pipros.stderr


@pytest.mark.timeout(400)
@pytest.mark.parametrize("master", ["genuine", "pipros"])
def test_both_find_the_same_faults_in_a_broken_system(
    ros: RosSystem, environment: dict[str, str], master: str
) -> None:
    (ros.genuine if master == "genuine" else ros.pipros).start_master()
    ros.genuine.start("/usr/bin/python3", "-c", NODE).wait_for("up")
    ros.pipros.start("rostopic", "echo", "/chatter", "__name:=listener")
    ros.wait_for_subscriber("/chatter")
    ros.wait_for_subscriber("/nothing_else")
    observer = SystemObserver(MasterClient(ros.master_uri, "/test", timeout_s=30))

    def has_all_links() -> bool:
        links = Counter(link.topic for link in observer.poll().connections)
        return links == {"/chatter": 1, "/rosout": len(ros.publishers("/rosout"))}

    def found_by(side: Side) -> list[str]:
        # Each roswtf is a node, whose link genuine rosout still has for a moment after its end.
        wait_until(lambda: links_of_rosout(ros) == len(ros.publishers("/rosout")), 60, "current links")
        return findings(side, environment, "--no-plugins")

    wait_until(has_all_links, 60, "all links")
    genuine, pipros = found_by(ros.genuine), found_by(ros.pipros)
    assert sorted(pipros) == sorted(genuine)
    assert "   * /nothing_else" in pipros

    with ServerProxy(ros.master_uri) as api:
        any_api: Any = api
        any_api.registerPublisher("/ghost", "/chatter", "std_msgs/String", "http://127.0.0.1:1/")
        any_api.registerSubscriber("/deaf", "/chatter", "std_msgs/String", "http://127.0.0.1:1/")
        any_api.registerService("/ghost", "/dead", "rosrpc://127.0.0.1:2", "http://127.0.0.1:1/")
        any_api.setParam("/test", "/use_sim_time", True)
    genuine, pipros = found_by(ros.genuine), found_by(ros.pipros)
    assert sorted(pipros) == sorted(genuine)
    assert "Found 4 error(s)." in pipros


def transform_findings(side: Side, environment: dict[str, str]) -> set[str] | None:
    """Return the findings about transforms, or None if in that second the nodes were not heard in turn."""
    lines = findings(side, environment)
    after = lines[lines.index("running tf checks, this will take a second...") :]
    found = {re.sub(r"by -5\d\.\d+s", "by -50 s", line) for line in after}
    heard = [
        name for name in ("one", "other") if any(f" node [/{name}] publishing " in line for line in found)
    ]
    return found if len(heard) == 2 else None


@pytest.mark.timeout(400)
def test_both_find_the_same_in_contradicting_transforms(ros: RosSystem, environment: dict[str, str]) -> None:
    rules = ros.home / "rules" / "tf_rules"  # Debian has the plugin, and no package that exports it
    rules.mkdir(parents=True)
    (rules / "manifest.xml").write_text(  # for a package.xml it would query rosdep's database
        "<package><description>d</description><author>m</author><license>x</license>"
        "<depend package='roswtf'/><export><roswtf plugin='tf.tfwtf'/></export></package>"
    )
    ros.pipros.start_master()
    for name in ("one", "other"):
        ros.genuine.start("/usr/bin/python3", "-c", TRANSFORMS, name)
    wait_until(lambda: len(ros.publishers("/tf")) == 2)
    found = []
    for side, path in ((ros.genuine, f"{rules.parent}:/usr/share"), (ros.pipros, str(ros.home / "src"))):
        variables = {**environment, "ROS_PACKAGE_PATH": path}
        found.append(wait_until(partial(transform_findings, side, variables), 150) or set())
    assert found[0] == found[1]
    assert "ERROR TF cycle detection::" in found[1]
    assert " * rotation from [a] to [b] is not unit length, 2.0" in found[1]
    assert " * reparenting of [odom] to [world] by [/one]" in found[1]


@pytest.mark.timeout(400)
def test_both_check_launch_files(ros: RosSystem, environment: dict[str, str]) -> None:
    package = ros.home / "src" / "mine"
    package.mkdir()
    (package / "package.xml").write_text(
        "<package format='2'><name>mine</name><version>1.0.0</version><description>d</description>"
        "<maintainer email='me@example.org'>m</maintainer><license>x</license></package>"
    )
    (package / "bad.launch").write_text(
        '<launch><node name="a" pkg="mine" type="missing"/>'
        '<node name="b" pkg="mine" type="gone.py"/></launch>'
    )
    (package / "broken.launch").write_text('<launch><node name="a" pkg="mine"/></launch>')
    genuine, pipros = both(ros, environment, "--offline", "--no-plugins", str(package / "bad.launch"))
    assert sorted(pipros) == sorted(genuine)
    assert " * node [gone.py] in package [mine]" in pipros
    for file in ("broken.launch", "nothing.launch"):
        for side in (ros.genuine, ros.pipros):
            done = side.run("roswtf", "--no-plugins", str(package / file), **environment)
            assert done.returncode == 0
            assert any(
                line.startswith(f"Unable to load roslaunch file [{package / file}]") for line in done.stderr
            )


def test_a_package_without_a_program_is_named(ros: RosSystem, environment: dict[str, str]) -> None:
    file: Path = ros.home / "x.launch"
    file.write_text('<launch><arg name="pkg"/><node name="a" pkg="$(arg pkg)" type="x"/></launch>')
    lines = findings(ros.pipros, environment, "--offline", str(file), "pkg:=not_there")
    assert "ERROR Cannot find the following required packages:" in lines
    assert " * not_there" in lines
