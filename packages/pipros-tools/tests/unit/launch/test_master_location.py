import re
import socket
from typing import Any

import pytest

from pipros.basics.env import Environment
from pipros.basics.errors import ProtocolError, Refused, Unreachable
from pipros.net import this_machine
from pipros.net.lookup import Lookups
from pipros.net.rpc_client import Fault
from pipros_tools.launch.announcements import (
    announce_launch,
    summary,
    warn_about_arguments,
    warn_about_machines,
)
from pipros_tools.launch.console import Console
from pipros_tools.launch.model import Argument, Launch, LaunchError, LaunchNode, Machine
from pipros_tools.launch.session_master import choose_run_id, master_environment, run_id_of
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
    assert run_id_of(FakeClient(answer)) == run_id


@pytest.mark.parametrize("answer", [ProtocolError("it speaks SSH"), Fault(1, "no such method")])
def test_another_server_at_the_address_of_the_master_is_an_error(answer: Exception) -> None:
    client: Any = FakeClient(answer)
    with pytest.raises(LaunchError, match=r"at ROS_MASTER_URI \[http://robot:11311\] is not a ROS master: "):
        run_id_of(client)


@pytest.mark.parametrize(("requested", "running", "chosen"), [
    ("one", None, "one"), ("one", "", "one"), ("one", "one", "one"), (None, "two", "two")
])  # fmt: skip
def test_a_requested_run_id_precedes_that_of_the_master(
    requested: str | None, running: str | None, chosen: str
) -> None:
    assert choose_run_id(requested, running, Console()) == chosen


@pytest.mark.parametrize("running", [None, ""])
def test_without_either_a_new_run_id_is_created(running: str | None) -> None:
    assert choose_run_id(None, running, Console()) != choose_run_id(None, running, Console())


def test_a_run_id_of_the_master_that_is_not_a_folder_name_is_not_used(capsys) -> None:
    assert "/" not in choose_run_id(None, "../../etc", Console())
    assert "/run_id on the parameter server must be" in capsys.readouterr().err


@pytest.mark.parametrize(("requested", "running", "complaint"), [
    ("../../etc", None, "--run_id must be up to 64 letters"),
    ("one", "two", "run_id on parameter server does not match declared run_id: two vs one"),
])  # fmt: skip
def test_an_invalid_requested_run_id_is_refused(requested: str, running: str | None, complaint: str) -> None:
    with pytest.raises(LaunchError, match=complaint):
        choose_run_id(requested, running, Console())


def test_the_summary_is_the_one_of_noetic() -> None:
    params = {
        "/b": 1, "/a": "012345678901234567890", "/exact": "01234567890123456789", "/lines": "a\nb",
        "/l": ["aaaaaaa", "bbbbbbbb", "c"], "/u": "ä", "/bin": b"5\n",
    }  # fmt: skip
    nodes = [LaunchNode("p", "t", "z"), LaunchNode("p", "t", "a"), LaunchNode("p", "t", "n", "/g/")]
    assert summary(params, nodes).split("\n") == [
        "", "SUMMARY", "========", "", "PARAMETERS", " * /a: 01234567890123456...", " * /b: 1", " * /bin: 5",
        " * /exact: 01234567890123456789", " * /l: ['aaaaaaa', 'bbbb...", " * /lines: <...>", " * /u: <...>",
        "", "NODES", "  /", "    a (p/t)", "    z (p/t)", "  /g/", "    n (p/t)", "",
    ]  # fmt: skip


class Recorder(Console):
    """A console that records its output."""

    def __init__(self) -> None:
        super().__init__()
        self.errors: list[str] = []
        self.details: list[str] = []
        self.lines: list[str] = []

    def error(self, text: str) -> None:
        self.errors.append(text)

    def detail(self, text: str) -> None:
        self.details.append(text)

    def say(self, text: str) -> None:
        self.lines.append(text)


def test_the_read_configuration_is_announced_in_detail() -> None:
    console = Recorder()
    launch = Launch(
        files=("/a.launch",), params={"/p": 1}, nodes=(LaunchNode("pkg", "t", "n", "/g/"),),
        warnings=("strange",),
    )  # fmt: skip
    announce_launch(console, launch, local_only=False)
    assert console.errors == ["WARNING: strange"]
    assert console.details == [
        "... loading XML file [/a.launch]",
        "Added parameter [/p]",
        "Added node of type [pkg/t] in namespace [/g/]",
    ]
    assert console.lines == []
    announce_launch(console, Launch(), local_only=True)
    assert console.lines == ["local only launch specified, will not launch remote nodes"]


def test_arguments_that_no_file_declares_are_warned_about() -> None:
    console = Recorder()
    launch = Launch(arguments=(Argument("known"),))
    warn_about_arguments(console, launch, ["known", "knwon"], ["a.launch", "b.launch"])
    assert console.errors == ["WARNING: no <arg> named [knwon] is declared in a.launch, b.launch"]


def test_a_launch_from_standard_input_declares_what_it_likes() -> None:
    console = Recorder()
    warn_about_arguments(console, Launch(), ["x"], [])
    assert console.errors == []


@pytest.mark.parametrize(("master_uri", "password", "warnings"), [
    ("http://robot:11311", "", []),
    (
        "http://127.0.0.1:11311",
        "",
        ["nodes on other machines cannot reach the master at http://127.0.0.1"],
    ),
    ("http://robot:11311", "secret", [r"the password of machine \[base\] is ignored"]),
])  # fmt: skip
def test_obstacles_for_nodes_on_other_machines_are_warned_about(
    master_uri: str, password: str, warnings: list[str]
) -> None:
    console = Recorder()
    launch = Launch(machines={"base": Machine("base", "base.local", password=password)})
    warn_about_machines(console, launch, master_uri)
    assert len(console.errors) == len(warnings)
    assert all(map(re.search, warnings, console.errors))
    assert "secret" not in "".join(console.errors)
