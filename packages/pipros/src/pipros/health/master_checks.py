"""Checks for `ROS_MASTER_URI` and the master. Perform no I/O."""

from __future__ import annotations

from pipros.basics.env import DEFAULT_MASTER_URI, Environment, InvalidEnvironment, split_master_uri
from pipros.health.finding import Finding, Findings, error
from pipros.health.machine import MachineReport
from pipros.net.address import is_loopback


def master_uri(machine: MachineReport) -> Findings:
    """Check that ROS_MASTER_URI is valid, its host is known, and a master answers there."""
    uri = machine.variables.get("ROS_MASTER_URI") or DEFAULT_MASTER_URI
    try:
        host, port = split_master_uri(uri)
    except InvalidEnvironment as problem:
        yield error(
            "master-uri", str(problem), f"export ROS_MASTER_URI={DEFAULT_MASTER_URI}", "ROS_MASTER_URI"
        )
        return
    if machine.resolved.get(host) == ():
        yield error(
            "master-host-unknown",
            f"The host [{host}] of ROS_MASTER_URI [{uri}] cannot be resolved to an address",
            f"Use the address of that machine, or add a line 'ADDRESS {host}' to /etc/hosts.",
            "ROS_MASTER_URI",
            host,
        )
    elif machine.master_error:
        yield _no_master(machine, uri, host, port)


def _no_master(machine: MachineReport, uri: str, host: str, port: int) -> Finding:
    summary = f"No master answers at ROS_MASTER_URI [{uri}]: {machine.master_error}"
    is_here = is_loopback(host) or host in machine.own_hosts
    if machine.other_master:
        cure = f"export ROS_MASTER_URI={machine.other_master}"
        if is_here and not is_loopback(host):
            cure += f", or, to let other machines connect, restart that master: roscore --bind {host}"
        elif machine.other_master == DEFAULT_MASTER_URI:
            cure = f"ROS_MASTER_URI is probably outdated: {cure}, and look for the old value in ~/.bashrc."
        else:
            cure += " in each terminal; another roscore would start a separate system."
        return error(
            "stale-master-uri",
            f"{summary}, but one answers at {machine.other_master}",
            cure,
            "ROS_MASTER_URI",
        )
    start = "roscore" if port == 11311 else f"roscore -p {port}"
    cure = (
        f"Start it: {start}"
        if is_here
        else f"Start roscore on [{host}] so that it can be reached from here (with --bind or ROS_IP, and "
        f"with this machine's network in --allow, if used), check the network (ping {host}), or correct "
        "ROS_MASTER_URI."
    )
    return error("no-master", summary, cure, "ROS_MASTER_URI")


def is_own_master(machine: MachineReport, environment: Environment) -> bool:
    """Return whether the master runs on this machine; True if its URI is invalid."""
    try:
        host, _ = split_master_uri(environment.master_uri)
    except InvalidEnvironment:
        return True
    return is_loopback(host) or host in machine.own_hosts
