"""`rostopic echo`: prints messages, from a topic or a bag."""

from __future__ import annotations

from collections.abc import Sequence

from pipros.basics.names import parse_arguments
from pipros_tools.cli.rostopic.echo_options import parse
from pipros_tools.graph.client import GraphClient


def echo(argv: Sequence[str]) -> int:
    arguments = parse_arguments(argv)
    topic, options, bag = parse(arguments.rest)
    if bag is not None:
        from pipros_tools.cli.rostopic.bag import echo_bag

        echo_bag(bag.path, topic, options, shows_all=bag.shows_all)
        return 0
    from pipros_tools.cli.command_node import command_node
    from pipros_tools.cli.rostopic.printing import MessagePrinter
    from pipros_tools.graph.listening import Listening, wait_for_topic

    with GraphClient("rostopic") as graph:
        source = wait_for_topic(graph.master, graph.resolve(topic))
    with command_node("rostopic", argv) as node:
        listening = Listening(node)
        printer = MessagePrinter(options, source, node.clock, listening.finish)
        listening.subscribe(source.topic, printer.show)
        listening.wait()
    return 0
