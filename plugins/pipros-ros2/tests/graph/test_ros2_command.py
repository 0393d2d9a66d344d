"""`pipros ros2` as a command: its output, its status and its end."""

from __future__ import annotations

import signal

import pytest

from tests.support.ros import RosSystem
from tests.support.ros2_domains import free_domain
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
