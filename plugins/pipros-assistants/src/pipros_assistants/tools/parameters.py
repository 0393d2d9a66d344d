"""Tools for parameters, logs and diagnostics."""

from __future__ import annotations

import re
import time
from collections.abc import Iterator
from typing import Annotated, Any, Final, Literal

from pydantic import Field

from pipros.basics.errors import PiprosError
from pipros.net.address import split_uri
from pipros.net.this_machine import is_this_machine
from pipros_assistants.answer import Answer
from pipros_assistants.robot import RobotAccess, decoded
from pipros_assistants.tools.arguments import Cursor, Name, Namespace, Wait
from pipros_tools.launch.log_history import log_history

MASKED: Final = "(masked: the name looks like that of a secret)"

_SECRET = re.compile(
    r"pass(wd|word|phrase|code)|secret|token|credential|(api|access|private)_?key"
    r"|(^|_)(auth|key|pass|pin|psk|pwd)($|[_\d])",
    re.IGNORECASE,
)
_IN_URL = re.compile(r"(?<=://)[^/@\s]*@")
_LEVELS = {"debug": 1, "info": 2, "warn": 4, "error": 8, "fatal": 16}
_LOG_TOPIC = "/rosout"
_DIAGNOSTICS = ("/diagnostics", "/diagnostics_agg")
_LONGEST_TEXT, _LONGEST_NAME = 2000, 300


class StateTools:
    """Tools for parameters, logs and diagnostics."""

    def __init__(self, robot: RobotAccess) -> None:
        self._robot = robot

    def list_parameters(self, below: Namespace = "/", cursor: Cursor = 0) -> Answer:
        """List the names of the parameters below a namespace."""
        from pipros_tools.graph.params import names_below

        with self._robot.client() as client:
            return Answer(names_below(client.master, client.resolve(below)))

    def read_parameter(self, name: Name, cursor: Cursor = 0) -> Answer:
        """Read a parameter, or all parameters in a namespace. Values are masked if the parameters' names
        suggest that they are secret, such as passwords."""
        from pipros_tools.graph.params import read

        with self._robot.client() as client:
            full = client.resolve(name)
            value = read(client.master, full)
        return Answer([{"name": each, "value": part} for each, part in _leaves(full, value)])

    def read_logs(
        self,
        seconds: Annotated[float, Field(gt=0, le=1e7, description="how far to look back")] = 300.0,
        level: Literal["debug", "info", "warn", "error", "fatal"] = "info",
        node: Annotated[str, Field(max_length=500, description="a single node; empty for all")] = "",
        wait_s: Wait = 1.0,
        cursor: Cursor = 0,
    ) -> Answer:
        """Read log messages of nodes, newest first: earlier messages from the log file of this run, if the
        master runs on this machine, and messages that are published during the wait."""
        history = self._history()
        samples = self._robot.sample([_LOG_TOPIC], wait_s)
        entries = [entry[:4] for entry in history]
        for _, message in decoded(samples.received):
            if message._type == "rosgraph_msgs/Log":
                entries.append([message.level, message.name, message.msg, message.header.stamp.to_sec()])
        since_s = min(samples.now_s, time.time()) - seconds
        kept = {
            (entry[3], entry[1], entry[2], entry[0])
            for entry in entries
            if entry[3] >= since_s and entry[0] >= _LEVELS[level] and node in ("", entry[1])
        }
        names = {number: name for name, number in _LEVELS.items()}
        rows = [
            {"time_s": stamp, "level": names.get(number, str(number)), "node": sender, "text": text}
            for stamp, sender, text, number in sorted(kept, key=lambda each: each[0], reverse=True)
        ]
        note = "" if history else "Earlier messages are missing, because this run has no log file here."
        return Answer(rows, note, {"messages": len(rows)})

    def read_diagnostics(
        self,
        wait_s: Wait = 2.5,
        level: Annotated[int, Field(ge=0, le=3, description="0 OK, 1 warning, 2 error, 3 stale")] = 0,
        cursor: Cursor = 0,
    ) -> Answer:
        """Read the diagnostics that nodes publish during the wait, from this level up, worst first."""
        samples = self._robot.sample(_DIAGNOSTICS, wait_s)
        found: dict[str, Any] = {}
        for _, message in decoded(samples.received):
            if message._type == "diagnostic_msgs/DiagnosticArray":
                found |= {status.name: status for status in message.status}
        rows = [
            {
                "name": each.name,
                "level": _number(each.level),
                "message": each.message,
                "hardware": each.hardware_id,
                "values": {value.key: value.value for value in each.values[:100]},
            }
            for each in sorted(found.values(), key=lambda each: (-_number(each.level), each.name))
            if _number(each.level) >= level
        ]
        return Answer(rows, figures={"statuses": len(found)})

    def _history(self) -> list[list[Any]]:
        environment = self._robot.environment
        try:
            if not is_this_machine(split_uri(environment.master_uri)[0]):
                return []
            with self._robot.client() as client:
                run_id = client.master.get_param("/run_id")
        except (PiprosError, ValueError):
            return []
        return log_history(environment.log_dir.expanduser(), run_id, _LONGEST_TEXT, _LONGEST_NAME)


def is_secret(name: str) -> bool:
    """Return whether a part of a parameter's name suggests that the value is secret.

    >>> is_secret("/wifi/password"), is_secret("/api_key"), is_secret("/keyboard/map")
    (True, True, False)
    """
    return any(_SECRET.search(part) for part in re.sub(r"(?<=[a-z])(?=[A-Z])", "_", name).split("/"))


def _leaves(name: str, value: Any) -> Iterator[tuple[str, Any]]:
    """Yield the names and values of parameters. The values of secrets are masked."""
    if isinstance(value, dict) and value:
        for key, part in sorted(value.items()):
            yield from _leaves(f"{name.rstrip('/')}/{key}", part)
    else:
        yield name, MASKED if is_secret(name) else _without_secrets(value)


def _without_secrets(value: Any) -> Any:
    """Return a value in which credentials in URLs, and secrets in dictionaries inside lists, are masked."""
    if isinstance(value, str):
        return _IN_URL.sub("(masked)@", value)
    if isinstance(value, list):
        return [_without_secrets(part) for part in value]
    if isinstance(value, dict):
        return {key: MASKED if is_secret(str(key)) else _without_secrets(part) for key, part in value.items()}
    return value


def _number(level: Any) -> int:
    """Return a `byte` field as an integer. In Python, such fields are `bytes` or `int`."""
    return level[0] if isinstance(level, bytes) else int(level)
