"""Publish velocities so that a base never keeps one that no program stands behind.

`VelocityRule` decides, from times that the caller provides; `VelocityOutput` connects it to a node. Every
program of pipros that commands velocities publishes them with a `VelocityOutput`.
"""

from __future__ import annotations

import contextlib
import math
import re
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any, Final, Protocol

from pipros.basics.errors import PiprosError
from pipros.msg import load_message_class
from pipros.msg.time import NS_PER_S
from pipros.node import Node
from pipros.node.clock import Clock, SimulatedClock, WallClock, stamp
from pipros.node.publisher import Publisher
from pipros.node.rate import Timer
from pipros.node.signals import rest_while_suspended
from pipros.node.subscriber import Subscriber
from pipros_libraries.nodes.params import InvalidParameter, is_number, raw, read_parameters
from pipros_libraries.nodes.wiring import advertise

SILENCE_S: Final = 0.5
"""Time after which a person, a browser or a policy that sends nothing no longer steers."""

CHECK_S: Final = 0.1
"""Interval at which outputs check for silence."""

RATES_HZ: Final = (0.5, 1000.0)
"""Lowest and highest rate of commands."""

BRAKING_S: Final = 60.0
"""Longest time in which a robot must be able to stop from its greatest velocity."""


VELOCITIES: Final = (
    "geometry_msgs/Twist",
    "geometry_msgs/TwistStamped",
    "ackermann_msgs/AckermannDrive",
    "ackermann_msgs/AckermannDriveStamped",
)
"""Types of messages that command a base."""


def speeds(message: Any) -> Iterator[float]:
    """Return the numbers of a Twist, an AckermannDrive, or a message with a header and one of them."""
    for name in message.__slots__:
        if name != "header":
            value = getattr(message, name)
            yield from (value,) if isinstance(value, int | float) else speeds(value)


def checked_rate(name: str, rate_hz: float) -> float:
    """Return a rate of commands in Hz.

    Raises:
        InvalidParameter: the rate is outside `RATES_HZ`, or not finite.
    """
    if not RATES_HZ[0] <= rate_hz <= RATES_HZ[1]:
        least, most = RATES_HZ
        raise InvalidParameter(f"{name} must be a rate from {least:g} to {most:g} Hz, got {rate_hz:g}")
    return rate_hz


_MAGNITUDES: Final = re.compile("acc|decel|speed_lim|max_vel")
_LIMITS: Final = re.compile(r"acc|decel|speed_lim|(max|min)\w{0,80}_vel|escape_vel")


class Bounded(Protocol):
    """A setting with a name and a lower bound."""

    @property
    def name(self) -> str: ...

    @property
    def low(self) -> float | None: ...


Limit = tuple[str, float]
"""A parameter's name and value."""


def checked_number(node: Node, name: str, default: float, least: float = 0.0) -> float:
    """Return a private parameter that bounds velocities or silences.

    Raises:
        InvalidParameter: the value is no number, below `least`, or not finite.
    """
    value = raw(node, name, default)
    if not is_number(value):
        raise InvalidParameter(f"~{name} must be a number, got {value!r}")
    if not least <= value < math.inf:
        bound = f" >= {least:g}" if math.isfinite(least) else ""
        raise InvalidParameter(f"~{name} must be a finite number{bound}, got {value:g}")
    return float(value)


def check_settings(node: Node, namespace: str, settings: Iterable[Bounded]) -> None:
    """Check the parameters of settings before they are clamped.

    Args:
        namespace: the namespace of the settings, such as `~` or `~planner`.

    Raises:
        InvalidParameter: a value is not finite, a magnitude is negative, or a limit is not a number.
    """
    given, prefix = read_parameters(node, namespace).values, namespace.rstrip("/")
    for setting in settings:
        value = given.get(setting.name)
        place = f"{prefix}{setting.name}" if prefix == "~" else f"{prefix}/{setting.name}"
        if not is_number(value):
            if value is not None and _LIMITS.search(setting.name):
                raise InvalidParameter(f"{place} must be a number, got {value!r}")
            continue
        is_magnitude = setting.low == 0 and bool(_MAGNITUDES.search(setting.name))
        if not math.isfinite(value) or (is_magnitude and value < 0):
            bound = " >= 0" if math.isfinite(value) else ""
            raise InvalidParameter(f"{place} must be a finite number{bound}, got {value:g}")


