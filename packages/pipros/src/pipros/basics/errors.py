"""Common errors. Each describes what happened, to which peer or object, and what to try."""

from __future__ import annotations

import copyreg
import sys

from pipros.basics.printable import bounded, printable

_TEXT_LIMIT = 2_000
"""Maximum number of characters of a peer's text that are quoted in an error."""


class PiprosError(Exception):
    """Base class of all pipros errors. Its text is that of `bounded`, whatever values it quotes."""

    def __str__(self) -> str:
        return bounded(super().__str__())

    def __reduce__(self) -> tuple[object, ...]:
        # Without the arguments of the subclass, a pool of processes would wait forever for what raised it.
        return copyreg.__newobj__, (type(self),), {**self.__dict__, "args": self.args}  # type: ignore[attr-defined]


class NeedsPosix(PiprosError):
    """This system lacks a feature of POSIX."""

    def __init__(self, feature: str) -> None:
        super().__init__(f"{feature} needs a POSIX system, but this is {sys.platform}")


class NeedsSockets(PiprosError):
    """Python runs in a browser, where there are no sockets or threads."""

    def __init__(self) -> None:
        super().__init__("nodes, masters and their clients need sockets and threads, which a browser lacks")


class MissingExtra(ImportError):
    """A library from an optional extra is not installed.

    The error text says what needs the library and how to install it.
    """


class InvalidName(PiprosError, ValueError):
    """A graph resource name, package name or type name breaks the rules of ROS names."""


class NotFound(PiprosError, LookupError):
    """A package, node, file, type, topic or parameter that was requested does not exist."""


class ProtocolError(PiprosError):
    """Bytes from a peer violate the protocol. The connection is closed.

    Text from the peer is made printable, as in all errors about peers.
    """

    def __init__(self, text: str = "") -> None:
        super().__init__(printable(text, _TEXT_LIMIT))


class LimitExceeded(ProtocolError):
    """A peer sent or announced more than a limit allows."""


class Unreachable(PiprosError, ConnectionError):
    """A connection to a peer failed, or was lost before the reply arrived.

    This is also a ConnectionError, which scripts written for genuine rospy catch.

    Attributes:
        peer: the URI or host:port that was tried.
        reason: the cause, such as the operating system's error text.
        cure: what to try; may be empty.
    """

    def __init__(self, peer: str, reason: str, cure: str = "") -> None:
        self.peer = peer = printable(peer, _TEXT_LIMIT)
        self.reason = reason = printable(reason, _TEXT_LIMIT)
        self.cure = cure
        super().__init__(f"cannot reach {peer}: {reason}" + (f". {cure}" if cure else ""))


class Refused(PiprosError):
    """A peer refused a valid request, or reported an error.

    Attributes:
        peer: the peer that refused.
        code: the status code of the ROS API (-1: the caller's error, 0: the peer's failure).
        text: the peer's message.
    """

    def __init__(self, peer: str, code: int, text: str) -> None:
        self.peer = peer = printable(peer, _TEXT_LIMIT)
        self.code = code
        self.text = text = printable(text, _TEXT_LIMIT)
        super().__init__(f"{peer} refused: {text}")


class Interrupted(PiprosError):
    """A wait was interrupted, usually because the node is shutting down."""
