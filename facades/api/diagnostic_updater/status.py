"""A status that tasks write to."""

from __future__ import annotations

from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus, KeyValue

from pipros.libraries.diagnostics.summaries import merged

OK = DiagnosticStatus.OK
WARN = DiagnosticStatus.WARN
ERROR = DiagnosticStatus.ERROR


class DiagnosticStatusWrapper(DiagnosticStatus):
    """A DiagnosticStatus with a summary, and with values that anything can be added to."""

    def summary(self, *args: Any) -> None:
        """Sets level and message: those of another status, or the two given."""
        level, message = _level_and_message(args)
        self.level, self.message = level, str(message)

    def clearSummary(self) -> None:
        """Level OK without a message."""
        self.summary(0, "")

    def mergeSummary(self, *args: Any) -> None:
        """Adds a level and a message: the worse level counts; good messages, or bad ones, are joined."""
        level, message = _level_and_message(args)
        self.level, self.message = merged(self.level, self.message, level, message)

    def add(self, key: str, val: Any) -> None:
        """Adds a value."""
        self.values.append(KeyValue(key, str(val)))


def _level_and_message(args: tuple[Any, ...]) -> tuple[Any, Any]:
    if len(args) == 1:
        return args[0].level, args[0].message
    level, message = args
    return level, message
