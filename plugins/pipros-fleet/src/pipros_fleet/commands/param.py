"""`pipros fleet param`: reads and sets a member's parameters, if its configuration file allows it."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any

from pipros_fleet.commands.options import add_link_options, caller_of, link_of
from pipros_tools.cli.runner import CommandError, option_parser

REQUEST_S = 5.0


def main(argv: Sequence[str]) -> int:
    parser = option_parser("pipros fleet param", "list|get|set MEMBER [NAME] [VALUE] [options]")
    add_link_options(parser)
    options, arguments = parser.parse_args(list(argv))
    from pipros.safe import yaml
    from pipros_fleet import keys

    match arguments:
        case ["list", member]:
            verb, payload = "get", b""
        case ["get", member, name]:
            verb, payload = "get", json.dumps(name).encode()
        case ["set", member, name, value]:
            verb, payload = "set", json.dumps([name, yaml.load(value)]).encode()
        case _:
            parser.error("expected `list MEMBER`, `get MEMBER NAME` or `set MEMBER NAME VALUE`")
    key = keys.parameters(keys.member_name(member), verb, caller_of(options))
    with link_of(options) as link:
        answers = link.get(key, payload, timeout_s=REQUEST_S)
    if not answers:
        raise CommandError(f"member [{member}] does not exist or does not answer")
    found: Any = json.loads(answers[-1].payload)
    if arguments[0] == "list":
        print("\n".join(found))
    elif arguments[0] == "get":
        from pipros_tools.graph.param_text import as_shown

        print(as_shown(found), end="")
    return 0
