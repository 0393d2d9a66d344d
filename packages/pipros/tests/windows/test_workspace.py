"""Workspaces and interrupts with Windows's programs."""

import re
import shutil
from pathlib import Path

import pytest

from tests.support import windows
from tests.support.windows import DRIVE, WindowsProgram

pytestmark = pytest.mark.timeout(500)  # on busy processors, building a workspace takes minutes under Wine

_FILE = """\
cmake_minimum_required(VERSION 3.0.2)
project(found_scripts)
find_package(catkin REQUIRED)
catkin_package()
file(GLOB scripts ${CMAKE_CURRENT_SOURCE_DIR}/scripts/*.py)
catkin_install_python(PROGRAMS ${scripts} DESTINATION ${CATKIN_PACKAGE_BIN_DESTINATION})
get_filename_component(name ${CMAKE_CURRENT_LIST_FILE} NAME)
message(STATUS "name=${name}")
install(DIRECTORY scripts DESTINATION share REGEX "scripts/two" EXCLUDE)
"""


@pytest.fixture
def folder(environment: None) -> Path:
    folder = DRIVE / "temp" / "my \u015fpace"  # the code page 437 of Wine's consoles lacks \u015f
    shutil.rmtree(folder, ignore_errors=True)
    scripts = folder / "src" / "found_scripts" / "scripts"
    scripts.mkdir(parents=True)
    (scripts.parent / "CMakeLists.txt").write_text(_FILE)
    (scripts.parent / "package.xml").write_text(
        "<package format='2'><name>found_scripts</name><version>1.0.0</version><description>d</description>"
        "<maintainer email='a@b.de'>m</maintainer><license>BSD</license>"
        "<buildtool_depend>catkin</buildtool_depend></package>"
    )
    for name in ("one", "two"):
        (scripts / f"{name}.py").write_text("#!/usr/bin/env python3\nprint(1)\n")
    return folder


def lines_of(command: list[str], folder: Path) -> list[str]:
    program = WindowsProgram(command, folder=folder)
    try:
        assert program.wait(120) == 0, program.output
    finally:
        windows.end_programs()
        program.close()
    return program.lines


def test_a_workspace_is_installed_and_set_up(folder: Path) -> None:
    assert "-- name=CMakeLists.txt" in lines_of(["catkin_make", "install"], folder)
    installed = folder / "install"
    assert {"one.py", "two.py"} <= {path.name for path in (installed / "lib" / "found_scripts").iterdir()}
    assert [path.name for path in (installed / "share" / "scripts").iterdir()] == ["one.py"]
    (folder / "show.bat").write_bytes(
        b"@call devel\\setup.bat\r\n@rospack find found_scripts\r\n"
        b'@if exist "%CMAKE_PREFIX_PATH%\\setup.bat" echo found %CMAKE_PREFIX_PATH%\r\n'
    )
    lines = lines_of(["cmd", "/c", "show.bat"], folder)
    assert re.fullmatch(r"C:\\temp\\.*\\found_scripts", lines[-2])
    assert re.fullmatch(r"found C:\\temp\\[ -~]+", lines[-1]), "not in Windows's short names"


def test_an_interrupt_from_a_thread_ends_a_sleep(environment: None) -> None:
    code = (
        "import threading, time\n"
        "from pipros.basics.interrupts import interrupt_main_thread\n"
        "threading.Timer(0.5, interrupt_main_thread).start()\n"
        "try: time.sleep(1000)\n"
        "except KeyboardInterrupt: print('interrupted')\n"
    )
    assert "interrupted" in lines_of(["python", "-c", code], DRIVE)
