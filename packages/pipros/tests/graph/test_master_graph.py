"""A running master: notices, vanished nodes, duplicate names, a restart with its store."""

import asyncio
import os
import socket
import threading
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest

from pipros.basics.env import Environment
from pipros.basics.errors import Refused, Unreachable
from pipros.basics.limits import Limits
from pipros.master import notifier
from pipros.master.master import Master
from pipros.master.options import Probing
from pipros.master.statistics import describe
from pipros.net import address
from pipros.net.master_client import MasterClient
from pipros.net.rpc_client import RpcClient
from pipros_tools.launch.roscore import Core
from tests.support.slaves import FakeSlave, SilentSlave
from tests.support.waiting import wait_until


@pytest.fixture
def master() -> Iterator[Master]:
    with Master(port=0, probing=Probing(answer_s=60.0)) as running:
        yield running


@pytest.fixture
def slave() -> Iterator[FakeSlave]:
    found = FakeSlave()
    yield found
    found.stop()


@pytest.fixture
def quick_master() -> Iterator[Master]:
    """A master that quickly detects a dead node."""
    probing = Probing(round_s=0.1, newcomers_s=0.05, answer_s=0.3, confirmation_pause_s=0.02)
    with Master(port=0, probing=probing) as running:
        yield running


def client(master: Master, name: str) -> MasterClient:
    return MasterClient(master.uri, name, timeout_s=60)


def figures(master: Master) -> Any:
    return client(master, "/test").call("pipros.getStatistics")


def test_the_master_answers_from_start_to_stop() -> None:
    with Master(port=0, parameters={"/run_id": "abc", "/a/b": 1}) as master:
        me = client(master, "/me")
        assert (me.get_uri(), me.get_pid()) == (master.uri, os.getpid())
        assert me.get_param("/") == {"run_id": "abc", "a": {"b": 1}}
    with pytest.raises(Unreachable, match="Is roscore running"):
        me.get_uri()
    master.stop()


def test_a_port_in_use_is_an_error_and_leaves_no_resources(master: Master) -> None:
    threads = set(threading.enumerate())
    with pytest.raises(OSError, match=r"in use"):
        Master(port=master.port).start()
    assert set(threading.enumerate()) <= threads  # a thread of an earlier test may end meanwhile


def test_a_refusal_by_the_master_raises_with_its_text(master: Master) -> None:
    with pytest.raises(Refused) as caught:
        client(master, "/me").get_param("/nope")
    assert (caught.value.code, caught.value.text) == (-1, "Parameter [/nope] is not set")


def test_subscribers_are_notified_of_new_and_removed_publishers(master: Master, slave: FakeSlave) -> None:
    client(master, "/s").register_subscriber("/t", "x/Y", slave.api)
    talker = client(master, "/p")
    assert talker.register_publisher("/t", "x/Y", "http://127.0.0.1:9/") == [slave.api]
    wait_until(lambda: slave.publishers() == [["http://127.0.0.1:9/"]])
    talker.unregister_publisher("/t", "http://127.0.0.1:9/")
    wait_until(lambda: slave.publishers()[-1] == [])
    assert slave.told[0][:3] == ("publisherUpdate", "/master", "/t")


def test_parameter_changes_arrive_in_order(master: Master, slave: FakeSlave) -> None:
    client(master, "/s").subscribe_param(slave.api, "/count")
    me = client(master, "/me")
    for number in range(200):
        me.set_param("/count", number)
    wait_until(lambda: slave.told and slave.told[-1] == ("paramUpdate", "/master", "/count/", 199))
    heard = [notice[3] for notice in slave.told]
    assert heard == sorted(heard)


def test_a_large_parameter_reaches_all_its_subscribers(master: Master) -> None:
    slaves = [FakeSlave() for _ in range(3)]
    for number, slave in enumerate(slaves):
        client(master, f"/s{number}").subscribe_param(slave.api, "/w")
    for large in ([{"number": number} for number in range(20_000)], "x" * 2_000_000):
        client(master, "/x").set_param("/w", large)
        for slave in slaves:
            wait_until(lambda told=slave.told, value=large: told and told[-1][3] == value, 60)
    for slave in slaves:
        slave.stop()


