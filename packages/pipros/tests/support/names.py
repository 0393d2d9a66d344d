"""Host names defined by a test."""

import socket
from collections.abc import Callable, Mapping
from typing import Any


def hosts(addresses: Mapping[str, str]) -> Callable[..., list[Any]]:
    """Return a replacement for `socket.getaddrinfo` that knows only these hosts and their IPv4 addresses."""

    def resolve(host: str, *_: object, **__: object) -> list[Any]:
        if host not in addresses:
            raise socket.gaierror(socket.EAI_NONAME, "Name or service not known")
        return [(socket.AF_INET, socket.SOCK_STREAM, socket.IPPROTO_TCP, "", (addresses[host], 0))]

    return resolve
