"""Master, talker, listener, relay, launcher and recorder are killed in random order, and recover."""

import random
import signal
import sys
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import pytest
from std_msgs.msg import String

from pipros.basics.env import Environment
from pipros.basics.errors import PiprosError
from pipros.net.master_client import MasterClient
from pipros.node import Node
from pipros_tools.bag import open_bag
from pipros_tools.testing.faults.history import History
from tests.support.environments import VENV_BIN
from tests.support.ports import ClaimedPort
from tests.support.processes import Process, Processes
from tests.support.waiting import wait_until

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="uses process groups and /proc")

LIMIT_S = 60.0

TALKER = """#!/usr/bin/env python3
import os, rospy
from std_msgs.msg import String
from pipros_tools.testing.faults.history import History
rospy.init_node("talker", anonymous=True)
history, rate = History(), rospy.Rate(200)
publisher = rospy.Publisher(rospy.get_param("~topic"), String, queue_size=10_000)
while not rospy.is_shutdown():
    publisher.publish(history.next_text(f"talker{os.getpid()}", 500))
    rate.sleep()
"""
RELAY = """
import rospy
from std_msgs.msg import String
rospy.init_node("relay", anonymous=True)
publisher = rospy.Publisher("relayed", String, queue_size=10_000)
rospy.Subscriber("chat", String, publisher.publish)
rospy.spin()
"""
LISTENER = """
import rospy, sys
from std_msgs.msg import String
rospy.init_node("listener", anonymous=True)
with open(sys.argv[1], "w", buffering=1) as heard:
    rospy.Subscriber("chat", String, lambda message: heard.write(message.data + "\\n"))
    rospy.spin()
"""
LAUNCH = """<launch>
  <node name="launched" pkg="chaos_pkg" type="talker.py" respawn="true">
    <param name="topic" value="/launched"/>
  </node>
</launch>"""


class Scene:
    """The victims, each of which is restarted when it exits, and a node that receives their messages."""

    def __init__(self, processes: Processes, port: ClaimedPort, folder: Path) -> None:
        self._processes = processes
        self._port = port
        self._folder = folder
        self.histories = {topic: History() for topic in ("chat", "relayed", "launched")}
        self.bags: list[Path] = []
        self.heard: list[Path] = []
        self.kills = 0
        self._master = MasterClient(port.uri, "/test", timeout_s=5)
        self._write_package()
        self._environment = {"ROS_MASTER_URI": port.uri, "ROS_PACKAGE_PATH": str(folder)}
        self._starters: dict[str, Callable[[], Process]] = {
            "master": self._start_master, "talker": lambda: self._python("-c", TALKER, "_topic:=chat"),
            "relay": lambda: self._python("-c", RELAY), "listener": self._start_listener,
            "launcher": lambda: self._python("-m", "pipros_tools.cli.roslaunch", "chaos_pkg", "chaos.launch"),
            "recorder": self._start_recorder,
        }  # fmt: skip
        self._running: dict[str, Process] = {}
        self._start("master")
        self.node = Node("witness", environment=Environment(master_uri=port.uri))
        self.node.start()
        for topic, history in self.histories.items():
            self.node.subscribe(topic, String, lambda message, history=history: history.receive(message.data))
        for name in list(self._starters)[1:]:
            self._start(name)

    def _write_package(self) -> None:
        package = self._folder / "chaos_pkg"
        package.mkdir()
        (package / "package.xml").write_text("<package><name>chaos_pkg</name></package>")
        (package / "talker.py").write_text(TALKER)
        (package / "talker.py").chmod(0o755)
        (package / "chaos.launch").write_text(LAUNCH)

    def _python(self, *words: str) -> Process:
        return self._processes.start(sys.executable, *words, environment=self._environment)

    def _start(self, name: str) -> None:
        self._running[name] = self._starters[name]()

    def _start_master(self) -> Process:
        process = self._python("-m", "pipros_tools.cli.rosmaster", "--core", "-p", str(self._port.number))
        wait_until(self._is_up, LIMIT_S)
        return process

    def _is_up(self) -> bool:
        try:
            return self._master.get_pid() > 0
        except PiprosError:
            return False

    def _start_listener(self) -> Process:
        self.heard.append(self._folder / f"heard{len(self.heard)}.txt")
        return self._python("-c", LISTENER, str(self.heard[-1]))

    def _start_recorder(self) -> Process:
        self.bags.append(self._folder / f"record{len(self.bags)}.bag")
        words = ("record", "--chunksize", "16", "-O", str(self.bags[-1]), "chat", "relayed")
        return self._processes.start(str(VENV_BIN / "rosbag"), *words, environment=self._environment)

    def has_recorded(self) -> bool:
        """Return True if the recorder has written some chunks."""
        active = self.bags[-1].with_name(f"{self.bags[-1].stem}.bag.active")
        return active.exists() and active.stat().st_size > 50_000

    def kill(self, after: int, name: str, number: signal.Signals) -> None:
        """Kill a victim after some messages, restart it, and wait until all messages are recorded."""
        self.hear_more(after)
        self.kills += 1
        victim = self._running[name]
        victim.send_signal(number)
        victim.wait(LIMIT_S)
        self._start(name)
        self.hear_more(1)
        wait_until(lambda: self.heard[-1].exists() and self.heard[-1].stat().st_size, LIMIT_S)
        wait_until(self.has_recorded, LIMIT_S)

    def hear_more(self, count: int) -> None:
        before = {topic: history.received for topic, history in self.histories.items()}

        def is_heard() -> bool:
            return all(self.histories[topic].received >= before[topic] + count for topic in before)

        wait_until(is_heard, LIMIT_S, lambda: f"nothing more of one of {before}: {self.histories}")

    def heard_by_listeners(self) -> list[History]:
        """Return the messages of each killed listener. It wrote each line at once, so none is truncated."""
        found = []
        for file in self.heard[:-1]:
            found.append(History())
            for line in file.read_text().splitlines():
                found[-1].receive(line)
        return found

    def recorded(self, *topics: str) -> list[History]:
        """Return the messages in the bag of each killed recorder, reindexed if necessary, by topic."""
        found = []
        for bag in self.bags[:-1]:
            active = bag.with_name(f"{bag.name}.active")
            if active.exists():
                done = self._processes.run(str(VENV_BIN / "rosbag"), "reindex", str(active))
                assert done.returncode == 0, done.output
            found.append(History())
            with open_bag(active if active.exists() else bag) as reader:
                for message in reader.messages(topics):
                    found[-1].receive(message.message.data, message.topic)
        return found

    def close(self) -> None:
        self.node.shutdown("end of the test")


