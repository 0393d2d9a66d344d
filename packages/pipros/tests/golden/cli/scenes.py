"""The graph that a transcript needs, and replacements for output that varies between runs."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator

from tests.golden.cli.stub_graph import StubGraph

MASKS = {
    # argparse of Python 3.13 and newer prints the value of an option only once
    r"(?m)^  (-\w), (--[\w-]+) ([A-Z_]+)$": r"  \1 \3, \2 \3",
    r"(?m)^(Did you mean|ROS_PACKAGE_PATH is) .*\?\n": "",  # advice of pipros
    r"(127\.0\.0\.1|localhost):(?!1\b)\d+": r"\1:PORT",
    r"time=[\d.]+ms": "time=N ms",
    r"average: [\d.]+ms": "average: N ms",
    # rosnode 1.17 prints the type of a topic without publishers, 1.15 does not
    r"(?m)^ \* /clock \[(unknown type|rosgraph_msgs/Clock)\]$": " * /clock [rosgraph_msgs/Clock]",
    r"seq: +\d+": "seq: N",  # genuine ROS counts a latched message once for each subscriber
    r"\b1[78]\d{17}\b": "NOW",
    r"(?m)^(NOW|1000000000005|0),\d+,(?=1000000000005|0,)": r"\1,N,",
}


@contextlib.contextmanager
def graph_for(transcript: str, master_uri: str) -> Iterator[None]:
    """Start the graph named in the first line of the transcript: `graph: robot` or `graph: empty`."""
    if not transcript.startswith("graph: robot\n"):
        yield
        return
    graph = StubGraph(master_uri)
    try:
        yield
    finally:
        graph.close()


def needs_sources(transcript: str) -> bool:
    """Return True for `graph: sources`: a real node that publishes the messages of `sources.py`."""
    return transcript.startswith("graph: sources\n")
