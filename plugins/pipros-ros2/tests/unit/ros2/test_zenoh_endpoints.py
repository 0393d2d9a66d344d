"""Endpoints for rmw_zenoh, without Zenoh."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

from pipros_ros2.interface import Sample, TopicQos
from pipros_ros2.zenoh.endpoints import ZenohSubscriber
from pipros_ros2.zenoh.tokens import new_attachment


class Closed(Exception):
    """Replaces zenoh.ZError."""


class Connection:
    """A connection whose subscriber has received samples of publishers, whose tokens may never arrive."""

    def __init__(self, gids: list[bytes], log: list[str]) -> None:
        kinds = SimpleNamespace(PUT="put")
        self.library = SimpleNamespace(
            ZError=Closed, SampleKind=kinds, ext=None, handlers=SimpleNamespace(RingChannel=lambda _: None)
        )
        samples = [
            SimpleNamespace(
                kind="put", attachment=Data(new_attachment(number, gid).to_bytes()), payload=Data(gid)
            )
            for number, gid in enumerate(gids, 1)
        ]
        self.session = SimpleNamespace(
            declare_subscriber=lambda *_: SimpleNamespace(handler=Handler(samples), undeclare=lambda: None)
        )
        self._log = log

    def new_endpoint(self, *_: object) -> tuple[str, bytes, str]:
        return "key", bytes(16), "token"

    def declare(self, _: str) -> Any:
        return SimpleNamespace(undeclare=lambda: None)

    def start(self, _: str, run: Callable[[], None]) -> None:
        run()

    def count(self, *_: object) -> int:
        return 0

    def wait_for_endpoint(self, gid: bytes, _: float) -> bool:
        self._log.append(f"wait {gid[:1].decode()}")
        return gid.startswith(b"k")


class Handler:
    """The channel of a subscriber that is closed after some samples."""

    def __init__(self, samples: list[Any]) -> None:
        self._samples = iter(samples)

    def recv(self) -> Any:
        try:
            return next(self._samples)
        except StopIteration:
            raise Closed from None


class Data:
    """Bytes as eclipse-zenoh returns them."""

    def __init__(self, data: bytes) -> None:
        self._data = data

    def to_bytes(self) -> bytes:
        return self._data


def test_first_messages_wait_for_the_tokens_of_their_publishers() -> None:
    log: list[str] = []
    gids = [letter * 16 for letter in (b"k", b"k", b"u", b"v", b"k")]

    def receive(sample: Sample) -> None:
        log.append(bytes(sample.publisher[:1]).decode())

    ZenohSubscriber(Connection(gids, log), "/a", "std_msgs/msg/String", "", TopicQos(), receive)

    assert log == ["wait k", "k", "k", "wait u", "u", "v", "k"]  # no wait soon after one in vain
