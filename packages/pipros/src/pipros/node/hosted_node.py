"""A node without ports, inside the process of another node: the node of a nodelet."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable, Mapping, Sequence
from threading import get_ident
from typing import Any

from pipros.basics import names, one_thread
from pipros.basics.interruptible_wait import OnceEvent
from pipros.node.clock import Clock
from pipros.node.identity import Identity
from pipros.node.node import Node
from pipros.node.open_calls import OpenCalls
from pipros.node.publisher import Publisher
from pipros.node.service_server import ServiceClass, ServiceServer
from pipros.node.subscriber import Subscriber


class HostedNode(Node):
    """A nodelet's own names, parameters, remappings and handles. Its host provides ports, clock and master.

    The master knows only the host, so a topic that the nodelet advertises belongs to the host. `shutdown`
    ends only the nodelet: it runs the hooks, and releases all handles. When the host shuts down, it
    also shuts its nodelets down. Messages between nodelets of one host are passed as objects, so a message
    must not be changed after it has been published.

    Attributes:
        arguments: the nodelet's command-line arguments, without remappings.
    """

    def __init__(
        self,
        host: Node,
        name: str,
        *,
        remappings: Mapping[str, str] | None = None,
        arguments: Sequence[str] = (),
        log: logging.Logger | None = None,
    ) -> None:
        """Create the node. The host must already have been started.

        Args:
            name: the full name, such as `/camera/debayer`.
            remappings: maps global names to global names. The host's remappings apply to the results.
            arguments: the nodelet's command-line arguments, without remappings.
            log: defaults to the host's logger.
        """
        host.hand_over_messages()
        self.host = host
        self.arguments = tuple(arguments)
        own = {source: host.resolve(target) for source, target in (remappings or {}).items()}
        self.identity = Identity(
            name,
            names.namespace(name),
            names.parse_arguments(()),
            {**host.identity.remappings, **own},
            host.environment,
        )
        self.name = name
        self.namespace = self.identity.namespace
        self.environment = host.environment
        self.resolve = self.identity.resolve
        self.limits = host.limits
        self.log = log or host.log
        self.master = host.master
        self.params = host.params.for_names(self.resolve)
        self._timings = host._timings
        self._on_shutdown_request = self._end_by_request
        self.calls = OpenCalls(part_of=host.calls)
        self._loop = host._loop
        self._running = host._running
        self._lock = threading.Lock()
        self._ending_thread: int | None = None
        self._ended = OnceEvent()
        self._shutdown_hooks: list[Callable[[], object]] = []
        self._handles: list[Publisher[Any] | Subscriber[Any]] = []
        self._servers: list[ServiceServer] = []
        host.on_shutdown(self._end_with_host)

    @property
    def clock(self) -> Clock:  # type: ignore[override]
        """The clock of the host."""
        return self.host.clock

    def start(self) -> None:
        """Do nothing: the host has been started."""

    def _end_with_host(self) -> None:
        self.shutdown("its host ends")

    def end_soon(self, end: Callable[[str], object], reason: str) -> None:
        """Call `end` in another thread. Without threads, the callbacks of other nodes go on waiting."""
        one_thread.start_thread(end, reason, name=f"end {self.name}")

    def shutdown(self, reason: str = "") -> None:
        """Run the hooks, and release all handles. Blocks until done; may be called repeatedly."""
        with self._lock:
            is_first, self._ending_thread = self._ending_thread is None, self._ending_thread or get_ident()
        if not is_first:
            if self._ending_thread != get_ident():
                self._ended.wait()
            return
        self.log.debug("%s ends: %s", self.name, reason)
        self._run_hooks()
        self.calls.interrupt(self._timings.call_grace_s)
        self.host.remove_shutdown_hook(self._end_with_host)
        # The subscribers end first, so that no callback publishes on a topic that has ended.
        for handle in sorted(self._handles, key=lambda each: isinstance(each, Publisher)):
            handle.unregister()
        for server in self._servers:
            self.endpoints.stop_serving(server)
        self._ended.set()

    def serve(
        self,
        service: str,
        service_class: ServiceClass,
        handler: Callable[[Any], Any],
        on_error: Callable[[BaseException], object] | None = None,
    ) -> ServiceServer:
        """Offer a service until the nodelet ends; see `Node.serve`."""
        server = super().serve(service, service_class, handler, on_error)
        self._servers.append(server)
        return server

    @property
    def subscribers(self) -> Sequence[Subscriber[Any]]:
        """The handles of the nodelet's current subscriptions."""
        return [each for each in self._handles if isinstance(each, Subscriber) and each.is_registered]

    def _keep(self, handle: Publisher[Any] | Subscriber[Any]) -> None:
        # Lazy nodelets subscribe repeatedly, so handles that have been released are removed.
        self._handles = [*(each for each in self._handles if each.is_registered), handle]
