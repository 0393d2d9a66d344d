"""The slave API: what the master and other nodes may ask of a node by XML-RPC.

Every answer is `[code, text, value]`. Sources: http://wiki.ros.org/ROS/Slave_API and, where it is
silent, genuine rospy. Methods are looked up in a table, so that nothing else can be called.
"""

from __future__ import annotations

import contextlib
import logging
import os
import socket
from collections.abc import Callable, Mapping
from typing import Any, Protocol

from pipros import names
from pipros.env import split_master_uri
from pipros.errors import PiprosError
from pipros.net.address import is_loopback, plain_address
from pipros.net.rpc_server import caller_address
from pipros.node.params import Parameters
from pipros.node.topics import Topics

Answer = list[Any]


class Host(Protocol):
    """What the slave API asks of the node that it speaks for."""

    name: str
    host: str
    log: logging.Logger
    params: Parameters
    topics: Topics

    def end_soon(self, reason: str) -> None: ...


def slave_methods(node: Host, master_uri: str) -> Mapping[str, Callable[..., Answer]]:
    """The table of the methods that `node` answers."""
    api = SlaveApi(node, master_uri)
    return {
        "getBusInfo": api.get_bus_info,
        "getBusStats": api.get_bus_stats,
        "getMasterUri": api.get_master_uri,
        "getName": api.get_name,
        "getPid": api.get_pid,
        "getPublications": api.get_publications,
        "getSubscriptions": api.get_subscriptions,
        "paramUpdate": api.param_update,
        "publisherUpdate": api.publisher_update,
        "requestTopic": api.request_topic,
        "shutdown": api.shutdown,
    }


def on_bad_arity(method: str, params: tuple[Any, ...]) -> Answer:
    """What genuine nodes answer to a call with the wrong number of parameters."""
    value = 0 if method in ("shutdown", "paramUpdate") else -1
    if not params:
        return [-1, "missing required caller_id parameter", value]
    return [-1, "Error: bad call arity", value]


class SlaveApi:
    """Answers for one node. Runs in the node's event loop and never blocks."""

    def __init__(self, node: Host, master_uri: str) -> None:
        self._node = node
        self._master_uri = master_uri
        self._master_addresses: frozenset[str] = frozenset()

    def get_bus_stats(self, caller_id: str) -> Answer:
        del caller_id
        publications = [
            [
                one.topic,
                sum(peer.link.statistics.bytes for peer in one.links),
                [
                    [peer.number, peer.link.statistics.bytes, peer.link.statistics.frames, True]
                    for peer in one.links
                ],
            ]
            for one in self._node.topics.publications
        ]
        subscriptions = [
            [
                one.topic,
                [
                    [peer.number, peer.link.statistics.bytes, peer.link.statistics.dropped, True]
                    for peer in one.links
                ],
            ]
            for one in self._node.topics.subscriptions
        ]
        return [1, "", [publications, subscriptions, []]]

    def get_bus_info(self, caller_id: str) -> Answer:
        del caller_id
        port = self._node.topics.port
        outgoing = [
            [
                peer.number,
                peer.caller_id,
                "o",
                "TCPROS",
                one.topic,
                True,
                f"TCPROS connection on port {port} to [{peer.link.peer}]",
            ]
            for one in self._node.topics.publications
            for peer in one.links
        ]
        incoming = [
            [
                peer.number,
                peer.uri,
                "i",
                "TCPROS",
                one.topic,
                True,
                f"TCPROS connection to [{peer.link.peer}]",
            ]
            for one in self._node.topics.subscriptions
            for peer in one.links
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

    def get_publications(self, caller_id: str) -> Answer:
        del caller_id
        return [
            1,
            "publications",
            [[one.topic, one.interface.type] for one in self._node.topics.publications],
        ]

    def get_subscriptions(self, caller_id: str) -> Answer:
        del caller_id
        return [
            1,
            "subscriptions",
            [[one.topic, one.interface.type] for one in self._node.topics.subscriptions],
        ]

    def param_update(self, caller_id: str, parameter_key: str, parameter_value: Any) -> Answer:
        del caller_id
        if not isinstance(parameter_key, str) or not parameter_key:
            return [-1, "ERROR: parameter [parameter_key] must be a non-empty string", -1]
        if self._node.params.update(parameter_key, parameter_value):
            return [1, "", 0]
        return [-1, "not subscribed", 0]

    def publisher_update(self, caller_id: str, topic: str, publishers: Any) -> Answer:
        if not isinstance(topic, str) or not topic:
            return [-1, "ERROR: parameter [topic] must be a non-empty string", -1]
        if not isinstance(publishers, list):
            return [-1, "ERROR: param [publishers] must be a list", -1]
        if (refusal := self._distrust(caller_id, "publisherUpdate")) is not None:
            return [-1, refusal, -1]
        subscription = self._node.topics.subscription(topic)
        if subscription is not None:
            subscription.update_publishers(uri for uri in publishers if isinstance(uri, str))
        return [1, "", 0]

    def request_topic(self, caller_id: str, topic: str, protocols: Any) -> Answer:
        """Where a topic is to be had. Protocols that are unknown here are skipped, as genuine nodes do."""
        del caller_id
        if not isinstance(topic, str) or not topic:
            return [-1, "ERROR: parameter [topic] must be a non-empty string", []]
        if not protocols:
            return [-1, "ERROR: parameter [protocols] must be specified and non-empty", []]
        topic = names.resolve(topic, self._node.name)
        if self._node.topics.publication(topic) is None:
            return [-1, f"Not a publisher of [{topic}]", []]
        for protocol in protocols if isinstance(protocols, list) else ():
            if isinstance(protocol, list) and protocol and protocol[0] == "TCPROS":
                host, port = self._node.host, self._node.topics.port
                return [1, f"ready on {host}:{port}", ["TCPROS", host, port]]
        return [0, "no supported protocol implementations", []]

    def shutdown(self, caller_id: str, reason: str) -> Answer:
        if (refusal := self._distrust(caller_id, "shutdown")) is not None:
            return [-1, refusal, 0]
        self._node.log.debug("external shutdown request from [%s]: %s", caller_id, reason)
        self._node.end_soon(reason)
        return [1, "shutdown", 0]

    def _distrust(self, caller_id: str, request: str) -> str | None:
        """Why a request is refused that only the master and this machine may make; None when it is not."""
        peer = caller_address.get()
        if is_loopback(peer) or peer in self._addresses_of_master():
            return None
        self._node.log.warning(
            "refused %s of [%s] from %s, which is not the master", request, caller_id, peer
        )
        return f"ERROR: {request} is accepted from the master and this machine only, not from {peer}"

    def _addresses_of_master(self) -> frozenset[str]:
        if not self._master_addresses:
            with contextlib.suppress(OSError, PiprosError):
                host, _ = split_master_uri(self._master_uri)
                found = socket.getaddrinfo(host, None)
                self._master_addresses = frozenset(plain_address(str(info[4][0])) for info in found)
        return self._master_addresses
