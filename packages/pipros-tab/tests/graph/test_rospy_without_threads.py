"""The tests of rospy's behaviour, with nodes that have no threads. Each runs here too, or is in LEFT_OUT."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any, Final

import pytest

from tests.graph import test_rospy_again, test_rospy_facade, test_rospy_process
from tests.support.environments import REPOSITORY
from tests.support.processes import Process, Processes
from tests.support.tab_hub import TabHub

THREADS: Final = "starts a thread"
CHILDREN: Final = "forks"
LEFT_OUT: Final = {
    "test_a_forked_child_ends_by_signals_and_takes_nothing_with_it": CHILDREN,
    "test_a_forked_child_may_start_its_own_node": CHILDREN,
    "test_a_node_logs_the_reason_of_a_requested_shutdown": "the test, which is outside, calls the node",
    "test_a_node_starts_without_openssl": "Pyodide has no OpenSSL; the hub of this test has",
    "test_a_node_waits_for_its_master_and_continues_when_it_starts": "the test is the master",
    "test_a_second_ctrl_c_ends_a_node_whose_hook_hangs": "the second raises KeyboardInterrupt",
    "test_a_signal_is_handled_while_another_library_owns_the_wakeup_descriptor": "runs asyncio",
    "test_a_signal_to_a_child_at_its_start_does_not_end_the_node": CHILDREN,
    "test_another_ctrl_c_ends_a_program_that_continues_after_its_node": THREADS,
    "test_ctrl_c_ends_a_second_node_that_was_made_in_another_thread": THREADS,
    "test_shutdown_joins_running_threads_and_forgets_ended_ones": THREADS,
    "test_simulated_time_follows_clock": THREADS,
}
"""Why a test does not run without threads."""

URI: Final = "http://127.0.0.1:11311/"
CALL: Final = """
import json, sys
from pipros.net.master_client import MasterClient
print(json.dumps(getattr(MasterClient(sys.argv[1], "/test"), sys.argv[2])(*json.loads(sys.argv[3]))))
"""


class TabProcesses(Processes):
    """Starts Python programs as workers of a tab."""

    def __init__(self, environment: Mapping[str, str], folder: Path, hub: TabHub) -> None:
        super().__init__(environment)
        self._folder, self._hub = folder, hub

    def start(
        self,
        *argv: str | Path,
        cwd: Path | None = None,
        stdin: int = subprocess.DEVNULL,
        environment: Mapping[str, str] | None = None,
    ) -> Process:
        """Start `python SCRIPT …`. The worker's socket takes the place of its standard input."""
        assert stdin == subprocess.DEVNULL
        words = ["python3", *map(str, argv[1:])]
        home = str(self._folder)
        variables = {"PIPROS_LOCAL": "off", "HOME": home, "ROS_HOME": home}
        program = {"argv": words, "env": variables, "folder": str(cwd or home)}
        command = (sys.executable, "-u", "-m", "tests.support.tab_process", "0", json.dumps(program))
        with self._hub.connect() as there:
            return super().start(*command, cwd=REPOSITORY, stdin=there.fileno(), environment=environment)


@pytest.fixture
def processes(processes: Processes, tmp_path: Path) -> Iterator[Processes]:
    with TabHub(tmp_path) as hub:
        started = TabProcesses(processes.environment, tmp_path, hub)
        yield started
        started.end_all()


@pytest.fixture
def master(processes: Processes, tmp_path: Path) -> SimpleNamespace:
    script = tmp_path / "master.py"
    script.write_text(
        "import time\nfrom pipros.master.master import Master\nMaster(port=11311).start()\n"
        "print('ready')\ntime.sleep(1000)\n"
    )
    processes.start(sys.executable, script).wait_for("ready")
    return SimpleNamespace(uri=URI)


class Client:
    """Calls the master of the tab: each method is one of `MasterClient`, in a program of its own."""

    def __init__(self, processes: Processes, script: Path) -> None:
        self._processes, self._script = processes, script

    def _call(self, method: str, *arguments: object) -> Any:
        ran = self._processes.run(sys.executable, self._script, URI, method, json.dumps(arguments))
        assert ran.returncode == 0, ran.output
        return json.loads(ran.stdout[-1])

    def __getattr__(self, method: str) -> Callable[..., Any]:
        return partial(self._call, method)


@pytest.fixture
def client(processes: Processes, tmp_path: Path) -> Client:
    script = tmp_path / "call.py"
    script.write_text(CALL)
    return Client(processes, script)


TESTS = {
    name: test
    for module in (test_rospy_again, test_rospy_facade, test_rospy_process)
    for name, test in vars(module).items()
    if name.startswith("test_")
}
globals().update({name: test for name, test in TESTS.items() if name not in LEFT_OUT})


def test_only_existing_tests_are_left_out() -> None:
    assert set(LEFT_OUT) < set(TESTS)
