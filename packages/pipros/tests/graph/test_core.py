"""A master and `/rosout` in the test's own process."""

from __future__ import annotations

import os
import socket
from pathlib import Path

import pytest

from pipros_tools.launch.roscore import Core


def open_files(folder: Path) -> list[str]:
    links = [f"/proc/self/fd/{number}" for number in os.listdir("/proc/self/fd")]
    return [os.readlink(link) for link in links if os.path.realpath(link).startswith(str(folder))]


def test_a_core_whose_port_is_in_use_closes_its_log(tmp_path: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        core = Core(port=taken.getsockname()[1], log_folder=tmp_path)
        with pytest.raises(OSError, match="in use"):
            core.start()
    assert open_files(tmp_path) == []