def test_thousands_of_notices_of_one_call_arrive_before_later_ones(master: Master, slave: FakeSlave) -> None:
    keys = [f"/w/{number}" for number in range(900)]
    for key in keys:
        client(master, "/s").subscribe_param(slave.api, key)
    client(master, "/x").set_param("/w", {str(number): number for number in range(900)})
    client(master, "/x").set_param("/w/899", "last")
    wait_until(lambda: ("paramUpdate", "/master", "/w/899/", "last") in slave.told, timeout_s=30)
    wait_until(lambda: client(master, "/x").call("pipros.getStatistics")["notices_waiting"] == 0)
    told = {key: value for _, _, key, value in slave.told}
    assert told == {f"{key}/": number for number, key in enumerate(keys)} | {"/w/899/": "last"}


def test_hanging_nodes_do_not_delay_others(slave: FakeSlave) -> None:
    hanging = [SilentSlave() for _ in range(notifier.TURNS_AT_A_TIME * 2)]
    with Master(port=0, limits=Limits(notice_s=1000.0)) as master:
        for number, found in enumerate(hanging):
            client(master, f"/hangs_{number}").register_subscriber("/t", "x/Y", found.api)
        client(master, "/s").register_subscriber("/t", "x/Y", slave.api)
        talker = client(master, "/p")
        for number in range(1, 51):
            talker.register_publisher("/t", "x/Y", f"http://127.0.0.1:{number}/")
        wait_until(lambda: slave.publishers() and slave.publishers()[-1] == ["http://127.0.0.1:50/"])
        wait_until(lambda: set(figures(master)["slow_nodes"]) == {found.api for found in hanging})
        assert figures(master)["notices_dropped"] == 0
    for found in hanging:
        found.stop()


def test_a_node_that_hung_receives_the_current_state_and_not_every_missed_notice(master: Master) -> None:
    awake = threading.Event()

    async def hang() -> list[Any]:
        while not awake.is_set():
            await asyncio.sleep(0.01)
        return [1, "", 0]

    slave = FakeSlave(on_notice=hang)
    client(master, "/s").register_subscriber("/t", "x/Y", slave.api)
    apis = [f"http://127.0.0.1:{number}/" for number in range(1, 51)]
    for number, api in enumerate(apis):
        client(master, f"/p{number}").register_publisher("/t", "x/Y", api)
        wait_until(slave.publishers)  # the first notice is with the node before the others follow
    awake.set()
    wait_until(lambda: slave.publishers()[-1] == apis)
    assert len(slave.publishers()) == 2
    slave.stop()


def test_a_duplicate_name_shuts_down_the_former_node(master: Master) -> None:
    former, successor = FakeSlave(name="/n"), FakeSlave(name="/n")
    client(master, "/n").register_publisher("/t", "x/Y", former.api)
    client(master, "/n").register_publisher("/u", "x/Y", successor.api)
    wait_until(lambda: former.told)
    reason = "[/n] Reason: new node registered with same name"
    assert former.told == [("shutdown", "/master", reason)]
    assert client(master, "/x").get_system_state()[0] == [["/u", ["/n"]]]
    assert successor.told == []
    former.stop()
    successor.stop()


def test_a_node_that_registers_while_it_is_shut_down_does_not_end_its_successor(master: Master) -> None:
    """Like a roscpp node, which subscribes to a parameter when it logs the shutdown request."""

    def subscribe() -> list[object]:
        client(master, "/n").subscribe_param(former.api, "/rosout_disable_topics_generation")
        return [1, "", 0]

    former, successor = FakeSlave(name="/n", on_notice=subscribe), FakeSlave(name="/n")
    client(master, "/n").register_publisher("/t", "x/Y", former.api)
    client(master, "/n").register_publisher("/t", "x/Y", successor.api)
    wait_until(lambda: client(master, "/x").call("pipros.getStatistics")["notices_delivered"] == 1)
    assert client(master, "/x").lookup_node("/n") == successor.api
    assert (len(former.told), successor.told) == (1, [])
    former.stop()
    successor.stop()


