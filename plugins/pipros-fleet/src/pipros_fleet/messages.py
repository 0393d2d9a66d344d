"""Messages on a fleet link: the ROS 1 body, which may be compressed, and an attachment of 48 bytes."""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass, field
from typing import Final

from pipros.basics.errors import LimitExceeded, ProtocolError
from pipros.basics.limits import limit_text
from pipros_fleet.keys import VERSION

_LAYOUT: Final = struct.Struct("<BB2xI8sQQ16s")
_COMPRESSED, _LATCHED = 1, 2
_REPLAYS: Final = 10_000
"""Maximum number of different replays of one topic. Further replays are dropped."""
_LEVEL: Final = 1  # zlib's fastest


@dataclass(frozen=True, slots=True)
class MessageAttachment:
    """Metadata sent with each message.

    Attributes:
        source: number of the publisher, assigned by the sender. Receivers keep one latched message for each
            publisher.
        instance: hexadecimal identifier of one run of the sender's agent.
        sequence: number of the message on its topic in this run, starting at 1.
        stamp_ns: send time on the sender's clock.
        md5sum: MD5 sum of the message type.
    """

    source: int
    instance: str
    sequence: int
    stamp_ns: int
    md5sum: str
    is_compressed: bool = False
    is_latched: bool = False


def pack(attachment: MessageAttachment) -> bytes:
    """Encode an attachment."""
    flags = attachment.is_compressed * _COMPRESSED | attachment.is_latched * _LATCHED
    return _LAYOUT.pack(
        VERSION,
        flags,
        attachment.source,
        bytes.fromhex(attachment.instance),
        attachment.sequence,
        attachment.stamp_ns,
        bytes.fromhex(attachment.md5sum),
    )


def is_compressed(content: bytes) -> bool:
    """Return whether an attachment says that the message is compressed. The rest may be malformed."""
    return len(content) > 1 and bool(content[1] & _COMPRESSED)


def unpack(content: bytes) -> MessageAttachment:
    """Decode an attachment.

    Raises:
        ProtocolError: the attachment is malformed or has another version.
    """
    if len(content) != _LAYOUT.size or content[0] != VERSION:
        raise ProtocolError(f"a message attachment must have {_LAYOUT.size} bytes and version {VERSION}")
    _, flags, source, instance, sequence, stamp_ns, md5sum = _LAYOUT.unpack(content)
    return MessageAttachment(
        source,
        instance.hex(),
        sequence,
        stamp_ns,
        md5sum.hex(),
        bool(flags & _COMPRESSED),
        bool(flags & _LATCHED),
    )


def compressed(body: bytes) -> bytes:
    return zlib.compress(body, _LEVEL)


def decompressed(body: bytes, limit_bytes: int) -> bytes:
    """Return the body of a compressed message.

    Raises:
        LimitExceeded: the body is larger than the limit.
        ProtocolError: the data is malformed.
    """
    inflate = zlib.decompressobj()
    try:
        found = inflate.decompress(body, limit_bytes)
    except zlib.error as error:
        raise ProtocolError(f"a compressed message is malformed: {error}") from None
    if inflate.unconsumed_tail:
        raise LimitExceeded(
            f"a decompressed message is too large; {limit_text('fleet_message_bytes', limit_bytes)}"
        )
    if not inflate.eof:
        raise ProtocolError("a compressed message is incomplete")
    return found


@dataclass(slots=True)
class ReceivedMessage:
    """Counts the messages received from one member on one topic. Detects missing and repeated messages.

    Attributes:
        messages, bytes: totals received.
        lost: number of skipped sequence numbers.
        malformed: number of messages that could not be decoded or had a different type.
        remembers: whether a message that was received is recognized if it is replayed.
    """

    messages: int = 0
    bytes: int = 0
    lost: int = 0
    malformed: int = 0
    remembers: bool = False
    _instance: str = ""
    _last: int = 0
    _replayed: set[int] = field(default_factory=set, repr=False)

    def is_new(self, attachment: MessageAttachment, size: int, *, is_replay: bool = False) -> bool:
        """Count a message and return True. If it was received before, return False without counting it.

        A replay is a latched message or a result sent on request, which may be older than the last message.
        Replays beyond `_REPLAYS` also return False.
        """
        if attachment.instance != self._instance:
            self._instance, self._last = attachment.instance, 0
            self._replayed.clear()
        number = attachment.sequence
        if is_replay:
            if number in self._replayed or len(self._replayed) >= _REPLAYS:
                return False
            self._replayed.add(number)
        else:
            if number <= self._last or number in self._replayed:
                self._last = max(self._last, number)
                return False
            if self._last:
                self.lost += number - self._last - 1
            self._last = number
            if self.remembers:
                self._replayed.add(number)
                if len(self._replayed) >= _REPLAYS:
                    self._replayed = {each for each in self._replayed if each > number - _REPLAYS // 2}
        self.messages += 1
        self.bytes += size
        return True

    def restart(self) -> None:
        """Start a new sequence: messages sent while the topic was not received do not count as lost."""
        self._last = 0
        self._replayed.clear()
