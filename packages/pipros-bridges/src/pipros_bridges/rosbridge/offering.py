"""Services that clients offer. The node passes each call to the client, which sends the response."""

from __future__ import annotations

import itertools
import threading
from collections.abc import Callable, Mapping
from concurrent.futures import Future
from concurrent.futures import TimeoutError as NotInTime
from typing import Any, Final, Protocol
from weakref import WeakValueDictionary

from pipros.basics.errors import PiprosError
from pipros.basics.printable import printable
from pipros.msg import load_service_class
from pipros.node import Node
from pipros.node.service_server import HandlerError, ServiceServer
from pipros_bridges.rosbridge.filling import Filler

REPLIES_S: Final = 0.5
"""Time (s) for the callers of a withdrawn service to receive the error."""
_LONGEST_REASON: Final = 2000


class Offerer(Protocol):
    """A client that offers services. A protocol because `RosbridgeSession` imports this module."""

    def send_call(self, operation: Mapping[str, Any], request: Any) -> None:
        """Send the operation `call_service` with the values of a request.

        Raises:
            PiprosError: a value of the request cannot be represented in the client's encoding.
        """


class OfferedServices:
    """The services of all clients.

    A new offer replaces an earlier offer with the same name, for example after a page has been reloaded.
    Offering and withdrawing take time, and wait only for the same on the same service.
    """

    def __init__(self, node: Node, filler: Filler, answer_s: float) -> None:
        """Create an empty set of services. `answer_s` is the maximum time (s) to wait for a response."""
        self._node = node
        self._filler = filler
        self._answer_s = answer_s
        self._offers: dict[str, _Offer] = {}
        self._lock = threading.Lock()  # for `_locks`; never held while anything waits
        self._locks: WeakValueDictionary[str, threading.Lock] = WeakValueDictionary()

    def offer(self, client: Offerer, service: str, kind: str, name: str) -> None:
        """Offer a service on behalf of a client. `name` is the service's name as the client wrote it.

        Raises:
            PiprosError: the type is unknown, or the node itself has a service with this name.
        """
        service_class: Any = load_service_class(kind)
        with self._lock_of(service):
            self._withdraw(self._offers.pop(service, None))
            offer = _Offer(client, name, self._answer_s, service_class)
            offer.server = self._node.serve(service, service_class, offer.call)
            self._offers[service] = offer

    def withdraw(self, client: Offerer, service: str) -> None:
        """Withdraw a service of this client; its callers get an error. Ignore services of other clients."""
        with self._lock_of(service):
            found = self._offers.get(service)
            if found is not None and found.client is client:
                self._withdraw(self._offers.pop(service))

    def answer(self, client: Offerer, service: str, call: object, values: Any, *, is_success: bool) -> None:
        """Pass the client's response to the caller.

        A response without an id answers the open call, if there is only one.

        Raises:
            PiprosError: the client does not offer the service, the call is not open, or the values do not fit
                the response. In the last case, the call also fails.
        """
        found = self._offers.get(service)
        if found is None or found.client is not client:
            raise PiprosError(f"{service} is no longer offered by this client")
        found.answer(call, values, self._filler, is_success=is_success)

    def close(self) -> None:
        """Make all open and future calls fail. The node's shutdown unadvertises the services."""
        for offer in list(self._offers.values()):
            offer.fail("the bridge is shutting down")
        self._offers.clear()

    def _lock_of(self, service: str) -> threading.Lock:
        with self._lock:
            return self._locks.setdefault(service, threading.Lock())

    def _withdraw(self, offer: _Offer | None) -> None:
        if offer is None:
            return
        if offer.fail("the client no longer offers the service, or has disconnected"):
            threading.Event().wait(REPLIES_S)  # closing the service closes the callers' connections
        if offer.server is not None:
            self._node.endpoints.stop_serving(offer.server)


class _Offer:
    """A client's service and its pending calls."""

    def __init__(self, client: Offerer, name: str, answer_s: float, service_class: Any) -> None:
        self.client = client
        self.server: ServiceServer | None = None
        self._name = name
        self._answer_s = answer_s
        self._response_class: Callable[[], Any] = service_class._response_class
        self._numbers = itertools.count(1)
        self._open: dict[str, Future[Any]] = {}
        self._failure = ""
        self._lock = threading.Lock()

    def call(self, request: Any) -> Any:
        """Forward a call to the client, and return its response. Runs in one of the node's threads."""
        identity = f"service_request:{self._name}:{next(self._numbers)}"
        answer: Future[Any] = Future()
        with self._lock:
            if self._failure:
                raise HandlerError(self._failure)
            self._open[identity] = answer
        try:
            self.client.send_call({"op": "call_service", "service": self._name, "id": identity}, request)
            return answer.result(self._answer_s)
        except NotInTime:
            raise HandlerError(f"the client did not answer within {self._answer_s:g} s") from None
        except PiprosError as error:
            raise HandlerError(str(error)) from None
        finally:
            with self._lock:
                self._open.pop(identity, None)

    def answer(self, call: object, values: Any, filler: Filler, *, is_success: bool) -> None:
        """Complete an open call. Raises the same errors as `OfferedServices.answer`."""
        with self._lock:
            if call is None and len(self._open) == 1:
                call = next(iter(self._open))
            waiting = self._open.pop(call, None) if isinstance(call, str) else None
        if waiting is None:
            raise PiprosError(f"{self._name} has no open call with the id {printable(call)}")
        if not is_success:
            reason = printable(values, _LONGEST_REASON) if values else "the client reported a failure"
            waiting.set_exception(HandlerError(reason))
            return
        response = self._response_class()
        try:
            if response.__slots__ and not isinstance(values, (dict, list)):
                raise PiprosError(f"values must be an object or a list, got {printable(values)}")
            filler.fill(response, values)
        except PiprosError as error:
            waiting.set_exception(HandlerError(f"the client's response does not fit: {error}"))
            raise
        waiting.set_result(response)

    def fail(self, reason: str) -> bool:
        """Make all open and future calls fail. Return whether any calls were open."""
        with self._lock:
            self._failure = reason
            waiting = list(self._open.values())
            self._open.clear()
        for each in waiting:
            each.set_exception(HandlerError(reason))
        return bool(waiting)
