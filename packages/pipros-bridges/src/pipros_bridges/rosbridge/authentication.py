"""The `auth` operation, checked as in rosauth: a SHA-512 hash of a shared secret and the client's claims.

With `mac`, a client proves that it knows the secret. Unlike in rosauth, each hash is accepted only once, and
hashes are compared in constant time. The claims are hashed without separators, so moving characters from one
claim to the next does not change the hash. Therefore, a used proof is recognized by its hash, not by its
claims.
"""

from __future__ import annotations

import hashlib
import hmac
from collections.abc import Callable, Mapping
from typing import Any

_NAMES = ("client", "dest", "rand", "level")
CLOCKS_DIFFER_S = 5
"""Maximum difference between `t` and the clock of this machine."""
SECRET_CHARACTERS = 16
_MAX_USED = 10_000


class Authenticator:
    """Checks the claims of all clients of a server."""

    def __init__(self, secret: str, now_s: Callable[[], float]) -> None:
        """Use a secret of `SECRET_CHARACTERS` characters.

        Raises:
            ValueError: the secret has another length.
        """
        if len(secret) != SECRET_CHARACTERS:
            raise ValueError(f"the secret must have {SECRET_CHARACTERS} characters, got {len(secret)}")
        self._secret = secret
        self._now_s = now_s
        self._used: dict[str, int] = {}

    def accepts(self, claims: Mapping[str, Any]) -> bool:
        """Return whether the claims are authentic and current, and are used for the first time."""
        mac, sent_s, end_s = claims.get("mac"), claims.get("t"), claims.get("end")
        texts = [claims.get(name) for name in _NAMES]
        if type(sent_s) is not int or type(end_s) is not int or not isinstance(mac, str) or not mac.isascii():
            return False
        if not all(isinstance(text, str) for text in texts):
            return False
        client, dest, rand, level = texts
        claimed = f"{self._secret}{client}{dest}{rand}{sent_s}{level}{end_s}"
        expected = hashlib.sha512(claimed.encode(errors="replace")).hexdigest()
        if not hmac.compare_digest(mac, expected):
            return False
        now_s = self._now_s()
        self._used = {key: t for key, t in self._used.items() if abs(now_s - t) < CLOCKS_DIFFER_S}
        is_new = expected not in self._used and len(self._used) < _MAX_USED
        if abs(now_s - sent_s) >= CLOCKS_DIFFER_S or end_s <= now_s or not is_new:
            return False
        self._used[expected] = sent_s
        return True
