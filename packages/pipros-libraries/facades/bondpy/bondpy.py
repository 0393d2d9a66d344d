"""`Bond`, one side of a bond between two processes."""

from __future__ import annotations

import threading
import uuid
from collections.abc import Callable
from typing import Any

import rospy
from bondpy.machine import BondMachine
from pipros.basics.lazy_names import star_names as _star_names
from pipros.basics.printable import printable
from pipros.msg import load_message_class
from pipros_libraries.bonds.life import BondEvent, BondState
from pipros_libraries.bonds.side import BondSide, RestartableTimer

_star_names(__name__, "time")

Constants: Any = load_message_class("bond/Constants")
Status: Any = load_message_class("bond/Status")

Seconds = Any  # accepts a rospy.Duration or a number of seconds


def as_ros_duration(d: Seconds) -> rospy.Duration:
    """Convert a number of seconds to a `rospy.Duration`; a duration is returned unchanged."""
    return d if isinstance(d, rospy.Duration) else rospy.Duration.from_sec(d)


def as_float_duration(d: Seconds) -> float:
    """Convert a `rospy.Duration` or a number to seconds."""
    return d.to_sec() if isinstance(d, rospy.Duration) else float(d)


class Timeout(RestartableTimer):
    """Timer that calls a function once, `duration` after the last `reset`, in its own thread."""

    def __init__(self, duration: Seconds, on_timeout: Callable[[], object] | None = None) -> None:
        super().__init__()
        self.duration = as_ros_duration(duration)
        self.on_timeout = on_timeout

    def reset(self) -> Timeout:
        """Start or restart the timer. Return self."""
        self.restart(self.duration.to_sec(), self.on_timeout or (lambda: None))
        return self


Getter = Callable[["Bond"], float]
Setter = Callable[["Bond", Seconds], None]


def _accessors(event: BondEvent, meaning: str) -> tuple[Getter, Setter, property]:
    """Return the getter and the setter for a timeout, and a property that combines them."""

    def get(self: Bond) -> float:
        return self._side.durations_s[event]

    def set_(self: Bond, dur: Seconds) -> None:
        if self._started:
            raise AssertionError("timeouts can only be set before start()")
        self._side.durations_s[event] = as_float_duration(dur)

    get.__doc__ = f"Return the {meaning}, in seconds."
    set_.__doc__ = f"Set the {meaning}. Raises AssertionError after `start`."
    return get, set_, property(get, set_)


