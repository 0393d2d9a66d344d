"""Rules about packages. Facade of `pipros.health.wtf.packages`."""

from __future__ import annotations

from pipros.basics.lazy_names import star_names as _star_names
from pipros.health.wtf import packages as _rules
from roswtf.context import WtfContext
from roswtf.rules import apply, of_context, of_contexts

__all__ = [
    "errors",
    "manifest_valid",
    "warnings",
    "wtf_check",
]

_star_names(
    __name__,
    "roswtf.rules:error_rule roslib.packages:get_pkg_dir roslib.packages:InvalidROSPkgException "
    "roswtf.environment:is_executable os roswtf.environment:paths roslib time roswtf.rules:warning_rule",
)

manifest_valid = of_context(_rules.manifest_valid)

errors = of_contexts(_rules.errors)
warnings = of_contexts(_rules.warnings)


def wtf_check(ctx: WtfContext) -> None:
    """Apply all rules in this module."""
    apply(ctx, warnings, errors)
