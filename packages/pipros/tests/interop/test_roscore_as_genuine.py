"""roscore and rosmaster compared with the genuine ones: parameters and topics after the start, log,
options."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from pipros.basics.errors import PiprosError
from pipros.net.master_client import MasterClient
from tests.support.ros import RosSystem, Side
from tests.support.waiting import wait_until

API = "http://127.0.0.1:9/"
CALLS = [
    ("/s", "registerSubscriber", "t", "x/Y", API),
    ("/p", "registerPublisher", "t", "x/Y", API),
    ("/p", "registerService", "~srv", "rosrpc://h:1", API),
    ("/p", "setParam", "a/b", 1),
    ("/p", "setParam", "a", {"c": 2}),
    ("/s", "subscribeParam", API, "a"),
    ("/p", "setParam", "/a//c/", 3),
    ("/p", "deleteParam", "a/c"),
    ("/s", "unsubscribeParam", API, "a"),
    ("/p", "unregisterService", "~srv", "rosrpc://h:1"),
    ("/p", "unregisterPublisher", "t", API),
    ("/s", "unregisterSubscriber", "t", API),
]


def _changes(ros: RosSystem, side: Side, log: Path) -> list[str]:
    """Return the lines about calls in a master's log, which begin with a plus or a minus."""
    master = side.start("rosmaster", "--core", "-p", str(ros.port), f"__log:={log}")
    for caller, method, *params in CALLS:
        client = MasterClient(ros.master_uri, caller, timeout_s=30)
        wait_until(lambda found=client: _is_up(found), 60)
        client.call(method, *params)
        client.close()
    master.press_ctrl_c()
    assert master.wait() == 0
    lines = log.read_text().splitlines()
    return [line for line in lines if re.search(r"\]\[INFO\] [-0-9 :,]{23}: [+-]", line)]


def _is_up(client: MasterClient) -> bool:
    try:
        return client.get_pid() > 0
    except PiprosError:
        return False


def test_master_log_has_the_same_lines(ros: RosSystem, tmp_path: Path) -> None:
    ours, genuine = (
        [re.sub(r"\d{4}-\d\d-\d\d \d\d:\d\d:\d\d,\d{3}", "TIME", line) for line in _changes(ros, side, log)]
        for side, log in ((ros.pipros, tmp_path / "ours.log"), (ros.genuine, tmp_path / "genuine.log"))
    )
    assert len(ours) == len(CALLS)
    assert ours == genuine


@pytest.mark.parametrize(
    "question",
    [
        "rosnode list",
        "rosservice list",
        "rostopic list -v",
        "rosparam list",
        "rosservice uri /rosout/get_loggers",
    ],
)
def test_a_new_roscore_gives_tools_the_same_answers(ros: RosSystem, question: str) -> None:
    answers = []
    for side in (ros.pipros, ros.genuine):
        core = side.start_master()
        ros.wait_for_publisher("/rosout_agg")
        ros.wait_for_subscriber("/rosout")  # the process was started, and may not be registered yet
        answer = ros.genuine.run(*question.split())
        answers.append((re.sub(r"\d{4,5}", "NUMBER", answer.output), answer.returncode))
        core.press_ctrl_c()
        assert core.wait(60) == 0
    assert answers[0] == answers[1]
    assert answers[0][1] == 0


@pytest.mark.parametrize("command", ["roscore", "rosmaster"])
def test_every_option_of_the_genuine_command_is_there(ros: RosSystem, command: str) -> None:
    ours, genuine = (
        set(re.findall(r"(?<!\w)--?[a-z][a-z-]*", side.run(command, "--help").output))
        for side in (ros.pipros, ros.genuine)
    )
    assert genuine <= ours
