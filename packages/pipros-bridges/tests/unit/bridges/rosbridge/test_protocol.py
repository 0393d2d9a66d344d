"""Operations of one client as literal JSON, and their effects or answers."""

import hashlib
import json
import random
import struct
import threading
from collections.abc import Callable, Sequence
from typing import Any

import bson
import pytest

from pipros.basics.errors import InvalidName
from pipros.basics.limits import Limits
from pipros.msg import load_message_class
from pipros_bridges.limits import BridgeLimits
from pipros_bridges.outbox import ClientOutbox, text_frame
from pipros_bridges.rosbridge.authentication import Authenticator
from pipros_bridges.rosbridge.effects import (
    Advertise,
    AnswerCall,
    CallService,
    DeliveryOptions,
    Disconnect,
    LeaveTopic,
    OfferService,
    Publish,
    Reply,
    TakeTopic,
    Unadvertise,
    WithdrawService,
)
from pipros_bridges.rosbridge.encoding import Encoder, WireEncoding
from pipros_bridges.rosbridge.globs import Globs
from pipros_bridges.rosbridge.protocol import ClientProtocol
from pipros_bridges.rosbridge.settings import RosbridgeSettings
from pipros_bridges.rosbridge.streams import TopicStream
from pipros_bridges.shared_topics import TopicMessage
from pipros_bridges.shares import ClientShares, ServerShares
from tests.support.constants import Constants


def resolve(name: str) -> str:
    if " " in name:
        raise InvalidName(f"[{name}] is not a name")
    return name if name.startswith("/") else f"/{name}"


class Peer:
    """A client whose operations are written as JSON."""

    def __init__(
        self,
        settings: RosbridgeSettings | None = None,
        limits: Limits | None = None,
        shares: ClientShares | None = None,
    ) -> None:
        self.now_s = 0.0
        self.protocol = ClientProtocol(
            settings or RosbridgeSettings(), resolve, limits, lambda: self.now_s, shares
        )

    def sends(self, data: str | bytes) -> list[Any]:
        return list(self.protocol.receive(data))

    def gets(self, data: str | bytes) -> str:
        """The only answer to a frame, as JSON."""
        (reply,) = self.sends(data)
        assert isinstance(reply, Reply)
        return json.dumps(reply.operation)


def error(text: str, **more: Any) -> str:
    return json.dumps({"op": "status", "level": "error", "msg": text, **more})


EFFECTS = {
    '{"op": "subscribe", "topic": "/a"}': TakeTopic,
    '{"op": "subscribe", "topic": "/a", "id": 2}': TakeTopic,
    '{"op": "unsubscribe", "topic": "/a"}': LeaveTopic,
    '{"op": "advertise", "topic": "/b", "type": "std_msgs/String"}': Advertise,
    '{"op": "advertise", "topic": "/b", "type": "std_msgs/Int32", "id": 2}': Advertise,
    '{"op": "publish", "topic": "/b", "msg": {"data": "x"}}': Publish,
    '{"op": "unadvertise", "topic": "/b"}': Unadvertise,
    '{"op": "call_service", "service": "/s"}': CallService,
    '{"op": "advertise_service", "service": "/s", "type": "std_srvs/Empty"}': OfferService,
    '{"op": "service_response", "service": "/s", "id": "1", "values": {}, "result": true}': AnswerCall,
    '{"op": "unadvertise_service", "service": "/s"}': WithdrawService,
}


def test_each_operation_has_its_effect() -> None:
    peer = Peer()
    for text, kind in EFFECTS.items():
        assert [type(effect) for effect in peer.sends(text)] == [kind], text
    without_effects = {"set_level", "auth"}
    assert {json.loads(text)["op"] for text in EFFECTS} | without_effects == peer.protocol.operations.keys()


