"""Wheels of many ROS packages, built, checked, installed and used: a table, package by package.

    python -m tests.support.wheel_table [--suite forky]

The packages: all of pipros, those of the tests and examples, those of the forms that public repositories
have (`wheel_workspace_table`), and Debian's installed packages of definitions (types must have the genuine
MD5 sums). `installed_wheels.py` uses the wheels with the running Python, and with that of a bare Debian of
the suite, if it is named (needs root and debootstrap). The settings of pip lead to PyPI.
"""

import argparse
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import venv
import zipfile
from pathlib import Path
from typing import Any

from pipros.packages import SHARE
from pipros_wheels.names import distribution_name
from tests.support.environments import EXAMPLES, REPOSITORY, file_of_tests
from tests.support.every_program import NODES
from tests.support.wheel_workspace_table import WORKSPACES, write_workspace
from tests.support.wheels import build_pipros

SETS = ("pipros", "own", "Debian")
TOOLS = ("twine", "check-wheel-contents")
EXCEPTED = ("W007", "W002")
"""Codes of check-wheel-contents that are true of a package, and no mistake: it has no Python modules, or a
program under two names, or a file that its sources have twice."""
NEEDED_ARGUMENT = re.compile(r"<arg\s+name=[^>=]*(doc=[^>=]*)?/>")
OTHER_FOLDERS = {"cfg", "cmake", "rosbuild", "setup.py", "test"}
"""Folders with executable files that users do not start."""
GENUINE = """
import glob, json, os, sys
import genmsg
from genmsg.msg_loader import load_depends, load_msg_from_file, load_srv_from_file
context = genmsg.MsgContext.create_default()
places = {os.path.basename(os.path.dirname(path)): [path] for path in glob.glob("/usr/share/*/msg")}
found = {}
for folder in sys.argv[1:]:
    package = os.path.basename(folder)
    for kind, load in (("msg", load_msg_from_file), ("srv", load_srv_from_file)):
        for file in glob.glob(f"{folder}/{kind}/*.{kind}"):
            name = os.path.basename(file)[:-4]
            spec = load(context, file, f"{package}/{name}")
            load_depends(context, spec, places)
            found[f"{package}.{kind}:{name}"] = genmsg.compute_md5(context, spec)
print(json.dumps(found))
"""
ARGUMENTS = {line.split()[0]: line.split()[1:] for line in reversed(NODES)}
LEFT_OUT = {"twelve packages of messages", "an overlay of a package of pipros", "C++ and Python mixed"}
LEFT_OUT |= {"a metapackage", "scripts and folders installed by hand", "Python with a setup.py"}
"""Workspaces that add nothing here, or that are named or packed so that this table would complain."""
FORMS = {
    path: pack
    for workspace, packs in WORKSPACES.items()
    if workspace not in LEFT_OUT
    for path, pack in packs.items()
    if pack.expected is not None
}
RUNNING = {path.rpartition("/")[2] for path, pack in FORMS.items() if "scripts/run" in pack.files}
"""Those with a program `run`."""
ROW = "{:42} {:18} {:9} {:>5} {:>4}  {:30} {}"
KINDS = {"compiled": "without C++", "as a whole": "whole folder", "not in the wheel": "lacks a folder"}
"""Words in the notes of `pipros wheel`, and what the table says."""


