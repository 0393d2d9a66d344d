"""Every pair of {pipros, genuine rospy, genuine roscpp} uses every feature, with both masters.

Three peers, one of each kind, use all features with each other concurrently and print their findings;
see `client_matrix/peer.py`. One such run for each master serves all tests of this file.
"""

import contextlib
import json
from collections.abc import Callable
from pathlib import Path

import pytest

from pipros.net.master_client import MasterClient
from tests.support.catkin import CatkinWorkspace
from tests.support.once import alone, shared_folder
from tests.support.ports import ClaimedPort
from tests.support.processes import Process
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

SCRIPT = Path(__file__).parent / "client_matrix" / "peer.py"
PEERS = ("pipros", "rospy", "roscpp")
RUN_TIMEOUT_S = 120

DIRECT = {
    "plain": "@ plain {0} 30 in order, std_msgs/String from /{0}",
    "nodelay": "@ nodelay {0} 30 in order, std_msgs/String from /{0}",
    "latched": "@ latched {0} newest, latching=1", "large": "@ large {0} intact",
    "clock": "@ clock {0} slept", "service": "@ service {0} {0} to /{1}, persistent=0",
    "service_error": "@ service_error {0} ServiceException",
    "persistent": "@ persistent {0} {0} to /{1}, persistent=1", "loggers": "@ loggers {0} followed",
    "parameters": "@ parameters {0} followed",
}  # fmt: skip
SEEN_BY_ALL = {
    "relay": "@ relay {0} {1} sent by {0} from /{1}",
    "statistics": "@ statistics {0} /{0} heard by /{1}",
}
"""What the first peer says or serves and the second one hears or calls: the line that proves it.
With two marks, every peer must find it: what the second relayed, what the second measured."""


def cells() -> list[tuple[str, str, str, str]]:
    """Return all combinations of master, aspect and two peers in which pipros takes part."""
    return [
        (master, aspect, first, second)
        for master in ("genuine", "pipros")
        for aspect in (*DIRECT, *SEEN_BY_ALL)
        for first in PEERS
        for second in PEERS
        if "pipros" in (master, first, second)
    ]


Findings = dict[str, list[str]]


@pytest.fixture(scope="session")
def findings_with(
    tmp_path_factory: pytest.TempPathFactory,
    worker_id: str,
    bare_tools: Path,
    catkin_workspace: CatkinWorkspace,
) -> Callable[[str], Findings]:
    """Return the output of the three peers with a master; run once for all workers of pytest."""
    shared = shared_folder(tmp_path_factory, worker_id)

    def findings(master: str) -> Findings:
        kept = shared / f"client_matrix_{master}.json"
        with alone(kept.with_suffix(".lock")):
            if not kept.exists():
                home = shared / f"client_matrix_{master}"
                home.mkdir()
                try:
                    found = run(master, home, bare_tools, catkin_workspace)
                except AssertionError as error:  # once for all tests
                    found = {"error": [str(error)]}
                kept.write_text(json.dumps(found))
        result: Findings = json.loads(kept.read_text())
        assert "error" not in result, result["error"][0]
        return result

    return findings


def run(master: str, home: Path, tools: Path, workspace: CatkinWorkspace) -> Findings:
    """Run the peers with a master until they have reported all findings, or time out."""
    port = ClaimedPort()
    ros = RosSystem(port.number, home, tools)
    ros.genuine.environment.update(workspace.variables)
    try:
        (ros.pipros if master == "pipros" else ros.genuine).start_master()
        client = MasterClient(ros.master_uri, "/test")
        client.set_param("/use_sim_time", True)
        client.set_param("/enable_statistics", True)
        client.close()
        peers = {
            "pipros": ros.pipros.start("python", SCRIPT, "pipros"),
            "rospy": ros.genuine.start("/usr/bin/python3", SCRIPT, "rospy"),
            "roscpp": ros.genuine.start_node("cpp_battery", "battery_peer", "roscpp"),
        }
        expected = len(PEERS) * len(DIRECT) + len(PEERS) ** 2 * len(SEEN_BY_ALL)
        with contextlib.suppress(AssertionError):  # the tests report what is missing
            wait_until(lambda: all(count(peer) >= expected for peer in peers.values()), RUN_TIMEOUT_S)
        result = {name: list(peer.lines) for name, peer in peers.items()}
        for peer in peers.values():
            peer.press_ctrl_c()
        with contextlib.suppress(AssertionError):
            wait_until(lambda: not any(peer.is_running for peer in peers.values()), 60)
        return {**result, "exit codes": [f"{name} {peer.returncode}" for name, peer in peers.items()]}
    finally:
        ros.close()
        port.release()


def count(peer: Process) -> int:
    return sum(line.startswith("@ ") for line in list(peer.lines))


@pytest.mark.parametrize(("master", "aspect", "first", "second"), cells())
def test_both_implementations_interoperate(findings_with, master, aspect, first: str, second: str) -> None:
    findings = findings_with(master)
    expected = (DIRECT | SEEN_BY_ALL)[aspect].format(first, second)
    for finder in PEERS if aspect in SEEN_BY_ALL else (second,):
        about = [line for line in findings[finder] if line.startswith(f"@ {aspect} {first} ")]
        errors = [line for line in findings[finder] if not line.startswith("@ ")]
        wrong = [line for line in about if line.endswith(("not set", "out of order", "broken"))]
        assert expected in about, f"{finder} found {about}, and said:\n" + "\n".join(errors)
        assert not wrong, f"{finder} found {about}"


@pytest.mark.parametrize("master", ["genuine", "pipros"])
def test_all_peers_end_well(findings_with: Callable[[str], Findings], master: str) -> None:
    assert findings_with(master)["exit codes"] == ["pipros 0", "rospy 0", "roscpp 0"]
