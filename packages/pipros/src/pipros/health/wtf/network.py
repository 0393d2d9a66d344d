"""Rules about this machine's host name and addresses."""

from __future__ import annotations

import socket

from pipros.health.gather_machine import own_addresses
from pipros.health.wtf.rules import Problem, Rule, problems_of
from pipros.health.wtf.subject import Subject
from pipros.net.this_machine import addresses_of, is_this_machine


def ip_check(subject: Subject) -> str | None:
    """Check that the host name resolves to this machine, unless ROS_IP or ROS_HOSTNAME is set."""
    if subject.variables.get("ROS_HOSTNAME") or subject.variables.get("ROS_IP"):
        return None
    name = socket.gethostname()
    found = addresses_of(name)
    if found and not is_this_machine(name):
        return (
            f"Local hostname [{name}] resolves to [{found[0]}], which does not appear to be a local IP "
            f"address {list(own_addresses(name))}."
        )
    return None


def ros_hostname_check(subject: Subject) -> str | None:
    name = subject.variables.get("ROS_HOSTNAME")
    if not name:
        return None
    found = addresses_of(name)
    if not found:
        return f"ROS_HOSTNAME [{name}] cannot be resolved to an IP address"
    if is_this_machine(name):
        return None
    return (
        f"ROS_HOSTNAME [{name}] resolves to [{found[0]}], which does not appear to be a local IP address "
        f"{list(own_addresses(socket.gethostname()))}."
    )


def ros_ip_check(subject: Subject) -> str | None:
    ip = subject.variables.get("ROS_IP")
    if not ip or is_this_machine(ip):
        return None
    return (
        f"ROS_IP [{ip}] does not appear to be an IP address of a local network interface "
        f"(one of {list(own_addresses(socket.gethostname()))})."
    )


errors: list[Rule] = [(ip_check, "Local network configuration is invalid: ")]

warnings: list[Rule] = [
    (ros_hostname_check, "ROS_HOSTNAME may be incorrect: "),
    (ros_ip_check, "ROS_IP may be incorrect: "),
]


def check_network(subject: Subject) -> list[Problem]:
    """Apply all rules in this module."""
    return problems_of(subject, warnings, errors)
