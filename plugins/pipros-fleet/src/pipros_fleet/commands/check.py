"""`pipros fleet check`: checks and explains a member's YAML file."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from pipros_tools.cli.runner import only_argument

if TYPE_CHECKING:
    from pipros_fleet.fleet_rules import FleetFile, FleetRule


def main(argv: Sequence[str]) -> int:
    path = only_argument(
        "pipros fleet check", "FILE", argv, missing="a file is required", several="only one file is checked"
    )
    from pipros_fleet.fleet_file import read_fleet_file

    print("\n".join(_lines(read_fleet_file(path))))
    return 0


def _lines(file: FleetFile) -> Iterator[str]:
    if file.router:
        yield f"router: {file.router}"
    yield f"shows the members {', '.join(file.show) or '(none)'}"
    if file.bandwidth_kbit:
        yield f"sends at most {file.bandwidth_kbit:g} kbit/s"
    for what, rules in (
        ("shares the topics", file.shared_topics),
        ("shares the parameters", file.shared_parameters),
        ("accepts messages for the topics", file.accepted_topics),
        ("accepts calls to the services", file.accepted_services),
        ("lets others set the parameters", file.accepted_parameters),
    ):
        yield f"{what}:{'' if rules else ' (none)'}"
        for rule in rules:
            yield f"  {rule.name}{_details(rule)}"


def _details(rule: FleetRule) -> str:
    from pipros_fleet.fleet_rules import ANYONE, Priority

    if not rule.is_allowed:
        return ": not"
    found = [f"at most {rule.rate_hz:g} messages/s"] if rule.rate_hz else []
    if rule.is_latest_only:
        found.append("only the latest")
    if rule.priority is not Priority.NORMAL:
        found.append(f"{rule.priority.value} priority")
    if rule.is_compressed:
        found.append("compressed")
    if rule.has_prefixed_frames:
        found.append("with prefixed frames")
    if tuple(rule.members) != ANYONE:
        found.append(f"from {', '.join(rule.members) or 'no member'}")
    return f": {', '.join(found)}" if found else ""