def check_axis(least: Limit, greatest: Limit, acceleration: Limit | None = None) -> None:
    """Check the limits of one axis. A negative least velocity means backwards.

    Raises:
        InvalidParameter: a limit is not finite, the greatest velocity is below the least, or the robot could
            not brake within `BRAKING_S`. An axis that is switched off, with 0 as the greatest velocity, needs
            no acceleration.
    """
    for name, value in (least, greatest, *([acceleration] if acceleration else [])):
        if not math.isfinite(value):
            raise InvalidParameter(f"{name} must be a finite number, got {value:g}")
    if greatest[1] < least[1]:
        raise InvalidParameter(f"{greatest[0]} must be >= {least[0]} ({least[1]:g}), got {greatest[1]:g}")
    fastest = max(abs(greatest[1]), abs(least[1])) if greatest[1] else 0.0
    if acceleration and fastest and acceleration[1] < fastest / BRAKING_S:
        bound = f"at least {fastest / BRAKING_S:.3g}" if acceleration[1] > 0 else "> 0"
        raise InvalidParameter(
            f"{acceleration[0]} must be {bound}, got {acceleration[1]:g}: the robot could not brake"
        )


class VelocityRule:
    """Whether a base may keep the last velocity. Reads no clock.

    Attributes:
        is_moving: whether the last velocity was not zero.
        silence_s: how long after the last velocity the base is stopped.
    """

    def __init__(self, silence_s: float = math.inf) -> None:
        """Create the rule for a base at rest."""
        self.is_moving = False
        self.silence_s = silence_s
        self._sent_s = -math.inf

    def allows(self, message: Any, now_s: float) -> bool:
        """Record a velocity. Return False if it has a number that is not finite; a zero replaces it."""
        numbers = tuple(speeds(message))
        is_finite = all(map(math.isfinite, numbers))
        self.is_moving, self._sent_s = is_finite and any(numbers), now_s
        return is_finite

    def must_stop(self, now_s: float) -> bool:
        """Return whether the velocity is too old, or time has moved back behind it."""
        return self.is_moving and not 0 <= now_s - self._sent_s < self.silence_s


class RelayedVelocity:
    """The last message of one source of a relay, whose types are known at run time only.

    `end` sends a zero velocity to subscribers if the source has gone after a velocity, as does the end of the
    node, or Ctrl-Z. Other types pass unnoticed. Not thread-safe.

    Attributes:
        publisher: sends the zero velocity. Replace it only by one of the same type.
    """

    def __init__(self, node: Node, publisher: Publisher[Any]) -> None:
        """Relay to a publisher of a node, whose message class may be raw."""
        self.publisher = publisher
        self._node = node
        self._class = publisher.publication.message_class
        self._last: Any = None
        self._is_velocity = self._class._type in VELOCITIES

    def note(self, message: Any) -> None:
        """Record a message that is published."""
        if not self._is_velocity:
            return
        if self._last is None:
            self._node.on_shutdown(self.end)
            rest_while_suspended(self)
        self._last = message

    def forget(self) -> None:
        """Leave it to others to stop the base."""
        self._last = None
        self._node.remove_shutdown_hook(self.end)

    @contextlib.contextmanager
    def suspended(self) -> Iterator[None]:
        """Stop the base before the block."""
        self.end()
        yield

    def end(self) -> None:
        """Stop the base, if the last message has not."""
        last = self._last
        self.forget()
        if last is None:
            return
        found: Any = load_message_class(self._class._type)
        try:
            message = found._from_bytes(b"".join(last._to_buffers()))
        except PiprosError:  # a base does not understand it, either
            return
        if any(speeds(message)):
            body = b"".join(found()._to_buffers())
            self.publisher.publish(self._class._from_bytes(body))


