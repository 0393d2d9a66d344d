"""Features of POSIX systems, and their substitutes on other systems."""

import ntpath
import os
from pathlib import Path

import pytest

from pipros.basics.errors import NeedsPosix, PiprosError
from pipros.basics.posix import NO_LINK, READ, descriptor_limit, signal_group, user_id
from pipros.basics.windows import (
    file_url,
    is_as_written,
    path_of_url,
    relative_path,
    remove_file,
    replace_file,
    with_slashes,
)
from pipros.basics.windows_job import Job
from tests.support.without_posix import run_without_posix

WITHOUT = """
import sys
from pipros.basics import posix, terminals
from pipros.basics.errors import NeedsPosix

posix.call_in_children(lambda: None)
posix.raise_descriptor_limit(1 << 16)
posix.make_room_for_descriptors(64)
posix.give_to("/no/such/file", 1, 1)
with terminals.single_keys() as has_keys:
    print(posix.user_id(), posix.descriptor_limit(), has_keys)
for call in (lambda: posix.signal_group(2, 0), lambda: terminals.open_pty(1)):
    try:
        call()
    except NeedsPosix as error:
        print(error)
"""


def test_without_posix_each_function_has_a_harmless_result_or_an_error_of_one_line() -> None:
    assert run_without_posix(WITHOUT).splitlines() == [
        "0 8192 False",
        "a process group needs a POSIX system, but this is win32",
        "a pty needs a POSIX system, but this is win32",
    ]
    assert issubclass(NeedsPosix, PiprosError)


def test_the_user_is_the_owner_of_new_files(tmp_path: Path) -> None:
    assert user_id() == tmp_path.stat().st_uid


@pytest.mark.needs("process groups")
def test_a_group_that_does_not_exist_cannot_get_signals() -> None:
    with pytest.raises(ProcessLookupError):
        signal_group(2**22 + 1, 0)  # above the highest process id of Linux


def test_a_descriptor_below_the_limit_can_be_opened() -> None:
    descriptor = os.open(os.devnull, READ)
    os.close(descriptor)
    assert descriptor < descriptor_limit()


@pytest.mark.needs("O_NOFOLLOW")
def test_a_link_is_refused(tmp_path: Path) -> None:
    link = tmp_path / "link"
    link.symlink_to(os.devnull)
    with pytest.raises(OSError, match="symbolic links"):
        os.open(link, READ | NO_LINK)


# Windows's ways, on any system.


def test_only_paths_of_windows_get_slashes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("pipros.basics.windows.ON_WINDOWS", False)
    assert with_slashes(r"/a\b") == r"/a\b"
    monkeypatch.setattr("pipros.basics.windows.ON_WINDOWS", True)
    assert with_slashes(r"C:\ws\src") == "C:/ws/src"


@pytest.mark.parametrize(
    ("is_windows", "path", "url", "named"),
    [
        (True, "C:\\my ws", "file:///C:/my ws", "C:/my ws"),
        (False, "/a\\b", "file:///a\\b", "/a\\b"),
        (True, r"\\nas\share\ws", "file:////nas/share/ws", "//nas/share/ws"),
    ],
)
def test_a_url_names_a_file(monkeypatch, is_windows: bool, path: str, url: str, named: str) -> None:
    monkeypatch.setattr("pipros.basics.windows.ON_WINDOWS", is_windows)
    assert (file_url(path), path_of_url(url)) == (url, named)
    assert not path.startswith("\\\\") or path_of_url("file://nas/share/ws") == named  # as Windows names it


def test_a_file_is_replaced_once_other_programs_have_closed_it(tmp_path: Path, monkeypatch) -> None:
    (tmp_path / "new").write_text("new")
    rename = os.replace
    refusals = 3

    def refuse_first(source: Path, target: Path) -> None:
        nonlocal refusals
        if refusals:
            refusals -= 1
            raise PermissionError(13, "in use")
        rename(source, target)

    slept: list[float] = []
    monkeypatch.setattr("pipros.basics.windows.ON_WINDOWS", True)
    monkeypatch.setattr(os, "replace", refuse_first)
    replace_file(tmp_path / "new", tmp_path / "old", slept.append)
    assert ((tmp_path / "old").read_text(), len(slept)) == ("new", 3)


def test_a_file_that_stays_open_is_reported_after_two_seconds(tmp_path: Path, monkeypatch) -> None:
    def refuse(*_: object) -> None:
        raise PermissionError(13, "in use")

    slept: list[float] = []
    monkeypatch.setattr("pipros.basics.windows.ON_WINDOWS", True)
    monkeypatch.setattr(os, "replace", refuse)
    with pytest.raises(PermissionError, match="in use"):
        replace_file(tmp_path / "new", tmp_path / "old", slept.append)
    assert sum(slept) == pytest.approx(2)


def test_a_read_only_file_is_replaced_and_removed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    rename = os.replace

    def refuse_read_only(source: Path, target: Path) -> None:
        if not target.stat().st_mode & 0o200:
            raise PermissionError(5, "Access is denied")
        rename(source, target)

    old = tmp_path / "old"
    old.touch(0o444)
    (tmp_path / "new").write_text("new")
    monkeypatch.setattr("pipros.basics.windows.ON_WINDOWS", True)
    monkeypatch.setattr(os, "replace", refuse_read_only)
    replace_file(tmp_path / "new", old, lambda _: None)
    assert old.read_text() == "new"
    old.chmod(0o444)
    remove_file(old)
    remove_file(old)
    assert not old.exists()


def test_a_path_on_another_drive_stays_whole(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "path", ntpath)
    assert (relative_path(r"C:\ws\src\a", r"C:\ws"), relative_path(r"D:\a", r"C:\ws")) == (r"src\a", r"D:\a")


def test_a_name_in_another_case_is_not_the_one_that_is_written(tmp_path: Path, monkeypatch) -> None:
    (tmp_path / "Foo.msg").touch()
    monkeypatch.setattr("pipros.basics.windows.ON_WINDOWS", True)
    assert is_as_written(str(tmp_path / "Foo.msg"))
    assert not is_as_written(str(tmp_path / "foo.msg"))


def test_a_job_of_no_process_is_refused() -> None:
    with pytest.raises(OSError, match=r"."):
        Job(0)
