"""Who may see the page: anyone who has the token and uses the page's own address. No sockets."""

from __future__ import annotations

import hmac
import ipaddress
import secrets
from collections.abc import Collection
from dataclasses import dataclass
from http.cookies import CookieError, SimpleCookie
from urllib.parse import parse_qs, urlsplit

LOOPBACK_HOSTS = frozenset({"localhost", "127.0.0.1", "[::1]"})


class Denied(Exception):
    """The request is refused. The text says why and what to do."""


@dataclass(frozen=True, slots=True)
class Access:
    """What a request must have to be answered.

    Attributes:
        token: the secret in the address.
        port: of the server.
        hosts: the names that a `Host` header may have.
        is_secure: whether the server uses TLS.
        takes_addresses: whether `Host` may be any IP address; only names can be rebound.
    """

    port: int
    hosts: Collection[str] = LOOPBACK_HOSTS
    is_secure: bool = False
    token: str = ""
    takes_addresses: bool = False

    @classmethod
    def with_new_token(
        cls, port: int, hosts: Collection[str], *, is_secure: bool, takes_addresses: bool = False
    ) -> Access:
        return cls(port, frozenset(hosts), is_secure, secrets.token_urlsafe(24), takes_addresses)

    @property
    def cookie_name(self) -> str:
        """The name of the cookie, which contains the port.

        Browsers keep cookies by host, and several servers on one host must not share one."""
        return f"pipros_{self.port}"

    @property
    def cookie(self) -> str:
        """The `Set-Cookie` header for a browser that sent the token."""
        secure = "; Secure" if self.is_secure else ""
        return f"{self.cookie_name}={self.token}; Path=/; HttpOnly; SameSite=Strict{secure}"

    def url(self, host: str, tab: str = "") -> str:
        """The address to open, with the token in it."""
        scheme = "https" if self.is_secure else "http"
        return f"{scheme}://{host}:{self.port}/?token={self.token}{'#' + tab if tab else ''}"

    def check_host(self, host: str | None) -> None:
        """Raises `Denied` when the `Host` of a request is not a name of the server."""
        name, _, port = (host or "").rpartition(":")
        is_own = name.lower() in self.hosts or (self.takes_addresses and _is_address(name))
        if not is_own or port != str(self.port):
            raise Denied(f"This server is not {host or 'without a name'}. Open the address that it printed.")

    def check_origin(self, origin: str | None) -> None:
        """Raises `Denied` when a WebSocket was opened by a page of another site."""
        try:
            parts = urlsplit(origin or "")
        except ValueError:
            raise Denied("The origin of this connection is malformed.") from None
        if parts.scheme != ("https" if self.is_secure else "http"):
            raise Denied(f"Pages of {origin or 'unknown origin'} may not connect here.")
        self.check_host(parts.netloc)

    def comes_with_token(self, path: str) -> bool:
        """Whether the address contains the token."""
        values = parse_qs(urlsplit(path).query).get("token", [])
        return any(self._is_token(value) for value in values)

    def check_cookie(self, cookies: str | None) -> None:
        """Raises `Denied` without the cookie."""
        try:
            morsel = SimpleCookie(cookies or "").get(self.cookie_name)
        except CookieError:
            morsel = None
        if morsel is None or not self._is_token(morsel.value):
            raise Denied("Open the address that rqt_graph printed: it has the token of this server in it.")

    def _is_token(self, value: str) -> bool:
        return hmac.compare_digest(value.encode(), self.token.encode())


def _is_address(name: str) -> bool:
    try:
        ipaddress.ip_address(name.strip("[]"))
    except ValueError:
        return False
    return True
