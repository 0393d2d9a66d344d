"""Write the `pyproject.toml` that lets `pip install .` build a ROS package."""

from __future__ import annotations

from pathlib import Path

from pipros.basics.input_file import read_text
from pipros.basics.replaced_file import write_whole
from pipros_wheels.file_tree import WheelRefused

BUILD_SYSTEM = """\
[build-system]
requires = ["pipros-wheels"]
build-backend = "pipros_wheels.backend"
"""

ADVICE = (
    "pip and uv look for pipros-wheels in an index. Until it is on PyPI, first run pip wheel --wheel-dir "
    "FOLDER PATH/TO/pipros PATH/TO/pipros/plugins/pipros-wheels, then PIP_NO_INDEX=1 PIP_FIND_LINKS=FOLDER "
    "pip install . or uv pip install --no-index --find-links FOLDER ."
)
"""Advice to print as long as pipros is not on PyPI."""


def write_build_system(folder: Path) -> Path:
    """Add `BUILD_SYSTEM` to a package's `pyproject.toml`, and return the path of the file.

    Raises:
        WheelRefused: the folder is not a package, or the file already specifies another build system.
        OSError: the file cannot be written.
    """
    if not (folder / "package.xml").is_file():
        raise WheelRefused(f"{folder} has no package.xml")
    file = folder / "pyproject.toml"
    text = read_text(file) if file.exists() else ""
    if BUILD_SYSTEM not in text:
        if any(line.strip() == "[build-system]" for line in text.splitlines()):
            raise WheelRefused(f"{file} already has a [build-system]; its lines must be:\n{BUILD_SYSTEM}")
        write_whole(file, (f"{BUILD_SYSTEM}\n{text}" if text else BUILD_SYSTEM).encode())
    return file