@pytest.mark.parametrize("number", [0, 1, 3, 4, 5, 7, 8, 9])
def test_an_operation_whose_effect_fails_changes_nothing(number: int) -> None:
    shares = ServerShares(Limits()).client()
    peer, other = Peer(shares=shares), Peer()
    texts = [*EFFECTS]
    for text in texts[:number]:
        assert peer.sends(text) == other.sends(text)
    kept = shares.kept.used
    effects = peer.protocol.receive(texts[number])
    next(effects)
    assert "no room" in repr(effects.throw(InvalidName("no room")))
    assert shares.kept.used == kept
    for text in texts[number + 1 :]:
        assert peer.sends(text) == other.sends(text)


@pytest.mark.parametrize(("text", "message"), [
    ("3", "expected a JSON object, got '3'"), ("true", "expected a JSON object, got 'true'"),
    ('"op"', "expected a JSON object, got '\"op\"'"),
    ('{"op": ["subscribe"]}', "['subscribe']: unknown operation ['subscribe']"),
    ("{}", "null: unknown operation null"), ('{"op": "x"}', "'x': unknown operation 'x'"),
    ('{"op": "send_action_goal"}',
     "'send_action_goal': unknown operation 'send_action_goal': actions are for ROS 2"),
    ('{"op": "subscribe", "topic": 3}', "subscribe: topic must be a name, got 3"),
    ('{"op": "subscribe", "topic": "a b"}', "subscribe: [a b] is not a name"),
    ('{"op": "subscribe", "topic": "/a", "throttle_rate": "1"}',
     "subscribe: throttle_rate must be a finite number, got '1'"),
    ('{"op": "subscribe", "topic": "/a", "fragment_size": -1}',
     "subscribe: fragment_size must be a finite number >= 0, got -1"),
    ('{"op": "subscribe", "topic": "/a", "queue_length": Infinity}',
     "subscribe: queue_length must be a finite number >= 0, got inf"),
    ('{"op": "subscribe", "topic": "/a", "type": 1}', "subscribe: type must be package/Name, got 1"),
    ('{"op": "advertise", "topic": "/a"}', "advertise: type must be package/Name, got null"),
    ('{"op": "advertise", "topic": "/a", "type": "a/B", "latch": 1}',
     "advertise: latch must be true or false, got 1"),
    ('{"op": "service_response", "service": "/s", "result": true}',
     "service_response: this client does not offer /s"),
    ('{"op": "set_level", "level": "loud"}',
     "set_level: level must be one of none, error, warning, info; got 'loud'"),
])  # fmt: skip
def test_a_malformed_operation_has_an_error_and_the_next_one_is_read(text: str, message: str) -> None:
    peer = Peer()
    assert peer.gets(text) == error(message)
    assert [type(effect) for effect in peer.sends('{"op": "subscribe", "topic": "/a"}')] == [TakeTopic]


def test_an_id_of_any_type_comes_back_and_null_is_left_out() -> None:
    peer = Peer()
    for identity in ("5", '[1, {"a": null}]', '"x"', "false", "0.5"):
        answer = json.loads(peer.gets(f'{{"op": "x", "id": {identity}}}'))
        assert answer["id"] == json.loads(identity)
    assert "id" not in json.loads(peer.gets('{"op": "x", "id": null}'))


def test_only_a_service_call_answers_with_result_false() -> None:
    answer = json.loads(Peer().gets('{"op": "call_service", "service": "", "id": 3}'))
    assert answer == {
        "op": "service_response", "service": "", "values": "service must be a name, got ''", "result": False,
        "id": 3,
    }  # fmt: skip


def test_status_levels_are_respected() -> None:
    peer = Peer()
    assert (peer.sends('{"op": "set_level", "level": "none"}'), peer.sends('{"op": "x"}')) == ([], [])
    assert peer.sends('{"op": "set_level", "level": "error"}') == []
    assert len(peer.sends('{"op": "x"}')) == 1


