"""Checks for Windows and for Linux inside Windows (WSL). They derive findings without I/O."""

from __future__ import annotations

from pipros.basics.env import DEFAULT_MASTER_URI, Environment, InvalidEnvironment, split_master_uri
from pipros.net.address import is_loopback
from pipros_tools.health.finding import Findings, error, warning
from pipros_tools.health.machine import MachineReport

_LONG = 140
"""Paths below a workspace or ROS_HOME have up to about 120 characters more."""


def refused_scripts(machine: MachineReport) -> Findings:
    """Check that PowerShell runs scripts, which activate environments and set up workspaces."""
    policy = machine.windows.refusing_policy
    if policy:
        yield warning(
            "execution-policy",
            f"PowerShell runs no scripts of yours (its execution policy is {policy}): Activate.ps1 and "
            "devel\\setup.ps1 fail",
            "Set-ExecutionPolicy -Scope CurrentUser RemoteSigned, or, if your organization sets the policy, "
            "use cmd and devel\\setup.bat.",
            "PSExecutionPolicyPreference",
        )


def programs_in_path(machine: MachineReport) -> Findings:
    """Check that Windows finds pipros's programs."""
    folder = machine.windows.scripts_off_path
    if folder:
        yield warning(
            "scripts-not-in-path",
            f"PATH does not list [{folder}], so that roscore and the other commands are not found",
            f"Activate the environment again (.venv\\Scripts\\activate), or add the folder: set "
            f"PATH={folder};%PATH% in cmd, $env:PATH = '{folder};' + $env:PATH in PowerShell.",
            "PATH",
        )


def long_paths(machine: MachineReport) -> Findings:
    """Find folders whose files would have longer paths than Windows allows."""
    folders = (machine.workspace, Environment.from_os(machine.variables).ros_home)
    long = next((str(each) for each in folders if each and len(str(each)) > _LONG), None)
    if long and not machine.windows.has_long_paths:
        yield warning(
            "long-paths",
            f"The path of [{long}] has {len(long)} characters, and Windows refuses paths of more than 259: "
            'builds, logs and bags below it fail with "No such file or directory"',
            "Use a folder near the top of a drive (set ROS_HOME=C:\\ros), or set LongPathsEnabled to 1 in "
            "the registry's key System\\CurrentControlSet\\Control\\FileSystem.",
            "ROS_HOME",
        )


def blocked_by_firewall(machine: MachineReport) -> Findings:
    """Find rules of Windows's firewall that keep other machines from nodes of this Python."""
    rules = machine.windows.blocking_rules
    if rules and not is_loopback(machine.bound_host):
        yield error(
            "firewall",
            f"Windows's firewall blocks connections to this Python, by its rules {', '.join(rules)}: other "
            "machines cannot reach nodes here",
            "Delete these rules (Windows Defender Firewall, Advanced settings, Inbound Rules) and start a "
            "node again; when Windows asks whether Python may be reached, allow it.",
            *rules,
        )


def wsl_network(machine: MachineReport) -> Findings:
    """Check that nodes in WSL can be reached by a master on another machine."""
    network = machine.windows.wsl_network
    try:
        host, _ = split_master_uri(machine.variables.get("ROS_MASTER_URI") or DEFAULT_MASTER_URI)
    except InvalidEnvironment:
        return
    is_advertised = bool(machine.variables.get("PIPROS_ADVERTISE"))
    if network == "nat" and not (is_advertised or is_loopback(host) or host in machine.own_hosts):
        yield warning(
            "wsl-nat",
            f"This is WSL behind address translation, and the master is on [{host}]: programs there cannot "
            "reach nodes here",
            "Write networkingMode=mirrored below [wsl2] into .wslconfig in your Windows user folder, and run "
            "wsl --shutdown; or forward fixed ports (PIPROS_PORTS and PIPROS_ADVERTISE).",
            "ROS_MASTER_URI",
        )