def test_a_vanished_node_is_removed_and_its_subscribers_are_notified(quick_master, slave: FakeSlave) -> None:
    gone = FakeSlave()
    client(quick_master, "/s").register_subscriber("/t", "x/Y", slave.api)
    client(quick_master, "/gone").register_publisher("/t", "x/Y", gone.api)
    client(quick_master, "/gone").register_service("/srv", "rosrpc://127.0.0.1:9", gone.api)
    wait_until(lambda: slave.publishers() == [[gone.api]])
    wait_until(lambda: figures(quick_master)["nodes_met"] == 2)
    gone.stop()
    wait_until(lambda: slave.publishers()[-1] == [])
    assert client(quick_master, "/x").get_system_state() == [[], [["/t", ["/s"]]], []]


def test_a_node_that_has_asked_is_removed_as_soon_as_its_connection_closes() -> None:
    with Master(port=0, probing=Probing(round_s=1e6, newcomers_s=0.05, confirmation_pause_s=0.02)) as master:
        gone, me = FakeSlave(), client(master, "/gone")
        me.register_publisher("/t", "x/Y", gone.api)
        wait_until(lambda: figures(master)["nodes_met"] == 1)
        assert me.lookup_node("/gone") == gone.api
        gone.stop()
        me.close()
        wait_until(lambda: figures(master)["nodes"] == 0)


def test_a_node_whose_port_went_to_another_process_is_removed(quick_master: Master) -> None:
    slave = FakeSlave(pid=1001)
    client(quick_master, "/n").register_publisher("/t", "x/Y", slave.api)
    wait_until(lambda: figures(quick_master)["nodes_met"])  # the first process id has arrived
    slave.pid = 1002
    wait_until(lambda: client(quick_master, "/x").get_system_state() == [[], [], []])
    slave.stop()


def test_a_silent_node_is_kept_and_shown_as_unreachable(quick_master: Master) -> None:
    silent = SilentSlave()
    client(quick_master, "/silent").register_publisher("/t", "x/Y", silent.api)
    wait_until(lambda: figures(quick_master)["unreachable_nodes"] == ["/silent"])
    assert client(quick_master, "/x").lookup_node("/silent") == silent.api
    assert "Unreachable nodes:\n * /silent" in describe(quick_master.uri, figures(quick_master))
    silent.stop()


def test_statistics_count_the_work_of_the_master(master: Master, slave: FakeSlave) -> None:
    client(master, "/s").register_subscriber("/t", "x/Y", slave.api)
    client(master, "/s").set_param("/a", {"b": 1, "c": 2})
    with socket.create_connection(("127.0.0.1", master.port)) as stranger:
        stranger.sendall(b"GET / HTTP/1.0\r\n\r\n")
        assert stranger.recv(100)
    found = figures(master)
    assert (found["nodes"], found["topics_subscribed"], found["parameters"]) == (1, 1, 2)
    assert (found["calls_by_method"]["setParam"], found["refused_by_peer"]) == (1, {"127.0.0.1": 1})
    text = describe(master.uri, found)
    assert "Nodes: 1, topics published: 0, subscribed: 1, services: 0, parameters: 2" in text
    assert " * 127.0.0.1 1" in text


# ---- guards


@pytest.mark.parametrize(
    ("variables", "host", "who"),
    [
        ({}, "127.0.0.1", "for this computer only"),
        ({"ROS_IP": "127.0.0.1"}, "127.0.0.1", "for this computer only"),
        ({"ROS_HOSTNAME": "robot"}, address.ANY, "open to all programs that can reach this computer"),
        (
            {"ROS_MASTER_URI": "http://robot:11311"}, address.ANY,
            "open to all programs that can reach this computer",
        ),
    ],
)  # fmt: skip
def test_only_loopback_is_bound_unless_it_is_opened(variables: dict[str, str], host: str, who: str) -> None:
    master = Master(port=0, environment=Environment.from_os(variables))
    assert (master.host, master.binding) == (host, f"listens on {host}, {who}")


