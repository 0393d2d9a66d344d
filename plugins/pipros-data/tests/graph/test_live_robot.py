"""A robot under a policy: what it observes, what it is told, and how it is stopped."""

import os
import re
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import closing, suppress
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any

import cv2
import numpy as np
import pytest

from pipros.master.master import Master
from pipros.msg import load_message_class, load_service_class
from pipros.safe.settings import BadSettings
from pipros_data import ActionRefused, LiveRobot, LiveTeleoperator, RobotEnvironment, RobotSilent, open_bags
from pipros_data.datasets.config import DatasetConfig, read_config
from pipros_data.datasets.episodes import find_episodes
from pipros_data.datasets.marker import EpisodeMarker
from pipros_data.datasets.rows import episode_rows
from pipros_server.guardian_process import REPETITIONS
from tests.support import documents
from tests.support.bags import bag_bytes
from tests.support.environments import REPOSITORY
from tests.support.nodes import Inbox, MakeNode, wait_until_connected
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

Twist: Any = load_message_class("geometry_msgs/Twist")
JointState: Any = load_message_class("sensor_msgs/JointState")
Image: Any = load_message_class("sensor_msgs/Image")
CompressedImage: Any = load_message_class("sensor_msgs/CompressedImage")

ROOT = REPOSITORY
PLUGINS = ("lerobot_robot_ros1", "lerobot_teleoperator_ros1")

LONG_S, SHORT_S = 3000, 0.4
"""A watchdog that cannot act during a test, and one that does."""
DESCRIPTION = """\
rate: 20
time: receipt
tolerance: 600
watchdog: {watchdog}
observations:
  arm: {{topic: /joints, names: [b, a], unit: deg, scale: 10}}
actions:
  arm: {{topic: /arm, type: sensor_msgs/JointState, names: [b, a], unit: deg, scale: 10, stop: hold, max: 90}}
  base: {{topic: /cmd_vel, fields: [linear.x, angular.z], min: [-0.5, -1], max: [0.5, 1], teleop: /joy_vel}}
"""


class Robot:
    """A robot that holds its last commands for ever, and publishes its joints only if asked."""

    def __init__(self, node: Any) -> None:
        self.node = node
        self.commands, self.arm = Inbox(), Inbox()
        self.subscriber = node.subscribe("/cmd_vel", Twist, self.commands)
        node.subscribe("/arm", JointState, self.arm)
        self.joints = node.advertise("/joints", JointState, latch=True)
        self.measure(1.5, -2.0)

    def measure(self, a: float, b: float) -> None:
        self.joints.publish(JointState(name=["a", "x", "b"], position=[a, 9.0, b]))

    @property
    def speed(self) -> float:
        return float(self.commands.messages[-1].linear.x) if self.commands.messages else 0.0


@pytest.fixture
def robot(make_node: MakeNode) -> Robot:
    return Robot(make_node("robot"))


@pytest.fixture
def describe(tmp_path: Path) -> Callable[..., Path]:
    """Return a function that writes a description."""

    def write(watchdog: float = LONG_S, text: str = DESCRIPTION) -> Path:
        path = tmp_path / "robot.yaml"
        path.write_text(text.format(watchdog=watchdog))
        return path

    return write


@pytest.fixture
def live(master: Master, robot: Robot, describe: Callable[..., Path]) -> Iterator[LiveRobot]:
    with LiveRobot(describe(), master_uri=master.uri, timeout_s=60) as found:
        yield found


POLICY = """
import sys, time
from pipros_data import LiveRobot
with LiveRobot(sys.argv[1], timeout_s=60) as robot:
    while True:
        robot.act([-10, 10, 0.25, 0])
        time.sleep(0.02)
"""


@pytest.fixture
def policy(
    master: Master, robot: Robot, describe: Callable[..., Path]
) -> Iterator[Callable[[float], subprocess.Popen[bytes]]]:
    """Return a function that starts a policy with a watchdog, which drives the robot."""
    started: list[subprocess.Popen[bytes]] = []

    def start(watchdog: float) -> subprocess.Popen[bytes]:
        command = [sys.executable, "-c", POLICY, str(describe(watchdog))]
        started.append(subprocess.Popen(command, env={**os.environ, "ROS_MASTER_URI": master.uri}))
        wait_until(lambda: robot.speed == 0.25)
        return started[0]

    yield start
    for each in started:
        each.kill()
        each.wait()


def stops(robot: Robot) -> int:
    return sum(each.linear.x == 0 for each in robot.commands.messages)


