"""`Bond`, one side of a bond between two processes."""

from __future__ import annotations

import functools
import threading
import uuid
from collections.abc import Callable
from typing import Any

import rospy
from bondpy.machine import BondMachine
from pipros.basics.lazy_names import star_names as _star_names
from pipros.basics.printable import printable
from pipros.libraries.bonds.life import Event, Life, State
from pipros.msg import load_message_class

_star_names(__name__, "time")

Constants: Any = load_message_class("bond/Constants")
Status: Any = load_message_class("bond/Status")

Seconds = Any  # a rospy.Duration, or a number of seconds

_EVENT_OF = {True: Event.SISTER_ALIVE, False: Event.SISTER_ENDS}


def as_ros_duration(d: Seconds) -> rospy.Duration:
    """Convert a number of seconds to a `rospy.Duration`; a duration is returned unchanged."""
    return d if isinstance(d, rospy.Duration) else rospy.Duration.from_sec(d)


def as_float_duration(d: Seconds) -> float:
    """Convert a `rospy.Duration` or a number to seconds."""
    return d.to_sec() if isinstance(d, rospy.Duration) else float(d)


class Timeout:
    """Timer that calls a function once, `duration` after the last `reset`, in a thread of its own."""

    def __init__(self, duration: Seconds, on_timeout: Callable[[], object] | None = None) -> None:
        self.duration = as_ros_duration(duration)
        self.on_timeout = on_timeout
        self._timer: threading.Timer | None = None

    def reset(self) -> Timeout:
        """Start or restart the timer. Return self."""
        self.cancel()
        self._timer = threading.Timer(self.duration.to_sec(), self.on_timeout or (lambda: None))
        self._timer.daemon = True
        self._timer.start()
        return self

    def cancel(self) -> None:
        """Stop the timer without calling the function."""
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None


