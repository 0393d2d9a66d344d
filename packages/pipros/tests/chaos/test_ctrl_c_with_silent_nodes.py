"""Ctrl-C ends tools at once while they wait for nodes that accept connections and never respond."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from contextlib import closing

import pytest

from pipros.master.master import Master
from pipros.net.master_client import MasterClient
from tests.support.processes import Process, Processes
from tests.support.slaves import SilentSlave

AT_ONCE_S = 30.0
"""Half a second is promised; every look at a silent node takes 100 s here."""

PATIENT = """
import os, sys
from pipros.net.rpc_client import RpcClient
make = RpcClient.__init__
def make_patient(client, uri, *, timeout_s=None, **more):
    make(client, uri, timeout_s=100.0, **more)
    os.write(1, f'asks {uri}\\n'.encode())  # a daemon thread in print can abort the end of the interpreter
RpcClient.__init__ = make_patient
"""

TOOLS = {
    "rosnode ping -a": ["pipros_tools.cli.rosnode", "ping", "-a"],
    "rosnode cleanup": ["pipros_tools.cli.rosnode", "cleanup"],
    "roswtf": ["pipros_tools.cli.roswtf", "--no-plugins"],
    "pipros doctor": ["pipros_tools.cli.doctor", "--timeout", "100"],
}


@pytest.fixture
def silent(master: Master) -> Iterator[SilentSlave]:
    """A node's address that is registered under five names."""
    slave = SilentSlave()
    for number in range(5):
        with closing(MasterClient(master.uri, f"/silent_{number}")) as client:
            client.register_publisher("/chat", "std_msgs/String", slave.api)
    yield slave
    slave.stop()


def start(processes: Processes, master: Master, tool: str) -> Process:
    module, *arguments = TOOLS[tool]
    code = f"{PATIENT}from {module} import main\nsys.exit(main({arguments}))"
    return processes.start(sys.executable, "-c", code, environment={"ROS_MASTER_URI": master.uri})


@pytest.mark.parametrize("tool", TOOLS)
def test_ctrl_c_ends_a_tool_that_waits_for_silent_nodes(
    processes: Processes, master: Master, silent: SilentSlave, tool: str
) -> None:
    process = start(processes, master, tool)
    process.wait_for(f"asks {silent.api}")  # the master has connected to it, too
    began = time.monotonic()
    process.press_ctrl_c()

    assert process.wait() == 0, process.output
    assert time.monotonic() - began < AT_ONCE_S, process.output
    assert "Traceback" not in process.output
    assert "Unable to contact" not in process.output
