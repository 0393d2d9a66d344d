"""The link from a publication to one subscriber."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from pipros.net.outgoing import OutgoingLink


class PublisherLink(NamedTuple):
    """One subscriber of a publication: its name, its number, and the link to it."""

    caller_id: str
    number: int
    link: OutgoingLink
