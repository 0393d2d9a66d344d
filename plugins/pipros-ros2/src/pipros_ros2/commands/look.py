"""`pipros ros2 topics`, `nodes`, `services` and `actions`, and what all commands that look at ROS 2 share.

They print what ROS 2's own commands print, as far as scripts read it.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from pipros.basics.interrupts import accept_ctrl_c
from pipros.basics.printable import listed
from pipros_rosbag2.commands import add_reading_options, definition_folders
from pipros_tools.cli.runner import CommandError, add_flag, option_parser

if TYPE_CHECKING:
    from optparse import OptionParser

    from pipros_ros2.interface import Endpoint
    from pipros_ros2.look import DomainView, Named


def topics(argv: Sequence[str]) -> int:
    from pipros_ros2.look import topics

    parser = _listing_parser("topic")
    add_flag(parser, "-v", "--verbose", help="list publishers and subscribers, or describe each of them")
    options, names, ends = _looked(parser, argv)
    found = topics(ends)
    if names:
        _describe_topic(_one(found, names[0], "topic"), is_verbose=options.verbose)
    elif options.verbose:
        for heading, kind, side in (
            ("Published", "publisher", "first"),
            ("Subscribed", "subscriber", "second"),
        ):
            print(f"{heading} topics:")
            for each in _visible(found, options):
                count = len(getattr(each, side))
                if count:
                    print(f" * {each.name} [{', '.join(each.types)}] {count} {kind}{'s' * (count > 1)}")
            print()
    else:
        _list(_visible(found, options), options)
    return 0


def services(argv: Sequence[str]) -> int:
    from pipros_ros2.look import services

    options, names, ends = _looked(_listing_parser("service"), argv)
    found = services(ends)
    if names:
        each = _one(found, names[0], "service")
        print(f"Type: {', '.join(each.types)}")
        print(f"Clients count: {len(each.second)}\nServices count: {len(each.first)}")
    else:
        _list([each for each in _visible(found, options) if each.first], options)
    return 0


def actions(argv: Sequence[str]) -> int:
    from pipros_ros2.look import actions

    options, names, ends = _looked(_listing_parser("action"), argv)
    found = actions(ends)
    if names:
        each = _one(found, names[0], "action")
        print(f"Action: {each.name}")
        for title, side in (("clients", each.second), ("servers", each.first)):
            print(f"Action {title}: {len(side)}")
            for end in side:
                print(f"    {end.node} [{', '.join(each.types)}]" if options.types else f"    {end.node}")
    else:
        _list(_visible(found, options), options)
    return 0


def nodes(argv: Sequence[str]) -> int:
    options, names, ends = _looked(_listing_parser("node"), argv)
    found = sorted({each.node for each in ends if each.node})
    shown = [each for each in found if options.all or not each.rpartition("/")[2].startswith("_")]
    if names and names[0] not in found:
        raise CommandError(f"node [{listed(names[0])}] was not found")
    if names:
        _describe_node(names[0], ends)
    elif options.count:
        print(len(shown))
    else:
        sys.stdout.writelines(f"{each}\n" for each in shown)
    return 0


def look_parser(name: str, usage: str, description: str) -> OptionParser:
    """Return a parser with the options of all commands that look at a domain."""
    parser = option_parser(f"pipros ros2 {name}", usage, description)
    parser.add_option(
        "--domain", metavar="N", type="int", help="the ROS 2 domain (default: ROS_DOMAIN_ID, or 0)"
    )
    parser.add_option(
        "--distro", help="humble, jazzy, kilted or lyrical: selects the definitions (default: jazzy)"
    )
    add_reading_options(parser)
    return parser


def _listing_parser(kind: str) -> OptionParser:
    parser = look_parser(f"{kind}s", f"[options] [/{kind}]", f"Lists {kind}s, or describes one.")
    add_flag(parser, "-t", "--show-types", dest="types", help="print types, too")
    add_flag(parser, "-c", "--count", help="print only the number")
    add_flag(parser, "-a", "--all", help="list names with a part that starts with _, too")
    return parser


def _looked(parser: OptionParser, argv: Sequence[str]) -> tuple[Any, list[str], Sequence[Endpoint]]:
    """Return the options, the name, if one is given, and the endpoints of the domain."""
    options, names = parsed(parser, argv, most=1)
    with domain_view(options) as view:
        return options, names, [_printable(each) for each in view.endpoints()]


def _printable(each: Endpoint) -> Endpoint:
    """Return an endpoint whose names, which a peer chooses, are safe for a terminal."""
    name, node, type_hash = map(listed, (each.name, each.node, each.type_hash))
    return replace(each, name=name, node=node, type_hash=type_hash)


def parsed(parser: OptionParser, argv: Sequence[str], *, least: int = 0, most: int) -> tuple[Any, list[str]]:
    """Return the options and words. Exit with an error if there are too few or too many words."""
    options, words = parser.parse_args(list(argv))
    if not least <= len(words) <= most:
        parser.error(
            "an argument is missing" if len(words) < least else f"unexpected argument: {words[most]}"
        )
    return options, words


@contextmanager
def domain_view(options: Any) -> Iterator[DomainView]:
    """Connect to the domain of a command line. As with rostopic, an ignored SIGINT counts."""
    from pipros_ros2.commands.gateway import discovery_of, distribution_of
    from pipros_ros2.look import DomainView
    from pipros_rosbag2.distribution import Distribution

    accept_ctrl_c()
    discovery = discovery_of(options.domain)
    view = DomainView(
        discovery, distribution_of(options.distro) or Distribution.JAZZY, definition_folders(options.msgs)
    )
    try:
        yield view
    finally:
        view.close()


def full_name(name: str) -> str:
    """Return a name with a leading slash."""
    return name if name.startswith("/") else f"/{name}"


def _visible(found: Sequence[Named], options: Any) -> list[Named]:
    return [each for each in found if options.all or not each.is_hidden]


def _list(found: Sequence[Named], options: Any) -> None:
    if options.count:
        print(len(found))
        return
    for each in found:
        print(f"{each.name} [{', '.join(each.types)}]" if options.types else each.name)


def _one(found: Sequence[Named], name: str, kind: str) -> Named:
    each = next((each for each in found if each.name == full_name(name)), None)
    if each is None:
        raise CommandError(f"{kind} [{listed(name)}] was not found")
    return each


def _describe_topic(topic: Named, *, is_verbose: bool) -> None:
    gap = "\n" if is_verbose else ""
    print(f"Type: {', '.join(topic.types)}{gap}")
    for title, kind, ends in (
        ("Publisher", "PUBLISHER", topic.first),
        ("Subscription", "SUBSCRIPTION", topic.second),
    ):
        print(f"{title} count: {len(ends)}{gap}")
        for each in ends if is_verbose else ():
            namespace, _, name = each.node.rpartition("/")
            print(
                f"Node name: {name or '_NODE_NAME_UNKNOWN_'}\nNode namespace: {namespace or '/'}\n"
                f"Topic type: {each.type}\nTopic type hash: {each.type_hash or 'INVALID'}\n"
                f"Endpoint type: {kind}\nGID: {'.'.join(f'{byte:02x}' for byte in each.key)}\nQoS profile:\n"
                f"  Reliability: {each.qos.reliability.name}\n  History (Depth): UNKNOWN\n"
                f"  Durability: {each.qos.durability.name}\n"
            )


def _describe_node(name: str, ends: Sequence[Endpoint]) -> None:
    from pipros_ros2.look import actions, services, topics

    own = [each for each in ends if each.node == name]
    print(name)
    for title, found, side in (
        ("Subscribers", topics(own), "second"),
        ("Publishers", topics(own), "first"),
        ("Service Servers", services(own), "first"),
        ("Service Clients", services(own), "second"),
        ("Action Servers", actions(own), "first"),
        ("Action Clients", actions(own), "second"),
    ):
        print(f"  {title}:")
        for each in found:
            if getattr(each, side) and not each.is_hidden:
                print(f"    {each.name}: {', '.join(each.types)}")
    print()
