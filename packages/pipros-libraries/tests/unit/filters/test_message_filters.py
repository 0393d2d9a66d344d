"""The facade message_filters, without a node."""

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from std_msgs.msg import Header, String

import message_filters
import rospy
from pipros_libraries.filters.sequencer import Sequencer
from pipros_libraries.filters.synchronizer import ApproximateSynchronizer, ExactSynchronizer


class Stamped:
    def __init__(self, stamp: int) -> None:
        self.header = Header(stamp=rospy.Time(stamp))

    def __repr__(self) -> str:
        return f"at {self.header.stamp.secs}"


@pytest.fixture(autouse=True)
def time() -> Iterator[None]:
    rospy.rostime.set_rostime_initialized(True)
    yield
    rospy.rostime.switch_to_wallclock()
    rospy.rostime.set_rostime_initialized(False)


def inputs_of(kind: str) -> tuple[list[message_filters.SimpleFilter], Any]:
    inputs = [message_filters.SimpleFilter() for _ in range(2)]
    if kind == "exact":
        return inputs, message_filters.TimeSynchronizer(inputs, 5)
    return inputs, message_filters.ApproximateTimeSynchronizer(inputs, 5, 0.5)


@pytest.mark.parametrize("kind", ["exact", "approximate"])
def test_callbacks_may_raise_and_add_messages(kind: str) -> None:
    inputs, synchronizer = inputs_of(kind)
    sets = []

    def feed_and_raise(first: Stamped, second: Stamped, more: str) -> None:
        sets.append((first.header.stamp.secs, second.header.stamp.secs, more))
        if len(sets) == 1:
            for each in inputs:
                each.signalMessage(Stamped(2))
            raise ValueError("by the callback")

    synchronizer.registerCallback(feed_and_raise, "more")
    inputs[0].signalMessage(Stamped(1))
    with pytest.raises(ValueError, match="by the callback"):
        inputs[1].signalMessage(Stamped(1))
    for each in inputs:
        each.signalMessage(Stamped(3))

    assert sets == [(1, 1, "more"), (2, 2, "more"), (3, 3, "more")]


def test_inputs_may_come_in_threads() -> None:
    inputs, synchronizer = inputs_of("exact")
    synchronizer.queue_size = 1000
    sets: list[int] = []
    synchronizer.registerCallback(lambda first, second: sets.append(first.header.stamp.secs))

    def feed(each: message_filters.SimpleFilter) -> None:
        for stamp in range(1, 301):
            each.signalMessage(Stamped(stamp))

    with ThreadPoolExecutor(2) as threads:
        list(threads.map(feed, inputs))

    assert sets == list(range(1, 301))


def test_messages_without_header_are_dropped_or_take_the_time() -> None:
    inputs = [message_filters.SimpleFilter() for _ in range(2)]
    sets: list[Any] = []
    for allowed in (False, True):
        made = message_filters.ApproximateTimeSynchronizer(inputs, 5, 10.0, allow_headerless=allowed)
        made.registerCallback(lambda *got: sets.append([message.data for message in got]))
    for each in inputs:
        each.signalMessage(String("x"))

    assert sets == [["x", "x"]]


def test_a_chain_feeds_its_filters_in_order() -> None:
    source = message_filters.SimpleFilter()
    chain = message_filters.Chain(source)
    got: list[Any] = []
    chain.registerCallback(got.append)
    second: Any = message_filters.PassThrough()
    assert (chain.addFilter(message_filters.PassThrough()), chain.addFilter(second)) == (0, 1)
    source.signalMessage("message")

    assert got == ["message"]
    assert chain.getFilter(1) is second
    assert chain.getFilter(2) is None


def test_a_sequencer_puts_messages_in_order() -> None:
    rospy.rostime._set_rostime(rospy.Time(100))
    source = message_filters.SimpleFilter()
    sequencer = message_filters.TimeSequencer(source, rospy.Duration(5), rospy.Duration(3600), 10)
    got: list[Any] = []
    sequencer.registerCallback(lambda message: got.append(message.header.stamp.secs))
    for stamp in (95, 93, 99, 94):
        source.signalMessage(Stamped(stamp))
    sequencer.dispatch()
    sequencer.shutdown()

    assert got == [93, 94, 95]


# Messages synchronized by their timestamps.


class Inputs:
    """Feeds a synchronizer with timestamps; a message is the text of its input and timestamp."""

    def __init__(self, synchronizer: ExactSynchronizer) -> None:
        self.synchronizer = synchronizer

    def add(self, index: int, stamp: int, now: int | None = None) -> list[list[str]]:
        queue = self.synchronizer.queues[index]
        return [list(found) for found in self.synchronizer.add(f"{index}:{stamp}", stamp, queue, index, now)]


def test_messages_of_one_stamp_make_a_set() -> None:
    inputs = Inputs(ExactSynchronizer(3, queue_size=5))

    assert (inputs.add(2, 10), inputs.add(0, 10), inputs.add(0, 20)) == ([], [], [])
    assert inputs.add(1, 10) == [["0:10", "1:10", "2:10"]]
    assert [list(queue) for queue in inputs.synchronizer.queues] == [[20], [], []]


