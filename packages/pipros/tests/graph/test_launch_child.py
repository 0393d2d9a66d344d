"""`roslaunch --child`: its reports to the parent, the accepted commands, and when it exits.

The parent is a server in the test; tests.interop.test_remote_machines uses a genuine one.
"""

import os
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from tests.support.launch_parent import Parent, launch, start
from tests.support.programs import make_programs
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

PROGRAMS = {
    "sleeper": "#!/bin/sh\nexec sleep 1000\n",
    "fails": "#!/bin/sh\necho out\necho the reason >&2\nexit 3\n", "ends": "#!/bin/sh\nexit 0\n",
    "floods": "#!/bin/sh\nwhile :; do echo this is not read on the other side of a connection; done\n",
}  # fmt: skip


@pytest.fixture
def parent(package: Path) -> Iterator[Parent]:
    parent = Parent()
    yield parent
    parent.end()


@pytest.fixture
def package(ros: RosSystem) -> Path:
    folder = make_programs(ros.home / "programs", PROGRAMS)
    ros.pipros.environment["ROS_PACKAGE_PATH"] = str(folder)
    return folder


def test_it_starts_the_ordered_nodes_and_reports_the_result(ros: RosSystem, parent: Parent) -> None:
    child = start(ros, parent)
    answer = launch(parent, ("a", "sleeper"), ("b", "nope"), ("c", "fails"))
    assert answer == [1, "launched", [["a-1", "c-3"], ["b"]]]
    wait_until(lambda: ("process_died", "c-3", 3) in parent.calls)
    texts = [text for _, text in parent.shown]
    assert texts[:2] == ["launching nodes...", f"ROS_MASTER_URI={ros.master_uri}"]
    assert texts[2].startswith("process[a-1]: started with pid [")
    errors = [text for level, text in parent.shown if level == 8]
    assert errors[0].startswith("ERROR: cannot launch node of type [programs/nope]")
    assert errors[1].startswith("[c-3] process has died [pid ")
    assert wait_until(lambda: [text for text in parent.shown if "the reason" in text[1]])
    assert child.is_running


def test_it_describes_its_processes_to_tools(ros: RosSystem, parent: Parent) -> None:
    child = start(ros, parent)
    launch(parent, ("a", "sleeper"), ("b", "ends"))
    wait_until(lambda: ("process_died", "b-2", 0) in parent.calls)
    server = parent.child
    assert server.call("get_pid") == [1, str(child.pid), child.pid]
    assert server.call("list_processes") == [1, "processes on parent machine", [[["a-1", 1]], [["b-2", 1]]]]
    assert server.call("get_node_names") == [1, "node names", ["a-1"]]
    info = server.call("process_info", "b-2")[2]
    assert (info["name"], info["package"], info["alive"], info["exit_code"]) == ("b-2", "programs", False, 0)
    assert info["env"]["ROS_MASTER_URI"] == ros.master_uri
    assert server.call("process_info", "nobody") == [-1, "no process by that name", {}]


def order_shutdown(parent: Parent) -> None:
    assert parent.child.call("shutdown") == [1, "success", 1]


@pytest.mark.parametrize(
    ("program", "end", "shown"),
    [
        ("ends", lambda _: None, (2, "all processes on machine have died, roslaunch will exit")),
        ("sleeper", order_shutdown, (2, "[a-1] killing on exit")),
        ("sleeper", Parent.close, None), (None, Parent.close, None),
    ],
    ids=["with its nodes", "by order", "with its parent", "with its parent, before any order"],
)  # fmt: skip
def test_it_ends(ros: RosSystem, parent: Parent, program, end: Callable[[Parent], None], shown) -> None:
    child = start(ros, parent)
    if program:
        launch(parent, ("a", program))
    else:
        assert parent.child.uri
    end(parent)
    assert child.wait() == 0
    assert shown is None or shown in parent.shown


def test_it_ends_when_ssh_is_over_and_its_parent_is_silent(ros: RosSystem, parent: Parent) -> None:
    read_end, write_end = os.pipe()
    child = start(ros, parent, stdin=read_end)
    os.close(read_end)
    launch(parent, ("a", "sleeper"))
    parent.is_mute = True
    os.close(write_end)
    assert child.wait() == 0


def test_a_node_that_floods_its_output_is_not_blocked_by_a_parent_that_does_not_read_it(ros, parent) -> None:
    start(ros, parent)
    launch(parent, ("a", "floods"), more='output="screen"')
    log = ros.home / ".ros" / "log" / "run" / "a-1-stdout.log"
    wait_until(lambda: log.stat().st_size > 1_000_000)


def test_an_invalid_launch_file_is_refused_and_a_valid_one_launched_later(ros, parent: Parent) -> None:
    start(ros, parent)
    code, text, nodes = parent.child.call("launch", '<launch><node name="a" type="t"/></launch>')
    assert (code, nodes) == (-1, [[], []])
    assert text.startswith("ERROR: ")
    assert "missing required attribute: 'pkg'" in text
    assert launch(parent, ("a", "sleeper"))[0] == 1


def test_a_program_that_cannot_be_started_is_reported_and_the_others_stay(ros, parent, package: Path) -> None:
    (package / "sleeper").write_text("#!/nope\n")
    child = start(ros, parent)
    code, text, _ = launch(parent, ("a", "ends"), ("b", "sleeper"))
    assert code == 0
    assert "needs the interpreter /nope" in text
    assert child.wait() == 0


def test_it_launches_once(ros: RosSystem, parent: Parent) -> None:
    start(ros, parent)
    launch(parent, ("a", "sleeper"))
    code, text, _ = launch(parent, ("b", "sleeper"))
    assert code == -1
    assert "has already launched its nodes" in text


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (["-c", "x"], "--child option requires --server_uri to be set as well"),
        (["-c", "x", "-u", "http://127.0.0.1:1"], "--child option requires --run_id to be set as well"),
        (
            ["-c", "x", "-u", "http://127.0.0.1:1", "--run_id", "r", "x.launch"],
            "Input files are not allowed when run in child mode",
        ),
    ],
)
def test_incompatible_options_are_refused(ros: RosSystem, words: list[str], complaint: str) -> None:
    ended = ros.pipros.run("roslaunch", *words)
    assert ended.returncode == 2
    assert f"roslaunch: error: {complaint}" in ended.stderr


@pytest.mark.parametrize("uri", ["http://127.0.0.1:1/", "nonsense"])
def test_a_missing_parent_is_named(ros: RosSystem, uri: str) -> None:
    ended = ros.pipros.run("roslaunch", "-c", "x", "-u", uri, "--run_id", "r")
    ended.check(1, uri, "RLException: ")
