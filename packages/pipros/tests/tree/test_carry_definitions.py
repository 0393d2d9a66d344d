"""`script/carry-definitions` copies fields, and keeps comments that were added since."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.environments import REPOSITORY

MANIFEST = "<package><name>robot</name><version>1.2.3</version></package>"


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    """A project with only the script, and the ROS package `robot`."""
    (tmp_path / "project" / "script").mkdir(parents=True)
    shutil.copy(REPOSITORY / "script" / "carry-definitions", tmp_path / "project" / "script")
    (tmp_path / "robot" / "msg").mkdir(parents=True)
    (tmp_path / "robot" / "package.xml").write_text(MANIFEST)
    (tmp_path / "robot" / "msg" / "Arm.msg").write_text(
        "# Theirs.\n\nfloat64   x # theirs\nstring A = b # c\n"
    )
    return tmp_path


def carry(tree: Path) -> subprocess.CompletedProcess[str]:
    script = tree / "project" / "script" / "carry-definitions"
    return subprocess.run(
        [sys.executable, script, tree / "robot"], capture_output=True, text=True, check=False
    )


def carried(tree: Path) -> Path:
    return tree / "project/packages/pipros/src/pipros/share/robot/msg/Arm.msg"


def test_fields_and_constants_are_carried_without_comments(tree: Path) -> None:
    ended = carry(tree)
    assert (ended.returncode, ended.stdout) == (0, "robot: messages\n")
    assert carried(tree).read_text() == "float64 x\nstring A=b # c\n"


def test_a_package_of_a_room_stays_there(tree: Path) -> None:
    share = tree / "project/packages/pipros-robot/src/pipros/share/robot"
    share.mkdir(parents=True)

    carry(tree)

    assert (share / "msg" / "Arm.msg").is_file()
    assert not carried(tree).exists()


def test_our_comments_stay_while_the_fields_do(tree: Path) -> None:
    carry(tree)
    ours = "# Ours.\n\nfloat64 x  # ours\n# ours\nstring A=b # c\n"
    carried(tree).write_text(ours)

    assert carry(tree).returncode == 0

    assert carried(tree).read_text() == ours


def test_a_file_with_comments_whose_fields_changed_is_refused_and_nothing_is_written(tree: Path) -> None:
    carry(tree)
    ours = "# Ours.\n\nfloat32 x  # ours\nstring A=b # c\n"
    carried(tree).write_text(ours)
    (tree / "robot" / "msg" / "Added.msg").write_text("int8 y\n")

    ended = carry(tree)

    assert ended.returncode == 1
    assert f"{carried(tree)}: has comments, but its fields changed" in ended.stderr
    assert carried(tree).read_text() == ours
    assert not carried(tree).with_name("Added.msg").exists()


def test_a_file_without_comments_follows_the_original(tree: Path) -> None:
    carry(tree)
    carried(tree).write_text("float32 x\nstring A=b # c\n")

    assert carry(tree).returncode == 0

    assert carried(tree).read_text() == "float64 x\nstring A=b # c\n"
