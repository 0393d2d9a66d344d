"""The output of `rosconsole echo`."""

from __future__ import annotations

import re
from typing import Any

import pytest

from pipros.msg import load_message_class
from pipros_tools.cli.rosconsole import main
from pipros_tools.cli.rosconsole.echo import LogPrinter


def log(level: int, text: str, name: str = "/talker") -> Any:
    message: Any = load_message_class("rosgraph_msgs/Log")()
    message.level, message.name, message.msg = level, name, text
    message.function, message.file, message.line = "main", "x.py", 7
    return message


def printed(*messages: Any, pattern: str = ".*", **options: Any) -> list[str]:
    lines: list[str] = []
    options = {"level": 4, "is_coloured": False, "is_verbose": False, **options}
    printer = LogPrinter(re.compile(pattern), write=lines.append, **options)
    for message in messages:
        printer.show(message)
    return lines


def test_only_statuses_at_or_above_the_level_are_printed() -> None:
    assert printed(log(2, "a"), log(4, "b"), log(16, "c")) == [
        "[ WARN  ] [/talker]: b",
        "[ FATAL ] [/talker]: c",
    ]


def test_the_filter_is_looked_for_in_the_name() -> None:
    assert printed(log(8, "a"), log(8, "b", name="/listener"), pattern="lis.*") == [
        "[ ERROR ] [/listener]: b"
    ]


def test_details_stand_on_a_line_of_their_own() -> None:
    (text,) = printed(log(8, "a"), is_verbose=True)
    assert re.fullmatch(r"\[ ERROR \] \[/talker\]: a\n {10}\[19.* \(0\.000000\)\] \[main\]: x\.py:7", text)


def test_colours_are_for_terminals() -> None:
    assert printed(log(8, "a"), is_coloured=True) == ["[ \x1b[91mERROR\x1b[0m ] [\x1b[1m/talker\x1b[22m]: a"]


def test_a_node_cannot_send_escape_sequences() -> None:
    assert printed(log(8, "a\x1b[2J\nb", name="/x\n")) == ["[ ERROR ] [/x\\n]: a\\x1b[2J\nb"]


def test_an_unknown_level_is_shown_as_its_number() -> None:
    assert printed(log(32, "a")) == ["[ 32    ] [/talker]: a"]


@pytest.mark.parametrize(("words", "complaint"), [
    (["list"], "you must specify a node to list loggers"),
    (["list", "a", "b"], "you may only specify one node to list"),
    (["get", "a"], "you must specify a node and a logger"),
    (["set", "a", "b"], "you must specify a node, a logger and a level"),
    (["echo", "-l", "loud"], "invalid choice"),
    (["echo", "["], "argument FILTER: [[] must be a regular expression"),
])  # fmt: skip
def test_mistakes_end_with_2(words: list[str], complaint: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as end:
        main(words)
    assert end.value.code == 2
    assert complaint in capsys.readouterr().err


def test_an_unknown_subcommand_ends_with_64(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["nonsense"]) == 64
    assert "rosconsole echo\tprint logger messages" in capsys.readouterr().out
