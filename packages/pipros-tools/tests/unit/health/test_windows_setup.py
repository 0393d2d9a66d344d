"""The setup of Windows is read from variables, the registry and WSL's files, which are simulated here."""

import os
from pathlib import Path

import pytest

from pipros_tools.health.windows_setup import blocking_rules, refusing_policy, scripts_off_path, wsl_network

SYSTEM = r"C:\Program Files\WindowsPowerShell\Modules;C:\Windows\system32\WindowsPowerShell\v1.0\Modules"
CMD = {"ProgramFiles": r"C:\Program Files", "SystemRoot": r"C:\Windows", "PSModulePath": SYSTEM}
POWERSHELL = {**CMD, "PSModulePath": rf"C:\Users\me\Documents\WindowsPowerShell\Modules;{SYSTEM}"}
POWERSHELL_7 = {**CMD, "PSModulePath": rf"C:\Users\me\Documents\PowerShell\Modules;{SYSTEM}"}
BLOCK = (
    r"v2.31|Action=Block|Active=TRUE|Dir=In|Protocol=6|Profile=Public|App=C:\Python\python.exe|Name=python|"
)


@pytest.mark.parametrize(("variables", "settings", "refusing"), [
    (POWERSHELL, {}, "Restricted"), (POWERSHELL, {"CURRENT_USER\\Software\\Microsoft": "RemoteSigned"}, ""),
    (
        POWERSHELL,
        {"CURRENT_USER\\Software\\Microsoft": "RemoteSigned", "MACHINE\\Software\\Policies": "AllSigned"},
        "AllSigned",
    ),
    (POWERSHELL, {"MACHINE\\Software\\Microsoft": "Undefined"}, "Restricted"),
    ({**POWERSHELL, "PSExecutionPolicyPreference": "Bypass"}, {}, ""), (CMD, {}, ""), (POWERSHELL_7, {}, ""),
    ({}, {}, ""),
])  # fmt: skip
def test_an_execution_policy_that_refuses_scripts(
    variables: dict[str, str], settings: dict[str, str], refusing: str
) -> None:
    def values_of(key: str) -> dict[str, str]:
        return next(({"ExecutionPolicy": policy} for part, policy in settings.items() if part in key), {})

    assert refusing_policy(variables, values_of) == refusing


@pytest.mark.parametrize(("path", "missing"), [
    (r"C:\Windows;C:\VENV\scripts\;C:\x", ""), (r'"C:\venv\Scripts"', ""), (r"C:\Users\me\Scripts", ""),
    (r"C:\Windows;C:\venv", r"C:\venv\Scripts"), ("", r"C:\venv\Scripts"),
])  # fmt: skip
def test_a_folder_of_programs_that_path_lacks(path: str, missing: str) -> None:
    folders = [r"C:\venv\Scripts", r"C:\Users\me\Scripts"]
    assert scripts_off_path(folders, {"Path": path}) == missing
    assert scripts_off_path([], {"Path": path}) == ""


@pytest.mark.parametrize(("rule", "names"), [
    (BLOCK, ("python",)), (BLOCK.replace("C:", "c:").replace("python.exe", "PYTHON.EXE"), ("python",)),
    (BLOCK.replace("Block", "Allow"), ()), (BLOCK.replace("TRUE", "FALSE"), ()),
    (BLOCK.replace("Dir=In", "Dir=Out"), ()), (BLOCK.replace("python.exe", "other.exe"), ()), ("", ()),
])  # fmt: skip
def test_rules_of_the_firewall_that_block_a_program(rule: str, names: tuple[str, ...]) -> None:
    assert blocking_rules({"{1}": rule, "{2}": rule}, r"C:\Python\python.exe") == names


@pytest.mark.needs("executable files")
@pytest.mark.parametrize(("kernel", "says", "network"), [
    ("5.15.153.1-microsoft-standard-WSL2\n", "echo mirrored", "mirrored"),
    ("5.15.153.1-microsoft-standard-WSL2\n", "exit 1", "nat"), ("6.1.0-18-amd64\n", "echo nat", ""),
])  # fmt: skip
def test_the_network_of_wsl(tmp_path: Path, monkeypatch, kernel: str, says: str, network: str) -> None:
    (tmp_path / "osrelease").write_text(kernel)
    (tmp_path / "wslinfo").write_text(f"#!/bin/sh\n{says}\n")
    (tmp_path / "wslinfo").chmod(0o755)
    monkeypatch.setenv("PATH", f"{tmp_path}{os.pathsep}{os.environ['PATH']}")
    assert wsl_network(str(tmp_path / "osrelease")) == network
    assert wsl_network(str(tmp_path / "absent")) == ""
