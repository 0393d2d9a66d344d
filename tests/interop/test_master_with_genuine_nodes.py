"""Genuine rospy and roscpp nodes live with our master: names, kills, restarts."""

from __future__ import annotations

import os
import signal
import sys
import textwrap
from pathlib import Path
from typing import Any

import pytest

from pipros.errors import PiprosError
from pipros.net.master import MasterClient
from tests.support.processes import Process
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

TALKER = """
    import rospy
    from std_msgs.msg import String
    rospy.init_node("talker")
    publisher = rospy.Publisher("chat", String, queue_size=10)
    rospy.set_param("~started", True)
    rate = rospy.Rate(20)
    while not rospy.is_shutdown():
        publisher.publish("hello")
        rate.sleep()
    print("talker ends", flush=True)
"""
LISTENER = """
    import rospy
    from std_msgs.msg import String
    rospy.init_node("listener")
    rospy.Subscriber("chat", String, lambda message: print("heard", message.data, flush=True))
    rospy.spin()
"""


@pytest.fixture
def start_master(ros: RosSystem, tmp_path: Path) -> Any:
    def start(*options: str) -> Process:
        # With loopback told, as the genuine nodes of these tests are.
        process = ros.pipros.start(
            sys.executable,
            "-m",
            "pipros.cli.rosmaster",
            "--core",
            "-p",
            str(ros.port),
            *options,
            ROS_IP="127.0.0.1",
        )
        wait_until(lambda: _is_up(master(ros)))
        return process

    return start


def master(ros: RosSystem) -> MasterClient:
    return MasterClient(ros.master_uri, "/test", timeout_s=5)


def _is_up(client: MasterClient) -> bool:
    try:
        return client.get_pid() > 0
    except PiprosError:
        return False


def publishers(ros: RosSystem, topic: str = "/chat") -> list[str]:
    [*found] = [nodes for name, nodes in master(ros).get_system_state()[0] if name == topic]
    return list(found[0]) if found else []


def script(ros: RosSystem, tmp_path: Path, source: str, *arguments: str) -> Process:
    file = tmp_path / f"{abs(hash(source))}.py"
    file.write_text(textwrap.dedent(source))
    return ros.genuine.start("/usr/bin/python3", str(file), *arguments)


def roscpp_node(ros: RosSystem, *arguments: str) -> Process:
    """topic_tools' relay: a roscpp node that needs no build."""
    return ros.genuine.start("rosrun", "topic_tools", "relay", "/chat", "/chat_again", *arguments)


def test_rospy_and_roscpp_nodes_meet_through_our_master(
    ros: RosSystem, tmp_path: Path, start_master: Any
) -> None:
    start_master()
    script(ros, tmp_path, TALKER)
    roscpp_node(ros)
    listener = script(ros, tmp_path, LISTENER, "chat:=chat_again")
    listener.wait_for(r"heard hello")
    assert master(ros).get_param("/talker/started") is True


def test_a_second_node_of_a_name_ends_the_first_one(
    ros: RosSystem, tmp_path: Path, start_master: Any
) -> None:
    start_master()
    first = script(ros, tmp_path, TALKER)
    wait_until(lambda: publishers(ros) == ["/talker"])
    first_api = master(ros).lookup_node("/talker")
    script(ros, tmp_path, TALKER)
    first.wait_for("talker ends")
    assert first.wait(10) == 0
    wait_until(lambda: publishers(ros) == ["/talker"])
    assert master(ros).lookup_node("/talker") != first_api


def test_a_second_roscpp_node_of_a_name_ends_the_first_one(ros: RosSystem, start_master: Any) -> None:
    start_master()
    first = roscpp_node(ros, "__name:=same")
    wait_until(lambda: master(ros).get_system_state()[2])
    wait_until(lambda: _knows(ros, "/same"))
    roscpp_node(ros, "__name:=same")
    first.wait(15)


def _knows(ros: RosSystem, node: str) -> bool:
    try:
        return bool(master(ros).lookup_node(node))
    except PiprosError:
        return False


def test_a_node_that_is_killed_is_forgotten_without_rosnode_cleanup(
    ros: RosSystem, tmp_path: Path, start_master: Any
) -> None:
    start_master()
    talker = script(ros, tmp_path, TALKER)
    wait_until(lambda: publishers(ros) == ["/talker"])
    wait_until(lambda: master(ros).call("pipros.getStatistics")["nodes_met"] == 1)
    talker.send_signal(signal.SIGKILL)
    wait_until(lambda: not publishers(ros), timeout_s=25)
    cleanup = ros.genuine.run("rosnode", "cleanup")
    assert "Unable to contact" not in cleanup.output


def test_links_carry_on_without_a_master_and_new_ones_are_made_after_a_resume(
    ros: RosSystem, tmp_path: Path, start_master: Any
) -> None:
    store = str(tmp_path / "master.db")
    first = start_master("--resume", store)
    script(ros, tmp_path, TALKER)
    listener = script(ros, tmp_path, LISTENER)
    listener.wait_for("heard hello")
    wait_until(lambda: _has_kept(store))
    first.send_signal(signal.SIGKILL)
    first.wait(10)
    listener.wait_for("heard hello", since=listener.mark())
    start_master("--resume", store)
    assert publishers(ros) == ["/talker"]
    assert master(ros).get_param("/talker/started") is True
    listener.wait_for("heard hello", since=listener.mark())
    late = script(ros, tmp_path, LISTENER.replace('"listener"', '"late"'))
    late.wait_for("heard hello")


def test_a_roscpp_node_is_taken_over_with_its_topics_and_services_after_a_resume(
    ros: RosSystem, tmp_path: Path, start_master: Any
) -> None:
    store = str(tmp_path / "master.db")
    first = start_master("--resume", store)
    roscpp_node(ros, "__name:=relay")
    script(ros, tmp_path, TALKER)
    wait_until(lambda: publishers(ros, "/chat_again") == ["/relay"])
    wait_until(lambda: _has_kept(store))
    before = master(ros).get_system_state()
    service = master(ros).lookup_service("/relay/get_loggers")
    first.send_signal(signal.SIGKILL)
    first.wait(10)

    start_master("--resume", store)

    assert [sorted(map(str, table)) for table in master(ros).get_system_state()] == [
        sorted(map(str, table)) for table in before
    ]
    assert master(ros).lookup_service("/relay/get_loggers") == service
    late = script(ros, tmp_path, LISTENER.replace('"/chat"', '"/chat_again"'))
    late.wait_for("heard hello")


def _has_kept(store: str) -> bool:
    """The writer of the store has caught up: what was written last is there."""
    import sqlite3

    database = sqlite3.connect(store)
    try:
        [count] = database.execute("SELECT count(*) FROM registrations WHERE key = '/chat'").fetchone()
        [param] = database.execute("SELECT count(*) FROM parameters WHERE key LIKE '/talker/%'").fetchone()
        return count == 2 and param > 0
    finally:
        database.close()


def test_without_resume_a_restarted_master_knows_nothing_of_genuine_nodes_but_serves_new_ones(
    ros: RosSystem, tmp_path: Path, start_master: Any
) -> None:
    first = start_master()
    talker = script(ros, tmp_path, TALKER)
    wait_until(lambda: publishers(ros) == ["/talker"])
    first.send_signal(signal.SIGKILL)
    first.wait(10)
    start_master()
    assert publishers(ros) == []
    os.kill(talker.pid, 0)  # it lives on
    script(ros, tmp_path, TALKER, "__name:=talker_2")
    wait_until(lambda: publishers(ros) == ["/talker_2"])
