"""The slave API: the XML-RPC calls that a node accepts from the master and from other nodes.

Every response is `[code, text, value]`. Sources: http://wiki.ros.org/ROS/Slave_API and, where that page is
silent, genuine rospy. Methods are looked up in a table, so only these methods can be called.
"""

from __future__ import annotations

import asyncio
import logging
import os
import threading
from collections.abc import Callable, Mapping
from contextlib import suppress
from functools import partial
from typing import Any, Final, Protocol

from pipros.basics import names
from pipros.basics.printable import printable
from pipros.net import local_stream
from pipros.net.master_client import MasterClient
from pipros.net.rpc_server import current_caller
from pipros.node.endpoints import Endpoints
from pipros.node.params import Parameters
from pipros.node.publication import Publication
from pipros.node.registration import Registrations

RECHECK_S = 1.0
"""Limit: the time after which a node that has queried its master about untrusted callers may query it again.
Beyond it, after a node has verified a call from an untrusted caller with the master, further calls
(`publisherUpdate`, `paramUpdate`, `shutdown`) wait for this time, and are then verified together.
"""

Answer = list[Any]

ASKED_INSTEAD: Final = "the master is queried instead"
SHUTDOWN_REFUSED: Final = (
    "shutdown is only accepted from the master and from this node's machine, not from {}"
)

_DOUBTED_LIMIT: Final = 100
"""Maximum number of untrusted callers that are named in the log."""


class SlaveNode(Protocol):
    """The parts of a node that the slave API uses. A protocol because `Node` imports this module."""

    name: str
    log: logging.Logger
    master: MasterClient
    params: Parameters

    @property
    def endpoints(self) -> Endpoints: ...

    @property
    def uri(self) -> str: ...

    @property
    def registrations(self) -> Registrations: ...

    def shutdown_async(self, reason: str) -> None: ...


def slave_methods(node: SlaveNode, master_uri: str) -> Mapping[str, Callable[..., Answer]]:
    """Return the slave API's method table for `node`."""
    api = SlaveApi(node, master_uri)
    return {
        "getBusInfo": api.get_bus_info,
        "getBusStats": api.get_bus_stats,
        "getMasterUri": api.get_master_uri,
        "getName": api.get_name,
        "getPid": api.get_pid,
        "getPublications": api.get_publications,
        "getSubscriptions": api.get_subscriptions,
        "getUri": api.get_uri,
        "paramUpdate": api.param_update,
        "publisherUpdate": api.publisher_update,
        "requestTopic": api.request_topic,
        "shutdown": api.shutdown,
    }


def on_bad_arity(method: str, params: tuple[Any, ...]) -> Answer:
    """Return the response that genuine nodes give to a call with the wrong number of parameters."""
    value: object = "" if method == "getUri" else 0 if method in ("shutdown", "paramUpdate") else -1
    if not params:
        return [-1, "missing required caller_id parameter", value]
    return [-1, "Error: bad call arity", value]


