import shutil
from collections.abc import Callable, Iterator

import pytest

from tests.browser.chromium import (  # noqa: F401 # fixtures and a hook
    chromium,
    open_tab,
    pytest_runtest_teardown,
    steady_network,
)
from tests.support import windows
from tests.support.environments import EXAMPLES
from tests.support.ros import RosSystem
from tests.support.windows import DRIVE, WindowsProgram

StartOnWindows = Callable[..., WindowsProgram]
_TRACES = "import faulthandler; faulthandler.dump_traceback_later(60)"
"""Each Python prints its stacks after a minute. Under a load of 40, nodes print something after 20 s."""


@pytest.fixture
def environment() -> Iterator[None]:
    """Have the environment for one test at a time, also beside other processes of pytest."""
    with windows.locked():
        windows.make()
        windows.keep_wine()
        yield
        windows.end_programs()


@pytest.fixture
def workspace(environment: None) -> None:
    """Build the case study's workspace as `C:\\ws` with Windows's programs, once for each installation."""
    built = DRIVE / "ws" / "built_by"
    if not built.exists() or built.read_text() != windows.INSTALLED.read_text():
        shutil.rmtree(DRIVE / "ws", ignore_errors=True)
        shutil.copytree(EXAMPLES, DRIVE / "ws" / "src")
        made = WindowsProgram(["catkin_make"], folder=DRIVE / "ws")
        try:
            assert made.wait(300) == 0, made.output
        finally:
            windows.end_programs()
            made.close()
        built.write_text(windows.INSTALLED.read_text())


@pytest.fixture
def start(ros: RosSystem, workspace: None) -> Iterator[StartOnWindows]:
    """Start a program of Windows in the system of the test, with the built workspace."""
    (DRIVE / "traces").mkdir(exist_ok=True)
    (DRIVE / "traces" / "sitecustomize.py").write_text(_TRACES)
    variables = {
        "PYTHONPATH": r"C:\traces", "ROS_MASTER_URI": ros.master_uri, "ROS_IP": "127.0.0.1",
        "ROS_PACKAGE_PATH": r"C:\ws\src", "CMAKE_PREFIX_PATH": r"C:\ws\devel", "PIPROS_LIMITS": "login_s=60",
    }  # fmt: skip
    started: list[WindowsProgram] = []

    def start_one(*command: str) -> WindowsProgram:
        started.append(WindowsProgram(command, variables))
        return started[-1]

    yield start_one
    windows.end_programs()
    for program in started:
        program.close()
