"""`pipros ros2`: connects the running system to ROS 2 nodes, and shows the traffic."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Mapping, Sequence
from typing import Any

from pipros.basics.printable import listed
from pipros.msg.language.full_text import DEFINITION_BYTES
from pipros_rosbag2.commands import add_reading_options, definition_folders
from pipros_tools.cli.runner import USAGE_ERROR, CommandError, add_flag, dispatch, option_parser, run
from pipros_tools.cli.server_options import without_remappings

LOOKING = {
    **{name: f"pipros_ros2.commands.look:{name}" for name in ("topics", "nodes", "services", "actions")},
    **{name: f"pipros_ros2.commands.messages:{name}" for name in ("echo", "hz", "pub", "call")},
}
"""The subcommands that look at ROS 2 without a master."""
ROUTER = "tcp/localhost:7447"


def main(argv: Sequence[str] | None = None) -> int:
    arguments = list(sys.argv[1:] if argv is None else argv)
    if arguments[:1] == ["status"]:
        return run(lambda: _status(arguments[1:]))
    if arguments[:1] and arguments[0] in LOOKING:
        return run(lambda: dispatch(LOOKING, arguments, "", USAGE_ERROR))
    return run(lambda: _serve(arguments))


def _serve(argv: Sequence[str]) -> int:
    parser = option_parser(
        "pipros ros2",
        "[options] | status | topics | nodes | services | actions | echo | hz | pub | call",
        "Passes topics, services and actions between the running system and ROS 2 nodes.",
    )
    parser.add_option(
        "--domain", metavar="N", type="int", help="the ROS 2 domain (default: ROS_DOMAIN_ID, or 0)"
    )
    parser.add_option(
        "--distro", help="the ROS 2 distribution: humble, jazzy, kilted or lyrical (default: jazzy)"
    )
    parser.add_option(
        "--rules", metavar="FILE", help="use the allow lists, deny lists and static rules in FILE"
    )
    parser.add_option(
        "--mapping",
        metavar="FILE",
        action="append",
        default=[],
        help="use the mapping rules in FILE, in the format of ros1_bridge; may be repeated",
    )
    add_reading_options(parser)
    add_flag(parser, "--zenoh", help=f"connect to rmw_zenoh instead of DDS, at its router {ROUTER}")
    parser.add_option("--router", metavar="ENDPOINT", help="the address of the Zenoh router; implies --zenoh")
    parser.add_option(
        "--engine", metavar="NAME", help="dds (default) or rclpy, which uses an installed ROS 2"
    )
    parser.add_option(
        "--ros2-python",
        metavar="PYTHON",
        help="the Python that has rclpy (default: this one); implies --engine rclpy",
    )
    add_flag(parser, "--force-types", help="pass messages even if the hashes of their types differ")
    options, arguments = parser.parse_args(without_remappings(argv))
    if arguments:
        parser.error(f"unexpected argument: {arguments[0]}")
    from pipros.node import Node
    from pipros.node.program_log import stderr_logger
    from pipros_ros2.serve import GatewayOptions, gateway_node_name, serve_gateway

    discovery, distribution = discovery_of(options.domain), distribution_of(options.distro)
    routers = [options.router or ROUTER] if options.router or options.zenoh else []
    engine = options.engine or ("rclpy" if options.ros2_python else "dds")
    if engine not in ("dds", "rclpy"):
        parser.error(f"--engine must be dds or rclpy, got {engine}")
    if engine == "rclpy" and routers:
        parser.error("--zenoh and --router are not for --engine rclpy; set RMW_IMPLEMENTATION instead")
    python = (options.ros2_python or sys.executable) if engine == "rclpy" else ""
    name = gateway_node_name(discovery.domain, is_zenoh=bool(routers))
    node = Node(name, argv=argv, log=stderr_logger("pipros_ros2"))
    pairs = _pairs(options, distribution)
    rules = _rules(options.rules)
    return serve_gateway(node, GatewayOptions(discovery, rules, pairs, distribution, routers, python))


def discovery_of(domain: int | None) -> Any:
    """Return the `Discovery` of the environment, with the domain if one is given."""
    from pipros_ros2.rtps.domain import Discovery

    given = {} if domain is None else {"ROS_DOMAIN_ID": str(domain)}
    return Discovery.from_environment({**os.environ, **given})


def distribution_of(name: str | None) -> Any:
    """Return the distribution of a name, or None without one. Raise CommandError if it is unknown."""
    from pipros_rosbag2.distribution import Distribution

    try:
        return Distribution(name) if name else None
    except ValueError:
        known = ", ".join(each.value for each in Distribution)
        raise CommandError(f"--distro must be one of {known}, got [{listed(name)}]") from None


def _pairs(options: Any, distribution: Any) -> Any:
    from pipros_ros2.type_pairs import TypePairs
    from pipros_rosbag2.conversion.mapping import merged, parse_rules
    from pipros_rosbag2.distribution import Distribution

    return TypePairs(
        distribution or Distribution.JAZZY,
        merged([parse_rules(_read(file), file) for file in options.mapping if file]),
        definition_folders(options.msgs),
        is_lenient=options.force_types,
    )


def _rules(file: str | None) -> Any:
    from pipros_ros2.rules import GatewayRules, parse_gateway_rules

    return parse_gateway_rules(_read(file), file) if file else GatewayRules()


def _read(file: str) -> str:
    from pipros.basics.input_file import read_text

    try:
        return read_text(file, DEFINITION_BYTES)
    except (OSError, UnicodeDecodeError) as error:
        raise CommandError(f"cannot read {file}: {getattr(error, 'strerror', None) or error}") from None


def _status(argv: Sequence[str]) -> int:
    parser = option_parser("pipros ros2 status", "[options]")
    add_flag(parser, "--json", dest="is_json", help="print JSON, one line for each gateway")
    options, arguments = parser.parse_args(list(argv))
    if arguments:
        parser.error(f"unexpected argument: {arguments[0]}")
    found = _statuses()
    if not found:
        raise CommandError("no gateway is running; start one with `pipros ros2`")
    for name, status in found.items():
        print(json.dumps({"node": name, **status}) if options.is_json else "\n".join(_lines(name, status)))
    return 0


def _statuses() -> dict[str, Mapping[str, Any]]:
    """Return the status reports of this master's gateways, by node name."""
    from pipros_rosbag2.names import GATEWAY_PREFIX
    from pipros_tools.graph.client import GraphClient
    from pipros_tools.graph.errors import GraphError
    from pipros_tools.graph.service_call import ServiceCaller
    from pipros_tools.graph.system_state import SystemState

    found = {}
    with GraphClient("pipros_ros2_status") as graph:
        services = SystemState.from_state(graph.master.get_system_state()).services
        for name in sorted(services):
            node, _, last = name.rpartition("/")
            if node.startswith(GATEWAY_PREFIX) and last == "status":
                try:
                    caller = ServiceCaller(graph.master, name)
                    found[node] = json.loads(caller.call(caller.request([])).message)
                except (GraphError, ValueError, RecursionError) as error:
                    raise CommandError(f"[{node}] returned no valid status: {error}") from None
    return found


def _lines(name: str, status: Mapping[str, Any]) -> list[str]:
    from pipros_ros2.rules import INTERNAL

    lines = [f"{listed(name)}:"]
    for row in status["passed"]:
        arrow = "->" if row["direction"] == "to_ros2" else "<-"
        kind = f"{row['ros1_type']} {arrow} {row['ros2_type']}"
        state = f"{row['rate']:.1f}/s" if row["active"] else "no subscribers"
        dropped = f", {row['dropped']} dropped: {listed(row['reason'])}" if row["dropped"] else ""
        what = "" if row["kind"] == "topics" else f"{row['kind'].removesuffix('s')} "
        name = listed(row["name"])
        lines.append(f"  ROS 1 {arrow} ROS 2  {what}{name} ({listed(kind)}): {state}{dropped}")
    internal = [what for what, why in status["left_out"].items() if why.startswith(INTERNAL)]
    lines += [
        f"  left out: {listed(what)}: {listed(why)}"
        for what, why in sorted(status["left_out"].items())
        if what not in internal
    ]
    if internal:
        lines.append(f"  left out: internal names: {len(internal)} (--json lists them)")
    return lines
