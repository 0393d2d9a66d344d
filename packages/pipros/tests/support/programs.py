"""A package of scripts, for tests that start programs."""

from collections.abc import Mapping
from pathlib import Path


def make_programs(folder: Path, programs: Mapping[str, str]) -> Path:
    """Create the package `programs` with these executable files in `folder`, and return the folder."""
    folder.mkdir(parents=True)
    (folder / "package.xml").write_text("<package><name>programs</name></package>")
    for name, content in programs.items():
        (folder / name).write_text(content)
        (folder / name).chmod(0o755)
    return folder
