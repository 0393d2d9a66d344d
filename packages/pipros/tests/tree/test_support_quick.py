"""What `script/test --quick` runs."""

from __future__ import annotations

import subprocess

import pytest

from tests.support import quick
from tests.support.environments import REPOSITORY
from tests.support.outcomes import Outcome


def test_the_listed_files_exist_and_each_is_run_once() -> None:
    listed = quick.listed()
    assert len(listed) > 50
    assert [file for file in listed if not (REPOSITORY / file).is_file()] == []
    assert quick.to_run([]) == sorted(set(listed))


@pytest.mark.parametrize(
    ("changed", "tests"),
    [
        ("packages/pipros-tools/src/pipros_tools/bag/writer.py", "packages/pipros-tools/tests/unit/bag"),
        (
            "packages/pipros-libraries/src/pipros_libraries/markers/new/x.py",
            "packages/pipros-libraries/tests/unit/markers",
        ),
        ("plugins/pipros-data/src/pipros_data/table.py", "plugins/pipros-data/tests/unit"),
        ("plugins/pipros-data/facades/x.py", "plugins/pipros-data/tests/unit"),
        ("packages/pipros/facades/rospy/core.py", None),
        ("packages/pipros/tests/tree/test_plugins.py", "packages/pipros/tests/tree/test_plugins.py"),
        ("packages/pipros-tools/tests/unit/bag/test_deleted.py", None),
        ("packages/pipros/tests/support/quick.py", None),
        ("packages/conftest.py", None),
        ("docs/guides/bags.md", None),
    ],
)
def test_what_a_changed_file_adds(changed: str, tests: str | None) -> None:
    assert quick.tests_of(changed) == tests


def test_a_file_in_a_folder_that_runs_whole_is_not_named_again() -> None:
    ran = quick.to_run(["packages/pipros-tools/src/pipros_tools/bag/writer.py"])
    assert "packages/pipros-tools/tests/unit/bag" in ran
    assert not any(path.startswith("packages/pipros-tools/tests/unit/bag/") for path in ran)


def test_a_thousand_are_chosen_from_every_folder_and_the_dear_ones_are_not() -> None:
    def ran(file: str, processor_s: float) -> list[Outcome]:
        return [Outcome(f"p/tests/{file}::test_{n}", "passed", 1.0, processor_s) for n in range(500)]

    outcomes = [
        *ran("unit/bag/test_quick.py", 0.001),
        *ran("unit/bag/test_slow.py", 0.01),
        *ran("unit/bag/test_slower.py", 0.02),
        *ran("unit/net/test_only.py", 0.05),
        *ran("unit/dear/test_dear.py", 1.0),
        *ran("browser/test_other.py", 0.001),
    ]
    assert quick.choose(outcomes) == [
        "p/tests/unit/bag/test_quick.py",
        "p/tests/unit/bag/test_slow.py",
        "p/tests/unit/net/test_only.py",
    ]


def test_script_test_refuses_a_name_that_is_no_package_or_plugin() -> None:
    ended = subprocess.run([REPOSITORY / "script/test", "navigator"], capture_output=True, text=True)
    assert (ended.returncode, ended.stdout) == (2, "")
    assert {"page", "robot", "pipros;"} < set(ended.stderr.partition(" one of: ")[2].split())
    assert ended.stderr.endswith(" pipros; got navigator\n")
