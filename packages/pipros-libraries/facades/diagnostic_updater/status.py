"""`DiagnosticStatusWrapper`, the status that tasks fill in."""

from __future__ import annotations

from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus, KeyValue

from pipros_libraries.diagnostics.summaries import merged

OK = DiagnosticStatus.OK
WARN = DiagnosticStatus.WARN
ERROR = DiagnosticStatus.ERROR


class DiagnosticStatusWrapper(DiagnosticStatus):
    """A DiagnosticStatus with methods that set the summary and add values of any type."""

    def summary(self, *args: Any) -> None:
        """Set the level and the message, given as another status or as two arguments."""
        level, message = _level_and_message(args)
        self.level, self.message = level, str(message)

    def clearSummary(self) -> None:
        """Set the level to OK and the message to an empty string."""
        self.summary(0, "")

    def mergeSummary(self, *args: Any) -> None:
        """Merge in a level and a message, given as for `summary`. The worse level wins.

        If both levels are OK or neither is, the messages are joined. Otherwise, the message with the worse
        level wins.
        """
        level, message = _level_and_message(args)
        self.level, self.message = merged(self.level, self.message, level, message)

    def add(self, key: str, val: Any) -> None:
        """Add a key with a value, which is converted to text."""
        self.values.append(KeyValue(key, str(val)))


def _level_and_message(args: tuple[Any, ...]) -> tuple[Any, Any]:
    if len(args) == 1:
        return args[0].level, args[0].message
    level, message = args
    return level, message