def test_the_oldest_timestamp_is_dropped_when_a_queue_is_full() -> None:
    inputs = Inputs(ExactSynchronizer(2, queue_size=2))
    for stamp in (30, 10, 20):
        inputs.add(0, stamp)

    assert (inputs.add(1, 10), inputs.add(1, 20)) == ([], [["0:20", "1:20"]])


def test_a_simulated_clock_that_goes_back_empties_queues_with_reset() -> None:
    inputs = Inputs(ExactSynchronizer(2, queue_size=5, reset=True))
    inputs.add(0, 10, now=100)
    inputs.add(1, 20, now=100)

    assert inputs.add(0, 20, now=50) == []  # the other input still has earlier messages
    assert (inputs.add(1, 10, now=50), inputs.add(1, 20, now=50)) == ([], [["0:20", "1:20"]])


def test_the_nearest_messages_within_the_slop_make_a_set() -> None:
    inputs = Inputs(ApproximateSynchronizer(2, queue_size=5, slop=10))
    for stamp in (100, 106, 95):
        inputs.add(0, stamp)

    assert inputs.add(1, 104) == [["0:106", "1:104"]]
    assert inputs.add(1, 110) == []  # a distance of exactly the slop is too large


def test_a_clock_jump_backwards_is_reported_once() -> None:
    synchronizer = ApproximateSynchronizer(2, queue_size=5, slop=10)
    inputs = Inputs(synchronizer)
    assert not synchronizer.went_back(100, None, 0)
    inputs.add(0, 100)

    assert synchronizer.went_back(50, None, 1)
    assert synchronizer.queues == [{}, {}]
    assert not synchronizer.went_back(51, None, 1)


def first_by_trying_all(candidates: list[list[int]], slop: int) -> list[int] | None:
    from itertools import product

    return next((list(tried) for tried in product(*candidates) if max(tried) - min(tried) < slop), None)


@given(
    st.lists(st.lists(st.integers(0, 40), min_size=1, max_size=5), min_size=1, max_size=4), st.integers(0, 30)
)
def test_the_first_combination_equals_that_of_an_exhaustive_search(
    candidates: list[list[int]], slop: int
) -> None:
    from pipros_libraries.filters.synchronizer import _first_within

    assert _first_within(candidates, slop) == first_by_trying_all(candidates, slop)


def test_a_cache_is_in_the_order_of_arrival_and_can_be_emptied() -> None:
    source = message_filters.SimpleFilter()
    cache = message_filters.Cache(source, 3)
    for stamp in (9, 30, 10, 20):
        source.signalMessage(Stamped(stamp))
    assert str([cache.cache_msgs, cache.getInterval(rospy.Time(10), rospy.Time(20))]) == (
        "[[at 30, at 10, at 20], [at 10, at 20]]"
    )
    assert str([cache.getElemAfterTime(rospy.Time(15)), cache.getElemBeforeTime(rospy.Time(25))]) == (
        "[at 30, at 20]"
    )
    assert cache.getElemAfterTime(rospy.Time(31)) is cache.getElemBeforeTime(rospy.Time(9)) is None
    cache.cache_msgs, cache.cache_times = [], []
    source.signalMessage(Stamped(5))
    assert str([cache.getLast(), cache.getOldestTime().secs]) == "[at 5, 5]"


def test_a_sequencer_forwards_messages_in_order_after_the_delay() -> None:
    sequencer = Sequencer(delay=5, queue_size=3)
    for stamp in (20, 10, 15, 12):
        sequencer.add(stamp, stamp)

    assert sequencer.due(16) == []
    assert sequencer.due(20) == [12, 15]  # 10 was the oldest of four
    sequencer.add(14, "late")
    assert sequencer.due(99) == [20]


def test_a_sequencer_starts_again_if_the_time_moves_back() -> None:
    sequencer = Sequencer(delay=5, queue_size=3)
    for stamp in (90, 99):
        sequencer.add(stamp, stamp)
    assert (sequencer.due(95), sequencer.due(1)) == ([90], [])
    sequencer.add(2, 2)
    assert sequencer.due(10) == [2]


def test_a_subclass_keeps_queues_and_times_of_its_own() -> None:
    class Stamps(message_filters.ApproximateTimeSynchronizer):
        def connectInput(self, fs: Any) -> None:  # noqa: N802
            self.queues = [{} for _ in fs]
            self.latest_stamps = [rospy.Time(0) for _ in fs]
            self.input_connections = [each.registerCallback(self.add, i) for i, each in enumerate(fs)]

        def add(self, msg: Any, index: int) -> None:
            self.queues[index][msg], self.latest_stamps[index] = msg, rospy.Time(msg)
            self.signalMessage(self.last_added, *self.latest_stamps)

    inputs = [message_filters.SimpleFilter() for _ in range(2)]
    got: list[Any] = []
    both = Stamps(inputs, 5, 0.1)
    both.registerCallback(lambda *times: got.append(times))
    inputs[1].signalMessage(7)
    assert (got, both.queues) == ([(rospy.Time(0), rospy.Time(0), rospy.Time(7))], [{}, {7: 7}])