class Bond:
    """One side of a bond between two processes with the same topic and ID.

    On each side, the first message from the other side forms the bond. The bond is broken when one side
    breaks the bond or stops publishing, or if no message arrives within `connect_timeout`.

    Callbacks are called without arguments, in a thread of the bond, of its subscriber or of the caller of
    `break_bond`, and may call any method. All methods may be called from any thread.

    Attributes:
        topic, id: the constructor's arguments.
        instance_id: ID of this side.
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
        self.on_broken = on_broken
        self.on_formed = on_formed
        self.is_shutdown = False
        self.sm = BondMachine()
        self._side = BondSide(
            {
                BondEvent.CONNECT_TIMEOUT: float(Constants.DEFAULT_CONNECT_TIMEOUT),
                BondEvent.HEARTBEAT_TIMEOUT: float(Constants.DEFAULT_HEARTBEAT_TIMEOUT),
                BondEvent.DISCONNECT_TIMEOUT: float(Constants.DEFAULT_DISCONNECT_TIMEOUT),
            },
            send=self._publish_status,
            notify=self._call_back,
            enter=self.sm.enter,
            ignores_silence=_timeouts_are_off,
            is_over=rospy.is_shutdown,
        )
        self._lock = threading.Lock()
        self._started = False
        self._heartbeat_period = float(Constants.DEFAULT_HEARTBEAT_PERIOD)
        self._publisher: Any = None
        self._subscriber: Any = None

    @property
    def sister_instance_id(self) -> str | None:
        """ID of the other side; None until its first message arrives."""
        return self._side.sister_id

    @property
    def sister_died_first(self) -> bool:
        """Whether the other side broke the bond before this side did."""
        return self._side.sister_ended_first

    # -- settings ----------------------------------------------------------------

    get_connect_timeout, set_connect_timeout, connect_timeout = _accessors(
        BondEvent.CONNECT_TIMEOUT, "maximum time to wait for the other side"
    )
    get_heartbeat_timeout, set_heartbeat_timeout, heartbeat_timeout = _accessors(
        BondEvent.HEARTBEAT_TIMEOUT, "maximum time between messages from the other side"
    )
    get_disconnect_timeout, set_disconnect_timeout, disconnect_timeout = _accessors(
        BondEvent.DISCONNECT_TIMEOUT,
        "maximum time to wait for the other side to confirm that the bond is broken",
    )

    def get_heartbeat_period(self) -> float:
        """Return the period of this side's messages, in seconds."""
        return self._heartbeat_period

    def set_heartbeat_period(self, per: Seconds) -> None:
        """Set the period of this side's messages, in seconds or as a `rospy.Duration`.

        Raises:
            AssertionError: the bond was started.
            ValueError: the period is not > 0.
        """
        if self._started:
            raise AssertionError("the heartbeat period can only be set before start()")
        seconds = as_float_duration(per)
        if not seconds > 0:
            raise ValueError(f"the heartbeat period must be > 0 s, got {seconds}")
        self._heartbeat_period = seconds

    heartbeat_period = property(get_heartbeat_period, set_heartbeat_period)

    def set_formed_callback(self, on_formed: Callable[[], object] | None) -> None:
        """Set the function to call when the bond is formed."""
        self.on_formed = on_formed

    def set_broken_callback(self, on_broken: Callable[[], object] | None) -> None:
        """Set the function to call when the bond is broken, whether or not it was ever formed."""
        self.on_broken = on_broken

    # -- lifecycle ---------------------------------------------------------------

    def start(self) -> None:
        """Start publishing and waiting for the other side. Does not block. Further calls have no effect."""
        with self._lock:
            if self._started:
                return
            self._started = True
        self._side.start_timeout()
        self._publisher = rospy.Publisher(self.topic, Status, queue_size=10)
        self._subscriber = rospy.Subscriber(self.topic, Status, self._on_status)
        threading.Thread(target=self._publish_heartbeats, name=f"bond {self.id}", daemon=True).start()
        rospy.on_shutdown(self._side.wake)

    def break_bond(self) -> None:
        """Break the bond.

        Does not block. A formed bond is broken once the other side confirms this or `disconnect_timeout`
        expires; until then, inactive statuses are published. A bond that is not formed is broken immediately.
        Do nothing if the bond is already broken.
        """
        self._side.handle(BondEvent.BREAK)

    def shutdown(self) -> None:
        """Break the bond, then unregister from its topic. Does not block, and may be called repeatedly."""
        with self._lock:
            if self.is_shutdown:
                return
            self.is_shutdown = True
        self.break_bond()
        if self.is_broken():
            self._unregister()

    def _unregister(self) -> None:
        with self._lock:
            handles = self._subscriber, self._publisher
            self._publisher = self._subscriber = None
        for handle in handles:
            if handle is not None:
                handle.unregister()

    def is_broken(self) -> bool:
        """Return True if the bond is broken. A bond can break before it is formed."""
        return self._side.state is BondState.DEAD

    def wait_until_formed(self, timeout: Seconds | None = None) -> bool:
        """Wait until the bond is formed or broken. If `timeout` is None, wait indefinitely.

        Return False if the timeout expires or the node is shut down first.
        """
        return self._wait(lambda state: state is not BondState.WAITING, timeout)

    def wait_until_broken(self, timeout: Seconds | None = None) -> bool:
        """Wait until the bond is broken. If `timeout` is None, wait indefinitely.

        Return False if the timeout expires or the node is shut down first.
        """
        return self._wait(lambda state: state is BondState.DEAD, timeout)

    def _wait(self, is_reached: Callable[[BondState], bool], timeout: Seconds | None) -> bool:
        return self._side.wait(is_reached, None if timeout is None else as_float_duration(timeout))

    def __repr__(self) -> str:
        return f"[Bond {self.id}, Instance {self.instance_id} ({self._side.state.value})]"

    def _on_status(self, message: Any) -> None:
        if message.id != self.id or message.instance_id == self.instance_id:
            return
        if not self._side.receive(message.instance_id, bool(message.active)):
            rospy.logerr_once(
                f"a third process uses the bond {printable(self.id)} on {self.topic}: a bond has two sides, "
                "use a different ID for each pair of processes"
            )

    def _call_back(self, state: BondState) -> None:
        call = self.on_formed if state is BondState.ALIVE else self.on_broken
        try:
            if call:
                call()
        except Exception as error:
            rospy.logerr(f"callback of bond {printable(self.id)} raised {error!r}")

    def _publish_heartbeats(self) -> None:
        self._side.publish_heartbeats(self._heartbeat_period, float(Constants.DEAD_PUBLISH_PERIOD))
        if self.is_shutdown:
            self._unregister()

    def _publish_status(self, active: bool) -> None:
        publisher = self._publisher
        if publisher is None or rospy.is_shutdown():
            return
        status = Status(
            id=self.id,
            instance_id=self.instance_id,
            active=active,
            heartbeat_timeout=self.heartbeat_timeout,
            heartbeat_period=self.heartbeat_period,
        )
        status.header.stamp = rospy.Time.now()
        try:
            publisher.publish(status)
        except rospy.ROSException:  # the node was shut down in the meantime
            return


def _timeouts_are_off() -> bool:
    try:
        return bool(rospy.get_param(Constants.DISABLE_HEARTBEAT_TIMEOUT_PARAM, False))
    except (OSError, rospy.ROSException):  # the master cannot be reached
        return False
