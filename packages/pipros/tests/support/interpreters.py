"""Folders that look like those of an installed Python, whose program says that it was started."""

from pathlib import Path

SAYS = '#!/bin/sh\necho "fake interpreter $*"\n'


def make_interpreter(prefix: Path, *, rospy_in: str | None = None, version: str = "3.11") -> Path:
    """Create `prefix/bin/python3`; `rospy_in` is the folder below `prefix` of its rospy."""
    name = f"python{version}"
    program = prefix / "bin" / name
    program.parent.mkdir(parents=True)
    program.write_text(SAYS)
    program.chmod(0o755)
    (prefix / "lib" / name / "site-packages").mkdir(parents=True)
    if rospy_in is not None:
        add_rospy(prefix / rospy_in)
    link = program.with_name(f"python{version[0]}")
    link.symlink_to(name)
    return link


def add_rospy(folder: Path) -> None:
    (folder / "rospy").mkdir(parents=True)
    (folder / "rospy" / "__init__.py").touch()
