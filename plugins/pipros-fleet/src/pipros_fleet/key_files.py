"""The folders that `pipros fleet keys` writes: one for the fleet and one for each member."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Final

from pipros.basics.errors import PiprosError
from pipros.basics.input_file import read_text
from pipros_fleet.keys import member_name
from pipros_fleet.zenoh_session import Tls

AUTHORITY: Final = "fleet.crt"
AUTHORITY_KEY: Final = "fleet.key"
CERTIFICATE: Final = "member.crt"
KEY: Final = "member.key"
NAME: Final = "name"
MEMBERS: Final = "members.json"


class BadKeys(PiprosError):
    """A folder lacks a key file, or one of its files cannot be read."""


@dataclass(frozen=True, slots=True)
class KeyFolder:
    """The name of a member, and the certificate files that prove its identity."""

    member: str
    tls: Tls


def read_keys(folder: str | Path) -> KeyFolder:
    """Return a member's name and certificate files from the member's folder.

    Raises:
        BadKeys: a file is missing, or the file `name` is unreadable or invalid.
    """
    folder = Path(folder)
    for file in (AUTHORITY, CERTIFICATE, KEY, NAME):
        if not (folder / file).is_file():
            raise BadKeys(
                f"[{folder}] has no file [{file}]; create a complete folder with `pipros fleet keys add`"
            )
    try:
        name = member_name(read_text(folder / NAME, 1000).strip())
    except (OSError, ValueError) as error:
        raise BadKeys(f"{folder / NAME} is unreadable or invalid: {error}") from None
    return KeyFolder(name, Tls(str(folder / AUTHORITY), str(folder / CERTIFICATE), str(folder / KEY)))
