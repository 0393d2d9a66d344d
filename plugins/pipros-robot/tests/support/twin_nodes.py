"""Pairs of nodes with the same inputs: one of pipros, in the test's process, and a genuine one.

The genuine ones run, or a recording has what they answered.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from pipros.basics.env import Environment
from pipros.msg import load_message_class, load_service_class
from pipros.msg.time import Time
from pipros.node import Node
from pipros_robot.navigation import plane
from tests.support.nodes import Inbox
from tests.support.recordings import Recording
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

SIDES = ("pipros", "genuine")


class Twins:
    """Nodes `/pipros/NAME` and `/genuine/NAME`, whose other relative names are in these namespaces."""

    def __init__(self, ros: RosSystem, node: Node, recording: Recording | None) -> None:
        self.node = node
        self._ros, self._recording = ros, recording
        self._live = SIDES[:1] if recording else SIDES
        self._nodes: list[Node] = []
        self._publishers: dict[str, Any] = {}
        self._inboxes: dict[tuple[str, str], Inbox] = {}
        self._readers: dict[str, int] = {}
        self._outputs: list[Any] = []
        self._mark_ns = 0
        self.clock_ns = 1000 * 10**9

    def add(
        self,
        name: str,
        make: Callable[[Node], Any],
        genuine: Sequence[str | Path],
        parameters: Mapping[str, Any],
        inputs: Mapping[str, str],
        outputs: Mapping[str, str],
        services: Mapping[str, str] | None = None,
        private: Mapping[str, str] | None = None,
    ) -> Any:
        """Start both nodes, and subscribe to their outputs. Return the node of pipros.

        Args:
            make: creates the node of pipros.
            genuine: the command line of the genuine node; with a recording, its package and program.
            inputs: topics of the test by names in the node.
            outputs: types by topics of the node, such as `scan` or `~output`.
            services: names in the node's namespace by names in the node.
            private: more parameters, in which SIDE becomes the name of the side.
        """
        made = None
        if self._recording is not None:
            given = {
                "parameters": parameters, "inputs": inputs, "outputs": outputs, "services": services or {}
            }  # fmt: skip
            self._recording.give(f"node {name}", {"program": "/".join(map(str, genuine)), **given})
            for topic, type_name in outputs.items():
                inbox = self._inboxes["genuine", f"{name} {topic}"] = Inbox()
                inbox.messages = self._recording.messages(f"{name} {topic}", load_message_class(type_name))
        for side in self._live:
            remappings = [f"{old}:={new}" for old, new in inputs.items()]
            remappings += [f"{old}:=/{side}/{new}" for old, new in (services or {}).items()]
            arguments = [f"__name:={name}", f"__ns:=/{side}", *remappings]
            own = {key: value.replace("SIDE", side) for key, value in (private or {}).items()}
            if parameters or own:
                self.node.params.set(f"/{side}/{name}", {**parameters, **own})
            for topic, type_name in outputs.items():
                inbox = self._inboxes[side, f"{name} {topic}"] = Inbox()
                place = f"{name}/{topic[1:]}" if topic[0] == "~" else topic
                if topic[0] != "~":
                    place = f"{name}_{topic}"
                    arguments.append(f"{topic}:=/{side}/{place}")
                kind = load_message_class(type_name)
                self._outputs.append(self.node.subscribe(f"/{side}/{place}", kind, inbox))
            if side == "pipros":
                node = Node(name, argv=arguments, environment=self.node.environment)
                node.start()
                self._nodes.append(node)
                made = make(node)
            else:
                self._ros.genuine.start(*genuine, *arguments)
        for topic in inputs.values():
            self._readers[topic] = self._readers.get(topic, 0) + len(self._live)
        return made

    def expect(self, topic: str, pairs: int) -> None:
        """Make `publish` wait until the nodes of this number of pairs have subscribed to a topic."""
        self._readers[topic] = pairs * len(self._live)

    def call(self, service: str, type_name: str, *values: Any) -> list[Any]:
        """Call a service of both nodes; return the responses."""
        service_class: Any = load_service_class(type_name)
        request = service_class._request_class(*values)
        found = [self.node.client(f"/{side}/{service}", service_class).call(request) for side in self._live]
        if self._recording is not None:
            found.append(self._recording.call(service, service_class, request))
        return found

    def publish(self, topic: str, message: Any, *, latch: bool = False) -> None:
        """Publish a message when the nodes of each pair with this input have subscribed to it."""
        if self._recording is not None:
            message = self._recording.give(f"publish {topic}", message)
        self._send(topic, message, latch=latch)

    def _send(self, topic: str, message: Any, *, latch: bool) -> None:
        if topic not in self._publishers:
            self._publishers[topic] = self.node.advertise(topic, type(message), queue_size=100, latch=latch)
        publisher, count = self._publishers[topic], self._readers.get(topic, 0)
        wait_until(lambda: publisher.connection_count >= count, 60, f"{count} subscribers of {topic}")
        wait_until(lambda: all(each.connection_count for each in self._outputs), 60, "the outputs")
        publisher.publish(message)

    def publish_next(self, topic: str) -> Any:
        """Publish the next recorded message of a topic, and return it."""
        assert self._recording is not None
        given = self._recording.take(f"publish {topic}")
        if hasattr(given, "header"):
            self.clock_ns = given.header.stamp.to_nsec()
        self._send(topic, given, latch=topic == "/tf_static")
        return given

    def transforms(self, *frames: tuple[str, str, Sequence[float], Sequence[float]]) -> None:
        """Publish static transforms: parent, child, position and quaternion of each."""
        made = []
        for parent, child, position, quaternion in frames:
            turn = np.array(quaternion) / np.linalg.norm(quaternion)
            pose: Any = tuple(map(float, (*position, *turn)))
            made += plane.transforms(parent, child, pose, Time()).transforms
        tf_class: Any = load_message_class("tf2_msgs/TFMessage")
        self.publish("/tf_static", tf_class(made), latch=True)

    def next_header(self, frame: str) -> Any:
        """Return a header with a new timestamp."""
        self.clock_ns += 10**8
        header: Any = load_message_class("std_msgs/Header")(frame_id=frame)
        header.stamp = Time(*divmod(self.clock_ns, 10**9))
        return header

    def warm_up(self, publish: Callable[[], object]) -> None:
        """Publish inputs until all nodes have transforms and react; `outputs` ignores the results."""

        def react() -> bool:
            publish()
            return all(self._inboxes[key].messages for key in self._inboxes if key[0] in self._live)

        wait_until(react, 60, "an output of each node")
        self._mark_ns = self.clock_ns + 50_000_000  # clusters have later timestamps than their cloud

    def _since_mark(self, inbox: Inbox) -> list[Any]:
        return [each for each in inbox.messages if each.header.stamp.to_nsec() > self._mark_ns]

    def outputs(self, name: str, topic: str, count: int = 1) -> tuple[list[Any], list[Any]]:
        """Wait until both nodes have published `count` messages; return those of either side."""
        inboxes = [self._inboxes[side, f"{name} {topic}"] for side in SIDES]
        wait_until(
            lambda: all(len(self._since_mark(each)) >= count for each in inboxes),
            60,
            lambda: (
                f"{name} {topic}: {[len(self._since_mark(each)) for each in inboxes]} of {count} messages"
            ),
        )
        ours, genuine = map(self._since_mark, inboxes)
        return ours, genuine[: len(ours)] if self._recording else genuine

    def settings(self, name: str) -> list[dict[str, Any]]:
        """Return the settings of dynamic_reconfigure in a namespace of both sides.

        The values are type, level, minimum, maximum and default, by the name of the setting.
        """
        found = []
        for side in self._live:
            inbox = Inbox()
            kind = load_message_class("dynamic_reconfigure/ConfigDescription")
            handle = self.node.subscribe(f"/{side}/{name}/parameter_descriptions", kind, inbox)
            message = inbox.wait()[0]
            handle.unregister()
            values = [
                {each.name: each.value for part in config.__slots__[:4] for each in getattr(config, part)}
                for config in (message.min, message.max, message.dflt)
            ]
            (group,) = message.groups
            rows = group.parameters
            found.append(
                {
                    each.name: (each.type, each.level, *(part.get(each.name) for part in values))
                    for each in rows
                }
            )
        if self._recording is not None:
            recorded = self._recording.value(f"settings {name}")
            found.append({setting: tuple(values) for setting, values in recorded.items()})
        return found

    def close(self) -> None:
        for node in self._nodes:
            node.shutdown()


@contextmanager
def twins(ros: RosSystem, recording: Recording | None = None) -> Iterator[Twins]:
    """Run a master, and end all nodes afterwards. With a recording, no genuine node runs."""
    ros.serve_master()
    with Node("test", environment=Environment(master_uri=ros.master_uri)) as node:
        both = Twins(ros, node, recording)
        try:
            yield both
        finally:
            both.close()


def differences(one: Any, other: Any) -> list[str]:
    """Return the paths of all fields in which two messages differ. NaN equals NaN. Ignores `seq`.

    Bytes are compared as integers of 32 bits, so that the difference of floats is visible.
    """
    found: list[str] = []
    _compare(one, other, "", found)
    return found


def _compare(one: Any, other: Any, path: str, found: list[str]) -> None:
    if hasattr(one, "__slots__") and not isinstance(one, Time):
        for name in one.__slots__:
            if name != "seq":
                _compare(getattr(one, name), getattr(other, name), f"{path}.{name}", found)
    elif isinstance(one, bytes) and len(one) == len(other) and len(one) % 4 == 0:
        _compare(np.frombuffer(one, "<i4"), np.frombuffer(other, "<i4"), path, found)
    elif isinstance(one, bytes | str | bool) or not hasattr(one, "__len__"):
        if one != other and not (one != one and other != other):  # NaN
            found.append(f"{path}: {one!r} {other!r}"[:300])
    elif len(one) != len(other):
        found.append(f"{path}: {len(one)} and {len(other)} elements")
    else:
        for index, (first, second) in enumerate(zip(one, other, strict=True)):
            _compare(first, second, f"{path}[{index}]", found)