def test_subscriptions_to_a_topic_share_the_greatest_encoding_and_the_lowest_throttle_and_queue() -> None:
    peer = Peer()
    peer.sends('{"op": "subscribe", "topic": "a", "id": 1, "throttle_rate": 100.0, "queue_length": 5}')
    (second,) = peer.sends(
        '{"op": "subscribe", "topic": "a", "id": 2, "compression": "png", "throttle_rate": 50, '
        '"queue_length": 2, "fragment_size": 100}'
    )
    shared = second.delivery
    assert (shared.encoding, shared.throttle_s, shared.queue_length) == (WireEncoding.PNG, 0.05, 2)
    assert shared.fragment_size == 100
    (left,) = peer.sends('{"op": "unsubscribe", "topic": "a", "id": 2}')
    assert (left.delivery.encoding, left.delivery.throttle_s) == (WireEncoding.JSON, 0.1)
    assert peer.sends('{"op": "unsubscribe", "topic": "a", "id": 1}') == [LeaveTopic("a")]


@pytest.mark.parametrize("compression", ["none", "gzip", None, 3, ["cbor"]])
def test_unknown_compressions_mean_json(compression: object) -> None:
    operation = {"op": "subscribe", "topic": "/a", "compression": compression}
    (taken,) = Peer().sends(json.dumps(operation))
    assert taken.delivery.encoding is WireEncoding.JSON


def test_null_values_of_a_subscription_are_the_defaults() -> None:
    (taken,) = Peer().sends(
        '{"op": "subscribe", "topic": "/a", "type": null, "throttle_rate": null, "queue_length": null, '
        '"fragment_size": null}'
    )
    assert (taken.kind, taken.delivery.throttle_s, taken.delivery.fragment_size) == (None, 0.0, 0)


def test_types_as_ros_2_writes_them_are_understood() -> None:
    (taken,) = Peer().sends('{"op": "subscribe", "topic": "/a", "type": "std_msgs/msg/String"}')
    assert taken.kind == "std_msgs/String"


def test_split_and_joined_texts_are_put_together() -> None:
    text = '{"op": "subscribe", "topic": "/a", "id": "}\\"{"}{"op": "unsubscribe", "topic": "/a"}'
    for position in range(1, len(text)):
        peer = Peer()
        effects = [*peer.sends(text[:position]), *peer.sends(text[position:])]
        assert [type(effect) for effect in effects] == [TakeTopic, LeaveTopic], position


def test_json_in_binary_frames_is_accepted() -> None:
    assert [type(effect) for effect in Peer().sends(b'{"op": "subscribe", "topic": "/a"}')] == [TakeTopic]


def test_a_complete_operation_ends_a_text_that_was_not_complete() -> None:
    peer = Peer()
    assert peer.sends('{"op": "publish", "msg": {') == []
    status, taken = peer.sends('{"op": "subscribe", "topic": "/a"}')
    assert "discarded" in status.operation["msg"]
    assert isinstance(taken, TakeTopic)


def test_deep_json_and_cbor_are_refused() -> None:
    for start, end in (("[", "]"), ('{"a":', "}")):
        deep = '{"op": "publish", "topic": "/a", "msg": ' + start * 100_000 + "1" + end * 100_000 + "}"
        assert Peer().gets(deep) == error("the JSON object is nested too deeply")
    for cbor in (b"\x81" * 5000 + b"\0", b"\xa1\x61a" * 3000 + b"\0", b"\xd9\xd9\xf7" * 3000):
        assert "expected a JSON object" in Peer().gets(cbor)  # clients send CBOR in no operation


def test_deep_bson_is_refused() -> None:
    deep = b"\x05\0\0\0\0"
    for _ in range(1000):
        body = b"\x03a\0" + deep + b"\0"
        deep = struct.pack("<i", len(body) + 4) + body
    peer = Peer(RosbridgeSettings(is_bson=True))
    assert json.loads(peer.gets(deep))["level"] == "error"
    assert [type(each) for each in peer.sends(bson.encode({"op": "subscribe", "topic": "/a"}))] == [TakeTopic]


