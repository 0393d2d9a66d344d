"""Encode the server's messages to Foxglove clients as frames. Performs no I/O.

Source: https://github.com/foxglove/ws-protocol/blob/main/docs/spec.md. Binary integers are little-endian.
"""

from __future__ import annotations

import struct
from collections.abc import Iterable, Mapping, Sequence
from enum import IntEnum
from typing import Any

from pipros_bridges.foxglove.catalog import Channel, Service
from pipros_bridges.foxglove.sent_assets import Asset
from pipros_bridges.outbox import WebSocketFrame, text_frame
from pipros_server.json_text import encoded

_MESSAGE = struct.Struct("<BIQ")
_TIME = struct.Struct("<BQ")
_RESPONSE = struct.Struct("<BIII")
_ASSET = struct.Struct("<BIBI")
_MESSAGE_DATA, _TIME_DATA, _SERVICE_RESPONSE, _ASSET_RESPONSE = 1, 2, 3, 4
_ASSET_FOUND, _ASSET_FAILED = 0, 1


class StatusLevel(IntEnum):
    """Severity of a status message."""

    INFO = 0
    WARNING = 1
    ERROR = 2


def _op(op: str, **fields: Any) -> WebSocketFrame:
    return text_frame(encoded({"op": op, **fields}))


def server_info(
    name: str,
    capabilities: Sequence[str],
    encodings: Sequence[str],
    metadata: Mapping[str, str],
    session: str,
) -> WebSocketFrame:
    """Return the first message to a client, with the `encodings` for publishing and service calls."""
    return _op(
        "serverInfo",
        name=name,
        capabilities=capabilities,
        supportedEncodings=encodings,
        metadata=metadata,
        sessionId=session,
    )


def status(level: StatusLevel, text: str) -> WebSocketFrame:
    return _op("status", level=int(level), message=text)


def advertise(channels: Iterable[Channel]) -> WebSocketFrame:
    rows = [
        {
            "id": channel.id,
            "topic": channel.topic,
            "encoding": "ros1",
            "schemaName": channel.definition.type,
            "schema": channel.definition.text,
            "schemaEncoding": "ros1msg",
        }
        for channel in channels
    ]
    return _op("advertise", channels=rows)


def unadvertise(ids: Iterable[int]) -> WebSocketFrame:
    return _op("unadvertise", channelIds=list(ids))


def message_data(subscription: int, time_ns: int, body: bytes) -> WebSocketFrame:
    return WebSocketFrame((_MESSAGE.pack(_MESSAGE_DATA, subscription, time_ns), body))


def time(time_ns: int) -> WebSocketFrame:
    return WebSocketFrame((_TIME.pack(_TIME_DATA, time_ns),))


def advertise_services(services: Iterable[Service]) -> WebSocketFrame:
    """Return a message that advertises services, with schemas in the formats for new and for old clients."""
    rows = [
        {
            "id": service.id,
            "name": service.name,
            "type": service.definition.type,
            "request": _schema(f"{service.definition.type}Request", service.definition.request_text),
            "response": _schema(f"{service.definition.type}Response", service.definition.response_text),
            "requestSchema": service.definition.request_text,
            "responseSchema": service.definition.response_text,
        }
        for service in services
    ]
    return _op("advertiseServices", services=rows)


def _schema(name: str, text: str) -> Mapping[str, str]:
    return {"encoding": "ros1", "schemaName": name, "schemaEncoding": "ros1msg", "schema": text}


def unadvertise_services(ids: Iterable[int]) -> WebSocketFrame:
    return _op("unadvertiseServices", serviceIds=list(ids))


def service_response(service: int, call: int, encoding: str, body: bytes) -> WebSocketFrame:
    name = encoding.encode()
    return WebSocketFrame((_RESPONSE.pack(_SERVICE_RESPONSE, service, call, len(name)) + name, body))


def service_failure(service: int, call: int, text: str) -> WebSocketFrame:
    return _op("serviceCallFailure", serviceId=service, callId=call, message=text)


def parameter_values(parameters: Sequence[Mapping[str, Any]], request: str | None = None) -> WebSocketFrame:
    fields = {"parameters": parameters}
    return (
        _op("parameterValues", **fields) if request is None else _op("parameterValues", **fields, id=request)
    )


def connection_graph(
    *,
    published: Mapping[str, Sequence[str]],
    subscribed: Mapping[str, Sequence[str]],
    services: Mapping[str, Sequence[str]],
    removed_topics: Sequence[str],
    removed_services: Sequence[str],
) -> WebSocketFrame:
    """Return a graph update: changed topics and services with their nodes, and removed names."""
    return _op(
        "connectionGraphUpdate",
        publishedTopics=[{"name": name, "publisherIds": nodes} for name, nodes in published.items()],
        subscribedTopics=[{"name": name, "subscriberIds": nodes} for name, nodes in subscribed.items()],
        advertisedServices=[{"name": name, "providerIds": nodes} for name, nodes in services.items()],
        removedTopics=removed_topics,
        removedServices=removed_services,
    )


def asset(request: int, found: Asset) -> WebSocketFrame:
    return WebSocketFrame(
        (_ASSET.pack(_ASSET_RESPONSE, request, _ASSET_FOUND, 0), found.content), owner=found
    )


def asset_failure(request: int, text: str) -> WebSocketFrame:
    reason = text.encode()
    return WebSocketFrame((_ASSET.pack(_ASSET_RESPONSE, request, _ASSET_FAILED, len(reason)) + reason,))
