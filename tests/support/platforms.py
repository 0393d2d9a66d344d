"""Report the errors that pyright finds for macOS or Windows, but not for Linux.

Tests do not run on these systems, but pyright finds uses of names that one of them lacks. Only files that
import a module with such names are checked, for macOS and Windows at the same time. Files with errors are
then checked for Linux. `script/check platforms` runs this program.
"""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Collection, Iterable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from tests.support.environments import FACADES, SRC
from tests.support.pyright import INSTALL, find_pyright

MODULES = (
    "asyncio ctypes errno fcntl grp locale mmap multiprocessing os pty pwd readline resource select "
    "selectors shutil signal socket socketserver ssl stat subprocess syslog tempfile "
    "termios time tty webbrowser"
)
"""The modules whose names differ between systems, according to the stubs of the standard library."""

_IMPORT = re.compile(rf"^\s*(?:from|import)\s(?:.*[\s,])?(?:{'|'.join(MODULES.split())})\b", re.MULTILINE)
_LIMIT_S = 600


@dataclass(frozen=True, slots=True, order=True)
class Complaint:
    """An error that pyright reports."""

    file: str
    line: int
    text: str

    def __str__(self) -> str:
        return f"{self.file}:{self.line}: {self.text}"


def files_with_differences(folder: Path) -> list[Path]:
    """Return the Python files that import a module whose names differ between systems."""
    return [file for file in sorted(folder.rglob("*.py")) if _IMPORT.search(file.read_text())]


def errors_on(platform: str, files: Collection[Path], extra_paths: Iterable[Path] = ()) -> set[Complaint]:
    """Return the errors of pyright's basic mode for a platform: Linux, Darwin or Windows."""
    program = find_pyright()
    if program is None:
        raise SystemExit(f"pyright is not on this machine: {INSTALL}")
    with tempfile.TemporaryDirectory() as folder:
        settings = Path(folder) / "pyrightconfig.json"
        settings.write_text(
            json.dumps(
                {
                    "include": [os.path.relpath(file, folder) for file in files],
                    "exclude": [],
                    "extraPaths": [str(path) for path in extra_paths],
                    "pythonPlatform": platform,
                    "typeCheckingMode": "basic",
                }
            )
        )
        ended = subprocess.run(
            [program, "--project", settings, "--pythonpath", sys.executable, "--outputjson"],
            stdout=subprocess.PIPE,
            text=True,
            timeout=_LIMIT_S,
            check=False,
        )
    report = json.loads(ended.stdout)
    if report["summary"]["filesAnalyzed"] != len(files):
        raise SystemExit(
            f"pyright checked {report['summary']['filesAnalyzed']} files instead of {len(files)}"
        )
    return {
        Complaint(each["file"], each["range"]["start"]["line"] + 1, each["message"])
        for each in report["generalDiagnostics"]
        if each["severity"] == "error"
    }


def additional_errors(
    files: Collection[Path], extra_paths: Iterable[Path] = ()
) -> dict[str, list[Complaint]]:
    """Return the errors on macOS and on Windows that do not occur on Linux, by platform."""
    platforms = ("Darwin", "Windows")
    with ThreadPoolExecutor(len(platforms)) as pool:
        found = list(pool.map(partial(errors_on, files=files, extra_paths=extra_paths), platforms))
    with_errors = {Path(error.file) for errors in found for error in errors}
    on_linux = errors_on("Linux", with_errors, extra_paths) if with_errors else set()
    return {platform: sorted(errors - on_linux) for platform, errors in zip(platforms, found, strict=True)}


def main() -> int:
    folders = (SRC, *FACADES)
    files = [file for folder in folders for file in files_with_differences(folder)]
    additional = additional_errors(files, folders)
    for platform, errors in additional.items():
        print(f"{platform}: {len(errors)} errors more than on Linux, in {len(files)} files")
        for error in errors:
            print(f"  {error}")
    return int(any(additional.values()))


if __name__ == "__main__":
    sys.exit(main())