class SlaveApi:
    """The slave API methods of one node. They run in the node's event loop and never block."""

    def __init__(self, node: SlaveNode, master_uri: str) -> None:
        self._node = node
        self._master_uri = master_uri
        self._verification = CallerVerification(RECHECK_S)
        self._doubted: set[tuple[str, str]] = set()

    def get_bus_stats(self, caller_id: str) -> Answer:
        del caller_id
        publications = [
            [
                publication.topic,
                sum(peer.link.statistics.bytes for peer in publication.links),
                [
                    [peer.number, peer.link.statistics.bytes, peer.link.statistics.frames, True]
                    for peer in publication.links
                ],
            ]
            for publication in self._node.endpoints.publications
        ]
        subscriptions = [
            [
                subscription.topic,
                [
                    [peer.number, peer.link.statistics.bytes, peer.link.statistics.dropped, True]
                    for peer in subscription.links
                ],
            ]
            for subscription in self._node.endpoints.subscriptions
        ]
        return [1, "", [publications, subscriptions, []]]

    def get_bus_info(self, caller_id: str) -> Answer:
        del caller_id
        port = self._node.endpoints.port
        outgoing = [
            [
                peer.number,
                peer.caller_id,
                "o",
                peer.link.transport,
                publication.topic,
                True,
                f"{peer.link.transport} connection on port {port} to "
                f"[{peer.link.peer} on socket {peer.link.descriptor}]{_memory(publication)}",
            ]
            for publication in self._node.endpoints.publications
            for peer in publication.links
        ]
        incoming = [
            [
                peer.number,
                peer.uri,
                "i",
                peer.link.transport,
                subscription.topic,
                True,
                f"{peer.link.transport} connection on port {peer.link.local_port} to "
                f"[{peer.link.peer} on socket {peer.link.descriptor}]",
            ]
            for subscription in self._node.endpoints.subscriptions
            for peer in subscription.links
        ]
        return [1, "bus info", outgoing + incoming]

    def get_master_uri(self, caller_id: str) -> Answer:
        del caller_id
        return [1, self._master_uri, self._master_uri]

    def get_name(self, caller_id: str) -> Answer:
        del caller_id
        return [1, "", self._node.name]

    def get_pid(self, caller_id: str) -> Answer:
        del caller_id
        return [1, "", os.getpid()]

    def get_uri(self, caller_id: str) -> Answer:
        del caller_id
        return [1, "", self._node.uri]

    def get_publications(self, caller_id: str) -> Answer:
        del caller_id
        return [
            1,
            "publications",
            [
                [publication.topic, publication.interface.type]
                for publication in self._node.endpoints.publications
            ],
        ]

    def get_subscriptions(self, caller_id: str) -> Answer:
        del caller_id
        return [
            1,
            "subscriptions",
            [
                [subscription.topic, subscription.interface.type]
                for subscription in self._node.endpoints.subscriptions
            ],
        ]

    def param_update(self, caller_id: str, parameter_key: str, parameter_value: Any) -> Answer:
        if not isinstance(parameter_key, str) or not parameter_key:
            return [-1, "ERROR: parameter [parameter_key] must be a non-empty string", -1]
        if not self._is_trusted(caller_id, "paramUpdate"):
            for key in self._node.params.cached_around(parameter_key):
                self._verification.ask(f"parameter {key}", partial(self._node.params.invalidate, key))
            return [1, ASKED_INSTEAD, 0]
        if self._node.params.update(parameter_key, parameter_value):
            return [1, "", 0]
        return [-1, "not subscribed", 0]

    def publisher_update(self, caller_id: str, topic: str, publishers: Any) -> Answer:
        if not isinstance(topic, str) or not topic:
            return [-1, "ERROR: parameter [topic] must be a non-empty string", -1]
        if not isinstance(publishers, list):
            return [-1, "ERROR: param [publishers] must be a list", -1]
        for uri in publishers:
            if not isinstance(uri, str):
                return [-1, "ERROR: param [publishers] must be a list of strings", -1]
            if not _is_url(uri):
                return [-1, f"ERROR: param [publishers] does not contain valid URLs [{printable(uri)}]", -1]
        subscription = self._node.endpoints.subscription(topic)
        if not self._is_trusted(caller_id, "publisherUpdate"):
            if subscription is not None:
                self._verification.ask(
                    f"topic {topic}", partial(self._node.endpoints.ask_for_publishers, topic)
                )
            return [1, ASKED_INSTEAD, 0]
        if subscription is not None:
            subscription.update_publishers(publishers)
        return [1, "", 0]

    def request_topic(self, caller_id: str, topic: str, protocols: Any) -> Answer:
        """Return the address for a topic, in one of the requested protocols.

        This node supports TCPROS and prefers, for nodes on this machine, Unix streams
        (`pipros.net.local_stream`). As in genuine nodes, unknown protocols are ignored.
        """
        del caller_id
        if not isinstance(topic, str) or not topic:
            return [-1, "ERROR: parameter [topic] must be a non-empty string", []]
        if not protocols:
            return [-1, "ERROR: parameter [protocols] must be specified and non-empty", []]
        topic = names.resolve(topic, self._node.name)
        if self._node.endpoints.publication(topic) is None:
            return [-1, f"Not a publisher of [{topic}]", []]
        local_name = self._node.endpoints.local_name
        offers = protocols if isinstance(protocols, list) else []
        if local_name and any(map(local_stream.is_offer_from_here, offers)):
            return [1, "ready on this machine", [local_stream.PROTOCOL, local_stream.VERSION, local_name]]
        if any(isinstance(offer, list) and offer[:1] == ["TCPROS"] for offer in offers):
            host, port = self._node.endpoints.address
            return [1, f"ready on {host}:{port}", ["TCPROS", host, port]]
        return [0, "no supported protocol implementations", []]

    def shutdown(self, caller_id: str, reason: str) -> Answer:
        reason = printable(reason)
        if not self._is_trusted(caller_id, "shutdown"):
            self._verification.ask("shutdown", partial(self._end_if_replaced, reason))
            return [-1, "ERROR: " + SHUTDOWN_REFUSED.format(printable(current_caller.get().host)), 0]
        self._node.log.debug("external shutdown request from [%s]: %s", printable(caller_id), reason)
        self._node.shutdown_async(reason)
        return [1, "shutdown", 0]

    def _end_if_replaced(self, reason: str) -> None:
        """Shut the node down if another node has taken its name.

        A master calls `shutdown` only in this case.
        """
        if self._node.registrations.is_replaced():
            self._node.shutdown_async(reason)

    def _is_trusted(self, caller_id: str, request: str) -> bool:
        """Return whether a call comes from the master's address or from this machine.

        A master may call from an address other than the one at which it is reached, for example behind NAT,
        in a container, or with several networks. Therefore, a call from any other address is not trusted, and
        the caller of this method queries the master instead.
        """
        caller = current_caller.get()
        if caller.host in self._node.master.addresses or caller.is_here:
            return True
        if (request, caller.host) not in self._doubted and len(self._doubted) < _DOUBTED_LIMIT:
            self._doubted.add((request, caller.host))
            self._node.log.warning(
                "%s of [%s] came from %s, which is an address of neither the master nor this machine: "
                "querying the master instead. Further calls from there are not logged",
                request,
                printable(caller_id),
                caller.host or "a closed connection",
            )
        return False


