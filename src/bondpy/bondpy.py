"""`Bond`, one side of a bond."""

from __future__ import annotations

import functools
import threading
import uuid
from collections.abc import Callable
from typing import Any

import rospy
from bondpy.machine import BondMachine
from pipros.bonds.life import Event, Life, State
from pipros.lazy_names import star_names as _star_names
from pipros.msg import load_message_class
from pipros.printable import printable

_star_names(__name__, "time")

Constants: Any = load_message_class("bond/Constants")
Status: Any = load_message_class("bond/Status")

Seconds = Any  # a rospy.Duration, or a number of seconds

_EVENT_OF = {True: Event.SISTER_ALIVE, False: Event.SISTER_ENDS}


def as_ros_duration(d: Seconds) -> rospy.Duration:
    """A duration, from one or from a number of seconds."""
    return d if isinstance(d, rospy.Duration) else rospy.Duration.from_sec(d)


def as_float_duration(d: Seconds) -> float:
    """Seconds, from them or from a duration."""
    return d.to_sec() if isinstance(d, rospy.Duration) else float(d)


class Timeout:
    """Calls a function once when the time since the last `reset` is over."""

    def __init__(self, duration: Seconds, on_timeout: Callable[[], object] | None = None) -> None:
        self.duration = as_ros_duration(duration)
        self.on_timeout = on_timeout
        self._timer: threading.Timer | None = None

    def reset(self) -> Timeout:
        """Starts the timer, or starts it again. Returns itself."""
        self.cancel()
        self._timer = threading.Timer(self.duration.to_sec(), self.on_timeout or (lambda: None))
        self._timer.daemon = True
        self._timer.start()
        return self

    def cancel(self) -> None:
        """Stops; nothing is called."""
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None


