"""Accept only requests whose host and origin are those of the page's server. Performs no I/O."""

from __future__ import annotations

import ipaddress
import re
from collections.abc import Collection
from dataclasses import dataclass, field
from urllib.parse import urlsplit

from pipros.server.secret import Denied, Secret

LOOPBACK_HOSTS = frozenset({"localhost", "127.0.0.1", "[::1]"})

_HOST = re.compile(r"(?P<name>\[[^\]]*\]|[^:\[\]]*)(?::(?P<port>[0-9]{1,5}))?")


@dataclass(frozen=True, slots=True)
class Access:
    """Conditions that a request must meet.

    Attributes:
        port: port of the server.
        hosts: names allowed in the `Host` header.
        is_secure: whether the server uses TLS.
        takes_addresses: whether `Host` may be any IP address. This is safe, because DNS rebinding requires a
            name.
        secret: the secret with which clients authenticate.
    """

    port: int
    hosts: Collection[str] = LOOPBACK_HOSTS
    is_secure: bool = False
    takes_addresses: bool = False
    secret: Secret = field(default_factory=Secret)

    def url(self, host: str, tab: str = "") -> str:
        """Return the address to open, with the token in its fragment, which is not sent to servers."""
        return self._url(host, f"token={self.secret.token}", tab)

    def url_with_code(self, host: str, code: str, tab: str = "") -> str:
        """Return the address with a one-time code instead of the token."""
        return self._url(host, f"code={code}", tab)

    def check_host(self, host: str | None) -> None:
        """Raise `Denied` unless a `Host` header has an allowed name or address, and the server's port.

        A header without a port implies the scheme's default port.
        """
        self._own_name(host)

    def check_origin(self, origin: str | None, host: str | None) -> None:
        """Raise `Denied` unless an `Origin` header has this server's scheme, and passes `check_host`.

        An IP address that is not in `hosts` must also equal the one in the request's `Host` header.
        Otherwise, a site that is opened by its IP address and listens on the same port could connect.
        """
        try:
            parts = urlsplit(origin or "")
        except ValueError:
            raise Denied("The origin of this connection is malformed.") from None
        if parts.scheme != ("https" if self.is_secure else "http"):
            raise Denied(f"Pages from {origin or 'an unknown origin'} may not connect here.")
        name = self._own_name(parts.netloc)
        if name not in self.hosts and name != self._own_name(host):
            raise Denied(f"Pages from {origin} may not connect to {host or 'this server'}.")

    def _own_name(self, host: str | None) -> str:
        """Return the name in a `Host` header; see `check_host`."""
        found = _HOST.fullmatch(host or "")
        name = found["name"].lower() if found else ""
        port = (found["port"] if found else None) or ("443" if self.is_secure else "80")
        is_own = name in self.hosts or (self.takes_addresses and _is_address(name))
        if not is_own or int(port) != self.port:
            raise Denied(f"This server is not {host or 'the one requested'}. Open the address it printed.")
        return name

    def _url(self, host: str, proof: str, tab: str) -> str:
        scheme = "https" if self.is_secure else "http"
        return f"{scheme}://{host}:{self.port}/#{proof}{'/' + tab if tab else ''}"


def _is_address(name: str) -> bool:
    try:
        ipaddress.ip_address(name.strip("[]"))
    except ValueError:
        return False
    return True