def test_an_open_master_logs_the_allowed_networks_and_admits_this_computer() -> None:
    master = Master(port=0, host=address.ANY, allow=["10.0.0.0/8", "192.168.1.7"])
    assert master.binding == "listens on 0.0.0.0, open to 10.0.0.0/8, 192.168.1.7/32"
    with master:
        assert client(master, "/me").get_pid()


def test_an_invalid_network_is_refused() -> None:
    with pytest.raises(ValueError, match="nonsense"):
        Master(port=0, allow=["nonsense"])


def test_the_master_ends_on_request_of_this_computer() -> None:
    asked = threading.Event()
    with Master(port=0, on_shutdown=lambda _: asked.set()) as master:
        client(master, "/me").call("shutdown", "bye")
        assert asked.wait(60)


# ---- resuming


def test_a_restarted_master_remembers_parameters_and_the_nodes_that_are_still_there(tmp_path: Path) -> None:
    patient = Probing(resume_s=60.0)  # a node that answers later is kept
    store = tmp_path / "master.db"
    here, gone, other = FakeSlave(name="/here"), FakeSlave(name="/gone"), FakeSlave(name="/somebody_else")
    with Master(port=0, store=store, parameters={"/run_id": "first"}) as master:
        client(master, "/here").register_publisher("/t", "x/Y", here.api)
        client(master, "/here").register_service("/srv", "rosrpc://127.0.0.1:9", here.api)
        client(master, "/gone").register_publisher("/t", "x/Y", gone.api)
        client(master, "/replaced").register_publisher("/t", "x/Y", other.api)
        client(master, "/x").set_param("/robot", {"name": "r", "gains": [1.5, 2]})
        client(master, "/x").delete_param("/robot/name")
    gone.stop()
    with Master(port=0, store=store, parameters={"/run_id": "second"}, probing=patient) as master:
        me = client(master, "/x")
        assert me.get_param("/") == {"robot": {"gains": [1.5, 2]}, "run_id": "second"}
        assert me.get_system_state() == [[["/t", ["/here"]]], [], [["/srv", ["/here"]]]]
        assert me.lookup_service("/srv") == "rosrpc://127.0.0.1:9"
        assert me.get_topic_types() == [["/t", "x/Y"]]
    assert here.told == []
    for found in (here, other):
        found.stop()


def test_a_restarted_master_keeps_a_silent_node(tmp_path: Path) -> None:
    store, silent = tmp_path / "master.db", SilentSlave()
    with Master(port=0, store=store) as master:
        client(master, "/silent").register_publisher("/t", "x/Y", silent.api)
    with Master(port=0, store=store) as master:
        assert client(master, "/x").get_system_state() == [[["/t", ["/silent"]]], [], []]
    silent.stop()


def test_an_unusable_store_is_set_aside_and_the_master_starts(tmp_path: Path) -> None:
    store = tmp_path / "master.db"
    store.write_text("my diary")
    with Master(port=0, store=store) as master:
        assert client(master, "/x").get_param_names() == []
    assert (tmp_path / "master.db.unusable-1").read_text() == "my diary"


def test_rosout_of_a_core_comes_back_after_rosnode_kill_and_ends_with_the_core(tmp_path: Path) -> None:
    core = Core(environment=Environment(ros_home=tmp_path), port=0)
    core.start()
    asker = MasterClient(core.uri, "/x")
    first = asker.lookup_node("/rosout")
    with RpcClient(first) as rosout:
        rosout.call("shutdown", "/x", "user request")

    def is_back() -> bool:
        with suppress(Refused):
            return asker.lookup_node("/rosout") != first
        return False

    wait_until(is_back)
    core.stop_rosout()
    assert asker.get_system_state() == [[], [], []]
    core.stop()
