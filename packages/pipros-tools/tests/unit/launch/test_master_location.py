from __future__ import annotations

import socket
from typing import Any

import pytest

from pipros.basics.env import Environment
from pipros.basics.errors import ProtocolError, Refused, Unreachable
from pipros.net import this_machine
from pipros.net.lookup import Lookups
from pipros.net.rpc_client import Fault
from pipros_tools.launch.model import LaunchError
from pipros_tools.launch.session_master import master_environment, run_id_of
from tests.support.constants import Constants
from tests.support.names import hosts

ELSEWHERE = Environment(master_uri="http://robot:1234")
NAMED = Environment(hostname="me.example")
ANYWHERE = "0.0.0.0"  # noqa: S104


@pytest.mark.parametrize(("environment", "port", "bind", "uri"), [
    (Environment(), None, None, "http://127.0.0.1:11311/"), (ELSEWHERE, 5, None, "http://127.0.0.1:5/"),
    (NAMED, None, None, "http://me.example:11311/"),
    (Environment(), None, "192.168.0.7", "http://192.168.0.7:11311/"),
    (NAMED, None, ANYWHERE, "http://me.example:11311/"),
    (Environment(), None, ANYWHERE, f"http://{socket.gethostname()}:11311/"),
])  # fmt: skip
def test_roscore_is_reached_by_the_name_that_this_computer_advertises(
    environment: Environment, port: int | None, bind: str | None, uri: str
) -> None:
    assert master_environment(environment, is_core=True, port=port, bind=bind).master_uri == uri


def test_roslaunch_uses_the_master_of_the_environment_unless_given_a_port() -> None:
    assert master_environment(ELSEWHERE, is_core=False, port=None, bind=None) == ELSEWHERE
    elsewhere = master_environment(ELSEWHERE, is_core=False, port=7, bind=None)
    assert elsewhere.master_uri == "http://robot:7"


@pytest.mark.parametrize(("requested", "announced"), [
    ("http://laptop:7", "laptop"),  # this computer's name: it means the network
    ("http://127.0.1.1:7", "127.0.0.1"),
    ("http://robot:7", "127.0.0.1"),  # another computer: not meant for a master here
    ("nonsense", "127.0.0.1"),
])  # fmt: skip
def test_a_uri_with_the_name_of_this_computer_opens_the_master(
    monkeypatch: pytest.MonkeyPatch, constants: Constants, requested: str, announced: str
) -> None:
    lookups = Lookups(4, resolve=hosts({"laptop": "127.0.1.1", "robot": "198.51.100.7"}))
    monkeypatch.setattr(this_machine, "process_lookups", lambda: lookups)
    constants(LOOKUP_S=60.0)
    monkeypatch.setattr(socket, "gethostname", lambda: "laptop")
    environment = master_environment(Environment(master_uri=requested), is_core=True, port=5, bind=None)
    assert environment.master_uri == f"http://{announced}:5/"


class FakeClient:
    uri = "http://robot:11311"

    def __init__(self, answer: object) -> None:
        self._answer = answer

    def get_param(self, _key: str) -> object:
        if isinstance(self._answer, Exception):
            raise self._answer
        return self._answer


@pytest.mark.parametrize(("answer", "run_id"), [
    ("0fb2803c", "0fb2803c"), (5, "5"), (Refused("the master", -1, "Parameter [/run_id] is not set"), ""),
    (Unreachable("the master", "Connection refused"), None),
])  # fmt: skip
def test_a_master_with_a_run_one_without_and_no_master_are_distinguished(
    answer: object, run_id: str | None
) -> None:
    client: Any = FakeClient(answer)
    assert run_id_of(client) == run_id


@pytest.mark.parametrize("answer", [ProtocolError("it speaks SSH"), Fault(1, "no such method")])
def test_another_server_at_the_address_of_the_master_is_an_error(answer: Exception) -> None:
    client: Any = FakeClient(answer)
    with pytest.raises(LaunchError, match=r"at ROS_MASTER_URI \[http://robot:11311\] is not a ROS master: "):
        run_id_of(client)