@pytest.fixture
def scene(processes: Processes, claimed_port: ClaimedPort, tmp_path: Path) -> Iterator[Scene]:
    found = Scene(processes, claimed_port, tmp_path)
    yield found
    found.close()


def kill_schedule(
    seed: int, victims: Sequence[str], count: int, most: int
) -> Iterator[tuple[int, str, signal.Signals]]:
    """Yield kills: how many messages must arrive before, at most `most`, the victim, and the signal.

    Each victim is killed once before any is killed again.
    """
    chance = random.Random(seed)  # noqa: S311
    signals = (signal.SIGINT, signal.SIGTERM, signal.SIGKILL)
    turn: list[str] = []
    for _ in range(count):
        turn = turn or chance.sample(sorted(victims), len(victims))
        yield chance.randint(1, most), turn.pop(), chance.choice(signals)


@pytest.mark.parametrize("seed", [1, 2])
def test_every_process_recovers_and_messages_arrive_whole_once_and_in_order(scene: Scene, seed: int) -> None:
    victims = ("master", "talker", "listener", "relay", "launcher", "recorder")
    for kill in kill_schedule(seed, victims, 12, most=50):
        scene.kill(*kill)

    # a killed relay explains one gap, because no other node is between a talker and its listener
    assert (scene.histories["chat"].problems(), scene.histories["launched"].problems()) == ([], [])
    assert scene.histories["relayed"].problems(breaks=2) == []
    assert [heard.problems() for heard in scene.heard_by_listeners()] == [[], []]
    assert [recorded.problems() for recorded in scene.recorded("/chat")] == [[], []]


def test_the_bags_of_killed_recorders_hold_whole_messages(scene: Scene) -> None:
    for kill in kill_schedule(1, ["recorder"], 3, most=20):
        scene.kill(*kill)

    for recorded in scene.recorded("/chat", "/relayed"):  # one of them may have been connected late
        assert recorded.problems() == []
        assert recorded.received > 20
