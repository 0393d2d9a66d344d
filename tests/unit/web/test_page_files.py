"""The files of the page: unmodified third-party code, and nothing that the page's policy forbids."""

from __future__ import annotations

import hashlib
import re

import pytest

from tests.support.environments import REPOSITORY
from tests.support.page_checks import PAGES

PAGE = REPOSITORY / "src" / "pipros" / "web" / "page"
CHECKSUMS = {
    "uPlot.js": "5dd9b3281aa64b461b42d9945f6adb2649d346502b12281a9ae0d46599a80eba",
    "uPlot.css": "df630c6a8d6f8eeaff264b50f73ce5b114f646ffd9a0bb74f049b0a00135fa04",
    "uPlot.LICENSE": "8f989229699b4fe2f1a0432d0e9edc338a8a911e250e2d1b01ecd770a5f5b1bd",
}
OWN = sorted(file for file in (REPOSITORY / "src").rglob("*.js") if file.parent.name != "vendor")


@pytest.mark.parametrize("name", CHECKSUMS)
def test_third_party_code_is_unchanged(name: str) -> None:
    assert hashlib.sha256((PAGE / "vendor" / name).read_bytes()).hexdigest() == CHECKSUMS[name]


def test_third_party_code_is_listed() -> None:
    listed = (PAGE / "vendor" / "README.md").read_text()
    files = {file.name for file in (PAGE / "vendor").iterdir()} - {"README.md"}
    assert files == set(CHECKSUMS)
    assert all(f"`{name}`" in listed for name in files)


def test_the_checks_cover_all_pages() -> None:
    folders = [REPOSITORY / folder for folder in PAGES]
    assert [file for file in OWN if not any(file.is_relative_to(folder) for folder in folders)] == []


@pytest.mark.parametrize("file", OWN, ids=lambda file: file.name)
def test_text_from_the_system_is_never_markup(file: object) -> None:
    text = (PAGE / str(file)).read_text()
    forbidden = r"innerHTML|outerHTML|insertAdjacentHTML|document\.write|\beval\(|new Function"
    assert not re.search(forbidden, text)


def test_every_tab_has_a_file() -> None:
    app = (PAGE / "app.js").read_text()
    tabs = re.findall(r'^  \["(\w+)", "\w+"\],$', app, re.MULTILINE)
    parts = re.findall(r'(\w+): "\w+"', re.findall(r"^const PARTS = \{(.*)\};$", app, re.MULTILINE)[0])
    assert {file.stem for file in (PAGE / "tabs").iterdir()} == {*tabs, *parts}
