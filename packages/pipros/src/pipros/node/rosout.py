"""The `/rosout` node: republishes `/rosout` on `/rosout_agg`, and logs the messages to a file."""

from __future__ import annotations

import logging
from pathlib import Path
from types import TracebackType
from typing import Any

from pipros.basics.env import Environment
from pipros.basics.printable import listed, printable_lines
from pipros.msg import load_message_class
from pipros.node.log import open_file_handler
from pipros.node.logger_services import serve_loggers
from pipros.node.node import Node

QUEUE_SIZE = 1000
"""Maximum number of messages queued for one subscriber of `/rosout_agg`, as in genuine rosout."""

_NAMES = {1: "DEBUG", 2: "INFO", 4: "WARN", 8: "ERROR", 16: "FATAL"}


class RosoutAggregator:
    """Runs the `/rosout` node inside this process. Use it as a context manager, or call `start` and `stop`.

    In the file, continuation lines of a message are indented by a tab and control characters are escaped, so
    that a sender cannot forge another sender's lines.
    """

    def __init__(self, environment: Environment, log_file: Path | None = None) -> None:
        """Store the settings; `start` connects.

        Args:
            environment: variables that include the master's address.
            log_file: the file to which each message is logged; None for no file.
        """
        self.node = Node("rosout", environment=environment)
        self._log_file = log_file
        self._lines = logging.Logger("rosout")
        self._handler: logging.Handler | None = None

    def start(self) -> None:
        """Register the node with the master.

        Raises:
            OSError: the node cannot open its ports; see `Node.start`.
        """
        self.open_log()
        self.node.start()
        self.register()

    def open_log(self) -> None:
        """Open the log file, as a `LogFile` does."""
        if self._log_file is not None:
            self._handler = open_file_handler(self._log_file)
            self._handler.setFormatter(logging.Formatter("%(message)s"))
            self._lines.addHandler(self._handler)

    def register(self) -> None:
        """Register the node's topics and services. The node must have been started. Blocks."""
        log_class = load_message_class("rosgraph_msgs/Log")
        self._publisher = self.node.advertise("/rosout_agg", log_class, queue_size=QUEUE_SIZE)
        self.node.subscribe("/rosout", log_class, self._repeat)
        serve_loggers(self.node)

    def stop(self) -> None:
        """Stop the node and close the file. May be called repeatedly."""
        self.node.shutdown("the end of rosout")
        if self._handler is not None:
            self._handler.close()

    def _repeat(self, message: Any) -> None:
        self._publisher.publish(message)
        if self._handler is not None:
            stamp, severity = message.header.stamp, _NAMES.get(message.level, str(message.level))
            self._lines.info(
                "%d.%09d %s %s [%s:%d(%s)] [topics: %s] %s",
                stamp.secs,
                stamp.nsecs,
                severity,
                listed(message.name),
                listed(message.file),
                message.line,
                listed(message.function),
                ", ".join(map(listed, message.topics)),
                printable_lines(message.msg).replace("\n", "\n\t"),
            )

    def __enter__(self) -> RosoutAggregator:
        self.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.stop()
