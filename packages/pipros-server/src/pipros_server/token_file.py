"""Read a server's token file: one client token per line; `#` starts a comment."""

from __future__ import annotations

import re
import stat
from pathlib import Path
from typing import Final

from pipros.basics.errors import PiprosError
from pipros.basics.input_file import read_text
from pipros.basics.posix import HAS_OWNERS, user_id

SHORTEST: Final = 16
"""Minimum number of characters in a token."""
_LIMIT_BYTES: Final = 64 * 1024
_TOKEN = re.compile(r"[A-Za-z0-9._~-]+")


class BadTokenFile(PiprosError):
    """A token file is unreadable, accessible to other users, or contains no token or an invalid one."""


def read_tokens(path: str) -> list[str]:
    """Return the tokens in a file, at least one.

    Raises:
        BadTokenFile: the file cannot be read, other users can read or change it, it contains no token, or a
            token is too short or contains characters that would have to be quoted in a URL.
    """
    try:
        text = read_text(path, _LIMIT_BYTES)
        found = Path(path).stat()
    except (OSError, UnicodeDecodeError) as error:
        raise BadTokenFile(f"cannot read {path}: {getattr(error, 'strerror', None) or error}") from None
    if HAS_OWNERS and (found.st_uid not in (0, user_id()) or found.st_mode & (stat.S_IRWXG | stat.S_IRWXO)):
        raise BadTokenFile(f"{path} must belong to you and be readable only by you: chmod 600 {path}")
    tokens = []
    for number, line in enumerate(text.splitlines(), 1):
        token = line.partition("#")[0].strip()
        if not token:
            continue
        if len(token) < SHORTEST or not _TOKEN.fullmatch(token):
            raise BadTokenFile(
                f"{path}:{number}: a token must have at least {SHORTEST} characters, "
                "and only letters, digits, '-', '.', '_' and '~'"
            )
        tokens.append(token)
    if not tokens:
        raise BadTokenFile(f"{path} contains no token")
    return tokens
