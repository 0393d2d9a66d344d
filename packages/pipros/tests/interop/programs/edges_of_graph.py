"""Print as JSON the edges that genuine rosgraph, the library behind rqt_graph, finds in a system."""

import json
import logging

from rosgraph.impl.graph import Graph

logging.disable()  # of dead nodes, with irrelevant tracebacks
graph = Graph()
graph.update()


def edges(found):
    return sorted([str(edge.start), str(edge.end), str(edge.label)] for edge in found)


print(
    json.dumps(
        {
            "connections": edges(graph.nn_edges), "topics": edges(graph.nt_edges),
            "registered": edges(graph.nt_all_edges), "nodes": sorted(map(str, graph.nn_nodes)),
            "bad": sorted(map(str, graph.bad_nodes)),
        }
    )
)  # fmt: skip
