"""The declarations of the page's tabs, and what the browser's modules use of them."""

from __future__ import annotations

import re

from pipros_page.tabs import CONTROLS, TABS
from tests.support.environments import files_below, source

PAGE = source("pipros_page/page")
SOURCES = [
    file.read_text(encoding="utf-8") for file in files_below(PAGE, "*.js") if "vendor" not in file.parts
]


def used(function: str) -> set[str]:
    """Return the names with which the browser's modules call `watch` or `act`."""
    return {name for text in SOURCES for name in re.findall(rf'\b{function}\("(\w+)"', text)}


def test_no_name_belongs_to_two_tabs() -> None:
    names = [name for tab in TABS for name in (*tab.views, *tab.actions)]
    assert len(names) == len(set(names)) > 50


def test_what_changes_the_system_or_shows_messages_is_a_view_or_an_action() -> None:
    for tab in TABS:
        own = {*tab.views, *tab.actions}
        assert tab.changing.keys() | tab.of_messages <= own
        assert set(tab.controls.values()) <= tab.changing.keys()
    controlled = {name for tab in TABS for name in tab.controls}
    listed = set(re.findall(r'(?m)^  \["(\w+)", ', (PAGE / "sections.js").read_text(encoding="utf-8")))
    assert controlled - listed == {"reconfigure"}  # a section of the tab of parameters
    assert CONTROLS["services"] == "call_service"


def test_the_browser_asks_only_for_what_the_server_has() -> None:
    views, actions = used("watch"), used("act")
    assert len(views) > 25
    assert len(actions) > 20
    assert views - {name for tab in TABS for name in tab.views} == set()
    assert actions - {name for tab in TABS for name in tab.actions} == {"about"}
