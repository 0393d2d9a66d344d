"""Checks for the setup of a machine and a shell. They derive findings from a `MachineReport` without I/O."""

from __future__ import annotations

import os
import shlex
from collections.abc import Callable
from pathlib import Path

from pipros.basics.env import DEFAULT_MASTER_URI, Environment, InvalidEnvironment, split_master_uri
from pipros.basics.graph_variables import master_uri_of
from pipros.basics.windows import ON_WINDOWS
from pipros.net.address import is_loopback
from pipros_tools.health.address_checks import master_calls_back, ports_and_advertised_address
from pipros_tools.health.finding import Finding, Findings, error, findings_of, warning
from pipros_tools.health.machine import MachineReport, PathKind
from pipros_tools.health.windows_checks import (
    blocked_by_firewall,
    long_paths,
    programs_in_path,
    refused_scripts,
    wsl_network,
)


def master_uri(machine: MachineReport) -> Findings:
    """Check that ROS_MASTER_URI is valid, its host is known, and a master answers there."""
    uri = master_uri_of(machine.variables)
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


_PATH_VARIABLES = ("ROS_ROOT", "ROS_PACKAGE_PATH", "CMAKE_PREFIX_PATH", "PYTHONPATH")


def check_machine(machine: MachineReport) -> list[Finding]:
    """Run all checks and return the findings, in the order of the checks."""
    return findings_of(CHECKS, machine)


def mixed_programs(machine: MachineReport) -> Findings:
    """Find ROS commands in PATH that belong to another implementation."""
    foreign = machine.foreign_programs
    if not foreign:
        return
    listing = ", ".join(f"{name} is {program}" for name, program in sorted(foreign.items())[:3])
    if len(foreign) > 3:
        listing += f" and {len(foreign) - 3} more"
    yield warning(
        "mixed-programs",
        f"PATH finds another ROS installation's programs before those in {machine.own_programs}: {listing}",
        f"Put pipros first: export PATH={shlex.quote(str(machine.own_programs))}:$PATH, or activate its "
        "environment again, or open a new terminal in which only one of the two is set up.",
        *sorted(foreign),
    )


def mixed_python(machine: MachineReport) -> Findings:
    """Check that `import rospy` and similar imports import pipros."""
    foreign = {
        name: place for name, place in machine.python_packages.items() if place not in machine.own_packages
    }
    if foreign:
        listing = ", ".join(f"{name} from {place}" for name, place in sorted(foreign.items()))
        yield error(
            "mixed-python",
            f"Python imports packages from another ROS instead of pipros's packages: {listing}",
            "Remove the folders of the other ROS from PYTHONPATH: unset PYTHONPATH, or start from a "
            "terminal in which /opt/ros/…/setup.bash was not sourced.",
            *sorted(foreign),
        )


def changed_packages(machine: MachineReport) -> Findings:
    """Find pipros modules that another distribution replaced, or that were edited or deleted."""
    changed = machine.changed_packages
    if not changed:
        return
    owners = sorted({owner for owner in changed.values() if owner})
    by = f"{' and '.join(owners)} replaced" if owners else "something changed or deleted"
    shown = ", ".join(list(changed)[:5]) + (f" and {len(changed) - 5} more" if len(changed) > 5 else "")
    yield error(
        "changed-packages",
        f"After pipros was installed, {by} files of its packages: {shown}",
        "Install pipros again, last, from the same place: "
        "python -m pip install --force-reinstall --no-deps PLACE",
        *changed,
    )


def other_ros_set_up(machine: MachineReport) -> Findings:
    """Find environment variables that belong to ROS 2 or genuine ROS 1."""
    if machine.variables.get("ROS_VERSION") == "2" or machine.variables.get("AMENT_PREFIX_PATH"):
        yield warning(
            "ros-2-environment",
            "ROS 2 is set up in this shell (ROS_VERSION or AMENT_PREFIX_PATH): its programs and packages "
            "interfere with those of ROS 1",
            "Use a terminal in which no ROS 2 setup file was sourced.",
            "ROS_VERSION",
        )
    for name in ("CMAKE_PREFIX_PATH", "PYTHONPATH", "ROS_ROOT", "ROS_PACKAGE_PATH"):
        entries = machine.variables.get(name, "").split(os.pathsep)
        genuine = [entry for entry in entries if entry.startswith("/opt/ros/")]
        if genuine:
            yield warning(
                "mixed-paths",
                f"{name} lists folders of another ROS installation: {os.pathsep.join(genuine)}",
                "Use a terminal in which only one of the two is set up, unless you want packages of that "
                "installation.",
                name,
            )


