"""Messages in the order of their stamps, as roscpp's message_filters has it."""

from __future__ import annotations

from threading import RLock
from typing import Any

import rospy
from message_filters.simple_filter import SimpleFilter, stamp_of
from pipros.filters.history import Sequencer


class TimeSequencer(SimpleFilter):
    """Passes on messages in the order of their stamps, each `delay` after its stamp.

    Messages that come too late for that are dropped.

    Args:
        f: the filter whose messages are put in order.
        delay: a `rospy.Duration`, how long earlier messages are waited for.
        update_rate: a `rospy.Duration`, how often it is looked for messages to pass on.
        queue_size: how many messages wait at most; 0 for any number.
    """

    def __init__(self, f: SimpleFilter, delay: Any, update_rate: Any, queue_size: int) -> None:
        super().__init__()
        self._sequencer = Sequencer(delay.to_nsec(), queue_size)
        self._lock = RLock()
        self.connectInput(f)
        self._timer = rospy.Timer(update_rate, lambda _: self.dispatch(), reset=True)

    def connectInput(self, f: SimpleFilter) -> None:
        """Puts the messages of this filter in order, too."""
        self.incoming_connection = f.registerCallback(self.add)

    def add(self, msg: Any) -> None:
        """Takes a message."""
        stamp = stamp_of(msg, False)
        if stamp is not None:
            with self._lock:
                self._sequencer.add(stamp.to_nsec(), msg)

    def dispatch(self) -> None:
        """Passes on what is due. A timer calls it."""
        with self._lock:
            for message in self._sequencer.due(rospy.Time.now().to_nsec()):
                self.signalMessage(message)

    def shutdown(self) -> None:
        """Passes on nothing any more."""
        self._timer.shutdown()
