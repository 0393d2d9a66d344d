"""`pipros foxglove` and the node `foxglove_bridge`: serve the running system to Foxglove and Lichtblick."""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from pipros_bridges.commands.bridge_options import add_bridge_options, bridge_options, client_limits
from pipros_tools.cli.runner import CommandError, option_parser, run
from pipros_tools.cli.server_options import without_remappings

if TYPE_CHECKING:
    from pipros.node import Node

PORT = 8765
MAX_UPDATE_MS = 5000
BUFFER_BYTES = 10_000_000


def main(argv: Sequence[str] | None = None) -> int:
    return run(lambda: _main(sys.argv[1:] if argv is None else argv))


def _main(argv: Sequence[str]) -> int:
    parser = option_parser("pipros foxglove", "[options]")
    add_bridge_options(parser, PORT)
    for name, what in (("topic", "topics"), ("service", "services"), ("param", "parameters")):
        parser.add_option(
            f"--{name}",
            metavar="REGEX",
            action="append",
            help=f"the {what} that clients may use (all); may be repeated",
        )
    parser.add_option(
        "--max-update-ms",
        metavar="MS",
        type="int",
        default=MAX_UPDATE_MS,
        help="maximum interval between queries of the graph",
    )
    options, arguments = parser.parse_args(without_remappings(argv))
    if arguments:
        parser.error(f"unexpected argument: {arguments[0]}")
    from pipros.node import Node
    from pipros_bridges.foxglove.handler import Rules
    from pipros_bridges.foxglove.serve import compiled, serve_foxglove

    rules = Rules(
        compiled(options.topic or [".*"]),
        compiled(options.service or [".*"]),
        compiled(options.param or [".*"]),
        has_control=bool(options.control),
        max_poll_s=options.max_update_ms / 1000,
    )
    node = Node("foxglove_bridge", anonymous=True, argv=argv, limits=client_limits(options))
    return serve_foxglove(node, bridge_options("pipros foxglove", options), rules)


def node_main(argv: Sequence[str] | None = None) -> int:
    """Run the node of foxglove_bridge.launch, with the same private parameters as in Noetic."""
    return run(lambda: _node_main(sys.argv if argv is None else argv))


def _node_main(argv: Sequence[str]) -> int:
    from pipros.basics.limits import process_limits
    from pipros.node import Node
    from pipros_bridges.foxglove.handler import CAPABILITIES, Rules
    from pipros_bridges.foxglove.serve import compiled, serve_foxglove
    from pipros_bridges.limits import BridgeLimits
    from pipros_bridges.serve import BridgeOptions
    from pipros_server.policy.policy_file import read_policy

    given = _PrivateParameters(Node("foxglove_bridge", argv=argv))
    limits = process_limits()
    queue_bytes = max(1, given.number("send_buffer_limit", BUFFER_BYTES))
    limits = limits.with_table(limits.of(BridgeLimits)._replace(bridge_queue_bytes=queue_bytes))
    has_tls = bool(given.get("tls", False))
    options = BridgeOptions(
        "foxglove_bridge",
        given.number("port", PORT),
        given.text("address", "127.0.0.1"),
        given.text("certfile", "") if has_tls else None,
        given.text("keyfile", "") or None if has_tls else None,
        given.text("token_file", "") or None,
        given.texts("origins", []),
        has_control=True,
        policy=read_policy(policy) if (policy := given.text("policy", "")) else None,
    )
    everything = [".*"]
    rules = Rules(
        compiled(given.texts("topic_whitelist", everything)),
        compiled(given.texts("service_whitelist", everything)),
        compiled(given.texts("param_whitelist", everything)),
        has_control=True,
        capabilities=given.texts("capabilities", list(CAPABILITIES)),
        max_poll_s=given.number("max_update_ms", MAX_UPDATE_MS) / 1000,
        published=compiled(given.texts("client_topic_whitelist", everything)),
        assets=compiled(given.texts("asset_uri_allowlist", everything)),
    )
    return serve_foxglove(Node("foxglove_bridge", argv=argv, limits=limits), options, rules)


class _PrivateParameters:
    """Reads the private parameters of a node that has not started yet."""

    def __init__(self, node: Node) -> None:
        from pipros.node.start_params import set_private_params

        set_private_params(node, keep_texts=True)
        self._node = node

    def get(self, name: str, default: Any) -> Any:
        try:
            return self._node.params.get(f"~{name}")
        except LookupError:
            return default

    def text(self, name: str, default: str) -> str:
        return str(self.get(name, default))

    def number(self, name: str, default: int) -> int:
        value = self.get(name, default)
        if not isinstance(value, (int, float)) or isinstance(value, bool) or not 0 <= value < math.inf:
            raise CommandError(f"parameter ~{name} must be a finite number >= 0, got {value!r}")
        return int(value)

    def texts(self, name: str, default: list[str]) -> list[str]:
        value = self.get(name, default)
        if not isinstance(value, list) or not all(isinstance(each, str) for each in value):
            raise CommandError(f"parameter ~{name} must be a list of strings, got {value!r}")
        return value
