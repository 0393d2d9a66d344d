"""What genuine `roswtf` finds, ours finds, in the words of `pipros doctor`, in systems of either side."""

import json
import re
from collections import Counter
from functools import partial
from pathlib import Path
from typing import Any
from xmlrpc.client import ServerProxy

import pytest

from pipros.basics.env import Environment
from pipros.net.master_client import MasterClient
from pipros_tools.graph.observer import SystemObserver
from pipros_tools.health.examine import uncalled_address
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


@pytest.fixture
def environment(ros: RosSystem) -> dict[str, str]:
    """The environment of both sides: an empty package path, and writable folders."""
    root = ros.home / "share" / "ros"
    packages = ros.home / "src"
    for folder in (root, packages, ros.home / ".ros" / "log"):
        folder.mkdir(parents=True, exist_ok=True)
    return {
        "ROS_ROOT": str(root), "ROS_PACKAGE_PATH": str(packages), "PYTHONPATH": "",
        "PYTHONWARNINGS": "ignore",
    }  # fmt: skip


def findings(side: Side, environment: dict[str, str], *arguments: str) -> str:
    """Return the output of roswtf without colours."""
    done = side.run("roswtf", *arguments, **environment)
    assert done.returncode == 0, done.output
    return re.sub(r"\x1b\[\d+m", "", "\n".join(done.stdout))


def both(ros: RosSystem, environment: dict[str, str], *arguments: str) -> tuple[str, str]:
    return findings(ros.genuine, environment, *arguments), findings(ros.pipros, environment, *arguments)


def links_of_rosout(ros: RosSystem) -> int:
    """Return the number of publishers of /rosout to which the node /rosout is connected."""
    with ServerProxy(ros.master_uri) as api, ServerProxy(str(api.lookupNode("/test", "/rosout")[2])) as node:
        links: Any = node.getBusInfo("/test")
    return [link[4] for link in links[2]].count("/rosout")


FAULTS: dict[str, dict[str, str]] = {
    "ROS_PACKAGE_PATH": {"ROS_PACKAGE_PATH": "/nope:/etc/passwd"}, "PYTHONPATH": {"PYTHONPATH": "/not/there"},
    "ROS_LOG_DIR": {"ROS_LOG_DIR": "/etc/passwd"},
    "ROS_TEST_RESULTS_DIR": {"ROS_TEST_RESULTS_DIR": "/etc/hosts"}, "foo:1": {"ROS_MASTER_URI": "foo:1"},
    "http://localhost": {"ROS_MASTER_URI": "http://localhost"},
    "no.such.host.invalid:11311": {"ROS_MASTER_URI": "http://no.such.host.invalid:11311"},
    "ROS_HOSTNAME": {"ROS_HOSTNAME": "no.such.host.invalid"}, "ROS_IP [192.0.2.77]": {"ROS_IP": "192.0.2.77"},
    "/not/there/ros": {"ROS_ROOT": "/not/there/ros"}, "CONFIG_FILE": {"ROSCONSOLE_CONFIG_FILE": "/not/there"},
}  # fmt: skip
"""For each faulty environment, what both summaries name."""


def test_both_find_the_faults_of_an_environment(ros: RosSystem, environment: dict[str, str]) -> None:
    found = {}
    for name, changes in FAULTS.items():
        sides = both(ros, {**environment, **changes}, "--offline")
        found[name] = [
            name in text.partition("Static checks summary")[2].partition("=====")[0] for text in sides
        ]
    assert found == {name: [True, True] for name in FAULTS}
    healthy = both(ros, environment, "--offline")
    assert not any(name in text for text in healthy for name in FAULTS)


def test_both_print_the_same_usage(ros: RosSystem) -> None:
    for arguments in (["-h"], ["--nonsense"]):
        genuine, pipros = (side.run("roswtf", *arguments) for side in (ros.genuine, ros.pipros))
        assert (genuine.returncode, genuine.stdout) == (pipros.returncode, pipros.stdout)
        assert genuine.stderr == pipros.stderr