def test_a_killed_policy_stops_the_robot(policy: Callable[[float], Any], robot: Robot) -> None:
    policy(LONG_S).kill()
    wait_until(lambda: stops(robot) == REPETITIONS)
    assert robot.speed == 0
    wait_until(
        lambda: len([each for each in robot.arm.messages if list(each.position) == [-2, 1.5]]) >= REPETITIONS
    )
    assert list(robot.arm.messages[-1].position) == [-2.0, 1.5]  # where it was measured, not its command


def test_a_policy_that_is_late_is_stopped_until_it_goes_on(
    policy: Callable[[float], Any], robot: Robot
) -> None:
    process = policy(SHORT_S)
    process.send_signal(signal.SIGSTOP)
    wait_until(lambda: robot.speed == 0)
    process.send_signal(signal.SIGCONT)
    wait_until(lambda: robot.speed == 0.25)


def test_without_a_watchdog_the_robot_drives_on_after_its_policy_was_killed(
    policy: Callable[[float], Any], robot: Robot
) -> None:
    process = policy(0)
    wait_until_connected(robot.subscriber)
    process.kill()
    wait_until(lambda: robot.subscriber.connection_count == 0)
    assert (robot.speed, stops(robot)) == (0.25, 0)


def test_numbers_have_the_names_units_and_order_of_the_description(live: LiveRobot, robot: Robot) -> None:
    assert live.state_names == ("arm.b", "arm.a")
    assert live.action_names == ("arm.b", "arm.a", "base.linear.x", "base.angular.z")
    least, most = live.action_limits
    assert (least.tolist(), most.tolist()) == ([-np.inf, -np.inf, -0.5, -1], [90, 90, 0.5, 1])
    state, pictures = live.observe()
    assert (state.tolist(), pictures) == ([-20.0, 15.0], {})
    robot.measure(3.0, 4.0)
    wait_until(lambda: live.observe()[0].tolist() == [40.0, 30.0])
    assert live.act([10, 20, 0.5, -1]).tolist() == [10, 20, 0.5, -1]
    (arm,), (twist,) = robot.arm.wait(), robot.commands.wait()
    assert (arm.name, list(arm.position)) == (["b", "a"], [1.0, 2.0])
    assert abs(arm.header.stamp.to_nsec() - live.node.clock.now_ns()) < 60e9
    assert (twist.linear.x, twist.linear.y, twist.angular.z) == (0.5, 0, -1)


@pytest.mark.parametrize(("action", "reason"), [
    ([0, 0, 0.6, 0], "actions.base.linear.x must be a number from -0.5 to 0.5, got 0.6"),
    ([91, 0, 0, 0], "actions.arm.b must be a number from -inf to 90 deg, got 91"),
    ([0, 0, 0, np.nan], "actions.base.angular.z must be a number from -1 to 1, got nan"),
    ([0, np.inf, 0, 0], "actions.arm.a must be a number from -inf to 90 deg, got inf"),
    ([0, 0, 0], "an action must have 4 numbers, got 3"),
])  # fmt: skip
def test_a_refused_action_stops_the_robot(
    live: LiveRobot, robot: Robot, action: list[float], reason: str
) -> None:
    live.act([0, 0, 0.1, 0])
    with pytest.raises(ActionRefused, match="^" + reason.replace(".", r"\.") + "$"):
        live.act(action)
    wait_until(lambda: stops(robot) >= REPETITIONS)
    assert {each.linear.x for each in robot.commands.messages} == {0.1, 0.0}


@pytest.mark.parametrize("watchdog", [LONG_S, 0])
def test_a_measurement_that_cannot_be_held_leaves_no_other_command_running(
    master: Master, robot: Robot, describe: Callable[..., Path], watchdog: float
) -> None:
    with LiveRobot(describe(watchdog), master_uri=master.uri, timeout_s=60) as live:
        live.act([0, 0, 0.1, 0])
        robot.measure(float("nan"), 1.0)
        with pytest.raises(RobotSilent, match="a number in the last message on /joints is missing or NaN"):
            wait_until(lambda: live.observe() is None)
        wait_until(lambda: robot.speed == 0)
        if watchdog:
            wait_until(lambda: list(robot.arm.messages[-1].position) == [-2.0, 1.5])
    assert all(np.isfinite(each.position).all() for each in robot.arm.messages)


