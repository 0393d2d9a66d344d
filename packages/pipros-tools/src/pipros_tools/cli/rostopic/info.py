"""`rostopic info`, `rostopic type` and `rostopic find`: describe topics, or find them by type."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from pipros.basics.errors import NotFound
from pipros.basics.names import parse_arguments
from pipros.basics.printable import listed
from pipros_tools.cli.runner import only_argument
from pipros_tools.graph.client import GraphClient
from pipros_tools.graph.topics import describe_topic, field_type, topic_type, topics_of_type


def show_info(argv: Sequence[str]) -> int:
    name = only_argument(
        "rostopic",
        "info /topic",
        argv,
        missing="you must specify a topic name",
        several="you may only specify one topic name",
    )
    with GraphClient("rostopic") as graph:
        print(describe_topic(graph.master, graph.resolve(name)))
    return 0


def show_type(argv: Sequence[str]) -> int:
    from argparse import ArgumentParser

    parser = ArgumentParser(prog="rostopic type")
    parser.add_argument("topic_or_field", help="Topic or field name")
    options = parser.parse_args(list(parse_arguments(argv).rest))
    with GraphClient("rostopic") as graph:
        name = graph.resolve(options.topic_or_field)
        type_name, topic = topic_type(graph.master, name)
    if type_name is None:
        return _unknown_type(name)
    path = name[len(topic) + 1 :]
    if not path:
        print(listed(type_name))
        return 0
    try:
        print(type_name, path, field_type(type_name, path.split("/")))
    except NotFound:
        return _unknown_type(name)
    return 0


def _unknown_type(name: str) -> int:
    print(f"unknown topic type [{name}]", file=sys.stderr)
    return 1


def find_topics(argv: Sequence[str]) -> int:
    type_name = only_argument(
        "rostopic",
        "find msg-type",
        argv,
        missing="please specify a message type",
        several="you may only specify one message type",
    )
    with GraphClient("rostopic") as graph:
        print("\n".join(map(listed, topics_of_type(graph.master, type_name))))
    return 0
