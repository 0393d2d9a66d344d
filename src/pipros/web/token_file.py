"""Files with the tokens that clients of a server present: one per line, after `#` a comment."""

from __future__ import annotations

import re
import stat
from pathlib import Path
from typing import Final

from pipros.basics.errors import PiprosError
from pipros.basics.input_file import read_text
from pipros.basics.posix import HAS_OWNERS, user_id

SHORTEST: Final = 16
"""Minimum number of characters of a token."""
_LIMIT_BYTES: Final = 64 * 1024
_TOKEN = re.compile(r"[A-Za-z0-9._~-]+")


class BadTokenFile(PiprosError):
    """A file of tokens cannot be read, or has none, or is readable for others."""


def read_tokens(path: str) -> list[str]:
    """Return the tokens in a file, at least one.

    Raises:
        BadTokenFile: the file cannot be read, other users can read or replace it, it has no token, or one is
            too short or contains characters that a URL would have to quote.
    """
    try:
        text = read_text(path, _LIMIT_BYTES)
        found = Path(path).stat()
    except (OSError, UnicodeDecodeError) as error:
        raise BadTokenFile(f"cannot read {path}: {getattr(error, 'strerror', None) or error}") from None
    if HAS_OWNERS and (found.st_uid not in (0, user_id()) or found.st_mode & (stat.S_IRWXG | stat.S_IRWXO)):
        raise BadTokenFile(f"{path} must belong to you and be readable for you only: chmod 600 {path}")
    tokens = []
    for number, line in enumerate(text.splitlines(), 1):
        token = line.partition("#")[0].strip()
        if not token:
            continue
        if len(token) < SHORTEST or not _TOKEN.fullmatch(token):
            raise BadTokenFile(
                f"{path}:{number}: a token must have at least {SHORTEST} characters, "
                "which are letters, digits, '-', '.', '_' or '~'"
            )
        tokens.append(token)
    if not tokens:
        raise BadTokenFile(f"{path} has no token")
    return tokens