def ros2_packages(machine: MachineReport) -> Findings:
    """Find packages of ROS 2 in pipros's environment, which hide ROS 1's messages from scripts."""
    names = machine.ros2_packages
    if names:
        listing = ", ".join(names[:4]) + (f" and {len(names) - 4} more" if len(names) > 4 else "")
        yield warning(
            "ros-2-packages",
            f"This environment also contains ROS 2: scripts import ROS 2's classes from {listing}",
            "Install ROS 2 in an environment of its own; or import ROS 1's classes in scripts: from "
            "pipros.ros1.std_msgs.msg import String; or export PIPROS_MESSAGES=ros1.",
            *names,
        )


def missing_paths(machine: MachineReport) -> Findings:
    """Find entries in path variables that are not existing folders."""
    for name in _PATH_VARIABLES:
        for entry in filter(None, machine.variables.get(name, "").split(os.pathsep)):
            kind = machine.paths.get(entry, PathKind.FOLDER)
            is_archive = name == "PYTHONPATH" and kind is PathKind.FILE
            if kind in (PathKind.MISSING, PathKind.FILE) and not is_archive:
                what = "does not exist" if kind is PathKind.MISSING else "is a file, not a folder"
                yield warning(
                    "missing-path",
                    f"{name} lists [{entry}], which {what}",
                    "Source the setup file of the workspace again, in a new terminal; if the workspace was "
                    "moved or deleted, build it again first.",
                    name,
                    entry,
                )


def log_configuration(machine: MachineReport) -> Findings:
    """Check that the file with the levels of loggers exists."""
    file = machine.variables.get("ROSCONSOLE_CONFIG_FILE", "")
    if machine.paths.get(file) is PathKind.MISSING:
        yield warning(
            "missing-log-configuration",
            f"ROSCONSOLE_CONFIG_FILE [{file}] does not exist: all loggers have their default levels",
            "Correct the variable, or unset it.",
            "ROSCONSOLE_CONFIG_FILE",
            file,
        )


def missing_setup_files(machine: MachineReport) -> Findings:
    """Find shell startup files that source a missing ROS setup file.

    Many courses tell students to add a line that sources the setup file of genuine ROS.
    """
    for setup_file, start_file in machine.missing_setup_files.items():
        yield warning(
            "missing-setup-file",
            f"{start_file} sources {setup_file}, which does not exist",
            (
                f'Replace that line by: eval "$({shlex.quote(str(machine.own_programs / "pipros"))} env)"'
                if setup_file.startswith("/opt/ros/")
                else "Correct the path, in quotes if it has spaces, and run catkin_make in a new workspace"
            )
            + ", and open a new terminal.",
            start_file,
        )


def workspace_not_set_up(machine: MachineReport) -> Findings:
    """Check that the workspace that contains the working directory is part of the environment."""
    if machine.workspace is None:
        return
    known = machine.variables.get("CMAKE_PREFIX_PATH", "").split(os.pathsep)
    if machine.workspace not in map(Path, known):
        yield warning(
            "workspace-not-set-up",
            f"The workspace of the current directory is not set up in this shell: {machine.workspace}",
            (
                f'call "{machine.workspace / "setup.bat"}"'
                if ON_WINDOWS
                else f"source {shlex.quote(str(machine.workspace / 'setup.bash'))}"
            ),
            str(machine.workspace),
        )


