"""Genuine rospy and roscpp nodes with our master: names, kills, restarts.

Each test has a talker of one kind and a listener of the other, in both combinations.
"""

import re
import signal
import sqlite3
import sys
import textwrap
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import pytest

from pipros.basics.errors import PiprosError
from pipros.net.master_client import MasterClient
from tests.support.processes import Process
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

ROSPY_TALKER = """
    import rospy
    from composiv_tryouts.msg import BatteryLevel
    rospy.init_node("talker")
    publisher = rospy.Publisher("battery_topic", BatteryLevel, queue_size=10)
    rate = rospy.Rate(20)
    while not rospy.is_shutdown():
        try:
            publisher.publish("%25")
        except rospy.ROSException:  # the topic was closed since
            assert rospy.is_shutdown()
        rate.sleep()
"""
ROSPY_LISTENER = """
    import rospy
    from composiv_tryouts.msg import BatteryLevel
    def hear(message):
        print("heard", message.battery, "from", message._connection_header["callerid"], flush=True)
    rospy.init_node("listener")
    rospy.Subscriber("battery_topic", BatteryLevel, hear)
    rospy.spin()
"""
TOPIC = "/battery_topic"
PUBLISHER, SUBSCRIBER, SERVICE = range(3)  # the tables of getSystemState
BOTH_WAYS = pytest.mark.parametrize(
    ("talker", "listener"), [("rospy", "roscpp"), ("roscpp", "rospy")], ids=["rospy_talker", "roscpp_talker"]
)


class Scene:
    """Our master in its own process, and genuine nodes."""

    def __init__(self, ros: RosSystem, folder: Path) -> None:
        self._ros = ros
        self._folder = folder
        self.store = folder / "master.db"
        self.master = MasterClient(ros.master_uri, "/test", timeout_s=30)

    def start_master(self, *, resumes: bool = False) -> Process:
        # With an explicit loopback address, like the genuine nodes of these tests.
        command = (sys.executable, "-m", "pipros_tools.cli.rosmaster", "--core", "-p", str(self._ros.port))
        options = ("--resume", str(self.store)) if resumes else ()
        process = self._ros.pipros.start(*command, *options, ROS_IP="127.0.0.1")
        wait_until(lambda: self._answers(self.master.get_pid), 60)
        return process

    def start_talker(self, kind: str, name: str = "talker") -> Process:
        """A node that publishes and, like all nodes, has its own services and a parameter."""
        own = (f"__name:={name}", "_started:=true")
        if kind == "rospy":
            return self._start_script(ROSPY_TALKER, *own)
        return self._ros.genuine.start_node("cpp_battery", "battery_talker", *own)

    def start_listener(self, kind: str, name: str = "listener") -> Process:
        if kind == "rospy":
            return self._start_script(ROSPY_LISTENER, f"__name:={name}")
        return self._ros.genuine.start_node("cpp_battery", "battery_listener", f"__name:={name}")

    def _start_script(self, source: str, *arguments: str) -> Process:
        file = self._folder / f"{abs(hash(source))}.py"
        file.write_text(textwrap.dedent(source))
        return self._ros.genuine.start("/usr/bin/python3", str(file), *arguments)

    def registered(self, table: int, key: str = TOPIC) -> list[str]:
        """Return the nodes of a topic or service in one of the tables of `getSystemState`."""
        return dict(self.master.get_system_state()[table]).get(key, [])

    def api_of(self, node: str) -> str | None:
        return self._answers(lambda: self.master.lookup_node(node))

    def has_met(self, count: int) -> bool:
        """Return True if this number of nodes has responded to the master, which then detects their end."""
        return bool(self.master.call("pipros.getStatistics")["nodes_met"] == count)

    def has_kept_all(self) -> bool:
        """Return True if the store has all registrations and the talker's parameter."""
        state = self.master.get_system_state()
        expected = {
            (table, key, node) for table, rows in enumerate(state) for key, nodes in rows for node in nodes
        }
        with closing(sqlite3.connect(self.store)) as store:
            rows = store.execute("SELECT role, key, node FROM registrations").fetchall()
            params = store.execute("SELECT key FROM parameters WHERE key = '/talker/started'").fetchall()
        tables = {"PUBLISHER": PUBLISHER, "SUBSCRIBER": SUBSCRIBER, "SERVICE": SERVICE}
        return {(tables[role], key, node) for role, key, node in rows} == expected and len(params) == 1

    @staticmethod
    def _answers(ask: Callable[[], object]) -> str | None:
        try:
            return str(ask())
        except PiprosError:
            return None


