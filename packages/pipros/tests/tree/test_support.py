"""Tools of the tests whose faults would leave tests out, or make them pass unnoticed."""

import json
import os
import subprocess
import sys
from contextlib import nullcontext
from dataclasses import asdict
from datetime import date
from pathlib import Path

import pytest

from tests.support import hunt, long_tests, quick
from tests.support.environments import REPOSITORY, ROOTS, TEST_PATH, project_files, source
from tests.support.lacks import SYSTEMS, environment
from tests.support.outcomes import Outcome, read_outcomes
from tests.support.processes import Processes
from tests.support.waiting import wait_until

OPTIONS = """
from tests.support.project_conftest import pytest_addoption, pytest_collection_modifyitems
from tests.support.project_conftest import pytest_runtest_makereport
from tests.support.outcomes import configure as pytest_configure
"""
"""A conftest.py with the tree's options, for tests outside of it."""
WITHOUT_GENUINE = """
from tests.support import genuine
genuine.missing_packages = lambda: ["python3-rospy"]
"""
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
    "import os; os.memfd_create", "import os; os.pipe2", "import select; select.epoll",
    "import socket; socket.SO_PEERCRED", "import socket; socket.socket(socket.AF_UNIX).bind('\\0name')",
    "from selectors import EpollSelector", "open('/proc/self/stat')", "Path('/proc/self/stat').read_bytes()",
    "Path('/proc/self/stat').stat()", "os.listdir('/proc')", "os.readlink('/proc/self/exe')",
]  # fmt: skip
ON_MACOS = [
    "import fcntl, pwd, resource, termios", "import os; os.fork", "import signal; signal.SIGKILL",
    "import select; select.poll", "import socket; socket.AF_UNIX, socket.TCP_KEEPALIVE",
]  # fmt: skip
ON_BOTH = ["import ssl, subprocess, asyncio", "open(os.devnull)", "import signal; signal.SIGTERM"]


def run_as(
    system: str, code: str, *arguments: str, folder: Path | None = None, file: str = FILE
) -> list[str]:
    """Run code as if it belonged to pipros, and return the lines that it prints."""
    ended = subprocess.run(
        [sys.executable, "-W", "error", "-c", RUNNER.format(file=file), *arguments],
        env={**os.environ, **environment(system)}, input=code, capture_output=True, text=True, timeout=120,
        cwd=folder,
    )  # fmt: skip
    assert ended.returncode == 0, ended.stderr
    return ended.stdout.splitlines()


@pytest.mark.parametrize("system", SYSTEMS)
def test_what_a_system_lacks_is_missing_and_the_rest_is_there(system: str) -> None:
    expected = dict.fromkeys(ON_NEITHER, False) | dict.fromkeys(ON_BOTH, True)
    expected |= dict.fromkeys(ON_MACOS, system == "macos")
    assert run_as(system, LACKS, *expected) == [f"{attempt} | {works}" for attempt, works in expected.items()]


@pytest.mark.parametrize(("system", "names"), [("macos", "darwin posix"), ("windows", "win32 nt")])
def test_children_lack_the_same_even_isolated_ones(system: str, names: str) -> None:
    code = """
import os, subprocess, sys
print(sys.platform, os.name, flush=True)
shown = "import pipros_tools.launch.process as p; print(p.sys.platform, p.os.name)"
for options in ([], ["-I"], ["-I", "-S"]):
    subprocess.Popen([sys.executable, *options, "-c", shown], env={}).wait()
"""
    assert run_as(system, code) == [names] * 4


def test_all_folders_of_sources_lack_the_same() -> None:
    code = """
import sys
for file in sys.argv[1:]:
    exec(compile("import sys; print(sys.platform)", file, "exec"), {"__file__": file, "__name__": "probe"})
"""
    files = [str(folder / "probe.py") for folder in ROOTS]
    assert run_as("windows", code, *files) == ["win32"] * len(files)


