"""Print the graph of the running system from the parts of rosgraph.impl.graph that rqt_graph uses."""

import sys

import rosgraph.impl.graph
from rosgraph.impl.graph import BadNode, Graph, node_topic, topic_node

graph = Graph()
graph.set_master_stale(5.0)
graph.set_node_stale(5.0)
bad = sys.argv[1:]
for _ in range(20):
    graph.update()
    if sorted(graph.bad_nodes) == bad:
        break


def name(node):
    assert topic_node(node_topic(node)) == node or not node.startswith(" ")
    return repr(node)


print("module", rosgraph.impl.graph.__name__, Graph("/a", "/b").node_ns, Graph(None, "").topic_ns)
for title, nodes in (("nodes", graph.nn_nodes), ("topics", graph.nt_nodes), ("services", graph.srvs)):
    print(title, *sorted(map(name, nodes)))
for title in ("nn_edges", "nt_edges", "nt_all_edges"):
    edges = getattr(graph, title)
    for line in sorted(f"{name(edge.start)} -> {name(edge.end)} [{edge.label}] {edge}" for edge in edges):
        print(title, line)
    print(title, *sorted(edges.edges_by_start), "|", *sorted(edges.edges_by_end))
for node in sorted(graph.bad_nodes):
    print("bad", node, graph.bad_nodes[node].type == BadNode.DEAD)
print("stale", graph.update(), graph.master_stale, graph.node_stale)
