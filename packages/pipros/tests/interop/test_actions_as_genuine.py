"""Goals between pipros and genuine ROS have the same outcome in either direction."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path

import pytest

from pipros_libraries.actions.client_goal import TRANSITIONS
from tests.support.ros import RosSystem
from tests.support.roscpp import compile_program

PROGRAMS = Path(__file__).parent / "programs"

TABLE = """
import json
from actionlib.action_client import _transitions
print(json.dumps([[state, status, list(way) if isinstance(way, tuple) else [way]]
                  for state, ways in _transitions.items() for status, way in ways.items()]))
"""


def test_the_table_of_clients_is_that_of_genuine() -> None:
    genuine = subprocess.run(
        ["/usr/bin/python3", "-c", TABLE],
        env={"PATH": "/usr/bin:/bin"},
        check=True,
        capture_output=True,
        text=True,
    )

    # -1: no change, -2: impossible; DONE has no transitions, so it is not in our table.
    theirs = {
        (state, status): [number for number in way if number != -1]
        for state, status, way in json.loads(genuine.stdout)
        if way != [-2] and state != 7
    }
    ours = {
        (int(s), int(t)): [int(x) for x in way] for s, ways in TRANSITIONS.items() for t, way in ways.items()
    }
    assert ours == theirs


@pytest.mark.timeout(200)
@pytest.mark.parametrize(
    ("server", "client"),
    [("pipros", "genuine"), ("genuine", "pipros"), ("pipros", "pipros"), ("roscpp", "pipros")],
)
def test_goals_have_the_same_outcome(plain_ros: RosSystem, server: str, client: str) -> None:
    plain_ros.serve_master()
    sides = {"pipros": plain_ros.pipros, "genuine": plain_ros.genuine}
    if server == "roscpp":
        serving = plain_ros.genuine.start(compile_program(PROGRAMS / "goals.cpp", "actionlib"), "server")
    else:
        serving = sides[server].start("python3", PROGRAMS / "serve_goals.py")

    ended = sides[client].run("python3", PROGRAMS / "send_goals.py", timeout_s=120)
    serving.press_ctrl_c()

    lines = ended.stdout
    assert lines == [
        "True",
        "3 5 reached",
        "[('done', 'SUCCEEDED', 7)]",
        "101 False",
        "True 2 -1 asked to end",
        "2",
        "3 8",
        "4 Exception in execute callback: by the goal",
        "4",
        "True",
        "['WAITING_FOR_RESULT', 'DONE'] REJECTED -2",
        "not below zero",
        "['WAITING_FOR_RESULT', 'DONE'] ABORTED -3",
        "never",
        "True 2",
    ], ended.output


@pytest.mark.timeout(200)
def test_goals_of_a_client_in_cpp_end_as_they_should(plain_ros: RosSystem) -> None:
    plain_ros.serve_master()
    plain_ros.pipros.start("python3", PROGRAMS / "serve_goals.py")

    ended = plain_ros.genuine.run(
        compile_program(PROGRAMS / "goals.cpp", "actionlib"), "client", timeout_s=120
    )

    assert ended.stdout == [
        "1",
        "SUCCEEDED 5 reached",
        "ABORTED 0 Exception in execute callback: by the goal",
        "101",
        "1",
        "PREEMPTED -1 asked to end",
        "SUCCEEDED 8 reached",
    ], ended.output


@pytest.mark.timeout(200)
@pytest.mark.parametrize("side", ["pipros", "genuine"])
def test_goals_removed_from_the_status_list_are_lost(plain_ros: RosSystem, side: str) -> None:
    plain_ros.serve_master()
    sides = {"pipros": plain_ros.pipros, "genuine": plain_ros.genuine}

    ended = sides[side].run("python3", PROGRAMS / "lose_goals.py", timeout_s=120)

    lines = [line for line in ended.stdout if not line.startswith("[ERROR]")]
    assert lines == [
        "[]",
        "True",
        "['StatusTracker'] True",
        "delete LOST",
        "['StatusTracker'] True",
        "clear LOST",
        "['StatusTracker'] True",
        "replace LOST",
        "[]",
    ], ended.output
