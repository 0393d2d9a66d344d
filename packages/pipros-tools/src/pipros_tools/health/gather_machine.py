"""Gather the setup of this machine and this shell into a `MachineReport`."""

from __future__ import annotations

import base64
import csv
import hashlib
import importlib.util
import os
import re
import shlex
import shutil
import socket
import sys
from collections.abc import Mapping
from contextlib import suppress
from importlib.metadata import Distribution, PackageNotFoundError, distribution, distributions
from pathlib import Path

from pipros.basics.env import DEFAULT_MASTER_URI, Environment, InvalidEnvironment, split_master_uri
from pipros.basics.errors import PiprosError
from pipros.basics.input_file import open_file
from pipros.msg.importing.modules import ros1_has_public_names
from pipros.net.address import LOOPBACK, address_towards, bind_host, is_loopback
from pipros.net.in_parallel import in_parallel
from pipros.net.master_client import MasterClient
from pipros.net.rpc_client import reason_of
from pipros.net.sockets import NoFreePort, listen
from pipros.net.this_machine import addresses_of, has_address, is_this_machine, listening_addresses
from pipros.packages import shipped_folder
from pipros.packages.installed_packages import AMENT_INDEX, share_folders
from pipros_tools.health.machine import MachineReport, PathKind
from pipros_tools.health.windows_setup import gather_windows
from pipros_workspace.overlays import MARKER

COMMANDS = ("roscore", "roslaunch", "rosrun", "rosnode", "rostopic", "rosparam", "rosservice", "rosmsg")
PACKAGES = ("rospy", "roslib", "rosgraph", "roslaunch", "genpy")

CALLER_ID = "/pipros_doctor"

_SCRIPT_BYTES = 1 << 20  # on Windows, a small launcher program precedes the script

_START_FILES = (".bashrc", ".zshrc", ".profile", ".bash_profile")
_SOURCED = re.compile(
    r"(?m)^[ \t]*(?:source|\.)[ \t]+(?=\S)([^\n;&|#`(]*setup\.(?:bash|sh|zsh)[\"']?)[ \t]*(?:[;&|#]|$)"
)


def gather_machine(variables: Mapping[str, str] | None = None, *, timeout_s: float = 3.0) -> MachineReport:
    """Return the setup that programs started from this shell would use.

    `variables` is the environment; defaults to `os.environ`. Blocks while host names are resolved, and up to
    `timeout_s` for each address at which a master is sought.
    """
    values = dict(os.environ if variables is None else variables)
    environment = Environment.from_os(values)
    hostname = socket.gethostname()
    try:
        master_host, _ = split_master_uri(environment.master_uri)
    except InvalidEnvironment:
        master_host = ""
    advertised_host = _advertised_host(environment)
    hosts = {host for host in (hostname, master_host, environment.hostname, advertised_host) if host}
    resolved = in_parallel(sorted(hosts), addresses_of, at_once=max(len(hosts), 1))
    questioned = {*hosts, *filter(None, [environment.ip])}
    own_programs = Path(sys.executable).parent
    python_packages = _python_packages(values)
    master_error = _error_of_master(environment.master_uri, timeout_s) if master_host else None
    return MachineReport(
        variables=values,
        hostname=hostname,
        addresses=own_addresses(hostname),
        resolved=resolved,
        own_hosts=frozenset(host for host in questioned if is_this_machine(host)),
        address_towards_master=address_towards(environment.master_uri) if resolved.get(master_host) else "",
        paths=_kinds(environment, values),
        foreign_programs=_foreign_programs(values),
        own_programs=own_programs,
        python_packages=python_packages,
        own_packages=frozenset(place for name, place in python_packages.items() if _is_ours(place / name)),
        changed_packages=changed_packages(),
        master_error=master_error,
        other_master=_other_master(environment, timeout_s) if master_error else "",
        missing_setup_files=_missing_setup_files(values),
        bound_host=bind_host(environment),
        port_problem=_port_problem(environment),
        ros2_packages=() if ros1_has_public_names() else _ros2_packages(),
        workspace=_workspace_around(Path.cwd()),
        windows=gather_windows(values),
    )


