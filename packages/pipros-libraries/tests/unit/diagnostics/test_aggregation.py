"""The aggregator's reports on statuses, and on invalid parameters."""

from typing import Any

import pytest

from pipros_libraries.diagnostics.aggregation import Aggregation, whole_level
from pipros_libraries.diagnostics.analyzers import ITEM_LIMIT, BadAnalyzer, Items
from pipros_libraries.diagnostics.csv_rows import CsvColumns, file_names
from pipros_libraries.diagnostics.items import ERROR, OK, STALE, WARN, ComponentStatus, output_name
from pipros_libraries.diagnostics.listing import listed

ROBOT = {
    "motors": {
        "type": "diagnostic_aggregator/AnalyzerGroup",
        "path": "Motors",
        "analyzers": {
            "arms": {"type": "GenericAnalyzer", "path": "Arms", "find_and_remove_prefix": "arm"},
            "legs": {"type": "GenericAnalyzer", "path": "Legs", "contains": ["leg"], "num_items": 2},
        },
    },
    "power": {
        "type": "diagnostic_aggregator/GenericAnalyzer", "path": "Power",
        "expected": ["Battery 0", "Battery 1"], "startswith": "Breaker", "timeout": 10.0,
    },
    "noise": {"type": "diagnostic_aggregator/DiscardAnalyzer", "path": "Noise", "regex": "noise [0-9]+"},
    "later": {"type": "diagnostic_aggregator/IgnoreAnalyzer", "path": "Later", "anything": [1, 2]},
}  # fmt: skip


def reported(aggregation: Aggregation, now_s: float) -> dict[str, tuple[int, str]]:
    return {status.name: (status.level, status.message) for status in aggregation.report(now_s)}


def feed(aggregation: Aggregation, now_s: float, **levels: int) -> None:
    for name, level in levels.items():
        aggregation.take(ComponentStatus(name.replace("_", " "), level, f"is {level}"), now_s)


def one(now_s: float, *names: str, **parameters: Any) -> dict[str, tuple[int, str]]:
    aggregation = Aggregation("", {"a": {"type": "GenericAnalyzer", "path": "A", **parameters}})
    for name in names:
        aggregation.take(ComponentStatus(name, OK, "fine"), 0.0)
    return reported(aggregation, now_s)


def test_statuses_are_sorted_into_a_tree() -> None:
    aggregation = Aggregation("robot", ROBOT)
    assert aggregation.problems() == {}
    feed(aggregation, 1.0, arm_left=OK, arm_right=WARN, left_leg=OK, Battery_0=OK, noise_7=ERROR, fan=ERROR)
    feed(aggregation, 1.0, Breaker_3=OK)

    assert reported(aggregation, 2.0) == {
        "/robot": (ERROR, "Error"), "/robot/Motors": (ERROR, "Error"),
        "/robot/Motors/Arms": (WARN, "Warning"), "/robot/Motors/Arms/left": (OK, "is 0"),
        "/robot/Motors/Arms/right": (WARN, "is 1"), "/robot/Motors/Legs": (ERROR, "Expected 2, found 1"),
        "/robot/Motors/Legs/left leg": (OK, "is 0"), "/robot/Power": (ERROR, "Error"),
        "/robot/Power/Battery 0": (OK, "is 0"), "/robot/Power/Battery 1": (STALE, "Missing"),
        "/robot/Power/Breaker 3": (OK, "is 0"), "/robot/Other": (ERROR, "Error"),
        "/robot/Other/fan": (ERROR, "is 2"),
    }  # fmt: skip
    motors = next(status for status in aggregation.report(2.0) if status.name == "/robot/Motors")
    assert motors.values == (("Arms", "Warning"), ("Legs", "Expected 2, found 1"))


def test_without_a_base_path_the_analyzers_are_on_top() -> None:
    assert list(one(0.0, "x", name="x")) == ["/A", "/A/x"]
    assert list(one(0.0, "y", name="x")) == ["/A", "/Other", "/Other/y"]


def test_items_without_updates_are_stale() -> None:
    assert one(5.0, "x", name="x")["/A"] == (OK, "OK")
    assert one(5.1, "x", name="x") == {"/A": (STALE, "Stale"), "/A/x": (STALE, "fine")}
    assert one(5.1, "x", name="x", timeout=6)["/A"] == (OK, "OK")
    assert one(1e9, "x", name="x", timeout=0)["/A"] == (OK, "OK")
    assert one(5.1, "x", name="x", discard_stale=True) == {"/A": (STALE, "Stale")}
    assert one(0.0, name="x")["/A"] == (STALE, "Stale")
    assert one(0.0, name="x", num_items=0)["/A"] == (OK, "OK")


