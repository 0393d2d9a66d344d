"""The setup of Windows, and of Linux inside Windows (WSL), as far as it prevents programs from working."""

from __future__ import annotations

import shutil
import subprocess
import sys
import sysconfig
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path, PureWindowsPath

from pipros.basics.input_file import read_text
from pipros.basics.windows import ON_WINDOWS, registry_values

_POLICIES = (
    r"HKEY_LOCAL_MACHINE\Software\Policies\Microsoft\Windows\PowerShell",
    r"HKEY_CURRENT_USER\Software\Policies\Microsoft\Windows\PowerShell",
    r"HKEY_CURRENT_USER\Software\Microsoft\PowerShell\1\ShellIds\Microsoft.PowerShell",
    r"HKEY_LOCAL_MACHINE\Software\Microsoft\PowerShell\1\ShellIds\Microsoft.PowerShell",
)
"""Keys with the execution policy; the first one that has it decides."""
_RULES = (
    r"HKEY_LOCAL_MACHINE\System\CurrentControlSet\Services\SharedAccess"
    r"\Parameters\FirewallPolicy\FirewallRules"
)
_FILE_SYSTEM = r"HKEY_LOCAL_MACHINE\System\CurrentControlSet\Control\FileSystem"
_KERNEL = "/proc/sys/kernel/osrelease"


@dataclass(frozen=True, slots=True)
class WindowsReport:
    """Input for the checks of Windows.

    Attributes:
        refusing_policy: the execution policy with which this PowerShell refuses scripts of the user; empty
            if it runs them, or if this is another shell.
        scripts_off_path: the folder of pipros's programs, if PATH lacks it; otherwise empty.
        blocking_rules: names of the firewall's rules that block connections to this Python.
        has_long_paths: whether paths may have more than 259 characters.
        wsl_network: how WSL is connected, such as `nat` or `mirrored`; empty outside WSL.
    """

    refusing_policy: str = ""
    scripts_off_path: str = ""
    blocking_rules: tuple[str, ...] = ()
    has_long_paths: bool = True
    wsl_network: str = ""


def gather_windows(variables: Mapping[str, str]) -> WindowsReport:
    """Return the setup of this machine. `variables` is the environment. Does not block for more than 2 s."""
    if not ON_WINDOWS:
        return WindowsReport(wsl_network=wsl_network())
    scripts = [sysconfig.get_path("scripts"), sysconfig.get_path("scripts", "nt_user")]
    return WindowsReport(
        refusing_policy=refusing_policy(variables, registry_values),
        scripts_off_path=scripts_off_path(
            [folder for folder in scripts if Path(folder, "roscore.exe").exists()], variables
        ),
        blocking_rules=blocking_rules(
            registry_values(_RULES), getattr(sys, "_base_executable", sys.executable)
        ),
        has_long_paths=registry_values(_FILE_SYSTEM).get("LongPathsEnabled") == "1",
    )


def refusing_policy(variables: Mapping[str, str], values_of: Callable[[str], Mapping[str, str]]) -> str:
    """Return the execution policy if this is Windows PowerShell and refuses unsigned scripts, else `""`.

    Without a setting, Windows refuses all scripts. `values_of` returns the values of a registry key.
    """
    if not _is_windows_powershell(variables):
        return ""
    settings = [values_of(key).get("ExecutionPolicy", "") for key in _POLICIES]
    settings.insert(2, variables.get("PSExecutionPolicyPreference", ""))
    policy = next((each for each in settings if each and each != "Undefined"), "Restricted")
    return policy if policy in ("Restricted", "AllSigned") else ""


def _is_windows_powershell(variables: Mapping[str, str]) -> bool:
    """PowerShell adds a folder of the user to the search path for its modules; version 7 adds another one."""
    known = {name.upper(): value for name, value in variables.items()}
    of_system = tuple(known[name] for name in ("PROGRAMFILES", "SYSTEMROOT") if name in known)
    return any(
        entry.endswith(r"\WindowsPowerShell\Modules") and not entry.startswith(of_system)
        for entry in known.get("PSMODULEPATH", "").split(";")
    )


def scripts_off_path(folders: list[str], variables: Mapping[str, str]) -> str:
    """Return the first of the folders with programs if PATH has none of them, else an empty string."""
    path = next((value for name, value in variables.items() if name.upper() == "PATH"), "")
    entries = {PureWindowsPath(entry.strip('"')) for entry in path.split(";") if entry}
    return "" if any(PureWindowsPath(folder) in entries for folder in folders) else next(iter(folders), "")


def blocking_rules(rules: Mapping[str, str], program: str) -> tuple[str, ...]:
    """Return the names of active rules that block incoming connections to a program.

    Windows makes such rules when its question about a program is answered with Cancel. A rule in the registry
    is a text such as `v2.31|Action=Block|Active=TRUE|Dir=In|Profile=Public|App=C:\\x.exe|Name=x|`.
    """
    found: dict[str, None] = {}
    for text in rules.values():
        rule = dict(word.partition("=")[::2] for word in text.split("|"))
        does_block = (rule.get("Action"), rule.get("Active"), rule.get("Dir")) == ("Block", "TRUE", "In")
        if does_block and PureWindowsPath(rule.get("App", "")) == PureWindowsPath(program):
            found[rule.get("Name", program)] = None
    return tuple(found)


def wsl_network(kernel: str = _KERNEL) -> str:
    """Return how WSL is connected; `nat` if it does not say so, and an empty string outside WSL."""
    try:
        if "microsoft" not in read_text(kernel).lower():
            return ""
    except (OSError, ValueError):
        return ""
    program = shutil.which("wslinfo")
    if program is None:
        return "nat"
    try:
        done = subprocess.run(  # noqa: S603 - a program of WSL
            [program, "--networking-mode"], capture_output=True, text=True, timeout=2, check=True
        )
    except (OSError, subprocess.SubprocessError):
        return "nat"
    return done.stdout.strip() or "nat"