def _advertised_host(environment: Environment) -> str:
    try:
        advertised = environment.advertised_address()
    except InvalidEnvironment:
        return ""
    return "" if advertised is None else advertised.host


def _port_problem(environment: Environment) -> str:
    """Return the reason why a new node would not get a port in `PIPROS_PORTS`, or an empty string."""
    try:
        ports = environment.port_range
        if ports is not None:
            listen(bind_host(environment), ports).close()
    except InvalidEnvironment:
        pass
    except NoFreePort as problem:
        return str(problem)
    except OSError as problem:
        return reason_of(problem)
    return ""


def own_addresses(hostname: str) -> tuple[str, ...]:
    """Return this machine's addresses that can be found without listing its interfaces, loopback first."""
    found = [address for address in addresses_of(hostname) if is_this_machine(address)]
    return tuple(dict.fromkeys([LOOPBACK, *found, address_towards("http://192.0.2.1:9/")]))


def _error_of_master(uri: str, timeout_s: float) -> str:
    """Return why no master responds at a URI, or an empty string if a master responds."""
    client = MasterClient(uri, CALLER_ID, timeout_s=timeout_s)
    try:
        client.get_pid()
    except PiprosError as problem:
        return getattr(problem, "reason", "") or str(problem)
    finally:
        client.close()
    return ""


def _other_master(environment: Environment, timeout_s: float) -> str:
    """Return the URI of a master on this machine other than `ROS_MASTER_URI`, or an empty string."""
    host, port = split_master_uri(environment.master_uri)
    uris = []
    if is_loopback(host):  # a roscore with --bind ADDRESS does not listen on loopback
        hosts = [environment.ip or "", *own_addresses(socket.gethostname()), *listening_addresses(port)]
        uris = [f"http://{each}:{port}" for each in dict.fromkeys(hosts) if has_address(each)]
    others = [uri for uri in (*uris, DEFAULT_MASTER_URI) if uri != environment.master_uri.rstrip("/")]
    return next((uri for uri in others if not _error_of_master(uri, timeout_s)), "")


def _kinds(environment: Environment, variables: Mapping[str, str]) -> dict[str, PathKind]:
    entries = [
        entry
        for name in (
            "ROS_ROOT",
            "ROS_PACKAGE_PATH",
            "CMAKE_PREFIX_PATH",
            "PYTHONPATH",
            "ROSCONSOLE_CONFIG_FILE",
        )
        for entry in variables.get(name, "").split(os.pathsep)
        if entry
    ]
    written = [environment.ros_home, environment.log_dir, environment.test_results_dir]
    kinds = {entry: _kind(Path(entry), is_written=False) for entry in entries}
    return kinds | {str(folder): _kind(folder, is_written=True) for folder in written}


def _kind(path: Path, *, is_written: bool) -> PathKind:
    if os.path.isfile(path):
        return PathKind.FILE
    if not os.path.isdir(path):
        return PathKind.MISSING
    if is_written and not os.access(path, os.W_OK | os.X_OK):
        return PathKind.READ_ONLY
    if is_written:
        disk = shutil.disk_usage(path)
        if disk.total > disk.free == 0:  # some network drives have no total
            return PathKind.FULL
    return PathKind.FOLDER


def _foreign_programs(variables: Mapping[str, str]) -> dict[str, Path]:
    """Map ROS commands to their programs in PATH, omitting pipros's own programs."""
    path = variables.get("PATH", os.defpath)
    found = {name: shutil.which(name, path=path) for name in COMMANDS}
    return {name: Path(program) for name, program in found.items() if program and not _is_own(program)}


def _is_own(program: str) -> bool:
    """Return whether a program contains the word pipros, as the scripts that pip installs for pipros do."""
    try:
        with open_file(program) as file:
            return b"pipros" in file.read(_SCRIPT_BYTES)
    except OSError:
        return False


