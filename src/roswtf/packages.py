"""Rules about packages. Facade of `pipros.health.wtf.packages`."""

from pipros.health.wtf.packages import (
    errors,
    manifest_valid,
    warnings,
    wtf_check,
)

__all__ = [
    "errors",
    "manifest_valid",
    "warnings",
    "wtf_check",
]
