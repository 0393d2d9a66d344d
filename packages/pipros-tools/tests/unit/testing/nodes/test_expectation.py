"""Topics and services that must appear, or must not, each within its own time from a common start."""

from typing import Any

import pytest

from pipros_tools.testing.nodes.expectation import Expectation, Watch
from pipros_tools.testing.nodes.hztest import AllowedRate


class Graph:
    """The topics of the graph by name."""

    def __init__(self, **types: str) -> None:
        self.types = {f"/{name}": kind for name, kind in types.items()}

    def find(self, one: Expectation) -> str | None:
        return self.types.get(one.name)


def test_an_entry_needs_only_a_name() -> None:
    read = Expectation.read({"name": "level"}, lambda name: f"/robot/{name}")

    assert read == Expectation("/robot/level", timeout_s=10.0, negative=False, type=None)


@pytest.mark.parametrize(("entry", "complaint"), [
    ("level", "'name' field in rosparam is required"),
    ({"timeout": 1}, "'name' field in rosparam is required"),
    ({"name": "level", "timeout": "soon"}, r"timeout of \[level\] must be a number, got 'soon'"),
])  # fmt: skip
def test_invalid_expectations_are_refused(entry: Any, complaint: str) -> None:
    with pytest.raises(AssertionError, match=complaint):
        Expectation.read(entry, str)


def test_all_times_have_the_same_start() -> None:
    graph = Graph()
    watch = Watch([Expectation("/slow", 9.0), Expectation("/quick", 2.0)], "topic")

    assert not watch.check(1.9, graph.find)
    with pytest.raises(AssertionError, match=r"topic \[/quick\] did not appear within 2 s"):
        watch.check(2.0, graph.find)


def test_a_topic_that_appeared_once_may_disappear() -> None:
    graph = Graph(level="std_msgs/String")
    watch = Watch([Expectation("/level", 5.0), Expectation("/other", 5.0)], "topic")
    assert not watch.check(0.0, graph.find)

    graph.types = {"/other": "std_msgs/String"}

    assert watch.check(1.0, graph.find)


def test_a_forbidden_name_is_watched_for_its_whole_time() -> None:
    graph = Graph()
    watch = Watch([Expectation("/gone", 5.0, negative=True)], "service")

    assert watch.longest_s == 5.0
    assert not watch.check(4.9, graph.find)
    assert watch.check(5.0, graph.find)


def test_a_forbidden_name_that_appears_fails_at_once() -> None:
    watch = Watch([Expectation("/gone", 5.0, negative=True)], "service")

    with pytest.raises(AssertionError, match=r"service \[/gone\] exists, but must not"):
        watch.check(0.1, Graph(gone="std_srvs/Empty").find)


def test_a_type_is_compared_only_if_it_is_given() -> None:
    graph = Graph(level="std_msgs/String")

    assert Watch([Expectation("/level", type="std_msgs/String")], "topic").check(0, graph.find)
    with pytest.raises(AssertionError, match=r"have the type \[std_msgs/Int8\], got \[std_msgs/String\]"):
        Watch([Expectation("/level", type="std_msgs/Int8")], "topic").check(0, graph.find)


def test_an_empty_list_of_topics_returns_at_once() -> None:
    watch = Watch([], "topic")

    assert watch.longest_s == 0
    assert watch.check(0, Graph().find)


# The verdicts of `hztest` on arrival times.


MS = 1_000_000


def every(gap_ms: int, count: int = 11) -> list[int]:
    return [1_000 * MS + number * gap_ms * MS for number in range(count)]


def test_a_rate_within_its_tolerance_passes() -> None:
    AllowedRate(10, 1).check(every(100), check_intervals=True)
    AllowedRate(10, 1).check(every(92), check_intervals=True)


@pytest.mark.parametrize(("gap_ms", "expected"), [(125, "8.000Hz"), (80, "12.500Hz"), (0, "infHz")])
def test_a_rate_outside_its_tolerance_is_reported_with_the_tolerance(gap_ms: int, expected: str) -> None:
    with pytest.raises(AssertionError, match=f"average rate {expected} is not between 9.000Hz and 11.000Hz"):
        AllowedRate(10, 1).check(every(gap_ms), check_intervals=False)


def test_a_single_gap_matters_only_when_gaps_are_checked() -> None:
    arrivals = [at + (50 * MS if number == 5 else 0) for number, at in enumerate(every(100))]

    AllowedRate(10, 1).check(arrivals, check_intervals=False)
    with pytest.raises(AssertionError, match=r"interval of 0.150s does not match 9.000Hz to 11.000Hz"):
        AllowedRate(10, 1).check(arrivals, check_intervals=True)


def test_a_tolerance_as_large_as_the_rate_allows_any_gap() -> None:
    AllowedRate(1, 1).check(every(100_000, 2), check_intervals=True)


@pytest.mark.parametrize(
    ("count", "expected"), [(0, "no messages received"), (1, "only one message received")]
)
def test_one_message_has_no_rate(count: int, expected: str) -> None:
    with pytest.raises(AssertionError, match=expected):
        AllowedRate(10, 1).check(every(100, count), check_intervals=False)


def test_silence_is_broken_by_one_message() -> None:
    AllowedRate(0, 0).check([], check_intervals=False)
    with pytest.raises(AssertionError, match="expected no messages, received 1"):
        AllowedRate(0, 0).check(every(100, 1), check_intervals=False)