def _memory(publication: Publication) -> str:
    """Describe a topic's shared memory for `getBusInfo`; empty if it has none."""
    memory = publication.memory
    if memory is None or not memory.used_bytes:
        return ""
    return f", shared memory: {memory.used_bytes} of at most {memory.limit_bytes} bytes"


def _is_url(text: str) -> bool:
    """Return True if the text has a scheme and a part after `//`."""
    scheme, sign, rest = text.partition("://")
    return bool(scheme and sign and rest.partition("/")[0])


Question = Callable[[], object]


class CallerVerification:
    """Queries the master about the claims of untrusted callers.

    The first query is sent immediately. Queries that are requested while it is running, or within
    `interval_s` after its response, are sent together afterwards, without duplicates. A peer that calls a
    thousand times therefore costs the master few calls, and a notice from a master with an unexpected address
    still takes effect, though later. Queries run in a separate thread, so that the event loop never waits.
    """

    def __init__(self, interval_s: float) -> None:
        self._interval_s = interval_s
        self._waiting: dict[str, Question] = {}
        self._is_busy = False

    def ask(self, about: str, question: Question) -> None:
        """Schedule `question` to be called in another thread. Must be called from the event loop.

        Args:
            about: the subject. A queued question with the same subject is replaced.
        """
        self._waiting[about] = question
        if not self._is_busy:
            self._send_next()

    def _send_next(self) -> None:
        questions, self._waiting = self._waiting, {}
        self._is_busy = bool(questions)
        if questions:
            loop = asyncio.get_running_loop()
            threading.Thread(
                target=self._ask_all, args=(questions, loop), name="question to the master", daemon=True
            ).start()

    def _ask_all(self, questions: Mapping[str, Question], loop: asyncio.AbstractEventLoop) -> None:
        try:
            for question in questions.values():
                question()
        finally:
            with suppress(RuntimeError):  # the node and its event loop have ended
                loop.call_soon_threadsafe(loop.call_later, self._interval_s, self._send_next)
