"""The transports that images can have here, and their topics."""

from __future__ import annotations

PUBLISHED = ("raw", "compressed")
SUBSCRIBED = ("raw", "compressed", "compressedDepth")


def topic_of(base: str, transport: str) -> str:
    """The topic of a transport: `raw` has the base topic itself."""
    return base if transport == "raw" else f"{base}/{transport}"
