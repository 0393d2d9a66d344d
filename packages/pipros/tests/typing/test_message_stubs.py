"""Type checkers accept correct uses of messages, and report wrong fields."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest
from mypy import api

from pipros.msg.importing.hook import installed_library
from pipros.msg.stubs import package_stubs
from pipros_tools.cli.stubs import main
from tests.support.environments import EXAMPLES as COMPOSIV
from tests.support.environments import ROOTS, SOURCE_PATH, source
from tests.support.pyright import INSTALL, find_pyright

SHARE = source("pipros/share")
EXAMPLES = [Path(__file__).with_name(name) for name in ("message_fields.txt", "rospy_calls.txt")]


@pytest.fixture(scope="module")
def stubs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("project") / "typings"
    assert (
        main([*sorted(file.parent.name for file in SHARE.glob("*/package.xml")), "--output", str(folder)])
        == 0
    )
    return folder


def mypy_errors(file: Path, stubs: Path) -> dict[int, str]:
    """Return the errors of mypy in a file, by line."""
    settings = stubs / "mypy.ini"
    settings.write_text(
        f"[mypy]\nstrict = true\nmypy_path = {stubs}:{SOURCE_PATH}\ncache_dir = {stubs}/.cache\n"
    )
    recursion_limit = sys.getrecursionlimit()  # which mypy raises
    output, problems, _ = api.run(["--config-file", str(settings), "--no-error-summary", str(file)])
    sys.setrecursionlimit(recursion_limit)
    assert problems == ""
    found = re.findall(rf"^{re.escape(str(file))}:(\d+): error: (.*)$", output, re.MULTILINE)
    assert len(found) == output.count("error:"), output
    return {int(line): text for line, text in found}


def said_by_pyright(path: Path) -> dict[tuple[str, int], str]:
    """Return the errors of pyright in a file or folder beside `typings`, by file name and line."""
    program = find_pyright()
    if program is None:
        pytest.skip(f"pyright is not on this machine: {INSTALL}")
    settings = path.parent / "pyrightconfig.json"
    settings.write_text(
        json.dumps(
            {
                "typeCheckingMode": "strict",
                "reportMissingModuleSource": False,
                "extraPaths": [str(folder) for folder in ROOTS],
                "include": [path.name],
            }
        )
    )
    asked = [program, "--project", settings, "--pythonpath", sys.executable, "--outputjson"]
    ended = subprocess.run(asked, stdout=subprocess.PIPE, text=True, check=False)
    report = json.loads(ended.stdout)
    assert report["summary"]["filesAnalyzed"] > 0
    return {
        (Path(each["file"]).name, each["range"]["start"]["line"] + 1): each["message"]
        for each in report["generalDiagnostics"]
    }


def expected_complaints(example: Path) -> dict[int, str]:
    return {
        number: line.partition("# error: ")[2]
        for number, line in enumerate(example.read_text().splitlines(), 1)
        if "# error: " in line
    }


@pytest.mark.timeout(180)
@pytest.mark.parametrize("example", EXAMPLES, ids=lambda example: example.stem)
def test_mypy_checks_messages_and_their_use_in_rospy(example: Path, stubs: Path, tmp_path: Path) -> None:
    program = tmp_path / "program.py"
    program.write_text(example.read_text())
    expected = expected_complaints(example)

    found = mypy_errors(program, stubs)

    assert found.keys() == expected.keys(), found
    for line, beginning in expected.items():
        assert found[line].startswith(beginning)


@pytest.mark.timeout(180)
@pytest.mark.parametrize("example", EXAMPLES, ids=lambda example: example.stem)
def test_pyright_checks_messages_and_their_use_in_rospy(example: Path, stubs: Path) -> None:
    program = stubs.parent / f"{example.stem}.py"
    program.write_text(example.read_text())

    found = said_by_pyright(program)

    assert found.keys() == {(program.name, line) for line in expected_complaints(example)}, found


@pytest.mark.timeout(180)
def test_pyright_accepts_the_stubs(stubs: Path) -> None:
    assert said_by_pyright(stubs) == {}


def test_pyright_finds_the_stubs_of_a_package_where_they_are_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(COMPOSIV))
    monkeypatch.chdir(tmp_path)
    assert main(["composiv_tryouts"]) == 0
    program = tmp_path / "program.py"
    program.write_text("from composiv_tryouts.msg import BatteryLevel\n\nBatteryLevel(battery=25)\n")

    ((place, complaint),) = said_by_pyright(program).items()

    assert place == ("program.py", 3)
    assert '"Literal[25]" is not assignable to "str"' in complaint


@pytest.mark.timeout(180)
def test_all_stubs_that_ship_pass_the_strictest_check(stubs: Path, tmp_path: Path) -> None:
    program = tmp_path / "program.py"
    modules = [
        ".".join(file.parent.relative_to(stubs).parts) for file in sorted(stubs.glob("*/*/__init__.pyi"))
    ]
    program.write_text("".join(f"import {module}\n" for module in modules))

    assert len(modules) > 30
    assert mypy_errors(program, stubs) == {}


def test_a_stub_has_every_type_and_every_constant() -> None:
    text = package_stubs("diagnostic_msgs", installed_library().definitions)["msg/__init__.pyi"]
    assert re.findall(r"^class (\w+)", text, re.MULTILINE) == [
        *("DiagnosticArray", "DiagnosticStatus", "KeyValue"),
    ]
    assert "    WARN: _Final = 1\n" in text


def test_an_unknown_package_is_reported_in_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["no_such_package"]) == 1
    assert capsys.readouterr().err.startswith("pipros stubs: there is no package no_such_package: ")
