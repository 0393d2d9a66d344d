"""Rules about the names and addresses of this machine. Facade of `pipros.health.wtf.network`."""

from pipros.basics.lazy_names import star_names as _star_names
from pipros.health.wtf.network import (
    errors,
    ip_check,
    ros_hostname_check,
    ros_ip_check,
    warnings,
    wtf_check,
)

__all__ = [
    "errors",
    "ip_check",
    "ros_hostname_check",
    "ros_ip_check",
    "warnings",
    "wtf_check",
]

_star_names(__name__, "roswtf.rules:error_rule os rosgraph socket stat string sys roswtf.rules:warning_rule")
