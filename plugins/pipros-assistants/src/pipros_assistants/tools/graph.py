"""Tools that inspect and diagnose the graph of nodes, topics, services and actions."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from contextlib import suppress
from typing import Annotated, Any, Final

from pydantic import Field

from pipros.basics.errors import PiprosError
from pipros.msg import load_message_class, load_service_class
from pipros_assistants.answer import Answer, ToolRefused
from pipros_assistants.robot import RobotAccess
from pipros_assistants.tools.arguments import Cursor, Name, Namespace, Wait
from pipros_tools.graph.system_state import by_node, is_below
from pipros_workspace.type_catalogue import ACTIONS, MESSAGES, SERVICES

SHOWN_NAMES: Final = 100
"""Maximum number of names in one field of a row."""

_TYPE = re.compile(r"([A-Za-z]\w*)/(?:(?:msg|srv|action)/)?([A-Za-z]\w*)")
_ACTION = "ActionGoal"


class GraphTools:
    """Tools for the graph."""

    def __init__(self, robot: RobotAccess) -> None:
        self._robot = robot

    def list_nodes(self, below: Namespace = "/", cursor: Cursor = 0) -> Answer:
        """List the nodes below a namespace, with their published topics, subscribed topics and services."""
        with self._robot.client() as client:
            ns = client.resolve(below)
        state, _ = self._robot.state()
        names = {
            "publishes": by_node(state.publishers),
            "subscribes": by_node(state.subscribers),
            "services": by_node(state.services),
        }
        rows = [
            {"node": node, **{key: _some(found.get(node, ())) for key, found in names.items()}}
            for node in state.nodes()
            if is_below(node, ns)
        ]
        return Answer(rows, figures={"nodes": len(rows)})

    def list_topics(self, below: Namespace = "/", cursor: Cursor = 0) -> Answer:
        """List the topics below a namespace, with their types, publishers and subscribers."""
        state, types = self._robot.state(below)
        rows = [
            {
                "topic": topic,
                "type": types.get(topic),
                "publishers": _some(state.publishers.get(topic, ())),
                "subscribers": _some(state.subscribers.get(topic, ())),
            }
            for topic in state.topics()
        ]
        return Answer(rows, figures={"topics": len(rows)})

    def list_services(self, below: Namespace = "/", cursor: Cursor = 0) -> Answer:
        """List the services below a namespace, with the node that provides each."""
        state, _ = self._robot.state(below)
        rows = [{"service": name, "nodes": _some(nodes)} for name, nodes in sorted(state.services.items())]
        return Answer(rows, figures={"services": len(rows)})

    def describe_service(self, service: Name, cursor: Cursor = 0) -> Answer:
        """Show the type of a service, and its definition line by line. The service is not called."""
        from pipros_tools.graph.services import type_of

        with self._robot.client() as client:
            name = client.resolve(service)
            kind = type_of(client.master, name)
        if kind is None:
            known = self._robot.state()[0].services
            raise ToolRefused("this service does not exist; list_services lists all services", name, known)
        return Answer([{"service": service, "type": kind}, *_service_lines(kind)])

    def list_actions(self, below: Namespace = "/", cursor: Cursor = 0) -> Answer:
        """List the actions below a namespace, with their types, servers and clients."""
        state, types = self._robot.state(below)
        rows = []
        for topic in state.topics():
            action, _, last = topic.rpartition("/")
            kind = types.get(topic, "")
            if last == "goal" and kind.endswith(_ACTION):
                rows.append(
                    {
                        "action": action,
                        "type": kind.removesuffix("Goal"),
                        "servers": _some(state.subscribers.get(topic, ())),
                        "clients": _some(state.publishers.get(topic, ())),
                    }
                )
        return Answer(rows, figures={"actions": len(rows)})

    def show_definition(
        self,
        type: Annotated[str, Field(max_length=200, description="such as sensor_msgs/LaserScan")],  # noqa: A002
        cursor: Cursor = 0,
    ) -> Answer:
        """Show the definition of a message, service or action type, line by line, with embedded types. For a
        message type that is not installed here, the definition comes from a publisher."""
        match = _TYPE.fullmatch(type)
        if match is None:
            same = [each for each in _known_types() if each.endswith(f"/{type}")]
            raise ToolRefused(
                "a type must have the form PACKAGE/TYPE or, as in ROS 2, PACKAGE/msg/TYPE",
                [type, *same] if same else type,
            )
        type = f"{match[1]}/{match[2]}"  # noqa: A001
        base = type.removesuffix("Action")
        parts = [type] if base == type else [base + part for part in ("Goal", "Result", "Feedback")]
        with suppress(PiprosError, ValueError):
            return Answer([line for part in parts for line in _lines(part)])
        with suppress(PiprosError, ValueError):
            return Answer(list(_service_lines(type)))
        with suppress(PiprosError):  # without a master, there are no publishers to ask
            if lines := self._robot.definition_of(type):
                return Answer(
                    [f"type {type}", *lines], "This type is not installed here; a publisher sent it."
                )
        raise ToolRefused(
            "no package here defines this type, and no publisher sends its definition", type, _known_types()
        )

    def doctor(
        self,
        about: Annotated[
            str, Field(max_length=500, description="a topic, node or service; empty for all findings")
        ] = "",
        cursor: Cursor = 0,
    ) -> Answer:
        """Check this machine and the running system. Each finding describes a problem and how to fix it."""
        from pipros_tools.health.examine import examine

        examination = examine(self._robot.environment)
        found = [each.as_json() for each in examination.findings]
        rows = [each for each in found if not about or about in each["subjects"]]
        system = examination.system
        figures = {
            "is_healthy": examination.is_healthy,
            "is_running": system is not None,
            "findings": len(rows),
            "nodes": len(system.nodes) if system is not None else 0,
        }
        return Answer(rows, figures=figures)

    def why_no_data(self, topic: Name, wait_s: Wait = 3.0, cursor: Cursor = 0) -> Answer:
        """Find out why no data arrives on a topic. Checks publisher, types, connections, addresses, messages,
        rate, stamp, frame and queues in this order, and suggests a remedy for the first check that fails."""
        found = self._robot.check_topic(topic, wait_s).as_json()
        steps, finding = found.pop("steps"), found.pop("finding")
        note = (
            "Nothing is wrong." if finding is None else "The last step fails; later steps were not checked."
        )
        return Answer([found, *steps, *filter(None, [finding])], note, {"passes": finding is None})


def _some(names: Sequence[str]) -> list[str]:
    left = len(names) - SHOWN_NAMES
    return [*names[:SHOWN_NAMES], *([f"... and {left} more"] if left > 0 else [])]


def _known_types() -> list[str]:
    kinds = MESSAGES, SERVICES, ACTIONS
    return [
        f"{package}/{name}" for kind in kinds for package in kind.packages() for name in kind.names(package)
    ]


def _lines(kind: str) -> list[str]:
    return [f"type {kind}", *load_message_class(kind)._full_text.splitlines()]


def _service_lines(kind: str) -> Iterator[str]:
    found: Any = load_service_class(kind)
    yield "request"
    yield from found._request_class._full_text.splitlines()
    yield "response"
    yield from found._response_class._full_text.splitlines()
