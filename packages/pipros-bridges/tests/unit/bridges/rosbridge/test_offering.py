"""Services that clients offer, with a node that the tests simulate."""

import threading
from typing import Any

from pipros_bridges.rosbridge.offering import OfferedServices

DEADLINE_S = 60


class SlowNode:
    """Node whose service `/slow` waits for the master."""

    def __init__(self) -> None:
        self.is_waiting = threading.Event()
        self.is_ready = threading.Event()
        self.served: list[str] = []

    def serve(self, name: str, *_: object) -> None:
        if name == "/slow":
            self.is_waiting.set()
            self.is_ready.wait(DEADLINE_S)
        self.served.append(name)


def test_a_service_that_takes_time_does_not_delay_those_of_other_clients() -> None:
    node: Any = SlowNode()
    client: Any = object()
    services = OfferedServices(node, filler=client, answer_s=1.0)
    slow = threading.Thread(target=services.offer, args=(client, "/slow", "std_srvs/Empty", "/slow"))
    slow.start()
    assert node.is_waiting.wait(DEADLINE_S)
    services.offer(client, "/fast", "std_srvs/Empty", "/fast")
    assert node.served == ["/fast"]
    node.is_ready.set()
    slow.join(DEADLINE_S)
    assert node.served == ["/fast", "/slow"]
