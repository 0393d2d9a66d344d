"""Type checkers see all of an installed wheel and of messages, and find the mistakes in programs."""

import json
import os
import re
import shutil
import subprocess
import sys
import venv
import zipfile
from pathlib import Path
from typing import Any

import numpy
import pytest
from mypy import api

from pipros.msg.importing.hook import installed_library
from pipros.msg.stubs import package_stubs
from pipros_tools.cli.stubs import main
from tests.support.environments import EXAMPLES, FACADES, REPOSITORY, ROOTS, SOURCE_PATH, files_below, source
from tests.support.once import make_once, shared_folder
from tests.support.pyright import INSTALL, find_pyright

pytestmark = pytest.mark.timeout(300)
HERE = Path(__file__).parent
TEXTBOOK = HERE / "textbook.txt"
PROGRAMS = [HERE / name for name in ("message_fields.txt", "rospy_calls.txt")]
SHARE = source("pipros/share")


@pytest.fixture(scope="session")
def environment(tmp_path_factory: pytest.TempPathFactory, worker_id: str) -> Path:
    """Return a virtual environment with the wheels of pipros and its plugins, and numpy."""
    folder = shared_folder(tmp_path_factory, worker_id) / "installed"

    def make() -> None:
        built = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", folder]
        for project in (REPOSITORY, *REPOSITORY.glob("plugins/*/")):
            subprocess.run(built, cwd=project, check=True, capture_output=True)
        venv.create(folder / "venv", with_pip=False)
        (site,) = folder.glob("venv/lib/python*/site-packages")
        for wheel in folder.glob("*.whl"):
            zipfile.ZipFile(wheel).extractall(site)
        (site / "numpy").symlink_to(Path(numpy.__file__).parent)

    return make_once(folder, make) / "venv"


@pytest.fixture(scope="session")
def stubs(tmp_path_factory: pytest.TempPathFactory, worker_id: str) -> Path:
    """Return a folder `typings` with stubs of all packages that ship."""
    folder = shared_folder(tmp_path_factory, worker_id) / "project"
    packages = sorted(file.parent.name for file in SHARE.glob("*/package.xml"))

    def make() -> None:
        assert main([*packages, "--output", str(folder / "typings")]) == 0

    return make_once(folder, make) / "typings"


Errors = dict[int, str]


def mypy_errors(program: Path, setting: str) -> Errors:
    """Return the errors of mypy in a file, by line."""
    settings = program.with_name("mypy.ini")
    settings.write_text(f"[mypy]\nstrict = true\n{setting}\n")
    recursion_limit = sys.getrecursionlimit()  # which mypy raises
    output, problems, _ = api.run(["--config-file", str(settings), "--no-error-summary", str(program)])
    sys.setrecursionlimit(recursion_limit)
    assert problems == ""
    found = re.findall(rf"^{re.escape(str(program))}:(\d+): error: (.*)$", output, re.MULTILINE)
    assert len(found) == len(re.findall(": error: ", output)), output
    return {int(line): text for line, text in found}


def pyright_report(path: Path, *options: str | Path, **settings: object) -> list[dict[str, Any]]:
    """Return what pyright finds in a file or folder."""
    checker = find_pyright()
    if checker is None:
        pytest.skip(f"pyright is not on this machine: {INSTALL}")
    file = path.with_name("pyrightconfig.json")
    file.write_text(json.dumps({"reportMissingModuleSource": False, "include": [path.name], **settings}))
    command = [checker, "--project", file, *options, "--outputjson"]
    report = json.loads(subprocess.run(command, stdout=subprocess.PIPE, text=True, check=False).stdout)
    assert report["summary"]["filesAnalyzed"] > 0
    return list(report["generalDiagnostics"])


def pyright_errors(path: Path, *options: str | Path, **settings: object) -> Errors:
    """Return the errors of pyright in a file, by line."""
    found = pyright_report(path, *options, **settings)
    return {each["range"]["start"]["line"] + 1: each["message"] for each in found}


def expected_errors(program: Path) -> Errors:
    lines = enumerate(program.read_text().splitlines(), 1)
    return {number: line.partition("# error: ")[2] for number, line in lines if "# error: " in line}


def cache_in(folder: Path) -> str:
    """Return the setting for a cache of mypy that the tests of this process share."""
    return f"cache_dir = {folder.parent}/.cache-{os.getpid()}"


def of_installed(environment: Path) -> tuple[str, dict[str, object]]:
    """Return the settings of mypy and of pyright for the wheels."""
    place = {"venvPath": str(environment.parent), "venv": environment.name}
    setting = f"python_executable = {environment}/bin/python\n{cache_in(environment)}"
    return setting, {"typeCheckingMode": "standard", **place}


def of_stubs(stubs: Path) -> tuple[str, dict[str, object]]:
    """Return the settings of mypy and of pyright for the sources, and stubs of messages."""
    folders = [str(folder) for folder in ROOTS]
    setting = f"mypy_path = {stubs}:{SOURCE_PATH}\n{cache_in(stubs)}"
    return setting, {"typeCheckingMode": "strict", "extraPaths": folders}


