"""Files that the workers of a tab share."""

from __future__ import annotations

from pathlib import Path

import pytest

from pipros_tab.files import PIECE_BYTES, SharedFiles


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "home").mkdir()
    return tmp_path / "home"


def shared(folder: Path) -> tuple[SharedFiles, list[bytes]]:
    sent: list[bytes] = []
    return SharedFiles(str(folder), sent.append), sent


def test_what_one_worker_changes_reaches_another(folder: Path) -> None:
    files, sent = shared(folder)
    (folder / "src").mkdir()
    script, large = folder / "src/talker.py", folder / "large.bag"
    script.write_text("print()\n")
    script.chmod(0o755)
    large.write_bytes(bytes(range(256)) * 500)
    files.push()
    assert len(large.read_bytes()) > 2 * PIECE_BYTES
    content = large.read_bytes()
    for path in (script, large):
        path.unlink()
    (folder / "src").rmdir()

    other, sent_back = shared(folder)
    for packet in sent:
        other.take(packet)
    assert script.read_text() == "print()\n"
    assert script.stat().st_mode & 0o777 == 0o755
    assert large.read_bytes() == content
    other.push()
    assert sent_back == []


def test_removed_files_and_folders_are_removed_elsewhere(folder: Path) -> None:
    (folder / "a").mkdir()
    (folder / "a/b").touch()
    files, sent = shared(folder)
    other, _ = shared(folder)
    (folder / "a/b").unlink()
    (folder / "a").rmdir()
    files.push()
    (folder / "a").mkdir()
    (folder / "a/b").touch()
    for packet in sent:
        other.take(packet)
    assert list(folder.iterdir()) == []


def test_bytecode_is_not_shared(folder: Path) -> None:
    files, sent = shared(folder)
    (folder / "__pycache__").mkdir()
    (folder / "__pycache__/a.pyc").touch()
    files.push()
    assert sent == []
