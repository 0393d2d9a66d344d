"""Nodes, the master and commands in Pyodide, one in each worker of Node.js, connected by the hub of a tab."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.pyodide.conftest import pyodide_files  # noqa: F401 # a fixture
from tests.support.pyodide_tab import PyodideTab
from tests.support.tab_programs import BROADCASTER, BUSY, CLIENT, FRAME_LISTENER, LIMITS, SERVER, TALKER

pytestmark = pytest.mark.timeout(900)  # several workers start Pyodide at the same time, on a busy machine

ENDS_WITHIN_S = 0.5


@pytest.fixture
def tab(pyodide_files: Path) -> Iterator[PyodideTab]:  # noqa: F811
    with PyodideTab(pyodide_files) as tab:
        tab.run("roscore").wait_for_output("started core service [/rosout]")
        yield tab


def test_nodes_in_workers_talk_call_each_other_and_end(tab: PyodideTab) -> None:
    talker, server = tab.start("talker", TALKER), tab.start("server", SERVER)
    client = tab.start("client", CLIENT)
    assert client.wait() == 0, client.output
    assert "the client is done" in client.output
    assert "tick" in server.output

    busy = tab.start("busy", BUSY)
    busy.wait_for_output("computing")
    listed = tab.run("rosnode", "list")
    assert listed.wait() == 0
    assert "/talker" in listed.output
    assert busy.stop() < ENDS_WITHIN_S

    assert talker.interrupt() < ENDS_WITHIN_S
    assert talker.code == 0
    assert talker.output.endswith("the hook ran\nthe talker ended\n")


def test_a_transform_passes_from_a_node_to_another_without_numpy(tab: PyodideTab) -> None:
    broadcaster, listener = tab.start("broadcaster", BROADCASTER), tab.start("frame_listener", FRAME_LISTENER)
    assert listener.wait() == 0, listener.output + broadcaster.output
    assert "turned" in listener.output


def test_a_program_in_a_worker_reaches_no_other_machine_and_starts_no_thread(pyodide_files: Path) -> None:  # noqa: F811
    with PyodideTab(pyodide_files) as tab:
        program = tab.start("limits", LIMITS)
        assert program.wait() == 0, program.output
