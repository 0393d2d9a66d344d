"""Topics that report how often, and how late, messages come."""

from __future__ import annotations

from typing import Any

from diagnostic_updater.tasks import CompositeDiagnosticTask, FrequencyStatus, TimeStampStatus


class HeaderlessTopicDiagnostic(CompositeDiagnosticTask):
    """Reports how often `tick` is called for a topic. Adds itself to the updater `diag`."""

    def __init__(self, name: str, diag: Any, freq: Any) -> None:
        super().__init__(f"{name} topic status")
        self.diag = diag
        self.freq = FrequencyStatus(freq)
        self.addTask(self.freq)
        self.diag.add(self)

    def tick(self) -> None:
        """Counts a message."""
        self.freq.tick()

    def clear_window(self) -> None:
        """Resets the window."""
        self.freq.clear()


class TopicDiagnostic(HeaderlessTopicDiagnostic):
    """Reports also how old the stamps of messages are."""

    def __init__(self, name: str, diag: Any, freq: Any, stamp: Any) -> None:
        super().__init__(name, diag, freq)
        self.stamp = TimeStampStatus(stamp)
        self.addTask(self.stamp)

    def tick(self, stamp: Any) -> None:  # type: ignore[override] # as Noetic has it
        """Counts a message with its stamp."""
        self.stamp.tick(stamp)
        super().tick()


class DiagnosedPublisher(TopicDiagnostic):
    """A publisher whose messages, which must have a header, are counted."""

    def __init__(self, pub: Any, diag: Any, freq: Any, stamp: Any) -> None:
        super().__init__(pub.name, diag, freq, stamp)
        self.publisher = pub

    def publish(self, message: Any) -> None:
        """Counts a message and publishes it."""
        self.tick(message.header.stamp)
        self.publisher.publish(message)
