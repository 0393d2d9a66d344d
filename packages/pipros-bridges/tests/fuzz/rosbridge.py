"""Any frames from a rosbridge client have effects or cause status errors, but never raise an exception.

An input is frames, separated by NUL bytes. The first byte says how they are read: `b` as BSON, `s` as parts
of a stream, anything else as frames of a WebSocket.

python -m tests.fuzz.rosbridge --seconds 60
"""

import json
import sys
from typing import Any

from pipros.basics.errors import PiprosError
from pipros.basics.limits import Limits
from pipros.basics.names import InvalidName, canonicalize, is_legal
from pipros.msg import load_message_class
from pipros_bridges.limits import BridgeLimits
from pipros_bridges.rosbridge.effects import AnswerCall, CallService, Publish, Reply
from pipros_bridges.rosbridge.encoding import Encoder, WireEncoding, operation_frame
from pipros_bridges.rosbridge.filling import Filler
from pipros_bridges.rosbridge.protocol import ClientProtocol
from pipros_bridges.rosbridge.settings import RosbridgeSettings
from pipros_bridges.shared_topics import TopicMessage
from tests.fuzz import mutation
from tests.support.constants import changed

LIMITS = Limits(tables=(BridgeLimits(bridge_message_bytes=100_000),))
TYPES = (
    *("sensor_msgs/Imu", "sensor_msgs/Image", "tf2_msgs/TFMessage", "std_msgs/String", "std_msgs/Time"),
    *("std_msgs/Float32MultiArray", "diagnostic_msgs/DiagnosticArray", "std_msgs/UInt64", "std_msgs/Bool"),
)
WORDS = [
    *(
        b"{", b"}", b"[", b"]", b'"', b"\\", b"\0", b",", b":", b"null", b"true", b"NaN", b"1e400", b"-1",
        b"1" * 30,
    ),
    *(b'"op":', b'"id":', b'"topic":', b'"type":', b'"msg":', b'"data":', b'"num":', b'"total":', b'"now"'),
    *(b'"fragment"', b'"header":{}', b'"transforms":[{}]', b'"\\ud800"'),
    *(f'"{name}"'.encode() for name in ClientProtocol(RosbridgeSettings(), str).operations),
    *(
        b'{"op":"fragment","id":1,"num":0,"total":2,"data":"{"}',
        b'"layout":{}',
        b'"secs":',
        b"\x03a\0",
        b"\x12",
    ),
]  # fmt: skip
_ENCODER = Encoder()
_FILLER = Filler(lambda: 0)


@changed(BRIDGE_SUBSCRIPTIONS=20)
def target(data: bytes) -> None:
    protocol = ClientProtocol(RosbridgeSettings(is_bson=data[:1] == b"b"), _resolve, LIMITS, lambda: 0.0)
    for frame in data.split(b"\0\0" if data[:1] == b"b" else b"\0"):
        if data[:1] == b"s":
            effects: Any = protocol.receive_stream(frame.decode(errors="replace"))
        elif data[:1] == b"b":
            effects = protocol.receive(frame[1:] if frame[:1] == b"b" else frame)
        else:
            effects = protocol.receive(frame if frame[:1] == b"\xff" else frame.decode(errors="replace"))
        for effect in effects:
            _carry_out(effect)


def _carry_out(effect: Any) -> None:
    if isinstance(effect, Reply):
        json.loads(b"".join(operation_frame(effect.operation).parts))
    values = {Publish: "values", CallService: "arguments", AnswerCall: "values"}.get(type(effect))
    for kind in TYPES if values else ():
        message = load_message_class(kind)()
        try:
            _FILLER.fill(message, getattr(effect, values))
            body = b"".join(message._to_buffers())
        except PiprosError:
            continue
        header = {"type": kind, "md5sum": message._md5sum, "message_definition": message._full_text}
        for encoding in WireEncoding:
            assert _ENCODER.encoded(TopicMessage("/x", body, header, 0)).frames(encoding, "/x", 50)


def _resolve(name: str) -> str:
    name = canonicalize(name)
    if not is_legal(name):
        raise InvalidName(f"[{name}] is not a name")
    return name if name.startswith("/") else f"/{name}"


if __name__ == "__main__":
    sys.exit(mutation.main(target, "rosbridge", WORDS))
