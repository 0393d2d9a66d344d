"""`pipros ros2` as a command: its output, its status and its end."""

import hashlib
import signal
from pathlib import Path
from typing import Any

import pytest

from pipros.msg import load_message_class
from pipros.node.codec import encoder
from pipros_libraries.topic_tools.raw import class_like
from pipros_ros2.interface import Durability, EndpointKind, Sample, TopicQos
from pipros_ros2.type_pairs import TypePairs
from pipros_rosbag2.conversion.mapping import BUILTIN_RULES
from pipros_rosbag2.distribution import Distribution
from tests.support.ros import RosSystem
from tests.support.ros2_domains import free_domain
from tests.support.ros2_gateways import PAIRS, System
from tests.support.waiting import wait_until


def test_a_gateway_runs_as_a_command(ros: RosSystem) -> None:
    ros.serve_master()
    none = ros.pipros.run("pipros", "ros2", "status")
    assert (none.returncode, none.output.strip()) == (
        1,
        "ERROR: no gateway is running; start one with `pipros ros2`",
    )
    ros.pipros.start("rostopic", "pub", "-l", "/map", "std_msgs/String", "hello")
    ros.pipros.start("rostopic", "pub", "-l", "/secret", "std_msgs/String", "hidden")
    with free_domain() as domain:
        (ros.home / "rules.yaml").write_text("topics: {to_ros2: {deny: [/secret]}}\n")
        words = ("pipros", "ros2", "--domain", str(domain), "--rules", "rules.yaml")
        gateway = ros.pipros.start(*words)
        gateway.wait_for(rf"connected to domain {domain} \(range LOCALHOST\)")
        gateway.wait_for(rf"start here are in domain 0, unless ROS_DOMAIN_ID={domain} is set for them")

        second = ros.pipros.run(*words)
        assert second.returncode == 1
        assert f"already running: [/ros2_gateway_{domain}]" in second.output

        def status() -> str:
            return ros.pipros.run("pipros", "ros2", "status").output

        wait_until(lambda: "/map (std_msgs/String -> std_msgs/msg/String)" in status(), 60, what="the topic")
        assert f"/ros2_gateway_{domain}:" in status()
        wait_until(
            lambda: (
                "left out: topics: to_ros2: /secret: the deny list (topics: to_ros2) contains /secret"
                in status()
            ),
            60,
            what="the reason",
        )

        gateway.send_signal(signal.SIGINT)
        assert gateway.wait(30) == 0
        assert "Traceback" not in gateway.output


@pytest.mark.parametrize(("words", "text"), [
    (["--domain", "300"], "ERROR: the ROS 2 domain must be from 0 to 101, got 300"),
    (["--distro", "foxy"], "ERROR: --distro must be one of humble, jazzy, kilted, lyrical, got [foxy]"),
    (["--rules", "missing.yaml"], "ERROR: cannot read missing.yaml: No such file or directory"),
])  # fmt: skip
def test_invalid_options_are_one_line(ros: RosSystem, words: list[str], text: str) -> None:
    result = ros.pipros.run("pipros", "ros2", *words)

    assert (result.returncode, result.output.strip()) == (1, text)


@pytest.mark.parametrize(("words", "text"), [
    (["--engine", "zenoh"], "--engine must be dds or rclpy, got zenoh"),
    (
        ["--ros2-python", "python3", "--zenoh"],
        "--zenoh and --router are not for --engine rclpy; set RMW_IMPLEMENTATION instead",
    ),
])  # fmt: skip
def test_engines_that_contradict_each_other_are_refused(ros: RosSystem, words: list[str], text: str) -> None:
    result = ros.pipros.run("pipros", "ros2", *words)

    assert result.returncode == 2
    assert result.output.strip().endswith(f"error: {text}")


def test_programs_in_the_background_of_a_script_end_on_ctrl_c(ros: RosSystem) -> None:
    ignoring = "trap '' INT; exec pipros ros2"
    with free_domain() as domain:
        words = f"--domain {domain} /words std_msgs/msg/String"
        pub = ros.pipros.start("sh", "-c", f"{ignoring} pub -r 10 {words} '{{data: hello}}'")
        echo = ros.pipros.start("sh", "-c", f"{ignoring} echo {words}")
        echo.wait_for("data: hello")
        for process in (echo, pub):
            process.send_signal(signal.SIGINT)
            assert process.wait() == 0, process.output