def test_an_endless_object_is_dropped() -> None:
    peer = Peer(limits=Limits(tables=(BridgeLimits(bridge_message_bytes=1000),)))
    assert peer.sends('{"a": "') == []
    answers = [effect for _ in range(3) for effect in peer.sends("x" * 600)]
    assert "a JSON object is too long; the limit is 1000" in answers[0].operation["msg"]
    assert [type(effect) for effect in peer.sends('{"op": "subscribe", "topic": "/a"}')] == [TakeTopic]


def fragments(text: str, size: int, identity: object = "x") -> list[str]:
    parts = [text[start : start + size] for start in range(0, len(text), size)]
    return [
        json.dumps({"op": "fragment", "id": identity, "data": part, "num": number, "total": len(parts)})
        for number, part in enumerate(parts)
    ]


def test_fragments_are_joined_in_any_order_even_twice() -> None:
    text = '{"op": "subscribe", "topic": "/a"}'
    for seed in range(20):
        peer = Peer()
        first, second = fragments(text, 7), fragments(text.replace("/a", "/b"), 5, identity=["other", 2])
        frames = [*first, *second]
        random.Random(seed).shuffle(frames)  # noqa: S311
        effects = [effect for frame in frames for effect in peer.sends(frame)]
        assert [type(effect) for effect in effects] == [TakeTopic, TakeTopic]


def test_endless_fragments_are_dropped() -> None:
    peer = Peer(limits=Limits(tables=(BridgeLimits(bridge_message_bytes=10_000),)))
    answers: list[Any] = []
    for number in range(1000):
        operation = {"op": "fragment", "id": number, "data": "", "num": 0, "total": 2}
        answers += peer.sends(json.dumps(operation))
    assert "the incomplete fragments are too long; the limit is 10000" in answers[0].operation["msg"]
    assert len(answers) < 50


def test_old_fragments_are_forgotten() -> None:
    peer = Peer(RosbridgeSettings(fragment_timeout_s=10))
    first, second = fragments('{"op": "x"}', 6)
    peer.sends(first)
    peer.now_s = 11
    assert peer.sends(second) == []


@pytest.mark.parametrize("fragment", [
    '"num": 2, "total": 2, "data": "x"', '"num": -1, "total": 2, "data": "x"',
    '"num": "0", "total": 2, "data": "x"', '"num": 0, "total": 2, "data": 3', '"num": 0, "data": "x"',
])  # fmt: skip
def test_malformed_fragments_are_refused(fragment: str) -> None:
    assert "'fragment': fragment: " in Peer().gets(f'{{"op": "fragment", {fragment}}}')


def test_fragments_of_fragments_are_refused() -> None:
    (inner,) = fragments('{"op": "subscribe", "topic": "/a"}', 100)
    (outer,) = fragments(inner, 1000)
    assert "unknown operation 'fragment'" in Peer().gets(outer)


@pytest.mark.parametrize(("text", "name"), [
    ('{"op": "subscribe", "topic": "secret"}', "/secret"),
    ('{"op": "publish", "topic": "/secret"}', "/secret"),
    ('{"op": "advertise", "topic": "/secret", "type": "a/B"}', "/secret"),
    ('{"op": "call_service", "service": "/secret"}', "/secret"),
    ('{"op": "advertise_service", "service": "/secret", "type": "a/B"}', "/secret"),
])  # fmt: skip
def test_globs_are_access_control(text: str, name: str) -> None:
    globs = Globs.parse("[/open/*, '/also']")
    answer = json.loads(Peer(RosbridgeSettings(topics=globs, services=globs)).gets(text))
    assert f"clients may not use {name}; they may use /open/*, /also" in str(answer)


def test_globs_allow_what_matches_and_everything_without_patterns() -> None:
    assert Globs.parse("[/open/*]").allow("/open/a/b")
    assert not Globs.parse("[/open/*]").allow("/a/open/b")
    assert Globs.parse("[*]").allow("/x")
    assert Globs.parse("").allow("/x")
    assert Globs.parse(["/a"]).allow("/a")


