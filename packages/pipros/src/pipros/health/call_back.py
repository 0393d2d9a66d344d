"""Test whether the master can connect to this machine, which it does when publishers change."""

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
    """Return a URI that was registered with the master but that the master did not call within `WAIT_S`.

    The result is empty if the master called the URI, or if the test is not possible because no port is free
    or the master does not answer. The test subscribes to a parameter and sets it briefly as another node,
    because the master notifies all subscribers except the node that sets the parameter. (Programs that record
    all topics would subscribe to a test topic.)
    """
    name = f"/{names.anonymous('pipros_doctor')}"
    called = threading.Event()

    def param_update(*_: Any) -> list[Any]:
        called.set()
        return [1, "", 0]

    table = {
        "paramUpdate": param_update,
        "getPid": lambda *_: [1, "", 0],
        "shutdown": lambda *_: [1, "", 0],
    }
    loop = BackgroundLoop("call from the master")
    master = MasterClient(environment.master_uri, name, timeout_s=timeout_s)
    setter = MasterClient(environment.master_uri, f"{name}_setter", timeout_s=timeout_s)
    loop.start()
    try:
        advertised = address.advertised_address(environment)
        server = RpcServer(table, host=address.bind_host(environment), port=environment.port_range or 0)
        loop.run(server.start())
        uri = address.uri(*advertised.outside(server.port))
        key = f"{name}_called"  # not in a namespace, which genuine masters would keep
        until = time.monotonic() + WAIT_S
        try:
            master.subscribe_param(uri, key)
            setter.set_param(key, True)
            return "" if called.wait(max(until - time.monotonic(), WAIT_S / 2)) else uri
        finally:
            with suppress(PiprosError):
                master.call("unsubscribeParam", uri, key)
                setter.delete_param(key)
            loop.run(server.stop())
    except (OSError, PiprosError):
        return ""
    finally:
        setter.close()
        master.close()
        loop.stop()
