from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from pipros_tools.launch.command import NodeCommand
from pipros_tools.launch.managed_node import ManagedNode, ProcessInfo
from pipros_tools.launch.model import LaunchNode, Output


def process(*, exit_code: int | None = None, has_group: bool = False) -> Any:
    return SimpleNamespace(pid=4711, exit_code=exit_code, has_group=has_group)


@pytest.fixture
def managed() -> ManagedNode:
    command = NodeCommand(("/bin/talker", "x"), {"PATH": "/bin", "A": "1"}, {"A": "1"}, Path("/"))
    node = LaunchNode("talkers", "talker", "n", respawn=True, respawn_delay_s=2.5)
    return ManagedNode("n-1", node, command, Output.LOG, 1)


def test_a_running_process_is_described_under_noetics_names(managed: ManagedNode) -> None:
    managed.process = managed.latest = process()
    managed.spawn_count = 2
    assert managed.info().as_struct() == {
        "name": "n-1", "package": "talkers", "pid": 4711, "alive": True, "spawn_count": 2,
        "args": ["/bin/talker", "x"], "env": {"A": "1"}, "respawn": True, "respawn_delay": 2.5,
        "required": False, "log_output": True,
    }  # fmt: skip


def test_a_process_that_has_ended_has_an_exit_code() -> None:
    ended = ProcessInfo("n-1", LaunchNode("p", "t", "n"), 1, -2, 1, arguments=(), environment={})
    assert not ended.is_alive
    assert ended.as_struct()["exit_code"] == -2


def test_a_node_is_done_when_it_neither_runs_nor_respawns(managed: ManagedNode) -> None:
    assert managed.is_done
    managed.process = process()
    assert not managed.is_done
    managed.process, managed.restart_at = None, 5.0
    assert not managed.is_done
    managed.restart_at, managed.left_behind = None, process(exit_code=0, has_group=True)
    assert not managed.is_done
    managed.left_behind = process(exit_code=0)
    assert managed.is_done
    assert managed.left_behind is None
