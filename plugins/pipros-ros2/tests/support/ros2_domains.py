"""ROS 2 domains for tests."""

import contextlib
import socket
from collections.abc import Iterator

from pipros_ros2.rtps.domain import MAX_DOMAIN, multicast_port


@contextlib.contextmanager
def free_domain() -> Iterator[int]:
    """Yield a domain that no other test on this machine uses.

    A bound UDP port, which RTPS does not use, marks the domain as used.
    """
    for domain in range(1, MAX_DOMAIN + 1):
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as claim:
            try:
                claim.bind(("127.0.0.1", multicast_port(domain) + 5))
            except OSError:
                continue
            yield domain
            return
    raise RuntimeError("all domains are in use")
