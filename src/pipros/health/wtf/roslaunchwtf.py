"""Rules about launch files and running launchers."""

from __future__ import annotations

from pathlib import Path

from pipros.basics.errors import PiprosError
from pipros.health.wtf.context import WtfContext
from pipros.health.wtf.rules import Rule, error_rule, warning_rule
from pipros.launch.model import Node
from pipros.net.rpc_client import RpcClient
from pipros.net.this_machine import addresses_of
from pipros.workspace.executables import find_executables

ANSWER_LIMIT_S = 3.0


def _nodes(ctx: WtfContext) -> list[Node]:
    if ctx.launch is None:
        return []
    return [*ctx.launch.nodes, *(test.node for test in ctx.launch.tests)]


def roslaunch_missing_pkgs_check(ctx: WtfContext) -> list[str]:
    wanted = sorted({node.package for node in _nodes(ctx)})
    return [name for name in wanted if ctx.index is not None and ctx.index.get(name) is None]


def roslaunch_missing_node_check(ctx: WtfContext) -> list[str]:
    return [
        f"node [{node.type}] in package [{node.package}]" for node, programs in _programs(ctx) if not programs
    ]


def roslaunch_duplicate_node_check(ctx: WtfContext) -> list[str]:
    return [
        f"node [{node.type}] in package [{node.package}]"
        for node, programs in _programs(ctx)
        if len(programs) > 1
    ]


def _programs(ctx: WtfContext) -> list[tuple[Node, list[Path]]]:
    found: list[tuple[Node, list[Path]]] = []
    for node in _nodes(ctx):
        package = ctx.index.get(node.package) if ctx.index is not None else None
        if package is not None and not node.machine:
            programs = find_executables(package, node.type)
            found.append((node, [programs.relay] if programs.relay else list(programs.runnable)))
    return found


def roslaunch_machine_name_check(ctx: WtfContext) -> list[str]:
    machines = ctx.launch.machines.values() if ctx.launch is not None else ()
    return sorted({machine.address for machine in machines if not addresses_of(machine.address)})


def roslaunch_config_errors(ctx: WtfContext) -> list[str]:
    return list(ctx.launch.warnings) if ctx.launch is not None else []


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


def roslaunch_respawn_check(ctx: WtfContext) -> list[str]:
    return [f"{name} ({count - 1})" for name, count in _processes(ctx)[0] if count > 1]


def roslaunch_dead_check(ctx: WtfContext) -> list[str]:
    return [name for name, _ in _processes(ctx)[1]]


def _processes(ctx: WtfContext) -> tuple[list[tuple[str, int]], list[tuple[str, int]]]:
    """Return name and start count of the processes of all running launchers: active ones, ended ones."""
    kinds: tuple[list[tuple[str, int]], list[tuple[str, int]]] = ([], [])
    for uri in ctx.roslaunch_uris or ():
        try:
            with RpcClient(uri, timeout_s=ANSWER_LIMIT_S) as client:
                _, _, lists = client.call("list_processes")
            for kind, processes in zip(kinds, lists, strict=False):
                kind.extend((str(name), int(count)) for name, count in processes)
        except (PiprosError, ValueError, TypeError):
            continue  # the launcher has exited without deleting its parameter
    return kinds


online_roslaunch_errors: list[Rule] = []

online_roslaunch_warnings: list[Rule] = [
    (roslaunch_respawn_check, "These nodes have respawned at least once:"),
    (roslaunch_dead_check, "These nodes have died:"),
]


def wtf_check_static(ctx: WtfContext) -> None:
    """Apply the rules about launch files, if there are files to check."""
    if not ctx.launch_files:
        return
    for rule in static_roslaunch_warnings:
        warning_rule(rule, rule[0](ctx), ctx)
    for rule in static_roslaunch_errors:
        error_rule(rule, rule[0](ctx), ctx)


def wtf_check_online(ctx: WtfContext) -> None:
    """Apply the rules about running launchers."""
    for rule in online_roslaunch_warnings:
        warning_rule(rule, rule[0](ctx), ctx)
