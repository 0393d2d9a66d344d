#!/usr/bin/env python3
"""Real ROS 1 packages under pipros: what builds, what launches, what lacks a name.

    script/fresh bookworm survey            # on a bare Debian, without genuine ROS; the result is survey.txt
    script/bench survey [--only NAME,NAME] [--sources FOLDER] [--no-start]

The sources are downloaded from PyPI and Debian, in the versions below; apt-get must be configured for
Debian. Each is built by `catkin_make` in its own workspace. Every launch file is checked as by
`roslaunch-check`; those whose programs exist are started for some seconds, and files with tests are run by
`rostest`. Imports, and attributes of imported modules, are looked up in pipros, in this Python.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import tarfile
import tempfile
import time
import zipfile
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

from survey_names import CLIENT, package_folders
from table import heed_interrupts

from pipros.workspace.index import SHARED_PACKAGES

# "name version", with a source archive that pip can read.
PYPI = """
    dual-quaternions-ros 0.1.0
    extended-rospylogs 0.0.5
    haros 3.10.20
    imu-listener 1.0.0
    jderobot-ros 1.0.2
    mavros-python-examples 0.0.3
    panda-robot 0.0.5
    py-trees 2.6.0
    pyrobopath 0.2.8
    pyros 0.4.3
    pyros-msgs 0.2.0
    ros1-fuzzer 1.0.0
    roshelper 0.1.6
    rosonic 0.2.2
    rosrx 0.2.0
    sixriver-ros-utils 0.0.6
    spatialmath-rospy 0.3.1
    standalone-smach 0.0.9
    topic-store 0.1.8
    urdf-parser-py 0.0.4
    urdfdom-py 1.2.1.post1
"""
# "name version": the newest version whose upstream archive Debian's mirrors have.
DEBIAN = """
    ros-actionlib 1.14.3-1
    ros-bond-core 1.8.7-1
    ros-catkin 0.8.12-2
    ros-cmake-modules 0.5.2-2
    ros-collada-urdf 1.12.13-12
    ros-common-msgs 1.13.2-1
    ros-diagnostics 1.12.1+ds-2
    ros-dynamic-reconfigure 1.7.6-1
    ros-eigen-stl-containers 0.1.8-7
    ros-gencpp 0.7.2-1
    ros-genlisp 0.4.18-3
    ros-genmsg 0.6.1-1
    ros-genpy 0.6.18-2
    ros-geometric-shapes 0.7.7-2
    ros-geometry 1.13.2-11
    ros-geometry2 0.7.10-2
    ros-image-common 1.12.1-1
    ros-image-pipeline 1.17.0-2
    ros-image-transport-plugins 1.15.0-5
    ros-interactive-markers 1.12.0-10
    ros-joint-state-publisher 1.15.2-1
    ros-kdl-parser 1.14.2-3
    ros-laser-geometry 1.6.7-5
    ros-message-generation 0.4.1-6
    ros-message-runtime 0.4.13-6
    ros-navigation-msgs 1.14.2-1
    ros-nodelet-core 1.11.1-1
    ros-opencv-apps 2.0.2-10
    ros-pcl-msgs 0.3.0-4
    ros-perception-pcl 1.7.5-6
    ros-random-numbers 0.3.3-3
    ros-resource-retriever 1.12.10-1
    ros-robot-state-publisher 1.15.2-5
    ros-ros 1.15.10-1
    ros-ros-comm 1.17.4+ds-4
    ros-ros-comm-msgs 1.11.4-1
    ros-ros-environment 1.3.2-4
    ros-rosconsole 1.14.4-2
    ros-rosconsole-bridge 0.5.5-1
    ros-roscpp-core 0.7.3-3
    ros-roslisp 1.9.25-2
    ros-rospack 2.6.4-2
    ros-rviz 1.14.25+dfsg-1
    ros-std-msgs 0.5.14-1
    ros-urdf 1.13.4-1
    ros-vision-opencv 1.16.2+ds-5
