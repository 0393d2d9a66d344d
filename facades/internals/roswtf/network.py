"""Rules about the names and addresses of this machine. Facade of `pipros.health.wtf.network`."""

from __future__ import annotations

from pipros.basics.lazy_names import star_names as _star_names
from pipros.health.wtf import network as _rules
from roswtf.context import WtfContext
from roswtf.rules import apply, of_context, of_contexts

__all__ = [
    "errors",
    "ip_check",
    "ros_hostname_check",
    "ros_ip_check",
    "warnings",
    "wtf_check",
]

_star_names(__name__, "roswtf.rules:error_rule os rosgraph socket stat string sys roswtf.rules:warning_rule")

ip_check = of_context(_rules.ip_check)
ros_hostname_check = of_context(_rules.ros_hostname_check)
ros_ip_check = of_context(_rules.ros_ip_check)

errors = of_contexts(_rules.errors)
warnings = of_contexts(_rules.warnings)


def wtf_check(ctx: WtfContext) -> None:
    """Apply all rules in this module."""
    apply(ctx, warnings, errors)
