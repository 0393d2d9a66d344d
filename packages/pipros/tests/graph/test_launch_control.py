"""The page lists the nodes of a roslaunch, and stops and restarts them."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import pytest

from pipros.net import local_socket
from pipros_tools.launch.control import LaunchUnavailable, ask, running_launches
from tests.support.page import LivePage, Page
from tests.support.processes import Process
from tests.support.programs import make_programs
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

PROGRAMS = {
    "sleeper": "#!/bin/sh\nprintf '\\033[32mready\\033[0m\\n'\nexec sleep 1000\n",
    "wrapper": """#!/bin/sh
        sh -c 'trap "echo cleaned up > \"$0\"; exit" TERM; echo > "$0.ready"
            while :; do sleep 0.1; done' "$ROS_HOME/cleaned" &
        wait
    """,
    "fails": "#!/bin/sh\necho the reason\nexit 3\n",
}
FILE = """
<launch>
  <node pkg="programs" type="sleeper" name="driver" required="true"/>
  <node pkg="programs" type="sleeper" name="planner" respawn="true"/>
  <node pkg="programs" type="wrapper" name="camera"/>
  <node pkg="programs" type="fails" name="map" ns="maps"/>
</launch>
"""

pytestmark = pytest.mark.skipif(not local_socket.HAS_LOCAL_SOCKETS, reason="needs Linux")


@pytest.fixture
def launch(ros: RosSystem, monkeypatch: pytest.MonkeyPatch) -> Process:
    """A roslaunch with the nodes above; this process has its ROS_HOME."""
    folder = make_programs(ros.home / "src" / "programs", PROGRAMS)
    (folder / "robot.launch").write_text(FILE)
    monkeypatch.setenv("ROS_HOME", ros.pipros.environment["ROS_HOME"])
    ros.serve_master()
    running = ros.pipros.start("roslaunch", folder / "robot.launch", ROS_PACKAGE_PATH=str(folder.parent))
    running.wait_for("exit code 3")
    wait_until(running_launches)
    return running


def nodes(browser: LivePage) -> Iterator[dict[str, Mapping[str, Any]]]:
    """Yield the nodes by name, again and again."""
    return ({node["node"]: node for node in data["nodes"]} for data in browser.watch("launches"))


def states(browser: LivePage, name: str, state: str) -> Mapping[str, Any]:
    """Return a node once it has this state."""
    return next(found[name] for found in nodes(browser) if found and found[name]["state"] == state)


def test_nodes_are_listed_stopped_and_restarted(ros: RosSystem, launch: Process) -> None:
    with Page(ros, "--control").connect() as browser:
        failed = states(browser, "/maps/map", "exited")
        assert (failed["exit_code"], failed["program"], failed["starts"]) == (3, "programs/fails", 1)
        assert failed["files"].endswith("robot.launch")
        for name in ("/driver", "/planner"):  # neither does the launch end, nor is the node respawned
            running = states(browser, name, "running")
            place = {"launch": running["launch"], "node": running["name"]}
            assert browser.act("stop_launched", **place) is True
            stopped = states(browser, name, "stopped")
            assert (stopped["exit_code"], stopped["starts"]) == (-2, 1)
            assert browser.act("restart_launched", **place) is True
            assert states(browser, name, "running")["starts"] == 2
            assert browser.act("restart_launched", **place) is True
            restarted = next(found[name] for found in nodes(browser) if found and found[name]["starts"] == 3)
            assert restarted["pid"] != running["pid"]
    assert launch.returncode is None
    launch.press_ctrl_c(code=0)
    assert running_launches() == []


def test_the_output_is_shown_without_colours(ros: RosSystem, launch: Process) -> None:
    with Page(ros).connect() as browser:
        for name, text in (("/driver", "ready\n"), ("/maps/map", "the reason\n")):
            node = next(found[name] for found in nodes(browser) if found)
            [[source, shown]] = next(
                data["output"]
                for data in browser.watch("launch_output", launch=node["launch"], node=node["name"])
                if any(written for _, written in data["output"])
            )
            assert (Path(source).name, shown) == (f"{node['name'].replace('/', '-')}-stdout.log", text)


def test_without_control_no_node_is_stopped(ros: RosSystem, launch: Process) -> None:
    with Page(ros).connect() as browser:
        node = states(browser, "/driver", "running")
        place = {"launch": node["launch"], "node": node["name"]}
        for action in ("stop_launched", "restart_launched"):
            assert "read-only" in browser.act(action, **place)["error"]
    with Page(ros, "--control").connect() as browser:
        assert "process id" in browser.act("stop_launched", launch="../x", node="driver")["error"]
        assert "has ended" in browser.act("stop_launched", launch="0", node="driver")["error"]
        assert "no node [x]" in browser.act("stop_launched", launch=node["launch"], node="x")["error"]


def test_processes_that_a_stopped_node_left_behind_may_clean_up(ros: RosSystem, launch: Process) -> None:
    [name] = running_launches()
    run_id = ask(name, {"do": "list"})["run_id"]

    def camera() -> Mapping[str, Any]:
        return next(node for node in ask(name, {"do": "list"})["nodes"] if node["node"] == "/camera")

    for starts in (1, 2):
        wait_until(lambda starts=starts: (camera()["state"], camera()["starts"]) == ("running", starts))  # type: ignore[misc]
        cleaned = Path(ros.pipros.environment["ROS_HOME"]) / "cleaned"
        ready = cleaned.with_suffix(".ready")  # the trap is set
        wait_until(ready.exists)
        ready.unlink()
        ask(name, {"do": "restart", "node": camera()["name"], "run_id": run_id})
        wait_until(cleaned.exists)
        cleaned.unlink()


def test_a_node_that_has_exited_is_not_stopped(launch: Process) -> None:
    [name] = running_launches()

    def last() -> Mapping[str, Any]:
        return next(node for node in ask(name, {"do": "list"})["nodes"] if node["node"] == "/maps/map")

    wait_until(lambda: last()["state"] == "exited")
    run_id = ask(name, {"do": "list"})["run_id"]
    ask(name, {"do": "stop", "node": last()["name"], "run_id": run_id})
    assert last()["state"] == "exited"


def test_another_master_changes_nothing(launch: Process) -> None:
    [name] = running_launches()
    for what in ("stop", "restart", "output"):
        with pytest.raises(LaunchUnavailable, match="another master"):
            ask(name, {"do": what, "node": "driver-1", "run_id": "of-another-master"})


def test_malformed_requests_and_other_users_are_refused(launch: Process, monkeypatch) -> None:
    [name] = running_launches()
    run_id = ask(name, {"do": "list"})["run_id"]
    with pytest.raises(LaunchUnavailable, match="do must be"):
        ask(name, {"do": "reboot", "run_id": run_id})
    with pytest.raises(LaunchUnavailable, match="no node"):
        ask(name, {"do": "output", "node": ["x"], "run_id": run_id})
    monkeypatch.setattr(local_socket, "peer_user", lambda _: 4711)
    with pytest.raises(LaunchUnavailable, match="another user"):
        ask(name, {"do": "list"})
