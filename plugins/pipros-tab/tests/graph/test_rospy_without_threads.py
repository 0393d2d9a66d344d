"""The tests of rospy's behaviour, with nodes that have no threads. Each runs here too, or is in LEFT_OUT.

The tests of `PROGRAMS` start programs, here as workers of a tab. The tests of `IN_PROCESS` have a master and
nodes in their own process: each of these modules runs in one worker.
"""

import json
import subprocess
import sys
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any, Final

import pytest

from pipros.net.local_stream import PROTOCOL
from tests.graph import (
    test_node_interfaces,
    test_node_services,
    test_node_topics,
    test_rospy_facade,
    test_rospy_process,
)
from tests.support.environments import REPOSITORY
from tests.support.processes import Process, Processes
from tests.support.tab_hub import TabHub
from tests.support.waiting import wait_until

again, start = test_rospy_process.again, test_rospy_process.start  # fixtures
PROGRAMS: Final = (test_rospy_facade, test_rospy_process)
IN_PROCESS: Final = (test_node_interfaces, test_node_services, test_node_topics)

THREADS: Final = "starts a thread"
CHILDREN: Final = "forks"
HELD: Final = "a callback waits for the test, which waits for the callback"
ASYNCIO: Final = "runs asyncio"
STREAMS: Final = "a tab has no Unix streams"
OUTSIDE: Final = "the test, which is outside, calls the node"
LEFT_OUT: Final = {
    "test_a_buffer_may_be_used_again_once_publish_has_returned": HELD,
    "test_a_child_forked_while_a_thread_imports_may_use_topics": THREADS,
    "test_a_forked_child_ends_by_signals_and_takes_nothing_with_it": CHILDREN,
    "test_a_forked_child_may_start_its_own_node": CHILDREN,
    "test_a_handler_from_before_the_node_comes_after_its_hooks": "the node ends after the handler",
    "test_a_malformed_request_ends_only_its_connection": "reads from a socket while the server must answer",
    "test_a_node_loads_openssl_with_its_first_use": "Pyodide has no OpenSSL; the hub of this test has",
    "test_a_node_logs_the_reason_of_a_requested_shutdown": OUTSIDE,
    "test_a_node_that_its_master_lost_registers_again_and_keeps_its_links": "claims a port of the machine",
    "test_a_node_waits_for_its_master_and_continues_when_it_starts": "the test is the master",
    "test_a_publisher_announced_during_the_registration_of_a_subscriber_is_received": THREADS,
    "test_a_script_prints": "reads the output of programs that it starts",
    "test_a_second_ctrl_c_ends_a_node_whose_hook_hangs": "the second raises KeyboardInterrupt",
    "test_a_server_that_closes_the_early_connection_is_connected_to_again": "the hub passes this on later",
    "test_a_signal_is_handled_while_another_library_owns_the_wakeup_descriptor": ASYNCIO,
    "test_a_signal_to_a_child_at_its_start_does_not_end_the_node": CHILDREN,
    "test_a_slow_callback_with_queue_size_1_sees_the_newest_message": HELD,
    "test_a_slow_handler_does_not_delay_other_calls": THREADS,
    "test_a_slow_subscriber_does_not_delay_the_others": HELD,
    "test_an_interrupted_early_connection_ends_the_call": THREADS,
    "test_another_ctrl_c_ends_a_program_that_survives_its_node": THREADS,
    "test_ctrl_c_ends_a_second_node_made_in_another_thread": THREADS, "test_links": THREADS,
    "test_forked_children_and_their_parent_get_only_their_own_answers": CHILDREN,
    "test_links_of_a_topic_unregistered_during_shutdown_are_closed": THREADS, "test_local_transport": STREAMS,
    "test_only_hooks_may_publish_while_the_node_ends": THREADS, "test_shared_memory": STREAMS,
    "test_shutdown_joins_running_threads_and_forgets_ended_ones": THREADS,
    "test_shutdown_waits_for_a_running_callback_that_ends_in_time": HELD,
    "test_simulated_time_follows_clock": THREADS,
    "test_spin_of_a_service_ends_with_the_service": THREADS,
    "test_the_end_of_a_node_ends_its_calls": THREADS,
    "test_the_last_published_message_arrives_although_the_node_ends": "the receiver is in the same worker",
    "test_threads_that_share_a_client_all_connect_early": THREADS,
    "test_topics_unregistered_during_shutdown_are_not_left_at_the_master": THREADS,
}  # fmt: skip
"""Why a test, or a module of tests of nodes, does not run without threads."""

FOLDER: Final = REPOSITORY / "packages" / "pipros" / "tests" / "graph"
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


def names_of(module: ModuleType) -> list[str]:
    return [name for name in vars(module) if name.startswith("test_")]


TESTS = {name: getattr(module, name) for module in PROGRAMS for name in names_of(module)}
globals().update({name: test for name, test in TESTS.items() if name not in LEFT_OUT})


@pytest.mark.parametrize("module", IN_PROCESS, ids=lambda module: module.__name__.rpartition(".")[2])
def test_nodes_of_one_worker(module: ModuleType, tmp_path: Path) -> None:
    assert module.__file__ is not None
    file = (FOLDER / Path(module.__file__).name).relative_to(REPOSITORY)
    left_out = [f"--deselect={file}::{name}" for name in names_of(module) if name in LEFT_OUT]
    options = ["-vv", "-o", "timeout=60", "--noconftest", "-p", "tests.support.node_fixtures"]
    words = [*options, "-p", "no:cacheprovider", "-k", f"not {PROTOCOL}", *left_out, str(file)]
    with TabHub(tmp_path) as hub:
        ran = hub.run("python3", "-m", "pytest", *words, folder=REPOSITORY)
        wait_until(lambda: not ran.is_running, 140.0, lambda: ran.output)
        assert ran.wait() == 0, ran.output


def test_only_existing_tests_are_left_out() -> None:
    modules = {file.stem for file in FOLDER.glob("test_*.py")}
    assert set(LEFT_OUT) < modules.union(TESTS, *map(names_of, IN_PROCESS))
