"""Install wheels of ROS packages into a new environment of the running Python, and use them as users do.

    python3 plugins/pipros-wheels/tests/support/installed_wheels.py FOLDER

FOLDER has the wheels of pipros, a folder for each set of wheels, and `checks.json`, which
`tests.support.wheel_table` writes. Of each set, pip installs all wheels: each type and module is imported,
each launch file is loaded, a program of each package is started, and pip uninstalls all. Then uv does the
same, without the launch files and programs. No ROS variable is set, except for the port of the master.

Prints one line of JSON for each package. Needs only the standard library.
"""

from __future__ import annotations

import argparse
import importlib
import json
import os
import platform
import re
import signal
import socket
import subprocess
import sys
import tempfile
import time
import venv
import xmlrpc.client
import zipfile
from pathlib import Path
from typing import Any

LIMIT_S = 60.0
CARRIED = ("PIP_", "UV_", "HTTP", "http", "NO_PROXY", "no_proxy", "SSL_")
"""Beginnings of the variables with this machine's settings, for pip and uv alone."""

FAILED = re.compile(r"^Traceback |not found|[Cc]ouldn't find|cannot find", re.MULTILINE)


def main() -> int:
    """Check all sets. Return 1 if a package has an error."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", type=Path)
    parser.add_argument("--import", dest="imported", metavar="SET", help="only import the types of a set")
    arguments = parser.parse_args()
    sets = json.loads((arguments.folder / "checks.json").read_text())
    if arguments.imported:
        print(json.dumps({check["name"]: import_all(check["imports"]) for check in sets[arguments.imported]}))
        return 0
    with tempfile.TemporaryDirectory(prefix="pipros-wheels-") as folder:
        environment = Environment(Path(folder), arguments.folder)
        failed = False
        for name, checks in sets.items():
            for row in environment.check_set(name, checks):
                failed |= bool(row["errors"])
                print(f"result {json.dumps(row)}", flush=True)
    return int(failed)


def import_all(names: list[str]) -> dict[str, Any]:
    """Import `module` and `module:class`. Return the MD5 sums by name, and the first error."""
    found = {}
    for name in names:
        module, _, attribute = name.partition(":")
        try:
            loaded: Any = importlib.import_module(module)
            found[name] = getattr(loaded, attribute)._md5sum if attribute else ""
        except Exception as error:  # whatever the package raises is the result
            return {"md5": found, "error": f"{name}: {type(error).__name__}: {error}"}
    return {"md5": found, "error": ""}


def new_row(name: str, check: dict[str, Any]) -> dict[str, Any]:
    types = sum(":" in item for item in check["imports"])
    counts = {"types": types, "modules": len(check["imports"]) - types}
    row = {"set": name, "name": check["name"], "python": platform.python_version(), **counts}
    return {**row, "program": "", "errors": []}


class Environment:
    """A new virtual environment with pipros, pip and uv."""

    def __init__(self, folder: Path, wheels: Path) -> None:
        self.wheels = wheels
        self.home = folder / "home"
        self.home.mkdir()
        self.prefix = folder / "environment"
        venv.create(self.prefix, with_pip=True, symlinks=True)
        self.programs = self.prefix / "bin"
        self.pip = [str(self.programs / "python"), "-m", "pip"]
        self.uv = [str(self.programs / "uv"), "pip"]
        (pipros,) = wheels.glob("pipros-*.whl")
        self.tool("pip", "install", "--quiet", "uv", f"{pipros}[numpy]")
        self.tool("uv", "install", "--quiet", pipros)  # uv keeps a lock file from now on

    def tool(self, name: str, verb: str, *words: str | Path) -> str:
        """Run pip or uv with the settings of this machine; a failure raises an error with the output."""
        command = [*(self.pip if name == "pip" else self.uv), verb, *map(str, words)]
        if name == "uv":
            command += ["--python", str(self.programs / "python")]
        carried = {key: value for key, value in os.environ.items() if key.startswith(CARRIED)}
        return self.run(command, **{**carried, "PIP_DISABLE_PIP_VERSION_CHECK": "1"})

    def variables(self, **more: str) -> dict[str, str]:
        return {"PATH": f"{self.programs}:/usr/bin:/bin", "HOME": str(self.home), "LANG": "C.UTF-8", **more}

    def run(self, command: list[str], **variables: str) -> str:
        """Run a program to its end, and return its output."""
        ended = subprocess.run(
            command, env=self.variables(**variables), cwd=self.home, stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT, text=True, timeout=600,
        )  # fmt: skip
        if ended.returncode != 0:
            raise RuntimeError(f"{' '.join(command)[:300]}\n{ended.stdout}")
        return ended.stdout

    def files(self) -> set[str]:
        """Return the paths of all files, without compiled Python."""
        found = (file for file in self.prefix.rglob("*") if "__pycache__" not in file.parts)
        return {str(file.relative_to(self.prefix)) for file in found if not file.is_dir()}

    def check_set(self, name: str, checks: list[dict[str, Any]]) -> list[dict[str, Any]]:
        """Install, use and uninstall all wheels of a set with pip, then with uv. Return a row for each."""
        folder = self.wheels / name
        files = sorted(folder.glob("*.whl"))
        projects = sorted({item for file in files for item in requirements(file)})
        if projects:
            self.tool("pip", "install", "--quiet", "--find-links", self.wheels, *projects)
        rows = {check["name"]: new_row(name, check) for check in checks}
        before = self.files()
        for tool in ("pip", "uv"):
            self.tool(tool, "install", "--quiet", "--no-index", "--find-links", folder, *files)
            self.check_imports(name, checks, rows)
            if tool == "pip":
                with Master(self) as master:
                    for check in checks:
                        self.launch(check, rows[check["name"]])
                        master.start_program(check, rows[check["name"]])
            yes = ("--quiet", "--yes") if tool == "pip" else ("--quiet",)
            self.tool(tool, "uninstall", *yes, *(check["distribution"] for check in checks))
            for file in sorted(self.files() - before):
                owners = (check["name"] for check in checks if f"/{check['name']}/" in file)
                rows[next(owners, checks[0]["name"])]["errors"].append(f"{tool} left {file}")
            for file in sorted(before - self.files()):
                rows[checks[0]["name"]]["errors"].append(f"{tool} removed {file}")
        return list(rows.values())

    def check_imports(self, name: str, checks: list[dict[str, Any]], rows: dict[str, dict[str, Any]]) -> None:
        """Check that all packages are found in the environment, and import all of their types and modules."""
        listed = dict(line.split(" ", 1) for line in self.run(["rospack", "list"]).splitlines())
        script = [str(self.programs / "python"), "-I", __file__, str(self.wheels), "--import", name]
        results = json.loads(self.run(script).splitlines()[-1])
        for check in checks:
            package, errors = check["name"], rows[check["name"]]["errors"]
            if listed.get(package) != str(self.prefix / "share" / package):
                errors.append(f"found at {listed.get(package)}")
            if results[package]["error"]:
                errors.append(results[package]["error"])
            sums = results[package]["md5"]
            errors += [
                f"{key} has md5 {sums.get(key)}" for key, md5 in check["md5"].items() if sums.get(key) != md5
            ]

    def launch(self, check: dict[str, Any], row: dict[str, Any]) -> None:
        """Load a launch file."""
        try:
            if (
                check["launch"]
                and not self.run(["roslaunch", "--nodes", check["name"], check["launch"]]).strip()
            ):
                row["errors"].append(f"{check['launch']} has no nodes")
        except RuntimeError as error:
            row["errors"].append(str(error)[-300:])


class Master:
    """A running master, and programs that register at it."""

    def __init__(self, environment: Environment) -> None:
        self.environment = environment
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            port = free.getsockname()[1]
        self.uri = f"http://127.0.0.1:{port}"
        self.output = environment.home / "output"
        self.process = self.start(["rosmaster", "--core", "-p", str(port)], environment.home / "master")

    def __enter__(self) -> Master:
        deadline = time.monotonic() + LIMIT_S
        while self.nodes() is None:
            if time.monotonic() > deadline:
                raise RuntimeError("rosmaster did not start")
            time.sleep(0.05)
        return self

    def __exit__(self, *_error: object) -> None:
        end(self.process)

    def start(self, command: list[str], output: Path) -> subprocess.Popen[bytes]:
        variables = self.environment.variables(ROS_MASTER_URI=self.uri, PYTHONUNBUFFERED="1")
        with output.open("wb") as file:
            return subprocess.Popen(
                command, env=variables, cwd=self.environment.home, stdin=subprocess.DEVNULL, stdout=file,
                stderr=subprocess.STDOUT, start_new_session=True,
            )  # fmt: skip

    def nodes(self) -> set[str] | None:
        """Return the registered nodes, or None if the master does not answer."""
        try:
            with xmlrpc.client.ServerProxy(self.uri) as proxy:
                answer: Any = proxy.getSystemState("/check")
        except OSError:
            return None
        return {name for kind in answer[2] for _, names in kind for name in names}

    def start_program(self, check: dict[str, Any], row: dict[str, Any]) -> None:
        """Start a program, until it ends or is registered as a node."""
        if not check["program"]:
            return
        command = ["rosrun", check["name"], *check["program"], f"__name:=probe_{check['name']}"]
        process = self.start(command, self.output)
        deadline = time.monotonic() + LIMIT_S
        outcome = ""
        while not outcome:
            if process.poll() is not None:
                outcome = f"ended with {process.returncode}"
            elif not check["says"] and f"/probe_{check['name']}" in (self.nodes() or ()):
                outcome = "is a node"
            elif time.monotonic() > deadline:
                outcome = "runs"
            else:
                time.sleep(0.05)
        text = self.output.read_text(errors="replace")  # before the program handles a signal
        end(process)
        if FAILED.search(text) or check["says"] not in text:
            row["errors"].append(f"{' '.join(check['program'])} {outcome}: {text[-300:]}")
        row["program"] = f"{check['program'][0]} {outcome}"


def end(process: subprocess.Popen[bytes]) -> None:
    """End a program, and what it started."""
    for number, limit_s in ((signal.SIGINT, 15), (signal.SIGKILL, 15)):
        if process.poll() is None:
            os.killpg(process.pid, number)
            try:
                process.wait(limit_s)
            except subprocess.TimeoutExpired:
                continue


def requirements(wheel: Path) -> list[str]:
    """Return the requirements of a wheel, except pipros and ROS packages."""
    with zipfile.ZipFile(wheel) as archive:
        (name,) = [name for name in archive.namelist() if name.endswith(".dist-info/METADATA")]
        lines = archive.read(name).decode().splitlines()
    found = [line.partition(": ")[2] for line in lines if line.startswith("Requires-Dist: ")]
    return [item for item in found if item != "pipros" and not item.startswith("ros1-")]


if __name__ == "__main__":
    sys.exit(main())
