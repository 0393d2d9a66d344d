"""Checks of the requests with which clients of a bridge connect: their origin and their token. No sockets.

A program sends no `Origin`; a browser sends the one of the page that connects. Pages of this machine may
connect, others only if the server was started with their origin, because a page of any site on the Internet
could otherwise control the robot through the browser of a visitor.
"""

from __future__ import annotations

import ipaddress
import re
from collections.abc import Collection
from dataclasses import dataclass
from urllib.parse import parse_qs, urlsplit

from pipros.basics.printable import printable
from pipros.web.secret import Denied, Secret

ANY_ORIGIN = "*"
_ORIGIN = re.compile(r"https?://([A-Za-z0-9.-]+|\[[0-9A-Fa-f:.]+\])(?::[0-9]{1,5})?")


@dataclass(frozen=True, slots=True)
class Admission:
    """Conditions for clients of a bridge.

    Attributes:
        secret: its token is required; None requires none.
        origins: origins of pages that may connect besides those of this machine: `https://app.example.org`;
            `*` is any.
        allows_null_origin: whether pages without an origin may, which are files and sandboxed frames.
    """

    secret: Secret | None = None
    origins: Collection[str] = ()
    allows_null_origin: bool = False

    def check_origin(self, origin: str | None) -> None:
        """Raise `Denied` if a page of this origin may not connect. None stands for a client without one."""
        if origin is None or ANY_ORIGIN in self.origins or origin in self.origins:
            return
        if self.allows_null_origin if origin == "null" else _is_loopback(origin):
            return
        raise Denied(f"Pages of {printable(origin)} may not connect here; --origin allows them.")

    def has_token(self, path: str, authorization: str | None) -> bool:
        """Return whether a request contains the token, or needs none.

        Args:
            path: path of the request; the token is its last segment or the parameter `token`.
            authorization: the header with that name: `Bearer` and the token.
        """
        if self.secret is None:
            return True
        parts = urlsplit(path)
        scheme, _, value = (authorization or "").partition(" ")
        candidates = [parts.path.rpartition("/")[2], *parse_qs(parts.query).get("token", [])[:1]]
        if scheme.lower() == "bearer":
            candidates.append(value.strip())
        return any(self.secret.is_token(each) for each in candidates)


def _is_loopback(origin: str) -> bool:
    found = _ORIGIN.fullmatch(origin)
    host = found[1].lower().strip("[]") if found else ""
    if host == "localhost" or host.endswith(".localhost"):
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False
