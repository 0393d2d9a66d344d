"""Reads and sets the logger levels of other nodes, through the services that every node offers."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pipros.net.master_client import MasterClient
from pipros_tools.graph.errors import GraphError

if TYPE_CHECKING:
    from pipros.node.service_server import ServiceClass

LEVELS = ("debug", "info", "warn", "error", "fatal")

CALL_LIMIT_S = 10.0
"""Timeout for a node's response, so that an unresponsive node does not block the command."""


def levels_of(master: MasterClient, node: str, *, limit_s: float = CALL_LIMIT_S) -> dict[str, str]:
    """Return the level of each of a node's loggers. rospy spells levels in upper case; other nodes do not.

    Raises:
        GraphError: no node with this name responds.
    """
    answer = _call(master, node, "get_loggers", "roscpp/GetLoggers", limit_s)
    return {str(logger.name): str(logger.level) for logger in answer.loggers}


def set_level(master: MasterClient, node: str, logger: str, level: str) -> None:
    """Set the level of one of a node's loggers, unless it already has this level.

    Raises:
        GraphError: no node with this name responds, or the node lacks the logger.
    """
    levels = levels_of(master, node)
    if logger not in levels:
        raise GraphError(f"node {node} does not contain logger {logger}")
    if levels[logger].upper() != level.upper():
        fields = {"logger": logger, "level": level}
        _call(master, node, "set_logger_level", "roscpp/SetLoggerLevel", CALL_LIMIT_S, **fields)


def nodes_with_loggers(master: MasterClient) -> list[str]:
    """Return the nodes whose levels can be set, sorted."""
    from pipros_tools.graph.services import nodes_by_service

    suffix = "/set_logger_level"
    return sorted(name.removesuffix(suffix) for name in nodes_by_service(master) if name.endswith(suffix))


def _call(
    master: MasterClient, node: str, service: str, type_name: str, limit_s: float, **fields: str
) -> Any:
    from pipros.msg import load_service_class
    from pipros.node.open_calls import OpenCalls
    from pipros.node.service_client import ServiceClient
    from pipros.node.service_link import ServiceFailed
    from pipros_tools.graph.services import uri_of

    name = f"{node.rstrip('/')}/{service}"
    if uri_of(master, name) is None:
        raise GraphError(f"Service [{name}] is not available.")
    service_class: ServiceClass = load_service_class(type_name)
    client = ServiceClient(name, service_class, master=lambda: master, calls=OpenCalls())
    try:
        return client.call(service_class._request_class(**fields), timeout_s=limit_s)
    except ServiceFailed as error:
        raise GraphError(f"service [{name}] failed: {error}") from None
    finally:
        client.close()
