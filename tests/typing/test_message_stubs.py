"""What a type checker says about messages: nothing where all is well, and where a field is wrong, that."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from mypy import api

from pipros.cli.stubs import main
from pipros.msg.hook import installed_library
from pipros.msg.stubs import package_stubs

SOURCES = Path(__file__).resolve().parents[2] / "src"
SHARE = SOURCES / "pipros" / "share"
EXAMPLES = [Path(__file__).with_name(name) for name in ("message_fields.txt", "rospy_calls.txt")]


@pytest.fixture(scope="module")
def stubs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("stubs")
    assert main([*sorted(package.name for package in SHARE.iterdir()), "--output", str(folder)]) == 0
    return folder


def complaints(file: Path, stubs: Path) -> dict[int, str]:
    """What mypy says about a file, by line."""
    settings = stubs / "mypy.ini"
    settings.write_text(f"[mypy]\nstrict = true\nmypy_path = {stubs}:{SOURCES}\ncache_dir = {stubs}/.cache\n")
    said, problems, _ = api.run(["--config-file", str(settings), "--no-error-summary", str(file)])
    assert problems == ""
    found = re.findall(rf"^{re.escape(str(file))}:(\d+): error: (.*)$", said, re.MULTILINE)
    assert len(found) == said.count("error:"), said
    return {int(line): text for line, text in found}


@pytest.mark.timeout(180)
@pytest.mark.parametrize("example", EXAMPLES, ids=lambda example: example.stem)
def test_a_type_checker_knows_messages_and_what_rospy_does_with_them(
    example: Path, stubs: Path, tmp_path: Path
) -> None:
    program = tmp_path / "program.py"
    program.write_text(example.read_text())
    expected = {
        number: line.partition("# error: ")[2]
        for number, line in enumerate(example.read_text().splitlines(), 1)
        if "# error: " in line
    }

    found = complaints(program, stubs)

    assert found.keys() == expected.keys(), found
    for line, beginning in expected.items():
        assert found[line].startswith(beginning)


@pytest.mark.timeout(180)
def test_all_stubs_that_ship_pass_the_strictest_check(stubs: Path, tmp_path: Path) -> None:
    program = tmp_path / "program.py"
    modules = [
        ".".join(file.parent.relative_to(stubs).parts) for file in sorted(stubs.glob("*/*/__init__.pyi"))
    ]
    program.write_text("".join(f"import {module}\n" for module in modules))

    assert len(modules) > 30
    assert complaints(program, stubs) == {}


def test_a_stub_has_every_type_and_every_constant() -> None:
    text = package_stubs("diagnostic_msgs", installed_library().definitions)["msg/__init__.pyi"]
    assert re.findall(r"^class (\w+)", text, re.MULTILINE) == [
        *("DiagnosticArray", "DiagnosticStatus", "KeyValue"),
    ]
    assert "    WARN: _Final = 1\n" in text


def test_an_unknown_package_is_said_in_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["no_such_package"]) == 1
    assert capsys.readouterr().err.startswith("pipros stubs: there is no package no_such_package: ")