@pytest.fixture
def scene(ros: RosSystem, tmp_path: Path) -> Scene:
    return Scene(ros, tmp_path)


def hears(listener: Process, talker: str = "/talker") -> None:
    """Wait until the listener receives further messages of the talker."""
    listener.wait_for(rf"heard %\d+ from {talker}\b", since=listener.mark())


@BOTH_WAYS
def test_talker_and_listener_connect(scene: Scene, talker: str, listener: str) -> None:
    scene.start_master()
    scene.start_talker(talker)

    hears(scene.start_listener(listener))

    assert scene.master.get_param("/talker/started") is True
    assert scene.registered(SERVICE, "/talker/get_loggers") == ["/talker"]


@BOTH_WAYS
def test_a_second_node_of_a_name_ends_the_first_one(scene: Scene, talker: str, listener: str) -> None:
    scene.start_master()
    first_talker, first_listener = scene.start_talker(talker), scene.start_listener(listener)
    hears(first_listener)
    former = scene.api_of("/talker"), scene.api_of("/listener")

    scene.start_talker(talker)
    second_listener = scene.start_listener(listener)

    assert (first_talker.wait(60), first_listener.wait(60)) == (0, 0)
    hears(second_listener)
    assert (scene.registered(PUBLISHER), scene.registered(SUBSCRIBER)) == (["/talker"], ["/listener"])
    assert {scene.api_of("/talker"), scene.api_of("/listener")}.isdisjoint({*former, None})


@BOTH_WAYS
def test_nodes_that_are_killed_are_forgotten_without_rosnode_cleanup(scene, ros, talker, listener) -> None:
    scene.start_master()
    killed_talker, killed_listener = scene.start_talker(talker), scene.start_listener(listener)
    staying = scene.start_listener(talker, "staying")
    hears(killed_listener)
    wait_until(lambda: scene.has_met(3), 60)

    killed_talker.send_signal(signal.SIGKILL)
    killed_listener.send_signal(signal.SIGKILL)

    wait_until(lambda: scene.registered(PUBLISHER) == [], timeout_s=60)
    wait_until(lambda: scene.registered(SUBSCRIBER) == ["/staying"], timeout_s=60)
    assert not scene.registered(SERVICE, "/talker/get_loggers")
    # On a busy machine, it may miss the living node, which it would name.
    assert not re.search("/talker|/listener", ros.genuine.run("rosnode", "cleanup").output)
    scene.start_talker(talker)
    hears(staying)


@BOTH_WAYS
def test_links_survive_a_master_restart_and_resume_restores_registrations(scene, talker, listener) -> None:
    first = scene.start_master(resumes=True)
    scene.start_talker(talker)
    staying = scene.start_listener(listener)
    hears(staying)
    wait_until(scene.has_kept_all, 60)
    before = scene.master.get_system_state()
    service = scene.master.lookup_service("/talker/get_loggers")
    first.send_signal(signal.SIGKILL)
    first.wait()
    hears(staying)

    scene.start_master(resumes=True)

    assert [sorted(table) for table in scene.master.get_system_state()] == [sorted(table) for table in before]
    assert scene.master.lookup_service("/talker/get_loggers") == service
    assert scene.master.get_param("/talker/started") is True
    hears(staying)
    hears(scene.start_listener(listener, "late"))
    scene.start_talker(talker, "late_talker")
    hears(staying, "/late_talker")


@BOTH_WAYS
def test_without_resume_a_restarted_master_knows_nothing_of_them_but_serves_new_ones(
    scene: Scene, talker: str, listener: str
) -> None:
    first = scene.start_master()
    scene.start_talker(talker)
    staying = scene.start_listener(listener)
    hears(staying)
    first.send_signal(signal.SIGKILL)
    first.wait()

    scene.start_master()

    assert scene.master.get_system_state() == [[], [], []]
    hears(staying)  # they continue to run
    scene.start_talker(talker, "late_talker")
    hears(scene.start_listener(listener, "late"), "/late_talker")
