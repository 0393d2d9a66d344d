"""`~set_logger_level` does not let peers fill the memory of a node with loggers."""

from __future__ import annotations

import logging
import uuid
from typing import Any

from pipros.msg import load_service_class
from pipros.node.logger_services import serve_loggers
from tests.support.constants import Constants
from tests.support.nodes import MakeNode, listening_log

SetLoggerLevel: Any = load_service_class("roscpp/SetLoggerLevel")


def level_of(name: str) -> int | None:
    """Return the level of a logger, None if it does not exist."""
    found = logging.Logger.manager.loggerDict.get(name)
    return found.level if isinstance(found, logging.Logger) else None


def test_peers_create_a_limited_number_of_loggers(make_node: MakeNode, constants: Constants) -> None:
    log, lines = listening_log()
    constants(LOGGERS=5)
    node = make_node("talker", log=log)
    serve_loggers(node)
    client = make_node("peer").client("/talker/set_logger_level", SetLoggerLevel, persistent=True)
    unique = f"x{uuid.uuid4().hex}"
    own = logging.getLogger(f"{unique}_own")
    names = [f"{unique}_{number}" for number in range(20)]
    for name in (*names, f"{unique}{'x' * 200}", own.name):
        client.call(SetLoggerLevel._request_class(logger=name, level="error"))
    client.close()

    assert [level_of(name) for name in names] == [logging.ERROR] * 5 + [None] * 15
    assert level_of(f"{unique}{'x' * 200}") is None
    assert own.level == logging.ERROR
    assert [line for line in lines if "the limit is 5" in line] == lines


def test_parts_of_names_count(make_node: MakeNode, constants: Constants) -> None:
    constants(LOGGERS=5)
    node = make_node("talker")
    serve_loggers(node)
    client = make_node("peer").client("/talker/set_logger_level", SetLoggerLevel, persistent=True)
    unique = f"x{uuid.uuid4().hex}"
    for name in (f"{unique}.a.b.c.d.e", f"{unique}_late"):
        client.call(SetLoggerLevel._request_class(logger=name, level="error"))
    client.close()

    assert level_of(f"{unique}.a.b.c.d.e") == logging.ERROR
    assert level_of(f"{unique}_late") is None
