"""The marks of a bag's timeline."""

from __future__ import annotations

import io
from collections.abc import Iterable
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rosgraph_msgs.msg import Log
from std_msgs.msg import Float64, String

from pipros_page.bags.marks import BINS, MARKS_OF_A_BIN, MAX_COMPONENTS, BagMarks, Mark
from pipros_tools.bag import BagReader
from tests.support.bags import bag_bytes


def marks_of(messages: Iterable[tuple[str, Any, int, int]]) -> tuple[list[Mark], int]:
    """Return the marks of a bag, and the number of those that were left out."""
    with BagReader(io.BytesIO(bag_bytes(list(messages)))) as reader:
        marks, found = BagMarks(reader), []
        while (piece := marks.next_piece()) is not None:
            found += piece
        return found, marks.left_out


def log(second: int, level: int, text: str, topic: str = "/rosout") -> tuple[str, Any, int, int]:
    entry = Log(level=level, name="/robot", msg=text)
    entry.header.frame_id = "a frame"
    return topic, entry, second, 0


def status(
    second: int, level: int, topic: str = "/diagnostics", name: str = "motor"
) -> tuple[str, Any, int, int]:
    return topic, DiagnosticArray(status=[DiagnosticStatus(level, name, f"level {level}", "", [])]), second, 0


def test_errors_of_the_log_are_marked_and_warnings_are_not() -> None:
    found, _ = marks_of([log(1, 1, "debug"), log(2, 4, "warn"), log(3, 8, "error"), log(4, 16, "fatal")])
    assert found == [(3.0, "log", "/robot: error"), (4.0, "log", "/robot: fatal")]


def test_diagnostics_are_marked_when_they_get_worse() -> None:
    found, _ = marks_of([status(second, level) for second, level in enumerate((0, 1, 1, 2, 1, 2, 0, 3, 7))])
    assert [(time, kind) for time, kind, _ in found] == [
        (1, "warning"), (3, "error"), (5, "error"), (7, "stale"),
    ]  # fmt: skip
    assert found[0][2] == "motor: level 1"


def test_entries_and_diagnostics_that_were_published_again_count_once() -> None:
    found, _ = marks_of(
        [
            log(1, 8, "error"),
            log(1, 8, "error", "/rosout_agg"),
            status(2, 2),
            status(2, 2, "/diagnostics_agg"),
        ]
    )
    assert [kind for _, kind, _ in found] == ["log", "error"]


def test_many_marks_are_spread_over_the_bag_and_equal_ones_are_one() -> None:
    burst = [log(1, 8, f"error {number}") for number in range(100)]
    found, left_out = marks_of(
        [*burst, *(log(1, 8, "error 0") for _ in range(50)), log(BINS * 10, 8, "last")]
    )
    assert len(found) == MARKS_OF_A_BIN + 1
    assert found[-1][2] == "/robot: last"
    assert left_out == 100 - MARKS_OF_A_BIN


def test_topics_of_other_types_and_long_texts_do_no_harm() -> None:
    assert marks_of([("/rosout", Float64(1), 1, 0), ("/diagnostics", Float64(1), 1, 0)]) == ([], 0)
    assert marks_of([("/rosout", String("x" * 300), 1, 0)]) == ([], 0)
    [(_, _, text)], _ = marks_of([log(2, 8, "x" * 100_000)])
    assert len(text) == 200


def test_the_number_of_components_is_limited() -> None:
    many = DiagnosticArray(
        status=[DiagnosticStatus(0, f"{number}", "", "", []) for number in range(MAX_COMPONENTS)]
    )
    found, _ = marks_of([("/diagnostics", many, 1, 0), status(2, 2, name="one more"), status(3, 2, name="5")])
    assert [text for _, _, text in found] == ["5: level 2"]