def run_pytest(folder: Path, *words: str, **variables: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", *words], cwd=folder,
        env={"PATH": "/usr/bin:/bin", "PYTHONPATH": str(REPOSITORY), **variables}, capture_output=True,
        text=True, timeout=120, check=False,
    )  # fmt: skip


def test_in_continuous_integration_missing_ros_is_an_error(tmp_path: Path) -> None:
    (tmp_path / "without_genuine.py").write_text(WITHOUT_GENUINE)
    words = ("-p", "without_genuine", "--collect-only", "packages/pipros/tests/interop")
    ended = run_pytest(REPOSITORY, *words, CI="true", PYTHONPATH=f"{tmp_path}:{REPOSITORY}")

    assert ended.returncode == pytest.ExitCode.USAGE_ERROR
    assert "genuine ROS 1 is needed here (CI is set) and lacks: python3-rospy" in ended.stderr


def test_an_archive_without_git_has_the_same_files(monkeypatch: pytest.MonkeyPatch) -> None:
    patterns = ("packages/pipros/src/*", "pyproject.toml")
    known = {file for file in project_files(*patterns) if file.is_file()}
    monkeypatch.setenv("PATH", "")
    found = set(project_files(*patterns))

    assert set() < known <= found


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder outside of the tree for tests that have its options."""
    (tmp_path / "conftest.py").write_text(OPTIONS)
    (tmp_path / "pytest.ini").write_text("[pytest]\n")
    monkeypatch.setenv("PYTHONPATH", str(REPOSITORY))
    return tmp_path


def test_in_continuous_integration_a_skipped_test_is_a_failure(folder: Path) -> None:
    (folder / "test_it.py").write_text("import pytest\ndef test_it(): pytest.skip('no zsh here')\n")

    here, in_ci = (run_pytest(folder, **variables) for variables in ({}, {"CI": "true"}))

    assert (here.returncode, in_ci.returncode) == (0, 1)
    assert "skipped, which nothing may be in continuous integration" in in_ci.stdout


OF_EACH_RESULT = """
import pytest

@pytest.fixture
def broken_at_the_end():
    yield
    raise OSError

@pytest.mark.parametrize("number", [1, 2])
def test_passes(number): pass

def test_fails(): assert False

def test_is_skipped(): pytest.skip("not here")

def test_cannot_end(broken_at_the_end): pass
"""


def test_passed_tests_are_not_run_again(folder: Path) -> None:
    (folder / "test_it.py").write_text(OF_EACH_RESULT)
    before = run_pytest(folder, "--outcomes-to=outcomes", "-n", "2").stdout
    after = run_pytest(folder, "--but-passed=outcomes").stdout

    assert "1 failed, 3 passed, 1 skipped, 1 error" in before
    results = {
        outcome.test.partition("::")[2]: outcome.result for outcome in read_outcomes(folder / "outcomes")
    }
    assert results == {
        "test_passes[1]": "passed", "test_passes[2]": "passed", "test_fails": "failed",
        "test_is_skipped": "skipped", "test_cannot_end": "failed",
    }  # fmt: skip
    assert "1 failed, 1 passed, 1 skipped" in after


FLAKY = """
from pathlib import Path
COUNT = Path(__file__).with_name("count")

def test_failed_once(): pass

def test_fails_now_and_then():
    runs = int(COUNT.read_text()) if COUNT.exists() else 0
    COUNT.write_text(str(runs + 1))
    assert runs not in (0, 1, 2)