class Bond:
    """One side of a bond: two processes that give the same topic and id hold it together.

    It is formed when they have heard from each other, and broken when one of them breaks it or falls silent.
    The callbacks are called without arguments, in a thread of the bond, and may use the bond.

    Attributes:
        topic, id: as given.
        instance_id: this side; `sister_instance_id` is the other side, None before its first message.
        sm: the state machine: `sm.getState().getName()`.
    """

    def __init__(
        self,
        topic: str,
        id: str,  # noqa: A002  # Noetic's name for it
        on_broken: Callable[[], object] | None = None,
        on_formed: Callable[[], object] | None = None,
    ) -> None:
        """Nothing is sent until `start`."""
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
            timeout.on_timeout = functools.partial(self._take, event)
        self._heartbeat_period = float(Constants.DEFAULT_HEARTBEAT_PERIOD)
        self._pending: list[Callable[[], object]] = []
        self._publisher: Any = None
        self._subscriber: Any = None

    # -- settings ----------------------------------------------------------------

    def _set(self, event: Event, duration: Seconds) -> None:
        if self._started:
            raise AssertionError("the times of a bond can be set before it is started only")
        self._timeouts[event].duration = as_ros_duration(duration)

    def _seconds(self, event: Event) -> float:
        return self._timeouts[event].duration.to_sec()

    def get_connect_timeout(self) -> float:
        """How long to wait for the other side, in seconds."""
        return self._seconds(Event.CONNECT_TIMEOUT)

    def set_connect_timeout(self, dur: Seconds) -> None:
        """Raises AssertionError after `start`, as the other setters."""
        self._set(Event.CONNECT_TIMEOUT, dur)

    connect_timeout = property(get_connect_timeout, set_connect_timeout)

    def get_heartbeat_timeout(self) -> float:
        """How long the other side may be silent, in seconds."""
        return self._seconds(Event.HEARTBEAT_TIMEOUT)

    def set_heartbeat_timeout(self, dur: Seconds) -> None:
        """See `set_connect_timeout`."""
        self._set(Event.HEARTBEAT_TIMEOUT, dur)

    heartbeat_timeout = property(get_heartbeat_timeout, set_heartbeat_timeout)

    def get_disconnect_timeout(self) -> float:
        """How long to wait until the other side confirms the end, in seconds."""
        return self._seconds(Event.DISCONNECT_TIMEOUT)

    def set_disconnect_timeout(self, dur: Seconds) -> None:
        """See `set_connect_timeout`."""
        self._set(Event.DISCONNECT_TIMEOUT, dur)

    disconnect_timeout = property(get_disconnect_timeout, set_disconnect_timeout)

    def get_heartbeat_period(self) -> float:
        """How often this side says that it lives, in seconds."""
        return self._heartbeat_period

    def set_heartbeat_period(self, per: Seconds) -> None:
        """See `set_connect_timeout`. Raises ValueError for a period that is not above 0, too."""
        if self._started:
            raise AssertionError("the period of a bond can be set before it is started only")
        seconds = as_float_duration(per)
        if not seconds > 0:
            raise ValueError(f"the period of a bond must be above 0 s, got {seconds}")
        self._heartbeat_period = seconds

    heartbeat_period = property(get_heartbeat_period, set_heartbeat_period)

    def set_formed_callback(self, on_formed: Callable[[], object] | None) -> None:
        """What is called when the bond is formed."""
        with self._condition:
            self.on_formed = on_formed

    def set_broken_callback(self, on_broken: Callable[[], object] | None) -> None:
        """What is called when the bond is broken, whether it was formed or not."""
        with self._condition:
            self.on_broken = on_broken

    # -- life --------------------------------------------------------------------

    def start(self) -> None:
        """Looks for the other side from now on."""
        with self._condition:
            if self._started:
                return
            self._started = True
            if self._life.state is State.WAITING:
                self._timeouts[Event.CONNECT_TIMEOUT].reset()
            self._publisher = rospy.Publisher(self.topic, Status, queue_size=10)
            self._subscriber = rospy.Subscriber(self.topic, Status, self._on_status)
        threading.Thread(target=self._keep_telling, name=f"bond {self.id}", daemon=True).start()
        rospy.on_shutdown(self._on_node_shutdown)

    def break_bond(self) -> None:
        """Ends the bond: tells the other side until it agrees. Does nothing if it is broken."""
        self._take(Event.BREAK)

    def shutdown(self) -> None:
        """Breaks the bond, and leaves its topic when that is done. Does not wait for it; may be repeated."""
        with self._condition:
            if self.is_shutdown:
                return
            self.is_shutdown = True
        self.break_bond()
        if self.is_broken():
            self._leave()

    def _leave(self) -> None:
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
        """Whether the bond has ended; also when it was never formed."""
        with self._condition:
            return self._life.state is State.DEAD

    def wait_until_formed(self, timeout: Seconds | None = None) -> bool:
        """Waits until the bond is formed or broken. Returns False if the timeout ended the wait."""
        return self._wait(lambda: self._life.state is not State.WAITING, timeout)

    def wait_until_broken(self, timeout: Seconds | None = None) -> bool:
        """Waits until the bond is broken. Returns False if the timeout ended the wait."""
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
                f"a third process uses the bond {printable(self.id)} of {self.topic}; a bond has two sides, "
                "each pair of processes needs an id of its own"
            )
            return
        self._take(_EVENT_OF[bool(message.active)])
        if message.active and self._life.state is State.DEAD:
            self._tell()  # it has not heard the end

    def _take(self, event: Event) -> None:
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
                self._enter(state)
        if state is State.ENDING and before is not State.ENDING:
            self._tell()
        self._call_pending()

    def _enter(self, state: State) -> None:
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
        """Calls what is to be called, without the lock: callbacks may wait and use the bond."""
        with self._condition:
            pending, self._pending = self._pending, []
        for call in pending:
            try:
                call()
            except Exception as error:
                rospy.logerr(f"a callback of the bond {printable(self.id)} failed: {error!r}")

    def _keep_telling(self) -> None:
        """Says on the topic that this side lives, and at its end that it ends."""
        while (state := self._life.state) is not State.DEAD and not rospy.is_shutdown():
            self._tell()
            pause_s = Constants.DEAD_PUBLISH_PERIOD if state is State.ENDING else self._heartbeat_period
            with self._condition:
                if self._life.state is state and not rospy.is_shutdown():
                    self._condition.wait(pause_s)
        self._tell()
        if self.is_shutdown:
            self._leave()

    def _tell(self) -> None:
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
        except rospy.ROSException:  # it was shut down meanwhile
            return


def _timeouts_are_off() -> bool:
    try:
        return bool(rospy.get_param(Constants.DISABLE_HEARTBEAT_TIMEOUT_PARAM, False))
    except (OSError, rospy.ROSException):  # without a master
        return False
