"""Errors and warnings that the `roswtf` rules add to a context."""

from __future__ import annotations

from typing import Any

from pipros.health.wtf.context import WtfContext

Rule = tuple[Any, str]
"""A function and its text; `%(name)s` in the text is replaced by an attribute of the context."""


class WtfError:
    """An error found by a rule.

    Attributes:
        msg: the text for the user.
        format_msg: the text of the rule.
        return_val: the return value of the rule's function.
    """

    def __init__(self, msg: str, format_msg: str | None = None, return_val: Any = None) -> None:
        self.msg = msg
        self.format_msg = msg if format_msg is None else format_msg
        self.return_val = True if return_val is None else return_val


class WtfWarning(WtfError):
    """A warning found by a rule; it may be intended."""


def error_rule(rule: Rule, ret: Any, ctx: WtfContext) -> None:
    """Add an error to the context unless `ret`, the result of the rule's function, is false."""
    if ret:
        ctx.errors.append(WtfError(_text(rule, ret, ctx), rule[1], ret))


def warning_rule(rule: Rule, ret: Any, ctx: WtfContext) -> None:
    """Add a warning to the context unless `ret`, the result of the rule's function, is false."""
    if ret:
        ctx.warnings.append(WtfWarning(_text(rule, ret, ctx), rule[1], ret))


def _text(rule: Rule, ret: Any, ctx: WtfContext) -> str:
    text = rule[1] % ctx.as_dictionary()
    if isinstance(ret, str):
        return text + ret
    if isinstance(ret, (list, tuple)):
        return text + "\n" + "".join(f" * {item}\n" for item in ret)
    return text