def test_the_names_of_a_client_are_limited(constants: Constants) -> None:
    constants(BRIDGE_SUBSCRIPTIONS=2)
    peer = Peer(limits=Limits())
    answers = [peer.sends(f'{{"op": "subscribe", "topic": "/t{number}"}}') for number in range(3)]
    assert [type(effects[0]) for effects in answers] == [TakeTopic, TakeTopic, Reply]
    ids = [peer.sends(f'{{"op": "subscribe", "topic": "/t0", "id": {number}}}') for number in range(3)]
    assert isinstance(ids[2][0], Reply)


def test_binary_frames_are_bson_in_bson_mode() -> None:
    peer = Peer(RosbridgeSettings(is_bson=True))
    (taken,) = peer.sends(bson.encode({"op": "subscribe", "topic": "/a"}))
    assert isinstance(taken, TakeTopic)
    assert "not BSON" in peer.gets(b"\1\2\3")


def test_operations_on_unknown_names_have_no_effect_or_an_error() -> None:
    peer = Peer()
    assert peer.sends('{"op": "unsubscribe", "topic": "/a"}') == []
    assert peer.sends('{"op": "unadvertise", "topic": "/a"}') == []
    assert "does not offer /s" in peer.gets('{"op": "unadvertise_service", "service": "/s"}')


def test_a_second_subscription_of_another_type_is_refused() -> None:
    peer = Peer()
    peer.sends('{"op": "subscribe", "topic": "/a", "type": "std_msgs/String"}')
    answer = peer.gets('{"op": "subscribe", "topic": "/a", "type": "std_msgs/Int32", "id": 1}')
    assert "this client subscribes to /a with the type std_msgs/String, not std_msgs/Int32" in answer


def test_a_topic_is_advertised_until_its_last_advertisement_is_withdrawn() -> None:
    peer = Peer()
    for identity in (1, 2):
        peer.sends(f'{{"op": "advertise", "topic": "/a", "type": "std_msgs/String", "id": {identity}}}')
    assert peer.sends('{"op": "unadvertise", "topic": "/a", "id": 1}') == []
    assert peer.sends('{"op": "unadvertise", "topic": "/a", "id": 2}') == [Unadvertise("/a")]


def test_a_read_only_server_answers_questions_only() -> None:
    peer = Peer(RosbridgeSettings(has_control=False))
    assert [type(each) for each in peer.sends('{"op": "subscribe", "topic": "/a"}')] == [TakeTopic]
    assert [type(each) for each in peer.sends('{"op": "call_service", "service": "/rosapi/topics"}')] == [
        CallService
    ]
    for text in (
        '{"op": "publish", "topic": "/a"}',
        '{"op": "advertise", "topic": "/a", "type": "a/B"}',
        '{"op": "advertise_service", "service": "/a", "type": "a/B"}',
        '{"op": "call_service", "service": "/rosapi/set_param"}',
        '{"op": "call_service", "service": "/a"}',
    ):
        assert "this server is read-only" in peer.gets(text)


SECRET = "0123456789abcdef"  # noqa: S105 # of these tests


def claims(secret: str = SECRET) -> dict[str, Any]:
    values = {"client": "1.2.3.4", "dest": "5.6.7.8", "rand": "r", "t": 1000, "level": "user", "end": 2000}
    text = secret + "".join(map(str, values.values()))
    return {"op": "auth", "mac": hashlib.sha512(text.encode()).hexdigest(), **values}


