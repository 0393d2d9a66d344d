"""`TimeSequencer`, which orders messages by stamp, as in roscpp's message_filters."""

from __future__ import annotations

from threading import RLock
from typing import Any

import rospy
from message_filters.simple_filter import SimpleFilter, stamp_of
from pipros_libraries.filters.sequencer import Sequencer


class TimeSequencer(SimpleFilter):
    """Filter that passes messages on in timestamp order, each `delay` after its timestamp.

    A message is dropped if a message with a later timestamp has already been passed on. Callbacks run in a
    timer thread.

    Args:
        f: the input filter.
        delay: `rospy.Duration` to wait after the timestamp of a message before passing it on.
        update_rate: `rospy.Duration` between checks for messages that are due.
        queue_size: maximum number of waiting messages; 0 for no limit.
    """

    def __init__(self, f: SimpleFilter, delay: Any, update_rate: Any, queue_size: int) -> None:
        super().__init__()
        self._sequencer = Sequencer(delay.to_nsec(), queue_size)
        self._lock = RLock()
        self.connectInput(f)
        self._timer = rospy.Timer(update_rate, lambda _: self.dispatch(), reset=True)

    def connectInput(self, f: SimpleFilter) -> None:
        """Connect another filter as an input."""
        self.incoming_connection = f.registerCallback(self.add)

    def add(self, msg: Any) -> None:
        """Add a message. A message without a header is dropped with a warning."""
        stamp = stamp_of(msg, False)
        if stamp is not None:
            with self._lock:
                self._sequencer.add(stamp.to_nsec(), msg)

    def dispatch(self) -> None:
        """Pass on the messages that are due. Called by a timer."""
        with self._lock:
            for message in self._sequencer.due(rospy.Time.now().to_nsec()):
                self.signalMessage(message)

    def shutdown(self) -> None:
        """Stop passing messages on."""
        self._timer.shutdown()
