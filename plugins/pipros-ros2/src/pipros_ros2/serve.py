"""Run `pipros ros2`: a ROS 1 node, a connection to ROS 2, and a gateway between them."""

from __future__ import annotations

import os
import sys
import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

from pipros.basics.errors import PiprosError
from pipros.basics.interruptible_wait import OnceEvent, set_by_signals
from pipros.node import Node
from pipros_ros2.agent.engine import RclpyEngine
from pipros_ros2.agent.process import reaches_out
from pipros_ros2.gateway import Gateway, new_identity
from pipros_ros2.interface import GATEWAY_NODE, EngineError, Ros2Engine
from pipros_ros2.rtps.domain import Discovery
from pipros_ros2.rtps.engine import RtpsEngine
from pipros_ros2.rtps.graph_info import GidBytes
from pipros_ros2.rtps.unseen import hint_for
from pipros_ros2.rules import GatewayRules
from pipros_ros2.type_pairs import TypePairs
from pipros_ros2.zenoh.engine import ZenohEngine
from pipros_rosbag2.distribution import Distribution
from pipros_rosbag2.names import GATEWAY_PREFIX
from pipros_tools.graph.ping import ask_pid

_ENDING_S: Final = 0.3
"""Maximum time by which the node, the gateway and the engine can delay the end of the process."""


HINT_S: Final = 10.0
"""Time after which a gateway that has found no participant prints a possible reason."""


class AlreadyRunning(PiprosError):
    """A gateway with this name is already running."""


@dataclass(frozen=True, slots=True)
class GatewayOptions:
    """Settings of a gateway.

    Attributes:
        distribution: the ROS 2 distribution; None if the user did not specify it.
        routers: Zenoh endpoints; empty for DDS.
        ros2_python: the Python whose rclpy connects to ROS 2; empty for pipros's own engines.
    """

    discovery: Discovery
    rules: GatewayRules
    pairs: TypePairs
    distribution: Distribution | None = None
    routers: Sequence[str] = ()
    ros2_python: str = ""

    @property
    def is_local(self) -> bool:
        """Whether only ROS 2 nodes on this machine can be reached.

        False with Zenoh routers, because other machines can connect to them, and if the environment gives
        rclpy settings that may reach other machines.
        """
        if self.ros2_python:
            return not reaches_out(self.discovery, os.environ)
        return not self.routers and not self.discovery.reaches_out

    def engine(self, identity: str, on_end: Callable[[PiprosError], object]) -> Ros2Engine:
        """Connect to ROS 2. `on_end` is called if the connection is lost for good."""
        node = f"/{GATEWAY_NODE}{identity}"
        if self.ros2_python:
            return RclpyEngine(
                self.discovery, node, self.ros2_python, on_end=lambda reason: on_end(EngineError(reason))
            )
        if self.routers:
            return ZenohEngine(self.discovery.domain, node, self.routers)
        size = None if self.distribution is None else GidBytes(self.distribution.gid_bytes)
        return RtpsEngine(self.discovery, node, gateway=identity, gid_bytes=size)


def gateway_node_name(domain: int, *, is_zenoh: bool) -> str:
    """Return the name of a gateway's ROS 1 node."""
    return f"{GATEWAY_PREFIX[1:]}{domain}{'_zenoh' if is_zenoh else ''}"


def serve_gateway(node: Node, options: GatewayOptions) -> int:
    """Forward topics, services and actions until Ctrl-C, SIGTERM or the node's shutdown.

    Waits for the master. Returns the exit code: 1 after an error, which is printed.
    """
    over = OnceEvent()
    failures: list[PiprosError] = []
    with set_by_signals(over):
        thread = threading.Thread(
            target=_run, args=(node, options, over, failures), name="gateway", daemon=True
        )
        thread.start()
        over.wait()
        thread.join(_ENDING_S)
    for failure in failures:
        print(f"ERROR: {failure}", file=sys.stderr)
    return 1 if failures else 0


def _run(node: Node, options: GatewayOptions, over: OnceEvent, failures: list[PiprosError]) -> None:
    ends: list[Callable[[], object]] = []

    def fail(error: PiprosError) -> None:
        failures.append(error)
        over.set()

    try:
        node.wait_for_master(lambda error: print(f"{error}; waiting", file=sys.stderr, flush=True))
        _check_name(node)
        identity = new_identity(node)
        engine = options.engine(identity, fail)
        ends.append(engine.close)
        with node:
            node.on_shutdown(over.set)
            gateway = Gateway(node, engine, identity, options.rules, options.pairs, is_local=options.is_local)
            ends.append(gateway.close)
            gateway.start()
            print(_announcement(options, engine), flush=True)
            if (warning := _other_domain(options.discovery.domain)) is not None:
                print(f"pipros ros2: {warning}", file=sys.stderr, flush=True)
            if not over.wait(HINT_S) and (hint := _hint(engine, options.discovery)) is not None:
                print(f"pipros ros2: {hint}", file=sys.stderr, flush=True)
            over.wait()
            for end in reversed(ends):
                end()
    except PiprosError as error:
        failures.append(error)
        for end in reversed(ends):
            end()
    finally:
        over.set()


def _other_domain(domain: int) -> str | None:
    """Return a warning if ROS 2 nodes of the same launch file or terminal are in another domain."""
    own = os.environ.get("ROS_DOMAIN_ID") or "0"
    if own == str(domain):
        return None
    return f"ROS 2 nodes that start here are in domain {own}, unless ROS_DOMAIN_ID={domain} is set for them"


def _announcement(options: GatewayOptions, engine: Ros2Engine) -> str:
    where = ", ".join(options.routers) if options.routers else f"range {options.discovery.range.value}"
    if isinstance(engine, RclpyEngine):
        where = f"{where}, rclpy with {engine.rmw}"
    return f"pipros ros2: connected to domain {options.discovery.domain} ({where})"


def _hint(engine: Ros2Engine, discovery: Discovery) -> str | None:
    """Return a hint if an engine for DDS has found no other participant."""
    return hint_for(discovery) if isinstance(engine, RtpsEngine) and not engine.has_peers else None


def _check_name(node: Node) -> None:
    """Raise AlreadyRunning if a node of this name responds, because registering would shut down that node."""
    try:
        ask_pid(node.master.lookup_node(node.name), node.name)
    except PiprosError:
        return
    raise AlreadyRunning(f"a gateway for this domain is already running: [{node.name}]")
