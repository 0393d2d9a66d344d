from __future__ import annotations

import socket

import pytest

from pipros.env import Environment
from pipros.launch.whereabouts import is_this_computer, master_environment

ELSEWHERE = Environment(master_uri="http://robot:1234")
NAMED = Environment(hostname="me.example")
ANYWHERE = "0.0.0.0"  # noqa: S104


@pytest.mark.parametrize(
    ("environment", "port", "bind", "uri"),
    [
        (Environment(), None, None, "http://127.0.0.1:11311/"),
        (ELSEWHERE, 5, None, "http://127.0.0.1:5/"),
        (NAMED, None, None, "http://me.example:11311/"),
        (Environment(), None, "192.168.0.7", "http://192.168.0.7:11311/"),
        (NAMED, None, ANYWHERE, "http://me.example:11311/"),
        (Environment(), None, ANYWHERE, f"http://{socket.gethostname()}:11311/"),
    ],
)
def test_roscore_is_reached_by_what_this_computer_tells_others(
    environment: Environment, port: int | None, bind: str | None, uri: str
) -> None:
    assert master_environment(environment, is_core=True, port=port, bind=bind).master_uri == uri


def test_roslaunch_uses_the_master_of_the_environment_unless_told_a_port() -> None:
    assert master_environment(ELSEWHERE, is_core=False, port=None, bind=None) == ELSEWHERE
    told = master_environment(ELSEWHERE, is_core=False, port=7, bind=None)
    assert told.master_uri == "http://robot:7"


def test_this_computer_is_told_from_others() -> None:
    assert is_this_computer("localhost")
    assert is_this_computer("127.0.0.2")
    assert not is_this_computer("192.0.2.1")
    assert not is_this_computer("nowhere.invalid")
