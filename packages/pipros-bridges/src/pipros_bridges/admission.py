"""Check the origin and the token of clients that connect to a bridge. Performs no I/O.

Programs send no `Origin` header; browsers send the origin of the page that opens the connection. Pages served
from this machine may connect. Pages from elsewhere may connect only if the server was started with their
origin. Otherwise, any website could control the robot through its visitors' browsers.
"""

from __future__ import annotations

import ipaddress
import re
from collections.abc import Collection
from dataclasses import dataclass
from urllib.parse import parse_qs, urlsplit

from pipros.basics.printable import printable
from pipros_server.secret import Denied, Secret

ANY_ORIGIN = "*"
_ORIGIN = re.compile(r"https?://([A-Za-z0-9.-]+|\[[0-9A-Fa-f:.]+\])(?::[0-9]{1,5})?")


@dataclass(frozen=True, slots=True)
class Admission:
    """Conditions under which clients may connect to a bridge.

    Attributes:
        secret: the secret whose token is required; None if no token is required.
        origins: origins of other pages that may connect, such as `https://app.example.org`; `*` allows all.
            Pages served from this machine may always connect.
        allows_null_origin: whether pages without an origin may connect: local files, but also the sandboxed
            frames that any website can create.
        null_origin_option: the option that sets `allows_null_origin`, for the error text.
    """

    secret: Secret | None = None
    origins: Collection[str] = ()
    allows_null_origin: bool = False
    null_origin_option: str = "--origin null"

    def check_origin(self, origin: str | None) -> None:
        """Raise `Denied` if a page with this origin may not connect. Programs send no origin (None)."""
        if origin is None or ANY_ORIGIN in self.origins or origin in self.origins:
            return
        if self.allows_null_origin if origin == "null" else _is_loopback(origin):
            return
        if origin == "null":
            raise Denied(
                "Pages without an origin may not connect here. If you opened an HTML file by double-clicking "
                "it, run 'python -m http.server --bind 127.0.0.1' in its folder and open "
                f"http://127.0.0.1:8000; {self.null_origin_option} allows such files, but also every website."
            )
        raise Denied(
            f"Pages from {printable(origin)} may not connect here; pipros serve and pipros foxglove allow "
            "them with --origin."
        )

    def has_token(self, path: str, authorization: str | None) -> bool:
        """Return whether a request contains the token. If no token is required, return True.

        Args:
            path: path of the request. The token may be its last segment or the query parameter `token`.
            authorization: the `Authorization` header, which may be `Bearer` followed by the token.
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
