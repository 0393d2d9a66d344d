"""Encodes operations and topic messages for clients, as JSON, PNG, CBOR or BSON."""

from __future__ import annotations

import base64
import itertools
import json
import math
import threading
from collections.abc import Mapping, Sequence
from enum import IntEnum
from functools import cache
from typing import TYPE_CHECKING, Any
from weakref import WeakKeyDictionary

from pipros.basics.errors import PiprosError
from pipros.basics.extras import install_command
from pipros.msg.class_finder import ClassFinder
from pipros.msg.compile.plain import plain_reader
from pipros.msg.time import NS_PER_S
from pipros_bridges.outbox import WebSocketFrame, text_frame
from pipros_bridges.rosbridge.plain_values import Format, NotRepresentable, PlainValues
from pipros_libraries.pictures.png import png
from pipros_server.json_text import ORJSON, json_bytes

if TYPE_CHECKING:
    from collections.abc import Callable

    from pipros.msg.base import Buffer, Message
    from pipros_bridges.shared_topics import TopicMessage


class WireEncoding(IntEnum):
    """Encodings of a topic's messages.

    If a client requests several encodings, the encoding with the highest value is used.
    """

    JSON = 0
    PNG = 1
    CBOR = 2
    CBOR_RAW = 3

    @classmethod
    def of(cls, compression: object) -> WireEncoding:
        """Return the encoding for a client's `compression`; JSON if it is unknown, as in rosbridge."""
        names = {"png": cls.PNG, "cbor": cls.CBOR, "cbor-raw": cls.CBOR_RAW}
        return names.get(compression, cls.JSON) if isinstance(compression, str) else cls.JSON


class MissingCodec(PiprosError):
    """An encoding needs a package that is not installed."""


_STRICT = json.JSONEncoder(separators=(",", ":"), allow_nan=False)
_PLAIN = json.JSONEncoder(separators=(",", ":"))


class _Bson:
    """The functions used from `pymongo`'s package `bson`."""

    def __init__(self) -> None:
        try:
            from bson import decode, encode
            from bson.errors import BSONError
        except ImportError:  # also raised if PyPI's unrelated package `bson` is installed
            raise MissingCodec(
                f"BSON needs pymongo, which is not installed. Try: {install_command('bridges')}"
            ) from None
        self.encode: Callable[[Any], bytes] = encode
        self.decode: Callable[[bytes], dict[str, Any]] = decode
        self.error: type[Exception] = BSONError


@cache
def bson_codec() -> _Bson:
    """Return the codec. Raises `MissingCodec` if `pymongo` is not installed."""
    return _Bson()


@cache
def _cbor() -> Any:
    try:
        import cbor2
    except ImportError:
        raise MissingCodec(
            f"CBOR needs cbor2, which is not installed. Try: {install_command('bridges')}"
        ) from None
    return cbor2


def check_codec(encoding: WireEncoding) -> None:
    """Raise `MissingCodec` if the encoding needs a package that is not installed."""
    if encoding in (WireEncoding.CBOR, WireEncoding.CBOR_RAW):
        _cbor()


MAX_FRAGMENTS = 10_000
"""Maximum number of fragments of an operation. If there would be more, larger fragments are used."""

_NUMBERS = itertools.count(1)


def operation_frame(operation: Mapping[str, Any], *, is_bson: bool = False) -> WebSocketFrame:
    """Encode an operation other than `publish`.

    Raises:
        PiprosError: BSON cannot hold a value, or `pymongo` is not installed.
    """
    if not is_bson:
        data = json_bytes(operation)
        return text_frame(_PLAIN.encode(operation)) if data is None else WebSocketFrame((data,), is_text=True)
    bson = bson_codec()
    try:
        return WebSocketFrame((bson.encode(operation),))
    except (bson.error, OverflowError, TypeError) as error:
        raise NotRepresentable(f"cannot encode as BSON: {error}") from None


