"""One side of a bond in real time: its `Life`, with timeouts, heartbeats and notifications."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from threading import Condition, Timer

from pipros.basics.interruptible_wait import wait_in_slices
from pipros_libraries.bonds.life import BondEvent, BondState, Life

TIMEOUTS: Mapping[BondState, BondEvent] = {
    BondState.WAITING: BondEvent.CONNECT_TIMEOUT,
    BondState.ALIVE: BondEvent.HEARTBEAT_TIMEOUT,
    BondState.ENDING: BondEvent.DISCONNECT_TIMEOUT,
}
"""The timeout that runs in each state. In DEAD, no timeout runs."""


class RestartableTimer:
    """Timer that calls a function once, in a separate thread, a given time after `restart`."""

    def __init__(self) -> None:
        self._timer: Timer | None = None

    def restart(self, duration_s: float, call: Callable[[], object]) -> None:
        """Start the timer from the beginning, even if it is running."""
        self.cancel()
        self._timer = Timer(duration_s, call)
        self._timer.daemon = True
        self._timer.start()

    def cancel(self) -> None:
        """Stop the timer without calling the function."""
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None


@dataclass(eq=False)
class BondSide:
    """One side of a bond. All methods may be called from any thread.

    Args:
        durations_s: length of each timeout. A change takes effect when the timeout is next started.
        send: publishes a status message; called with True if this side is alive.
        notify: called with ALIVE when the bond is formed, and with DEAD when this side is dead, even if no
            bond was formed. No lock is held.
        enter: called with each new state while the lock is held.
        ignores_silence: function that returns whether to ignore a heartbeat timeout. May block.
        is_over: function that returns whether `publish_heartbeats` and `wait` must return.

    Attributes:
        sister_id: ID of the other side; None until its first message arrives.
        sister_ended_first: whether the other side ended before this side.
    """

    durations_s: dict[BondEvent, float]
    send: Callable[[bool], object]
    notify: Callable[[BondState], object]
    enter: Callable[[BondState], object]
    ignores_silence: Callable[[], bool]
    is_over: Callable[[], bool]
    sister_id: str | None = field(default=None, init=False)
    sister_ended_first: bool = field(default=False, init=False)
    _life: Life = field(default_factory=Life, init=False)
    _timer: RestartableTimer = field(default_factory=RestartableTimer, init=False)
    # reentrant, because callbacks may call other methods
    _changed: Condition = field(default_factory=Condition, init=False)
    _pending: list[BondState] = field(default_factory=list, init=False)

    @property
    def state(self) -> BondState:
        return self._life.state

    def start_timeout(self) -> None:
        """Start the timeout of the current state from the beginning."""
        with self._changed:
            event = TIMEOUTS.get(self.state)
            if event is None:
                self._timer.cancel()
            else:
                self._timer.restart(self.durations_s[event], lambda: self._expire(event))

    def _expire(self, event: BondEvent) -> None:
        if event is BondEvent.HEARTBEAT_TIMEOUT and self.ignores_silence():
            self.start_timeout()
        else:
            self.handle(event)

    def receive(self, instance_id: str, is_alive: bool) -> bool:
        """Handle a message from another instance. The first sender becomes the sister.

        Return False, and ignore the message, if its sender is not the sister.
        """
        with self._changed:
            self.sister_id = instance_id if self.sister_id is None else self.sister_id
        if instance_id != self.sister_id:
            return False
        self.handle(BondEvent.SISTER_ALIVE if is_alive else BondEvent.SISTER_ENDS)
        if is_alive and self.state is BondState.DEAD:
            self.publish()  # the sister missed the message that announced the end of this side
        return True

    def handle(self, event: BondEvent) -> None:
        """Handle an event. Call `enter` and `notify` for the changes that it causes."""
        with self._changed:
            before, was_formed = self._life.state, self._life.was_formed
            state = self._life.take(event)
            if event is BondEvent.SISTER_ENDS and before in (BondState.WAITING, BondState.ALIVE):
                self.sister_ended_first = True
            if self._life.was_formed and not was_formed:
                self._pending.append(BondState.ALIVE)
            if state is not before:
                self.enter(state)
                self.start_timeout()
                if state is BondState.DEAD:
                    self._pending.append(BondState.DEAD)
                self._changed.notify_all()
            elif event is BondEvent.SISTER_ALIVE and state is BondState.ALIVE:
                self.start_timeout()
        if state is BondState.ENDING and before is not BondState.ENDING:
            self.publish()
        with self._changed:
            pending, self._pending = self._pending, []
        for change in pending:
            self.notify(change)

    def publish(self) -> None:
        """Publish the status of this side."""
        self.send(self.state in (BondState.WAITING, BondState.ALIVE))

    def publish_heartbeats(self, period_s: float, ending_period_s: float) -> None:
        """Publish the status until the state is DEAD or `is_over` returns True, and then once more."""
        while (state := self.state) is not BondState.DEAD and not self.is_over():
            self.publish()
            with self._changed:
                if self.state is state and not self.is_over():
                    self._changed.wait(ending_period_s if state is BondState.ENDING else period_s)
        self.publish()

    def wait(self, is_reached: Callable[[BondState], bool], timeout_s: float | None) -> bool:
        """Wait until `is_reached` accepts the state. Return whether it does.

        Stop waiting at the timeout (None for no limit), or when `is_over` returns True.
        """

        def is_ended() -> bool:
            return is_reached(self.state) or self.is_over()

        with self._changed:
            wait_in_slices(partial(self._changed.wait_for, is_ended), timeout_s)
            return is_reached(self.state)

    def wake(self) -> None:
        """Make the heartbeat loop and all waiting callers check `is_over` immediately."""
        with self._changed:
            self._changed.notify_all()
