"""Functions that plugins call to add the results of rules to a context."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from pipros.basics.lazy_names import star_names as _star_names
from pipros.health.wtf import rules as _rules
from roswtf.context import WtfContext
from roswtf.model import WtfError, WtfWarning

__all__ = ["error_rule", "warning_rule"]

_star_names(__name__, "roswtf.model:WtfError roswtf.model:WtfWarning")

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


def apply(ctx: WtfContext, warnings: Sequence[Rule], errors: Sequence[Rule]) -> None:
    """Apply rules to the context. (Not in Noetic.)"""
    for rule in warnings:
        warning_rule(rule, rule[0](ctx), ctx)
    for rule in errors:
        error_rule(rule, rule[0](ctx), ctx)


def of_context(function: Callable[[Any], Any]) -> Callable[[WtfContext], Any]:
    """Convert the function of a pipros rule to a function that takes a context. (Not in Noetic.)"""

    def check(ctx: WtfContext) -> Any:
        return function(ctx.subject())

    check.__name__ = function.__name__
    check.__doc__ = function.__doc__
    return check


def of_contexts(rules: Sequence[_rules.Rule]) -> list[Rule]:
    """Convert pipros rules to rules whose functions take a context. (Not in Noetic.)"""
    return [(of_context(function), text) for function, text in rules]