def test_a_robot_whose_measurements_end_is_stopped(live: LiveRobot, robot: Robot) -> None:
    live.act([0, 0, 0.1, 0])
    robot.joints.unregister()
    with pytest.raises(
        RobotSilent, match=r"/joints is no longer published \(.*robot.yaml:6: observations.arm\)"
    ):
        wait_until(lambda: live.observe() is None)
    wait_until(lambda: stops(robot) >= REPETITIONS)
    with pytest.raises(RobotSilent):
        live.act([0, 0, 0.1, 0])
    assert robot.speed == 0


def test_a_robot_whose_messages_are_older_than_their_tolerance_is_stopped(
    master: Master, robot: Robot, describe: Callable[..., Path]
) -> None:
    path = describe(text=DESCRIPTION.replace("tolerance: 600", "tolerance: 0.2"))
    with LiveRobot(path, master_uri=master.uri, timeout_s=60) as live:

        def drives() -> bool:
            robot.measure(1.5, -2.0)
            with suppress(RobotSilent):
                live.act([0, 0, 0.1, 0])
            return robot.speed > 0

        wait_until(drives)
        with pytest.raises(RobotSilent, match=r"/joints has been silent for \d+\.\d+ s"):
            wait_until(lambda: live.act([0, 0, 0.1, 0]) is None)
        wait_until(lambda: robot.speed == 0)
    path.write_text("gaps: hold\n" + path.read_text())
    with LiveRobot(path, master_uri=master.uri, timeout_s=60) as live:
        wait_until(lambda: live._sources[0].age_s > 0.3)
        assert live.observe()[0].tolist() == [-20.0, 15.0]


def test_a_robot_without_commands_is_not_stopped(live: LiveRobot, robot: Robot) -> None:
    with pytest.raises(ActionRefused):
        live.act([0])
    live.close()
    wait_until(lambda: robot.subscriber.connection_count == 0)
    assert robot.commands.messages == []


def test_live_numbers_and_pictures_equal_those_of_the_data_set(
    master: Master, make_node: MakeNode, tmp_path: Path
) -> None:
    pixels = np.zeros((40, 60, 3), np.uint8)
    pixels[:, :30] = (200, 100, 50)
    jpeg = cv2.imencode(".jpg", pixels)[1].tobytes()
    messages = {
        "/front": CompressedImage(format="jpeg", data=jpeg),
        "/raw": Image(height=40, width=60, encoding="bgr8", step=180, data=pixels.tobytes()),
        "/joints": JointState(name=["a", "b"], position=[0.1, 0.2]),
    }
    path = tmp_path / "robot.yaml"
    path.write_text(
        "rate: 1\ntime: receipt\ntolerance: 600\nobservations: {arm: {topic: /joints, scale: 3}}\n"
        "cameras: {front: {topic: /front}, raw: {topic: /raw}}\n"
    )
    (tmp_path / "run.bag").write_bytes(bag_bytes([(topic, each, 5, 0) for topic, each in messages.items()]))
    node = make_node("robot")
    for topic, message in messages.items():
        node.advertise(topic, type(message), latch=True).publish(message)
    config = read_config(path)
    with open_bags(tmp_path / "run.bag") as bags:
        (episode,) = find_episodes(bags, "run.bag", config, 0)
        rows = episode_rows(bags, episode, config)
        with LiveRobot(path, master_uri=master.uri, timeout_s=60) as live:
            state, pictures = live.observe()
            assert state.tolist() == rows.signals[0].values[0].tolist()
            assert live.state_names == ("arm.position[0]", "arm.position[1]")
            assert live.cameras == {"front": (40, 60, 3), "raw": (40, 60, 3)}
            assert np.abs(pictures["front"].astype(int) - pixels[:, :, ::-1]).max() < 12
            assert pictures["raw"].tolist() == pixels[:, :, ::-1].tolist()


def test_commands_are_read_from_a_joystick(
    master: Master, make_node: MakeNode, describe: Callable[..., Path]
) -> None:
    node = make_node("joystick")
    publisher = node.advertise("/joy_vel", Twist, latch=True)
    command = Twist()
    command.linear.x, command.angular.z = 0.5, -0.25
    publisher.publish(command)
    text = DESCRIPTION.replace("tolerance: 600", "tolerance: 2")
    text = text.replace(text.splitlines(keepends=True)[7], "")  # without the arm
    teleoperator = LiveTeleoperator(describe(text=text), master_uri=master.uri, timeout_s=60)
    assert teleoperator.action_names == ("base.linear.x", "base.angular.z")
    assert teleoperator.read().tolist() == [0.5, -0.25]
    wait_until(lambda: teleoperator.read().tolist() == [0, 0])  # it was released
    teleoperator.close()
    with pytest.raises(BadSettings, match=r"actions\.arm\.teleop: must be a topic other than"):
        LiveTeleoperator(describe(), master_uri=master.uri)


