"""`rostopic list`: lists the topics of the running system or of a bag."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from pipros.basics.errors import Refused
from pipros.basics.names import parse_arguments
from pipros.basics.printable import listed
from pipros.net.master_client import MasterClient
from pipros_tools.cli.runner import option_parser
from pipros_tools.cli.terminal import CYAN, DIM, table
from pipros_tools.graph.client import GraphClient
from pipros_tools.graph.system_state import Registrations, SystemState, is_below


def list_topics(argv: Sequence[str]) -> int:
    parser = option_parser("rostopic", "list [/namespace]")
    parser.add_option("-b", "--bag", dest="bag", metavar="BAGFILE", help="list topics in .bag file")
    parser.add_option(
        "-v", "--verbose", dest="verbose", action="store_true", help="list full details about each topic"
    )
    parser.add_option("-p", dest="publishers", action="store_true", help="list only publishers")
    parser.add_option("-s", dest="subscribers", action="store_true", help="list only subscribers")
    parser.add_option("--host", dest="by_host", action="store_true", help="group by host name")
    options, arguments = parser.parse_args(list(parse_arguments(argv).rest))
    if len(arguments) > 1:
        parser.error("you may only specify one input topic")
    if options.bag:
        for option in ("-s", "-p", "--host"):
            if option in argv:
                parser.error(f"{option} option is not valid with bags")
        from pipros_tools.cli.rostopic.bag import list_bag

        list_bag(options.bag, arguments[0] if arguments else None)
        return 0
    if options.publishers and options.subscribers:
        parser.error("you may only specify one of -p, -s")

    sections = (not options.subscribers, not options.publishers)
    with GraphClient("rostopic") as graph:
        ns = graph.resolve(arguments[0]) if arguments else "/"
        state = SystemState.from_state(graph.master.get_system_state())
        state = SystemState(
            _below(state.publishers, ns) if sections[0] else {},
            _below(state.subscribers, ns) if sections[1] else {},
            {},
        )
        types = dict(graph.master.get_topic_types()) if options.verbose else {}
        parts = list(_split_by_host(state, _Hosts(graph.master))) if options.by_host else []
    if not options.by_host:
        print("\n".join(_lines(state, types, sections, options.verbose)))
    for host, part in parts:
        print(f"Host [{listed(host)}]:")
        print(_indented(_lines(part, types, sections, options.verbose)))
    return 0


def _below(registrations: Registrations, ns: str) -> Registrations:
    return {topic: nodes for topic, nodes in registrations.items() if is_below(topic, ns)}


def _lines(
    state: SystemState, types: Mapping[str, str], sections: tuple[bool, bool], verbose: bool
) -> list[str]:
    """Return the lines to print. `sections` selects whether to list publishers, subscribers or both."""
    if not verbose:
        return [listed(topic) for topic in state.topics()]
    lines = [""]
    kinds = (("Published", state.publishers), ("Subscribed", state.subscribers))
    for is_wanted, (heading, registrations) in zip(sections, kinds, strict=True):
        if not is_wanted:
            continue
        lines.append(f"{heading} topics:")
        role = "publisher" if heading == "Published" else "subscriber"
        rows = []
        for topic, nodes in registrations.items():
            plural = "" if len(nodes) == 1 else "s"
            type_text = f"[{types.get(topic, 'unknown type')}]"
            rows.append([" *", listed(topic), listed(type_text), f"{len(nodes)} {role}{plural}"])
        lines += table(rows, ("", "", CYAN, DIM))
        lines.append("")
    return lines


def _indented(lines: Sequence[str]) -> str:
    """Indent lines by two spaces like Noetic, except for an empty first or last line."""
    last = len(lines) - 1
    return "\n".join(f"  {line}" if line or 0 < at < last else "" for at, line in enumerate(lines))


class _Hosts:
    """The hosts of nodes, looked up with one call to the master per node."""

    def __init__(self, master: MasterClient) -> None:
        self._master = master
        self._known: dict[str, str] = {}

    def of(self, node: str) -> str:
        if node not in self._known:
            self._known[node] = self._look_up(node)
        return self._known[node]

    def _look_up(self, node: str) -> str:
        from pipros.net.address import split_uri

        try:
            return split_uri(self._master.lookup_node(node))[0]
        except (Refused, ValueError):  # the node has just unregistered, or its address is invalid
            return "unknown"


def _split_by_host(state: SystemState, hosts: _Hosts) -> Iterable[tuple[str, SystemState]]:
    kinds = (state.publishers, state.subscribers)
    for host in sorted({hosts.of(node) for kind in kinds for nodes in kind.values() for node in nodes}):
        publishers, subscribers = (_on_host(kind, host, hosts) for kind in kinds)
        yield host, SystemState(publishers, subscribers, {})


def _on_host(registrations: Registrations, host: str, hosts: _Hosts) -> Registrations:
    graph = {
        topic: [node for node in nodes if hosts.of(node) == host] for topic, nodes in registrations.items()
    }
    return {topic: nodes for topic, nodes in graph.items() if nodes}
