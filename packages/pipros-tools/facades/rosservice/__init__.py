"""Python API of `rosservice`: list services, look up their types, and call them.

Functions that query the system raise `ROSServiceIOException` if the master cannot be reached.
Facade of `pipros_tools.graph`; see http://wiki.ros.org/rosservice.
"""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from pipros.basics.errors import PiprosError
from pipros.basics.uri import split_uri
from pipros_tools.cli.rosservice import main as _main
from pipros_tools.graph import services as _services
from pipros_tools.graph.client import GraphClient
from pipros_tools.graph.errors import translated
from pipros_tools.graph.service_call import ServiceCaller
from pipros_tools.graph.system_state import is_below

__all__ = [
    "NAME",
    "ROSServiceException",
    "ROSServiceIOException",
    "call_service",
    "get_service_args",
    "get_service_class_by_name",
    "get_service_headers",
    "get_service_list",
    "get_service_node",
    "get_service_type",
    "get_service_uri",
    "has_service_args",
    "rosservice_find",
    "rosservicemain",
]

NAME = "rosservice"


class ROSServiceException(Exception):
    """A rosservice function failed."""


class ROSServiceIOException(ROSServiceException):
    """The master or a service cannot be reached."""


@contextlib.contextmanager
def _graph() -> Iterator[GraphClient]:
    try:
        with translated(ROSServiceIOException, ROSServiceIOException), GraphClient("rosservice") as graph:
            yield graph
    except PiprosError as error:
        raise ROSServiceException(str(error)) from None


def get_service_list(
    node: str | None = None, namespace: str | None = None, include_nodes: bool = False
) -> list[str] | list[list[Any]]:
    """Return the services, optionally only the services of one node or in one namespace.

    If `include_nodes` is true, return `[[service, [node]], …]`.
    """
    with _graph() as graph:
        found = {
            service: provider
            for service, provider in _services.nodes_by_service(graph.master).items()
            if is_below(service, namespace or "/") and node in (None, provider)
        }
    if include_nodes:
        return [[service, [provider]] for service, provider in found.items()]
    return list(found)


def get_service_type(service_name: str) -> str | None:
    """Return the type of a service, or None if the service does not exist."""
    with _graph() as graph:
        return _services.type_of(graph.master, graph.resolve(service_name))


def get_service_uri(service_name: str) -> str | None:
    """Return a service's URI, `rosrpc://HOST:PORT`, or None if the service does not exist."""
    with _graph() as graph:
        return _services.uri_of(graph.master, graph.resolve(service_name))


def get_service_node(service_name: str) -> str | None:
    """Return the node that offers a service, or None if the service does not exist."""
    with _graph() as graph:
        return _services.nodes_by_service(graph.master).get(graph.resolve(service_name))


def get_service_headers(service_name: str, service_uri: str) -> Mapping[str, str]:
    """Return the connection header that the server at `service_uri` sends for a service.

    Raises:
        ROSServiceException: the URI is not `rosrpc://HOST:PORT`.
        ROSServiceIOException: the server cannot be reached.
    """
    try:
        split_uri(service_uri or "", ["rosrpc"])
    except ValueError:
        raise ROSServiceException(
            f"service [{service_name}] has an invalid RPC URI [{service_uri}]"
        ) from None
    try:
        return _services.header_at(service_uri, service_name, "/rosservice")
    except PiprosError:
        raise ROSServiceIOException(
            f"Unable to communicate with service [{service_name}], address [{service_uri}]"
        ) from None


def get_service_class_by_name(service_name: str) -> Any:
    """Return the class of a service.

    Raises:
        ROSServiceException: the service does not exist, or its type is not on ROS_PACKAGE_PATH.
    """
    with _graph() as graph:
        return _services.service_class_of(graph.master, graph.resolve(service_name))


def get_service_args(service_name: str) -> str:
    """Return the names of the fields of a service's request, separated by spaces."""
    return _services.argument_names(get_service_class_by_name(service_name))


def has_service_args(service_name: str, service_class: Any = None) -> bool:
    """Return whether a service's request has fields.

    Raises the same errors as `get_service_class_by_name`.
    """
    if service_class is None:
        service_class = get_service_class_by_name(service_name)
    return len(service_class._request_class.__slots__) > 0


def call_service(
    service_name: str, service_args: Sequence[Any] | Mapping[str, Any], service_class: Any = None
) -> tuple[Any, Any]:
    """Call a service, and return the request and the response. Blocks until the service responds.

    Args:
        service_args: the field values as a list or a dictionary, or a list that contains one dictionary.

    Raises:
        ROSServiceException: the service does not exist, the values do not fit, or the call failed.
    """
    del service_class  # the server determines the class
    with _graph() as graph:
        caller = ServiceCaller(graph.master, graph.resolve(service_name))
        request = caller.request(service_args)
        return request, caller.call(request)


def rosservice_find(service_type: str) -> list[str]:
    """Return the services with the given type."""
    with _graph() as graph:
        return _services.services_of_type(graph.master, service_type)


def rosservicemain(argv: Sequence[str] | None = None) -> None:
    """Run the command `rosservice`. `argv` starts with the program's name.

    Raises:
        SystemExit: the command failed, or its arguments are invalid.
    """
    if code := _main(None if argv is None else argv[1:]):
        sys.exit(code)
