"""Accept only requests whose host and origin are those of the page's server. Performs no I/O."""

from __future__ import annotations

import ipaddress
import re
from collections.abc import Collection
from dataclasses import dataclass, field
from urllib.parse import urlsplit

from pipros_server.secret import Denied, Secret

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
        """Raise `Denied` unless a `Host` header has an allowed name or address.

        Its port may differ from the server's, as behind a tunnel, a container's port or a proxy: DNS
        rebinding requires a foreign name.
        """
        self._own_place(host, self.is_secure)

    def check_origin(self, origin: str | None, host: str | None, *, is_behind_tls: bool = False) -> None:
        """Raise `Denied` unless an `Origin` header has this server's scheme, and the name and port of `Host`.

        Otherwise, the pages of another server on this machine could connect. The names in `hosts` may be
        mixed if both headers have the server's own port, which no other server on this machine has.
        `is_behind_tls` states that a proxy has added TLS: see `is_forwarded_tls`.
        """
        try:
            parts = urlsplit(origin or "")
        except ValueError:
            raise Denied("The origin of this connection is malformed.") from None
        is_secure = self.is_secure or is_behind_tls
        if parts.scheme != ("https" if is_secure else "http"):
            raise Denied(f"Pages from {origin or 'an unknown origin'} may not connect here.")
        name, port = self._own_place(parts.netloc, is_secure)
        own = self._own_place(host, is_secure)
        if (name, port) != own and not (name in self.hosts and port == own[1] == self.port):
            raise Denied(f"Pages from {origin} may not connect to {host or 'this server'}.")

    def _own_place(self, host: str | None, is_secure: bool) -> tuple[str, int]:
        """Return the name and the port in a `Host` header; see `check_host`.

        A header without a port implies the scheme's default port.
        """
        found = _HOST.fullmatch(host or "")
        name = found["name"].lower() if found else ""
        port = (found["port"] if found else None) or ("443" if is_secure else "80")
        is_own = name in self.hosts or (self.takes_addresses and _is_address(name))
        if not is_own:
            raise Denied(f"This server is not {host or 'the one requested'}. Open the address it printed.")
        return name, int(port)

    def _url(self, host: str, proof: str, tab: str) -> str:
        scheme = "https" if self.is_secure else "http"
        return f"{scheme}://{host}:{self.port}/#{proof}{'/' + tab if tab else ''}"


def is_forwarded_tls(forwarded: str | None) -> bool:
    """Return whether a header `X-Forwarded-Proto`, which no page can set, says that a proxy has added TLS."""
    return (forwarded or "").strip().lower() in ("https", "wss")


def _is_address(name: str) -> bool:
    try:
        ipaddress.ip_address(name.strip("[]"))
    except ValueError:
        return False
    return True
