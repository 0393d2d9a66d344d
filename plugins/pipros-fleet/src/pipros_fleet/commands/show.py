"""`pipros fleet list`, `info` and `top`: show members, their topics and services, and the traffic."""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator, Sequence
from typing import TYPE_CHECKING

from pipros_fleet.commands.options import add_link_options, link_of
from pipros_tools.cli.runner import CommandError, option_parser

if TYPE_CHECKING:
    from pipros_fleet.directory import Directory, DirectoryEntry
    from pipros_fleet.status import Counters
    from pipros_fleet.zenoh_session import SessionLink

INTERVAL_S = 2.0


def list_members(argv: Sequence[str]) -> int:
    parser = option_parser("pipros fleet list", "[options]")
    add_link_options(parser)
    options, arguments = parser.parse_args(list(argv))
    if arguments:
        parser.error(f"unexpected argument: {arguments[0]}")
    from pipros_fleet.keys import VERSION
    from pipros_fleet.status import present

    with link_of(options) as link:
        found = present(link)
        counts: dict[str, int] = {}
        for each in found:
            counts[each.member] = counts.get(each.member, 0) + 1
            if each.version != VERSION:
                print(f"{each.member}: version {each.version} of the protocol, not {VERSION}")
            elif counts[each.member] == 1:
                print(_summary(link, each.member))
            else:
                print(f"{each.member}: a second member with this name")
    return 0


def _summary(link: SessionLink, member: str) -> str:
    from pipros_fleet.status import directory_of

    directory = directory_of(link, member)
    if directory is None:
        return f"{member}: does not answer"
    return (
        f"{member}: shares {_count(directory.shared, 'topic')}, accepts "
        f"{_count(directory.accepted, 'topic')} and {_count(directory.services, 'service')}"
    )


def _count(entries: Sequence[object], what: str) -> str:
    return f"{len(entries)} {what}{'' if len(entries) == 1 else 's'}"


def info(argv: Sequence[str]) -> int:
    parser = option_parser("pipros fleet info", "MEMBER [options]")
    add_link_options(parser)
    options, arguments = parser.parse_args(list(argv))
    if len(arguments) != 1:
        parser.error("exactly one member name is required")
    from pipros_fleet.keys import member_name
    from pipros_fleet.status import counters_of, directory_of

    member = member_name(arguments[0])
    with link_of(options) as link:
        directory = directory_of(link, member)
        if directory is None:
            raise CommandError(f"member [{member}] does not exist or does not answer")
        print("\n".join(_described(directory, counters_of(link, member))))
    return 0


def _described(directory: Directory, counters: Counters | None) -> Iterator[str]:
    for what, entries in (
        ("Shared topics", directory.shared),
        ("Accepted topics", directory.accepted),
        ("Accepted services", directory.services),
    ):
        yield f"{what}:{'' if entries else ' None'}"
        yield from _rows(entries)
    shared = "some" if directory.has_parameters else "none"
    accepted = "some" if directory.sets_parameters else "none"
    yield f"Parameters: {shared} can be read, {accepted} can be set"
    if counters is not None:
        for name, row in sorted(counters.received.items()):
            yield f"Received from {name}: {row[0]} messages, {row[2]} lost, {row[3]} malformed"


def _rows(entries: Iterable[DirectoryEntry]) -> Iterator[str]:
    for entry in entries:
        yield f" * {entry.name} [{entry.type}]"


def top(argv: Sequence[str]) -> int:
    parser = option_parser("pipros fleet top", "[options]")
    add_link_options(parser)
    parser.add_option("--interval", metavar="S", type="float", default=INTERVAL_S, help="seconds (2)")
    parser.add_option("--count", metavar="N", type="int", default=0, help="tables to print (unlimited)")
    options, arguments = parser.parse_args(list(argv))
    if arguments:
        parser.error(f"unexpected argument: {arguments[0]}")
    if not 0.1 <= options.interval <= 3600:
        raise CommandError(f"--interval must be between 0.1 and 3600, got {options.interval:g}")
    with link_of(options) as link:
        before, before_s = _counters(link), time.monotonic()
        printed = 0
        while not options.count or printed < options.count:
            time.sleep(options.interval)
            after, now_s = _counters(link), time.monotonic()
            print("\n".join(_table(before, after, now_s - before_s)), flush=True)
            before, before_s = after, now_s
            printed += 1
    return 0


def _counters(link: SessionLink) -> dict[str, Counters]:
    from pipros_fleet.status import counters_of, present

    members = {each.member for each in present(link)}
    found = {member: counters_of(link, member) for member in sorted(members)}
    return {member: each for member, each in found.items() if each is not None}


def _table(before: dict[str, Counters], after: dict[str, Counters], passed_s: float) -> Iterator[str]:
    from pipros_fleet.status import rates

    yield f"{'topic':40} {'msg/s':>9} {'kB/s':>9} {'dropped':>8} {'unsent':>8}"
    for member, counters in after.items():
        lost = sum(row[2] for row in counters.received.values())
        malformed = sum(row[3] for row in counters.received.values())
        yield (
            f"{member}: round trip {1000 * counters.round_trip_s:.1f} ms, {lost} lost, {malformed} malformed"
        )
        for name, rate, bandwidth, dropped, unsent in rates(before.get(member, counters), counters, passed_s):
            yield f"  {name:38} {rate:9.1f} {bandwidth / 1000:9.1f} {dropped:8} {unsent:8}"