class Bond:
    """One side of a bond between two processes with the same topic and ID.

    The bond is formed when the sides have received a message from each other, and broken when one side breaks
    it or stops publishing. Callbacks are called without arguments in a thread of the bond or of its
    subscriber, and may call any method. All methods may be called from any thread.

    Attributes:
        topic, id: the arguments.
        instance_id: ID of this side; `sister_instance_id` is the other side's instance id, None before its
            first message.
        sm: the state machine; `sm.getState().getName()` is the name of the state.
    """

    def __init__(
        self,
        topic: str,
        id: str,  # noqa: A002  # Noetic's name for it
        on_broken: Callable[[], object] | None = None,
        on_formed: Callable[[], object] | None = None,
    ) -> None:
        """Set up the bond. Nothing is published until `start`."""
        self.topic = topic
        self.id = id
        self.instance_id = str(uuid.uuid4())
        self.sister_instance_id: str | None = None
        self.on_broken = on_broken
        self.on_formed = on_formed
        self.is_shutdown = False
        self.sister_died_first = False
        self.sm = BondMachine()
        self._life = Life()
        self._condition = threading.Condition(threading.RLock())
        self._started = False
        self._timeouts = {
            Event.CONNECT_TIMEOUT: Timeout(Constants.DEFAULT_CONNECT_TIMEOUT),
            Event.HEARTBEAT_TIMEOUT: Timeout(Constants.DEFAULT_HEARTBEAT_TIMEOUT),
            Event.DISCONNECT_TIMEOUT: Timeout(Constants.DEFAULT_DISCONNECT_TIMEOUT),
        }
        for event, timeout in self._timeouts.items():
            timeout.on_timeout = functools.partial(self._handle, event)
        self._heartbeat_period = float(Constants.DEFAULT_HEARTBEAT_PERIOD)
        self._pending: list[Callable[[], object]] = []
        self._publisher: Any = None
        self._subscriber: Any = None

    # -- settings ----------------------------------------------------------------

    def _set(self, event: Event, duration: Seconds) -> None:
        if self._started:
            raise AssertionError("timeouts can only be set before start()")
        self._timeouts[event].duration = as_ros_duration(duration)

    def _seconds(self, event: Event) -> float:
        return self._timeouts[event].duration.to_sec()

    def get_connect_timeout(self) -> float:
        """Return the maximum time to wait for the other side, in seconds."""
        return self._seconds(Event.CONNECT_TIMEOUT)

    def set_connect_timeout(self, dur: Seconds) -> None:
        """Set the timeout. Raises AssertionError after `start`."""
        self._set(Event.CONNECT_TIMEOUT, dur)

    connect_timeout = property(get_connect_timeout, set_connect_timeout)

    def get_heartbeat_timeout(self) -> float:
        """Return the maximum time between messages of the other side, in seconds."""
        return self._seconds(Event.HEARTBEAT_TIMEOUT)

    def set_heartbeat_timeout(self, dur: Seconds) -> None:
        """Set the timeout. Raises AssertionError after `start`."""
        self._set(Event.HEARTBEAT_TIMEOUT, dur)

    heartbeat_timeout = property(get_heartbeat_timeout, set_heartbeat_timeout)

    def get_disconnect_timeout(self) -> float:
        """Return the maximum time to wait until the other side confirms the end, in seconds."""
        return self._seconds(Event.DISCONNECT_TIMEOUT)

    def set_disconnect_timeout(self, dur: Seconds) -> None:
        """Set the timeout. Raises AssertionError after `start`."""
        self._set(Event.DISCONNECT_TIMEOUT, dur)

    disconnect_timeout = property(get_disconnect_timeout, set_disconnect_timeout)

    def get_heartbeat_period(self) -> float:
        """Return the period of this side's messages, in seconds."""
        return self._heartbeat_period

    def set_heartbeat_period(self, per: Seconds) -> None:
        """Set the period. Raises AssertionError after `start`, and ValueError unless the period is > 0."""
        if self._started:
            raise AssertionError("the heartbeat period can only be set before start()")
        seconds = as_float_duration(per)
        if not seconds > 0:
            raise ValueError(f"the heartbeat period must be > 0 s, got {seconds}")
        self._heartbeat_period = seconds

    heartbeat_period = property(get_heartbeat_period, set_heartbeat_period)

    def set_formed_callback(self, on_formed: Callable[[], object] | None) -> None:
        """Set the function to call when the bond is formed."""
        with self._condition:
            self.on_formed = on_formed

    def set_broken_callback(self, on_broken: Callable[[], object] | None) -> None:
        """Set the function to call when the bond is broken, whether it was formed or not."""
        with self._condition:
            self.on_broken = on_broken

    # -- life --------------------------------------------------------------------

    def start(self) -> None:
        """Start publishing and waiting for the other side. Does not block; does nothing if repeated."""
        with self._condition:
            if self._started:
                return
            self._started = True
            if self._life.state is State.WAITING:
                self._timeouts[Event.CONNECT_TIMEOUT].reset()
            self._publisher = rospy.Publisher(self.topic, Status, queue_size=10)
            self._subscriber = rospy.Subscriber(self.topic, Status, self._on_status)
        threading.Thread(target=self._publish_heartbeats, name=f"bond {self.id}", daemon=True).start()
        rospy.on_shutdown(self._on_node_shutdown)

    def break_bond(self) -> None:
        """Break the bond: publish its end until the other side confirms it or `disconnect_timeout` expires.

        Does not block. Does nothing if the bond is already broken.
        """
        self._handle(Event.BREAK)

    def shutdown(self) -> None:
        """Break the bond and unregister from its topic afterwards. Does not block; may be repeated."""
        with self._condition:
            if self.is_shutdown:
                return
            self.is_shutdown = True
        self.break_bond()
        if self.is_broken():
            self._unregister()

    def _unregister(self) -> None:
        with self._condition:
            handles = self._subscriber, self._publisher
            self._publisher = self._subscriber = None
        for handle in handles:
            if handle is not None:
                handle.unregister()

    def _on_node_shutdown(self) -> None:
        with self._condition:
            self._condition.notify_all()

    def is_broken(self) -> bool:
        """Return whether the bond is broken, including one that was never formed."""
        with self._condition:
            return self._life.state is State.DEAD

    def wait_until_formed(self, timeout: Seconds | None = None) -> bool:
        """Wait until the bond is formed or broken, without limit if `timeout` is None.

        Return False if the timeout expires or the node is shut down first.
        """
        return self._wait(lambda: self._life.state is not State.WAITING, timeout)

    def wait_until_broken(self, timeout: Seconds | None = None) -> bool:
        """Wait until the bond is broken, without limit if `timeout` is None.

        Return False if the timeout expires or the node is shut down first.
        """
        return self._wait(lambda: self._life.state is State.DEAD, timeout)

    def _wait(self, is_over: Callable[[], bool], timeout: Seconds | None) -> bool:
        seconds = None if timeout is None else as_float_duration(timeout)
        with self._condition:
            self._condition.wait_for(lambda: is_over() or rospy.is_shutdown(), seconds)
            return is_over()

    def __repr__(self) -> str:
        return f"[Bond {self.id}, Instance {self.instance_id} ({self._life.state.value})]"

    # -- the other side ----------------------------------------------------------

    def _on_status(self, message: Any) -> None:
        if message.id != self.id or message.instance_id == self.instance_id:
            return
        with self._condition:
            if self.sister_instance_id is None:
                self.sister_instance_id = message.instance_id
        if message.instance_id != self.sister_instance_id:
            rospy.logerr_once(
                f"a third process uses the bond {printable(self.id)} on {self.topic}: a bond has two sides, "
                "use a different ID for each pair of processes"
            )
            return
        self._handle(_EVENT_OF[bool(message.active)])
        if message.active and self._life.state is State.DEAD:
            self._publish_status()  # the other side has missed the end

    def _handle(self, event: Event) -> None:
        if event is Event.HEARTBEAT_TIMEOUT and _timeouts_are_off():
            self._timeouts[event].reset()
            return
        with self._condition:
            before, was_formed = self._life.state, self._life.was_formed
            state = self._life.take(event)
            if event is Event.SISTER_ALIVE and state is State.ALIVE:
                self._timeouts[Event.HEARTBEAT_TIMEOUT].reset()
            if event is Event.SISTER_ENDS and before in (State.WAITING, State.ALIVE):
                self.sister_died_first = True
            if self._life.was_formed and not was_formed:
                self._pending.append(lambda: self.on_formed and self.on_formed())
            if state is not before:
                self._enter_state(state)
        if state is State.ENDING and before is not State.ENDING:
            self._publish_status()
        self._call_pending()

    def _enter_state(self, state: State) -> None:
        self.sm.enter(state.value)
        self._timeouts[Event.CONNECT_TIMEOUT].cancel()
        if state in (State.ENDING, State.DEAD):
            self._timeouts[Event.HEARTBEAT_TIMEOUT].cancel()
        if state is State.ENDING:
            self._timeouts[Event.DISCONNECT_TIMEOUT].reset()
        if state is State.DEAD:
            self._timeouts[Event.DISCONNECT_TIMEOUT].cancel()
            self._pending.append(lambda: self.on_broken and self.on_broken())
        self._condition.notify_all()

    def _call_pending(self) -> None:
        """Call the pending callbacks without holding the lock, so that they may block and use the bond."""
        with self._condition:
            pending, self._pending = self._pending, []
        for call in pending:
            try:
                call()
            except Exception as error:
                rospy.logerr(f"callback of bond {printable(self.id)} raised {error!r}")

    def _publish_heartbeats(self) -> None:
        """Publish the state of this side periodically until the bond is broken, then once more."""
        while (state := self._life.state) is not State.DEAD and not rospy.is_shutdown():
            self._publish_status()
            pause_s = Constants.DEAD_PUBLISH_PERIOD if state is State.ENDING else self._heartbeat_period
            with self._condition:
                if self._life.state is state and not rospy.is_shutdown():
                    self._condition.wait(pause_s)
        self._publish_status()
        if self.is_shutdown:
            self._unregister()

    def _publish_status(self) -> None:
        with self._condition:
            publisher, state = self._publisher, self._life.state
        if publisher is None or rospy.is_shutdown():
            return
        status = Status(
            id=self.id,
            instance_id=self.instance_id,
            active=state in (State.WAITING, State.ALIVE),
            heartbeat_timeout=self.heartbeat_timeout,
            heartbeat_period=self.heartbeat_period,
        )
        status.header.stamp = rospy.Time.now()
        try:
            publisher.publish(status)
        except rospy.ROSException:  # the node was shut down meanwhile
            return


def _timeouts_are_off() -> bool:
    try:
        return bool(rospy.get_param(Constants.DISABLE_HEARTBEAT_TIMEOUT_PARAM, False))
    except (OSError, rospy.ROSException):  # the master cannot be reached
        return False
