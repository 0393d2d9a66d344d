"""Run a navigation node of pipros and the genuine one, on the same messages, and compare their interfaces."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from pipros.basics.env import Environment
from pipros.basics.errors import PiprosError
from pipros.graph.services import type_of
from pipros.graph.system_state import of_node, read_state
from pipros.msg import load_message_class, load_service_class
from pipros.node import Node
from tests.support.navigation_oracle import add_to
from tests.support.nodes import Inbox
from tests.support.processes import Process
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

SIDES = ("pipros", "genuine")


class BothNodes:
    """Two nodes with the same parameters and inputs. Their outputs, and their `/tf`, are in namespaces."""

    def __init__(self, node: Node, processes: list[Process], name: str) -> None:
        self.node = node
        self.name = name
        self._processes = processes
        self._publishers: dict[str, Any] = {}
        self.transforms = self.inboxes("tf", "tf2_msgs/TFMessage")

    def inboxes(self, topic: str, type_name: str) -> dict[str, Inbox]:
        """Subscribe to a topic of both sides."""
        inboxes = {side: Inbox() for side in SIDES}
        for side, inbox in inboxes.items():
            self.node.subscribe(f"/{side}/{topic}", load_message_class(type_name), inbox)
        return inboxes

    def publish(self, topic: str, message: Any, *, to: Sequence[str] = ("/",), subscribers: int = 2) -> None:
        """Publish on a topic to which both nodes subscribe, below each of the namespaces `to`."""
        for namespace in to:
            self._publisher(f"{namespace}{topic}", type(message), subscribers).publish(message)

    def _publisher(self, name: str, message_class: Any, subscribers: int) -> Any:
        """Return a publisher with this number of subscribers."""
        if name not in self._publishers:
            latch = name.endswith(("/tf_static", "/map"))
            self._publishers[name] = self.node.advertise(name, message_class, queue_size=1000, latch=latch)
        publisher = self._publishers[name]
        wait_until(lambda: publisher.connection_count >= subscribers, 60, lambda: f"{name}: {self.output}")
        return publisher

    def publish_tf(self, message: Any) -> None:
        """Publish on `/tf` of both sides, to the node and to `transforms`."""
        self.publish("tf", message, to=[f"/{side}/" for side in SIDES], subscribers=2)

    def call(self, service: str, type_name: str, **values: Any) -> list[Any]:
        """Call a service of both nodes; return the responses."""
        service_class: Any = load_service_class(type_name)
        request = service_class._request_class(**values)
        clients = [self.node.client(f"/{side}/{service}", service_class) for side in SIDES]
        return [client.call(request, timeout_s=60.0) for client in clients]

    def try_call(self, service: str, type_name: str, **values: Any) -> list[Any] | None:
        """Like `call`, but return None if one of the nodes fails."""
        try:
            return self.call(service, type_name, **values)
        except PiprosError:
            return None

    def settle(self, service: str, type_name: str) -> None:
        """Call a service of each node, so that both have handled earlier messages. The calls may fail."""
        service_class: Any = load_service_class(type_name)
        request = service_class._request_class()
        for side in SIDES:
            with suppress(PiprosError):
                self.node.client(f"/{side}/{service}", service_class).call(request, timeout_s=60.0)

    def parameters(self) -> list[dict[str, Any]]:
        """Return the private parameters of both nodes."""
        found: list[Any] = [self.node.params.get(f"/{side}/{self.name}") for side in SIDES]
        return found

    @property
    def output(self) -> list[str]:
        return [process.output for process in self._processes]

    def interface(self, side: str) -> dict[str, dict[str, str]]:
        """Return the types of topics and services of one side by name, without the namespace."""
        found = read_state(self.node.master)
        assert found is not None
        state, types = found
        node = f"/{side}/{self.name}"

        def named(names: Sequence[str]) -> list[str]:
            return [name for name in names if name not in ("/rosout", "/clock")]

        return {
            "publications": {
                _short(name, side): types[name] for name in named(of_node(node, state.publishers))
            },
            "subscriptions": {_short(name, side): "" for name in named(of_node(node, state.subscribers))},
            "services": {
                _short(name, side): type_of(self.node.master, name) or ""
                for name in of_node(node, state.services)
            },
        }


def _short(name: str, side: str) -> str:
    return name.removeprefix(f"/{side}")


@contextmanager
def both_nodes(
    ros: RosSystem,
    package: str,
    program: str,
    parameters: Mapping[str, Any],
    *,
    name: str = "node",
    before: Callable[[Node], object] = lambda _: None,
    remaps: Sequence[str] = (),
    arguments: Sequence[str] = (),
) -> Iterator[BothNodes]:
    """Run both nodes with these parameters and arguments; `before` is called before they start."""
    ros.serve_master()
    folder = add_to(ros.genuine)
    with Node("test", environment=Environment(master_uri=ros.master_uri)) as node:
        for side in SIDES:
            node.params.set(f"/{side}/{name}", dict(parameters))
        before(node)
        commands: dict[str, list[str | Path]] = {
            "pipros": ["rosrun", package, program],
            "genuine": [folder / "lib" / package / program],
        }
        processes = [
            getattr(ros, side).start(
                *commands[side], *arguments, f"__name:={name}", f"__ns:=/{side}", f"/tf:=/{side}/tf", *remaps
            )
            for side in SIDES
        ]
        yield BothNodes(node, processes, name)
        for process in processes:
            process.press_ctrl_c()
            process.wait()
