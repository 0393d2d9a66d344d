"""Errors and warnings found by rules."""

from __future__ import annotations

from typing import Any

__all__ = ["WtfError", "WtfWarning"]


class WtfError:
    """An error found by a rule.

    Attributes:
        msg: the text for the user.
        format_msg: the rule's text.
        return_val: the return value of the rule's function.
    """

    def __init__(self, msg: str, format_msg: str | None = None, return_val: Any = None) -> None:
        self.msg = msg
        self.format_msg = msg if format_msg is None else format_msg
        self.return_val = True if return_val is None else return_val


class WtfWarning(WtfError):
    """A warning found by a rule. The reported state may be intended."""
