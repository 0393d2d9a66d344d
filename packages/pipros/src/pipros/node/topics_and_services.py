"""What a node's program does with topics and services, by the names that the program uses."""

from __future__ import annotations

import asyncio
import inspect
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, overload

from pipros.node import asyncio_support
from pipros.node.codec import AnyMessage, class_named
from pipros.node.context import NO_ARGS
from pipros.node.service_server import ServiceClass, ServiceServer

if TYPE_CHECKING:
    from pipros.basics.limits import Limits
    from pipros.msg.base import Message
    from pipros.net.connection_table import ConnectionTable
    from pipros.net.master_client import MasterClient
    from pipros.node.endpoints import Endpoints
    from pipros.node.open_calls import OpenCalls
    from pipros.node.publisher import Publisher
    from pipros.node.registration import Registrations
    from pipros.node.running import RunningNode
    from pipros.node.service_client import ServiceClient
    from pipros.node.subscriber import Subscriber
    from pipros.node.timings import NodeTimings


class TopicsAndServices:
    """The half of a node that its program uses while the node runs. `Node` starts and ends it."""

    name: str
    resolve: Callable[[str], str]
    limits: Limits
    master: MasterClient
    calls: OpenCalls
    _timings: NodeTimings
    _running: RunningNode | None

    @property
    def _started(self) -> RunningNode:
        if self._running is None:
            raise RuntimeError(f"{self.name} was not started")
        return self._running

    @property
    def uri(self) -> str:
        """The URI of the slave API; empty before `start`."""
        return self._running.uri if self._running is not None else ""

    @property
    def endpoints(self) -> Endpoints:
        """The node's topics and services."""
        return self._started.endpoints

    @property
    def registrations(self) -> Registrations:
        """The node's registrations with the master."""
        return self._started.registrations

    @property
    def connections(self) -> ConnectionTable:
        """The TCPROS connections that peers have opened to the node."""
        return self._started.connections

    @overload
    def advertise(
        self, topic: str, message_class: str, *, queue_size: int | None = 10, latch: bool = False
    ) -> Publisher[Any]: ...

    @overload
    def advertise(
        self, topic: str, message_class: type[AnyMessage], *, queue_size: int | None = 10, latch: bool = False
    ) -> Publisher[AnyMessage]: ...

    def advertise(
        self,
        topic: str,
        message_class: type[Message] | str,
        *,
        queue_size: int | None = 10,
        latch: bool = False,
    ) -> Publisher[Any]:
        """Advertise a topic. See `pipros.net.outgoing` for `queue_size`.

        A latched topic sends its newest message to every later subscriber.

        Args:
            message_class: a message class, or the name of its type, such as `sensor_msgs/LaserScan`.

        Raises:
            NotFound: there is no type with the given name.
            TypeConflict: this node already publishes the topic with another type.
        """
        publisher = self.endpoints.advertise(
            self.resolve(topic), class_named(message_class), queue_size=queue_size, latch=latch
        )
        self._keep(publisher)
        return publisher

    @overload
    def subscribe(
        self,
        topic: str,
        message_class: str,
        callback: Callable[..., object] | None = None,
        *,
        callback_args: object = NO_ARGS,
        queue_size: int | None = None,
        tcp_nodelay: bool = True,
        zero_copy: bool = False,
    ) -> Subscriber[Any]: ...

    @overload
    def subscribe(
        self,
        topic: str,
        message_class: type[AnyMessage],
        callback: Callable[[AnyMessage], object] | Callable[[AnyMessage, Any], object] | None = None,
        *,
        callback_args: object = NO_ARGS,
        queue_size: int | None = None,
        tcp_nodelay: bool = True,
        zero_copy: bool = False,
    ) -> Subscriber[AnyMessage]: ...

    def subscribe(
        self,
        topic: str,
        message_class: type[Message] | str,
        callback: Callable[..., object] | None = None,
        *,
        callback_args: object = NO_ARGS,
        queue_size: int | None = None,
        tcp_nodelay: bool = True,
        zero_copy: bool = False,
    ) -> Subscriber[Any]:
        """Subscribe to a topic; call `callback` with each message, in the thread that received it.

        If `queue_size` is n, a slow callback gets the n newest messages and misses older ones. In an asyncio
        loop, if there is no callback, the subscriber is an asynchronous iterator.

        If `zero_copy` is true, the callback gets `uint8[]` fields as read-only numpy arrays over the memory
        in which the message arrived. They are valid as long as anything refers to them.

        Args:
            message_class: a message class, or the name of its type, such as `sensor_msgs/LaserScan`.

        Raises:
            MissingExtra: `zero_copy` is true, and numpy is not installed.
            NotFound: there is no type with the given name.
            TypeConflict: this node already subscribes to the topic with another type.

        Examples:
            >>> async for message in node.subscribe("/chatter", String):  # doctest: +SKIP
            ...     print(message.data)
        """
        if callback is None and asyncio_support.is_in_event_loop():
            callback = asyncio_support.MessageStream[Any](queue_size)
        subscriber = self.endpoints.subscribe(
            self.resolve(topic),
            class_named(message_class),
            callback,
            callback_args=callback_args,
            queue_size=queue_size,
            tcp_nodelay=tcp_nodelay,
            zero_copy=zero_copy,
        )
        self._keep(subscriber)
        return subscriber

    def _keep(self, handle: Publisher[Any] | Subscriber[Any]) -> None:
        """Take note of a new handle. The node of a nodelet overrides this method."""

    def serve(
        self,
        service: str,
        service_class: ServiceClass,
        handler: Callable[[Any], Any],
        on_error: Callable[[BaseException], object] | None = None,
    ) -> ServiceServer:
        """Offer a service; see `ServiceServer`. A coroutine function runs in the caller's asyncio loop.

        Raises:
            NameInUse: this node already provides a service with this name.
        """
        if inspect.iscoroutinefunction(handler):
            handler = asyncio_support.run_in_loop(handler, asyncio.get_running_loop())
        return self.endpoints.serve(self.resolve(service), service_class, handler, on_error)

    def client(
        self,
        service: str,
        service_class: ServiceClass,
        *,
        persistent: bool = False,
        headers: Mapping[str, str] | None = None,
    ) -> ServiceClient:
        """Return a client for a service; see `ServiceClient`.

        Its calls are interrupted when the node shuts down.
        """
        from pipros.node.service_client import ServiceClient  # imported here because many nodes call nothing

        return ServiceClient(
            self.resolve(service),
            service_class,
            master=lambda: self.master,
            calls=self.calls,
            persistent=persistent,
            headers=headers,
            limits=self.limits,
            early_s=self._timings.early_connect_s,
        )

    async def call(
        self, service: str, service_class: ServiceClass, request: Message, timeout_s: float | None = None
    ) -> Any:
        """Call a service from a coroutine. Cancelling the coroutine ends the call.

        Raises the same errors as `ServiceClient.call`.
        """
        return await asyncio_support.call(self.client(service, service_class), request, timeout_s)

    def statistics(self) -> Mapping[str, Any]:
        """Return statistics on the node's traffic so far; see `Endpoints.statistics`."""
        return self.endpoints.statistics()
