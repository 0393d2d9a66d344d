"""Module variables of Noetic's rospy that packages read and set, such as `rospy.core._uri`."""

from __future__ import annotations

from typing import Protocol

from pipros.node import Node


class OwnerOfNode(Protocol):
    """What these variables reflect of the session. A protocol because `Session` imports this module."""

    node: Node | None
    has_time: bool

    @property
    def is_shutdown(self) -> bool: ...

    def set_shutdown(self, value: bool) -> None: ...


class NoeticGlobals:
    """Variables that reflect the session's state and can be assigned to.

    Attributes:
        log_file: `rospy.core._log_filename`.
    """

    def __init__(self, session: OwnerOfNode) -> None:
        self._session = session
        self.reset()

    def reset(self) -> None:
        """Discard assigned values before another node starts."""
        self.log_file: str | None = None
        self._is_initialized: bool | None = None
        self._node_uri: str | None = None

    @property
    def is_initialized(self) -> bool:
        """The assigned value; by default, whether `init_node` has returned."""
        if self._is_initialized is not None:
            return self._is_initialized
        return self._session.node is not None and self._session.has_time

    @is_initialized.setter
    def is_initialized(self, value: bool) -> None:
        self._is_initialized = value

    @property
    def is_shutdown(self) -> bool:
        """Whether the node has started to shut down.

        Assigning False after the shutdown restores the state before `init_node`.
        """
        return self._session.is_shutdown

    @is_shutdown.setter
    def is_shutdown(self, value: bool) -> None:
        self._session.set_shutdown(value)

    @property
    def is_ending(self) -> bool:
        """Whether shutdown of the node was requested."""
        node = self._session.node
        return self._session.is_shutdown or (node is not None and node.is_ending)

    @is_ending.setter
    def is_ending(self, value: bool) -> None:
        """Ignore the value.

        Packages that set it to False also set `is_shutdown`, and that assignment takes effect.
        """

    @property
    def node_uri(self) -> str | None:
        """The assigned URI; by default, the URI of the node's slave API, or None before `init_node`."""
        node = self._session.node
        return self._node_uri if self._node_uri is not None or node is None else node.uri

    @node_uri.setter
    def node_uri(self, value: str | None) -> None:
        self._node_uri = value