def test_a_client_that_knows_the_secret_may_go_on_and_no_other() -> None:
    def attempts(operations: Sequence[dict[str, Any]], authenticator: Authenticator) -> list[type]:
        peer = Peer(RosbridgeSettings(authenticator=authenticator))
        return [type(each) for operation in operations for each in peer.sends(json.dumps(operation))]

    authenticator = Authenticator(SECRET, lambda: 1001.0)
    subscribe = {"op": "subscribe", "topic": "/a"}
    assert attempts([claims(), subscribe], authenticator) == [TakeTopic]
    assert attempts([claims(), subscribe], authenticator)[0] is Disconnect  # the same (rand, t) again
    assert attempts([subscribe], authenticator) == [Disconnect]
    for wrong in (claims(secret="x" * 16), {"op": "auth"}):
        assert attempts([wrong], authenticator) == [Disconnect], wrong


@pytest.mark.parametrize("message", [None, 5, "text", True])
def test_messages_other_than_objects_are_not_published(message: Any) -> None:
    [reply] = Peer().sends(json.dumps({"op": "publish", "topic": "/cmd_vel", "msg": message}))
    assert isinstance(reply, Reply)
    assert "msg must be an object" in reply.operation["msg"]


def test_old_conventions_of_clients_are_accepted() -> None:
    peer = Peer()
    [call] = peer.sends('{"op": "call_service", "service": "/add#33"}')
    assert (call.service, call.operation["service"]) == ("/add", "/add#33")
    [take] = peer.sends(
        '{"op": "subscribe", "topic": "/a", "type": "/std_msgs//String", "throttle_rate": -1}'
    )
    assert (take.kind, take.delivery.throttle_s) == ("std_msgs/String", 0)


def test_a_message_with_too_many_values_is_refused_before_it_is_parsed(constants: Constants) -> None:
    constants(BRIDGE_PARSED_BYTES=1_000_000)
    peer = Peer(limits=Limits())
    reason = "a message with so many values needs too much memory; the limit is 1000000"
    for values in ("[" + "{}," * 20_000 + "1]", "[" + "[]," * 20_000 + "1]", "[" + "1," * 40_000 + "1]"):
        text = f'{{"op": "publish", "topic": "/a", "msg": {{"data": {values}}}}}'
        for data in (text, text.encode(), fragments(text, len(text))[0]):
            assert reason in peer.gets(data)
        (reply,) = peer.protocol.receive_stream(text)
        assert isinstance(reply, Reply)
        assert reason in reply.operation["msg"]
    text = json.dumps({"op": "publish", "topic": "/a", "msg": {"data": "x" * 400_000}})
    assert [type(effect) for effect in peer.sends(text)] == [Publish]


def test_the_memory_of_a_message_is_returned_once_it_is_handled() -> None:
    peer = Peer()
    peer.sends(json.dumps({"op": "publish", "topic": "/a", "msg": {"data": "x" * 10_000}}))
    assert peer.protocol.parsed_bytes > 10_000
    peer.protocol.end_message()
    assert peer.protocol.parsed_bytes == 0


def test_the_memory_of_an_incomplete_object_is_known() -> None:
    peer = Peer()
    peer.sends('{"op": "publish", "msg": {"a": {}, "data": "' + "x" * 5000)
    assert 5000 <= peer.protocol.incomplete_bytes <= 6000
    effects = peer.sends('"}, "topic": "/a"}')
    assert [type(effect) for effect in effects] == [Publish]
    assert peer.protocol.incomplete_bytes == 0


def test_a_client_that_exceeds_its_share_again_is_disconnected(constants: Constants) -> None:
    constants(BRIDGE_KEPT_BYTES=3000)
    peer = Peer(limits=Limits())
    answers = [peer.sends(f'{{"op": "subscribe", "topic": "/t{number}"}}')[0] for number in range(4)]
    assert [type(answer) for answer in answers] == [TakeTopic, TakeTopic, Reply, Disconnect]
    assert "makes the server keep too much; the limit is 3000" in answers[2].operation["msg"]