@pytest.mark.parametrize("master", ["genuine", "pipros"])
def test_both_find_the_same_faults_in_a_broken_system(ros, environment: dict[str, str], master: str) -> None:
    (ros.genuine if master == "genuine" else ros.pipros).start_master()
    ros.genuine.start("/usr/bin/python3", "-c", NODE).wait_for("up")
    ros.pipros.start("rostopic", "echo", "/chatter", "__name:=listener")
    ros.wait_for_subscriber("/chatter")
    ros.wait_for_subscriber("/nothing_else")
    observer = SystemObserver(MasterClient(ros.master_uri, "/test", timeout_s=30))

    def has_all_links() -> bool:
        links = Counter(link.topic for link in observer.poll().connections)
        return links == {"/chatter": 1, "/rosout": len(ros.publishers("/rosout"))}

    def found_by(side: Side) -> str:
        # Each roswtf is a node, whose link genuine rosout still has for a moment after its end.
        wait_until(lambda: links_of_rosout(ros) == len(ros.publishers("/rosout")), 60, "current links")
        return findings(side, environment, "--no-plugins")

    wait_until(has_all_links, 60, "all links")
    for text in (found_by(ros.genuine), found_by(ros.pipros)):
        assert "/nothing_else" in text
        assert " error(s)" not in text.partition("Online checks summary")[2]

    with ServerProxy(ros.master_uri) as api:
        any_api: Any = api
        any_api.registerPublisher("/ghost", "/chatter", "std_msgs/String", "http://127.0.0.1:1/")
        any_api.registerSubscriber("/deaf", "/chatter", "std_msgs/String", "http://127.0.0.1:1/")
        any_api.registerService("/ghost", "/dead", "rosrpc://127.0.0.1:2", "http://127.0.0.1:1/")
        any_api.setParam("/test", "/use_sim_time", True)
    for text in (found_by(ros.genuine), found_by(ros.pipros)):
        faults = text.partition("Online checks summary")[2]
        assert [name for name in ("/ghost", "/deaf", "/clock", "use_sim_time") if name not in faults] == []


def transform_findings(side: Side, environment: dict[str, str]) -> set[str] | None:
    """Return the findings about transforms, or None if in that second the nodes were not heard in turn."""
    lines = [line for line in findings(side, environment).splitlines() if line.strip()]
    after = lines[lines.index("running tf checks, this will take a second...") :]
    found = {re.sub(r"by -5\d\.\d+s", "by -50 s", line) for line in after}
    heard = [
        name for name in ("one", "other") if any(f" node [/{name}] publishing " in line for line in found)
    ]
    return found if len(heard) == 2 else None


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
    for text in (genuine, pipros):
        assert " * node [missing] in package [mine]" in text
        assert " * node [gone.py] in package [mine]" in text
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
    text = findings(ros.pipros, environment, "--offline", str(file), "pkg:=not_there")
    assert "ERROR Cannot find the following required packages:\n * not_there" in text


# `pipros doctor` examines systems of genuine ROS: rospy and roscpp nodes, with a genuine master.
HEALTHY_NODE = (
    "import rospy, std_msgs.msg as s, std_srvs.srv as v\n"
    "rospy.init_node('python'); p = rospy.Publisher('/chatter', s.String, queue_size=1)\n"
    "rospy.Service('/reset', v.Empty, lambda _: v.EmptyResponse())\n"
    "print('up', flush=True); rospy.spin()\n"
)


def doctor_findings(ros: RosSystem) -> list[dict[str, Any]]:
    report: dict[str, Any] = json.loads("\n".join(ros.pipros.run("pipros", "doctor", "--json").stdout))
    assert report["examined"] is not None
    return [found for found in report["findings"] if found["rule"] not in ("mixed-programs", "mixed-paths")]


def named(ros: RosSystem) -> set[tuple[str, ...]]:
    return {(found["rule"], *found["subjects"]) for found in doctor_findings(ros)}


def test_a_healthy_genuine_system_is_found_healthy_and_its_faults_are_named(ros: RosSystem) -> None:
    ros.genuine.start_master()
    ros.genuine.start("/usr/bin/python3", "-c", HEALTHY_NODE).wait_for("up")
    ros.genuine.start("rostopic", "echo", "/chatter", "__name:=ear")
    ros.genuine.start_node("cpp_battery", "battery_listener", "battery_topic:=/battery_topic")
    ros.genuine.start_node("composiv_tryouts", "composiv_talker.py")
    ros.wait_for_subscriber("/battery_topic")
    ros.wait_for_subscriber("/chatter")
    wait_until(lambda: doctor_findings(ros) == [], 60.0, "no doctor_findings")

    wrong = ros.genuine.start(
        "rostopic", "pub", "-r", "5", "/chatter", "std_msgs/Int32", "1", "__name:=wrong"
    )
    wait_until(lambda: "/wrong" in ros.publishers("/chatter"), 60.0)
    wait_until(lambda: ("publishers-differ", "/chatter", "/python", "/wrong") in named(ros), 60.0)
    wrong.kill()
    wrong.wait()
    wait_until(lambda: ("ghost-node", "/wrong") in named(ros), 60.0)


def test_a_genuine_master_calls_the_doctor_back_and_keeps_nothing_of_it(ros: RosSystem) -> None:
    ros.genuine.start_master()
    environment = Environment(master_uri=ros.master_uri, ip="127.0.0.1")
    wait_until(lambda: uncalled_address(environment, timeout_s=30.0) == "", what="a call from the master")
    with ServerProxy(ros.master_uri) as master:
        kept = master.getParam("/test", "/"), master.getSystemState("/test")
    assert "pipros_doctor" not in str(kept)
