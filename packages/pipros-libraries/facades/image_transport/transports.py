"""The supported image transports and their topics."""

from __future__ import annotations

PUBLISHED = SUBSCRIBED = ("raw", "compressed", "compressedDepth")


def topic_of(base: str, transport: str) -> str:
    """Return the topic of a transport. For `raw`, this is the base topic."""
    return base if transport == "raw" else f"{base}/{transport}"