def main() -> int:
    """Build, check and use all wheels, and print the table. Return 1 if a package has an error."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--suite", choices=("bookworm", "trixie", "forky"), help="a Debian with another Python"
    )
    parser.add_argument("--only", choices=SETS, action="append", help="only these packages")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="pipros-wheels-") as name:
        folder = Path(name)
        sources = {name: write_sources(name, folder / "sources" / name) for name in arguments.only or SETS}
        wheels = folder / "wheels"
        wheels.mkdir()
        build_pipros(wheels, "pipros-robot")  # which an example needs
        notes = build(sources, wheels)
        found = {name: checks_of(wheels / name, path) for name, path in sources.items()}
        add_genuine_sums(found.get("Debian", []))
        (wheels / "checks.json").write_text(json.dumps(found))
        complaints = static_complaints(wheels, folder / "tools")
        passes = [
            results([sys.executable, str(Path(__file__).with_name("installed_wheels.py")), str(wheels)])
        ]
        if arguments.suite:
            fresh = [str(REPOSITORY / "script" / "fresh"), arguments.suite, "wheels"]
            passes.append(results(fresh, WHEELS=str(wheels)))
        return print_table(found, notes, complaints, passes)


def write_sources(group: str, folder: Path) -> Path:
    """Copy the packages of a set into a folder."""
    ignored = shutil.ignore_patterns("__pycache__")
    if group == "pipros":
        shutil.copytree(SHARE, folder, ignore=ignored)
    elif group == "own":
        for parent in (file_of_tests("packages"), EXAMPLES, REPOSITORY / "examples"):
            for manifest in parent.glob("*/package.xml"):
                shutil.copytree(manifest.parent, folder / manifest.parent.name, ignore=ignored)
        write_workspace(FORMS, folder)
    elif group == "Debian":
        for manifest in Path("/usr/share").glob("*/package.xml"):
            if any((manifest.parent / kind).is_dir() for kind in ("msg", "srv", "action")):
                shutil.copytree(manifest.parent, folder / manifest.parent.name)
    return folder


def build(sources: dict[str, Path], wheels: Path) -> dict[str, list[str]]:
    """Build the wheels of all sets, and return the notes by package. A failure ends the program."""
    notes: dict[str, list[str]] = {}
    for name, path in sources.items():
        words = [str(Path(sys.executable).with_name("pipros")), "wheel", str(path), "-o", str(wheels / name)]
        ended = subprocess.run(words, capture_output=True, text=True)
        if ended.returncode != 0:
            sys.exit(ended.stderr)
        for line in ended.stdout.splitlines():
            package, _, note = line.partition(": ")
            if note:
                notes.setdefault(f"{name}/{package}", []).append(note)
    return notes


def checks_of(wheels: Path, sources: Path) -> list[dict[str, Any]]:
    """Return what `installed_wheels.py` checks of each package."""
    found: list[dict[str, Any]] = []
    for folder in sorted({manifest.parent for manifest in sources.rglob("package.xml")}):
        text = (folder / "package.xml").read_text()
        name, version = (re.search(rf"<{tag}>([^<]+)", text)[1].strip() for tag in ("name", "version"))  # type: ignore[index]
        project = distribution_name(name)
        (wheel,) = wheels.glob(f"{project.replace('-', '_')}-{version}-*.whl")
        with zipfile.ZipFile(wheel) as archive:
            infos = {info.filename.partition(".data/data/")[2]: info for info in archive.infolist()}
        paths = sorted(filter(None, infos))
        programs = [path for path in paths if infos[path].external_attr >> 16 & 0o111]
        says = f"{name} works" if name in RUNNING else ""
        found.append({
            "name": name, "version": version, "distribution": project, "imports": imports(name, paths),
            "launch": launch_file(folder), "program": program(name, programs), "says": says, "md5": {},
        })  # fmt: skip
    return found


def imports(package: str, paths: list[str]) -> list[str]:
    """Return the types of a package as `package.msg:Type`, and its modules."""
    names = []
    for path in paths:
        stem, ending = os.path.splitext(os.path.basename(path))
        if path.startswith(f"share/{package}/") and ending in (".msg", ".srv"):
            names.append(f"{package}{ending}:{stem}")
        elif path.startswith(f"share/{package}/") and ending == ".action":
            names.append(f"{package}.msg:{stem}Action")
        elif path.startswith("share/pipros/modules/"):
            names.append(os.path.basename(path))
    return list(dict.fromkeys(names))


def launch_file(folder: Path) -> str:
    """Return a launch file of a package that needs no arguments, or an empty string."""
    files = sorted(folder.rglob("*.launch"))
    return next((file.name for file in files if not NEEDED_ARGUMENT.search(file.read_text())), "")


def program(package: str, paths: list[str]) -> list[str]:
    """Return one of a package's programs, whose paths are given, with arguments; empty if it has none."""
    found = [os.path.basename(path) for path in paths if not OTHER_FOLDERS & set(path.split("/"))]
    known = ["run"] if package in RUNNING else ARGUMENTS.get(package, [""])
    return known if known[0] in found else [found[0], "--help"] if found else []


