"""The limits of the server for assistants."""

from typing import NamedTuple


class AssistantLimits(NamedTuple):
    """The limits of the server for assistants.

    Get them with `limits.of(AssistantLimits)`, where `limits` is a `Limits`.

    Attributes:
        assistant_approval_s: maximum time for which an act awaits approval.
    """

    assistant_approval_s: float = 45.0
