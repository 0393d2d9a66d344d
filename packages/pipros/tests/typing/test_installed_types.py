"""Type checkers see all of an installed wheel, and find the mistakes in textbook programs."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys
import venv
import zipfile
from pathlib import Path

import numpy
import pytest
from mypy import api

from tests.support.environments import FACADES, REPOSITORY, files_below
from tests.support.pyright import INSTALL, find_pyright

TEXTBOOK = Path(__file__).with_name("textbook.txt")


@pytest.fixture(scope="module")
def environment(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a virtual environment with the wheels of pipros and its plugins, and numpy."""
    folder = tmp_path_factory.mktemp("installed")
    built = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", folder]
    for project in (REPOSITORY, *REPOSITORY.glob("plugins/*/")):
        subprocess.run(built, cwd=project, check=True, capture_output=True)
    venv.create(folder / "venv", with_pip=False)
    (site,) = folder.glob("venv/lib/python*/site-packages")
    for wheel in folder.glob("*.whl"):
        zipfile.ZipFile(wheel).extractall(site)
    (site / "numpy").symlink_to(Path(numpy.__file__).parent)
    return folder / "venv"


def mypy_errors(program: Path, environment: Path) -> dict[int, str]:
    """Return the errors of mypy in a file, by line."""
    settings = program.with_name("mypy.ini")
    settings.write_text(
        f"[mypy]\nstrict = true\npython_executable = {environment}/bin/python\n"
        f"cache_dir = {program.parent}/.cache\n"
    )
    recursion_limit = sys.getrecursionlimit()  # which mypy raises
    output, problems, _ = api.run(["--config-file", str(settings), "--no-error-summary", str(program)])
    sys.setrecursionlimit(recursion_limit)
    assert problems == ""
    found = re.findall(rf"^{re.escape(str(program))}:(\d+): error: (.*)$", output, re.MULTILINE)
    assert len(found) == len(re.findall(": error: ", output)), output
    return {int(line): text for line, text in found}


def pyright_errors(program: Path, environment: Path) -> dict[int, str]:
    """Return the errors of pyright in a file, by line."""
    checker = find_pyright()
    if checker is None:
        pytest.skip(f"pyright is not on this machine: {INSTALL}")
    settings = program.with_name("pyrightconfig.json")
    settings.write_text(
        json.dumps(
            {
                "typeCheckingMode": "standard",
                "reportMissingModuleSource": False,
                "venvPath": str(environment.parent),
                "venv": environment.name,
                "include": [program.name],
            }
        )
    )
    ended = subprocess.run([checker, "--project", settings, "--outputjson"], capture_output=True, text=True)
    report = json.loads(ended.stdout)
    assert report["summary"]["filesAnalyzed"] == 1
    return {each["range"]["start"]["line"] + 1: each["message"] for each in report["generalDiagnostics"]}


def expected_errors(text: str) -> dict[int, str]:
    lines = enumerate(text.splitlines(), 1)
    return {number: line.partition("# error: ")[2] for number, line in lines if "# error: " in line}


@pytest.mark.timeout(300)
def test_mypy_finds_the_mistakes_in_a_textbook_program_and_no_others(
    environment: Path, tmp_path: Path
) -> None:
    program = Path(shutil.copy(TEXTBOOK, tmp_path / "program.py"))
    expected = expected_errors(TEXTBOOK.read_text())

    found = mypy_errors(program, environment)

    assert found.keys() == expected.keys(), found
    for line, beginning in expected.items():
        assert found[line].startswith(beginning)


@pytest.mark.timeout(300)
def test_pyright_finds_the_mistakes_in_a_textbook_program_and_no_others(
    environment: Path, tmp_path: Path
) -> None:
    program = Path(shutil.copy(TEXTBOOK, tmp_path / "program.py"))

    found = pyright_errors(program, environment)

    assert found.keys() == expected_errors(TEXTBOOK.read_text()).keys(), found


def shipped_modules() -> list[str]:
    """Return the names of all modules in the facades, which is what programs import."""
    files = [(folder, file) for folder in FACADES for file in files_below(folder, "*.py")]
    paths = {file.relative_to(folder).with_suffix("") for folder, file in files}
    return sorted(".".join(path.parts).removesuffix(".__init__") for path in paths)


@pytest.mark.timeout(300)
@pytest.mark.parametrize("check", [mypy_errors, pyright_errors])
def test_type_checkers_find_every_module_of_the_wheel(
    check: object, environment: Path, tmp_path: Path
) -> None:
    program = tmp_path / "program.py"
    site = next(environment.glob("lib/python*/site-packages"))
    messages = {f"{file.parent.parent.name}.{file.parent.name}" for file in site.glob("*/*/__init__.pyi")}
    modules = [*shipped_modules(), *sorted(messages)]
    assert {"actionlib", "actionlib.msg", "tf.transformations", "dynamic_reconfigure.server"} < set(modules)
    program.write_text("".join(f"import {module}\n" for module in modules))

    assert check(program, environment) == {}  # type: ignore[operator]