def add_genuine_sums(checks: list[dict[str, Any]]) -> None:
    """Add the MD5 sums that genuine genmsg computes."""
    words = ["/usr/bin/python3", "-c", GENUINE, *(f"/usr/share/{check['name']}" for check in checks)]
    sums = json.loads(subprocess.run(words, check=True, capture_output=True, text=True).stdout)
    for check in checks:
        check["md5"] = {key: md5 for key, md5 in sums.items() if key.startswith(f"{check['name']}.")}


def static_complaints(wheels: Path, tools: Path) -> dict[str, list[str]]:
    """Return what twine and check-wheel-contents complain about, by set and distribution."""
    venv.create(tools, with_pip=True)
    pip = [str(tools / "bin" / "python"), "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
    subprocess.run([*pip, *TOOLS], check=True, stderr=subprocess.DEVNULL)
    names = {
        str(file): f"{file.parent.name}/{file.name.split('-')[0].replace('_', '-')}"
        for file in sorted(wheels.glob("*/*.whl"))
    }
    complaints: dict[str, list[str]] = {name: [] for name in names.values()}
    twine = [str(tools / "bin" / "twine"), "--no-color", "check", "--strict", *names]
    checked = subprocess.run(twine, capture_output=True, text=True)
    for file in re.findall(r"^Checking (.+\.whl): (?!PASSED)", checked.stdout, re.MULTILINE):
        complaints[names[file]].append("twine check")
    if checked.returncode != 0 and not any(complaints.values()):
        sys.exit(checked.stdout + checked.stderr)
    words = [str(tools / "bin" / "check-wheel-contents"), "--no-config", *names]
    output = subprocess.run(words, capture_output=True, text=True).stdout
    for file, code in dict.fromkeys(re.findall(r"^(.+\.whl): (W\d+): ", output, re.MULTILINE)):
        complaints[names[file]].append(code)
    if len(re.findall(r"^.+\.whl: (?:OK|W\d+)", output, re.MULTILINE)) < len(names):
        sys.exit(output)
    return complaints


def results(command: list[str], **variables: str) -> list[dict[str, Any]]:
    """Run `installed_wheels.py`, and return its rows. A failure without rows ends the program."""
    ended = subprocess.run(command, env={**os.environ, **variables}, stdout=subprocess.PIPE, text=True)
    lines = [line.removeprefix("result ") for line in ended.stdout.splitlines() if line.startswith("result ")]
    if not lines:
        sys.exit(f"{' '.join(command)} printed no results: {ended.stdout[-2000:]}")
    return [json.loads(line) for line in lines]


def print_table(
    found: dict[str, list[dict[str, Any]]],
    notes: dict[str, list[str]],
    complaints: dict[str, list[str]],
    passes: list[list[dict[str, Any]]],
) -> int:
    """Print a row for each package, and all errors. Return 1 if there is an error."""
    versions = [rows[0]["python"] for rows in passes]
    by_name = [{f"{row['set']}/{row['name']}": row for row in rows} for rows in passes]
    errors = []
    print(ROW.format("package", "wheel", "contents", "types", "mod.", "launch file", "program"))
    for group, check in ((group, check) for group, checks in found.items() for check in checks):
        name = f"{group}/{check['name']}"
        codes = complaints[f"{group}/{check['distribution']}"]
        errors += [f"{name}: {code}" for code in codes if code not in EXCEPTED]
        for version, rows in zip(versions, by_name, strict=True):
            wrong = rows[name]["errors"] if name in rows else ["not checked"]
            errors += [f"{name}, Python {version}: {error}" for error in wrong]
        words = [word for word in KINDS if any(word in note for note in notes.get(name, ()))]
        kind = ", ".join(KINDS[word] for word in words) or "as installed"
        row, title = by_name[0][name], f"{name} {check['version']}"
        used = (row["types"], row["modules"], check["launch"] or "-", row["program"] or "-")
        print(ROW.format(title, kind, " ".join(codes) or "ok", *used))
    print(f"\n{sum(map(len, found.values()))} packages, each installed, found, imported, started, and")
    print(f"uninstalled by pip and by uv, with Python {' and '.join(versions)}.")
    print(f"{len(errors)} errors", *errors, sep="\n")
    return int(bool(errors))


if __name__ == "__main__":
    sys.exit(main())
