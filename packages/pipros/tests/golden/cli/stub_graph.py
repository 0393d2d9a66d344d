"""The graph of a transcript: registrations without nodes, and slave APIs with canned responses.

Uses only the standard library, so that the same graph works with genuine ROS and with pipros.
"""

from __future__ import annotations

import threading
from collections.abc import Sequence
from typing import Any
from xmlrpc.client import ServerProxy
from xmlrpc.server import SimpleXMLRPCRequestHandler, SimpleXMLRPCServer

PID = 4242
UNREACHABLE = "http://127.0.0.1:1/"


class _Handler(SimpleXMLRPCRequestHandler):
    rpc_paths = ("/", "/RPC2")


class StubNode:
    """A registered node that implements the slave API, without real topics."""

    def __init__(self, name: str, master_uri: str, bus_info: Sequence[Sequence[Any]] = ()) -> None:
        self.name = name
        self._bus_info = [list(line) for line in bus_info]
        self._master: Any = ServerProxy(master_uri)
        self._server = SimpleXMLRPCServer(("127.0.0.1", 0), requestHandler=_Handler, logRequests=False)
        self.api = f"http://127.0.0.1:{self._server.server_address[1]}/"
        self.shutdown_requested = threading.Event()
        for method in (self.getPid, self.getBusInfo, self.shutdown, self.publisherUpdate):
            self._server.register_function(method)
        self._thread = threading.Thread(target=self._server.serve_forever, args=(0.02,))
        self._thread.start()

    def publishes(self, topic: str, type_name: str) -> StubNode:
        self._master.registerPublisher(self.name, topic, type_name, self.api)
        return self

    def subscribes(self, topic: str, type_name: str) -> StubNode:
        self._master.registerSubscriber(self.name, topic, type_name, self.api)
        return self

    def serves(self, service: str) -> StubNode:
        self._master.registerService(self.name, service, "rosrpc://127.0.0.1:1", self.api)
        return self

    def getPid(self, _caller: str) -> list[Any]:  # noqa: N802 - the names of the slave API
        return [1, "", PID]

    def getBusInfo(self, _caller: str) -> list[Any]:  # noqa: N802
        return [1, "bus info", self._bus_info]

    def shutdown(self, _caller: str, _reason: str = "") -> list[Any]:
        self.shutdown_requested.set()
        return [1, "shutdown", 0]

    def publisherUpdate(self, *_update: Any) -> list[Any]:  # noqa: N802
        return [1, "", 0]

    def close(self) -> None:
        self._master("close")()
        self._server.shutdown()
        self._thread.join()
        self._server.server_close()


class StubGraph:
    """Register three nodes that respond and a dead one, as most transcripts need.

    `/talker` and `/ns/camera` publish, `/ns/listener` subscribes, `/gone` cannot be reached.
    """

    def __init__(self, master_uri: str) -> None:
        listener = StubNode("/ns/listener", master_uri)
        talker = StubNode(
            "/talker",
            master_uri,
            bus_info=[
                [1, "/ns/listener", "o", "TCPROS", "/chatter", True, "TCPROS connection on port 40001"],
                [2, "/rosout", "o", "TCPROS", "/rosout", 1],
                [3, listener.api, "i", "TCPROS", "/clock", True, "TCPROS connection"],
                [4, "http://127.0.0.1:1/", "i", "TCPROS", "/late", False],
                [5, "/inside", "b", "INTRAPROCESS", "/loop", True],
            ],
        )
        camera = StubNode("/ns/camera", master_uri)
        self._nodes = [talker, listener, camera]
        talker.publishes("/chatter", "std_msgs/String").publishes("/rosout", "rosgraph_msgs/Log")
        talker.subscribes("/clock", "rosgraph_msgs/Clock")
        talker.serves("/talker/set_logger_level").serves("/talker/get_loggers")
        listener.subscribes("/chatter", "std_msgs/String").subscribes("/ns/unknown", "*")
        camera.publishes("/ns/image", "sensor_msgs/Image").publishes("/chatter", "std_msgs/String")
        with ServerProxy(master_uri) as master:
            master.registerPublisher("/gone", "/ghost", "nowhere_msgs/Ghost", UNREACHABLE)

    def close(self) -> None:
        for node in self._nodes:
            node.close()
