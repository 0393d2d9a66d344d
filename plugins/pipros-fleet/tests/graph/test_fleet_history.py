"""Recording at a router, and copies of the files for operators who join late."""

import itertools
import logging
import signal
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest
from cryptography.x509 import load_pem_x509_certificate

from pipros_fleet.access import FleetRole
from pipros_fleet.agent import new_instance
from pipros_fleet.certificates import Authority
from pipros_fleet.history_files import COMPLETION_S, SMALLEST_LIMIT_BYTES, HistoryFiles
from pipros_fleet.key_files import CERTIFICATE, read_keys
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
            with closing(link_to(address, viewer_tls, asker="viewer")) as viewer:
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


# The command `pipros fleet`: routers and members, output, errors and shutdown.


def test_a_router_and_a_member_run_as_commands(ros: RosSystem) -> None:
    ros.serve_master()
    port = ClaimedPort()
    address = f"tcp/127.0.0.1:{port.number}"
    (ros.home / "fleet.yaml").write_text("accept: {topics: [/cmd]}\n")
    ros.pipros.start("rostopic", "pub", "-l", "/chatter", "std_msgs/String", "hello")
    member = ros.pipros.start(
        "pipros", "fleet", "join", "robot1", "--router", address, "--file", "fleet.yaml"
    )
    member.wait_for(f"cannot reach the router at {address}.*waiting")
    router = ros.pipros.start("pipros", "fleet", "router", address)
    router.wait_for(f"router at {address}")
    member.wait_for(rf"\[robot1\] joined over {address}")

    second = ros.pipros.run("pipros", "fleet", "join", "robot1", "--router", address)
    assert second.returncode == 1
    assert "the fleet already has a member [robot1]" in second.output

    for process in (router, member):
        assert ".zenoh" not in Path(f"/proc/{process.pid}/maps").read_text(), "uses Zenoh's shared memory"
    ros.wait_for_publisher("/chatter")

    def shown() -> str:
        return ros.pipros.run("pipros", "fleet", "info", "robot1", "--router", address).output

    while "/chatter [std_msgs/String]" not in shown():
        assert member.is_running, member.output
    listed = ros.pipros.run("pipros", "fleet", "list", "--router", address)
    assert "robot1: shares 1 topic, accepts 0 topics and 0 services" in listed.stdout
    top = ros.pipros.run("pipros", "fleet", "top", "--count", "1", "--interval", "0.2", "--router", address)
    assert any(line.startswith("robot1: round trip ") for line in top.stdout), top.output
    missing = ros.pipros.run("pipros", "fleet", "info", "robot2", "--router", address)
    assert missing.returncode == 1
    assert "member [robot2] does not exist or does not answer" in missing.output

    healthy = ros.pipros.run("pipros", "doctor")
    assert "fleet agent" not in healthy.output
    for process, end in ((router, signal.SIGTERM), (member, signal.SIGINT)):
        if process is member:
            member.wait_for("the link to the router is lost")
            sick = ros.pipros.run("pipros", "doctor")
            assert "[/pipros_fleet_robot1] has no link to its fleet: no router is connected" in sick.output
        process.send_signal(end)
        assert process.wait(30) == 0
    port.release()


def test_a_member_ends_with_ctrl_c_while_it_waits_for_the_router(
    ros: RosSystem, claimed_port: ClaimedPort
) -> None:
    member = ros.pipros.start(
        "pipros", "fleet", "join", "a", "--router", f"tcp/127.0.0.1:{claimed_port.number}"
    )
    member.wait_for("waiting")
    member.press_ctrl_c()
    assert member.wait() == 0


def test_days_is_the_validity_of_the_certificates_of_routers_too(ros: RosSystem) -> None:
    for name, words in (("router", ("create", "fleet")), ("robot1", ("add", "fleet", "robot1"))):
        assert ros.pipros.run("pipros", "fleet", "keys", *words, "--days", "3").returncode == 0
        made = load_pem_x509_certificate((ros.home / "fleet" / name / CERTIFICATE).read_bytes())
        assert (made.not_valid_after_utc - made.not_valid_before_utc).days == 1 + 3


@pytest.mark.parametrize(("arguments", "reason"), [
    (["router", "tcp/0.0.0.0:7447"], "Without TLS, everyone there can control all robots"),
    (["router", "udp/127.0.0.1:1"], "must have the form tcp/HOST:PORT or tls/HOST:PORT"),
    (["router", "tls/127.0.0.1:1"], "needs --keys FOLDER"),
    (["router", "--history-topic", "/x"], "--history-topic needs --history DIR"),
    (["router", "--history", "x", "--history-mb", "1"], "--history-mb must be >= 34, got 1"),
    (["join", "a/b"], "is not a legal name for a member"),
    (["join", "a", "--router", "tls/127.0.0.1:1"], "needs --keys FOLDER"),
    (["join", "a", "--keys", "missing", "--router", "tls/127.0.0.1:1"], "has no file [fleet.crt]"),
    (["join", "a", "--file", "missing.yaml"], "cannot read missing.yaml: No such file or directory"),
    (["list", "--router", "tcp/127.0.0.1:9"], "cannot reach the router at tcp/127.0.0.1:9"),
    (["top", "--interval", "0"], "--interval must be between"),
    (["keys", "add", "missing", "robot1"], "has no authority"),
])  # fmt: skip
def test_errors_are_one_line(ros: RosSystem, arguments: list[str], reason: str) -> None:
    ended = ros.pipros.run("pipros", "fleet", *arguments)
    assert ended.returncode == 1
    assert reason in ended.output
    assert len(ended.stderr) == 1


def test_a_file_is_checked(ros: RosSystem) -> None:
    (ros.home / "good.yaml").write_text(
        "share: {topics: [{name: /tf, rate_hz: 5, latest_only: true, priority: high, compress: true}, "
        "{name: /x, allow: false}]}\nbandwidth_kbit: 100\naccept: {services: [{name: /s, from: [op]}]}\n"
    )
    good = ros.pipros.run("pipros", "fleet", "check", "good.yaml")
    assert good.returncode == 0
    assert good.stdout == [
        "shows the members *", "sends at most 100 kbit/s", "shares the topics:",
        "  /tf: at most 5 messages/s, only the latest, high priority, compressed", "  /x: not",
        "shares the parameters: (none)", "accepts messages for the topics: (none)",
        "accepts calls to the services:", "  /s: from op", "lets others set the parameters: (none)",
    ]  # fmt: skip
    (ros.home / "bad.yaml").write_text("accept: {topics: [{name: cmd}]}\n")
    bad = ros.pipros.run("pipros", "fleet", "check", "bad.yaml")
    assert bad.returncode == 1
    assert "bad.yaml: accept.topics[0].name must be a global name such as /camera/**, got 'cmd'" in bad.output


def test_without_the_extra_each_command_names_it(ros: RosSystem) -> None:
    """A module of that name that cannot be imported stands for one that is not installed."""
    (ros.home / "zenoh.py").write_text("raise ModuleNotFoundError('not here', name='zenoh')\n")
    for arguments in (["list"], ["join", "a"], ["router"], ["top"], ["info", "a"], ["param", "list", "a"]):
        ended = ros.pipros.run("pipros", "fleet", *arguments, PYTHONPATH=str(ros.home))
        assert ended.returncode == 1, ended.output
        assert len(ended.stderr) == 1, ended.output
        assert "fleets need eclipse-zenoh, which is not installed. Try: " in ended.stderr[0]
        assert "pip install" in ended.stderr[0]