@pytest.mark.parametrize(("before", "after", "reason"), [
    ("stop: hold, ", "", r"actions\.arm\.stop: must be zero, hold or 2 numbers"),
    ("stop: hold, ", "stop: [1], ", r"actions\.arm\.stop: must be zero, hold or 2 numbers for .*, got 1"),
    ("stop: hold, ", "stop: halt, ", r"actions\.arm\.stop: must be one of zero, hold"),
    ("scale: 10, stop", "scale: 10, fields: [speed], stop", r"fields: speed: .* has no such field"),
    ("scale: 10, stop", "scale: 10, fields: [header], stop", "fields: header: must be numbers"),
    (
        "scale: 10, stop",
        "scale: 10, fields: [position, effort], stop",
        "at most one field of variable size",
    ),
    ("unit: deg, scale: 10}", "unit: rad}", "stop: hold needs an observation with the same name, unit"),
    ("max: [0.5, 1]", "max: [0.5, 1, 2]", "must be one number or 2"),
    ("teleop: /joy", "teloep: /joy", "Did you mean teleop"),
    ("scale: 10}}\nactions", "scale: 10, stop: hold}}\nactions", "observations.arm.stop: unknown key"),
])  # fmt: skip
def test_errors_of_a_description_name_the_key(
    master: Master, robot: Robot, describe: Callable[..., Path], before: str, after: str, reason: str
) -> None:
    assert before in DESCRIPTION
    with pytest.raises(BadSettings, match=reason):
        LiveRobot(describe(text=DESCRIPTION.replace(before, after)), master_uri=master.uri, timeout_s=60)


def test_a_robot_that_is_missing_is_an_error(
    master: Master, make_node: MakeNode, describe: Callable[..., Path]
) -> None:
    with pytest.raises(RobotSilent, match=r"nothing subscribes to /cmd_vel. Start the missing node first"):
        LiveRobot(describe(), master_uri=master.uri, timeout_s=0.1)
    make_node("robot").subscribe("/cmd_vel", Twist)
    with pytest.raises(RobotSilent, match=r"no complete message on /joints. Start the missing node first"):
        LiveRobot(describe(), master_uri=master.uri, timeout_s=0.1)