"""
NAMES = Path(__file__).with_name("survey_names.py")
SUITES = ("bookworm", "trixie", "forky")
KEYRING = "/usr/share/keyrings/debian-archive-keyring.gpg"
HARDWARE: dict[str, str] = {}
"""The device or screen that a launch file needs, by a part of its path."""

WIDTH = 200
BUILD_TIMEOUT_S = 180
INSPECT_TIMEOUT_S = 180
START_S = 10.0
STOP_S = 20
TEST_TIMEOUT_S = 90
COLOUR = re.compile(r"\x1b\[[0-9;]*m")
COMPILED = re.compile(r"the package \[\S+\] (?:compiles|uses|needs|has) .*(?:cmake|catkin|c\+\+) is not ")
DEATH = re.compile(r"^\[?(?:REQUIRED process )?\[([^\]]+)\](?: process)? has died", re.MULTILINE)
ERROR_LINE = re.compile(r"^\w[\w.]*(?:Error|Exception|NotFound)\b.*", re.MULTILINE)


@dataclass
class Surveyed:
    """The results of one distribution."""

    name: str
    version: str
    packages: list[str] = field(default_factory=list)
    compiled: list[str] = field(default_factory=list)
    failed: dict[str, str] = field(default_factory=dict)
    launch: dict[str, list[str]] = field(default_factory=dict)
    outcomes: dict[str, str] = field(default_factory=dict)
    missing: list[str] = field(default_factory=list)
    others: list[str] = field(default_factory=list)
    python2: int = 0


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--only", default="", help="only these distributions, separated by commas")
    parser.add_argument("--sources", type=Path, help="folder that keeps the downloads")
    parser.add_argument("--no-start", action="store_true", help="start no launch files")
    arguments = parser.parse_args()
    heed_interrupts()
    only = arguments.only.split(",") if arguments.only else ()
    listed = [
        (*line.split(), pypi) for lines, pypi in ((DEBIAN, False), (PYPI, True)) for line in rows(lines)
    ]
    found = []
    with tempfile.TemporaryDirectory(prefix="pipros-survey-") as folder:
        sources = (arguments.sources or Path(folder) / "sources").absolute()
        sources.mkdir(parents=True, exist_ok=True)
        for name, version, is_pypi in listed:
            if only and name not in only:
                continue
            result = Surveyed(name, version)
            found.append(result)
            base = Path(folder) / name
            try:
                archive = fetch(name, version, is_pypi, sources)
            except subprocess.CalledProcessError as error:
                result.failed["download"] = (error.stderr or "").strip().splitlines()[-1]
            else:
                unpack(archive, base / "src" / name)
                survey(result, base, starts=not arguments.no_start)
                shutil.rmtree(base, ignore_errors=True)
            print(row(result), *details(result), sep="\n    ", file=sys.stderr, flush=True)
    print_report(found)
    return 0


def rows(lines: str) -> list[str]:
    return [line for line in lines.splitlines() if line.strip()]


# ---- sources


def fetch(name: str, version: str, is_pypi: bool, folder: Path) -> Path:
    """Return the source archive, which is downloaded unless `folder` has it."""
    target = folder / name
    if not target.is_dir():
        shutil.rmtree(folder / "part", ignore_errors=True)
        (folder / "part").mkdir()
        command = pip(name, version) if is_pypi else apt(name, version, folder)
        subprocess.run(command, cwd=folder / "part", check=True, capture_output=True, text=True)
        (folder / "part").rename(target)
    (archive,) = target.iterdir()
    return archive


def pip(name: str, version: str) -> list[str]:
    words = [sys.executable, "-m", "pip", "download", "--quiet", "--disable-pip-version-check", "--no-deps"]
    return [*words, "--no-binary", name, f"{name}=={version}"]


def apt(name: str, version: str, folder: Path) -> list[str]:
    """Return the command that downloads upstream's archive, using separate package lists."""
    state = folder.with_name(f"{folder.name}-apt")
    options = [f"-o=Dir::Etc::sourcelist={state}/sources.list", "-o=Dir::Etc::sourceparts=/dev/null"]
    options += [f"-o=Dir::State::lists={state}/lists", f"-o=Dir::Cache={state}/cache"]
    if not list(state.glob("lists/*Sources*")):
        (state / "lists" / "partial").mkdir(parents=True, exist_ok=True)
        (state / "cache").mkdir(exist_ok=True)
        words = [
            "apt-get",
            "indextargets",
            "--format",
            "$(REPO_URI)",
            "COMPONENT: main",
            "IDENTIFIER: Packages",
        ]
        mirror = subprocess.run(words, check=True, capture_output=True, text=True).stdout.split()[0]
        lines = [f"deb-src [signed-by={KEYRING}] {mirror} {suite} main\n" for suite in SUITES]
        (state / "sources.list").write_text("".join(lines))
        subprocess.run(["apt-get", "-qq", *options, "update"], check=True, capture_output=True, text=True)
    return ["apt-get", "-qq", *options, "source", "--download-only", "--tar-only", f"{name}={version}"]


