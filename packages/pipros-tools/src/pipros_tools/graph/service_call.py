"""Calls services with YAML values."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from pipros.net.master_client import MasterClient
from pipros_tools.graph.errors import GraphError
from pipros_tools.graph.services import argument_names, service_class_of, uri_of

if TYPE_CHECKING:
    from pipros.node.open_calls import OpenCalls
    from pipros.node.service_server import ServiceClass

POLL_PERIOD_S = 0.05


def wait_for_service(
    master: MasterClient, service: str, *, pause: Callable[[float], object] = time.sleep
) -> None:
    """Block until the service is available, or until Ctrl-C."""
    while uri_of(master, service) is None:
        pause(POLL_PERIOD_S)


class ServiceCaller:
    """Calls one service with YAML values."""

    def __init__(
        self,
        master: MasterClient,
        service: str,
        service_class: ServiceClass | None = None,
        *,
        calls: OpenCalls | None = None,
    ) -> None:
        """Query the server for the service type, unless the class is given.

        Args:
            calls: group to which this lookup and later calls are added; interrupting the group ends them.

        Raises:
            GraphError: the service is not available or does not answer, or its type is not installed.
        """
        from pipros.node.open_calls import OpenCalls
        from pipros.node.service_client import ServiceClient

        calls = calls or OpenCalls()
        self._class = service_class or service_class_of(master, service, calls)
        self._client = ServiceClient(service, self._class, master=lambda: master, calls=calls)

    @property
    def type_and_md5sum(self) -> tuple[str, str]:
        """The type of the service and its MD5 sum."""
        return self._class._type, self._class._md5sum

    @property
    def takes_arguments(self) -> bool:
        return bool(self._class._request_class.__slots__)

    def request(self, values: Sequence[Any] | Mapping[str, Any]) -> Any:
        """Create the request from one value per field, a dictionary, or a list of one dictionary.

        Raises:
            GraphError: the values do not fit the fields.
        """
        from pipros.msg import load_message_class
        from pipros.msg.check import check_values
        from pipros.msg.errors import MessageException, SerializationError
        from pipros.msg.from_yaml import fill_message_args
        from pipros.msg.time import NS_PER_S, Time

        request = self._class._request_class()
        now = Time(*divmod(time.time_ns(), NS_PER_S))
        keys = {"now": now, "auto": load_message_class("std_msgs/Header")(stamp=now)}
        given = [values] if isinstance(values, Mapping) else list(values)
        try:
            fill_message_args(request, given, keys)
        except (MessageException, ValueError) as error:
            listed = "\n".join(f" * {value} (type {type(value).__name__})" for value in given)
            raise GraphError(
                f"Incompatible arguments to call service:\n{error}\nProvided arguments are:\n{listed}\n\n"
                f"Service arguments are: [{argument_names(self._class)}]"
            ) from None
        for name, kind in zip(request.__slots__, request._slot_types, strict=True):
            if kind == "bool" and isinstance(getattr(request, name), int):
                setattr(request, name, bool(getattr(request, name)))  # Noetic accepts any integer
        try:
            check_values(request)
        except SerializationError as error:
            raise GraphError(
                "Unable to send request. One of the fields has an incorrect type:\n"
                f"  {error}\n\nsrv file:\n{self._definition()}"
            ) from None
        return request

    def call(self, request: Any, timeout_s: float | None = None) -> Any:
        """Call the service and return its response.

        Raises:
            CallTimeout: no response arrived within `timeout_s`.
            ServiceFailed: the server did not respond, or reported an error.
        """
        return self._client.call(request, timeout_s)

    def _definition(self) -> str:
        request, response = self._class._request_class, self._class._response_class
        halves = (
            "".join(f"{kind} {name}\n" for name, kind in zip(half.__slots__, half._slot_types, strict=True))
            for half in (request, response)
        )
        return "---\n".join(halves)
