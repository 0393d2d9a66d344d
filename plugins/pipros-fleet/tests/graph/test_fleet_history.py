"""Recording at a router, and copies of the files for operators who join late."""

from __future__ import annotations

import itertools
import logging
from contextlib import closing
from pathlib import Path
from typing import Any

from pipros_fleet.access import FleetRole
from pipros_fleet.agent import new_instance
from pipros_fleet.certificates import Authority
from pipros_fleet.history_files import COMPLETION_S, SMALLEST_LIMIT_BYTES, HistoryFiles
from pipros_fleet.key_files import read_keys
from pipros_fleet.recorder import FleetRecorder
from pipros_fleet.status import history_file, history_of
from pipros_fleet.zenoh_connecting import open_router
from pipros_tools.bag.opening import open_bag
from tests.graph.test_fleet_topics import publish_until
from tests.support.fleet import LIMIT_S, Member, String, link_to
from tests.support.ports import ClaimedPort
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until


def recorded(path: Path) -> list[tuple[str, str]]:
    with open_bag(path) as bag:
        return [(each.connection.topic, each.message.data) for each in bag.messages()]


def test_an_operator_who_joins_late_gets_the_history(claimed_port: ClaimedPort, tmp_path: Path) -> None:
    address = f"tcp/127.0.0.1:{claimed_port.number}"
    router = open_router([address])
    clock = itertools.count(step=COMPLETION_S).__next__
    files = HistoryFiles(tmp_path / "history", SMALLEST_LIMIT_BYTES, clock=clock)
    recorder = FleetRecorder(router, files, new_instance(), ["/odom", "/map"], log=logging.getLogger("test"))
    recorder.start()
    try:
        with Member("robot1", address) as robot:
            node = robot.node("base")
            node.advertise("/map", String, latch=True).publish(String("map"))
            odometry, unwanted = node.advertise("/odom", String), node.advertise("/debug", String)
            wait_until(lambda: odometry.connection_count == 1, LIMIT_S, "the recorder to receive")
            odometry.publish(String("moved"))
            assert unwanted.connection_count == 0, "nothing else crosses the link"
            with closing(link_to(address)) as late:

                def found() -> list[Any]:
                    return history_of(late, "robot1") or []

                wait_until(lambda: sum(each.messages for each in found()) >= 2, LIMIT_S, "both messages")
                contents = []
                for each in found():
                    copy = tmp_path / each.name
                    copy.write_bytes(history_file(late, "robot1", each.name) or b"")
                    contents += recorded(copy)
                assert {("/robot1/map", "map"), ("/robot1/odom", "moved")} == set(contents)
                assert history_of(late, "robot2") == []
                assert history_file(late, "robot1", "missing.mcap") is None
    finally:
        recorder.close()
        router.close()


def test_with_certificates_an_observer_gets_the_history(claimed_port: ClaimedPort, tmp_path: Path) -> None:
    authority = Authority.create(tmp_path / "fleet")
    robot_tls = read_keys(authority.add("robot1")).tls
    viewer_tls = read_keys(authority.add("viewer", FleetRole.OBSERVER)).tls
    address = f"tls/127.0.0.1:{claimed_port.number}"
    router = open_router([address], authority.router_tls(), authority.access())
    files = HistoryFiles(tmp_path / "history", SMALLEST_LIMIT_BYTES)
    recorder = FleetRecorder(router, files, new_instance(), ["/map"], log=logging.getLogger("test"))
    recorder.start()
    try:
        with Member("robot1", address, tls=robot_tls) as robot:
            robot.node("base").advertise("/map", String, latch=True).publish(String("map"))
            with closing(link_to(address, viewer_tls)) as viewer:
                wait_until(lambda: history_of(viewer, "robot1"), LIMIT_S, "the map")
                (file,) = history_of(viewer, "robot1") or []
                assert file.messages == 1
    finally:
        recorder.close()
        router.close()


def test_messages_for_other_members_are_recorded_without_extra_traffic(
    claimed_port: ClaimedPort, tmp_path: Path
) -> None:
    address = f"tcp/127.0.0.1:{claimed_port.number}"
    router = open_router([address])
    files = HistoryFiles(tmp_path, SMALLEST_LIMIT_BYTES)
    recorder = FleetRecorder(router, files, new_instance(), log=logging.getLogger("test"))
    recorder.start()
    try:
        with Member("robot1", address) as robot, Member("operator", address) as operator:
            talker = robot.node("talker").advertise("/chatter", String)
            operator.wait_for_topic("/robot1/chatter")
            received = operator.receive("/robot1/chatter")
            publish_until(talker, received, "hello")
            wait_until(lambda: "router" in operator.agent.shown, LIMIT_S, "the recorder to be a member")

            def count() -> int:
                talker.publish(String("more"))
                return sum(each.messages for each in files.list("robot1"))

            wait_until(lambda: count() > 0, LIMIT_S, "a recorded message")
    finally:
        recorder.close()
        router.close()


def test_a_router_with_a_history_runs_as_a_command(ros: RosSystem) -> None:
    ros.serve_master()
    port = ClaimedPort()
    address = f"tcp/127.0.0.1:{port.number}"
    router = ros.pipros.start(
        "pipros", "fleet", "router", address, "--history", "kept", "--history-topic", "/chatter"
    )
    router.wait_for("router at")
    ros.pipros.start("rostopic", "pub", "-l", "/chatter", "std_msgs/String", "hello")
    ros.pipros.start("pipros", "fleet", "join", "robot1", "--router", address).wait_for("joined")

    def listed() -> Any:
        return ros.pipros.run(
            "pipros", "fleet", "history", "robot1", "--router", address, "--output", "copies"
        )

    wait_until(lambda: "1 messages" in listed().output, LIMIT_S, "the message")
    router.press_ctrl_c()
    assert router.wait() == 0
    (copy,) = (ros.home / "copies").glob("robot1_*.mcap")
    assert recorded(copy) == [("/robot1/chatter", "hello")]
    port.release()