def unpack(archive: Path, folder: Path) -> None:
    folder.mkdir(parents=True)
    if zipfile.is_zipfile(archive):
        with zipfile.ZipFile(archive) as zipped:
            zipped.extractall(folder)  # noqa: S202
    else:
        with tarfile.open(archive) as opened:
            opened.extraction_filter = getattr(tarfile, "data_filter", None)  # Debian 12's Python has none
            opened.extractall(folder)  # noqa: S202


# ---- one distribution


def survey(result: Surveyed, base: Path, *, starts: bool) -> None:
    """Build, check and start the packages in the workspace `base`."""
    folders = package_folders(base / "src")
    result.packages = sorted(folders)
    if folders:
        read_build(result, run(base, ["catkin_make"], BUILD_TIMEOUT_S))
    inspected = run(base, [sys.executable, str(NAMES), str(base / "src")], INSPECT_TIMEOUT_S)
    try:
        facts = json.loads(inspected.splitlines()[-1])
    except (ValueError, IndexError):
        result.failed["names"] = inspected.strip().splitlines()[-1:][0] if inspected.strip() else "no answer"
        return
    result.launch, result.missing, result.others, result.python2 = facts
    if not starts:
        return
    replaced = [
        folder
        for name, folder in folders.items()
        if result.name in CLIENT and (SHARED_PACKAGES / name).is_dir()
    ]
    if replaced:
        for folder in replaced:
            (folder / "CATKIN_IGNORE").touch()
        shutil.rmtree(base / "build")
        shutil.rmtree(base / "devel")
        run(base, ["catkin_make"], BUILD_TIMEOUT_S)
    for file, wrong in result.launch.items():
        path = base / "src" / file
        if wrong or any(path.is_relative_to(folder) for folder in replaced):
            continue
        need = next((need for part, need in HARDWARE.items() if part in file), "")
        if need:
            result.outcomes[file] = f"needs {need}"
        else:
            result.outcomes[file] = test(base, path) if "<test" in path.read_text() else start(base, path)


def environment(base: Path) -> dict[str, str]:
    home = base / "home"
    home.mkdir(exist_ok=True)
    return {
        **{name: value for name, value in os.environ.items() if name.startswith(("LANG", "LC_", "TZ"))},
        "HOME": str(home),
        "PATH": f"{Path(sys.executable).parent}:{os.environ['PATH']}",
        "ROS_MASTER_URI": f"http://127.0.0.1:{20000 + os.getpid() % 10000}",
    }


def sourced(base: Path, words: list[str]) -> list[str]:
    setup = base / "devel" / "setup.bash"
    return ["bash", "-c", '[ ! -e "$0" ] || . "$0"; exec "$@"', str(setup), *words]


def run(base: Path, words: list[str], timeout_s: float) -> str:
    """Run a command in the built workspace and return its output, and "timed out" if it did not end."""
    code, output = ended(base, words, timeout_s)
    return output if code is not None else f"{output}\ntimed out after {timeout_s} s"


def ended(
    base: Path, words: list[str], timeout_s: float, stop_after_s: float | None = None
) -> tuple[int | None, str]:
    """Run a command, and return the exit code, None if it had to be killed, and the output.

    With `stop_after_s`, it is interrupted after this time, and later output is not returned.
    """
    log = base / "log"
    with log.open("w") as out:
        process = subprocess.Popen(
            sourced(base, words),
            cwd=base,
            env=environment(base),
            stdin=subprocess.DEVNULL,
            stdout=out,
            stderr=subprocess.STDOUT,
            start_new_session=True,
        )
    code: int | None = None
    try:
        code = process.wait(timeout_s if stop_after_s is None else stop_after_s)
        output = log.read_text(errors="replace")
    except subprocess.TimeoutExpired:
        output = log.read_text(errors="replace")
        if stop_after_s is not None:
            process.send_signal(signal.SIGINT)
            with suppress(subprocess.TimeoutExpired):
                code = process.wait(STOP_S)
    finally:
        with suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()
    for folder in (base, Path(sys.executable).parent):
        output = output.replace(f"{folder}/", "")
    return code, COLOUR.sub("", output)