def test_a_downgrading_analyzer_reports_everything_as_ok() -> None:
    aggregation = Aggregation(
        "", {"a": {"type": "diagnostic_aggregator/DowngradeAnalyzer", "path": "A", "startswith": "x"}}
    )
    feed(aggregation, 0.0, x1=ERROR, x2=WARN)
    assert reported(aggregation, 0.0) == {"/A": (OK, "Error"), "/A/x1": (OK, "is 2"), "/A/x2": (OK, "is 1")}


def test_unanalyzed_items_may_be_errors_and_disappear_when_stale() -> None:
    aggregation = Aggregation("", {}, other_as_errors=True)
    assert aggregation.report(0.0) == []
    feed(aggregation, 0.0, fan=OK)

    assert reported(aggregation, 5.0)["/Other"] == (ERROR, 'Unanalyzed items found in "Other"')
    assert aggregation.report(5.1) == []


def test_a_status_may_be_taken_twice() -> None:
    both = {key: {"type": "GenericAnalyzer", "path": key, "contains": "x"} for key in ("b", "a")}
    aggregation = Aggregation("", both)
    feed(aggregation, 0.0, x=OK)

    assert list(reported(aggregation, 0.0)) == ["/a", "/a/x", "/b", "/b/x"]


def test_names_lose_prefixes_and_slashes() -> None:
    assert (output_name("node: a/b", ["other", "node"]), output_name("node", ["node"])) == ("a b", "")
    assert output_name("x", [""]) == "x"


def test_the_level_of_everything() -> None:
    assert whole_level([ComponentStatus("a", WARN), ComponentStatus("b", OK)]) == WARN
    assert whole_level([ComponentStatus("a", STALE), ComponentStatus("b", WARN)]) == ERROR


@pytest.mark.parametrize(("parameters", "reason"), [
    ({"type": "my_pkg/MyAnalyzer"}, "unknown analyzer type my_pkg"),
    ({"type": None}, "missing required parameter 'type'"),
    ({"path": None}, "'path' must be a name, got None"), ({"path": "/"}, "must be a name"),
    ({}, "matches no status"), ({"regex": "("}, "'regex'"),
    ({"regex": "a" * 1001}, "at most 1000 characters"),
    ({"name": 5}, "must be a string or a list of strings"), ({"name": [5]}, "must be a string"),
    ({"name": "a", "timeout": "x"}, "a number"),
    ({"name": "a", "num_items": float("inf")}, "'num_items' must be finite, got inf"),
    ({"type": "AnalyzerGroup", "analyzers": [1]}, "must be a dictionary"),
    (["GenericAnalyzer"], "an analyzer must be a dictionary"),
])  # fmt: skip
def test_a_wrong_analyzer_is_reported_and_the_others_work(parameters: Any, reason: str) -> None:
    bad, good = parameters, {"type": "GenericAnalyzer", "path": "Good", "contains": "x"}
    if isinstance(parameters, dict):
        given = {"type": "GenericAnalyzer", "path": "X", **parameters}
        bad = {name: value for name, value in given.items() if value is not None}
    aggregation = Aggregation("base", {"bad": bad, "good": good})
    feed(aggregation, 0.0, x=OK)

    message = {"unknown": "Pluginlib exception loading analyzer", "missing": "No Analyzer type given"}
    assert reported(aggregation, 0.0) == {
        "/base": (ERROR, "Error"), "/base/Good": (OK, "OK"), "/base/Good/x": (OK, "is 0"),
        "/base/bad": (ERROR, message.get(reason.partition(" ")[0], "Analyzer init failed")),
    }  # fmt: skip
    assert reason in aggregation.problems()["/base/bad"]


def test_groups_without_end_and_without_analyzers_are_reported() -> None:
    deep: dict[str, Any] = {"type": "AnalyzerGroup", "path": "g", "analyzers": {}}
    for _ in range(50):
        deep = {"type": "AnalyzerGroup", "path": "g", "analyzers": {"g": deep}}

    assert "more than 20" in next(iter(Aggregation("", {"g": deep}).problems().values()))
    empty = Aggregation("", {"g": {"type": "AnalyzerGroup", "path": "g"}})
    assert reported(empty, 0.0) == {"/g": (ERROR, "No analyzers")}


