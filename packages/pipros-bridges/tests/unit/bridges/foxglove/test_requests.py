"""Messages of Foxglove clients, literally."""

import json
from typing import Any, get_args

import pytest

from pipros_bridges.foxglove import frames
from pipros_bridges.foxglove.catalog import Channel, Service
from pipros_bridges.foxglove.frames import StatusLevel
from pipros_bridges.foxglove.handler import CAPABILITIES
from pipros_bridges.foxglove.requests import (
    CAPABILITY_OF,
    READERS,
    REQUEST_CHARACTERS,
    AdvertiseRequest,
    CallRequest,
    ClientChannel,
    ClientRequest,
    FetchAsset,
    GetParameters,
    MalformedRequest,
    PublishRequest,
    SetParameters,
    Subscribe,
    SubscribeGraph,
    SubscribeParameters,
    UnadvertiseRequest,
    Unsubscribe,
    UnsubscribeParameters,
    read_request,
)
from pipros_bridges.foxglove.sent_assets import Asset
from pipros_bridges.outbox import WebSocketFrame
from pipros_tools.graph.definitions import Definition, ServiceDefinition

CASES: list[tuple[str | bytes, ClientRequest]] = [
    (
        '{"op": "subscribe", "subscriptions": [{"id": 0, "channelId": 3}, {"id": 1, "channelId": 5}]}',
        Subscribe([(0, 3), (1, 5)]),
    ),
    ('{"op": "unsubscribe", "subscriptionIds": [0, 4294967295]}', Unsubscribe([0, 4294967295])),
    (
        '{"op": "advertise", "channels": [{"id": 2, "topic": "/tf", "encoding": "ros1", '
        '"schemaName": "tf2_msgs/TFMessage"}]}',
        AdvertiseRequest([ClientChannel(2, "/tf", "ros1", "tf2_msgs/TFMessage", "")]),
    ),
    (
        '{"op": "advertise", "channels": [{"id": 2, "topic": "a", "encoding": "json", '
        '"schemaName": "p/T", "schema": "int8 x", "schemaEncoding": "ros1msg"}]}',
        AdvertiseRequest([ClientChannel(2, "a", "json", "p/T", "int8 x")]),
    ),
    ('{"op": "unadvertise", "channelIds": [2]}', UnadvertiseRequest([2])),
    ('{"op": "getParameters", "parameterNames": ["/a"], "id": "1"}', GetParameters(["/a"], "1")),
    ('{"op": "getParameters"}', GetParameters([], None)),
    (
        '{"op": "setParameters", "id": "x", "parameters": [{"name": "/a", "value": 1.5}, {"name": "/b"}]}',
        SetParameters([{"name": "/a", "value": 1.5}, {"name": "/b"}], "x"),
    ),
    ('{"op": "subscribeParameterUpdates", "parameterNames": []}', SubscribeParameters([])),
    ('{"op": "unsubscribeParameterUpdates", "parameterNames": ["/a"]}', UnsubscribeParameters(["/a"])),
    ('{"op": "subscribeConnectionGraph"}', SubscribeGraph(True)),
    ('{"op": "unsubscribeConnectionGraph"}', SubscribeGraph(False)),
    ('{"op": "fetchAsset", "uri": "package://a/b.stl", "requestId": 7}', FetchAsset("package://a/b.stl", 7)),
    (b"\x01\x02\x00\x00\x00body", PublishRequest(2, b"body")),
    (b"\x01\xff\xff\xff\xff", PublishRequest(4294967295, b"")),
    (b"\x02\x01\x00\x00\x00\x02\x00\x00\x00\x04\x00\x00\x00ros1body", CallRequest(1, 2, "ros1", b"body")),
]


@pytest.mark.parametrize(("data", "request_read"), CASES)
def test_each_operation_is_read(data: str | bytes, request_read: ClientRequest) -> None:
    assert read_request(data) == request_read


def test_each_operation_has_a_case_here_and_a_capability() -> None:
    texts = [data for data, _ in CASES if isinstance(data, str)]
    assert {json.loads(text)["op"] for text in texts} == READERS.keys()
    assert {type(request) for _, request in CASES} == set(get_args(ClientRequest)) == CAPABILITY_OF.keys()
    assert set(CAPABILITY_OF.values()) == {None, *CAPABILITIES}


