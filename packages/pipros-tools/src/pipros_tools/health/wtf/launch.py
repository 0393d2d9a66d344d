"""Rules about the things that only `roswtf` checks: manifests, launch files and running launchers."""

from __future__ import annotations

from pathlib import Path

from pipros.basics.errors import NotFound, PiprosError
from pipros.net.this_machine import addresses_of
from pipros_tools.health.wtf.rules import Problem, Rule, problems_of
from pipros_tools.health.wtf.subject import Subject
from pipros_tools.launch.model import LaunchNode
from pipros_tools.launch.processes_of import processes_of
from pipros_workspace.executables import find_executables, package_of_programs
from pipros_workspace.index import Package
from pipros_workspace.manifest import read_manifest


def _nodes(subject: Subject) -> list[LaunchNode]:
    if subject.launch is None:
        return []
    return [*subject.launch.nodes, *(test.node for test in subject.launch.tests)]


def roslaunch_missing_pkgs_check(subject: Subject) -> list[str]:
    wanted = sorted({node.package for node in _nodes(subject)})
    return [name for name in wanted if _package(subject, name) is None]


def roslaunch_missing_node_check(subject: Subject) -> list[str]:
    return [
        f"node [{node.type}] in package [{node.package}]"
        for node, programs in _programs(subject)
        if not programs
    ]


def roslaunch_duplicate_node_check(subject: Subject) -> list[str]:
    return [
        f"node [{node.type}] in package [{node.package}]"
        for node, programs in _programs(subject)
        if len(programs) > 1
    ]


def _programs(subject: Subject) -> list[tuple[LaunchNode, list[Path]]]:
    found: list[tuple[LaunchNode, list[Path]]] = []
    for node in _nodes(subject):
        package = _package(subject, node.package)
        if package is not None and not node.machine:
            programs = find_executables(package, node.type)
            found.append((node, [programs.relay] if programs.relay else list(programs.runnable)))
    return found


def _package(subject: Subject, name: str) -> Package | None:
    try:
        return package_of_programs(subject.index, name)
    except NotFound:
        return None


def roslaunch_machine_name_check(subject: Subject) -> list[str]:
    machines = subject.launch.machines.values() if subject.launch is not None else ()
    return sorted({machine.address for machine in machines if not addresses_of(machine.address)})


def roslaunch_config_errors(subject: Subject) -> list[str]:
    return list(subject.launch.warnings) if subject.launch is not None else []


def manifest_valid(subject: Subject) -> list[str]:
    """Return the name of each package whose manifest cannot be read, with the error."""
    broken = []
    for name in subject.packages:
        package = subject.index.get(name)
        if package is None:
            continue
        try:
            read_manifest(package.path)
        except (PiprosError, OSError) as error:
            broken.append(f"{name}: {error}")
    return broken


static_roslaunch_errors: list[Rule] = [
    (roslaunch_missing_pkgs_check, "Cannot find the following required packages:"),
    (
        roslaunch_missing_node_check,
        "Several nodes in your launch file could not be located. These are either typed incorrectly or "
        "need to be built:",
    ),
    (roslaunch_machine_name_check, "Cannot resolve the following hostnames:"),
]

static_roslaunch_warnings: list[Rule] = [
    (roslaunch_duplicate_node_check, "Multiple nodes of same name in packages:"),
    (
        roslaunch_config_errors,
        "Loading your launch files reported the following configuration errors:",
    ),
]


def roslaunch_respawn_check(subject: Subject) -> list[str]:
    found = processes_of(subject.launcher_uris)
    return [f"{each.name} ({each.starts - 1})" for each in found if each.is_alive and each.starts > 1]


def roslaunch_dead_check(subject: Subject) -> list[str]:
    return [each.name for each in processes_of(subject.launcher_uris) if not each.is_alive]


online_roslaunch_warnings: list[Rule] = [
    (roslaunch_respawn_check, "These nodes have respawned at least once:"),
    (roslaunch_dead_check, "These nodes have died:"),
]


def check_packages(subject: Subject) -> list[Problem]:
    """Apply the rule about manifests."""
    text = "The manifests of the following packages cannot be read:"
    return problems_of(subject, [], [(manifest_valid, text)])


def check_launch_files(subject: Subject) -> list[Problem]:
    """Apply the rules about launch files, if there are files to check."""
    if not subject.launch_files:
        return []
    return problems_of(subject, static_roslaunch_warnings, static_roslaunch_errors)


def check_launchers(subject: Subject) -> list[Problem]:
    """Apply the rules about running launchers."""
    return problems_of(subject, online_roslaunch_warnings, [])
