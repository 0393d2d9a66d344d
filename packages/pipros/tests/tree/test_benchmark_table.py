"""The figures of script/bench in documents, and who uses each benchmark."""

import importlib.util
import re
import sys
from types import ModuleType

import pytest

from tests.support import documents
from tests.support.environments import PACKAGES, REPOSITORY, benchmark


def benchmark_module(name: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(name, benchmark(f"{name}.py"))
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_figures_of_documents_are_those_of_the_results() -> None:
    """`script/bench figures` changes nothing."""
    figures = benchmark_module("figures")
    results = (figures.HERE / "RESULTS.md").read_text()

    for file in figures.DOCUMENTS:
        text = file.read_text()
        assert sum(heads[0] == "workload" for _, heads, _ in figures.tables(text)) >= 4, file
        assert figures.with_figures(text, results) == text, file


def test_every_benchmark_is_named_where_its_figures_are_used(monkeypatch: pytest.MonkeyPatch) -> None:
    """By a document, by a script, or by `script/bench`; or it is a part of one that is named."""
    for name in ("table", "figures"):
        monkeypatch.setitem(sys.modules, name, benchmark_module(name))
    everything = benchmark_module("everything")
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