def read_build(result: Surveyed, output: str) -> None:
    """Add the packages that `catkin_make` reports as failed, or as compiled and therefore built in part."""
    for line in output.splitlines():
        name, separator, reason = line.removeprefix(" * ").partition(": ")
        if line.startswith(" * ") and separator:
            if COMPILED.search(reason):
                result.compiled.append(name)
            else:
                result.failed[name] = re.sub(r"\bsrc/\S*/(?=\S)", "", reason)
        elif line.startswith("   skipped: "):
            for skipped, culprit in re.findall(r"(\S+) \(needs (\S+)\)", line):
                result.failed.setdefault(skipped, f"needs {culprit}")
    if "timed out" in output or ("failed" in output and not (result.failed or result.compiled)):
        result.failed["workspace"] = output.strip().splitlines()[-1]


def start(base: Path, file: Path) -> str:
    """Start a launch file, and return "started", or what went wrong."""
    began = time.monotonic()
    code, output = ended(base, ["roslaunch", "--screen", str(file)], STOP_S, START_S)
    if died := sorted(set(DEATH.findall(output))):
        reason = ERROR_LINE.findall(output)
        return f"died: {', '.join(died)}" + (f": {reason[-1]}" if reason else "")
    if code is None:
        return f"did not stop within {STOP_S} s"
    if code != 0 and time.monotonic() - began < START_S:
        return f"exit code {code}: {(output.strip().splitlines() or [''])[-1]}"
    return "started"


def test(base: Path, file: Path) -> str:
    """Run a file with rostest, and return "passed", or what went wrong."""
    code, output = ended(base, ["rostest", "--text", str(file)], TEST_TIMEOUT_S)
    if code == 0:
        return "passed"
    if code is None:
        return f"test: not ended after {TEST_TIMEOUT_S} s"
    counts = re.findall(r"^ \* (\w+): (\d+)", output, re.MULTILINE)[-3:]
    reason = ERROR_LINE.findall(output)
    text = ", ".join(f"{count} {word.lower()}" for word, count in counts if count != "0")
    return f"test: {text}" + (f": {reason[-1]}" if reason else "")


# ---- the report

COLUMNS = ("packages", "built", "C++", "failed", "launch", "ok", "started", "of", "passed", "of", "lacks")


def figures(result: Surveyed) -> list[int]:
    """Return the numbers of a row."""
    broken = set(result.failed) & set(result.packages)
    tried = [outcome for outcome in result.outcomes.values() if not outcome.startswith("needs ")]
    tests = [outcome for outcome in tried if outcome == "passed" or outcome.startswith("test: ")]
    return [
        len(result.packages),
        len(set(result.packages) - broken - set(result.compiled)),
        len(set(result.compiled)),
        len(broken),
        len(result.launch),
        sum(not wrong for wrong in result.launch.values()),
        tried.count("started"),
        len(tried) - len(tests),
        tests.count("passed"),
        len(tests),
        len(result.missing),
    ]


def row(result: Surveyed) -> str:
    return line(f"{result.name} {result.version}", figures(result))


def line(name: str, cells: Sequence[object]) -> str:
    return f"{name:<42}" + "".join(f"{cell!s:>9}" for cell in cells)


def print_report(found: list[Surveyed]) -> None:
    """Print the table, the totals, and for each distribution what did not work."""
    print(line("source", COLUMNS))
    for result in found:
        print(row(result))
    totals = [sum(column) for column in zip(*map(figures, found), strict=True)]
    print(line(f"{len(found)} sources", totals))
    print()
    for result in found:
        notes = list(details(result))
        if notes:
            print(f"{result.name} {result.version}")
            for note in notes:
                print(f"    {note}"[:WIDTH])
    for title, names in (
        ("lacking names", [name for result in found for name in result.missing]),
        ("modules of other projects", [name for result in found for name in result.others]),
    ):
        print(f"\n{title}: " + ", ".join(f"{name} ({n})" for name, n in Counter(names).most_common()))


def details(result: Surveyed) -> Iterator[str]:
    for name, reason in sorted(result.failed.items()):
        yield f"{name}: {reason}"
    reasons = Counter(reason for wrong in result.launch.values() for reason in wrong)
    for reason, count in reasons.most_common():
        yield f"{count} launch file{'s' * (count > 1)}: {reason}"
    for file, outcome in sorted(result.outcomes.items()):
        if outcome not in ("started", "passed"):
            yield f"{file}: {outcome}"
    if result.missing:
        yield f"lacks: {', '.join(result.missing)}"
    if result.python2:
        yield f"{result.python2} files of Python 2"


if __name__ == "__main__":
    sys.exit(main())
