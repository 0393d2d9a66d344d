"""Any response to `getBusInfo` and `getBusStats` becomes an observation that the page can send.

An input is one XML-RPC answer, a line `===`, and the other.

python -m tests.fuzz.bus_answers --seconds 60
"""

import itertools
import json
import sys
from collections.abc import Sequence
from typing import Any

from pipros.basics.errors import PiprosError
from pipros.wire.xmlrpc import decode_response
from pipros_page.views.graph_values import node_values, scene_values, traffic_values
from pipros_page.views.topics import topic_rows
from pipros_tools.graph.drawing.node_graph import GraphOptions, node_graph
from pipros_tools.graph.drawing.scene import draw
from pipros_tools.graph.observer import SystemObserver
from tests.fuzz import mutation

WORDS = [
    *(b"<value><double>inf</double></value>", b"<value><double>nan</double></value>", b"<int>-1</int>"),
    *(b"<value><double>1e300</double></value>", b"<i8>9223372036854775807</i8>", b"<boolean>1</boolean>"),
    *(b"<value><array><data>", b"</data></array></value>", b"<value>/level</value>", b"<value>/peer</value>"),
    *(b"<nil/>", b"<struct></struct>", b"<value><int>2</int></value>", b"<base64>AA==</base64>", b"=\n=="),
]
STATE = [[["/level", ["/node"]]], [["/level", ["/peer"]]], []]


class Master:
    """Knows `/node`, which publishes `/level` to `/peer`."""

    caller_id = "/fuzz"

    def get_system_state(self) -> Sequence[Sequence[Sequence[Any]]]:
        return STATE

    def get_topic_types(self) -> Sequence[Sequence[str]]:
        return [["/level", "std_msgs/String"]]

    def lookup_node(self, node: str) -> str:
        return f"http://{node[1:]}:1/"


def target(data: bytes) -> None:
    first, _, second = data.partition(b"\n===\n")

    def ask(_: str) -> tuple[Any, Any]:
        return decode_response(first), decode_response(second)

    try:
        ask("")
    except PiprosError:
        return
    seconds = itertools.count()
    observer = SystemObserver(Master(), ask=ask, ask_types=ask, now_s=lambda: float(next(seconds)))
    for _ in range(3):
        observation = observer.poll()
    graph = node_graph(
        observation.state, observation.connections, observation.unreachable, GraphOptions(mode="all"),
        observation.wrong_types,
    )  # fmt: skip
    scene = draw(graph, with_traffic=True)
    shown = scene_values(scene), traffic_values(observation, scene), node_values(observation, "/node")
    text = json.dumps([shown, list(topic_rows(observation))], allow_nan=False)
    assert len(text) < 10_000


if __name__ == "__main__":
    sys.exit(mutation.main(target, "bus_answers", WORDS))
