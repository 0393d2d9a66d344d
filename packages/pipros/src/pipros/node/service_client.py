"""Call services over TCPROS.

Source: http://wiki.ros.org/ROS/TCPROS
"""

from __future__ import annotations

import itertools
import threading
import time
import weakref
from collections import deque
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from pipros.basics.errors import Interrupted, PiprosError, Refused
from pipros.basics.limits import Limits
from pipros.net import sockets
from pipros.net.busy_poll import REPLY_POLL_S, PollingReceiver
from pipros.net.master_client import MasterClient
from pipros.net.rpc_client import TIMEOUT_OF_CLIENT
from pipros.node.codec import decoder, number
from pipros.node.missing_master import MasterWait
from pipros.node.open_calls import OpenCalls
from pipros.node.service_link import CallTimeout, NotDelivered, ServiceFailed, ServiceLink
from pipros.node.service_server import ServiceClass
from pipros.node.timings import NODE_TIMINGS
from pipros.wire.handshake import WireType

if TYPE_CHECKING:
    from pipros.msg.base import Message

PROBE_INTERVAL_S = 0.3
PROBE_LIMIT_S = 10.0
"""Interval between probes while waiting for a service, and the maximum duration of one probe."""


_NO_CONTACT = "unable to contact master"

MAX_IDLE = 8
"""Maximum number of idle connections that a client keeps, so that several threads can call at the same time
without reconnecting.
"""


