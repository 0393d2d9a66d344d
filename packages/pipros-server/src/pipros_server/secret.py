"""Authenticate clients of a pipros server with a shared secret instead of cookies. Performs no I/O.

Browsers send cookies to every server on the same host name, regardless of its port. So clients present the
secret explicitly: in the first message of a WebSocket, or in the header `Authorization: Bearer` of a request.
They read the secret from the fragment of the printed address, which browsers do not send. An address that is
passed to another program, such as the desktop's browser, contains a one-time code instead, which is worthless
once it has been used.
"""

from __future__ import annotations

import hmac
import json
import secrets
import time
from collections.abc import Callable, Sequence
from typing import Final

CODE_S: Final = 60.0
"""How long a one-time code is valid."""
CODES: Final = 100
"""Maximum number of valid codes. A new code beyond that replaces the oldest."""


class Denied(Exception):
    """The request is refused. The text states the reason and, if there is one, the remedy."""


class Secret:
    """The secret of one server, and its one-time codes. Not thread-safe.

    Comparisons take constant time for values of the same length.

    Attributes:
        token: the secret as text; contains only characters that need no quoting in a URL.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic, tokens: Sequence[str] = ()) -> None:
        """Create a secret with a random token, or with the given tokens. `token` is the first of them."""
        self._tokens = tuple(tokens) or (secrets.token_urlsafe(24),)
        self.token: Final = self._tokens[0]
        self._clock = clock
        self._codes: dict[str, float] = {}  # expiry time of each code, oldest first

    def __repr__(self) -> str:
        return "Secret()"  # omit the token, because representations end up in logs

    def is_token(self, value: object) -> bool:
        """Return whether a value from a client is a token of this server."""
        return any(_is_equal(value, token) for token in self._tokens)

    def check_first_message(self, message: str | bytes) -> None:
        """Raise `Denied` unless a message is `{"token": …}`, or `{"code": …}` with a valid one-time code."""
        try:
            values = json.loads(message)
        except (ValueError, RecursionError):
            values = None
        if isinstance(values, dict) and (
            self.is_token(values.get("token")) or self.redeem(values.get("code"))
        ):
            return
        raise Denied("The token is missing or wrong. Open the address that the server printed.")

    def check_authorization(self, header: str | None) -> None:
        """Raise `Denied` unless an `Authorization` header consists of `Bearer` and a valid token."""
        scheme, _, value = (header or "").partition(" ")
        if scheme.lower() != "bearer" or not self.is_token(value.strip()):
            raise Denied(
                "This request requires the header Authorization: Bearer with the token of this server."
            )

    def new_code(self) -> str:
        """Return a code that is valid once, for `CODE_S` seconds. Give it only to trusted clients."""
        while len(self._codes) >= CODES:
            del self._codes[next(iter(self._codes))]
        code = secrets.token_urlsafe(24)
        self._codes[code] = self._clock() + CODE_S
        return code

    def is_unused(self, code: str) -> bool:
        """Return whether a code is still valid."""
        return code in self._codes and self._codes[code] > self._clock()

    def redeem(self, value: object) -> bool:
        """Return whether a value from a client is a valid code, and invalidate the code."""
        known = [code for code in self._codes if _is_equal(value, code)]
        return any(self._codes.pop(code) > self._clock() for code in known)


def _is_equal(value: object, expected: str) -> bool:
    return isinstance(value, str) and value.isascii() and hmac.compare_digest(value, expected)