def test_a_repeated_subscription_has_no_effect_and_a_changed_one_replaces_it() -> None:
    peer = Peer()
    peer.sends('{"op": "subscribe", "topic": "/a", "id": 1, "queue_length": 1}')
    assert peer.sends('{"op": "subscribe", "topic": "/a", "id": 1, "queue_length": 1}') == []
    (changed,) = peer.sends('{"op": "subscribe", "topic": "/a", "id": 1, "queue_length": 5}')
    assert changed.delivery.queue_length == 5

    assert peer.sends('{"op": "unsubscribe", "topic": "/a", "id": 2}') == []
    assert peer.sends('{"op": "unsubscribe", "topic": "/a", "id": 1}') == [LeaveTopic("/a")]


def test_repeated_offers_count_once(constants: Constants) -> None:
    constants(BRIDGE_SUBSCRIPTIONS=1)
    peer = Peer(limits=Limits())
    for text in (
        '{"op": "advertise", "topic": "/a", "type": "a/B"}',
        '{"op": "advertise_service", "service": "/s", "type": "a/B"}',
    ):
        first, second = peer.sends(text)[0], peer.sends(text)[0]
        assert type(first) is type(second) is not Reply
    assert peer.sends('{"op": "unadvertise", "topic": "/a"}') == [Unadvertise("/a")]


def test_a_topic_that_was_only_published_counts_and_can_be_withdrawn(constants: Constants) -> None:
    constants(BRIDGE_SUBSCRIPTIONS=1)
    peer = Peer(limits=Limits())
    for _ in range(2):
        assert [type(effect) for effect in peer.sends('{"op": "publish", "topic": "/a"}')] == [Publish]
    assert "too many advertised topics; the limit is 1" in peer.gets('{"op": "publish", "topic": "/b"}')

    assert peer.sends('{"op": "unadvertise", "topic": "/a"}') == [Unadvertise("/a")]
    assert [type(effect) for effect in peer.sends('{"op": "publish", "topic": "/b"}')] == [Publish]


def test_auth_has_no_effect_without_authentication() -> None:
    peer = Peer()
    assert peer.sends(json.dumps(claims())) == []
    assert [type(effect) for effect in peer.sends('{"op": "subscribe", "topic": "/a"}')] == [TakeTopic]


@pytest.mark.parametrize("op", ["subscribe", "advertise", "unsubscribe", "unadvertise"])
def test_long_ids_are_refused(op: str) -> None:
    peer, more = Peer(), {"topic": "/a", "type": "std_msgs/String"}
    peer.sends(json.dumps({"op": op.removeprefix("un"), **more}))
    answer = peer.gets(json.dumps({"op": op, "id": "x" * 999, **more}))
    assert "id must have at most 1000 characters, got 1001" in answer
    answer = peer.gets(json.dumps({"op": "fragment", "data": "", "num": 0, "total": 2, "id": "x" * 999}))
    assert "fragment: id must have at most 1000 characters" in answer


def test_fragments_that_disagree_on_their_number_are_dropped() -> None:
    peer = Peer()
    peer.sends('{"op": "fragment", "id": 1, "data": "{\\"op\\"", "num": 0, "total": 2}')
    answer = peer.gets('{"op": "fragment", "id": 1, "data": ": 1}", "num": 1, "total": 3}')
    assert "total differs from that of earlier fragments" in answer
    assert peer.sends('{"op": "fragment", "id": 1, "data": ": 1}", "num": 1, "total": 2}') == []


def test_fragments_that_exceed_the_memory_of_the_client_are_dropped() -> None:
    shares = ServerShares(Limits()).client()
    peer = Peer(shares=shares)
    first, second, third = fragments('{"op": "subscribe", "topic": "/a"}', 12)
    peer.sends(first)
    held = shares.input.used
    others = shares.input.left
    shares.input.take(others)

    assert "incomplete messages exceed the memory for this client" in peer.gets(second)
    assert shares.input.used == others
    assert held > 0

    shares.input.give_back(others)
    effects = [effect for frame in (third, first, second) for effect in peer.sends(frame)]
    assert [type(effect) for effect in effects] == [TakeTopic]


