"""Gateways between a master and a ROS 2 domain, with a node on the master and an engine in the domain."""

from contextlib import ExitStack
from typing import Any

from pipros.basics.env import Environment
from pipros.master.master import Master
from pipros.node import Node
from pipros_ros2.gateway import Gateway, new_identity
from pipros_ros2.interface import GATEWAY_NODE, EndpointKind, Ros2Engine, Ros2Publisher, TopicQos
from pipros_ros2.rtps.domain import Discovery
from pipros_ros2.rtps.engine import RtpsEngine
from pipros_ros2.rules import parse_gateway_rules
from pipros_ros2.type_pairs import TypePairs
from pipros_ros2.zenoh.engine import ZenohEngine
from pipros_rosbag2.conversion.mapping import BUILTIN_RULES
from pipros_rosbag2.distribution import Distribution
from tests.support.zenoh_peer import Router

PAIRS = TypePairs(Distribution.JAZZY, BUILTIN_RULES)


class System:
    """A master with a node `ros1`, and a domain with an engine `ros2`. Tests add gateways and more nodes."""

    def __init__(self, domain: int, *, has_zenoh: bool) -> None:
        self._stack = ExitStack()
        self.domain = domain
        self._publishers: list[Ros2Publisher] = []
        self._router = Router() if has_zenoh else None
        if self._router is not None:
            self._stack.callback(self._router.close)
        self.master_uri = self.new_master()
        self.ros1 = self.node("ros1")
        self.ros2 = self.engine()

    def new_master(self) -> str:
        """Start a master, and return its URI."""
        return self._stack.enter_context(Master(port=0)).uri

    def node(self, name: str, master_uri: str = "", **more: Any) -> Node:
        environment = Environment(master_uri=master_uri or self.master_uri)
        return self._stack.enter_context(Node(name, environment=environment, **more))

    def engine(self, gateway: str = "") -> Ros2Engine:
        node = f"/{GATEWAY_NODE}{gateway}" if gateway else "/peer"
        engine: Ros2Engine
        if self._router is None:
            engine = RtpsEngine(Discovery(self.domain), node, gateway=gateway)
        else:
            engine = ZenohEngine(self.domain, node, [self._router.address], timeout_s=60)
        self._stack.callback(engine.close)
        return engine

    def gateway(
        self,
        rules: str = "",
        *,
        name: str = "ros2_gateway_0",
        is_local: bool = True,
        master_uri: str = "",
        pairs: TypePairs = PAIRS,
    ) -> Gateway:
        node = self.node(name, master_uri)
        identity = new_identity(node)
        gateway = Gateway(
            node, self.engine(identity), identity, parse_gateway_rules(rules, "rules"), pairs,
            is_local=is_local, poll_s=0.05,
        )  # fmt: skip
        self._stack.callback(gateway.close)
        gateway.start()
        return gateway

    def advertise(self, topic: str, type_name: str, type_hash: str, qos: TopicQos) -> Ros2Publisher:
        """Create a publisher in ROS 2, which exists until `close`."""
        self._publishers.append(self.ros2.advertise(topic, type_name, type_hash, qos))
        return self._publishers[-1]

    def has(self, kind: EndpointKind, name: str) -> bool:
        return any((each.kind, each.name) == (kind, name) for each in self.ros2.endpoints())

    def is_published(self, name: str) -> bool:
        return name in {topic for topic, _ in self.ros1.master.get_topic_types()}

    def close(self) -> None:
        self._stack.close()
