"""Genuine rclpy goes on after large messages that lose datagrams and are displaced before they arrive."""

import signal
import sys
from pathlib import Path

import pytest

from tests.support.dds_peers import enable_multicast
from tests.support.environments import file_of_tests
from tests.support.network import LoneNetwork, needs_network
from tests.support.processes import Processes
from tests.support.ros2_wheels import DISTROS, environment

pytestmark = needs_network


@pytest.mark.parametrize("loss", [0.1, 0.2])
@pytest.mark.parametrize("distro", DISTROS)
def test_rclpy_takes_later_messages_and_ends_after_lost_fragments(
    distro: str, loss: float, tmp_path: Path, processes: Processes
) -> None:
    """Fast DDS's `take` never returns if a GAP names a sample of which the reader has fragments."""
    network = LoneNetwork("127.0.0.1 localhost\n")
    try:
        enable_multicast(network)
        python = str(environment(distro) / "bin" / "python")
        private = 'mount -t tmpfs shm /dev/shm && exec "$@"'
        words = (
            "sh", "-c", private, "sh", python,
            str(file_of_tests("interop/programs/genuine_ros2_listener.py")),
        )  # fmt: skip
        listener = processes.start(*network.command(*words))
        listener.wait_for("^ready$")
        talker = processes.start(
            *network.command(sys.executable, str(file_of_tests("interop/programs/lossy_texts.py")), str(loss))
        )

        talker.wait_for("^sent$")
        listener.wait_for("^short [0-9]+ recent$")
        listener.send_signal(signal.SIGINT)
        listener.wait()  # its exit code depends on where rclpy and Python notice the signal
    finally:
        processes.end_all()
        network.close()
