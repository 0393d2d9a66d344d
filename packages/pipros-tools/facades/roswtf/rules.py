"""Functions that plugins call to add the results of rules to a context."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from pipros_tools.health.wtf import rules as _rules
from roswtf.context import WtfContext
from roswtf.model import WtfError, WtfWarning

__all__ = ["error_rule", "warning_rule"]

Rule = tuple[Callable[[WtfContext], Any], str]
"""A function and its text; `%(name)s` in the text is replaced by an attribute of the context."""


def error_rule(rule: Rule, ret: Any, ctx: WtfContext) -> None:
    """Add an error to the context unless `ret`, the result of the rule's function, is false."""
    if ret:
        ctx.errors.append(WtfError(_rules.text_of(rule[1], ret, vars(ctx)), rule[1], ret))


def warning_rule(rule: Rule, ret: Any, ctx: WtfContext) -> None:
    """Add a warning to the context unless `ret`, the result of the rule's function, is false."""
    if ret:
        ctx.warnings.append(WtfWarning(_rules.text_of(rule[1], ret, vars(ctx)), rule[1], ret))
