"""The sixty most frequent combinations of programs in public launch files, fed from a bag."""

import os
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest

from pipros.basics.errors import PiprosError
from pipros.msg import load_message_class, load_service_class
from pipros.node import Node
from pipros_libraries.teleoperation.joystick import BUTTON, EVENT
from tests.support.bags import bag_bytes
from tests.support.launch_combinations import COUNT, combinations
from tests.support.launch_recipes import SERVICES, Output, launch_file, rows, write_files
from tests.support.nodes import Inbox
from tests.support.ros import RosSystem
from tests.support.simulated_rplidar import SimulatedRplidar
from tests.support.simulated_urg import SimulatedUrg
from tests.support.waiting import wait_until

AT_ONCE = 10


def test_the_combinations_differ() -> None:
    assert len(set(combinations())) == COUNT


@pytest.mark.parametrize("first", range(0, COUNT, AT_ONCE))
def test_every_node_of_a_launch_file_publishes(ros: RosSystem, tmp_path: Path, first: int) -> None:
    write_files(tmp_path)
    (tmp_path / "drive.bag").write_bytes(bag_bytes(rows(seconds=240)))
    files, expected = [tmp_path / "time.launch"], []
    files[0].write_text('<launch><param name="/use_sim_time" value="true"/></launch>')
    with ExitStack() as stack:
        for number, programs in enumerate(combinations()[first : first + AT_ONCE], first):
            text, outputs = launch_file(f"c{number}", programs, tmp_path)
            files.append(tmp_path / f"c{number}.launch")
            expected += outputs
            if "joy/joy_node" in programs:
                stack.callback(os.close, pressed_joystick(tmp_path / f"c{number}.js"))
            if "rplidar_ros/rplidarNode" in programs:
                stack.callback(SimulatedRplidar(tmp_path / f"c{number}.tty", lambda _: 2000).unplug)
            if "urg_node/urg_node" in programs:
                urg = SimulatedUrg(lambda _: [(2000, 100)])
                stack.callback(urg.unplug)
                text = text.replace("URG_PORT", str(urg.port))
            files[-1].write_text(text)
        launch = ros.pipros.start("roslaunch", "-p", str(ros.port), *files)
        launch.wait_for(r"started core service \[/rosout\]")
        node = stack.enter_context(ros.node("test"))
        services = [each for each in expected if each.type in SERVICES]
        inboxes = {each.topic: subscribed(node, each) for each in expected if each not in services}
        bag = ros.pipros.start("rosbag", "play", "--clock", "--quiet", tmp_path / "drive.bag")

        def silent() -> list[str]:
            assert "process has died" not in launch.output, launch.output
            return [topic for topic, inbox in inboxes.items() if not inbox.messages]

        wait_until(lambda: not silent(), 120, lambda: f"{silent()} {launch.output}")
        wait_until(lambda: all(answers(node, each) for each in services), 60, lambda: launch.output)
        bag.press_ctrl_c()
    launch.press_ctrl_c(code=0)


def subscribed(node: Node, output: Output) -> Inbox:
    return Inbox.of(node, output.topic, load_message_class(output.type))


def answers(node: Node, output: Output) -> bool:
    """Return whether a service answers."""
    service: Any = load_service_class(output.type)
    try:
        node.client(output.topic, service).call(service._request_class())
    except PiprosError:
        return False
    return True


def pressed_joystick(path: Path) -> int:
    """Create a FIFO in place of a joystick whose first button is pressed. Return its descriptor."""
    os.mkfifo(path)
    descriptor = os.open(path, os.O_RDWR)
    os.write(descriptor, EVENT.pack(0, 1, BUTTON, 0))
    return descriptor
