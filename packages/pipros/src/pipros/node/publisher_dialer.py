"""Connect to a publisher of a topic over the fastest transport that both sides support."""

from __future__ import annotations

from pipros.basics.errors import PiprosError, ProtocolError, Unreachable
from pipros.basics.printable import printable
from pipros.net import local_stream, tcpros, tcpros_client
from pipros.net.rpc_async_client import call_async
from pipros.node.context import NodeContext
from pipros.wire.handshake import WireType, check_topic_reply, request_topic_link
from pipros.wire.slot_frames import ACCEPTED, HEADER_FIELD

PUBLISHERS_PER_TOPIC = 2000
"""Limit: publishers on one topic to which a node connects. Beyond it, the subscriber logs a warning, and
does not connect to further publishers.
"""

REQUEST_DEADLINE_S = 10.0
"""How long a publisher may take to answer `requestTopic`."""

LOG_TOPICS = ("/rosout", "/rosout_agg")
"""Topics that need no shared memory, because log messages are small. Every node publishes `/rosout`, and
starts faster if the modules for shared memory are not loaded.
"""


class PublisherDialer:
    """Connects to publishers of a topic: over a Unix stream, with shared memory if possible, or over TCP.

    Remembers which transports failed with which publisher, and does not try them again.
    """

    def __init__(self, topic: str, interface: WireType, context: NodeContext) -> None:
        self._topic = topic
        self._interface = interface
        self._context = context
        self._tcp_only: set[str] = set()  # URIs of publishers whose Unix streams failed
        self._without_memory: set[str] = set()  # URIs of publishers whose shared memory failed

    def avoid_memory(self, uri: str) -> None:
        """Stop requesting shared memory from this publisher."""
        self._remember(uri, self._without_memory)

    def _remember(self, uri: str, publishers: set[str]) -> None:
        if len(publishers) >= PUBLISHERS_PER_TOPIC:
            publishers.clear()
        publishers.add(uri)

    async def connect(self, uri: str, *, tcp_nodelay: bool) -> tcpros.TcprosConnection:
        """Return a connection whose handshake is complete.

        Raises:
            PiprosError: the publisher is unreachable, refuses the connection or violates the protocol.
            ValueError: the publisher registered an invalid URI.
        """
        address = await self._request(uri)
        wanted = request_topic_link(
            self._topic, self._context.node_name, self._interface, tcp_nodelay=tcp_nodelay
        )
        if isinstance(address, str):
            may_share = self._topic not in LOG_TOPICS and uri not in self._without_memory
            shares = may_share and local_stream.shares_memory()
            if shares:
                wanted[HEADER_FIELD] = ACCEPTED
            try:
                connection = await tcpros_client.connect_locally(address, wanted, shares_memory=shares)
            except (ProtocolError, Unreachable):
                self._remember(uri, self._tcp_only)
                return await self.connect(uri, tcp_nodelay=tcp_nodelay)
        else:
            connection = await tcpros_client.connect(*address, wanted, timings=self._context.timings.links)
        try:
            peer = address if isinstance(address, str) else f"{address[0]}:{address[1]}"
            check_topic_reply(connection.fields, self._interface, peer)
        except PiprosError:
            connection.sock.close()
            raise
        return connection

    async def _request(self, uri: str) -> tuple[str, int] | str:
        """Request the topic's address from a publisher.

        Return the host and port for TCPROS, or the name of a Unix stream.
        """
        answer = await call_async(
            uri,
            "requestTopic",
            self._context.node_name,
            self._topic,
            [["TCPROS"]] if uri in self._tcp_only else local_stream.offer(),
            timeout_s=REQUEST_DEADLINE_S,
        )
        match answer:
            case [1, _, ["TCPROS", str(host), int(port)]]:
                return host, port
            case [1, _, [local_stream.PROTOCOL, local_stream.VERSION, str(name)]] if (
                uri not in self._tcp_only
            ):
                return name
            case [int(code), str(text), _]:
                raise Unreachable(
                    uri, f"it does not offer the topic ({text})" if code != 1 else "it does not offer TCPROS"
                )
        raise ProtocolError(f"requestTopic returned {printable(answer)}")
