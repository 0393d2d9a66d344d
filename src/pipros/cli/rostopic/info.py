"""`rostopic info`, `rostopic type` and `rostopic find`."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from pipros.cli.program import CommandError, Surroundings, option_parser
from pipros.cli.rostopic.types import field_type, topic_type
from pipros.errors import NotFound, Refused
from pipros.graph.picture import Picture
from pipros.names import parse_arguments
from pipros.net.master import MasterClient


def show_info(argv: Sequence[str]) -> int:
    parser = option_parser("rostopic", "info /topic")
    _, arguments = parser.parse_args(list(parse_arguments(argv).rest))
    if not arguments:
        parser.error("you must specify a topic name")
    if len(arguments) > 1:
        parser.error("you may only specify one topic name")
    with Surroundings("rostopic") as here:
        print(describe_topic(here.master, here.resolve(arguments[0])))
    return 0


def describe_topic(master: MasterClient, topic: str) -> str:
    """The text of `rostopic info`.

    Raises:
        CommandError: nobody publishes or subscribes the topic.
    """
    picture = Picture.from_state(master.get_system_state())
    if topic not in picture.publishers and topic not in picture.subscribers:
        raise CommandError(f"Unknown topic {topic}")
    types = dict(master.get_topic_types())
    lines = [f"Type: {types.get(topic, 'unknown type')}", ""]
    for heading, registrations in (("Publishers", picture.publishers), ("Subscribers", picture.subscribers)):
        nodes = registrations.get(topic)
        if nodes:
            lines.append(f"{heading}: ")
            lines += [f" * {node} ({_api(master, node)})" for node in nodes]
        else:
            lines.append(f"{heading}: None")
        lines.append("")
    return "\n".join(lines) + "\n"


def _api(master: MasterClient, node: str) -> str:
    try:
        return master.lookup_node(node)
    except Refused:  # it has left since
        return "unknown"


def show_type(argv: Sequence[str]) -> int:
    from argparse import ArgumentParser

    parser = ArgumentParser(prog="rostopic type")
    parser.add_argument("topic_or_field", help="Topic or field name")
    options = parser.parse_args(list(parse_arguments(argv).rest))
    with Surroundings("rostopic") as here:
        asked = here.resolve(options.topic_or_field)
        type_name, topic = topic_type(here.master, asked)
    if type_name is None:
        return _unknown_type(asked)
    path = asked[len(topic) + 1 :]
    if not path:
        print(type_name)
        return 0
    try:
        print(type_name, path, field_type(type_name, path.split("/")))
    except NotFound:
        return _unknown_type(asked)
    return 0


def _unknown_type(asked: str) -> int:
    print(f"unknown topic type [{asked}]", file=sys.stderr)
    return 1


def find_topics(argv: Sequence[str]) -> int:
    parser = option_parser("rostopic", "find msg-type")
    _, arguments = parser.parse_args(list(parse_arguments(argv).rest))
    if not arguments:
        parser.error("please specify a message type")
    if len(arguments) > 1:
        parser.error("you may only specify one message type")
    with Surroundings("rostopic") as here:
        print("\n".join(topics_of_type(here.master, arguments[0])))
    return 0


def topics_of_type(master: MasterClient, type_name: str) -> list[str]:
    """The topics of a message type, sorted."""
    return sorted(topic for topic, found in master.get_topic_types() if found == type_name)