def test_parameters_of_a_node_are_written_for_ros2(ros: RosSystem) -> None:
    ros.serve_master()
    ros.pipros.run("rosparam", "set", "/camera", "{rate: 30, gains: [1, 2.5], table: [[1], [2]]}")

    dumped = ros.pipros.run("rosparam", "dump", "--ros2", "/camera")
    assert dumped.stdout == [
        *("/camera:", "  ros__parameters:", "    gains:", "    - 1.0", "    - 2.5", "    rate: 30")
    ]
    assert dumped.stderr == [
        "WARNING: /camera/table is left out: arrays in ROS 2 have at least one element, and elements of one "
        "simple type"
    ]
    assert ros.pipros.run("rosparam", "dump", "--ros2", "/camera", "camera.yaml").returncode == 0
    assert (ros.home / "camera.yaml").read_text() == "\n".join([*dumped.stdout, ""])


# What users of ros1_bridge have reported.


Log: Any = load_message_class("rosgraph_msgs/Log")
LOG = "rcl_interfaces/msg/Log"
GRIPPER = "robot_msgs/msg/Gripper"
FIELDS = "float32 width\nstring state\n"


@pytest.mark.parametrize("is_allowed", [True, False])
def test_rosout_of_ros2_arrives_latched_if_it_is_allowed(*, is_allowed: bool) -> None:
    """ros1_bridge#278: earlier entries did not arrive."""
    rules = "topics: {to_ros1: {allow: [/rosout, '*']}}" if is_allowed else ""
    with free_domain() as domain:
        system = System(domain, has_zenoh=False)
        entry = Log(name="driver", msg="too hot", level=Log.WARN)
        cdr = PAIRS.of_ros2(LOG).plan.to_cdr(b"".join(encoder(Log)(entry)))
        latched = TopicQos(durability=Durability.TRANSIENT_LOCAL, depth=1000)
        system.advertise("/rosout", LOG, PAIRS.of_ros2(LOG).type_hash, latched).publish(cdr)
        gateway = system.gateway(rules)
        if is_allowed:
            received: list[Any] = []
            system.ros1.subscribe("/rosout", Log, received.append)
            wait_until(lambda: any(each.name == "driver" for each in received), what="the entry")
            found = next(each for each in received if each.name == "driver")
            assert (found.msg, found.level) == ("too hot", Log.WARN)
        else:
            wait_until(lambda: "topics: to_ros1: /rosout" in gateway.status().left_out, what="the reason")
        system.close()


def test_types_that_no_package_in_ros1_defines_need_no_compilation(tmp_path: Path) -> None:
    """ros1_bridge#28, #77, #271, #348, #394, #431: "No template specialization for the pair"."""
    (tmp_path / "robot_msgs" / "msg").mkdir(parents=True)
    (tmp_path / "robot_msgs" / "package.xml").write_text("<package><name>robot_msgs</name></package>")
    (tmp_path / "robot_msgs" / "msg" / "Gripper.msg").write_text(FIELDS)
    pairs = TypePairs(Distribution.JAZZY, BUILTIN_RULES, [tmp_path])
    md5sum = hashlib.md5(FIELDS.strip().encode()).hexdigest()  # noqa: S324 # ROS 1 requires it
    header = {"type": "robot_msgs/Gripper", "md5sum": md5sum, "message_definition": FIELDS}
    with free_domain() as domain:
        system = System(domain, has_zenoh=False)
        system.gateway(pairs=pairs)
        publisher = system.ros1.advertise("/gripper", class_like(header))
        wait_until(lambda: system.has(EndpointKind.PUBLISHER, "/gripper"), what="the topic in ROS 2")
        (endpoint,) = [each for each in system.ros2.endpoints() if each.name == "/gripper"]
        samples: list[Sample] = []
        system.ros2.subscribe("/gripper", GRIPPER, endpoint.type_hash, TopicQos(), samples.append)

        def publish() -> list[Sample]:
            publisher.publish(publisher.publication.message_class(b"\0\0\x80?\4\0\0\0open"))
            return samples

        wait_until(publish, what="a message")
        expected = b"\0\1\0\0" + b"\0\0\x80?" + b"\5\0\0\0open\0"
        assert bytes(samples[0].payload[: len(expected)]) == expected  # padding may follow
        system.close()
