"""The simulation of other systems' lacks affects pipros in all processes, and nothing else."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.environments import FACADES, REPOSITORY, source
from tests.support.lacks import SYSTEMS, environment

FILE = str(source("pipros") / "probe.py")

RUNNER = """
import sys
code = sys.stdin.read()
exec(compile(code, {file!r}, "exec"), {{"__file__": {file!r}, "__name__": "pipros.probe"}})
"""

LACKS = """
import importlib, os, sys
from pathlib import Path

def works(attempt):
    try:
        exec(compile(attempt, __file__, "exec"), globals())
    except (AttributeError, ImportError, OSError, ValueError):
        return False
    return True

for attempt in sys.argv[1:]:
    print(attempt, "|", works(attempt))
"""

ON_NEITHER = [
    "import os; os.memfd_create",
    "import os; os.pipe2",
    "import select; select.epoll",
    "import socket; socket.SO_PEERCRED",
    "import socket; socket.socket(socket.AF_UNIX).bind('\\0name')",
    "from selectors import EpollSelector",
    "open('/proc/self/stat')",
    "Path('/proc/self/stat').read_bytes()",
    "Path('/proc/self/stat').stat()",
    "os.listdir('/proc')",
    "os.readlink('/proc/self/exe')",
]
ON_MACOS = [
    "import fcntl, pwd, resource, termios",
    "import os; os.fork",
    "import signal; signal.SIGKILL",
    "import select; select.poll",
    "import socket; socket.AF_UNIX, socket.TCP_KEEPALIVE",
]
ON_BOTH = ["import ssl, subprocess, asyncio", "open(os.devnull)", "import signal; signal.SIGTERM"]


def run(system: str, code: str, *arguments: str, folder: Path | None = None, file: str = FILE) -> list[str]:
    """Run code as if it belonged to pipros, and return the lines that it prints."""
    ended = subprocess.run(
        [sys.executable, "-W", "error", "-c", RUNNER.format(file=file), *arguments],
        env={**os.environ, **environment(system)},
        input=code,
        capture_output=True,
        text=True,
        timeout=120,
        cwd=folder,
    )
    assert ended.returncode == 0, ended.stderr
    return ended.stdout.splitlines()


@pytest.mark.parametrize("system", SYSTEMS)
def test_what_a_system_lacks_is_missing_and_the_rest_is_there(system: str) -> None:
    expected = dict.fromkeys(ON_NEITHER, False) | dict.fromkeys(ON_BOTH, True)
    expected |= dict.fromkeys(ON_MACOS, system == "macos")
    assert run(system, LACKS, *expected) == [f"{attempt} | {works}" for attempt, works in expected.items()]


@pytest.mark.parametrize(("system", "names"), [("macos", "darwin posix"), ("windows", "win32 nt")])
def test_children_lack_the_same_even_isolated_ones(system: str, names: str) -> None:
    code = """
import os, subprocess, sys
print(sys.platform, os.name, flush=True)
shown = "import pipros_tools.launch.process as p; print(p.sys.platform, p.os.name)"
for options in ([], ["-I"], ["-I", "-S"]):
    subprocess.Popen([sys.executable, *options, "-c", shown], env={}).wait()
"""
    assert run(system, code) == [names] * 4


@pytest.mark.parametrize(
    "folder",
    [
        *FACADES,
        REPOSITORY / "packages" / "pipros" / "src",
        REPOSITORY / "packages" / "pipros" / "facades",
        REPOSITORY / "plugins" / "pipros-ros2" / "src",
    ],
)
def test_all_folders_of_sources_lack_the_same(folder: Path) -> None:
    assert folder.is_dir()
    code = "import sys; print(sys.platform)"
    assert run("windows", code, file=str(folder / "probe.py")) == ["win32"]


@pytest.mark.parametrize("system", SYSTEMS)
def test_modules_as_users_import_them_lack_the_same(system: str) -> None:
    shown = "import rospy, pipros_tools.launch.process as p; print(p.sys.platform)"
    ended = subprocess.run(
        [sys.executable, "-c", shown],
        env={**os.environ, **environment(system)},
        capture_output=True,
        text=True,
        timeout=120,
        check=True,
    )
    assert ended.stdout.split() == [{"macos": "darwin", "windows": "win32"}[system]]


@pytest.mark.parametrize("system", SYSTEMS)
def test_other_code_sees_linux(system: str, tmp_path: Path) -> None:
    (tmp_path / "elsewhere.py").write_text(
        "import os, sys, termios; print(sys.platform, os.name, os.path.exists('/proc/self'))"
    )
    code = "import sys; sys.path.insert(0, ''); import elsewhere"
    assert run(system, code, folder=tmp_path) == ["linux posix True"]


def test_processes_of_windows_get_no_signals_but_sigbreak() -> None:
    code = '''
import signal, subprocess, sys
from pipros.basics.posix import NEW_GROUP, interrupt

waits = """
import time
from pipros.basics import interrupts
interrupts.install()
print(flush=True)
time.sleep(60)
"""
for end in (subprocess.Popen.terminate, interrupt):
    with subprocess.Popen(
        [sys.executable, "-c", waits], stdout=subprocess.PIPE, stderr=subprocess.PIPE, creationflags=NEW_GROUP
    ) as child:
        child.stdout.readline()
        try:
            child.send_signal(signal.SIGFPE)
        except ValueError as error:
            print(error)
        end(child)
        print(child.stderr.read().decode().splitlines()[-1:])
'''
    assert run("windows", code) == [
        "Unsupported signal: 8",
        "[]",
        "Unsupported signal: 8",
        "['KeyboardInterrupt']",
    ]