class VelocityOutput:
    """A publisher of velocities, whose last message is a zero. Thread-safe.

    A velocity that is not finite becomes zero, with one error in the log. The base is stopped if nothing is
    published for `silence_s`, when the node ends for any reason but SIGKILL, and before Ctrl-Z suspends it.
    While nobody publishes simulated time, which then stands as all timers do, `SILENCE_S` of real time count.
    """

    def __init__(
        self,
        node: Node,
        topic: str,
        kind: str = "geometry_msgs/Twist",
        *,
        silence_s: float = math.inf,
        queue_size: int = 1,
    ) -> None:
        """Advertise the topic. `kind` is a type for which `speeds` finds all numbers."""
        self._node, self._rule, self._lock = node, VelocityRule(), threading.RLock()
        self._publisher = advertise(node, topic, kind, queue_size)
        self._frame = ""
        self._has_warned = self._has_ended = False
        self._source: Subscriber[Any] | None = None
        self._real = VelocityRule(SILENCE_S)
        self._timer: Timer | None = None
        self._clock_timer = (
            self._timer_on(WallClock(), self._check_clock) if node.clock.is_simulated else None
        )
        node.on_shutdown(self._end)
        rest_while_suspended(self)
        self.silence_s = silence_s

    @property
    def is_moving(self) -> bool:
        """Whether the last velocity was not zero."""
        return self._rule.is_moving

    @property
    def connection_count(self) -> int:
        return int(self._publisher.connection_count)

    @property
    def silence_s(self) -> float:
        """How long after the last velocity the base is stopped."""
        return self._rule.silence_s

    @silence_s.setter
    def silence_s(self, silence_s: float) -> None:
        self._rule.silence_s = silence_s
        if math.isfinite(silence_s):
            self._start_checks()

    def follow(self, source: Subscriber[Any]) -> None:
        """Stop the base also if the source of its velocities has no publisher any more."""
        self._source = source
        self._start_checks()

    def message(self) -> Any:
        """Return a zero velocity."""
        return self._publisher.publication.message_class()

    def publish(self, message: Any) -> None:
        """Publish a velocity, or zero if one of its numbers is not finite. Do nothing once the node ends."""
        with self._lock:
            if self._has_ended:
                return
            self._frame = message.header.frame_id if message._has_header else ""
            self._real.allows(message, time.monotonic())
            if self._rule.allows(message, self._now_s()):
                self._publisher.publish(message)
                return
            self._publish_zero()
            if not self._has_warned:
                self._has_warned = True
                values = list(speeds(message))
                text = "[%s] must be finite numbers, got %s: the robot is stopped"
                self._node.log.error(text, self._publisher.topic, values)

    def stop(self) -> None:
        """Publish a zero velocity, unless the last one was zero."""
        with self._lock:
            if self._rule.is_moving:
                self._publish_zero()

    def hold(self) -> None:
        """Publish a zero velocity. Call it periodically to keep a base from moving."""
        self.publish(self.message())

    @contextlib.contextmanager
    def suspended(self) -> Iterator[None]:
        """Stop the base, and publish nothing during the block."""
        is_held = self._lock.acquire(timeout=CHECK_S)
        try:
            if is_held and not self._has_ended:
                self.stop()
            yield
        finally:
            if is_held:
                self._lock.release()

    def unregister(self) -> None:
        """Stop the base, and withdraw the topic."""
        self._end()
        self._node.remove_shutdown_hook(self._end)
        for timer in (self._timer, self._clock_timer):
            if timer is not None:
                timer.shutdown()
        self._publisher.unregister()

    def _end(self) -> None:
        with self._lock:
            self.stop()
            self._has_ended = True

    def _publish_zero(self) -> None:
        zero = self.message()
        self._rule.allows(zero, self._now_s())
        if zero._has_header:
            zero.header.stamp, zero.header.frame_id = stamp(self._node.clock), self._frame
        self._publisher.publish(zero)

    def _start_checks(self) -> None:
        if self._timer is None:
            self._timer = self._timer_on(self._node.clock, self._check)

    def _timer_on(self, clock: Clock, check: Callable[[], None]) -> Timer:
        return Timer(clock, round(CHECK_S * NS_PER_S), lambda _: check(), reset=True)

    def _check_clock(self) -> None:
        """Stop the base if its source is silent, and neither timers nor timeouts can tell."""
        with self._lock:
            clock = self._node.clock
            is_driven = not isinstance(clock, SimulatedClock) or clock.is_driven
            if not is_driven and self._rule.is_moving and self._real.must_stop(time.monotonic()):
                self._publish_zero()
                text = "[%s]: the robot is stopped: /use_sim_time is true, but nobody publishes /clock"
                self._node.log.error(text, self._publisher.topic)

    def _check(self) -> None:
        with self._lock:
            is_lost = self._source is not None and self._source.connection_count == 0
            if self._rule.is_moving and (is_lost or self._rule.must_stop(self._now_s())):
                self._publish_zero()

    def _now_s(self) -> float:
        return self._node.clock.now_ns() / NS_PER_S


def least_turning_radius(parameters: Mapping[str, Any]) -> float:
    """Return the least radius of a car's turns in m, or 0 if its parameters, by path, do not say."""
    names = {path.rpartition("/")[2]: value for path, value in parameters.items()}
    radius, length, angle = (
        names.get(each) for each in ("min_turning_radius", "wheelbase", "max_steering_angle")
    )
    if is_number(radius) and radius > 0:
        return float(radius)
    if not (is_number(length) and is_number(angle) and length > 0 and 0 < angle < math.pi / 2):
        return 0.0
    return float(length / math.tan(angle))
