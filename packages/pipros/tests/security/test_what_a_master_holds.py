"""Peers that keep registering and setting: the master's memory and responses, and the effect on others."""

from __future__ import annotations

from pathlib import Path
from threading import Thread

import pytest

from pipros.basics.errors import LimitExceeded, Refused
from pipros.basics.limits import Limits
from pipros.master.master import Master
from pipros.net.master_client import MasterClient
from pipros.net.rpc_client import RpcClient
from tests.support.constants import Constants
from tests.support.ros import RosSystem

API = "http://127.0.0.1:9/"


def resident_mb(pid: int) -> float:
    [line] = [line for line in Path(f"/proc/{pid}/status").read_text().splitlines() if "VmRSS" in line]
    return int(line.split()[1]) / 1024


def test_removed_names_leave_no_memory_behind(ros: RosSystem) -> None:
    core = ros.pipros.start_master()
    with RpcClient(ros.master_uri) as client:
        before = 0.0
        for number in range(3000):
            if number == 1000:  # by now, buffers have the size for names of 16 kB
                before = resident_mb(core.pid)
            topic = f"/{number:05}" + "x" * 16_000
            assert client.call("registerPublisher", "/hoarder", topic, "std_msgs/String", API)[0] == 1
            assert client.call("unregisterPublisher", "/hoarder", topic, API)[2] == 1
        assert resident_mb(core.pid) - before < 10  # of 32 MB
        assert len(client.call("getTopicTypes", "/me")[2]) < 100
    assert ros.pipros.run("rostopic", "list").stdout == ["/rosout", "/rosout_agg"]
    assert ros.pipros.run("rostopic", "info", "/rosout").stdout[0] == "Type: rosgraph_msgs/Log"


def test_discarded_types_are_not_restored(tmp_path: Path, constants: Constants) -> None:
    constants(TOPIC_TYPES=2)
    limits = Limits()
    for _ in range(2):
        with Master(port=0, store=tmp_path / "store", limits=limits) as master:
            client = MasterClient(master.uri, "/n")
            for topic in ("/a", "/b", "/c"):
                client.register_publisher(topic, "x/Y", API)
                client.unregister_publisher(topic, API)
            client.close()
    with Master(port=0, store=tmp_path / "store") as master:
        client = MasterClient(master.uri, "/n")
        assert client.get_topic_types() == [["/b", "x/Y"], ["/c", "x/Y"]]
        client.close()


@pytest.mark.timeout(300)  # 18 MB of YAML take ten seconds of a processor that may be shared
def test_all_accepted_parameters_can_be_read(ros: RosSystem) -> None:
    ros.pipros.start_master()
    client = MasterClient(ros.master_uri, "/honest")
    for number in range(18):
        client.set_param(f"/map{number}", "x" * 1_000_000)
    client.close()
    ended = ros.pipros.run("rosparam", "dump", "all.yaml", timeout_s=240)
    assert ended.returncode == 0, ended.output
    assert (ros.home / "all.yaml").stat().st_size > 18_000_000


def test_parameters_have_a_total_limit_and_deletions_make_room() -> None:
    with Master(port=0, limits=Limits(parameter_bytes=1_000_000)) as master:
        client = MasterClient(master.uri, "/n")
        client.set_param("/list", list(range(20_000)))  # 640,000 bytes, measured in a thread
        with pytest.raises(Refused, match=r"/other would bring the parameters to .* the limit is 1000000"):
            client.set_param("/other", list(range(20_000)))
        assert client.get_param_names() == ["/list"]
        client.set_param("/list", list(range(25_000)))
        client.delete_param("/list")
        client.set_param("/other", list(range(20_000)))
        client.set_param("/other", 0)
        client.set_param("/text", "x" * 900_000)
        client.close()


def test_rosparam_says_which_limit_a_parameter_is_above(ros: RosSystem) -> None:
    ros.pipros.environment["PIPROS_LIMITS"] = "parameter_bytes=2000"
    ros.pipros.start_master()
    ended = ros.pipros.run("rosparam", "set", "/big", "x" * 2000)
    assert ended.returncode == 1
    assert ended.output.startswith("ERROR: cannot set parameter [/big]: Error: invalid arguments: /big would")


def test_registrations_have_a_total_limit(constants: Constants) -> None:
    constants(REGISTRATIONS_BYTES=100000)
    with Master(port=0) as master:
        client = MasterClient(master.uri, "/n")
        answers = [client.call_raw("registerSubscriber", f"/t{number}", "x/Y", API) for number in range(400)]
        code, text, _ = answers[-1]
        assert code == -1
        assert "would bring the master's registrations to" in text
        assert "the limit is 100000" in text
        registered = [topic for topic, _ in client.get_system_state()[1]]
        assert 200 < len(registered) < 400
        for topic in registered:
            client.unregister_subscriber(topic, API)
        client.register_service("/s", "rosrpc://a:1", API)
        client.close()


def test_an_answer_above_the_limit_is_an_error_that_names_it() -> None:
    with Master(port=0) as master, RpcClient(master.uri, answer_limit_bytes=10_000) as client:
        assert client.call("setParam", "/n", "/text", "x" * 20_000)[0] == 1
        with pytest.raises(LimitExceeded, match=r"the response from .* is too large: .* the limit is 10000"):
            client.call("getParam", "/n", "/text")
        assert client.call("hasParam", "/n", "/text")[2] is True


def test_a_large_parameter_that_is_replaced_again_and_again_is_counted_right() -> None:
    with Master(port=0, limits=Limits(parameter_bytes=500_000)) as master:
        clients = [MasterClient(master.uri, f"/n{number}") for number in range(4)]

        def hammer(client: MasterClient) -> None:
            for number in range(20):
                client.set_param("/shared", [number] * 3_000)
                client.set_param("/shared/below", [number] * 3_000)

        threads = [Thread(target=hammer, args=(client,)) for client in clients]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        clients[0].delete_param("/shared")
        clients[0].set_param("/all", "x" * 499_000)
        with pytest.raises(Refused):
            clients[0].set_param("/more", "x" * 1000)
        for client in clients:
            client.close()
