"""`advertisetest`: checks whether topics are advertised and services are provided.

Private parameters `topics` and `services`: lists of `{name, timeout: 10.0, negative: false, type}`.
"""

from __future__ import annotations

import time

from pipros.basics.errors import PiprosError
from pipros.node import Node
from pipros.node.service_link import ServiceLink
from pipros.wire.handshake import HANDSHAKE_S, WireType
from pipros_tools.testing.nodes.expectation import Expectation, Watch, expectations, follow
from pipros_tools.testing.nodes.run_checks import run_checks

# unittest's reports omit the frames of modules that define this variable.
__unittest = True


def check_topics(node: Node) -> None:
    """Raise AssertionError if a topic is not published or, with `negative`, is published."""

    def find(expected: Expectation) -> str | None:
        published = node.master.get_published_topics()
        return next((kind for topic, kind in published if topic == expected.name), None)

    expected = expectations(node, "~topics")
    if not expected and not expectations(node, "~services"):
        raise AssertionError("No topic or service is specified in rosparam.")
    follow(node, Watch(expected, "topic"), find)


def check_services(node: Node) -> None:
    """Raise AssertionError if a service is not provided or, with `negative`, is provided."""

    def find(expected: Expectation) -> str | None:
        try:
            uri = node.master.lookup_service(expected.name)
            return "" if expected.type is None else _service_type(node, expected.name, uri)
        except PiprosError:
            return None

    follow(node, Watch(expectations(node, "~services"), "service"), find)


def _service_type(node: Node, service: str, uri: str) -> str:
    any_type = WireType("*", "*")
    deadline = time.monotonic() + HANDSHAKE_S
    link = ServiceLink(uri, service, node.name, any_type, deadline=deadline, probe=True)
    link.close()
    return link.fields.get("type", "")


def main() -> None:
    run_checks(
        "advertisetest", "AdvertiseTest", advertise_topics=check_topics, advertise_services=check_services
    )