def _python_packages(variables: Mapping[str, str]) -> dict[str, Path]:
    """Map ROS import packages to the folders from which Python imports them.

    Folders in PYTHONPATH take precedence.
    """
    places: dict[str, Path] = {}
    for name in PACKAGES:
        for entry in filter(None, variables.get("PYTHONPATH", "").split(os.pathsep)):
            if Path(entry, name, "__init__.py").is_file() and not _is_ours(Path(entry, name)):
                places[name] = Path(entry)
                break
        else:
            spec = importlib.util.find_spec(name)
            if spec is not None and spec.origin is not None:
                places[name] = Path(spec.origin).parent.parent
    return places


def _ros2_packages() -> tuple[str, ...]:
    """Return the installed packages of ROS 2 that have the name of a package of pipros."""
    shares = map(Path, share_folders())
    installed = {file.name for share in shares for file in (share / AMENT_INDEX).glob("*")}
    return tuple(sorted(name for name in installed if shipped_folder(name)))


def _is_ours(package: Path) -> bool:
    """Return whether an import package belongs to pipros. Only pipros's packages have type information."""
    return (package / "py.typed").is_file()


def _workspace_around(folder: Path) -> Path | None:
    for above in (folder, *folder.parents):
        if (above / "devel" / MARKER).is_file() and (above / "src").is_dir():
            return above / "devel"
    return None


def _missing_setup_files(variables: Mapping[str, str]) -> dict[str, str]:
    """Map each missing setup file that a shell startup file sources to that startup file."""
    found = {}
    home = variables.get("HOME") or os.path.expanduser("~")
    for name in _START_FILES:
        try:
            with open_file(Path(home) / name) as file:
                text = file.read(_SCRIPT_BYTES).decode(errors="replace")
        except OSError:
            continue
        for match in _SOURCED.finditer(text):
            with suppress(ValueError):  # a quote is not closed
                script, *rest = shlex.split(match[1])
                path = re.sub(r"\$HOME\b|\$\{HOME\}", lambda _: home, script)
                path = home + path[1:] if match[1].startswith("~/") else path
                if "$" not in path and not Path(path).exists():
                    found[" ".join([path, *rest])] = f"~/{name}"
    return found


NAME = "pipros"


def changed_packages(name: str = NAME) -> dict[str, str]:
    """Map changed import packages to the distribution that replaced their files.

    The value of `rospy` may be `py3rosmsgs`; it is empty if the distribution is unknown. Modules are compared
    with the checksums that pip recorded. In a checkout, for which pip records no modules, the result is
    empty. Blocks while reading the modules and, if a module has changed, the records of all distributions.
    """
    try:
        installed = distribution(name)
    except PackageNotFoundError:
        return {}
    sums = _recorded_sums(installed)
    changed = {module for module, recorded in sums.items() if _differs(installed, module, recorded)}
    if not changed:
        return {}
    packages = dict.fromkeys(sorted({module.split("/")[0] for module in changed}), "")
    for other in distributions():
        if other.metadata["Name"] != name:
            shared = changed & _recorded_sums(other).keys()
            packages.update((module.split("/")[0], other.metadata["Name"]) for module in shared)
    return packages


def _recorded_sums(installed: Distribution) -> dict[str, str]:
    """Map modules to `algorithm=sum`, as in a distribution's `RECORD` file (PEP 376)."""
    rows = csv.reader((installed.read_text("RECORD") or "").splitlines())
    return {
        row[0]: row[1]
        for row in rows
        if len(row) > 1 and row[0].endswith(".py") and not row[0].startswith("..")
    }


def _differs(installed: Distribution, module: str, recorded: str) -> bool:
    algorithm, _, value = recorded.partition("=")
    if not value:
        return False
    try:
        content = Path(str(installed.locate_file(module))).read_bytes()
    except OSError:
        return True
    found = base64.urlsafe_b64encode(hashlib.new(algorithm, content).digest())
    return found.rstrip(b"=").decode() != value