"""


def written(folder: Path, *outcomes: Outcome) -> Path:
    file = folder / "outcomes"
    file.write_text("".join(json.dumps(asdict(outcome)) + "\n" for outcome in outcomes))
    return file


def test_two_failed_repetitions_fail_the_run_and_passed_ones_do_not(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (folder / "test_it.py").write_text(FLAKY)
    monkeypatch.setattr(hunt, "REPOSITORY", folder)  # `judge` runs tests of this repository only
    monkeypatch.setattr(hunt, "busy_processors", nullcontext)  # they would slow down other tests
    test = "test_it.py::test_fails_now_and_then"
    steady = Outcome("test_it.py::test_failed_once", "failed", 1.0, output="what it said")
    file = written(folder, steady, Outcome(test, "failed", 1.0))

    passes, report = hunt.judge(file, (), {}, times=3)
    (folder / "count").unlink()
    quarantined, _ = hunt.judge(
        file, (), {test: hunt.Quarantined(test, "a race", "1 of 10", date(2026, 11, 21))}, times=3
    )

    assert not passes
    assert "passed 3 of 3 repetitions" in report
    assert "what it said" in report
    assert "passed 0 of 2 repetitions" in report
    assert "assert 0 not in (0, 1, 2)" in report
    assert quarantined


def test_the_quarantine_is_short_and_explains_each_entry() -> None:
    for test in hunt.read_quarantine():
        assert (REPOSITORY / test.partition("::")[0]).is_file()


@pytest.mark.skipif(not Path("/proc/self/environ").exists(), reason="looks into /proc, which Linux has")
def test_a_process_that_outlives_its_parent_in_another_session_is_found_and_ended() -> None:
    parent = (
        "import subprocess, sys; subprocess.Popen([sys.executable, '-c', 'import signal; signal.pause()'], "
        "start_new_session=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)"
    )
    started = Processes({"PATH": "/usr/bin:/bin"})
    started.run(sys.executable, "-c", parent)
    wait_until(started.left, what="the orphan to be seen")

    with pytest.raises(AssertionError, match=r"left running:\n\d+: .*signal.pause"):
        started.assert_nothing_left(timeout_s=0.2)
    wait_until(lambda: not started.left(), what="the orphan to be gone")


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="needs Linux's subreapers")
def test_a_run_has_the_exit_code_of_its_command_and_leaves_nothing() -> None:
    stubborn = "import signal, time; signal.signal(signal.SIGTERM, signal.SIG_IGN); time.sleep(1000)"
    command = f"""
import subprocess, sys
subprocess.Popen([sys.executable, "-c", {stubborn!r}], start_new_session=True)
sys.exit(3)
"""
    started = Processes({"PATH": "/usr/bin:/bin", "PYTHONPATH": TEST_PATH})
    words = (sys.executable, "-m", "tests.support.leave_nothing", sys.executable, "-c", command)
    assert started.run(*words).returncode == 3
    assert started.left() == []


def test_each_line_names_a_test_that_exists() -> None:
    for line in long_tests.patterns():
        file, _, name = line.lstrip("0123456789 ").partition("::")
        (found,) = (each for top in ("packages", "plugins") if (each := REPOSITORY / top / file).is_file())
        text = found.read_text(encoding="utf-8")
        function = name.partition("[")[0]
        assert function == "*" or f"def {function}(" in text, line


def test_others_than_script_long_run_a_case_of_each_test_with_a_number() -> None:
    numbered = [line.split()[1] for line in long_tests.patterns() if line[0].isdigit()]
    cases = [f"packages/{test}[{case}]" for test in numbered for case in ("genuine master", "a", "b")]
    left = {case.partition("[")[0] for case in cases if case not in long_tests.find_long(cases)}
    assert left == {f"packages/{test}" for test in numbered}


def test_the_listed_files_exist_and_each_is_run_once() -> None:
    listed = quick.listed()
    assert len(listed) > 50
    assert [file for file in listed if not (REPOSITORY / file).is_file()] == []
    assert quick.to_run([]) == sorted(listed)


def test_script_test_refuses_a_name_that_is_no_package_or_plugin() -> None:
    ended = subprocess.run([REPOSITORY / "script/test", "navigator"], capture_output=True, text=True)
    assert (ended.returncode, ended.stdout) == (2, "")
    assert {"page", "robot", "pipros;"} < set(ended.stderr.partition(" one of: ")[2].split())
    assert ended.stderr.endswith(" pipros; got navigator\n")
