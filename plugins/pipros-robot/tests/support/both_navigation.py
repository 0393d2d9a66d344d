"""Run a navigation node of pipros on the inputs of a recording, beside what the genuine node answered."""

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from typing import Any

from pipros.basics.env import Environment
from pipros.basics.errors import PiprosError
from pipros.msg import load_message_class, load_service_class
from pipros.node import Node
from pipros_tools.graph.services import type_of
from pipros_tools.graph.system_state import of_node, read_state
from tests.support.nodes import Inbox
from tests.support.processes import Process
from tests.support.recordings import Recording
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

SIDES = ("pipros", "genuine")


class BothNodes:
    """A node of pipros in the namespace `/pipros`, and the recording of the genuine one."""

    def __init__(self, node: Node, process: Process, name: str, recording: Recording) -> None:
        self.node, self.name, self.recording = node, name, recording
        self.services = "/pipros/"
        self._process = process
        self._publishers: dict[str, Any] = {}
        self.subscribers: dict[str, Any] = {}
        self.transforms = self.inboxes("tf", "tf2_msgs/TFMessage")

    def inboxes(self, topic: str, type_name: str) -> dict[str, Inbox]:
        """Subscribe to a topic of pipros. The other inbox has all recorded messages."""
        message_class = load_message_class(type_name)
        own, genuine = Inbox(), Inbox()
        self.subscribers[topic] = self.node.subscribe(f"/pipros/{topic}", message_class, own)
        genuine.messages = self.recording.messages(topic, message_class)
        return {"pipros": own, "genuine": genuine}

    def publish(
        self, topic: str, message: Any, *, to: str = "/", subscribers: int = 1, is_input: bool = True
    ) -> None:
        """Publish on a topic to which the node subscribes, in the namespace `to`."""
        given = self.recording.give(f"publish {topic}", message) if is_input else message
        self._publisher(f"{to}{topic}", type(given), subscribers).publish(given)

    def publish_next(self, topic: str, *, to: str = "/", subscribers: int = 1) -> Any:
        """Publish the recorded message of a topic, and return it."""
        given = self.recording.take(f"publish {topic}")
        self._publisher(f"{to}{topic}", type(given), subscribers).publish(given)
        return given

    def _publisher(self, name: str, message_class: Any, subscribers: int) -> Any:
        """Return a publisher with this number of subscribers."""
        if name not in self._publishers:
            latch = name.endswith(("/tf_static", "/map"))
            self._publishers[name] = self.node.advertise(name, message_class, queue_size=1000, latch=latch)
        publisher = self._publishers[name]
        wait_until(lambda: publisher.connection_count >= subscribers, 60, lambda: f"{name}: {self.output}")
        return publisher

    def publish_tf(self, message: Any, *, is_input: bool = True) -> None:
        """Publish on `/pipros/tf`, to the node and to `transforms`."""
        self.publish("tf", message, to="/pipros/", subscribers=2, is_input=is_input)

    def call(self, service: str, type_name: str, **values: Any) -> list[Any]:
        """Call a service of pipros; return its response and the recorded one."""
        service_class: Any = load_service_class(type_name)
        request = service_class._request_class(**values)
        client = self.node.client(f"{self.services}{service}", service_class)
        # the node may have subscribed, and not advertised yet
        client.wait_until_available(60.0, pause=time.sleep, report=str)
        own = client.call(request, timeout_s=60.0)
        return [own, self.recording.call(service, service_class, request)]

    def call_next(self, service: str, type_name: str) -> list[Any]:
        """Call a service with the recorded request; see `call`."""
        request = self.recording.next_request(service, load_service_class(type_name))
        return self.call(service, type_name, **{name: getattr(request, name) for name in request.__slots__})

    def try_call(self, service: str, type_name: str, **values: Any) -> list[Any] | None:
        """Like `call`, but return None if one of the nodes fails."""
        try:
            return self.call(service, type_name, **values)
        except PiprosError:
            return None

    def settle(self, service: str, type_name: str) -> None:
        """Call a service of pipros, so that it has handled earlier messages. The call may fail."""
        service_class: Any = load_service_class(type_name)
        with suppress(PiprosError):
            client = self.node.client(f"{self.services}{service}", service_class)
            client.call(service_class._request_class(), timeout_s=60.0)

    def parameters(self) -> list[Any]:
        """Return the private parameters of both nodes."""
        return [self.node.params.get(f"/pipros/{self.name}"), self.recording.value("parameters")]

    @property
    def output(self) -> str:
        return self._process.output

    def interface(self, side: str) -> dict[str, dict[str, str]]:
        """Return the types of topics and services of one side by name, without the namespace."""
        if side == "genuine":
            return {kind: dict(found) for kind, found in self.recording.value("interface").items()}
        found = read_state(self.node.master)
        assert found is not None
        state, types = found
        node = f"/pipros/{self.name}"

        def named(names: Sequence[str], type_name: Callable[[str], str]) -> dict[str, str]:
            return {
                name.removeprefix("/pipros"): type_name(name)
                for name in names
                if name not in ("/rosout", "/clock")
            }

        return {
            "publications": named(of_node(node, state.publishers), types.__getitem__),
            "subscriptions": named(of_node(node, state.subscribers), lambda _: ""),
            "services": named(
                of_node(node, state.services), lambda name: type_of(self.node.master, name) or ""
            ),
        }


@contextmanager
def both_nodes(
    ros: RosSystem,
    recording: Recording,
    package: str,
    program: str,
    parameters: Mapping[str, Any],
    *,
    name: str = "node",
    before: Callable[[Node], object] = lambda _: None,
    remaps: Sequence[str] = (),
    arguments: Sequence[str] = (),
) -> Iterator[BothNodes]:
    """Run the node with these parameters and arguments; `before` is called before it starts."""
    ros.serve_master()
    recording.give("parameters", parameters)
    recording.give("arguments", [*arguments, *remaps])
    with Node("test", environment=Environment(master_uri=ros.master_uri)) as node:
        node.params.set(f"/pipros/{name}", dict(parameters))
        before(node)
        process = start_node(ros, package, program, name, *arguments, *remaps)
        yield BothNodes(node, process, name, recording)
        end_node(process)


def start_node(ros: RosSystem, package: str, program: str, name: str, *arguments: str) -> Process:
    """Start a node of pipros in the namespace `/pipros`, with its own `tf`."""
    names = [f"__name:={name}", "__ns:=/pipros", "/tf:=/pipros/tf"]
    return ros.pipros.start("rosrun", package, program, *arguments, *names)


def end_node(process: Process) -> None:
    process.press_ctrl_c()
    process.wait()