def own_address(machine: MachineReport) -> Findings:
    """Check the address that this machine advertises: ROS_HOSTNAME, ROS_IP or its name."""
    environment = Environment.from_os(machine.variables)
    hostname, ip = environment.hostname, environment.ip
    is_master_here = is_own_master(machine, environment)
    if hostname:
        yield from _own_name(machine, "ROS_HOSTNAME", hostname)
        if ip and ip not in machine.resolved.get(hostname, (ip,)):
            yield warning(
                "hostname-and-ip",
                f"ROS_HOSTNAME [{hostname}] and ROS_IP [{ip}] are both set and differ; ROS_HOSTNAME is used",
                "Unset one of them.",
                "ROS_HOSTNAME",
                "ROS_IP",
            )
    elif ip:
        yield from _own_ip(machine, ip, is_master_here=is_master_here)
    elif not is_master_here:
        yield from _own_name(machine, "This machine's name", machine.hostname)
    advertised = hostname or ip
    if advertised and is_loopback(advertised) and not is_master_here:
        yield error(
            "loopback-advertised",
            "The master is on another machine, but programs on this machine advertise "
            f"[{advertised}], a loopback address: no program there can reach them",
            f"export ROS_IP={machine.address_towards_master or 'ADDRESS'}, the address by which the others "
            "reach this machine, and unset ROS_HOSTNAME.",
            "ROS_HOSTNAME" if hostname else "ROS_IP",
        )


def _own_name(machine: MachineReport, what: str, name: str) -> Findings:
    found = machine.resolved.get(name, (name,))
    cure = f"export ROS_IP={machine.address_towards_master or 'ADDRESS'}, and unset ROS_HOSTNAME."
    if "://" in name:
        yield error("hostname-form", f"{what} must be a host name, got [{name}]", cure, what)
    elif not found:
        yield error(
            "hostname-unknown",
            f"{what} [{name}] cannot be resolved to an address: other programs cannot reach this machine "
            "by that name",
            f"{cure} Or add a line 'ADDRESS {name}' to /etc/hosts on every machine.",
            what,
            name,
        )
    elif name not in machine.own_hosts:
        yield error(
            "hostname-of-another",
            f"{what} [{name}] resolves to {', '.join(found)}, which is not this machine",
            cure,
            what,
            name,
        )


def _own_ip(machine: MachineReport, ip: str, *, is_master_here: bool) -> Findings:
    good = machine.address_towards_master
    if ip not in machine.own_hosts:
        known = [*machine.addresses, *([good] if good and good not in machine.addresses else [])]
        yield error(
            "ip-of-another",
            f"ROS_IP [{ip}] is not an address of this machine, which has {', '.join(known)}",
            f"export ROS_IP={good or 'ADDRESS'}, or unset it.",
            "ROS_IP",
        )
    elif good and not is_loopback(good) and not is_master_here and not is_loopback(ip) and ip != good:
        yield warning(
            "ip-of-another-network",
            f"ROS_IP [{ip}] is an address of this machine, but this machine reaches the master from "
            f"[{good}], so other machines may have no route to ROS_IP",
            f"export ROS_IP={good}",
            "ROS_IP",
        )


def folders_to_write(machine: MachineReport) -> Findings:
    """Check that the folders for caches, logs and test results are writable."""
    environment = Environment.from_os(machine.variables)
    folders = {
        "ROS_HOME": environment.ros_home,
        "ROS_LOG_DIR": environment.log_dir,
        "ROS_TEST_RESULTS_DIR": environment.test_results_dir,
    }
    for name, folder in folders.items():
        kind = machine.paths.get(str(folder), PathKind.FOLDER)
        if kind in (PathKind.READ_ONLY, PathKind.FULL, PathKind.FILE):
            way = "Free some space" if kind is PathKind.FULL else "Make the folder writable (chown, chmod)"
            yield error(
                "cannot-write",
                f"{name} [{folder}] is a {kind.value}: no logs or results can be written there",
                f"{way}, or set {name} to a writable one.",
                name,
                str(folder),
            )


CHECKS: tuple[Callable[[MachineReport], Findings], ...] = (
    mixed_programs,
    mixed_python,
    changed_packages,
    other_ros_set_up,
    ros2_packages,
    missing_paths,
    log_configuration,
    missing_setup_files,
    workspace_not_set_up,
    master_uri,
    own_address,
    ports_and_advertised_address,
    master_calls_back,
    folders_to_write,
    refused_scripts,
    programs_in_path,
    long_paths,
    blocked_by_firewall,
    wsl_network,
)
