"""Endpoints for rmw_zenoh, without Zenoh."""

import random
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import pytest
import xxhash

from pipros_ros2.interface import Endpoint, EndpointKind, Sample, TopicQos
from pipros_ros2.zenoh.endpoints import ZenohSubscriber
from pipros_ros2.zenoh.tokens import (
    Arrivals,
    Attachment,
    NodeIdentity,
    endpoint_token,
    gid_of_hash,
    graph_key,
    new_attachment,
    node_token,
    parse_attachment,
    parse_token,
)
from pipros_rosbag2.names import zenoh_key


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


# Tokens, keys and attachments of rmw_zenoh against those in its design document.


STRING = "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18"
ADD_TWO_INTS = "RIHS01_e118de6bf5eeb66a2491b5bda11202e7b68f198d6f67922cf30364858239c81a"
SESSION = "8b20917502ee955ac4476e0266340d5c"
TALKER = f"@ros2_lv/2/{SESSION}/0/10/MP/%/%/talker/%chatter/std_msgs::msg::dds_::String_/{STRING}/::,7:,:,:,,"
NODE = NodeIdentity(2, SESSION, "", "talker")


def test_tokens_equal_the_published_ones() -> None:
    qos = TopicQos(depth=7)
    token = endpoint_token(NODE, 10, EndpointKind.PUBLISHER, "/chatter", "std_msgs/msg/String", STRING, qos)

    assert (token, node_token(NODE)) == (TALKER, f"@ros2_lv/2/{SESSION}/0/0/NN/%/%/talker")
    assert graph_key(2) == "@ros2_lv/2/**"
    assert gid_of_hash(xxhash.xxh3_128_intdigest(token.encode())).hex() == "ac170f31eadcd9ff0cd86d7a17907d1c"


def test_keys_of_services_equal_the_published_ones() -> None:
    assert zenoh_key(2, "/add_two_ints", "example_interfaces/srv/AddTwoInts", ADD_TWO_INTS) == (
        f"2/add_two_ints/example_interfaces::srv::dds_::AddTwoInts_/{ADD_TWO_INTS}"
    )


def test_tokens_are_parsed() -> None:
    parsed = parse_token(TALKER)

    assert parsed == (
        SESSION,
        Endpoint(TALKER.encode(), EndpointKind.PUBLISHER, "/chatter", "std_msgs/msg/String", STRING,
            TopicQos(depth=7), "/talker", process=SESSION),
    )  # fmt: skip
    assert parse_token(TALKER + "/buffers:cpu") is not None  # Lyrical appends parts


def test_names_and_namespaces_are_mangled() -> None:
    node = NodeIdentity(0, "1f", "/robot/left", "driver")
    name, kind = "/robot/left/scan", "sensor_msgs/msg/LaserScan"
    token = endpoint_token(node, 3, EndpointKind.SUBSCRIBER, name, kind, "", TopicQos())

    assert "/MS/%/%robot%left/driver/%robot%left%scan/" in token
    assert "/TypeHashNotSupported/" in token
    parsed = parse_token(token)
    assert parsed is not None
    assert (parsed[1].node, parsed[1].name, parsed[1].type_hash) == ("/robot/left/driver", name, "")


def test_attachments_have_33_bytes() -> None:
    attachment = Attachment(1, 2, bytes(range(16)))

    data = attachment.to_bytes()

    assert data.hex() == "0100000000000000" + "0200000000000000" + "10" + bytes(range(16)).hex()
    assert parse_attachment(data) == attachment
    assert parse_attachment(data[:-1]) is None
    assert parse_attachment(data.replace(b"\x10\0", b"\x11\0")) is None


def test_gaps_in_the_sequences_of_a_publisher_are_counted() -> None:
    arrivals = Arrivals()

    received = ((b"a", 5), (b"b", 1), (b"a", 6), (b"a", 9), (b"b", 2), (b"a", 7), (b"a", 10))
    firsts = [arrivals.add(*each) for each in received]

    assert (arrivals.missing, firsts) == (2, [True, True, False, False, False, False, False])


def test_arrivals_of_many_publishers_take_little_memory() -> None:
    arrivals = Arrivals()

    for number in range(1500):
        arrivals.add(number.to_bytes(2, "little"), 1)
    arrivals.add(bytes(2), 100)  # forgotten, so that it is a first message
    arrivals.add((1499).to_bytes(2, "little"), 3)

    assert arrivals.missing == 1


@pytest.mark.parametrize(
    "token", ["", "a/b", TALKER.replace("MP", "NN"), TALKER.replace("std_msgs::msg", "x")]
)
def test_other_tokens_are_ignored(token: str) -> None:
    assert parse_token(token) is None


def test_no_token_raises() -> None:
    rng = random.Random(1)  # noqa: S311 # a test
    for _ in range(2000):
        text = list(TALKER)
        for _ in range(rng.randint(1, 8)):
            text[rng.randrange(len(text))] = rng.choice("/%:,@é\0 2")
        parse_token("".join(text))
