"""The table of script/bench: figures, ratios and their spread."""

from __future__ import annotations

import importlib.util
import re
import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace

import pytest

from tests.support.environments import BENCHMARKS, REPOSITORY


def benchmark(name: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(name, BENCHMARKS / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def table() -> ModuleType:
    return benchmark("table")


@pytest.fixture
def everything(table: ModuleType, monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    monkeypatch.setitem(sys.modules, "table", table)
    return benchmark("everything")


def test_less_is_better_by_the_median_and_the_spread_is_that_of_the_rounds(table: ModuleType) -> None:
    row = table.Row("trip: us", {"genuine": [60.0, 90.0, 100.0], "pipros": [30.0, 90.0, 20.0]})

    assert row.figure("genuine") == 90.0
    assert row.ratio() == 3.0
    assert row.spread() == (1.0, 5.0)
    assert row.ratio("tuned") is None


def test_a_measurement_can_prefer_more_and_count_the_best_round(table: ModuleType) -> None:
    values = {"genuine": [10.0, 20.0], "pipros": [30.0, 40.0]}

    assert table.Row("messages/s", values, more_is_better=True).ratio() == pytest.approx(35 / 15)
    assert table.Row("messages/s", values, more_is_better=True, best=True).ratio() == 2.0
    assert table.Row("us", values, best=True).ratio() == pytest.approx(1 / 3)


def test_a_row_may_lack_an_implementation_of_another_row(table: ModuleType) -> None:
    rows = [
        table.Row("flow: messages/s", {"roscpp": [50.0], "pipros": [100.0]}, more_is_better=True),
        table.Row("import: ms", {"genuine": [30.0], "pipros": [10.0]}),
    ]

    assert table.markdown(rows).splitlines()[2:] == [
        "| flow: messages/s |  | 50 | 100 |  |  | 2.00 x |",
        "| import: ms | 30 |  | 10 | 3.00 x | 3.00..3.00 |  |",
    ]


def test_columns_are_the_measured_implementations(table: ModuleType) -> None:
    rows = [
        table.Row("one: us", {"genuine": [20.0], "tuned": [15.0], "pipros": [10.0]}),
        table.Row("two: MB", {"pipros": [1234.5]}),
    ]

    assert table.markdown(rows, "bound by", lambda row: row.label[:3]).splitlines() == [
        "| workload | genuine | tuned | pipros | ratio to genuine | min..max | to tuned | bound by |",
        "| --- | ---: | ---: | ---: | ---: | ---: | ---: | --- |",
        "| one: us | 20 | 15 | 10 | 2.00 x | 2.00..2.00 | 1.50 x | one |",
        "| two: MB |  |  | 1,234 |  |  |  | two |",
    ]


def test_rows_survive_a_round_trip(table: ModuleType, tmp_path: Path) -> None:
    rows = [table.Row("one", {"pipros": [1.0]}, more_is_better=True, best=True)]

    table.write_json(tmp_path / "rows", rows)

    assert [vars(row) for row in table.read_json(tmp_path / "rows")] == [vars(row) for row in rows]


def test_benchmarks_without_genuine_rows_keep_their_own_tables(everything: ModuleType) -> None:
    tables = {"script/bench ros2": "| pair | figure |", "script/bench costs": "two turtles  3 %"}

    text = everything.report([], tables, {"ros2": 1.0, "costs": 2.6}, ["scene"], " --rounds 3", 60)

    assert "Foreign load: ros2 1 %, **costs 3 %**.\n" in text
    assert "Failed, and not in the table: scene." in text
    assert "`script/bench ros2`:\n\n| pair | figure |\n" in text
    assert text.endswith("`script/bench costs`:\n\n```text\ntwo turtles  3 %\n```")


def test_a_disturbed_benchmark_is_repeated(everything: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    loads, runs = iter([9.0, 1.0, 9.0]), iter(["first", "second", "third"])
    monkeypatch.setattr(everything, "Load", lambda: SimpleNamespace(percent=lambda: next(loads)))
    monkeypatch.setattr(everything, "run", lambda *_: next(runs))

    assert everything.run_undisturbed("fleet", "", "", 3) == ("second", 1.0)
    assert everything.run_undisturbed("fleet", "", "", 1) == ("third", 9.0)


def test_every_benchmark_is_named_where_its_figures_are_used(everything: ModuleType) -> None:
    """By a document, by a script, or by `script/bench`; or it is a part of one that is named."""
    texts = {file.stem: file.read_text() for file in (BENCHMARKS).glob("*.py")}
    users = [*(REPOSITORY / "docs").glob("*.md"), REPOSITORY / "script" / "long"]
    text = "\n".join(file.read_text() for file in users)
    named = {
        *re.findall(r"(?:benchmarks/|script/bench )(\w+)", text),
        *everything.BENCHMARKS,
        *everything.OWN_TABLES,
    }
    waiting = sorted(named & texts.keys())
    while waiting:
        parts = re.findall(r"^(?:from|import) (\w+)|\b(\w+)\.py\b", texts[waiting.pop()], re.MULTILINE)
        new = {part for pair in parts for part in pair} & texts.keys() - named
        named |= new
        waiting += new

    assert sorted(texts.keys() - named - {"everything"}) == []
