from __future__ import annotations

import re

import pytest

from pipros_tools.launch.announcements import (
    announce_launch,
    summary,
    warn_about_arguments,
    warn_about_machines,
)
from pipros_tools.launch.console import Console
from pipros_tools.launch.model import Argument, Launch, LaunchNode, Machine


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
        files=("/a.launch",),
        params={"/p": 1},
        nodes=(LaunchNode("pkg", "t", "n", "/g/"),),
        warnings=("strange",),
    )
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
