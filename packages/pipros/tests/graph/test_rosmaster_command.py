"""rosmaster, started by users and by roslaunch; rosgraph."""

import os
import signal
import socket
import sys
from pathlib import Path
from typing import Any

import pytest

from pipros.basics.errors import PiprosError
from pipros.net.master_client import MasterClient
from pipros_tools.cli.rosgraph import describe
from pipros_tools.cli.rosmaster import main
from pipros_tools.graph.system_state import SystemState
from pipros_tools.launch.roscore import Core
from tests.support.ports import ClaimedPort
from tests.support.processes import Process, Processes
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

# `rosmaster`, started by users and by roslaunch.


def start(processes: Processes, port: ClaimedPort, *options: str) -> Process:
    command = ("-m", "pipros_tools.cli.rosmaster", *options, "-p", str(port.number))
    return processes.start(sys.executable, *command)


def is_up(port: ClaimedPort) -> bool:
    try:
        return MasterClient(port.uri, "/test", timeout_s=30).get_pid() > 0
    except PiprosError:
        return False


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_it_serves_until_a_signal_and_ends_with_0(processes, claimed_port, number: signal.Signals) -> None:
    process = start(processes, claimed_port, "--core", "-w", "3", "-t", "5")
    wait_until(lambda: is_up(claimed_port))
    process.send_signal(number, code=0)
    assert process.output == ""


def test_without_core_it_recommends_roscore_and_prints_its_address(processes, claimed_port) -> None:
    process = start(processes, claimed_port)
    process.wait_for("Standalone zenmaster has been deprecated, please use 'roscore' instead")
    process.wait_for(rf"http://127.0.0.1:{claimed_port.number}/ listens on 127.0.0.1, for this computer only")
    process.press_ctrl_c(code=0)


def test_a_port_in_use_is_reported_in_one_line(processes: Processes, claimed_port: ClaimedPort) -> None:
    start(processes, claimed_port, "--core")
    wait_until(lambda: is_up(claimed_port))
    second = start(processes, claimed_port, "--core")
    assert second.wait() == 1
    assert second.stderr == [
        f"ERROR: Unable to start XML-RPC server, port {claimed_port.number} is already in use"
    ]


def test_it_ends_on_request_of_a_local_peer(processes: Processes, claimed_port: ClaimedPort) -> None:
    process = start(processes, claimed_port, "--core")
    wait_until(lambda: is_up(claimed_port))
    MasterClient(claimed_port.uri, "/test", timeout_s=30).call("shutdown", "end of the test")
    assert (process.wait(), process.stdout) == (0, ["shutdown request: end of the test"])


def test_it_logs_to_roslaunchs_file(processes: Processes, claimed_port: ClaimedPort, tmp_path: Path) -> None:
    log = tmp_path / "logs" / "master.log"
    process = start(processes, claimed_port, "--core", "--master-logger-level=debug", f"__log:={log}")
    wait_until(lambda: is_up(claimed_port))
    MasterClient(claimed_port.uri, "/test", timeout_s=30).set_param("/w", 1)
    process.press_ctrl_c(code=0)
    assert "[rosmaster.master][INFO]" in log.read_text()
    assert "+PARAM [/w] by /test" in log.read_text()


def test_statistics_of_a_running_master_are_printed(processes, claimed_port, monkeypatch, capsys) -> None:
    start(processes, claimed_port, "--core")
    wait_until(lambda: is_up(claimed_port))
    monkeypatch.setenv("ROS_MASTER_URI", claimed_port.uri)
    assert main(["--statistics"]) == 0
    assert "Calls: " in capsys.readouterr().out


def test_statistics_without_a_master_are_an_error_with_advice(capsys: Any) -> None:
    assert main(["--statistics"]) == 1
    assert "Is roscore running" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("argv", "text"),
    [
        (["--core", "foo"], "unrecognized arg: foo"), (["--nope"], "no such option: --nope"),
        (["-p", "x"], "invalid literal"), (["-t", "x"], "could not convert"),
        (["-p", "70000"], "rosmaster: error: port must be between 0 and 65535, got 70000"),
    ],
)  # fmt: skip
def test_wrong_arguments_are_reported_and_end_with_2(argv: list[str], text: str, capsys) -> None:
    with pytest.raises(SystemExit) as caught:
        main(argv)
    assert caught.value.code == 2
    assert text in capsys.readouterr().err


def test_help_names_the_options_of_genuine_rosmaster(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["--help"])
    text = capsys.readouterr().out
    assert text.startswith("Usage: zenmaster [options]")
    for option in (
        "--core", "-p PORT, --port=PORT", "-w NUM_WORKERS", "-t TIMEOUT", "--master-logger-level=",
    ):  # fmt: skip
        assert option in text


# A master and `/rosout` in the test's own process.


def open_files(folder: Path) -> list[str]:
    links = [f"/proc/self/fd/{number}" for number in os.listdir("/proc/self/fd")]
    return [os.readlink(link) for link in links if os.path.realpath(link).startswith(str(folder))]


def test_a_core_whose_port_is_in_use_closes_its_log(tmp_path: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        core = Core(port=taken.getsockname()[1], log_folder=tmp_path)
        with pytest.raises(OSError, match="in use"):
            core.start()
    assert open_files(tmp_path) == []


# `rosgraph`: nodes and connections, until the master ends.


def test_it_shows_the_graph_and_its_changes(ros: RosSystem) -> None:
    core = ros.pipros.start_master()
    rosgraph = ros.pipros.start("rosgraph")
    rosgraph.wait_for(r"  /rosout :")
    since = rosgraph.mark()
    talker = ros.pipros.start(
        "rostopic", "pub", "-r", "1", "/chatter", "std_msgs/String", "x", "__name:=talker"
    )
    listener = ros.pipros.start("rostopic", "echo", "/chatter")
    rosgraph.wait_for(r"      /talker", since=since)
    rosgraph.wait_for(r"      /rostopic_", since=since)
    for process in (talker, listener):
        process.press_ctrl_c()
        process.wait()
    core.press_ctrl_c()
    core.wait()
    assert (rosgraph.wait(), rosgraph.stderr) == (0, ["ERROR: Unable to communicate with master!"])


def test_ctrl_c_ends_it(ros: RosSystem) -> None:
    ros.serve_master()
    rosgraph = ros.pipros.start("rosgraph")
    rosgraph.wait_for("Services:")
    rosgraph.press_ctrl_c(code=0)


def test_inbound_and_outbound_nodes_follow_from_the_topics() -> None:
    state = SystemState.from_state(
        [[["/t", ["/a"]], ["/u", ["/b"]]], [["/t", ["/b", "/c"]], ["/none", ["/c"]]], [["/s", ["/a"]]]]
    )
    assert describe(state).splitlines() == [
        "Nodes:", "  /a :", "    Inbound:", "    Outbound:", "      /b", "      /c", "  /b :", "    Inbound:",
        "      /a", "    Outbound:", "  /c :", "    Inbound:", "      /a", "    Outbound:", "Services:",
        "  /s",
    ]  # fmt: skip
