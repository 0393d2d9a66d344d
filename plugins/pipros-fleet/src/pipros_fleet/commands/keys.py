"""`pipros fleet keys`: manages a fleet's certificate authority."""

from __future__ import annotations

from collections.abc import Sequence

from pipros_tools.cli.runner import add_flag, option_parser

USAGE = "create|add|renew|revoke|list FOLDER [NAME] [options]"


def main(argv: Sequence[str]) -> int:
    parser = option_parser("pipros fleet keys", USAGE)
    add_flag(
        parser, "--observer", help="for add: a member that receives shared topics, but cannot change anything"
    )
    parser.add_option("--days", metavar="N", type="int", default=365, help="validity of a certificate (365)")
    options, arguments = parser.parse_args(list(argv))
    if not 1 <= options.days <= 36_500:
        parser.error(f"--days must be between 1 and 36500, got {options.days}")
    from pipros_fleet.access import FleetRole
    from pipros_fleet.certificates import Authority

    match arguments:
        case ["create", folder]:
            Authority.create(folder, options.days)
            print(f"{folder}: authority created; `pipros fleet router tls/HOST:PORT --keys {folder}` uses it")
        case ["add", folder, name]:
            made = Authority(folder).add(
                name, FleetRole.OBSERVER if options.observer else FleetRole.MEMBER, options.days
            )
            print(f"{made}: copy this folder to [{name}], then delete it here")
        case ["renew", folder, name]:
            print(f"{Authority(folder).renew(name, options.days)}: copy this folder to [{name}]")
        case ["revoke", folder, name]:
            Authority(folder).revoke(name)
            print(f"[{name}] is revoked; running routers end its link within two seconds")
        case ["list", folder]:
            for name, role in sorted(Authority(folder).members().items()):
                print(f"{name}: {role.value}")
        case _:
            parser.error(f"expected {USAGE}")
    return 0