class ServiceClient:
    """Calls one service. A persistent client uses one connection for all calls.

    Otherwise, each call over TCP has its own connection. After a call over a Unix stream without extra
    headers, the connection stays open for the next call, which still queries the master for the server's URI.
    The server closes an unused connection after some seconds (`pipros.node.service_connection`).
    """

    def __init__(
        self,
        service: str,
        service_class: ServiceClass,
        *,
        master: Callable[[], MasterClient],
        calls: OpenCalls,
        persistent: bool = False,
        headers: Mapping[str, str] | None = None,
        limits: Limits | None = None,
        early_s: float = NODE_TIMINGS.early_connect_s,
    ) -> None:
        """Store the settings; the first call connects.

        Args:
            service: the global name.
            service_class: the service class.
            master: function that returns the client of the master, which is queried for the service's URI.
            calls: the group of running calls to which this client's calls are added, so that all can be
                interrupted together.
            persistent: whether to keep one connection for all calls.
            headers: extra connection header fields, which the service handler can read.
            limits: limits on the resources that the server can use; defaults to the process-wide limits.
            early_s: maximum time for connecting to the server of the last call before the master's response
                is read.
        """
        self._limits = limits
        self._early_s = early_s
        self.calls = OpenCalls(part_of=calls)
        self.service = service
        self.uri: str | None = None  # the server's URI at the last call
        self._expected_uri: str | None = None  # the URI to which the next call connects early
        self._interface = WireType(service_class._type, service_class._md5sum)
        self._decode = decoder(service_class._response_class)
        self._master = master
        self._persistent = persistent
        self._headers = headers
        self._numbers = itertools.count(1)
        # Shared by all connections, because it learns whether servers respond immediately.
        self._poller = PollingReceiver(REPLY_POLL_S)
        self._kept: ServiceLink | None = None
        self._kept_lock = threading.Lock()  # held while the kept link is used
        self._idle: deque[ServiceLink] = deque()  # idle connections of a client that is not persistent
        weakref.finalize(self, _close_all, self._idle).atexit = False

    def call(self, request: Message, timeout_s: float | None = None) -> Any:
        """Send the request and return the response.

        Raises:
            CallTimeout: there was no response within `timeout_s`.
            ErrorReply: the server replied with an error.
            ServiceFailed: no server was found, the server refused the call, or the connection broke.
            SerializationError: a value in the request does not fit its field. The request was not sent.
        """
        deadline = None if timeout_s is None else time.monotonic() + timeout_s
        number(request, next(self._numbers))
        self.calls.begin()
        try:
            if not self._persistent:
                return self._call_plainly(request, deadline)
            with self._kept_lock:
                if self._kept is None or self._kept.is_closed:  # the link is broken; connect again
                    self._kept, _ = self._connect(deadline)
                link = self._kept
                body = link.call(self.service, request, deadline)
            return self._response(link, body)
        finally:
            self.calls.end()

    def _call_plainly(self, request: Message, deadline: float | None) -> Any:
        link, is_reused = self._connect(deadline)
        try:
            try:
                body = link.call(self.service, request, deadline)
            except NotDelivered:
                if not is_reused:
                    raise
                link = self._link(link.uri, deadline)  # the server closed the idle connection just now
                body = link.call(self.service, request, deadline)
            return self._response(link, body)
        finally:
            if link.is_kept_by_server and not self._headers and len(self._idle) < MAX_IDLE:
                self._idle.append(link)
            else:
                link.close()

    def _response(self, link: ServiceLink, body: bytes) -> Any:
        response = self._decode(body)
        response._connection_header = link.fields
        return response

    def probe(self, timeout_s: float) -> None:
        """Check that a server responds; raise ServiceFailed if it does not."""
        deadline = time.monotonic() + timeout_s
        interface = WireType("*", "*")
        link = ServiceLink(
            self._look_up(deadline),
            self.service,
            self._master().caller_id,
            interface,
            deadline=deadline,
            probe=True,
            poller=self._poller,
            calls=self.calls,
            limits=self._limits,
        )
        link.close()

    def wait_until_available(
        self,
        timeout_s: float | None,
        *,
        pause: Callable[[float], object],
        report: Callable[[ServiceFailed], object],
    ) -> bool:
        """Probe until a server responds. Return False if none does within `timeout_s`.

        If `timeout_s` is None, wait forever, but in pytest only while the master responds.

        Args:
            pause: called with the number of seconds until the next probe; an exception that it raises ends
                the wait.
            report: called once, when a registered server or the master first fails to respond.

        Raises:
            NoMaster: the process runs pytest, and the master does not respond.
        """
        wait = MasterWait()
        deadline = None if timeout_s is None else time.monotonic() + timeout_s
        has_reported = False
        while True:
            left_s = PROBE_LIMIT_S if deadline is None else deadline - time.monotonic()
            if left_s <= 0:
                return False
            try:
                self.probe(min(left_s, PROBE_LIMIT_S))
            except ServiceFailed as error:
                if not has_reported and "unavailable" not in str(error):
                    has_reported = True
                    report(error)
                if not str(error).startswith(_NO_CONTACT):
                    wait = MasterWait()
                elif timeout_s is None:
                    wait.check(error)
            else:
                return True
            pause(min(PROBE_INTERVAL_S, left_s))

    @property
    def kept(self) -> ServiceLink | None:
        """The connection of a persistent client; None before its first call and after `close`."""
        return self._kept

    def close(self) -> None:
        """Close the connections that are kept. A later call connects again."""
        kept, self._kept = self._kept, None
        if kept is not None:
            kept.close()
        _close_all(self._idle)

    def _look_up(self, deadline: float | None, meanwhile: Callable[[], None] | None = None) -> str:
        left_s = TIMEOUT_OF_CLIENT if deadline is None else max(0.0, deadline - time.monotonic())
        try:
            return self._master().lookup_service(self.service, meanwhile, timeout_s=left_s)
        except Refused:
            raise ServiceFailed(f"service [{self.service}] unavailable") from None
        except ServiceFailed:  # `meanwhile` raised it
            raise
        except PiprosError as error:
            kind = CallTimeout if deadline is not None and time.monotonic() >= deadline else ServiceFailed
            raise kind(f"{_NO_CONTACT}: {error}") from error

    def _connect(self, deadline: float | None) -> tuple[ServiceLink, bool]:
        """Look up the server and connect to it. Return the link, and whether an earlier call has used it.

        The server is usually the same as for the last call. While the client waits for the master's response,
        it therefore connects to that server, unless it still has an idle link to the server. The link is used
        if the master returns the same URI.
        """
        # Extra header fields may be secrets, which only the server that the master names should receive.
        expected = None if self._persistent or self._headers else self._expected_uri
        idle = early = self._take_idle(expected)

        def connect_early() -> None:
            nonlocal early
            soon = time.monotonic() + self._early_s
            if expected is not None and early is None:
                try:
                    early = self._link(expected, soon if deadline is None else min(soon, deadline))
                except ServiceFailed as error:
                    if isinstance(error.__cause__, Interrupted):
                        raise

        try:
            self.uri = uri = self._look_up(deadline, connect_early)
        except BaseException:
            self._expected_uri = None
            if early is not None:
                early.close()
            raise
        # A server that did not respond soon enough is not tried early in the next call.
        self._expected_uri = None if expected is not None and early is None else uri
        if early is not None:
            if uri == expected and sockets.is_idle(early.sock):
                return early, early is idle
            early.close()
        return self._link(uri, deadline), False

    def _take_idle(self, uri: str | None) -> ServiceLink | None:
        """Return an open link to the server at `uri`, kept from an earlier call. Close unusable links."""
        while True:
            try:
                link = self._idle.pop()
            except IndexError:
                return None
            if not link.is_closed and link.uri == uri and sockets.is_idle(link.sock):
                return link
            link.close()

    def _link(self, uri: str, deadline: float | None) -> ServiceLink:
        return ServiceLink(
            uri,
            self.service,
            self._master().caller_id,
            self._interface,
            deadline=deadline,
            persistent=self._persistent,
            extra=self._headers,
            poller=self._poller,
            calls=self.calls,
            limits=self._limits,
        )


def _close_all(links: deque[ServiceLink]) -> None:
    while links:
        links.pop().close()