@pytest.mark.parametrize(("data", "reason"), [
    ("", "not JSON"), ("{", "not JSON"), ("[" * 100_000, "not JSON"),
    ('{"op": ' + "9" * 10_000 + "}", "not JSON"), ("x" * (REQUEST_CHARACTERS + 1), "at most"),
    ("1", "must be a JSON object, got int"), ("{}", "unknown operation None"),
    ('{"op": ["subscribe"]}', "unknown operation"), ('{"op": "fly"}', "unknown operation 'fly'"),
    ('{"op": "subscribe"}', "subscriptions must be a list, got NoneType"),
    ('{"op": "subscribe", "subscriptions": [1]}', "subscriptions must contain objects, got int"),
    ('{"op": "subscribe", "subscriptions": [{"id": 1}]}', "channelId must be a 32-bit unsigned integer"),
    ('{"op": "unsubscribe", "subscriptionIds": [-1]}', "32-bit unsigned integer, got -1"),
    ('{"op": "unsubscribe", "subscriptionIds": [4294967296]}', "32-bit unsigned integer"),
    ('{"op": "unsubscribe", "subscriptionIds": [true]}', "32-bit unsigned integer"),
    ('{"op": "unsubscribe", "subscriptionIds": [1.0]}', "32-bit unsigned integer"),
    (
        '{"op": "advertise", "channels": [{"id": 1, "topic": null}]}',
        "topic must be a string, got NoneType",
    ),
    ('{"op": "getParameters", "parameterNames": [1]}', "parameterNames must contain strings"),
    ('{"op": "setParameters", "parameters": [{"value": 1}]}', "name must be a string"),
    ('{"op": "getParameters", "id": 5}', "id must be a string, got int"), (b"", "unknown binary opcode None"),
    (b"\x03abcd", "unknown binary opcode 3"), (b"\x01\x00\x00\x00", "opcode 1 is too short"),
    (b"\x02\x00\x00\x00\x00\x00\x00\x00\x00\x00\x00\x00", "opcode 2 is too short"),
    (b"\x02\x00\x00\x00\x00\x00\x00\x00\x00\xff\xff\xff\xffros1", "exceeds the message"),
])  # fmt: skip
def test_malformed_messages_are_refused_with_the_field(data: str | bytes, reason: str) -> None:
    with pytest.raises(MalformedRequest, match=reason):
        read_request(data)


# Messages to Foxglove clients, literally.


def read(frame: WebSocketFrame) -> Any:
    assert frame.is_text
    return json.loads(b"".join(frame.parts))


def binary(frame: WebSocketFrame) -> bytes:
    assert not frame.is_text
    return b"".join(frame.parts)


def test_the_server_introduces_itself() -> None:
    assert read(frames.server_info("name", ["time"], ["ros1"], {"ROS_DISTRO": "noetic"}, "17")) == {
        "op": "serverInfo", "name": "name", "capabilities": ["time"], "supportedEncodings": ["ros1"],
        "metadata": {"ROS_DISTRO": "noetic"}, "sessionId": "17",
    }  # fmt: skip


def test_channels_have_their_definition() -> None:
    channel = Channel(3, "/chatter", Definition("std_msgs/String", "0" * 32, "string data\n"))
    assert read(frames.advertise([channel])) == {
        "op": "advertise",
        "channels": [
            {
                "id": 3, "topic": "/chatter", "encoding": "ros1", "schemaName": "std_msgs/String",
                "schema": "string data\n", "schemaEncoding": "ros1msg",
            }
        ],
    }  # fmt: skip
    assert read(frames.unadvertise([3])) == {"op": "unadvertise", "channelIds": [3]}


def test_services_have_schemas_for_new_and_old_clients() -> None:
    definition = ServiceDefinition("std_srvs/Trigger", "0" * 32, "", "bool success\n")
    [service] = read(frames.advertise_services([Service(4, "/go", definition)]))["services"]
    assert service["response"] == {
        "encoding": "ros1", "schemaName": "std_srvs/TriggerResponse", "schemaEncoding": "ros1msg",
        "schema": "bool success\n",
    }  # fmt: skip
    assert (service["requestSchema"], service["responseSchema"]) == ("", "bool success\n")
    assert read(frames.unadvertise_services([4])) == {"op": "unadvertiseServices", "serviceIds": [4]}


def test_binary_messages_are_little_endian() -> None:
    body = b"\xab\xcd"
    assert binary(frames.message_data(2, 2**40, body)) == (
        b"\x01\x02\x00\x00\x00\x00\x00\x00\x00\x00\x01\x00\x00\xab\xcd"
    )
    assert binary(frames.time(256)) == b"\x02\x00\x01\x00\x00\x00\x00\x00\x00"
    assert binary(frames.service_response(1, 2, "ros1", body)) == (
        b"\x03\x01\x00\x00\x00\x02\x00\x00\x00\x04\x00\x00\x00ros1\xab\xcd"
    )
    assert binary(frames.asset(7, Asset(body))) == b"\x04\x07\x00\x00\x00\x00\x00\x00\x00\x00\xab\xcd"
    assert binary(frames.asset_failure(7, "né")) == b"\x04\x07\x00\x00\x00\x01\x03\x00\x00\x00n\xc3\xa9"


def test_a_message_shares_its_body() -> None:
    body = b"x" * 1000
    assert frames.message_data(1, 1, body).parts[1] is body


def test_other_messages() -> None:
    assert read(frames.status(StatusLevel.ERROR, "no")) == {"op": "status", "level": 2, "message": "no"}
    assert read(frames.service_failure(1, 2, "no")) == {
        "op": "serviceCallFailure", "serviceId": 1, "callId": 2, "message": "no",
    }  # fmt: skip
    assert read(frames.parameter_values([{"name": "/a", "value": float("nan")}])) == {
        "op": "parameterValues",
        "parameters": [{"name": "/a", "value": None}],
    }
    assert read(frames.parameter_values([], "x"))["id"] == "x"
