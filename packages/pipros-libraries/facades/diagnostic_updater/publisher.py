"""Report the frequency and delay of a topic's messages."""

from __future__ import annotations

from typing import Any

from diagnostic_updater.tasks import CompositeDiagnosticTask, FrequencyStatus, TimeStampStatus


class HeaderlessTopicDiagnostic(CompositeDiagnosticTask):
    """Task that reports how frequently `tick` is called. Adds itself to the updater `diag`."""

    def __init__(self, name: str, diag: Any, freq: Any) -> None:
        super().__init__(f"{name} topic status")
        self.diag = diag
        self.freq = FrequencyStatus(freq)
        self.addTask(self.freq)
        self.diag.add(self)

    def tick(self) -> None:
        """Count a message."""
        self.freq.tick()

    def clear_window(self) -> None:
        """Reset the frequency window."""
        self.freq.clear()


class TopicDiagnostic(HeaderlessTopicDiagnostic):
    """Task that reports the frequency of messages and the age of their timestamps."""

    def __init__(self, name: str, diag: Any, freq: Any, stamp: Any) -> None:
        super().__init__(name, diag, freq)
        self.stamp = TimeStampStatus(stamp)
        self.addTask(self.stamp)

    def tick(self, stamp: Any) -> None:  # type: ignore[override] # Noetic's signature
        """Count a message with its timestamp."""
        self.stamp.tick(stamp)
        super().tick()


class DiagnosedPublisher(TopicDiagnostic):
    """Publisher that reports diagnostics for its messages, which must have a header."""

    def __init__(self, pub: Any, diag: Any, freq: Any, stamp: Any) -> None:
        super().__init__(pub.name, diag, freq, stamp)
        self.publisher = pub

    def publish(self, message: Any) -> None:
        """Count a message and publish it."""
        self.tick(message.header.stamp)
        self.publisher.publish(message)
