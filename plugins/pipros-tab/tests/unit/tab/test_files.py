"""Files that the workers of a tab share."""

import zipfile
from pathlib import Path

import pytest

from pipros_tab.archives import main, pack, unpack
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


# Archives that a tab downloads and opens: what cannot be read is left out alone, and bombs are refused.


METHODS = {"odd": zipfile.ZIP_LZMA, "stored": zipfile.ZIP_STORED}
"""How files with these names are compressed."""


@pytest.fixture
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    (tmp_path / "home").mkdir()
    return tmp_path / "home"


def archive_of(home: Path, files: dict[str, bytes]) -> Path:
    """Write an archive. The content `whole` is damaged if it is stored, the method of `odd` is unknown."""
    path = home.parent / "made.zip"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as file:
        for name, content in files.items():
            file.writestr(name, content, METHODS.get(name))
    known, unknown = (b"PK\1\2\x3f\3\x3f\0\2\0" + method for method in (b"\x0e\0", b"\x63\0"))
    path.write_bytes(path.read_bytes().replace(known, unknown).replace(b"whole", b"WHOLE"))
    return path


def contents(home: Path) -> dict[str, bytes]:
    return {str(each.relative_to(home)): each.read_bytes() for each in home.rglob("*") if each.is_file()}


def test_an_entry_that_cannot_be_read_is_left_out_alone(home: Path) -> None:
    names = ("a/first", "odd", "../out", "/root", "b\\c", "d//e", "./f", "g\nh", "a/first/under", "last")
    count, left_out = unpack(home, archive_of(home, {name: name.encode() for name in names}))
    assert (count, contents(home)) == (2, {"a/first": b"a/first", "last": b"last"})
    assert [each.partition(": ")[0] for each in left_out] == list(names[1:-1])
    assert "../out: its name is refused" in left_out


def test_a_damaged_entry_is_left_out(home: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = archive_of(home, {"stored": b"whole", "last": b"6"})
    assert (main(["unpack", str(path)]), contents(home)) == (0, {"last": b"6"})
    lost = "1 are left out, such as stored: Bad CRC-32 for file 'stored'"
    assert capsys.readouterr().out == f"unpacked 1 files and folders; {lost}\n"


def test_an_archive_that_expands_too_much_is_refused(home: Path) -> None:
    path = archive_of(home, {f"zeros{number}": bytes(400_000) for number in range(3)})
    with pytest.raises(ValueError, match="the files of this archive are too large for a tab"):
        unpack(home, path, 1_000_000)
    assert contents(home) == {}


def test_a_file_that_is_not_an_archive_is_refused(home: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (home / "text").write_text("text")
    assert main(["unpack", str(home / "text")]) == 1
    assert capsys.readouterr().out == "File is not a zip file\n"


def test_files_are_packed_with_their_modes_and_without_what_is_built(home: Path) -> None:
    for name in ("ws/src/talker.py", "ws/build/made", "ws/devel/made", ".ros/log", ".bashrc"):
        (home / name).parent.mkdir(parents=True, exist_ok=True)
        (home / name).write_text(name)
    (home / "ws/src/talker.py").chmod(0o755)
    path = home / ".ros/packed.zip"
    assert pack(home, path) == (4, [])
    other = home.parent / "other"
    assert unpack(other, path) == (4, [])
    assert contents(other) == {name: name.encode() for name in ("ws/src/talker.py", ".bashrc")}
    assert (other / "ws/src/talker.py").stat().st_mode & 0o777 == 0o755
