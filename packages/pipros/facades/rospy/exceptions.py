"""The exceptions that rospy users catch."""

from __future__ import annotations


class ROSException(Exception):
    """Base class of rospy's exceptions."""


class ROSSerializationException(ROSException):
    """A value in a message does not fit the type of its field."""


class ROSInternalException(Exception):
    """An internal error in the client library."""


class ROSInitException(ROSException):
    """The node was used before `init_node`, or could not be initialized."""


class ROSInterruptException(ROSException, KeyboardInterrupt):
    """A blocking call was interrupted because the node is shutting down."""


class ROSTimeMovedBackwardsException(ROSInterruptException):
    """Simulated time moved backwards during a wait.

    Attributes:
        time: the size of the jump in seconds, which is negative.
    """

    def __init__(self, time: float) -> None:
        self.time = time
        super().__init__("ROS time moved backwards")


class TransportException(ROSInternalException):
    """Base class of connection errors."""


class TransportTerminated(TransportException):
    """A connection was closed."""


class TransportInitError(TransportException):
    """A connection could not be opened, or was refused by the peer."""