def fragment_frames(whole: WebSocketFrame, size: int) -> Sequence[WebSocketFrame]:
    """Split a text frame that is longer than `size` into fragments with `size` characters of data each.

    If `size` is 0, or the frame is binary, the frame is not split.
    """
    if not size or not whole.is_text or whole.size <= size:
        return (whole,)
    text = b"".join(whole.parts).decode()
    size = max(size, -(-len(text) // MAX_FRAGMENTS))
    parts = [text[start : start + size] for start in range(0, len(text), size)]
    identity = f"fragments_{next(_NUMBERS)}"
    total = len(parts)
    return [
        text_frame(
            _STRICT.encode({"op": "fragment", "id": identity, "data": part, "num": number, "total": total})
        )
        for number, part in enumerate(parts)
    ]


class Encoder:
    """Encodes topic messages for all clients. A message is encoded at most once per encoding and topic name.

    Methods may be called from any thread.

    Args:
        is_bson: whether clients receive BSON instead of JSON.
    """

    def __init__(self, *, is_bson: bool = False) -> None:
        self.is_bson = is_bson
        self._classes = ClassFinder()
        self._json = PlainValues(Format.BSON if is_bson else Format.JSON)
        self._nulls = PlainValues(Format.BSON if is_bson else Format.JSON_NULLS)
        self._cbor: PlainValues | None = None
        self._readers: WeakKeyDictionary[type[Message], Callable[[Buffer], dict[str, Any]]] = (
            WeakKeyDictionary()
        )
        self._newest: dict[str, EncodedMessage] = {}

    def encoded(self, message: TopicMessage) -> EncodedMessage:
        """Return the encodings of a message, as one object for all clients that receive the message."""
        newest = self._newest.get(message.topic)
        if newest is None or newest.message is not message:
            newest = self._newest[message.topic] = EncodedMessage(self, message)
        return newest

    def forget(self, topic: str) -> None:
        """Discard the encodings of a topic's newest message after a client has unsubscribed."""
        self._newest.pop(topic, None)

    def decode(self, message: TopicMessage) -> Any:
        """Decode a message with the installed class or its publisher's definition.

        Raises:
            PiprosError: the type is unknown, or the message is malformed.
        """
        return self._class_of(message)._from_bytes(message.body)

    def _class_of(self, message: TopicMessage) -> type[Message]:
        header = message.header
        kind, definition = header.get("type", "*"), header.get("message_definition", "")
        return self._classes.find(kind, header.get("md5sum", "*"), definition)

    def json_of(self, topic: str, message: TopicMessage) -> bytes | None:
        """Encode a `publish` operation without creating a message.

        Return None if `orjson` is not installed, or cannot encode the message.

        Raises:
            PiprosError: the type is unknown, or the message is malformed.
        """
        if ORJSON is None:
            return None
        cls = self._class_of(message)
        read = self._readers.get(cls)
        if read is None:
            read = self._readers[cls] = plain_reader(cls)
        return json_bytes({"op": "publish", "topic": topic, "msg": read(message.body)})

    def values_of(self, message: Any) -> dict[str, Any]:
        """Convert a message, such as a response, to values for `operation_frame`.

        NaN and infinities become None, except for BSON. Raises `NotRepresentable`.
        """
        return self._nulls.of(message)

    def encode(self, encoding: WireEncoding, topic: str, message: Any) -> WebSocketFrame:
        """Encode a `publish` operation with a decoded message.

        Raises:
            PiprosError: the package for the encoding is not installed, or the encoding cannot represent a
                value.
        """
        if encoding is WireEncoding.CBOR:
            if self._cbor is None:
                self._cbor = PlainValues(Format.CBOR, _cbor().CBORTag)
            return WebSocketFrame(
                (_cbor().dumps({"op": "publish", "topic": topic, "msg": self._cbor.of(message)}),)
            )
        operation = {"op": "publish", "topic": topic, "msg": self._json.of(message)}
        if self.is_bson:
            return operation_frame(operation, is_bson=True)
        try:
            text = _STRICT.encode(operation)
        except ValueError:  # NaN or infinity
            text = _STRICT.encode({**operation, "msg": self._nulls.of(message)})
        if encoding is WireEncoding.PNG:
            return text_frame(_STRICT.encode({"op": "png", "data": base64_png_of(text.encode())}))
        return text_frame(text)


class EncodedMessage:
    """A topic message, with the encodings that clients have requested so far. Thread-safe."""

    __slots__ = ("_decoded", "_encoder", "_known", "_lock", "message")

    def __init__(self, encoder: Encoder, message: TopicMessage) -> None:
        self.message = message
        self._encoder = encoder
        self._decoded: Any = None
        self._known: dict[tuple[WireEncoding, str, int], Sequence[WebSocketFrame]] = {}
        self._lock = threading.RLock()

    def frames(self, encoding: WireEncoding, topic: str, fragment_size: int = 0) -> Sequence[WebSocketFrame]:
        """Return the frames for a client: one frame, or fragments if the text is longer than `fragment_size`.

        `topic` is the name that the client used, which may be relative.

        Raises:
            PiprosError: the message cannot be decoded or encoded.
        """
        key = encoding, topic, fragment_size
        with self._lock:
            if key not in self._known:
                self._known[key] = (
                    fragment_frames(self.frames(encoding, topic)[0], fragment_size)
                    if fragment_size
                    else (self._whole(encoding, topic),)
                )
            return self._known[key]

    def _whole(self, encoding: WireEncoding, topic: str) -> WebSocketFrame:
        message = self.message
        if encoding is WireEncoding.CBOR_RAW:
            secs, nsecs = divmod(message.received_ns, NS_PER_S)
            body = {"secs": secs, "nsecs": nsecs, "bytes": message.body}
            return WebSocketFrame((_cbor().dumps({"op": "publish", "topic": topic, "msg": body}),))
        # Clients read pixels as characters, so PNG needs ASCII.
        if encoding is WireEncoding.JSON and not self._encoder.is_bson:
            data = self._encoder.json_of(topic, message)
            if data is not None:
                return WebSocketFrame((data,), is_text=True)
        if self._decoded is None:
            self._decoded = self._encoder.decode(message)
        return self._encoder.encode(encoding, topic, self._decoded)


def png_of(text: bytes) -> bytes:
    """Return an RGB image whose channel values are the bytes of `text`, padded with line breaks."""
    pixels = -(-len(text) // 3)
    width = max(math.isqrt(pixels), 1)
    height = max(-(-pixels // width), 1)
    row_bytes = width * 3
    padded = text.ljust(row_bytes * height, b"\n")
    rows = (padded[start : start + row_bytes] for start in range(0, len(padded), row_bytes))
    return png(width, height, 3, 8, rows, level=3)


def base64_png_of(text: bytes) -> str:
    """Return the image from `png_of`, encoded as base64."""
    return base64.b64encode(png_of(text)).decode("ascii")
