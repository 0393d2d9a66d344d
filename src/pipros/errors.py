"""The few errors of pipros. Each says what happened, to whom, and what to try."""

from __future__ import annotations

from pipros.printable import printable

_TEXT_LIMIT = 2_000
"""Characters of a peer's words in an error."""


class PiprosError(Exception):
    """Root of all errors that pipros raises on purpose."""


class InvalidName(PiprosError, ValueError):
    """A graph resource name, package name or type name breaks the rules of ROS names."""


class NotFound(PiprosError, LookupError):
    """A package, node, file, type, topic or parameter that was asked for does not exist."""


class ProtocolError(PiprosError):
    """Bytes from a peer break the protocol. The connection that they came over is closed.

    What it quotes of the peer is made printable, as in all errors about peers.
    """

    def __init__(self, text: str = "") -> None:
        super().__init__(printable(text, _TEXT_LIMIT))


class LimitExceeded(ProtocolError):
    """A peer sent or announced more than a limit allows."""


class Unreachable(PiprosError, ConnectionError):
    """No connection to a peer, or it was lost before the answer came.

    It is a ConnectionError too, which scripts written for genuine rospy catch.

    Attributes:
        peer: the URI or host:port that was tried.
        reason: what the operating system said, in plain words.
    """

    def __init__(self, peer: str, reason: str, cure: str = "") -> None:
        self.peer = peer = printable(peer, _TEXT_LIMIT)
        self.reason = reason = printable(reason, _TEXT_LIMIT)
        self.cure = cure
        super().__init__(f"cannot reach {peer}: {reason}" + (f". {cure}" if cure else ""))


class Refused(PiprosError):
    """A peer understood the request and said no.

    Attributes:
        peer: who refused.
        code: the status code of the ROS API (-1: the caller's error, 0: the peer's failure).
        text: the peer's own words.
    """

    def __init__(self, peer: str, code: int, text: str) -> None:
        self.peer = peer = printable(peer, _TEXT_LIMIT)
        self.code = code
        self.text = text = printable(text, _TEXT_LIMIT)
        super().__init__(f"{peer} refused: {text}")


class Interrupted(PiprosError):
    """A wait ended because the node is shutting down."""