# The messages of one topic for one client, without a node.


STRING: Any = load_message_class("std_msgs/String")


class Eager:
    """Topics whose first messages arrive in another thread while `take` is still running."""

    def __init__(self, count: int) -> None:
        self._count = count
        self._threads: list[threading.Thread] = []

    def take(self, topic: str, kind: str | None, on_message: Callable[[Any], object], *_: Any) -> Any:
        def deliver() -> None:
            for _ in range(self._count):
                on_message(TopicMessage(topic, b"\1\0\0\0x", header, 0))

        header = {"type": STRING._type, "md5sum": STRING._md5sum}
        self._threads.append(threading.Thread(target=deliver))
        self._threads[-1].start()
        self._threads[-1].join(0.5)  # they may all arrive, or wait for `take`
        return object()

    def wait(self) -> None:
        for thread in self._threads:
            thread.join()


def test_a_closed_stream_does_not_begin_again() -> None:
    topics: Any = Eager(1)
    outbox = ClientOutbox(1000, lambda: None)
    stream = TopicStream("/x", topics, Encoder(), outbox, print, lambda *_: None)
    stream.close()
    stream.take(None, DeliveryOptions())
    topics.wait()
    assert outbox.pop() is None


def test_messages_that_arrive_at_once_are_throttled_too() -> None:
    topics: Any = Eager(3)
    outbox = ClientOutbox(1000, lambda: None)
    stream = TopicStream("/x", topics, Encoder(), outbox, print, lambda *_: None)
    stream.take(None, DeliveryOptions(throttle_s=100.0))
    topics.wait()
    assert outbox.pop() is not None
    assert outbox.pop() is None


class Manual:
    """Topics whose messages the test delivers, and timers that it runs."""

    def __init__(self) -> None:
        self.on_message: Callable[[Any], object] = print
        self.timers: list[Callable[[], object]] = []

    def take(self, topic: str, kind: str | None, on_message: Callable[[Any], object], *_: Any) -> Any:
        self.on_message = on_message
        return Manual()

    def call_later(self, _: float, function: Callable[[], object]) -> None:
        self.timers.append(function)

    def close(self) -> None:
        pass

    topic = "/x"


def text_of(number: int, size: int) -> TopicMessage:
    header = {"type": STRING._type, "md5sum": STRING._md5sum}
    body = b"".join(STRING(f"{number:04}".ljust(size - 4))._to_buffers())
    return TopicMessage("/x", body, header, 0)


def sent(outbox: ClientOutbox) -> list[str]:
    """Pop all messages, and return the first words of their texts."""
    found = []
    while (frames := outbox.pop()) is not None:
        found.append(json.loads(frames[0].parts[0])["msg"]["data"][:4])
    return found


def test_throttled_messages_count_as_part_of_the_queue() -> None:
    topics: Any = Manual()
    outbox = ClientOutbox(20_000, lambda: None)
    stream = TopicStream("/x", topics, Encoder(), outbox, print, topics.call_later)
    stream.take(None, DeliveryOptions(throttle_s=1e6, queue_length=10**9))
    for number in range(100):
        topics.on_message(text_of(number, 1000))
    assert sent(outbox) == ["0000"]
    assert 5000 < outbox.waiting_bytes <= 10_000
    outbox.answer(text_frame("y" * 9000))
    assert not outbox.is_overrun
    outbox.pop()
    while topics.timers:
        topics.timers.pop()()
    assert sent(outbox) == [f"{number:04}" for number in range(94, 100)]
    assert outbox.waiting_bytes == 0

    topics.on_message(text_of(1, 50_000))  # too large: the newest one is kept in any case
    topics.on_message(text_of(2, 50_000))
    topics.timers.pop()()
    assert sent(outbox) == ["0002"]

    topics.on_message(text_of(3, 1000))
    assert outbox.waiting_bytes
    stream.close()
    assert outbox.waiting_bytes == 0
