"""Look up services by querying the master and the service servers."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from pipros.basics.errors import PiprosError, Refused
from pipros.basics.printable import printable
from pipros.net.master_client import MasterClient
from pipros_tools.graph.errors import GraphError
from pipros_tools.graph.system_state import SystemState

if TYPE_CHECKING:
    from pipros.node.open_calls import OpenCalls
    from pipros.node.service_server import ServiceClass

PROBE_DEADLINE_S = 5.0
ASKED_AT_ONCE = 16
"""Maximum number of servers that are queried concurrently."""


def nodes_by_service(master: MasterClient) -> dict[str, str]:
    """Map each service to the node that offers it, in the order of registration."""
    services = SystemState.from_state(master.get_system_state()).services
    return {service: services[service][0] for service in services if services[service]}


def uri_of(master: MasterClient, service: str) -> str | None:
    """Return the URI of a service, `rosrpc://HOST:PORT`, or None if the service is not available."""
    try:
        return master.lookup_service(service)
    except Refused:
        return None


def header_of(master: MasterClient, service: str, calls: OpenCalls | None = None) -> Mapping[str, str] | None:
    """Return the server's connection header (`type`, `md5sum`, …), or None if the service does not exist.

    Raises:
        GraphError: the server does not answer.
    """
    uri = uri_of(master, service)
    return None if uri is None else header_at(uri, service, master.caller_id, calls)


def header_at(uri: str, service: str, caller_id: str, calls: OpenCalls | None = None) -> Mapping[str, str]:
    """Return the connection header that the server at a URI sends for a service.

    Args:
        calls: group of open calls to which the lookup is added; interrupting the group ends the lookup.

    Raises:
        GraphError: the server does not answer, or the URI is invalid.
    """
    import time

    from pipros.node.service_link import ServiceFailed, ServiceLink
    from pipros.wire.handshake import WireType

    deadline = time.monotonic() + PROBE_DEADLINE_S
    try:
        link = ServiceLink(
            uri, service, caller_id, WireType("*", "*"), deadline=deadline, probe=True, calls=calls
        )
    except ServiceFailed as error:
        raise GraphError(
            f"Unable to communicate with service [{service}] at [{printable(uri)}]: {error}"
        ) from None
    link.close()
    return link.fields


def type_of(master: MasterClient, service: str, calls: OpenCalls | None = None) -> str | None:
    """Return the type of a service, or None if the service is not available.

    Raises:
        GraphError: the server does not answer.
    """
    header = header_of(master, service, calls)
    return None if header is None else header.get("type")


def service_class_of(master: MasterClient, service: str, calls: OpenCalls | None = None) -> ServiceClass:
    """Return the class of a service. Its type is determined by querying the server.

    Args:
        calls: group of open calls to which the lookup is added; interrupting the group ends the lookup.

    Raises:
        GraphError: the service is not available or does not answer, or its type is not installed.
    """
    from pipros.msg import load_service_class

    type_name = type_of(master, service, calls)
    if type_name is None:
        raise GraphError(f"Service [{service}] is not available.")
    try:
        found: Any = load_service_class(type_name)
    except PiprosError as error:
        raise GraphError(
            f"Unable to load type [{printable(type_name)}].\nHave you typed 'make'? ({error})"
        ) from None
    service_class: ServiceClass = found
    return service_class


def argument_names(service_class: ServiceClass) -> str:
    """Return the names of the request's fields, separated by spaces."""
    return " ".join(service_class._request_class.__slots__)


def was_silent(began_s: float, timeout_s: float) -> bool:
    """Return whether a call that failed now, and began at a monotonic time, was not answered in time.

    The clock of Windows has steps of 16 ms, and may have measured less than the timeout.
    """
    import time

    return time.monotonic() - began_s >= timeout_s / 2


def services_of_type(master: MasterClient, type_name: str) -> list[str]:
    """Return the services of a type, in the order of registration. Unresponsive servers are skipped.

    An address that has timed out is not called for its other services, until all others have been called: a
    busy server may answer then.
    """
    import time

    from pipros.net.in_parallel import in_parallel

    silent: set[str] = set()

    def is_of_type(service: str) -> bool | None:
        uri = uri_of(master, service)
        if uri is None:
            return False
        if uri in silent:
            return None
        began_s = time.monotonic()
        try:
            return type_of(master, service) == type_name
        except GraphError:
            if not was_silent(began_s, PROBE_DEADLINE_S):
                return False
            silent.add(uri)
            return None

    services = nodes_by_service(master)
    found = in_parallel(services, is_of_type, at_once=ASKED_AT_ONCE)
    silent.clear()
    unanswered = [service for service, is_wanted in found.items() if is_wanted is None]
    found |= in_parallel(unanswered, is_of_type, at_once=ASKED_AT_ONCE)
    return [service for service, is_wanted in found.items() if is_wanted]
