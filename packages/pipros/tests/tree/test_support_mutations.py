"""The table of mutations fits the tree, and a mutation that no test notices is found."""

from __future__ import annotations

import sys
from collections import Counter
from pathlib import Path

import pytest

from tests.support import mutations
from tests.support.environments import REPOSITORY
from tests.support.mutations import Mutation, MutationError, judge, read_mutations


@pytest.mark.parametrize("mutation", read_mutations(), ids=lambda each: each.name)
def test_each_mutation_applies_to_its_file_and_names_tests_that_exist(mutation: Mutation) -> None:
    mutation.applied((REPOSITORY / mutation.file).read_text(encoding="utf-8"))

    assert mutation.tests
    for test in mutation.tests:
        file, *function = test.partition("[")[0].split("::")
        assert (REPOSITORY / file).exists(), test
        assert not function or f"def {function[-1]}(" in (REPOSITORY / file).read_text(encoding="utf-8"), test


def test_names_of_mutations_are_unique() -> None:
    counts = Counter(each.name for each in read_mutations())
    assert [name for name, count in counts.items() if count > 1] == []


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Create a module with a test that has the tree's options, and fails twice if `add` returns None."""
    monkeypatch.setenv("PYTHONPATH", str(REPOSITORY))
    (tmp_path / "conftest.py").write_text(
        "import pytest\n"
        "from tests.support.project_conftest import pytest_addoption, pytest_collection_modifyitems\n"
        "from tests.support.outcomes import configure as pytest_configure\n"
        "@pytest.fixture(autouse=True)\n"
        "def checked():\n"
        "    import sums\n"
        "    yield\n"
        "    assert sums.add(0, 0) is not None\n"
    )
    (tmp_path / "sums.py").write_text("def add(a, b):\n    return a + b  # not a * b\n")
    (tmp_path / "test_sums.py").write_text(
        "from sums import add\n"
        "def test_two(): assert add(2, 2) == 4\n"
        "def test_three(): assert add(1, 2) == 3\n"
    )
    (tmp_path / "pytest.ini").write_text("[pytest]\n")
    return tmp_path


def fault(new: str, old: str = "return a + b") -> Mutation:
    return Mutation("a fault", "sums.py", old, new, ["test_sums.py"])


def test_failed_tests_are_counted_and_the_file_is_restored(folder: Path) -> None:
    text = (folder / "sums.py").read_text()
    python = Path(sys.executable)

    assert judge(fault("return a * b"), folder, python) == (1, 2)  # 2 * 2 is 2 + 2
    assert judge(fault("return a - b"), folder, python) == (2, 2)
    assert judge(fault("return None"), folder, python) == (2, 2)  # each fails at its end, too
    assert judge(fault("return b + a"), folder, python) == (0, 2)
    assert (folder / "sums.py").read_text() == text


def test_a_mutation_that_does_not_apply_or_breaks_the_file_is_an_error(folder: Path) -> None:
    for mutation in (fault("x", old="return a / b"), fault("x", old="a"), fault("a + b", old="a + b")):
        with pytest.raises(
            MutationError, match=r"^a fault: sums\.py must contain the old text once, got \d+$"
        ):
            judge(mutation, folder, Path(sys.executable))

    with pytest.raises(MutationError, match="pytest ended with 2"):
        judge(fault("return a +"), folder, Path(sys.executable))


def test_a_surviving_mutation_fails_the_run(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(mutations, "copy_tree", lambda copy: _copied(folder, copy))
    found = [fault("return a * b")]
    monkeypatch.setattr(mutations, "read_mutations", lambda: found)

    assert mutations.main([]) == 0
    found.append(fault("return b + a"))
    assert mutations.main([]) == 1
    assert mutations.main(["another"]) == 2

    output = capsys.readouterr()
    assert output.out.splitlines()[3:] == [
        "without a mutation: failed 0 of 2",
        "a fault: failed 1 of 2",
        "a fault: failed 0 of 2",
        "1 of 2 mutations are noticed",
    ]
    assert output.err.endswith("has a name with another\n")


def _copied(source: Path, copy: Path) -> Path:
    for file in source.glob("*.*"):
        (copy / file.name).write_text(file.read_text())
    return Path(sys.executable)
