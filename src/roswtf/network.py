"""Rules about the names and addresses of this machine. Facade of `pipros.health.wtf.network`."""

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
