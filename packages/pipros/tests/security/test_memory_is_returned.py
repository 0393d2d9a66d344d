"""Memory that a bridge returns to the system when a client with large messages has left."""

from __future__ import annotations

import re
from pathlib import Path

from tests.support.ros import RosSystem
from tests.support.rosbridge import RosbridgeClient
from tests.support.waiting import wait_until

MIB = 1024 * 1024
LARGE_BYTES = 8 * MIB


def memory_bytes(pid: int) -> int:
    found = re.search(r"VmRSS:\s+(\d+)", Path(f"/proc/{pid}/status").read_text())
    assert found is not None
    return int(found[1]) * 1024


def test_what_a_client_made_the_server_use_is_returned_after_it_has_left(ros: RosSystem) -> None:
    ros.serve_master()
    server = ros.pipros.start("pipros", "serve", "--port", "0", "--control")
    url = server.wait_for(r"ws://\S+:\d+")[0]
    with RosbridgeClient(url) as first:  # everything is imported
        assert first.call("/none")["result"] is False
    before = memory_bytes(server.pid)
    most = before
    with RosbridgeClient(url) as large:
        large.send("advertise", topic="/a", type="std_msgs/String")
        for _ in range(5):
            large.send("publish", topic="/a", msg={"data": "x" * LARGE_BYTES})
            large.call("/none")
            most = max(most, memory_bytes(server.pid))
    assert most > before + LARGE_BYTES
    wait_until(lambda: memory_bytes(server.pid) < before + LARGE_BYTES // 2)
