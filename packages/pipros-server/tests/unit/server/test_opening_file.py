import webbrowser
from collections.abc import Callable
from pathlib import Path

import pytest

from pipros_server.access import Access
from pipros_server.desktop import USED_WITHIN_S, OpeningFile, folders_for_browsers, open_in_browser
from pipros_server.secret import CODE_S
from tests.support.waiting import wait_until

ADDRESS = "http://localhost:1234/#code=abc/graph"


@pytest.fixture
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setenv("DISPLAY", ":0")
    monkeypatch.delenv("XDG_CONFIG_HOME", raising=False)
    monkeypatch.delenv("PIPROS_BROWSER", raising=False)
    return tmp_path


@pytest.fixture
def opened(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The addresses that the desktop's browser got."""
    addresses: list[str] = []
    monkeypatch.setattr(webbrowser, "open", addresses.append)
    return addresses


class Later:
    """Calls functions when the test says that their time has come."""

    def __init__(self) -> None:
        self.calls: dict[float, Callable[[], None]] = {}

    def __call__(self, delay_s: float, call: Callable[[], None]) -> None:
        self.calls[delay_s] = call


def test_only_the_user_can_read_the_file(home: Path) -> None:
    file = OpeningFile(ADDRESS)
    assert (file.path.stat().st_mode & 0o777, file.path.parent.stat().st_mode & 0o777) == (0o600, 0o700)
    assert ADDRESS in file.path.read_text()
    assert file.uri == f"file://{file.path}"
    file.remove()
    file.remove()
    assert list(home.iterdir()) == []


def test_confined_browsers_can_read_the_folder(home: Path) -> None:
    (home / "Downloads").mkdir()
    file = OpeningFile(ADDRESS)
    inside = file.path.relative_to(home)
    assert inside.parts[0] == "Downloads"
    assert not any(part.startswith(".") for part in inside.parts)
    file.remove()


def test_the_desktops_folder_for_downloads_is_used(home: Path) -> None:
    (home / ".config").mkdir()
    (home / ".config" / "user-dirs.dirs").write_text('# x\nXDG_DOWNLOAD_DIR="$HOME/Téléchargements"\n')
    assert folders_for_browsers({"HOME": str(home)}) == [home]
    (home / "Téléchargements").mkdir()
    assert folders_for_browsers({"HOME": str(home)}) == [home / "Téléchargements", home]


def test_without_a_home_the_temporary_folder_is_used(tmp_path: Path) -> None:
    file = OpeningFile(ADDRESS, {})
    assert file.path.parent.stat().st_mode & 0o777 == 0o700
    file.remove()


def test_an_address_cannot_leave_its_place_in_the_page(home: Path) -> None:
    file = OpeningFile('http://localhost/#"><script>alert(1)</script>')
    assert "<script>alert" not in file.path.read_text()
    file.remove()


def test_an_address_that_is_not_used_is_printed(
    home: Path, opened: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    access, later = Access(1234), Later()
    open_in_browser(access, "localhost", "graph", later=later)
    wait_until(lambda: opened)
    assert capsys.readouterr().err == ""
    later.calls[USED_WITHIN_S]()
    printed = capsys.readouterr().err
    assert f"paste this address into one: {access.url('localhost', 'graph')}" in printed
    later.calls[CODE_S]()
    assert list(home.iterdir()) == []


def test_a_code_that_was_used_removes_the_file(
    home: Path, opened: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    access, later = Access(1234), Later()
    open_in_browser(access, "localhost", later=later)
    wait_until(lambda: opened)
    page = Path(opened[0].removeprefix("file://")).read_text()
    assert access.secret.redeem(page.partition("#code=")[2].partition('"')[0])
    later.calls[USED_WITHIN_S]()
    assert capsys.readouterr().err == ""
    assert list(home.iterdir()) == []


@pytest.mark.parametrize(
    ("variable", "value"),
    [("PIPROS_BROWSER", "off"), pytest.param("DISPLAY", "", marks=pytest.mark.needs("DISPLAY"))],
)
def test_no_page_is_opened(
    home: Path, opened: list[str], monkeypatch: pytest.MonkeyPatch, variable: str, value: str
) -> None:
    monkeypatch.setenv(variable, value)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    later = Later()
    open_in_browser(Access(1234), "localhost", later=later)
    assert (later.calls, opened, list(home.iterdir())) == ({}, [], [])
