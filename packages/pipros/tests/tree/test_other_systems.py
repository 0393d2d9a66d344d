"""pipros can be imported, and its pure libraries work, on systems that lack features of Linux."""

import json
import re
from collections.abc import Sequence
from pathlib import Path

import pytest

from tests.support import documents
from tests.support.browser_programs import BEGINNING, LIMITS, PROGRAMS
from tests.support.environments import FLOORS, ROOTS, files_below, import_path
from tests.support.without_posix import PACKAGES, run_without_posix

FACADES = [package for package in PACKAGES if package not in FLOORS]

NEED_PYKDL = {"tf2_kdl", "tf2_kdl.tf2_kdl"}
"""They register the types of PyKDL, and say so where it is missing: PyPI does not have it."""

IMPORT_ALL = """
import importlib, json, sys, traceback
failed = {}
for name in json.loads(MODULES_AS_JSON):
    try:
        importlib.import_module(name)
    except Exception:
        failed[name] = traceback.format_exc().strip().splitlines()[-3:]
print(json.dumps(failed))
"""


def folder_of(package: str) -> Path:
    return next(folder / package for folder in ROOTS if (folder / package).is_dir())


def modules_of(folder: Path) -> list[str]:
    files = [file for file in files_below(folder, "*.py") if "share" not in import_path(file).parts]
    names = [".".join(import_path(file).with_suffix("").parts) for file in files]
    return [name.removesuffix(".__init__") for name in names if not name.endswith("__main__")]


@pytest.fixture
def empty_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("ROS_HOME", str(tmp_path / "home"))
    return tmp_path


@pytest.mark.parametrize("packages", [FLOORS, FACADES], ids=["core", "facades"])
def test_every_module_can_be_imported_without_what_only_posix_has(packages: Sequence[str]) -> None:
    """One process imports many modules, because a failed import does not affect the others."""
    modules = [module for package in packages for module in modules_of(folder_of(package))]
    assert set(packages) <= set(modules)
    modules = [module for module in modules if module not in NEED_PYKDL]
    failed = run_without_posix(f"MODULES_AS_JSON = {json.dumps(modules)!r}\n{IMPORT_ALL}")
    assert json.loads(failed) == {}


@pytest.mark.parametrize("work", PROGRAMS)
def test_pure_libraries_work_without_posix(work: str, empty_folder: Path) -> None:
    assert run_without_posix(f"{BEGINNING}{PROGRAMS[work]}\nprint('done')") == "done\n"


@pytest.mark.parametrize("work", [*PROGRAMS, *LIMITS])
def test_programs_work_in_a_browser(work: str, empty_folder: Path) -> None:
    code = f"{BEGINNING}{(PROGRAMS | LIMITS)[work]}\nprint('done')"
    assert run_without_posix(code, in_browser=True) == "done\n"


def test_the_blocks_of_the_page_for_browsers_work_in_a_browser(empty_folder: Path) -> None:
    text = documents.text_of("guides/tab.md")
    blocks = re.findall(r"^```python\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)
    assert len(blocks) == 4
    printed = run_without_posix("\n".join(blocks), in_browser=True)
    assert "example.bag 5 messages\n  /chatter std_msgs/String\nfirst:\n/chatter\n" in printed


@pytest.mark.parametrize(
    "attempt",
    ["threading.Thread(target=print).start()", "subprocess.run(['true'])", "socket.socket().listen()"],
)
def test_the_browser_of_these_tests_starts_and_connects_nothing(attempt: str) -> None:
    code = f"try:\n    {attempt}\nexcept RuntimeError as error:\n    print(error)"
    shown = run_without_posix(code, in_browser=True)
    assert shown == "a browser starts no threads or processes, and connects no sockets\n"