def assert_expected(found: Errors, program: Path, *, has_texts: bool) -> None:
    expected = expected_errors(program)
    assert found.keys() == expected.keys(), found
    if has_texts:
        assert [line for line in expected if not found[line].startswith(expected[line])] == [], found


def test_mypy_finds_the_mistakes_in_a_textbook_program_and_no_others(
    environment: Path, tmp_path: Path
) -> None:
    program = Path(shutil.copy(TEXTBOOK, tmp_path / "program.py"))
    assert_expected(mypy_errors(program, of_installed(environment)[0]), TEXTBOOK, has_texts=True)


def test_pyright_finds_the_mistakes_in_a_textbook_program_and_no_others(
    environment: Path, tmp_path: Path
) -> None:
    program = Path(shutil.copy(TEXTBOOK, tmp_path / "program.py"))
    assert_expected(pyright_errors(program, **of_installed(environment)[1]), TEXTBOOK, has_texts=False)


def shipped_modules() -> list[str]:
    """Return the names of all modules in the facades, which is what programs import."""
    files = [(folder, file) for folder in FACADES for file in files_below(folder, "*.py")]
    paths = {file.relative_to(folder).with_suffix("") for folder, file in files}
    return sorted(".".join(path.parts).removesuffix(".__init__") for path in paths)


@pytest.mark.parametrize("checker", ["mypy", "pyright"])
def test_type_checkers_find_every_module_of_the_wheel(
    checker: str, environment: Path, tmp_path: Path
) -> None:
    program = tmp_path / "program.py"
    site = next(environment.glob("lib/python*/site-packages"))
    messages = {f"{file.parent.parent.name}.{file.parent.name}" for file in site.glob("*/*/__init__.pyi")}
    modules = [*shipped_modules(), *sorted(messages)]
    assert {"actionlib", "actionlib.msg", "tf.transformations", "dynamic_reconfigure.server"} < set(modules)
    program.write_text("".join(f"import {module}\n" for module in modules))

    mypy, pyright = of_installed(environment)
    assert (mypy_errors(program, mypy) if checker == "mypy" else pyright_errors(program, **pyright)) == {}


@pytest.mark.parametrize("example", PROGRAMS, ids=lambda example: example.stem)
def test_mypy_checks_messages_and_their_use_in_rospy(example: Path, stubs: Path, tmp_path: Path) -> None:
    program = Path(shutil.copy(example, tmp_path / "program.py"))
    assert_expected(mypy_errors(program, of_stubs(stubs)[0]), example, has_texts=True)


BY_PYTHON = ("--pythonpath", sys.executable)


@pytest.mark.parametrize("example", PROGRAMS, ids=lambda example: example.stem)
def test_pyright_checks_messages_and_their_use_in_rospy(example: Path, stubs: Path, tmp_path: Path) -> None:
    program = Path(shutil.copy(example, tmp_path / "program.py"))
    (tmp_path / "typings").symlink_to(stubs)
    assert_expected(pyright_errors(program, *BY_PYTHON, **of_stubs(stubs)[1]), example, has_texts=False)


def test_pyright_accepts_the_stubs(stubs: Path) -> None:
    assert pyright_report(stubs, *BY_PYTHON, **of_stubs(stubs)[1]) == []


def test_pyright_finds_the_stubs_of_a_package_where_they_are_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(EXAMPLES))
    monkeypatch.chdir(tmp_path)
    assert main(["composiv_tryouts"]) == 0
    program = tmp_path / "program.py"
    program.write_text("from composiv_tryouts.msg import BatteryLevel\n\nBatteryLevel(battery=25)\n")

    ((line, complaint),) = pyright_errors(program, *BY_PYTHON, **of_stubs(tmp_path)[1]).items()

    assert line == 3
    assert '"Literal[25]" is not assignable to "str"' in complaint


def test_all_stubs_that_ship_pass_the_strictest_check(stubs: Path, tmp_path: Path) -> None:
    program = tmp_path / "program.py"
    files = sorted(stubs.glob("*/*/__init__.pyi"))
    modules = [".".join(file.parent.relative_to(stubs).parts) for file in files]
    program.write_text("".join(f"import {module}\n" for module in modules))

    assert len(modules) > 30
    assert mypy_errors(program, of_stubs(stubs)[0]) == {}


def test_a_stub_has_every_type_and_every_constant() -> None:
    text = package_stubs("diagnostic_msgs", installed_library().definitions)["msg/__init__.pyi"]
    classes = re.findall(r"^class (\w+)", text, re.MULTILINE)
    assert classes == ["DiagnosticArray", "DiagnosticStatus", "KeyValue"]
    assert "    WARN: _Final = 1\n" in text


def test_an_unknown_package_is_reported_in_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["no_such_package"]) == 1
    assert capsys.readouterr().err.startswith("pipros stubs: there is no package no_such_package: ")
