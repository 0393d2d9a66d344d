"""Options of the commands that serve clients over WebSockets."""

from __future__ import annotations

from optparse import OptionParser
from typing import TYPE_CHECKING, Any

from pipros_bridges.limits import BridgeLimits
from pipros_tools.cli.runner import CommandError, add_flag
from pipros_tools.cli.server_options import add_address_options, bind_address, policy_of

if TYPE_CHECKING:
    from pipros.basics.limits import Limits
    from pipros_bridges.serve import BridgeOptions


def add_bridge_options(parser: OptionParser, port: int) -> None:
    """Add the options for the address, TLS, access and client limits. `port` is the default port."""
    limits = BridgeLimits()
    parser.add_option("--port", type="int", default=port, help=f"the port ({port}); 0 selects a free one")
    add_address_options(parser)
    add_flag(parser, "--control", help="let clients change the system")
    parser.add_option(
        "--policy", metavar="FILE", help="policy that limits what --control permits (docs/guides/policy.md)"
    )
    parser.add_option(
        "--token-file", metavar="FILE", help="file with one token per line; clients must present one of them"
    )
    parser.add_option(
        "--origin",
        metavar="URL",
        action="append",
        help="let pages from this origin connect, such as https://app.example.org; may be repeated",
    )
    parser.add_option(
        "--client-messages",
        metavar="N",
        type="int",
        help=f"messages per second that one client may send ({limits.bridge_client_rate}); faster "
        "clients are slowed down",
    )
    parser.add_option(
        "--client-bytes",
        metavar="N",
        type="int",
        help=f"bytes per second that one client may send ({limits.bridge_client_rate_bytes >> 20} MiB)",
    )


def bridge_options(tool: str, options: Any) -> BridgeOptions:
    """Return the values of the options added by `add_bridge_options`."""
    from pipros_bridges.serve import BridgeOptions

    host, port = bind_address(options.bind)
    origins = options.origin or []
    return BridgeOptions(
        tool,
        options.port if port is None else port,
        host,
        options.cert,
        options.key,
        options.token_file,
        [origin for origin in origins if origin != "null"],
        "null" in origins,
        bool(options.control),
        policy=policy_of(options),
    )


def client_limits(options: Any) -> Limits:
    """Return the process-wide limits, overridden by the limits given as options."""
    from pipros.basics.limits import process_limits

    given = {
        "--client-messages": ("bridge_client_rate", options.client_messages),
        "--client-bytes": ("bridge_client_rate_bytes", options.client_bytes),
    }
    for option, (_, value) in given.items():
        if value is not None and value <= 0:
            raise CommandError(f"{option} must be > 0, got {value}")
    limits = process_limits()
    changed = {limit: value for limit, value in given.values() if value is not None}
    return limits.with_table(limits.of(BridgeLimits)._replace(**changed))