def test_the_plug_ins_of_lerobot_have_the_names_and_order_of_the_data_set(
    master: Master, robot: Robot, describe: Callable[..., Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    """`script/long lerobot` uses the real library; here its base classes do nothing."""

    class Config:
        @staticmethod
        def register_subclass(name: str) -> Callable[[type], type]:
            assert name == "ros1"
            return lambda found: found

    base = type("Base", (), {"__init__": lambda self, config: None})
    for module, *names in (
        ("robots", "Robot", "RobotConfig"),
        ("teleoperators", "Teleoperator", "TeleoperatorConfig"),
    ):
        stand_in: Any = ModuleType(f"lerobot.{module}")
        setattr(stand_in, names[0], base)
        setattr(stand_in, names[1], Config)
        monkeypatch.setitem(sys.modules, stand_in.__name__, stand_in)
    monkeypatch.setitem(sys.modules, "lerobot", ModuleType("lerobot"))
    for name in PLUGINS:
        monkeypatch.syspath_prepend(str(ROOT / "plugins" / "pipros-data" / "plugins" / name))
    robots, teleoperators = map(import_module, PLUGINS)
    text = DESCRIPTION.replace("teleop: /joy_vel", "teleop: /joy_vel, stop: [0, 0]")
    path = str(describe(text=text.replace("stop: hold", "stop: hold, teleop: /joints")))
    joystick = robot.node.advertise("/joy_vel", Twist, latch=True)
    joystick.publish(Twist())

    plugged = robots.Ros1Robot(robots.Ros1RobotConfig(description=path, master_uri=master.uri))
    assert not plugged.is_connected
    assert plugged.observation_features == {"arm.b": float, "arm.a": float}
    plugged.connect()
    assert plugged.is_connected
    assert plugged.get_observation() == {"arm.b": -20.0, "arm.a": 15.0}
    teleoperator = teleoperators.Ros1Teleoperator(
        teleoperators.Ros1TeleoperatorConfig(description=path, master_uri=master.uri)
    )
    teleoperator.connect()
    action = teleoperator.get_action()
    assert list(action.items()) == [
        ("arm.b", -20), ("arm.a", 15), ("base.linear.x", 0), ("base.angular.z", 0),
    ]  # fmt: skip
    assert set(plugged.action_features) == set(teleoperator.action_features) == set(action)
    assert (plugged.send_action(action), list(robot.arm.wait()[0].position)) == (action, [-2.0, 1.5])
    plugged.disconnect()
    teleoperator.disconnect()
    assert not plugged.is_connected


def test_the_example_of_the_document_drives_the_simulated_robot(ros: RosSystem, tmp_path: Path) -> None:
    text = documents.text_of("guides/data.md")
    (code, printed), *_ = re.findall(r"```python\n([^`]*LiveRobot[^`]*)```\n\n```text\n([^`]*)```", text)
    _, description = re.findall(r"```yaml\n(.*?)```", text, re.DOTALL)
    ros.serve_master()
    ros.pipros.start("rosrun", "pipros_sim", "sim", "_headless:=true").wait_for("Simulating 1 robot")
    (ros.pipros.home / "base.yaml").write_text(description)
    ended = ros.pipros.run(sys.executable, "-c", code.replace('yaml"', 'yaml", timeout_s=60'))
    assert (ended.returncode, "\n".join(ended.stdout) + "\n") == (0, printed), ended.output


def test_a_simulated_robot_is_an_environment_of_gymnasium(ros: RosSystem, tmp_path: Path) -> None:
    ros.serve_master()
    ros.pipros.start("rosrun", "pipros_sim", "sim", "_headless:=true").wait_for("Simulating 1 robot")
    path = tmp_path / "robot.yaml"
    path.write_text(
        "rate: 20\ntime: receipt\ntolerance: 60\nwatchdog: 60\n"
        "observations: {odom: {topic: /odom, fields: [pose.pose.position.x]}}\n"
        "actions: {base: {topic: /cmd_vel, fields: [linear.x], min: -0.5, max: 0.5}}\n"
    )
    ready = threading.Event()
    with closing(
        RobotEnvironment(
            path,
            reward=lambda found, action: float(found["state"][0] - action[0]),
            is_done=lambda found: found["state"][0] > 0.1,
            on_reset=lambda robot: ready.set(),
            master_uri=ros.master_uri,
            timeout_s=60,
        )
    ) as environment:
        found, info = environment.reset()
        assert ready.is_set()
        assert environment.observation_space.contains(found)
        assert environment.action_space.high.tolist() == [0.5]
        is_done, steps = False, 0
        while not is_done:
            found, reward, is_done, is_cut, info = environment.step([0.5])
            assert reward == found["state"][0] - 0.5
            assert (is_cut, info["late_s"] >= 0) == (False, True)
            steps += 1
        assert steps > 1
        found, _ = environment.reset()


# Service calls mark episodes in a bag, which `pipros dataset` then finds.


String: Any = load_message_class("std_msgs/String")
Trigger: Any = load_service_class("std_srvs/Trigger")


def test_calls_of_services_become_episodes(make_node: MakeNode, tmp_path: Path) -> None:
    node, other = make_node("episode_marker"), make_node("operator")
    EpisodeMarker(node, "/episode")
    received: list[Any] = []
    other.subscribe("/episode", String, received.append)
    start, stop = (other.client(f"/episode/{name}", Trigger) for name in ("start", "stop"))

    def call(client: Any) -> str:
        count = len(received)
        answer = client.call(Trigger._request_class())
        assert answer.success
        wait_until(lambda: len(received) > count)
        return str(answer.message)

    assert call(start) == "episode"
    call(stop)
    other.params.set("/episode/task", "open the drawer")
    assert call(start) == "open the drawer"
    call(stop)
    assert [each.data for each in received] == ["episode", "", "open the drawer", ""]

    path = tmp_path / "run.bag"
    path.write_bytes(bag_bytes([("/episode", each, 100 + n, 0) for n, each in enumerate(received)]))
    config = DatasetConfig(10, "skip", "/episode", "", "", (), (), 0.5, "")
    with open_bags(path) as bags:
        found = find_episodes(bags, str(path), config, 4)
    assert [(each.number, each.start / 1e9, each.end / 1e9, each.task) for each in found] == [
        (4, 100, 101, "episode"),
        (5, 102, 103, "open the drawer"),
    ]
