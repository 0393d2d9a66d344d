"""The table of script/bench: figures, ratios and their spread."""

from __future__ import annotations

import importlib.util
import re
import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace

import pytest

from tests.support import documents
from tests.support.environments import PACKAGES, REPOSITORY, benchmark


def benchmark_module(name: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(name, benchmark(f"{name}.py"))
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def table() -> ModuleType:
    return benchmark_module("table")


@pytest.fixture
def everything(table: ModuleType, monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    monkeypatch.setitem(sys.modules, "table", table)
    monkeypatch.setitem(sys.modules, "figures", benchmark_module("figures"))
    return benchmark_module("everything")


@pytest.fixture
def cost(table: ModuleType, monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    monkeypatch.setitem(sys.modules, "table", table)
    for name in ("worlds", "client"):
        monkeypatch.setitem(sys.modules, name, benchmark_module(name))
    return benchmark_module("cost")


def test_less_is_better_by_the_median_and_the_spread_is_that_of_the_rounds(table: ModuleType) -> None:
    row = table.Row("trip: us", {"genuine": [60.0, 90.0, 100.0], "pipros": [30.0, 90.0, 20.0]})

    assert (row.figure("genuine"), row.ratio(), row.spread()) == (90.0, 3.0, (1.0, 5.0))
    assert row.ratio("tuned") is None


def test_a_measurement_can_prefer_more_and_count_the_best_round(table: ModuleType) -> None:
    values = {"genuine": [10.0, 20.0], "pipros": [30.0, 40.0]}

    assert table.Row("messages/s", values, more_is_better=True).ratio() == pytest.approx(35 / 15)
    assert table.Row("messages/s", values, more_is_better=True, best=True).ratio() == 2.0
    assert table.Row("us", values, best=True).ratio() == pytest.approx(1 / 3)


def test_a_table_names_its_commit_and_a_document_keeps_the_others(
    everything: ModuleType, table: ModuleType, tmp_path: Path
) -> None:
    document = tmp_path / "RESULTS.md"
    marks = (everything.BEGIN, everything.END)
    document.write_text("\n".join(("before", *marks, "after\n")))
    rows = [table.Row("import: ms", {"pipros": [2.0]})]
    sections = {
        "ros2": everything.section("ros2", "", "| pair | figure |", 1.0, "0123abc"),
        "startup": everything.section("startup", "--rounds 3", rows, 2.6, "0123abc"),
        "fleet": everything.section("fleet", "", "two turtles  3 %", 0.0, "0123abc"),
    }

    everything.update(document, sections)
    everything.update(document, {"ros2": "another"})

    text = document.read_text()
    assert re.findall(r"(?m)^(## .*|before|after)$", text) == [
        "before",
        "## startup",
        "## fleet",
        "## ros2",
        "after",
    ]
    assert re.search(
        r"(?s)^`script/bench startup --rounds 3`: commit 0123abc, 20.* foreign load \*\*3 %\*\*\.\n\n"
        r"\| workload \| pipros \| bound by \|\n.*\| import: ms \| 2 \| ",
        text,
        re.MULTILINE,
    )
    assert "```text\ntwo turtles  3 %\n```" in text
    assert text.endswith(f"## ros2\n\nanother\n\n{everything.END}\nafter\n")


@pytest.mark.parametrize(
    ("options", "tree", "complaint"),
    [
        (["--quick"], "0123abc", "with --quick, name another FILE"),
        (["--only", "client"], "0123abc-dirty", "commit your changes first"),
    ],
)
def test_results_are_those_of_whole_runs_of_a_commit(
    everything: ModuleType,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    options: list[str],
    tree: str,
    complaint: str,
) -> None:
    monkeypatch.setattr(everything, "commit", lambda: tree)
    monkeypatch.setattr(sys, "argv", ["everything.py", "--update", *options])

    with pytest.raises(SystemExit):
        everything.main()

    assert complaint in capsys.readouterr().err


def test_documents_take_their_figures_from_the_results() -> None:
    figures = benchmark_module("figures")
    results = (
        "`script/bench a`: commit 1, 2026-12-01, a machine.\n\n"
        "`script/bench b`: commit 2, 2026-12-03, a machine.\n\n"
        "| workload | genuine | tuned | roscpp | pipros |\n| --- | --- |\n"
        "| trip, q=1: us | 1,000 | 9 |  | 7 |\n\n"
        "| node | pipros now |\n| --- | --- |\n| amcl | 3 s |\n"
    )
    document = (
        "From [the results](a.md) of 2026-01-01:\n\n"
        "| workload | genuine rospy | roscpp | pipros |\n| --- | --- | --- | --- |\n"
        "| trip, `q=1`: us | 1 | 2 | 3 |\n\n"
        "| node | pipros | genuine 2020 |\n| --- | --- | --- |\n| amcl | 1 s | 2 s |\n| other | 1 s | 2 s |\n"
    )

    assert figures.with_figures(document, results) == (
        document.replace("2026-01-01", "2026-12-01 to 2026-12-03")
        .replace("| 1 | 2 | 3 |", "| 1,000 | | 7 |")
        .replace("amcl | 1 s", "amcl | 3 s")
    )
    with pytest.raises(ValueError, match="has no row 'trip, `q=2`: us'"):
        figures.with_figures(document.replace("q=1", "q=2"), results)


def test_the_figures_of_documents_are_those_of_the_results() -> None:
    """`script/bench figures` changes nothing."""
    figures = benchmark_module("figures")
    results = (figures.HERE / "RESULTS.md").read_text()

    for file in figures.DOCUMENTS:
        text = file.read_text()
        assert sum(heads[0] == "workload" for _, heads, _ in figures.tables(text)) >= 4, file
        assert figures.with_figures(text, results) == text, file


def test_the_cost_of_a_message_is_that_of_both_ends_apart(
    cost: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    received = {"seen": 100, "cpu": 0.002}
    monkeypatch.setattr(cost, "flow", lambda *_, **__: ({"sent": 100, "cpu": 0.001}, [received]))
    world = SimpleNamespace(name="pipros")

    assert cost.cost("x", "string", 500, 0, 1000, world, 1.0) == {
        "x: us of the publisher's processor time per message": pytest.approx(10),
        "x: us of the subscriber's processor time per message": pytest.approx(20),
    }
    received["seen"] = 99
    with pytest.raises(SystemExit, match="pipros: x: 99 of 100 messages arrived"):
        cost.cost("x", "string", 500, 0, 1000, world, 1.0)


def test_every_benchmark_is_named_where_its_figures_are_used(everything: ModuleType) -> None:
    """By a document, by a script, or by `script/bench`; or it is a part of one that is named."""
    texts = {file.stem: file.read_text() for package in PACKAGES for file in package.glob("benchmarks/*.py")}
    users = [*documents.pages().values(), REPOSITORY / "script" / "long"]
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
