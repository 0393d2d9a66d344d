"""Access to other nodes' logger levels, for tools such as rqt_logger_level.

Facade of `pipros_tools.graph.loggers`.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator

from pipros.basics.errors import PiprosError
from pipros.basics.lazy_names import star_names as _star_names
from pipros_tools.graph import loggers as _loggers
from pipros_tools.graph.client import GraphClient

__all__ = ["LoggerLevelServiceCaller", "ROSConsoleException"]

_star_names(__name__, "rosgraph rosnode rospy rosservice")


class ROSConsoleException(Exception):
    """A node does not exist, or does not offer services for its loggers."""


class LoggerLevelServiceCaller:
    """Client that queries nodes' loggers and sets their levels."""

    def __init__(self) -> None:
        self._current_levels: dict[str, str] = {}

    def get_levels(self) -> list[str]:
        """Return the names of the levels, starting with the lowest."""
        return list(_loggers.LEVELS)

    def get_loggers(self, node: str) -> list[str]:
        """Return the names of a node's loggers.

        Raises:
            ROSConsoleException: the master or the node cannot be reached, or the call failed.
        """
        with _graph(node) as graph:
            self._current_levels = _loggers.levels_of(graph.master, graph.resolve(node))
        return list(self._current_levels)

    def get_node_names(self) -> list[str]:
        """Return the sorted names of the nodes whose logger levels can be set."""
        with GraphClient("rosconsole") as graph:
            return _loggers.nodes_with_loggers(graph.master)

    def send_logger_change_message(self, node: str, logger: str, level: str) -> bool:
        """Set the level of a logger.

        Return False if the logger already has this level. Call `get_loggers` for the node first.

        Raises:
            KeyError: `get_loggers` did not list the logger.
            ROSConsoleException: the master or the node cannot be reached, or the call failed.
        """
        if self._current_levels[logger].lower() == level.lower():
            return False
        with _graph(node) as graph:
            _loggers.set_level(graph.master, graph.resolve(node), logger, level)
        self._current_levels[logger] = level
        return True


@contextlib.contextmanager
def _graph(node: str) -> Iterator[GraphClient]:
    try:
        with GraphClient("rosconsole") as graph:
            yield graph
    except PiprosError as error:
        raise ROSConsoleException(f"node '{node}' doesn't exist or doesn't support query: {error}") from None
