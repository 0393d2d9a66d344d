"""Write docs/reference/evidence.md from files of the tree: `script/generate evidence`.

The status of a feature is in its plugin's README and declaration; `docs/guides/plugins.md` has the rule. Long
runs are dated by the first lines of their results in `tests/long`.
"""

import re
from pathlib import Path

from tests.support.documents import page
from tests.support.environments import REPOSITORY

KINDS = {"interop": "live", "dds": "live", "golden": "recordings", "windows": "Windows"}
"""Folders of tests, and what their programs are compared with."""

HEAD = """\
# Evidence

This page says on what each part of pipros was proven, and when. `script/generate evidence` writes it from
files of the tree. [The status](../guides/plugins.md#status) of a feature follows from it.

## In each run of the tests

Continuous integration runs these tests at each change, on Debian 12. "Live" tests start genuine programs
beside pipros: ros_comm 1.15.15, roscpp, catkin, rclpy of ROS 2 Jazzy and Kilted. Recordings are what genuine
programs answered before. Windows's Python runs under Wine.

"""


def packages() -> list[Path]:
    return sorted((*REPOSITORY.glob("packages/pipros*"), *REPOSITORY.glob("plugins/pipros-*")))


def in_each_run() -> str:
    lines = ["| part | files of tests | live | recordings | Windows |", "| --- | ---: | ---: | ---: | ---: |"]
    for package in packages():
        files = [*package.glob("tests/**/test_*.py")]
        kinds = [KINDS.get(file.relative_to(package).parts[1]) for file in files]
        counts = [str(kinds.count(kind) or "") for kind in ("live", "recordings", "Windows")]
        lines.append(f"| `{package.name}` | {len(files)} | {' | '.join(counts)} |")
    return "\n".join(lines)


def features() -> str:
    """Return the tables of all READMEs of plugins as one, with what was never tried."""
    lines = ["| plugin | feature | status | compared with |", "| --- | --- | --- | --- |"]
    limits = []
    for package in packages():
        text = (package / "README.md").read_text(encoding="utf-8")
        rows = re.findall(r"(?m)^\| (.+) \| (stable|beta|experimental) \| (.+) \|$", text)
        lines += [f"| `{package.name}` | {' | '.join(row)} |" for row in rows]
        limits += [
            f"- `{package.name}`: {found}" for found in re.findall(r"(?m)^\*\*Limits\.\*\* (.+)$", text)
        ]
    return "\n".join(lines) + "\n\n## Limits, and what was never tried\n\n" + "\n".join(limits)


def long_runs() -> str:
    lines = ["| `script/long` | date | commit | result |", "| --- | --- | --- | --- |"]
    for file in sorted((REPOSITORY / "packages" / "pipros" / "tests" / "long").glob("*.txt")):
        first = file.read_text(encoding="utf-8").partition("\n")[0]
        date = re.search(r"\d{4}-\d\d-\d\d", first)
        commit = re.search(r"(?<=commit )\w+|(?<=commits )[\w ,]+?\w(?=,|$)", first)
        result = re.search(r"exit code \w+(?: \w+)?", first)
        assert date, file
        cells = [file.stem, date[0], commit[0] if commit else "", result[0] if result else "see the file"]
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines)


def evidence() -> str:
    """Return the page."""
    return (
        f"{HEAD}{in_each_run()}\n\n## Features of plugins\n\n{features()}\n\n## Long runs\n\n"
        "`packages/pipros/tests/long` has the output of the last run of each.\n\n"
        f"{long_runs()}\n\nRobots, cameras, lidars and joysticks were only simulated.\n"
        "A real Windows, macOS, a class of thirty and a fleet on several machines were never tried.\n"
    )


if __name__ == "__main__":
    page("reference/evidence.md").write_text(evidence(), encoding="utf-8")
