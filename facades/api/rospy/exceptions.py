"""The exceptions that rospy users catch."""

from __future__ import annotations


class ROSException(Exception):
    """Base of the errors of rospy."""


class ROSSerializationException(ROSException):
    """A value in a message does not fit the type of its field."""


class ROSInternalException(Exception):
    """An internal error of the client library."""


class ROSInitException(ROSException):
    """The node was used before `init_node`, or could not be initialised."""


class ROSInterruptException(ROSException, KeyboardInterrupt):
    """A wait ended because the node is shutting down."""


class ROSTimeMovedBackwardsException(ROSInterruptException):
    """Simulated time went back during a wait.

    Attributes:
        time: the jump in seconds; negative.
    """

    def __init__(self, time: float) -> None:
        self.time = time
        super().__init__("ROS time moved backwards")


class TransportException(ROSInternalException):
    """Base of the errors of connections."""


class TransportTerminated(TransportException):
    """A connection ended."""


class TransportInitError(TransportException):
    """A connection could not be opened, or the peer refused it."""
