"""`hztest`: checks that messages arrive at a given rate, or that none arrive.

Private parameters: `topic`, `hz` (0 means that no message may arrive), `hzerror` (required unless `hz` is
0), `test_duration` in seconds, `wait_time` (20 s) for the first message, `check_intervals` (whether each
interval must also match the rate), and `wall_clock` (whether to use wall time even if time is simulated).
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

from pipros.msg.time import NS_PER_S
from pipros.node import Node
from pipros.node.any_msg import AnyMsg
from pipros.node.clock import WallClock
from pipros_tools.testing.nodes.run_checks import number, parameter, poll, run_checks

# unittest's reports omit the frames of modules that define this variable.
__unittest = True


@dataclass(frozen=True, slots=True)
class AllowedRate:
    """The expected rate and its tolerance, in hertz. A rate of 0 means that no messages are expected."""

    hz: float
    error: float

    def check(self, arrivals_ns: list[int], *, check_intervals: bool) -> None:
        """Check arrival times against the allowed rate.

        Raises:
            AssertionError: the rate is too low, too high or too irregular, or messages arrived although none
                were expected.
        """
        if not self.hz:
            if arrivals_ns:
                raise AssertionError(f"expected no messages, received {len(arrivals_ns)}")
            return
        if len(arrivals_ns) < 2:
            raise AssertionError("only one message received" if arrivals_ns else "no messages received")
        span_s = (arrivals_ns[-1] - arrivals_ns[0]) / NS_PER_S
        rate = (len(arrivals_ns) - 1) / span_s if span_s else float("inf")
        lowest, highest = self.hz - self.error, self.hz + self.error
        if not lowest <= rate <= highest:
            raise AssertionError(
                f"average rate {rate:.3f}Hz is not between {lowest:.3f}Hz and {highest:.3f}Hz"
            )
        if check_intervals:
            self._check_gaps(arrivals_ns, lowest, highest)

    @staticmethod
    def _check_gaps(arrivals_ns: list[int], lowest: float, highest: float) -> None:
        for earlier, later in itertools.pairwise(arrivals_ns):
            gap_s = (later - earlier) / NS_PER_S
            if gap_s < 1 / highest or (lowest > 0 and gap_s > 1 / lowest):
                raise AssertionError(
                    f"an interval of {gap_s:.3f}s does not match {lowest:.3f}Hz to {highest:.3f}Hz"
                )


def _measures_in_time_of_node(node: Node) -> bool:
    return not parameter(node, "~wall_clock", False)


def check(node: Node) -> None:
    """Raise AssertionError if the rate is not as expected."""
    topic = parameter(node, "~topic")
    hz = number(node, "~hz")
    rate = AllowedRate(hz, number(node, "~hzerror") if hz else 0.0)
    duration, wait = number(node, "~test_duration"), number(node, "~wait_time", 20)
    if rate.hz < 0 or rate.error < 0 or duration <= 0 or not topic:
        raise AssertionError(
            f"bad parameters: hz {rate.hz:g} and hzerror {rate.error:g} must not be negative, "
            f"test_duration {duration:g} must be positive, and topic [{topic}] must not be empty"
        )
    clock = node.clock if _measures_in_time_of_node(node) else WallClock()
    arrivals_ns: list[int] = []

    def arrive(_: AnyMsg) -> None:
        now_ns = clock.now_ns()
        if arrivals_ns and now_ns < arrivals_ns[0]:
            arrivals_ns.clear()  # simulated time was reset
        arrivals_ns.append(now_ns)

    node.subscribe(topic, AnyMsg, arrive)
    # Wait even if no message is expected, because the publisher may still be starting.
    if not any(arrivals_ns for _ in poll(node, wait)) and rate.hz:
        raise AssertionError("no messages before timeout")
    if rate.hz or not arrivals_ns:
        for _ in poll(node, duration, clock):
            if arrivals_ns and not rate.hz:
                break
    rate.check(list(arrivals_ns), check_intervals=bool(parameter(node, "~check_intervals", False)))


def main() -> None:
    run_checks("hztest", "HzTest", needs_time=_measures_in_time_of_node, hz=check)
