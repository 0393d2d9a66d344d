"""Test whether the master can connect to this machine, as it must when publishers change."""

from __future__ import annotations

import threading
import time
from contextlib import suppress
from typing import Any

from pipros.basics import names
from pipros.basics.env import Environment
from pipros.basics.errors import PiprosError
from pipros.net import address
from pipros.net.loop import BackgroundLoop
from pipros.net.master_client import MasterClient
from pipros.net.rpc_server import RpcServer

WAIT_S = 0.8


def uncalled_address(environment: Environment, *, timeout_s: float) -> str:
    """Return a URI that was registered with the master but that the master did not call within a second.

    The result is empty if the master called the URI, or if the test is not possible because no port is free
    or the master does not answer. A subscriber and a publisher of a new topic are registered briefly, because
    the master notifies a subscriber of a new publisher.
    """
    name = f"/{names.anonymous('pipros_doctor')}"
    called = threading.Event()

    def publisher_update(*_: Any) -> list[Any]:
        called.set()
        return [1, "", 0]

    table = {
        "publisherUpdate": publisher_update,
        "getPid": lambda *_: [1, "", 0],
        "shutdown": lambda *_: [1, "", 0],
    }
    loop = BackgroundLoop("call from the master")
    master = MasterClient(environment.master_uri, name, timeout_s=timeout_s)
    loop.start()
    try:
        advertised = address.advertised_address(environment)
        server = RpcServer(table, host=address.bind_host(environment), port=environment.port_range or 0)
        loop.run(server.start())
        uri = address.uri(*advertised.outside(server.port))
        topic = f"{name}/called"
        until = time.monotonic() + WAIT_S
        try:
            master.register_subscriber(topic, "std_msgs/Empty", uri)
            master.register_publisher(topic, "std_msgs/Empty", uri)
            return "" if called.wait(max(until - time.monotonic(), WAIT_S / 2)) else uri
        finally:
            with suppress(PiprosError):
                master.unregister_publisher(topic, uri)
                master.unregister_subscriber(topic, uri)
            loop.run(server.stop())
    except (OSError, PiprosError):
        return ""
    finally:
        master.close()
        loop.stop()
