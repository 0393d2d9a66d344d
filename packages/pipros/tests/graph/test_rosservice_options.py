"""`rosservice call` with `--noarr` and `--nostr`, as in ROS 1.16."""

from __future__ import annotations

from typing import Any

import pytest

from pipros.msg import load_message_class, load_service_class
from pipros_tools.cli.rosservice import main
from tests.support.nodes import MakeNode


@pytest.mark.parametrize(
    ("options", "printed"),
    [
        ((), 'loggers: \n  - \n    name: "ros"\n    level: "info"\n'),
        (("--noarr",), 'loggers: "<array type: roscpp/Logger, length: 1>"\n'),
    ],
)
def test_arrays_of_responses_can_be_left_out(
    make_node: MakeNode,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    options: tuple[str, ...],
    printed: str,
) -> None:
    service_class: Any = load_service_class("roscpp/GetLoggers")
    logger_class: Any = load_message_class("roscpp/Logger")
    response_class: Any = service_class._response_class
    node = make_node("server")
    monkeypatch.setenv("ROS_MASTER_URI", node.master.uri)
    node.serve("/levels", service_class, lambda _: response_class([logger_class("ros", "info")]))
    assert main(["call", *options, "/levels"]) == 0
    assert capsys.readouterr().out == printed


def test_strings_of_responses_can_be_left_out(
    make_node: MakeNode, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    service_class: Any = load_service_class("std_srvs/Trigger")
    node = make_node("server")
    monkeypatch.setenv("ROS_MASTER_URI", node.master.uri)
    response_class: Any = service_class._response_class
    node.serve("/ready", service_class, lambda _: response_class(True, "all systems"))
    assert main(["call", "--nostr", "/ready"]) == 0
    assert capsys.readouterr().out == 'success: True\nmessage: "<string length: 11>"\n'
