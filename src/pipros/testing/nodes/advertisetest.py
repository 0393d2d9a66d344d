"""`advertisetest`: topics are advertised and services offered, or are not.

Private parameters `topics` and `services`: lists of `{name, timeout: 10.0, negative: false, type}`.
"""

from __future__ import annotations

from pipros.errors import PiprosError, Refused
from pipros.node import Node
from pipros.node.client import ServiceLink
from pipros.testing.nodes.program import Expectation, check_all, expectations, run_check
from pipros.wire.handshake import Interface


def check(node: Node) -> None:
    """Raises AssertionError when a topic or service is not there, or is and must not be."""

    def find_topic(one: Expectation) -> str | None:
        return {topic: kind for topic, kind in node.master.get_published_topics()}.get(one.name)

    def find_service(one: Expectation) -> str | None:
        try:
            uri = node.master.lookup_service(one.name)
            link = ServiceLink(uri, one.name, node.name, Interface("*", "*"), deadline=None, probe=True)
        except (Refused, PiprosError):
            return None
        link.close()
        return link.fields.get("type", "")

    check_all(node, expectations(node, "~topics"), find_topic, what="topic")
    check_all(node, expectations(node, "~services"), find_service, what="service")


def main() -> None:
    run_check("advertisetest", check)