def test_analyzers_are_removed_with_their_owner() -> None:
    aggregation = Aggregation("", {})
    added = {"a": {"type": "GenericAnalyzer", "path": "Added", "contains": "x"}}
    aggregation.add("/node", added)
    with pytest.raises(BadAnalyzer, match="already"):
        aggregation.add("/node", added)
    with pytest.raises(BadAnalyzer, match="unknown analyzer type B"):
        aggregation.add("/other", {**added, "b": {"type": "B"}})
    with pytest.raises(BadAnalyzer, match="must set its private parameter"):
        aggregation.add("/other", {})
    feed(aggregation, 0.0, x=OK)
    assert list(reported(aggregation, 0.0)) == ["/Added", "/Added/x"]

    aggregation.remove("/node")
    aggregation.remove("/node")
    feed(aggregation, 0.0, x=OK)
    assert list(reported(aggregation, 0.0)) == ["/Other", "/Other/x"]


def test_an_endless_number_of_names_takes_bounded_memory() -> None:
    items = Items("A", "/A")
    taken = [items.analyze(ComponentStatus(str(number)), 0.0) for number in range(ITEM_LIMIT + 5)]

    assert taken.count(True) == ITEM_LIMIT
    assert items.analyze(ComponentStatus("0", OK), 1.0), "one that is known"


def test_statuses_are_listed_by_name_and_are_fit_for_a_terminal() -> None:
    statuses = [
        ComponentStatus("/b", OK, "fine", "hw", [("key", "value")]),
        ComponentStatus("/a\x1b[2J", STALE, ""),
        ComponentStatus("/c", 7, "odd"),
    ]

    assert listed(statuses, part="/b", details=True) == [
        "OK       /b: fine", "           hardware_id: hw", "           key: value",
    ]  # fmt: skip
    assert [line[:9] for line in listed(statuses)] == ["Stale    ", "OK       ", "Level 7  "]
    assert "\x1b" not in "".join(listed(statuses))
    assert listed(statuses, least=ERROR, part="/b") == []


def test_rows_have_no_line_breaks_and_names_stay_in_their_folder() -> None:
    columns = CsvColumns()
    first = columns.row(ComponentStatus("a", OK, "two\nlines, one", "h\r\nw", [("k,1\n", "v\n,")]), 0.0)
    second = columns.row(ComponentStatus("a", ERROR, "", "", [("new", "x")]), 0.0)

    assert columns.header() == "Timestamp,Level,Message,Hardware ID,k1 ,new\n"
    assert first.partition(",")[2] == "0,two  lines  one,h   w,v   \n"
    assert second.partition(",")[2] == "2,,,,x\n"
    names = file_names(["../../etc/passwd", "", "\0", "x" * 500, "x" * 501])
    assert not any("/" in name or name.startswith(".") or len(name) > 255 for name in names.values())
    assert len(set(names.values())) == 5


def test_a_regex_that_takes_too_long_is_an_error_of_its_analyzer_only() -> None:
    aggregation = Aggregation(
        "",
        {"slow": {"type": "GenericAnalyzer", "path": "Slow", "regex": ["(x+)+y", "fine"]},
            "quick": {"type": "GenericAnalyzer", "path": "Quick", "regex": "x*!"}},
    )  # fmt: skip
    for name in ("x" * 40 + "!", "fine"):
        aggregation.take(ComponentStatus(name, OK, "m"), 0.0)

    assert reported(aggregation, 1.0) == {
        "/Slow": (ERROR, "A regex takes too long and is no longer used"), "/Slow/fine": (OK, "m"),
        "/Quick": (OK, "OK"), f"/Quick/{'x' * 40}!": (OK, "m"),
    }  # fmt: skip


def test_the_number_of_nodes_that_add_analyzers_is_limited() -> None:
    aggregation = Aggregation("", {})
    analyzers = {"a": {"type": "GenericAnalyzer", "path": "A", "name": "a"}}
    for number in range(100):
        aggregation.add(f"/node_{number}", analyzers)
    with pytest.raises(BadAnalyzer, match="must be <= 100"):
        aggregation.add("/one_more", analyzers)
    aggregation.remove("/node_0")
    aggregation.add("/one_more", analyzers)
