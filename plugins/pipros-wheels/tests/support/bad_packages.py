"""Packages with one fault each, to be put among good ones: tests show that only they are left out."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from tests.support.workspaces import MANIFEST, Workspace

GOOD = ("b_good", "y_good")
POSITIONS = {"first": "a_bad", "middle": "m_bad", "last": "z_bad"}

MESSAGES = (
    "find_package(catkin REQUIRED COMPONENTS message_generation std_msgs)\n"
    "add_message_files(FILES {0}.msg)\ngenerate_messages(DEPENDENCIES std_msgs)\ncatkin_package()"
)


def _cmake_error(folder: Path) -> None:
    (folder / "CMakeLists.txt").write_text(f"project({folder.name})\nmessage(FATAL_ERROR broken)\n")


def _malformed_manifest(folder: Path) -> None:
    (folder / "package.xml").write_text(f"<package><name>{folder.name}</name>")


def _empty_manifest(folder: Path) -> None:
    (folder / "package.xml").write_bytes(b"")


def _foreign_encoding(folder: Path) -> None:
    text = MANIFEST.format(name=folder.name, more="").replace("<description>d", "<description>caf\xe9")
    (folder / "package.xml").write_bytes(text.encode("latin-1"))


def _invalid_message(folder: Path) -> None:
    (folder / "msg").mkdir(exist_ok=True)
    (folder / "msg" / "Bad.msg").write_text("int8 8\n")
    head = f"cmake_minimum_required(VERSION 3.0.2)\nproject({folder.name})\n"
    (folder / "CMakeLists.txt").write_text(head + MESSAGES.format("Bad") + "\n")


def _invalid_setup(folder: Path) -> None:
    head = f"cmake_minimum_required(VERSION 3.0.2)\nproject({folder.name})\nfind_package(catkin REQUIRED)\n"
    (folder / "CMakeLists.txt").write_text(f"{head}catkin_python_setup()\ncatkin_package()\n")
    (folder / "setup.py").write_text("raise RuntimeError('broken')\n")


def _dangling_manifest(folder: Path) -> None:
    (folder / "package.xml").unlink()
    (folder / "package.xml").symlink_to("nowhere")


def _manifest_in_a_loop(folder: Path) -> None:
    (folder / "package.xml").unlink()
    (folder / "package.xml").symlink_to("package.xml")


FAULTS: dict[str, Callable[[Path], None]] = {
    "a_cmake_error": _cmake_error,
    "a_malformed_manifest": _malformed_manifest,
    "an_empty_manifest": _empty_manifest,
    "a_foreign_encoding": _foreign_encoding,
    "an_invalid_message": _invalid_message,
    "an_invalid_setup": _invalid_setup,
    "a_dangling_manifest": _dangling_manifest,
    "a_manifest_in_a_loop": _manifest_in_a_loop,
}

NO_PACKAGE = ("a_dangling_manifest", "a_manifest_in_a_loop")
"""Faults with which `rospack` finds no package in a folder."""


def write_bad_package(workspace: Workspace, fault: str, position: str) -> str:
    """Write the good packages and a bad one, whose name decides its position, and return its name."""
    bad = POSITIONS[position]
    for name in (*GOOD, bad):
        workspace.add(name, MESSAGES.format("Good"), "std_msgs message_runtime", msg__Good_dot_msg="int8 a\n")
    FAULTS[fault](workspace.base / "src" / bad)
    return bad
