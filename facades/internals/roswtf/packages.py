"""Rules about packages. Facade of `pipros.health.wtf.packages`."""

from pipros.basics.lazy_names import star_names as _star_names
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

_star_names(
    __name__,
    "roswtf.rules:error_rule roslib.packages:get_pkg_dir roslib.packages:InvalidROSPkgException "
    "roswtf.environment:is_executable os roswtf.environment:paths roslib time roswtf.rules:warning_rule",
)
