"""Messages to Foxglove clients, literally."""

from __future__ import annotations

import json
from typing import Any

from pipros_bridges.foxglove import frames
from pipros_bridges.foxglove.catalog import Channel, Service
from pipros_bridges.foxglove.frames import StatusLevel
from pipros_bridges.foxglove.sent_assets import Asset
from pipros_bridges.outbox import WebSocketFrame
from pipros_tools.graph.definitions import Definition, ServiceDefinition


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
        "encoding": "ros1",
        "schemaName": "std_srvs/TriggerResponse",
        "schemaEncoding": "ros1msg",
        "schema": "bool success\n",
    }
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
