"""Rules about package manifests."""

from __future__ import annotations

from pipros.basics.errors import PiprosError
from pipros.health.wtf.context import WtfContext
from pipros.health.wtf.rules import Rule, error_rule
from pipros.workspace.manifest import read_manifest


def manifest_valid(ctx: WtfContext) -> list[str]:
    """Return the packages whose manifest cannot be read."""
    broken = []
    for name in ctx.pkgs:
        package = ctx.index.get(name) if ctx.index is not None else None
        if package is None:
            continue
        try:
            read_manifest(package.path)
        except (PiprosError, OSError) as error:
            broken.append(f"{name}: {error}")
    return broken


errors: list[Rule] = [(manifest_valid, "The manifests of the following packages cannot be read:")]
warnings: list[Rule] = []


def wtf_check(ctx: WtfContext) -> None:
    """Apply all rules of this module."""
    for rule in errors:
        error_rule(rule, rule[0](ctx), ctx)
