"""A Zenoh router, and a peer that behaves like a node with rmw_zenoh.

The peer follows the published format, and does not use `pipros_ros2`.
"""

from __future__ import annotations

import itertools
import json
import struct
from collections.abc import Callable
from typing import Any

import xxhash
import zenoh
import zenoh.ext

from tests.support.ports import ClaimedPort

STRING = "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18"
ADD = "RIHS01_e118de6bf5eeb66a2491b5bda11202e7b68f198d6f67922cf30364858239c81a"
STRING_TYPE = "std_msgs::msg::dds_::String_"
ADD_TYPE = "example_interfaces::srv::dds_::AddTwoInts_"

LATCHED = ":1:,1:,:,:,,"
VOLATILE = "::,10:,:,:,,"


def _session(**values: Any) -> Any:
    config: Any = zenoh.Config()
    base: dict[str, Any] = {
        "scouting/multicast/enabled": False,
        "timestamping/enabled": True,
        "transport/shared_memory/enabled": False,
    }
    for key, value in (base | values).items():
        config.insert_json5(key, json.dumps(value))
    return zenoh.open(config)


class Router:
    """A router on a free port."""

    def __init__(self) -> None:
        self._port = ClaimedPort()
        self.address = f"tcp/127.0.0.1:{self._port.number}"
        listen = {"listen/endpoints": [self.address], "connect/endpoints": []}
        self._session = _session(mode="router", **listen)

    def close(self) -> None:
        self._session.close()
        self._port.release()


class Peer:
    """A Zenoh session with one node, `/peer`."""

    def __init__(self, router: Router, domain: int = 0) -> None:
        connect = {"connect/endpoints": [router.address], "listen/endpoints": []}
        self.session = _session(mode="client", **connect)
        self.domain = domain
        self.id = str(self.session.zid())
        self._tokens: set[str] = set()
        self._numbers = itertools.count(1)
        self._kept: list[Any] = []
        liveliness = self.session.liveliness()
        watch = liveliness.declare_subscriber(f"@ros2_lv/{domain}/**", self._changed, history=True)
        self._kept += [watch, liveliness]

    @property
    def tokens(self) -> set[str]:
        """The liveliness tokens of other sessions, as a copy, because a Zenoh thread changes the set."""
        return self._tokens.copy()

    def _changed(self, change: zenoh.Sample) -> None:
        token = str(change.key_expr)
        if token.split("/")[2] == self.id:
            return
        if change.kind == zenoh.SampleKind.PUT:
            self._tokens.add(token)
        else:
            self._tokens.discard(token)

    def declare(self, kind: str, name: str, type_name: str, type_hash: str, qos: str = VOLATILE) -> bytes:
        """Declare the token of an endpoint, and return its GID."""
        mangled = name.replace("/", "%")
        token = (
            f"@ros2_lv/{self.domain}/{self.id}/0/{next(self._numbers)}/{kind}/%/%/peer/{mangled}/{type_name}"
        )
        token += f"/{type_hash}/{qos}"
        self._kept.append(self.session.liveliness().declare_token(token))
        return gid_of(token)

    def key(self, name: str, type_name: str, type_hash: str) -> str:
        return f"{self.domain}{name}/{type_name}/{type_hash}"

    def publisher(self, name: str, *, is_latched: bool = False, type_hash: str = STRING) -> PeerPublisher:
        gid = self.declare("MP", name, STRING_TYPE, type_hash, LATCHED if is_latched else VOLATILE)
        options: dict[str, Any] = {}
        if is_latched:
            options = {"cache": zenoh.ext.CacheConfig(max_samples=1), "publisher_detection": True}
        key = self.key(name, STRING_TYPE, type_hash)
        made = zenoh.ext.declare_advanced_publisher(self.session, key, **options)
        self._kept.append(made)
        return PeerPublisher(made, gid)

    def subscribe(
        self, name: str, *, is_latched: bool = False, type_hash: str = STRING
    ) -> list[tuple[bytes, bytes]]:
        """Return a list to which payloads and attachments are appended."""
        received: list[tuple[bytes, bytes]] = []
        self.declare("MS", name, STRING_TYPE, type_hash, LATCHED if is_latched else VOLATILE)

        def add(sample: zenoh.Sample) -> None:
            attachment = sample.attachment
            received.append((sample.payload.to_bytes(), b"" if attachment is None else attachment.to_bytes()))

        key = self.key(name, STRING_TYPE, type_hash)
        options: dict[str, Any] = {}
        if is_latched:
            options["history"] = zenoh.ext.HistoryConfig(detect_late_publishers=True)
        self._kept.append(zenoh.ext.declare_advanced_subscriber(self.session, key, add, **options))
        return received

    def serve(self, name: str, answer: Callable[[bytes], bytes]) -> None:
        key = self.key(name, ADD_TYPE, ADD)

        def reply(query: zenoh.Query) -> None:
            with query:
                assert query.payload is not None
                assert query.attachment is not None
                query.reply(key, answer(query.payload.to_bytes()), attachment=query.attachment.to_bytes())

        self._kept.append(self.session.declare_queryable(key, reply, complete=True))
        self.declare("SS", name, ADD_TYPE, ADD)

    def call(self, name: str, request: bytes) -> list[tuple[bytes, bytes]]:
        """Call a service, and return the payload and attachment of each reply."""
        gid = self.declare("SC", name, ADD_TYPE, ADD)
        replies = self.session.get(
            self.key(name, ADD_TYPE, ADD), target=zenoh.QueryTarget.ALL_COMPLETE,
            consolidation=zenoh.ConsolidationMode.NONE, payload=request, attachment=attachment_of(7, 8, gid),
            timeout=60.0,
        )  # fmt: skip
        found = [reply.ok for reply in replies]
        return [(ok.payload.to_bytes(), ok.attachment.to_bytes()) for ok in found if ok and ok.attachment]

    def close(self) -> None:
        self.session.close()


class PeerPublisher:
    def __init__(self, publisher: Any, gid: bytes) -> None:
        self._publisher = publisher
        self._numbers = itertools.count(1)
        self.gid = gid

    def put(self, payload: bytes, *, is_attached: bool = True) -> None:
        attachment = attachment_of(next(self._numbers), 5, self.gid) if is_attached else None
        self._publisher.put(payload, attachment=attachment)


def attachment_of(sequence: int, time_ns: int, gid: bytes) -> bytes:
    return struct.pack("<qqB", sequence, time_ns, 16) + gid


def gid_of(token: str) -> bytes:
    low_first: bytes = xxhash.xxh3_128_digest(token.encode())[::-1]
    return low_first
