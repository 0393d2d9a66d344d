"""Unix streams connect nodes of one user and network, whatever their other namespaces; others use TCP."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Iterator

import pytest

from pipros.master.master import Master
from tests.support.network import FarNetwork, needs_network
from tests.support.users import STRANGER, needs_other_users

# Another user may not be able to read pipros. Before the process gives up its rights, a node that hears
# itself has therefore imported everything that a publisher and a subscriber import as they need it.
NODE = """
import encodings.idna, os, sys, threading, time
from pipros.basics.env import Environment
from pipros.msg import load_message_class
from pipros.node import Node
uri, name, user, role, host = sys.argv[1:]
Image = load_message_class("sensor_msgs/Image")
environment = Environment(master_uri=uri, ip=host or None)
with Node(name + "_first", environment=environment) as first:
    heard = threading.Event()
    first.advertise("unused_" + name, Image, latch=True).publish(Image(data=bytes(300_000)))
    first.subscribe("unused_" + name, Image, lambda message: heard.set())
    assert heard.wait(60)
if int(user):
    os.setgid(int(user))
    os.setuid(int(user))
node = Node(name, environment=environment)
node.start()
if role == "publish":
    publisher = node.advertise("images", Image, queue_size=10)
    print("ready", flush=True)
    while True:
        publisher.publish(Image(data=bytes(300_000)))
        time.sleep(0.05)
else:
    def show(message):
        links = node.endpoints.subscription("/images").links
        print(len(message.data), *(peer.link.transport for peer in links), flush=True)
    node.subscribe("images", Image, show)
    time.sleep(1000)
"""


class Programs:
    """Nodes in processes of their own."""

    def __init__(self, uri: str) -> None:
        self.uri = uri
        self._started: list[subprocess.Popen[str]] = []

    def start(self, name: str, role: str, user: int = 0, prefix: tuple[str, ...] = (), host: str = "") -> str:
        """Start a node, and return the first line that it prints."""
        command = [*prefix, sys.executable, "-c", NODE, self.uri, name, str(user), role, host]
        environment = {**os.environ, "PIPROS_LOCAL": "on"}
        process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment)
        self._started.append(process)
        assert process.stdout is not None
        return process.stdout.readline().strip()

    def close(self) -> None:
        for process in self._started:
            process.kill()
            process.communicate()


@pytest.fixture
def programs(master: Master) -> Iterator[Programs]:
    started = Programs(master.uri)
    yield started
    started.close()


@needs_other_users
def test_two_ordinary_users_use_tcp_and_each_of_them_streams(programs: Programs) -> None:
    assert programs.start("talker", "publish", STRANGER) == "ready"
    assert programs.start("same", "subscribe", STRANGER) == "300000 PIPROSLOCAL"
    assert programs.start("other", "subscribe", STRANGER + 1) == "300000 TCPROS"


@needs_other_users
@pytest.mark.skipif(shutil.which("unshare") is None, reason="needs unshare")
def test_other_mount_process_and_ipc_namespaces_make_no_difference(programs: Programs) -> None:
    unshare = (
        str(shutil.which("unshare")),
        "--mount",
        "--propagation=unchanged",  # the root of a chroot is not a mount point
        "--pid",
        "--ipc",
        "--fork",
        "--kill-child",
        "--mount-proc",
    )
    assert programs.start("talker", "publish") == "ready"
    assert programs.start("contained", "subscribe", prefix=unshare) == "300000 PIPROSLOCAL"


@needs_network
def test_another_network_namespace_uses_tcp() -> None:
    far = FarNetwork()
    try:
        with Master(host="0.0.0.0", port=0, allow=["10.0.0.0/8"]) as master:  # noqa: S104
            programs = Programs(f"http://{far.near}:{master.port}")
            try:
                assert programs.start("talker", "publish", host=far.near) == "ready"
                prefix = tuple(far.command())
                line = programs.start("far", "subscribe", prefix=prefix, host=far.far)
                assert line == "300000 TCPROS"
            finally:
                programs.close()
    finally:
        far.close()
