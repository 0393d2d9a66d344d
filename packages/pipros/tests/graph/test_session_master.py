"""A launch that uses a master started by another program."""

from __future__ import annotations

from pathlib import Path

from pipros.basics.env import Environment
from pipros.master.master import Master
from pipros.master.options import MasterOptions
from pipros_tools.launch.console import Console
from pipros_tools.launch.session_master import SessionMaster


def test_a_running_master_without_a_run_id_gets_one_and_keeps_it(master: Master, tmp_path: Path) -> None:
    environment = Environment(master_uri=master.uri)

    def found() -> SessionMaster:
        return SessionMaster(
            environment, MasterOptions(), Console(), is_core=False, port=None, on_shutdown=lambda: None
        )

    first, second = found(), found()
    assert first.find() == ""
    first.start("run-1", tmp_path)
    assert (first.sets_run_id, first.is_own) == (True, False)
    assert second.find() == "run-1"
    second.start("run-2", tmp_path)
    assert not second.sets_run_id
    assert found().find() == "run-1"
