"""What a shell may offer that only the running system knows: topics, nodes, services, parameters."""

from __future__ import annotations

import contextlib
import io
from collections.abc import Sequence

from pipros.env import Environment
from pipros.errors import PiprosError

_TIMEOUT_S = 0.5

MANY_LINES = "\x1f"
"""Stands before a candidate of several lines, which comes alone."""


def live_names(command: str, before: Sequence[str]) -> list[str]:
    """Names from the running system; none when no master answers at once."""
    from pipros.net.master import MasterClient

    if len(before) > 1 and command != "rosnode":
        return []
    client = MasterClient(Environment.from_os().master_uri, "/complete", timeout_s=_TIMEOUT_S)
    try:
        if command == "rosparam":
            return client.get_param_names()
        if command == "rostopic":
            return sorted(name for name, _ in client.get_topic_types())
        publishers, subscribers, services = client.get_system_state()
        if command == "rosservice":
            return sorted(name for name, _ in services)
        if command == "rosnode":
            parts = (publishers, subscribers, services)
            return sorted({node for part in parts for _, nodes in part for node in nodes})
    except PiprosError:
        pass
    finally:
        client.close()
    return []


def service_type(service: str) -> str:
    """The type of a service that runs; empty when nobody says."""
    return _said_by("pipros.cli.rosservice", ["type", service])


def prototype(kind: str, type_name: str) -> list[str]:
    """A message or a request with the values that its fields have when nobody sets them, to be filled in."""
    text = _said_by("pipros.cli.rosmsg_proto", [kind, "-s", type_name]) if type_name else ""
    return [MANY_LINES + text] if text else []


def _said_by(module: str, arguments: list[str]) -> str:
    """What a command prints when it succeeds."""
    from importlib import import_module

    said = io.StringIO()
    with contextlib.redirect_stdout(said), contextlib.redirect_stderr(io.StringIO()):
        try:
            code = import_module(module).main(arguments)
        except SystemExit:
            return ""
    return "" if code else said.getvalue().strip()
