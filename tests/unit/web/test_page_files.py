"""The files of the page: unmodified third-party code, and nothing that the page's policy forbids."""

# ruff: noqa: E501 # checksums

from __future__ import annotations

import base64
import hashlib
import re

import pytest

from pipros.web.server import IMPORT_MAP_HASH
from tests.support.environments import REPOSITORY
from tests.support.page_checks import PAGES

PAGE = REPOSITORY / "src" / "pipros" / "web" / "page"
CHECKSUMS = {
    "uPlot.js": "5dd9b3281aa64b461b42d9945f6adb2649d346502b12281a9ae0d46599a80eba",
    "uPlot.css": "df630c6a8d6f8eeaff264b50f73ce5b114f646ffd9a0bb74f049b0a00135fa04",
    "uPlot.LICENSE": "8f989229699b4fe2f1a0432d0e9edc338a8a911e250e2d1b01ecd770a5f5b1bd",
    "three/LICENSE": "8b378ebe60e2fe500158cb0ac71cb5e8b7d92953c2abcc63a0eb90499653b5bc",
    "three/addons/loaders/ColladaLoader.js": "539406f55a8b7aaafecb00672d0a76f9f393b81c1eacb6131b8ee9431f0d14ac",
    "three/addons/loaders/MTLLoader.js": "19ea5563d215d4b2bb4ac2f8d84a6f2cb208d0ef560c7c4946e09ac6c29a919e",
    "three/addons/loaders/OBJLoader.js": "355484026ac163fdeceececaa943b0473a2e169444015cd2209cc7d27b5b894d",
    "three/addons/loaders/STLLoader.js": "a07441b8cd812faf8049741fe5e95373b19547e4038694753dfec26fe230a7eb",
    "three/addons/loaders/TGALoader.js": "034c95f0a27380ec2ce14aa0a5eb2a937444fd90ccc95f6be58c4cf3c283a2b4",
    "three/addons/loaders/collada/ColladaComposer.js": "eb262d262790a59d3e3b3c50abc56d565f6d97a34a3979151321da73ab9846a1",
    "three/addons/loaders/collada/ColladaParser.js": "d9532ab17f1d9e2919deba8029d759d5dcaed2f21195ded9e29491f719b1a0c6",
    "three/three.core.js": "613e370f76638fdef83926642bf256dc9615684922de1ce1f63a8583e5d78578",
    "three/three.module.js": "104f56145899722094556490d787aae0617cc2fc3382f31df02d724ea1aee341",
}
OWN = sorted(file for file in (REPOSITORY / "src").rglob("*.js") if "vendor" not in file.parts)


@pytest.mark.parametrize("name", CHECKSUMS)
def test_third_party_code_is_unchanged(name: str) -> None:
    assert hashlib.sha256((PAGE / "vendor" / name).read_bytes()).hexdigest() == CHECKSUMS[name]


def test_third_party_code_is_listed() -> None:
    listed = (PAGE / "vendor" / "README.md").read_text()
    vendor = PAGE / "vendor"
    files = {file.relative_to(vendor).as_posix() for file in vendor.rglob("*") if file.is_file()} - {
        "README.md"
    }
    assert files == set(CHECKSUMS)
    assert all(f"`{name}`" in listed for name in files)


def test_the_checks_cover_all_pages() -> None:
    folders = [REPOSITORY / folder for folder in PAGES]
    assert [file for file in OWN if not any(file.is_relative_to(folder) for folder in folders)] == []


def test_the_import_map_is_the_one_that_the_policy_allows() -> None:
    text = re.findall(r'<script type="importmap">(.*?)</script>', (PAGE / "index.html").read_text())[0]
    digest = base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()
    assert f"'sha256-{digest}'" == IMPORT_MAP_HASH


def test_other_tabs_do_not_load_the_library_of_the_scene() -> None:
    importing = [file for file in OWN if re.search(r'from "three|import\("three', file.read_text())]
    assert {file.parent.name for file in importing} <= {"scene", "displays"}
    tabs = [file for file in OWN if re.search(r'from "[./]*scene/', file.read_text())]
    assert [file.name for file in tabs] == ["scene.js"]


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
